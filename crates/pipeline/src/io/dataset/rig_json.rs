//! The sensors that a folder declares: [`rig_of`].

use std::path::Path;
use std::sync::Arc;

use super::error::bad_rig;
use crate::io::error::FileError;
use crate::io::files;
use touch2touch_core::rig::Rig;

/// The file in a folder that says which sensors its touches were felt with.
pub const RIG_JSON: &str = "rig.json";

/// The sensors that a folder declares in its [`RIG_JSON`], else the lab's.
///
/// # Errors
/// [`FileError`] if the file is there and cannot be read or declares no rig.
pub fn rig_of(folder: &Path) -> Result<Arc<Rig>, FileError> {
    let path = folder.join(RIG_JSON);
    // A link that leads nowhere is there.
    if path.symlink_metadata().is_err_and(|err| err.kind() == std::io::ErrorKind::NotFound) {
        return Ok(Rig::lab());
    }
    let rig = match files::read(&path, files::SMALL) {
        Ok(text) => Rig::parse(&text).map_err(|why| format!("{RIG_JSON} does not declare a rig: {why}")),
        Err(err) => Err(format!("{RIG_JSON} cannot be read: {err}")),
    };
    rig.map(Arc::new).map_err(|why| bad_rig(&path, why))
}
