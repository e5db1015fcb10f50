//! The files of a result. Each is written whole or not at all, and the JSON last: where it is, the others are.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value, json};

use touch2touch_core::dataset::Problem;
use touch2touch_core::grid::Mask;
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::follow::Stamp;
use touch2touch_pipeline::io::names::OUTPUT_MARK;
use touch2touch_pipeline::io::pt::Tensor;
use touch2touch_pipeline::io::{atomic, files, images, names, npz};
use touch2touch_pipeline::steps::mask::Contact;

/// File of a touch when it was done: with the same numbers and the same recipe it need not be done again.
pub(super) fn source(file: &Path, stamp: Stamp) -> Value {
    let name = file.file_name().map(|name| name.to_string_lossy());
    json!({"file": name, "bytes": stamp.bytes, "modified_ns": stamp.modified_ns()})
}

/// `stem` with the mark of an output and an ending.
fn output(stem: &Path, ending: &str) -> PathBuf {
    names::with_ending(stem, &format!("{OUTPUT_MARK}{ending}"))
}

/// True where the touch was done before: same file, same recipe, no error.
pub(super) fn is_done(stem: &Path, source: &Value, recipe: &Value) -> bool {
    let Ok(text) = files::read(&output(stem, "json"), files::SMALL) else { return false };
    let Ok(before) = serde_json::from_slice::<Value>(&text) else { return false };
    before["error"].is_null() && before["source"] == *source && before["recipe"] == *recipe
}

/// Writes imprints (meters, height x width) and masks as one `.npz`, and a 16-bit picture of each imprint (0.001 mm steps
/// from -20 mm).
pub(super) fn predictions(stem: &Path, rig: &Rig, contact: &Contact) -> anyhow::Result<Vec<String>> {
    let bits = |mask: &Mask| mask.as_slice().iter().map(|&m| u8::from(m)).collect::<Vec<u8>>();
    let (mut files, mut arrays) = (vec![output(stem, "npz")], Vec::new());
    for (pad, imprint) in contact.imprints.entries() {
        let Some(found) = &contact.masks[pad] else { continue };
        let (name, shape) = (rig.pad_key(pad), [imprint.height(), imprint.width()]);
        arrays.push((format!("imprint_{name}"), Tensor::f32(&shape, imprint.as_slice().to_vec())));
        arrays.push((format!("mask_{name}"), Tensor::u8(&shape, bits(&found.mask))));
        let picture = output(stem, &format!("{name}.png"));
        images::write_depth16(&picture, imprint)?;
        files.push(picture);
    }
    let arrays: Vec<(&str, Tensor)> = arrays.iter().map(|(name, t)| (name.as_str(), t.clone())).collect();
    npz::write(&files[0], &arrays)?;
    let name = |file: &PathBuf| file.file_name().map(|n| n.to_string_lossy().into_owned());
    Ok(files.iter().filter_map(name).collect())
}

/// Writes the JSON of a result.
pub(super) fn result(stem: &Path, value: &impl Serialize) -> anyhow::Result<()> {
    Ok(atomic::write_json(&output(stem, "json"), "cannot write the result", value)?)
}

/// Writes the JSON that says why there is no result.
pub(super) fn failure(stem: &Path, source: &Value, recipe: &Value, problem: &Problem) -> anyhow::Result<()> {
    let value = json!({"source": source, "recipe": recipe, "error": {"what": problem.what, "hint": problem.hint}});
    result(stem, &value)
}
