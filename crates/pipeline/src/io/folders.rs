//! The user's folders for this program, by the rules of the platform.

use std::path::{Path, PathBuf};

const NAME: &str = "touch2touch";

/// Settings.
pub fn config() -> Option<PathBuf> {
    Some(dirs::config_dir()?.join(NAME))
}

/// Labels: what follows the user to other machines where the platform does that.
pub fn data() -> Option<PathBuf> {
    Some(dirs::data_dir()?.join(NAME))
}

/// Folder for data of this machine, such as libraries and bundles; `TOUCH2TOUCH_DATA` overrides it. `None` without a
/// home folder.
pub(crate) fn program_data() -> Option<PathBuf> {
    let named = std::env::var_os("TOUCH2TOUCH_DATA").filter(|v| !v.is_empty()).map(PathBuf::from);
    named.or_else(|| Some(dirs::data_local_dir()?.join(NAME)))
}

/// Folder for data that can be made again; `TOUCH2TOUCH_CACHE` overrides it.
pub fn program_cache() -> Option<PathBuf> {
    let named = std::env::var_os("TOUCH2TOUCH_CACHE").map(PathBuf::from).filter(|p| p.is_absolute());
    named.or_else(|| Some(dirs::cache_dir()?.join(NAME)))
}

/// The user's pictures; made if it is not there. `None` without a home folder, or where it cannot be made.
pub fn pictures() -> Option<PathBuf> {
    let folder = dirs::picture_dir().or_else(|| Some(dirs::home_dir()?.join(NAME)))?;
    std::fs::create_dir_all(&folder).ok().map(|()| folder)
}

/// The folders in which this computer's fonts lie, the user's own first.
pub(crate) fn fonts() -> Vec<PathBuf> {
    let own = [dirs::font_dir(), dirs::home_dir().map(|home| home.join(".fonts"))];
    let shared = std::env::var_os("XDG_DATA_DIRS").filter(|dirs| !dirs.is_empty());
    let shared = shared.unwrap_or_else(|| "/usr/local/share:/usr/share".into());
    let of_system = ["/System/Library/Fonts", "/Library/Fonts", "C:\\Windows\\Fonts"].map(PathBuf::from);
    let shared: Vec<PathBuf> = std::env::split_paths(&shared).map(|folder| folder.join("fonts")).collect();
    let mut all: Vec<PathBuf> = own.into_iter().flatten().chain(shared).chain(of_system).collect();
    all.retain(|folder| folder.is_dir());
    all
}

/// Asks the system to show a file's folder, or a folder, in its own window; returns at once.
///
/// # Errors
/// If the place is not there any more, or the system has no program for it.
pub fn reveal(place: &Path) -> std::io::Result<()> {
    let program = if cfg!(windows) {
        "explorer"
    } else if cfg!(target_os = "macos") {
        "open"
    } else {
        "xdg-open"
    };
    let folder = if place.is_dir() { place } else { place.parent().unwrap_or(place) };
    // A path that begins with a dash is no option.
    let folder = std::fs::canonicalize(folder)?;
    let null = std::process::Stdio::null;
    let mut shown =
        std::process::Command::new(program).arg(folder).stdin(null()).stdout(null()).stderr(null()).spawn()?;
    // Waited for, so that nothing of it is left behind; by nobody else, because it may stay open.
    std::thread::Builder::new().name("reveal".into()).spawn(move || shown.wait().ok()).map(drop)
}
