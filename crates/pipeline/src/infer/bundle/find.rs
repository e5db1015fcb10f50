//! Finds bundles on this machine and in the program.

use std::path::{Path, PathBuf};

use super::{Bundle, MANIFEST, Origin};
use crate::io::folders;
use touch2touch_core::dataset::Problem;

/// The folder with more bundles, if the user has one.
const MODELS_VARIABLE: &str = "TOUCH2TOUCH_MODELS";

/// Bundles and what was wrong with the others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Usable, in the order of the places and then of the folder names; those of one identity and name once.
    pub bundles: Vec<Bundle>,
    /// Faults that kept the others from being used.
    pub problems: Vec<Problem>,
}

/// All bundles there are: those of `TOUCH2TOUCH_MODELS`, of `assets/models` beside the program and of the application's
/// data folder, then those inside the program, then those of the folders `more`.
///
/// The source tree is none of the places: what a program finds must not hang on where it was once built, and what
/// ships there is inside the program.
pub fn find_all(more: &[PathBuf]) -> Found {
    let beside = std::env::current_exe().ok().and_then(|exe| Some(exe.parent()?.join("assets/models")));
    let named = std::env::var_os(MODELS_VARIABLE).map(PathBuf::from);
    let folders = [named, beside, folders::program_data().map(|dir| dir.join("models"))];
    let mut found = find(&folders.into_iter().flatten().collect::<Vec<_>>());
    for origin in Origin::built_in() {
        found.open(&origin);
    }
    for folder in more {
        found.look_into(folder);
    }
    found
}

/// Opens every bundle directly inside `folders` (which may be bundles themselves). Absent folders are skipped.
pub fn find(folders: &[PathBuf]) -> Found {
    let mut found = Found::default();
    for folder in folders {
        found.look_into(folder);
    }
    found
}

impl Found {
    fn look_into(&mut self, folder: &Path) {
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        let mut dirs: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        dirs.sort();
        dirs.insert(0, folder.to_owned());
        for dir in dirs.iter().filter(|dir| dir.join(MANIFEST).is_file()) {
            self.open(&dir.into());
        }
    }

    fn open(&mut self, origin: &Origin) {
        match Bundle::open(origin) {
            Ok(bundle) if self.bundles.iter().all(|b| (b.hash(), b.name()) != (bundle.hash(), bundle.name())) => {
                self.bundles.push(bundle)
            }
            Ok(_) => {}
            Err(mut err) => self.problems.append(&mut err.problems),
        }
    }
}
