//! Finds bundles on this machine.

use std::path::{Path, PathBuf};

use super::{Bundle, MANIFEST};
use crate::domain::dataset::Problem;
use crate::infer::runtime::data_dir;

/// The folder with more bundles, if the user has one.
const MODELS_VARIABLE: &str = "TOUCH2TOUCH_MODELS";

/// Bundles and what was wrong with the others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Usable, in the order of the roots and then of the folder names; each hash once.
    pub bundles: Vec<Bundle>,
    /// What kept the others from being used.
    pub problems: Vec<Problem>,
}

/// Where bundles are looked for: `TOUCH2TOUCH_MODELS`, `assets/models` beside the program, the application's data
/// folder, and `assets/models` of the source tree the program was built in.
pub fn default_roots() -> Vec<PathBuf> {
    let beside = std::env::current_exe().ok().and_then(|exe| Some(exe.parent()?.join("assets/models")));
    let candidates = [
        std::env::var_os(MODELS_VARIABLE).map(PathBuf::from),
        beside,
        data_dir().map(|dir| dir.join("models")),
        Some(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models")),
    ];
    candidates.into_iter().flatten().collect()
}

/// Opens every bundle directly inside `roots` (a root may itself be a bundle). Absent roots are skipped.
pub fn find(roots: &[PathBuf]) -> Found {
    let mut found = Found::default();
    for root in roots {
        let mut dirs: Vec<PathBuf> = match std::fs::read_dir(root) {
            Ok(entries) => entries.filter_map(|entry| Some(entry.ok()?.path())).collect(),
            Err(_) => continue,
        };
        dirs.sort();
        dirs.insert(0, root.clone());
        for dir in dirs.iter().filter(|dir| dir.join(MANIFEST).is_file()) {
            match Bundle::open(dir) {
                Ok(bundle) if found.bundles.iter().all(|b| b.hash() != bundle.hash()) => found.bundles.push(bundle),
                Ok(_) => {}
                Err(mut err) => found.problems.append(&mut err.problems),
            }
        }
    }
    found
}
