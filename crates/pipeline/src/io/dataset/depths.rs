//! The lab's depth data set: one `.pt` file a tool with all its touches, each a GelSlim with the depth of its own gel.
//!
//! | key | shape | what it is |
//! | --- | --- | --- |
//! | `tactile_image` | N x 6 x 320 x 427 | pictures of the left and the right finger, red, green, blue, 0..255 |
//! | `base_tactile_image` | 1 or N, likewise | the same without contact |
//! | `depth_images` | N x 2 x 320 x 427 | left, right: distance to the gel less that without contact, millimeters, not above 0 |
//! | `in_hand_pose` | N x 3 | `grasp_from_object`: y, z in millimeters, theta in radians |
//! | `grasp_widths` | N | distance of the two gels, millimeters |
//!
//! Source: the README of the lab's repository gelslim_depth, and its `mesh_utils/depth_from_mesh.py`, which made the depths:
//! columns lie along z, rows along y of the right finger and against it of the left one; the right finger is at positive x.
//! A file has thousands of touches, so that a pair reads its own rows.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::cad::{CAD_FOLDER, cad_files};
use super::lab::NO_TOUCH;
use super::rig_json::{RIG_JSON, rig_of};
use super::{Files, InvalidPixels, Loaded, Scan, Source, SourceKind};
use super::{colors, error, most_invalid, plausible, problem, same_name};
use crate::io::catch_panic::catch_panic;
use crate::io::error::FileError;
use crate::io::files;
use crate::io::names::is_output;
use crate::io::pt::{PtDict, read_dict, too_large};
use touch2touch_core::dataset::{PairEntry, Problem, Split};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::rig::{PadId, Rig, lab};
use touch2touch_core::sample::{ColorTouch, DepthCamera, DepthTouch, PadTouch, Sample};
use touch2touch_core::sensor::Intrinsics;
use touch2touch_core::sim::outward;

const TOUCHED: &str = "tactile_image";
const UNTOUCHED: &str = "base_tactile_image";
/// The name in the released files, and the one in the lab's scripts.
const DEPTHS: [&str; 2] = ["depth_images", "depth_image"];
const POSE: &str = "in_hand_pose";
const WIDTHS: &str = "grasp_widths";
/// One width for all touches of a tool, a line each: `tool: millimeters`.
const WIDTHS_FILE: &str = "grasp_widths.txt";

const HEIGHT: usize = lab::GELSLIM.height;
const WIDTH: usize = lab::GELSLIM.width;
const PIXELS: usize = HEIGHT * WIDTH;
const PICTURE: [usize; 3] = [6, HEIGHT, WIDTH];
const DEPTH: [usize; 3] = [2, HEIGHT, WIDTH];
/// Places of right and left finger in the files.
const PLACES: [(PadId, usize); 2] = [(lab::RIGHT, 1), (lab::LEFT, 0)];

/// Folders of the published data set, and of what its splitting script writes.
const FOLDERS: [&str; 4] = ["train_data", "validation_data", "test_data", "real_data"];
/// Ends of file names that say the part, after the tool's name.
const PARTS: [(&str, Split); 4] =
    [("_train", Split::Train), ("_val", Split::None), ("_validation", Split::None), ("_test", Split::Test)];
/// CAD models in the lab's repository.
const MESHES: &str = "mesh";
/// Most touches of a file.
const MOST_TOUCHES: usize = 1 << 20;
/// A folder of this many files of something else is one of something else.
const MOST_TRIED: usize = 256;
/// Poses are within 10 mm; where none of a file is further than this from 0, they are in meters.
const LARGEST_IN_METERS: f64 = 0.05;
/// Distance of the two gels where nobody says it, millimeters.
const ASSUMED_WIDTH_MM: f64 = 10.0;
/// Widths that a gripper can have, millimeters.
const WIDTH_RANGE_MM: std::ops::RangeInclusive<f64> = 0.1..=200.0;
/// No touch is as shallow as this, millimeters.
const LEAST_MM: f32 = -0.02;
/// Distance of the assumed camera from the gel, meters: so far that its rays are parallel to 0.01 mm, as the depths are.
const CAMERA_M: f64 = 2.0;

