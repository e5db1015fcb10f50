//! The new bundle: the source's graphs, the fit, and a manifest that says from what it was made.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::json;

use super::WHAT;
use crate::error::TaskError;
use crate::infer::bundle::{Bundle, FileEntry, FitSpec, Role, write_fit};
use crate::io::digest::sha256;
use crate::io::files;
use crate::io::staging::Claim;
use crate::learn::new_bundle;
use crate::steps::bundles::BundleInfo;
use touch2touch_core::fit::{FitSource, Fitted};
use touch2touch_core::rig::Rig;
use touch2touch_core::units::counted;

/// The pictures of the fit in the new bundle.
const FIT_FILE: &str = "fit.npz";

/// Keeps a folder for the new bundle, before anything is computed: no other fit into it goes on meanwhile. A fit may be
/// made again.
pub(super) fn claim(out: &Path, from: &BundleInfo) -> Result<Claim, TaskError> {
    let claim = new_bundle::claim(WHAT, out)?;
    new_bundle::check_folder(WHAT, out, from, |bundle| bundle.fit().is_some())?;
    Ok(claim)
}

/// A fit to other data that a bundle in this folder is, in words.
pub(super) fn of_other_data(out: &Path, source: &FitSource) -> Option<String> {
    let bundle = Bundle::open(out).ok()?;
    let there = &bundle.fit()?.source;
    let pairs = counted(there.pairs.len(), "pair");
    (!there.same_data(source))
        .then(|| format!("{} holds a fit to other data: {pairs} of {}", out.display(), there.data))
}

/// A fit with all that its bundle is written from.
#[derive(Clone, Debug)]
pub struct Unwritten {
    pub(super) out: PathBuf,
    pub(super) from: BundleInfo,
    pub(super) rig: Arc<Rig>,
    pub(super) fitted: Fitted,
    pub(super) graphs: BTreeMap<Role, Vec<u8>>,
}

impl Unwritten {
    /// Writes the bundle; its folder.
    pub(super) fn write(&self) -> Result<PathBuf, TaskError> {
        let Self { out, from, rig, fitted, graphs } = self;
        new_bundle::write(WHAT, out, from, graphs, |folder, manifest| {
            let pads: Vec<String> = rig.pads().map(|pad| rig.pad_key(pad).into_owned()).collect();
            let file = folder.join(FIT_FILE);
            write_fit(&file, &pads, fitted).map_err(|err| TaskError::from_error(WHAT, &err))?;
            let bytes = files::read(&file, files::SMALL)
                .map_err(|err| TaskError::new(WHAT, format!("cannot be read: {err} ({})", file.display())))?;
            let entry = FileEntry { path: FIT_FILE.into(), sha256: sha256(&bytes) };
            let spec = FitSpec { file: entry, pads, source: fitted.source.clone() };
            manifest["fit"] = json!(spec);
            manifest["name"] = json!(format!("{}, fitted to {}", fitted.source.from, fitted.source.data));
            Ok(())
        })?;
        Ok(out.clone())
    }

    /// [`Unwritten::write`] of a fit whose folder is not kept any more.
    pub(super) fn write_late(&self) -> Result<PathBuf, TaskError> {
        let _claim = claim(&self.out, &self.from)?;
        self.write()
    }
}
