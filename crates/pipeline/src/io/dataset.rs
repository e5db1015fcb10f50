//! [`Dataset`]: one index over the kinds of source. Opening reads names only; samples load one by one.
//!
//! * the lab's folders of `.pt` files (the submodule `lab`), and its depth data set (the submodule `depths`),
//! * a folder of pictures `NAME_gelslim.png`, with or without `NAME_bubble.png`, or of camera images `NAME_touch.png`
//!   with `NAME_reference.png` (the submodule `pictures`),
//! * the built-in data sets (the demo and the test sets), rendered by the simulator.
//!
//! A [`Dataset`] never changes after opening and can be shared with worker threads.

mod built_in;
mod cad;
mod colors;
mod depths;
mod error;
mod grow;
mod lab;
mod other;
mod pictures;
mod plausible;
mod read_as;
mod rig_json;
mod tool_scale;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use touch2touch_core::align::Prior;
use touch2touch_core::dataset::{Index, PairEntry, PairId, Problem};
use touch2touch_core::grid::Grid;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::mesh::sampling::spread;
use touch2touch_core::read_as::ReadAs;
use touch2touch_core::rig::{PerPad, Rig};
use touch2touch_core::sample::{DepthCamera, Sample};
use touch2touch_core::turn::Turn;

use super::catch_panic::catch_panic;
use super::dataset_location::DatasetLocation;
use super::error::{FileError, FileErrorKind};

pub use built_in::BuiltIn;
pub(crate) use pictures::{ASSUMED_IMPRINT_RANGE_M, assumed_meters, imprint_from_tile};
pub use read_as::{READ_AS_FILE, write_read_as};
pub use rig_json::{RIG_JSON, rig_of};
pub(crate) use tool_scale::ToolFile;
pub use tool_scale::{ToolScale, ToolUnit, UNIT_FILE, read_in_meters};
pub(crate) use tool_scale::{read_tool, said_beside, tool_size, write_beside};

/// Kind of source that a data set comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SourceKind {
    /// The lab's folders of `.pt` files.
    Lab,
    /// A folder of pictures: no pose, no camera, assumed scale.
    Pictures,
    /// The built-in simulator: the demo or a test set.
    Demo,
}

/// A sample with what is invalid in its files.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The sample; its notes say what is odd: values that are not numbers, missing keys that it can do without, halves
    /// that disagree, numbers that cannot be those of a touch.
    pub sample: Sample,
    /// Pixels of each finger's imprint that are no measurement; they are NaN in the sample.
    pub invalid: PerPad<InvalidPixels>,
}

/// A larger share of an imprint's pixels without measurement than this is worth a note of its own, because every depth
/// camera drops some.
const MANY_INVALID: f64 = 0.02;
/// A larger share of an image that is no measurement than this leaves nothing to answer from.
const MOST_INVALID: f64 = 0.5;

/// Poses of a data set, spread over it, that must lie in the lab's grid for others to be expected there.
const POSES_SEEN: usize = 12;

/// Why pixels of an imprint are no measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InvalidPixels {
    /// NaN in the file.
    pub nan: usize,
    /// Infinite in the file.
    pub infinite: usize,
    /// At depth 0, which is how a depth camera says "nothing measured".
    pub dropped: usize,
}

impl InvalidPixels {
    /// All of them.
    pub fn total(self) -> usize {
        self.nan + self.infinite + self.dropped
    }

    /// True where there are so many that they are worth a note of their own: more than a depth camera drops anyway.
    pub(crate) fn are_many(self, pixels: usize) -> bool {
        self.infinite > 0 || self.total() as f64 > MANY_INVALID * pixels as f64
    }
}