/// A touch: a row of a file's tensors.
#[derive(Clone, Debug)]
pub(super) struct Row {
    file: Arc<File>,
    at: usize,
}

#[derive(Clone, Debug)]
struct File {
    path: PathBuf,
    touches: usize,
    /// Width of its grasps by [`WIDTHS_FILE`], millimeters.
    width_mm: Option<f64>,
}

/// Looks for such files in `folder`, or in the folders of the published data set in it; `None` if there are none.
///
/// # Errors
/// [`FileError`] if a `rig.json` is there and does not declare a GelSlim with its depth.
pub(super) fn scan(folder: &Path) -> Result<Option<Scan>, FileError> {
    let mut found = Found::default();
    found.look(folder);
    if found.files.is_empty() && found.problems.is_empty() {
        FOLDERS.iter().for_each(|name| found.look(&folder.join(name)));
    }
    if found.folders.is_empty() {
        return Ok(None);
    }
    let root = match folder.parent() {
        Some(above) if folder.file_name().is_some_and(|name| FOLDERS.iter().any(|known| name == *known)) => above,
        _ => folder,
    };
    let rig = rig(root)?;
    Ok(Some(found.end(root, rig)))
}

/// The rig that a [`RIG_JSON`] declares, such as one of another scale, or the lab's.
fn rig(root: &Path) -> Result<Arc<Rig>, FileError> {
    let declared = rig_of(root)?;
    if *declared == *Rig::lab() {
        return Ok(Arc::new(lab::depth_rig()));
    }
    let sensors =
        [declared.color(), declared.depth()].map(|sensor| sensor.is_some_and(|s| s.size() == [WIDTH, HEIGHT]));
    if declared.is_gel() && sensors == [true, true] && declared.pads.len() == 2 {
        return Ok(declared);
    }
    let why = format!(
        "{RIG_JSON} declares other sensors than the .pt files hold: a color sensor and the depth sensor {:?} of {WIDTH} x \
         {HEIGHT} pixels each, on two pads",
        lab::GELSLIM_DEPTH.key
    );
    Err(error::bad_rig(&root.join(RIG_JSON), why))
}

#[derive(Default)]
struct Found {
    files: Vec<File>,
    folders: Vec<PathBuf>,
    pairs: Vec<(PairEntry, (usize, usize))>,
    problems: Vec<Problem>,
}

