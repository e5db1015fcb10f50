//! A bundle made from another one: where it may lie ([`check_folder`]), and how it is written ([`write()`]).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::error::TaskError;
use crate::infer::bundle::{Bundle, MANIFEST, Role};
use crate::io::digest::sha256;
use crate::io::staging::{self, Claim, Staging};
use crate::io::{atomic, files, folders};
use crate::steps::bundles::BundleInfo;

/// Folder of the models that were made with the program, which looks for them at its start; `None` without a folder for
/// such files.
pub fn models_folder() -> Option<PathBuf> {
    folders::program_data().map(|folder| folder.join("models"))
}

fn unwritable(what: &str, file: &Path, err: std::io::Error) -> TaskError {
    TaskError::new(what, format!("cannot be written: {err} ({})", file.display()))
}

/// Place of a new bundle, with the folders above it made and swept.
fn place(what: &str, out: &Path) -> Result<PathBuf, TaskError> {
    let place = std::path::absolute(out).map_err(|err| unwritable(what, out, err))?;
    let parent = place.parent().unwrap_or(&place);
    std::fs::create_dir_all(parent).map_err(|err| unwritable(what, parent, err))?;
    staging::sweep(parent);
    Ok(place)
}

/// Keeps a folder for a bundle that is to be made, until the answer is dropped.
pub(crate) fn claim(what: &str, out: &Path) -> Result<Claim, TaskError> {
    let place = place(what, out)?;
    Claim::of(&place).map_err(|err| unwritable(what, out, err))?.ok_or_else(|| {
        TaskError::new(what, format!("a bundle is being made in {} already", out.display()))
            .with_hint("Wait for the other run, or name another folder.")
    })
}

/// That a folder may become the new bundle: it is not there, is empty, or holds a bundle that `replaceable` gives up;
/// never the source.
pub(crate) fn check_folder(
    what: &str,
    out: &Path,
    from: &BundleInfo,
    replaceable: impl Fn(&Bundle) -> bool,
) -> Result<(), TaskError> {
    let fail = |why: String| Err(TaskError::new(what, why).with_hint("Name a new folder."));
    let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    };
    if same(out, &from.origin.path()) {
        return fail(format!("{} is the bundle that it is made from, which stays as it is", out.display()));
    }
    if out.is_file() {
        return fail(format!("{} is a file", out.display()));
    }
    let empty = !std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some());
    let replaced = || Bundle::open(out).is_ok_and(|bundle| replaceable(&bundle));
    if empty || replaced() { Ok(()) } else { fail(format!("{} holds other files", out.display())) }
}

/// Writes a bundle: the graphs of `from`, with others in place of some of them, and its manifest as `change` makes it, which
/// may add files to the folder that it is given. Made and opened beside `out` first: a kill leaves no part of a bundle there.
pub(crate) fn write(
    what: &str,
    out: &Path,
    from: &BundleInfo,
    graphs: &BTreeMap<Role, Vec<u8>>,
    change: impl FnOnce(&Path, &mut Value) -> Result<(), TaskError>,
) -> Result<(), TaskError> {
    let source = from.open(what)?;
    let io = |file: &Path, err| unwritable(what, file, err);
    let place = place(what, out)?;
    let staging = Staging::new(&place).map_err(|err| io(&place, err))?;
    let folder = staging.new_content();
    std::fs::create_dir(&folder).map_err(|err| io(&folder, err))?;
    let read = |name: &str| {
        let file = source.origin().file(name);
        file.read(files::MODEL)
            .map_err(|err| TaskError::new(what, format!("cannot be read: {err} ({})", file.path().display())))
    };
    let text = read(MANIFEST)?;
    let mut manifest: Value = serde_json::from_slice(&text).map_err(|err| TaskError::new(what, err))?;
    for (role, _) in source.files() {
        let name = manifest["files"][role.key()]["path"].as_str().unwrap_or_default().to_owned();
        let file = folder.join(&name);
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
    change(&folder, &mut manifest)?;
    let manifest_file = folder.join(MANIFEST);
    let text = serde_json::to_string_pretty(&manifest).map_err(|err| TaskError::new(what, err))?;
    atomic::write_bytes(&manifest_file, text.as_bytes()).map_err(|err| io(&manifest_file, err))?;
    // What was written is what will be read.
    Bundle::open(&folder).map_err(|err| TaskError::from_error(what, &err))?;
    staging.put(&place).map_err(|err| io(out, err))
}