/// An opened source of paired touches.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Title for people.
    pub title: String,
    /// Root folder, the same for every sub-folder that the data set was opened from; `None` for one that is built in.
    pub root: Option<PathBuf>,
    /// That folder as it was opened.
    pub location: Option<DatasetLocation>,
    /// The kind of source.
    pub kind: SourceKind,
    /// Names of all pairs in natural order.
    pub index: Index,
    /// Faults of the data set, as far as names and folders tell.
    pub problems: Vec<Problem>,
    /// Unit of the CAD files' numbers; without it, the one that [`UNIT_FILE`] beside them names, else meters.
    pub tool_scale: Option<ToolScale>,
    /// The sensors that its touches were felt with.
    pub rig: Arc<Rig>,
    /// Ways in which it is read otherwise than it is stored.
    read_as: Vec<ReadAs>,
    source: Source,
    /// Of each pair, in the order of the index; none of what is built in.
    files: Vec<Files>,
    /// The folders whose content decides which pairs there are.
    folders: Vec<PathBuf>,
    /// The CAD models by tool.
    meshes: BTreeMap<String, PathBuf>,
    /// The depth cameras of the rig, for touches that come without a depth picture; read when first needed.
    cameras: OnceLock<PerPad<Arc<DepthCamera>>>,
    /// The units of CAD models that were named for this run only, by tool.
    held_units: Arc<Mutex<BTreeMap<String, ToolUnit>>>,
    /// True where the poses that the lab's files give lie in the lab's grid; looked up when first needed.
    in_lab_grid: OnceLock<bool>,
}

#[derive(Clone, Debug)]
enum Source {
    /// `flat`: the touches lie directly in one folder, as a robot may write them.
    Lab {
        flat: bool,
    },
    Depths,
    Pictures,
    BuiltIn(BuiltIn),
}

/// The files of a pair.
#[derive(Clone, Debug)]
enum Files {
    Lab(lab::PairFiles),
    Row(depths::Row),
    Pictures(pictures::Touch),
}

impl Files {
    fn list(&self) -> Vec<PathBuf> {
        match self {
            Self::Lab(lab) => [&lab.gelslim, &lab.bubble].into_iter().flatten().cloned().collect(),
            Self::Row(row) => vec![row.path().to_owned()],
            Self::Pictures(touch) => touch.list(),
        }
    }
}

/// Findings of a scan, before they become a [`Dataset`].
struct Scan {
    root: PathBuf,
    pairs: Vec<PairEntry>,
    problems: Vec<Problem>,
    files: Vec<Files>,
    folders: Vec<PathBuf>,
    meshes: BTreeMap<String, PathBuf>,
    source: Source,
    kind: SourceKind,
    rig: Arc<Rig>,
}

