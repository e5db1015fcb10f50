//! The files of a result. Each is written whole or not at all, and the JSON last: where it is, the others are.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;
use serde_json::{Value, json};

use super::Source;
use touch2touch_core::dataset::Problem;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::rig::{Rig, Text};
use touch2touch_pipeline::io::names::OUTPUT_MARK;
use touch2touch_pipeline::io::pt::{PtItem, Tensor};
use touch2touch_pipeline::io::{atomic, files, images, names, npz, pt};
use touch2touch_pipeline::steps::mask::Contact;

/// A form of the prediction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Save {
    /// `imprint_right`, `imprint_left` (meters, f32, height x width), `mask_right`, `mask_left` (0 or 1).
    Npz,
    /// One picture per finger.
    Png,
    /// `prediction` (meters, fingers x 1 x height x width), `mask`, `fingers`.
    Pt,
}

/// `stem` with the mark of an output and an ending.
fn output(stem: &Path, ending: &str) -> PathBuf {
    names::with_ending(stem, &format!("{OUTPUT_MARK}{ending}"))
}

/// True where the touch was done before: same file, same recipe, no error.
pub(super) fn is_done(stem: &Path, source: &Source, recipe: &Value) -> bool {
    let Ok(text) = files::read(&output(stem, "json"), files::SMALL) else { return false };
    let Ok(before) = serde_json::from_slice::<Value>(&text) else { return false };
    before["error"].is_null() && before["source"] == json!(source) && before["recipe"] == *recipe
}

/// Writes imprints and masks.
pub(super) fn predictions(stem: &Path, rig: &Rig, contact: &Contact, save: &[Save]) -> anyhow::Result<Vec<String>> {
    let mut files = Vec::new();
    let bits = |mask: &Mask| mask.as_slice().iter().map(|&m| u8::from(m)).collect::<Vec<u8>>();
    let fingers: Vec<(Text, &DepthMap, &Mask)> = contact
        .imprints
        .entries()
        .filter_map(|(pad, imprint)| Some((rig.pad_key(pad), imprint, &contact.masks[pad].as_ref()?.mask)))
        .collect();
    if save.contains(&Save::Npz) {
        let mut arrays: Vec<(String, Tensor)> = Vec::new();
        for (name, imprint, mask) in &fingers {
            let shape = [imprint.height(), imprint.width()];
            arrays.push((format!("imprint_{name}"), Tensor::f32(&shape, imprint.as_slice().to_vec())));
            arrays.push((format!("mask_{name}"), Tensor::u8(&shape, bits(mask))));
        }
        let arrays: Vec<(&str, Tensor)> = arrays.iter().map(|(name, t)| (name.as_str(), t.clone())).collect();
        files.push(output(stem, "npz"));
        npz::write(&files[files.len() - 1], &arrays)?;
    }
    if save.contains(&Save::Png) {
        for (name, imprint, _) in &fingers {
            let picture = imprint.map(|&d| ((d + 0.02) * 1e6).clamp(0.0, 65535.0) as u16);
            files.push(output(stem, &format!("{name}.png")));
            images::write_gray16(&files[files.len() - 1], &picture)?;
        }
    }
    if save.contains(&Save::Pt) {
        let [w, h] = fingers.first().map_or([0, 0], |(_, imprint, _)| imprint.size());
        let shape = [fingers.len(), 1, h, w];
        let depths = fingers.iter().flat_map(|(_, imprint, _)| imprint.as_slice()).copied().collect();
        let masks = fingers.iter().flat_map(|(_, _, mask)| bits(mask)).collect();
        let items: Vec<(&str, PtItem)> = vec![
            ("prediction", Tensor::f32(&shape, depths).into()),
            ("fingers", PtItem::Texts(fingers.iter().map(|(name, ..)| name.to_string()).collect())),
            ("mask", Tensor::u8(&shape, masks).into()),
        ];
        files.push(output(stem, "pt"));
        pt::write_dict(&files[files.len() - 1], &items)?;
    }
    let name = |file: &PathBuf| file.file_name().map(|n| n.to_string_lossy().into_owned());
    Ok(files.iter().filter_map(name).collect())
}

/// Writes the JSON of a result.
pub(super) fn result(stem: &Path, value: &impl Serialize) -> anyhow::Result<()> {
    let file = output(stem, "json");
    atomic::write_bytes(&file, &serde_json::to_vec_pretty(value)?)
        .map_err(|err| anyhow::anyhow!("cannot write the result: {err}: {}", file.display()))
}

/// Writes the JSON that says why there is no result.
pub(super) fn failure(stem: &Path, source: &Source, recipe: &Value, problem: &Problem) -> anyhow::Result<()> {
    let value = json!({"source": source, "recipe": recipe, "error": {"what": problem.what, "hint": problem.hint}});
    result(stem, &value)
}
