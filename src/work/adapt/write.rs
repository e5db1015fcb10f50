//! The new bundle: the source's graphs, the fit, and a manifest that says from what it was made.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::json;

use super::WHAT;
use crate::domain::fit::Fitted;
use crate::domain::rig::Rig;
use crate::infer::bundle::{FileEntry, FitSpec, Role, write_fit};
use crate::io::digest::sha256;
use crate::work::bundles::BundleInfo;
use crate::work::error::TaskError;
use crate::work::new_bundle;

/// The pictures of the fit in the new bundle.
const FIT_FILE: &str = "fit.npz";

/// That a folder may become the new bundle: a fit may be made again.
pub(super) fn check_folder(out: &Path, from: &BundleInfo) -> Result<(), TaskError> {
    new_bundle::check_folder(WHAT, out, from, |bundle| bundle.fit().is_some())
}

/// Writes the bundle.
pub(super) fn bundle<'a>(
    out: &'a Path,
    from: &BundleInfo,
    rig: &Rig,
    fitted: &Fitted,
    graphs: &BTreeMap<Role, Vec<u8>>,
) -> Result<&'a Path, TaskError> {
    new_bundle::write(WHAT, out, from, graphs, |folder, manifest| {
        let pads: Vec<String> = rig.pads().map(|pad| rig.pad_key(pad).into_owned()).collect();
        let file = folder.join(FIT_FILE);
        write_fit(&file, &pads, fitted).map_err(|err| TaskError::from_error(WHAT, &err))?;
        let bytes = std::fs::read(&file)
            .map_err(|err| TaskError::new(WHAT, format!("cannot be read: {err} ({})", file.display())))?;
        let entry = FileEntry { path: FIT_FILE.into(), sha256: sha256(&bytes) };
        let spec = FitSpec { file: entry, pads, source: fitted.source.clone() };
        manifest["fit"] = json!(spec);
        manifest["name"] = json!(format!("{}, fitted to {}", fitted.source.from, fitted.source.data));
        Ok(())
    })?;
    Ok(out)
}