impl Dataset {
    /// Opens the lab's folders or a folder of pictures, whichever `path` holds. Reads names only.
    ///
    /// If nothing has that path, the name of a built-in data set ([`BuiltIn`]) opens that one.
    ///
    /// `path` may be the data set's root, the folder above its `data` folder, any folder inside it, or a file in it.
    ///
    /// # Errors
    /// [`FileError`] if nothing can be opened at all; everything smaller is listed in [`Dataset::problems`].
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let io = |err| error::no_folder(path, err);
        if let Some(built_in) = path.to_str().and_then(BuiltIn::named).filter(|_| !path.exists()) {
            return Ok(Self::built_in(built_in));
        }
        // Absolute, so that masks are found again from every working directory.
        let absolute = path.canonicalize().map_err(io)?;
        let folder = if absolute.is_dir() { absolute.as_path() } else { absolute.parent().unwrap_or(&absolute) };
        let folder = folder.to_owned();
        drop(std::fs::read_dir(&folder).map_err(io)?);
        let found = match lab::scan(&folder) {
            Some(scan) => Some(scan),
            None => match pictures::scan(&folder)? {
                Some(scan) => Some(scan),
                None => match depths::scan(&folder)?.or_else(|| lab::scan_flat(&folder)) {
                    Some(scan) => Some(scan),
                    None => pictures::scan_folders(&folder)?,
                },
            },
        };
        let mut scan = found.ok_or_else(|| error::nothing_found(path, other::kind(&absolute, &folder)))?;
        let declared = if scan.kind == SourceKind::Lab { rig_of(&scan.root)? } else { scan.rig.clone() };
        if (Rig { camera_tolerance: scan.rig.camera_tolerance, ..(*declared).clone() }) == *scan.rig {
            scan.rig = declared;
        } else if *scan.rig == *Rig::lab() {
            let what = format!("{RIG_JSON} declares other sensors, but .pt files are always read as the lab's");
            scan.problems.push(problem(scan.root.join(RIG_JSON), what, "remove it, or save the touches as pictures"));
        }
        let read_as = read_as::of(&scan.root)?;
        Ok(Self::of(scan).reading(read_as))
    }

    fn of(scan: Scan) -> Self {
        let Scan { root, pairs, mut problems, files, folders, meshes, source, kind, rig } = scan;
        problems.extend(super::simulated::unfinished(&root));
        let title = root.file_name().map_or_else(|| "dataset".into(), |n| n.to_string_lossy().into_owned());
        let (location, root) = (DatasetLocation::at(&root), Some(root));
        Self { root, location, problems, files, folders, meshes, ..Self::of_pairs(title, kind, pairs, source, rig) }
    }

    /// Without files.
    fn of_pairs(title: String, kind: SourceKind, pairs: Vec<PairEntry>, source: Source, rig: Arc<Rig>) -> Self {
        Self {
            title,
            root: None,
            location: None,
            kind,
            index: Index { pairs },
            problems: Vec::new(),
            tool_scale: None,
            rig,
            read_as: Vec::new(),
            source,
            files: Vec::new(),
            folders: Vec::new(),
            meshes: BTreeMap::new(),
            cameras: OnceLock::new(),
            held_units: Arc::default(),
            in_lab_grid: OnceLock::new(),
        }
    }

    /// The built-in demo: simulated grasps of the simulator's tools, rendered one by one when they are asked for.
    pub fn demo() -> Self {
        Self::built_in(BuiltIn::Demo)
    }

    /// A built-in data set. Nothing is rendered yet.
    pub fn built_in(set: BuiltIn) -> Self {
        Self::of_pairs(set.title(), SourceKind::Demo, set.pairs(), Source::BuiltIn(set), Rig::lab())
    }

    /// Loads a pair. Takes tens of milliseconds: not for the thread that draws.
    ///
    /// Pixels without measurement are NaN in the imprint, also where the file has infinities or the camera said 0.
    /// Oddities of the files and implausible values in them are in the sample's notes.
    ///
    /// # Errors
    /// [`FileError`] naming the file, and for tensors the key.
    pub fn load(&self, id: PairId) -> Result<Sample, FileError> {
        self.load_with_counts(id).map(|loaded| loaded.sample)
    }

    /// [`Dataset::load`] for a small picture: a simulated pair has the first finger's bubble alone, unless it is read otherwise.
    ///
    /// # Errors
    /// As [`Dataset::load`].
    pub fn load_first_bubble(&self, id: PairId) -> Result<Sample, FileError> {
        self.read(id, self.read_as.is_empty()).map(|loaded| loaded.sample)
    }

    /// [`Dataset::load`], together with how many pixels are invalid.
    ///
    /// # Errors
    /// As [`Dataset::load`].
    pub fn load_with_counts(&self, id: PairId) -> Result<Loaded, FileError> {
        self.read(id, false)
    }

    /// Of a simulated pair the first finger's bubble `alone`, where that is asked for.
    fn read(&self, id: PairId, alone: bool) -> Result<Loaded, FileError> {
        if self.index.get(id).is_none() {
            return Err(error::no_such_pair(id));
        }
        self.catch_panic(id, || {
            let mut loaded = match (&self.source, self.files.get(id.0 as usize)) {
                (Source::BuiltIn(set), _) => set.load(id, alone).map(|sample| Loaded { sample, ..Loaded::default() }),
                (_, Some(Files::Lab(halves))) => Some(self.load_lab(halves)?),
                (_, Some(Files::Row(row))) => Some(row.load(&self.rig)?),
                (_, Some(Files::Pictures(touch))) => Some(touch.load(&self.rig)?),
                (_, None) => None,
            }
            .ok_or_else(|| error::no_such_pair(id))?;
            self.read_otherwise(&mut loaded.sample);
            if matches!(self.source, Source::Depths | Source::BuiltIn(_)) {
                return Ok(loaded);
            }
            let file = self.pair_files(id).pop().unwrap_or_default();
            plausible::notes(&mut loaded, &file, "bubble_imprint", true);
            self.lend_cameras(&mut loaded.sample);
            Ok(loaded)
        })
    }

    fn load_lab(&self, halves: &lab::PairFiles) -> Result<Loaded, FileError> {
        let mut loaded = halves.load(&self.rig)?;
        loaded.sample.in_lab_grid = *self.in_lab_grid.get_or_init(|| {
            let pose = |i: usize| match &self.files[i] {
                Files::Lab(halves) => halves.pose(),
                _ => None,
            };
            let poses: Vec<_> = spread(self.files.len(), POSES_SEEN).into_iter().filter_map(pose).collect();
            poses.len() == POSES_SEEN && poses.into_iter().all(|pose| Prior::default().allows(pose))
        });
        Ok(loaded)
    }

    /// Reads something of a pair. A panic is that pair's error: no file may end a run over others.
    fn catch_panic<T>(&self, id: PairId, read: impl FnOnce() -> Result<T, FileError>) -> Result<T, FileError> {
        catch_panic(read).unwrap_or_else(|message| Err(error::bug(&self.pair_files(id), &message)))
    }

    /// The tool's CAD model in meters and the object frame; `None` where the data set has none.
    ///
    /// # Errors
    /// [`FileError`] if there is a file that cannot be used, or whose size cannot be meters.
    pub fn tool_mesh(&self, tool: &str) -> Result<Option<TriMesh>, FileError> {
        Ok(self.tool_with_notes(tool)?.map(|file| file.mesh))
    }

    /// [`Dataset::tool_mesh`], together with what is odd about the file.
    ///
    /// # Errors
    /// As [`Dataset::tool_mesh`].
    pub(crate) fn tool_with_notes(&self, tool: &str) -> Result<Option<ToolFile>, FileError> {
        let mut file = match (self.tool_mesh_file(tool), &self.source) {
            (Some(path), _) => read_tool(path, self.scale_of(tool)).map(Some),
            (None, Source::Lab { .. } | Source::Depths) => Ok(None),
            (None, Source::Pictures | Source::BuiltIn(_)) => {
                Ok(built_in::mesh(tool).map(|mesh| ToolFile { mesh, notes: Vec::new() }))
            }
        }?;
        if let Some(ToolFile { mesh, .. }) = &mut file {
            self.cad_axes().for_each(|axes| *mesh = axes.apply(mesh));
        }
        Ok(file)
    }

    /// Unit that was set for a tool's CAD file other than beside it: for this run, else on the command line.
    pub(crate) fn scale_of(&self, tool: &str) -> Option<ToolScale> {
        let held = self.held_units.lock().unwrap_or_else(PoisonError::into_inner);
        held.get(tool).map(|unit| unit.scale()).or(self.tool_scale)
    }

    /// Reads a tool's CAD file in this unit as long as the data set is open: for folders that cannot be written.
    pub fn hold_unit(&self, tool: &str, unit: ToolUnit) {
        self.held_units.lock().unwrap_or_else(PoisonError::into_inner).insert(tool.to_owned(), unit);
    }

    /// The file of the tool's CAD model, if the source has files.
    pub fn tool_mesh_file(&self, tool: &str) -> Option<&Path> {
        self.meshes.get(tool).map(PathBuf::as_path)
    }

    /// The files of a pair (GelSlim, then bubble), as far as they exist.
    pub fn pair_files(&self, id: PairId) -> Vec<PathBuf> {
        self.files.get(id.0 as usize).map_or_else(Vec::new, Files::list)
    }

    /// The bubble picture on its own pixels (0..255, rotated by 180 degrees), laid upright from how the pair's pictures lay
    /// ([`touch2touch_core::sample::Sample::laid`]); `None` for other sources.
    ///
    /// # Errors
    /// As [`Dataset::load`].
    pub fn bubble_tile(&self, id: PairId, laid: Turn) -> Result<Option<Grid<f32>>, FileError> {
        let Some(Files::Pictures(touch)) = self.files.get(id.0 as usize) else { return Ok(None) };
        self.catch_panic(id, || {
            let tile = touch.tile(&self.rig, pictures::BUBBLE, laid)?;
            Ok(tile.map(|tile| self.lays().fold(tile, |tile, lay| lay.apply(&tile))))
        })
    }

    /// The lab's own VQ-VAE prediction for the pair, from the file `NAME_vqvae.png`, as [`Dataset::bubble_tile`]; `None`
    /// where there is none.
    ///
    /// # Errors
    /// As [`Dataset::load`].
    pub fn vqvae_tile(&self, id: PairId, laid: Turn) -> Result<Option<Grid<f32>>, FileError> {
        let Some(Files::Pictures(touch)) = self.files.get(id.0 as usize) else { return Ok(None) };
        self.catch_panic(id, || touch.tile(&self.rig, pictures::VQVAE, laid))
    }

    /// True where the GelSlim picture of a pair was cut off at black or white; `None` for other sources.
    ///
    /// # Errors
    /// As [`Dataset::load`].
    pub fn gelslim_is_clipped(&self, id: PairId) -> Result<Option<bool>, FileError> {
        let Some(Files::Pictures(touch)) = self.files.get(id.0 as usize) else { return Ok(None) };
        self.catch_panic(id, || touch.is_clipped())
    }
}

