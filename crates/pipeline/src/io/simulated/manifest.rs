//! Manifest of a simulated data set: that it was begun, what was asked for, and, last of all, that it is whole.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Layout, make_parent, write_models, write_pair, write_split};
use crate::io::error::FileError;
use crate::io::{atomic, files};
use touch2touch_core::dataset::Problem;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::sample::Sample;

/// The manifest's name, in the root of the data set.
pub const MANIFEST: &str = "simulated.json";
const FORMAT: &str = "touch2touch-simulated";
const VERSION: u32 = 1;
/// No manifest is larger.
const MOST_BYTES: u64 = 1 << 20;

#[derive(Debug, Serialize, Deserialize)]
struct Manifest {
    format: String,
    version: u32,
    /// Tools, the same for all parts: they share the CAD models.
    tools: Vec<String>,
    /// By layout.
    parts: BTreeMap<String, Part>,
}

#[derive(Debug, Serialize, Deserialize)]
struct Part {
    /// True once all of it was written.
    finished: bool,
    pairs: usize,
    /// Recipe that was asked for.
    recipe: Value,
}

/// A data set that is being written: [`Writing::begin`], the pairs, [`Writing::finish`].
#[derive(Debug)]
pub struct Writing {
    root: PathBuf,
    layout: Layout,
    tools: Vec<(String, bool)>,
    manifest: Manifest,
}

impl Writing {
    /// Says in the folder what is being written there, and writes the CAD models. The folder must be missing, empty, or
    /// hold what an earlier, perhaps unfinished run with the same recipe wrote; another layout of the same tools may
    /// lie beside.
    ///
    /// # Errors
    /// [`FileError`] if the folder holds anything else, which is then unchanged.
    pub fn begin(
        root: &Path,
        layout: Layout,
        tools: &[(&str, bool, TriMesh)],
        pairs: usize,
        recipe: Value,
    ) -> Result<Self, FileError> {
        let names: Vec<String> = tools.iter().map(|tool| tool.0.to_owned()).collect();
        let key: &str = layout.into();
        let mut manifest = match read(root) {
            None => {
                if let Some(found) = first_entry(root)? {
                    return Err(not_ours(root, &found));
                }
                Manifest { format: FORMAT.into(), version: VERSION, tools: names, parts: BTreeMap::new() }
            }
            Some(manifest) => {
                let same = manifest.parts.get(key).is_none_or(|part| part.recipe == recipe && part.pairs == pairs);
                if !same || manifest.tools != names {
                    return Err(not_ours(root, "a simulated data set of other tools, grasps or seeds"));
                }
                manifest
            }
        };
        manifest.parts.insert(key.to_owned(), Part { finished: false, pairs, recipe });
        let tools_seen = tools.iter().map(|(name, seen, _)| ((*name).to_owned(), *seen)).collect();
        let writing = Self { root: root.to_owned(), layout, tools: tools_seen, manifest };
        writing.write()?;
        write_models(root, tools)?;
        Ok(writing)
    }

    /// Writes both halves of a pair, as [`write_pair`].
    ///
    /// # Errors
    /// As there.
    pub fn pair(&self, tool: &str, index: u64, sample: &Sample) -> Result<(), FileError> {
        write_pair(&self.root, self.layout, tool, index, sample).map(drop)
    }

    /// Says that all pairs are there.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn finish(mut self) -> Result<(), FileError> {
        write_split(&self.root, self.tools.iter().map(|(name, seen)| (name.as_str(), *seen)))?;
        if let Some(part) = self.manifest.parts.get_mut::<str>(self.layout.into()) {
            part.finished = true;
        }
        self.write()
    }

    fn write(&self) -> Result<(), FileError> {
        let file = self.root.join(MANIFEST);
        make_parent(&file)?;
        atomic::write_json(&file, "cannot write the manifest", &self.manifest)
    }
}

fn not_ours(root: &Path, found: &str) -> FileError {
    let what = format!("the folder holds {found}, which was not written by the same command");
    FileError::new(root, format!("{what}; choose a new folder"), "choose a new folder")
}

/// The manifest in `root`; `None` if there is none that this program understands.
fn read(root: &Path) -> Option<Manifest> {
    let file = root.join(MANIFEST);
    // A pipe or a device of that name must not hold anybody up.
    let text = files::read(&file, MOST_BYTES).ok()?;
    let manifest: Manifest = serde_json::from_slice(&text).ok()?;
    (manifest.format == FORMAT && manifest.version == VERSION).then_some(manifest)
}

/// Something that lies in the folder, if it is there and not empty. Hidden files do not count.
fn first_entry(root: &Path) -> Result<Option<String>, FileError> {
    let failed = |err| FileError::io(root, "cannot list the folder", err);
    let entries = match std::fs::read_dir(root) {
        Ok(entries) => entries,
        Err(err) if err.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(failed(source)),
    };
    let mut names = Vec::new();
    for entry in entries {
        names.push(entry.map_err(failed)?.file_name().to_string_lossy().into_owned());
    }
    Ok(names.into_iter().filter(|name| !name.starts_with('.')).min())
}

/// Problem of a data set whose simulation did not end.
pub fn unfinished(root: &Path) -> Option<Problem> {
    let parts = read(root)?.parts;
    let open: Vec<String> =
        parts.iter().filter(|(_, p)| !p.finished).map(|(k, p)| format!("{k} ({})", p.pairs)).collect();
    (!open.is_empty()).then(|| Problem {
        file: root.join(MANIFEST),
        what: format!("the simulation that writes this data set was not finished; pairs meant: {}", open.join(", ")),
        hint: "run the same `touch2touch simulate` again into this folder, or remove the folder".into(),
    })
}