impl Found {
    fn look(&mut self, folder: &Path) {
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        paths.retain(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let stem = name.len().checked_sub(3).and_then(|at| name.split_at_checked(at));
            let stem = stem.filter(|(_, end)| end.eq_ignore_ascii_case(".pt")).map(|(stem, _)| stem);
            !name.starts_with('.') && !is_output(&name) && stem.is_some_and(|stem| !NO_TOUCH.contains(&stem))
        });
        paths.sort();
        // The first file that can be read and is of either kind says what kind of folder it is.
        let opened = || paths.iter().take(MOST_TRIED).filter_map(|path| catch_panic(|| read_dict(path)).ok()?.ok());
        if !opened().find(|rows| rows.has(TOUCHED) || rows.has("gelslim")).is_some_and(|rows| rows.has(TOUCHED)) {
            return;
        }
        self.folders.push(folder.to_owned());
        for path in paths {
            let read = catch_panic(|| touches(&read_dict(&path)?));
            let failed = |message: String| Err(error::bug(std::slice::from_ref(&path), &message));
            match read.unwrap_or_else(failed) {
                Ok(touches) => self.add(path, touches),
                Err(err) => self.problems.push(err.to_problem()),
            }
        }
    }

    fn add(&mut self, path: PathBuf, touches: usize) {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if let Some(first) = self.files.iter().find(|file| file.path.file_stem() == path.file_stem()) {
            self.problems.push(same_name(path.clone(), &stem, &first.path));
            return;
        }
        let part = PARTS.iter().find_map(|(end, split)| Some((stem.strip_suffix(end)?, *split)));
        let (tool, split) = part.unwrap_or((&stem, Split::None));
        let at = self.files.len();
        self.pairs.extend((0..touches).map(|row| {
            let name = format!("{stem}/data_{row}");
            (PairEntry { name, tool: Some(tool.to_owned()), split, number: row as u64 }, (at, row))
        }));
        self.files.push(File { path, touches, width_mm: None });
    }

    fn end(mut self, root: &Path, rig: Arc<Rig>) -> Scan {
        self.pairs
            .sort_by(|(a, _), (b, _)| (&a.tool, a.split as u8, a.number).cmp(&(&b.tool, b.split as u8, b.number)));
        let (pairs, rows): (Vec<PairEntry>, Vec<_>) = self.pairs.into_iter().unzip();
        let widths = files::read_to_string(&root.join(WIDTHS_FILE), files::SMALL).unwrap_or_default();
        let widths: BTreeMap<&str, f64> = widths
            .lines()
            .filter_map(|line| line.split_once(':'))
            .filter_map(|(tool, width)| Some((tool.trim(), width.trim().parse().ok()?)))
            .collect();
        for (entry, (file, _)) in pairs.iter().zip(&rows) {
            self.files[*file].width_mm = entry.tool.as_deref().and_then(|tool| widths.get(tool).copied());
        }
        let places = [root.join(CAD_FOLDER), root.join(MESHES)].into_iter();
        let above = root.parent().into_iter().flat_map(|above| [above.join(CAD_FOLDER), above.join(MESHES)]);
        let tools = pairs.iter().filter_map(|pair| pair.tool.as_deref());
        let meshes = cad_files(root, places.chain(above).collect(), tools, |_| false, &mut self.problems);
        let shared: Vec<Arc<File>> = self.files.into_iter().map(Arc::new).collect();
        let files = rows.into_iter().map(|(file, at)| Files::Row(Row { file: shared[file].clone(), at })).collect();
        let (root, kind) = (root.to_owned(), SourceKind::Lab);
        let (problems, folders, source) = (self.problems, self.folders, Source::Depths);
        Scan { root, pairs, problems, files, folders, meshes, source, kind, rig }
    }
}

/// The key of the depths, where there are any.
fn depths_key(rows: &PtDict) -> Option<&'static str> {
    DEPTHS.into_iter().find(|key| rows.has(key))
}

/// The number of touches in a file, after every shape in it was checked.
fn touches(rows: &PtDict) -> Result<usize, FileError> {
    let shape = rows.shape(TOUCHED).unwrap_or_default();
    let touches = shape.first().copied().unwrap_or(0).min(MOST_TOUCHES + 1);
    if touches > MOST_TOUCHES {
        let reason = format!("\"{TOUCHED}\" has the shape {shape:?}; at most {MOST_TOUCHES} touches are read");
        return Err(too_large(rows.file(), &reason));
    }
    rows.check(TOUCHED, touches, &PICTURE)?;
    if let Some(key) = depths_key(rows) {
        rows.check(key, touches, &DEPTH)?;
    }
    for (key, shape) in [(UNTOUCHED, &PICTURE[..]), (POSE, &[3])] {
        if rows.has(key) {
            rows.check(key, touches, shape)?;
        }
    }
    Ok(touches)
}

impl Row {
    pub(super) fn path(&self) -> &Path {
        &self.file.path
    }