/// The last run of digits in `text`; the lab's order of files. Numbers too large to hold come last.
fn last_integer(text: &str) -> u64 {
    let Some(end) = text.rfind(|c: char| c.is_ascii_digit()) else { return 0 };
    let start = text[..=end]
        .rfind(|c: char| !c.is_ascii_digit())
        .map_or(0, |i| i + text[i..].chars().next().map_or(1, char::len_utf8));
    text[start..=end].parse().unwrap_or(u64::MAX)
}

/// Refuses an image of which more than half (`bad` of `all`) is no measurement; `what` names it.
fn most_invalid(file: &Path, bad: usize, all: usize, what: impl FnOnce() -> String) -> Result<(), FileError> {
    let share = bad as f64 / all.max(1) as f64;
    if share > MOST_INVALID {
        let (percent, what) = (100.0 * share, what());
        let what =
            format!("{percent:.0} % of the {what} have no measurement (NaN, infinite or depth 0): too few are left");
        let hint = "record the grasp again, or remove the file";
        return Err(FileError::new(file, what, hint).of_kind(FileErrorKind::Content));
    }
    Ok(())
}

/// Start of the text of a problem that leaves a file out.
const SAME_NAME: &str = "same name";

/// Of two files that would be one pair: `file` is left out.
fn same_name(file: PathBuf, name: &str, first: &Path) -> Problem {
    problem(
        file,
        format!("{SAME_NAME} ({name}) as {}", first.display()),
        "rename or remove one of the two; the first is used",
    )
}

fn problem(file: impl Into<PathBuf>, what: impl Into<String>, hint: impl Into<String>) -> Problem {
    Problem { file: file.into(), what: what.into(), hint: hint.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_on_a_pair_is_that_pairs_error() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a_gelslim.png");
        std::fs::write(&file, b"").unwrap();
        let dataset = Dataset::open(dir.path()).unwrap();
        let error =
            dataset.catch_panic(PairId(0), || -> Result<(), FileError> { panic!("the depth is {}", 3) }).unwrap_err();
        let problem = error.to_problem();
        assert!(
            problem.what.contains("a bug: the depth is 3") && problem.what.contains("a_gelslim.png"),
            "{problem:?}"
        );
        assert_eq!(problem.file, dir.path().canonicalize().unwrap().join("a_gelslim.png"));
        assert!(dataset.load(PairId(0)).is_err_and(|err| !err.what.contains("a bug")));
    }
}
