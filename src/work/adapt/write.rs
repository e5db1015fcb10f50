//! The new bundle: the source's graphs, the fit, and a manifest that says from what it was made.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};

use super::WHAT;
use crate::domain::fit::Fitted;
use crate::domain::rig::Rig;
use crate::infer::bundle::{Bundle, FileEntry, FitSpec, MANIFEST, Role, write_fit};
use crate::io::digest::sha256;
use crate::io::{atomic, files};
use crate::work::bundles::BundleInfo;
use crate::work::error::TaskError;

/// The pictures of the fit in the new bundle.
const FIT_FILE: &str = "fit.npz";

/// That a folder may become the new bundle: it is not there, is empty, or holds a bundle that was fitted before; never
/// the source.
pub(super) fn check_folder(out: &Path, from: &BundleInfo) -> Result<(), TaskError> {
    let fail = |why: String| Err(TaskError::new(WHAT, why).with_hint("Name a new folder."));
    let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    };
    if same(out, &from.origin.path()) {
        return fail(format!("{} is the bundle that is fitted, which stays as it is", out.display()));
    }
    if out.is_file() {
        return fail(format!("{} is a file", out.display()));
    }
    let empty = !std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some());
    let fitted = Bundle::open(out).is_ok_and(|bundle| bundle.fit().is_some());
    if empty || fitted { Ok(()) } else { fail(format!("{} holds other files", out.display())) }
}

/// Writes the bundle; the manifest last, so that a folder without one is no bundle.
pub(super) fn bundle<'a>(
    out: &'a Path,
    from: &BundleInfo,
    rig: &Rig,
    fitted: &Fitted,
    graphs: &BTreeMap<Role, Vec<u8>>,
) -> Result<&'a Path, TaskError> {
    let source = from.open(WHAT)?;
    let io = |file: &Path, err: std::io::Error| {
        TaskError::new(WHAT, format!("cannot be written: {err} ({})", file.display()))
    };
    std::fs::create_dir_all(out).map_err(|err| io(out, err))?;
    let manifest_file = out.join(MANIFEST);
    if manifest_file.exists() {
        std::fs::remove_file(&manifest_file).map_err(|err| io(&manifest_file, err))?;
    }
    let read = |name: &str| {
        let file = source.origin().file(name);
        file.read(files::MODEL)
            .map_err(|err| TaskError::new(WHAT, format!("cannot be read: {err} ({})", file.path().display())))
    };
    let text = read(MANIFEST)?;
    let mut manifest: Value = serde_json::from_slice(&text).map_err(|err| TaskError::new(WHAT, err))?;
    for (role, _) in source.files() {
        let name = manifest["files"][role.key()]["path"].as_str().unwrap_or_default().to_owned();
        let file = out.join(&name);
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder).map_err(|err| io(folder, err))?;
        }
        if let Some(tuned) = graphs.get(&role) {
            atomic::write_bytes(&file, tuned).map_err(|err| io(&file, err))?;
            manifest["files"][role.key()]["sha256"] = json!(sha256(tuned));
        } else {
            atomic::write_bytes(&file, &read(&name)?).map_err(|err| io(&file, err))?;
        }
    }
    let pads: Vec<String> = rig.pads().map(|pad| rig.pad_key(pad).into_owned()).collect();
    let file = out.join(FIT_FILE);
    write_fit(&file, &pads, fitted).map_err(|err| TaskError::from_error(WHAT, &err))?;
    let bytes = std::fs::read(&file).map_err(|err| io(&file, err))?;
    let entry = FileEntry { path: FIT_FILE.into(), sha256: sha256(&bytes) };
    let spec = FitSpec { file: entry, pads, source: fitted.source.clone() };
    manifest["fit"] = json!(spec);
    manifest["name"] = json!(format!("{}, fitted to {}", fitted.source.from, fitted.source.data));
    let text = serde_json::to_string_pretty(&manifest).map_err(|err| TaskError::new(WHAT, err))?;
    atomic::write_bytes(&manifest_file, text.as_bytes()).map_err(|err| io(&manifest_file, err))?;
    // What was written is what will be read.
    Bundle::open(out).map_err(|err| TaskError::from_error(WHAT, &err))?;
    Ok(out)
}