    pub(super) fn load(&self, rig: &Arc<Rig>) -> Result<Loaded, FileError> {
        let (file, at) = (&self.file, self.at);
        let px_per_m = rig.depth().map_or(lab::GELSLIM_DEPTH.px_per_m, |sensor| sensor.px_per_m);
        let rows = read_dict(&file.path)?;
        let mut notes = Vec::new();
        let of = file.touches;
        let colors = both_colors(&rows, at, of, &mut notes)?;
        let depths = match depths_key(&rows) {
            Some(key) => Some((key, rows.row(key, at, of, &DEPTH)?.into_f32())),
            None => {
                let what = format!("no key \"{}\": there is no measured imprint", DEPTHS[0]);
                notes.push(problem(rows.file(), what, "save the depths with the pictures if the truth is wanted"));
                None
            }
        };
        let half_m = 0.5e-3 * self.width_mm(&rows, &mut notes);
        let mut invalid = [InvalidPixels::default(); 2];
        let mut pads = [PadTouch::default(), PadTouch::default()];
        for ((pad, place), color) in PLACES.into_iter().zip(colors) {
            let touch = &mut pads[pad.index()];
            if let (Some(color), Some(sensor)) = (color, rig.first(lab::GELSLIM.kind)) {
                touch.set(sensor, color);
            }
            let (Some((key, depths)), Some(sensor)) = (&depths, rig.first(lab::GELSLIM_DEPTH.kind)) else {
                continue;
            };
            let values = &depths[place * PIXELS..][..PIXELS];
            let imprint = imprint(values, &mut invalid[pad.index()]);
            let name = rig.pad_key(pad);
            most_invalid(rows.file(), invalid[pad.index()].total(), PIXELS, || format!("pixels of the {name} depth"))?;
            if values.iter().any(|v| *v > 0.0) && !values.iter().any(|v| *v < 0.0) {
                let what =
                    format!("key \"{key}\", {name} finger: the depths are positive, so that nothing is pushed in");
                notes.push(problem(rows.file(), what, "store the distance as the lab does, negative where pushed in"));
            }
            let deepest = values.iter().copied().fold(0f32, f32::min);
            if deepest < 0.0 && deepest > LEAST_MM {
                let what = format!("key \"{key}\", {name} finger: nothing is deeper than {} mm: meters?", -deepest);
                notes.push(problem(rows.file(), what, "store depths in millimeters"));
            }
            let camera = Some(camera(pad, half_m, px_per_m));
            touch.set(sensor, DepthTouch { imprint, camera, truth: None });
        }
        let grasp_from_object = pose(&rows, at, of, &mut notes)?;
        let sample =
            Sample { rig: rig.clone(), pads: pads.map(Some).into(), grasp_from_object, notes, ..Sample::default() };
        let mut loaded = Loaded { sample, invalid: invalid.map(Some).into() };
        plausible::notes(&mut loaded, rows.file(), depths.map_or(DEPTHS[0], |(key, _)| key), false);
        Ok(loaded)
    }

    /// Distance of the gels in a touch, millimeters.
    fn width_mm(&self, rows: &PtDict, notes: &mut Vec<Problem>) -> f64 {
        let own = || {
            let values = rows.tensor(WIDTHS).ok()?.into_f32();
            values.get(if values.len() == 1 { 0 } else { self.at }).map(|width| f64::from(*width))
        };
        let width = own().or(self.file.width_mm).filter(|width| WIDTH_RANGE_MM.contains(width));
        width.unwrap_or_else(|| {
            let what = format!("no width of the grasp: the gels are taken to be {ASSUMED_WIDTH_MM} mm apart");
            let hint = format!("save \"{WIDTHS}\" in millimeters, or write {WIDTHS_FILE} with a line `tool: width`");
            notes.push(problem(rows.file(), what, hint));
            ASSUMED_WIDTH_MM
        })
    }
}

