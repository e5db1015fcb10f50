//! What several test modules need.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The folder with real and reference data that only some machines have: `TOUCH2TOUCH_SHARED`, else `../shared`
/// beside the checkout. `None` (with a note) where it is absent: the product's tests pass without it.
pub(crate) fn shared() -> Option<PathBuf> {
    let path = std::env::var_os("TOUCH2TOUCH_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("no reference data at {}: this part of the test is left out", path.display());
    None
}

/// Whether a missing GPU, model runtime or window is a failure instead of a reason to leave a test out.
/// The check script sets it, so that nothing is skipped unnoticed.
pub(crate) fn require(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|v| v != "0" && !v.is_empty())
}

/// Runs the program; `data` stands for all folders of the user.
pub(crate) fn run(args: &[&str], data: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touch2touch"))
        .args(args)
        // Nothing of the user's may be read or written by a test.
        .env("TOUCH2TOUCH_DATA", data)
        .env("XDG_DATA_HOME", data)
        .env("XDG_CONFIG_HOME", data)
        .env("TOUCH2TOUCH_CACHE", data)
        .output()
        .unwrap()
}
