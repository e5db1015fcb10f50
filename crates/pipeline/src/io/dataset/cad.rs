//! CAD files of a data set's tools: [`cad_files`].

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use touch2touch_core::dataset::Problem;

use super::problem;

/// The folder of CAD models in a data set.
pub(super) const CAD_FOLDER: &str = "tools_stls";

/// The CAD models in `folders` by tool name, the first folder's first; tools without one, that are not `known` otherwise, are
/// listed once.
pub(super) fn cad_files<'t>(
    root: &Path,
    folders: Vec<PathBuf>,
    tools: impl Iterator<Item = &'t str>,
    known: impl Fn(&str) -> bool,
    problems: &mut Vec<Problem>,
) -> BTreeMap<String, PathBuf> {
    let mut meshes = BTreeMap::new();
    for folder in folders {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let mut models: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        models.retain(|path| path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("stl")));
        // Small letters first, whatever order the folder has.
        models.sort_by(|a, b| b.cmp(a));
        for path in models {
            let Some(stem) = path.file_stem() else { continue };
            let first = meshes.entry(stem.to_string_lossy().into_owned()).or_insert_with(|| path.clone());
            if *first != path && first.parent() == path.parent() {
                let used = first.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let what = format!("a second CAD model of the same name: {used} is used");
                problems.push(problem(path, what, "delete or rename the one that is not the tool's"));
            }
        }
    }
    for tool in tools.collect::<BTreeSet<_>>() {
        if !meshes.contains_key(tool) && !known(tool) {
            problems.push(problem(
                root.join(CAD_FOLDER).join(format!("{tool}.stl")),
                format!("the CAD model of {tool} is missing: its pose cannot be estimated"),
                "add the STL in meters, named like the tool",
            ));
        }
    }
    meshes
}