/// The pictures of the right and the left finger.
fn both_colors(
    rows: &PtDict,
    at: usize,
    of: usize,
    notes: &mut Vec<Problem>,
) -> Result<[Option<ColorTouch>; 2], FileError> {
    let raw = rows.row(TOUCHED, at, of, &PICTURE)?.into_f32();
    if !rows.has(UNTOUCHED) {
        let what = format!("no key \"{UNTOUCHED}\": there is no GelSlim difference");
        notes.push(problem(rows.file(), what, "save the picture without contact beside the others"));
        return Ok([None, None]);
    }
    let reference = rows.row(UNTOUCHED, at, of, &PICTURE)?.into_f32();
    let touches =
        colors::touches(rows.file(), [TOUCHED, UNTOUCHED], [raw, reference], PLACES.map(|(_, place)| place), notes)?;
    Ok(touches.map(Some))
}

/// Meters that the gel is pushed in, from the file's millimeters.
fn imprint(depths_mm: &[f32], invalid: &mut InvalidPixels) -> DepthMap {
    let meters = depths_mm.iter().map(|&depth| {
        if depth.is_nan() {
            invalid.nan += 1;
        } else if depth.is_infinite() {
            invalid.infinite += 1;
        }
        // Without a minus before 0.
        if depth.is_finite() { 0.0 - depth * 1e-3 } else { f32::NAN }
    });
    let meters = meters.collect();
    Grid::from_vec(WIDTH, HEIGHT, meters).unwrap_or_else(|_| Grid::filled(WIDTH, HEIGHT, f32::NAN))
}

/// A camera behind the gel whose rays are as good as parallel: the depths lie over the plane of the gel pixel by pixel.
fn camera(pad: PadId, half_m: f64, px_per_m: f64) -> DepthCamera {
    let o = outward(pad);
    // columns: where the picture's right, down and forward point in the grasp frame
    let rotation = DMat3::from_cols(DVec3::Z, DVec3::new(0.0, -o, 0.0), DVec3::new(o, 0.0, 0.0));
    let focal = px_per_m * CAMERA_M;
    DepthCamera {
        depth_reference: Grid::filled(WIDTH, HEIGHT, CAMERA_M as f32),
        intrinsics: Intrinsics { fx: focal, fy: focal, cx: 0.5 * WIDTH as f64, cy: 0.5 * HEIGHT as f64 },
        crop: lab::GELSLIM_DEPTH.crop,
        grasp_from_camera: DAffine3 { matrix3: rotation, translation: DVec3::new(-o * (half_m + CAMERA_M), 0.0, 0.0) },
    }
}

/// The camera over the gel of a finger whose grasp's width is not known.
pub(super) fn assumed_camera(rig: &Rig, finger: PadId) -> Option<DepthCamera> {
    let sensor = rig.depth().filter(|sensor| sensor.size() == [WIDTH, HEIGHT])?;
    Some(camera(finger, 0.5e-3 * ASSUMED_WIDTH_MM, sensor.px_per_m))
}

/// The true pose of a touch, where the file says one.
fn pose(rows: &PtDict, at: usize, of: usize, notes: &mut Vec<Problem>) -> Result<Option<PlanarPose>, FileError> {
    if !rows.has(POSE) {
        let what = format!("no key \"{POSE}\": this file has no true pose");
        notes.push(problem(rows.file(), what, "save the poses if angle errors are wanted"));
        return Ok(None);
    }
    let row = rows.row(POSE, at, of, &[3])?.into_f64();
    let [y, z, theta_rad] = row[..] else { return Ok(None) };
    if !row.iter().all(|v| v.is_finite()) {
        let what = format!("key \"{POSE}\", row {at} is {row:?}: it is not a true pose");
        notes.push(problem(rows.file(), what, "write the file again"));
        return Ok(None);
    }
    // The lab's page says millimeters, its scripts take meters.
    let all = rows.tensor(POSE)?.into_f64();
    let far = all.chunks_exact(3).flat_map(|pose| &pose[..2]).fold(0f64, |far, v| far.max(v.abs()));
    let to_m = if far > LARGEST_IN_METERS { 1e-3 } else { 1.0 };
    Ok(Some(PlanarPose { theta_rad, y_m: y * to_m, z_m: z * to_m }))
}

#[cfg(test)]
mod tests;
