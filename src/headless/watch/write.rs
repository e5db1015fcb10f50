//! The files of a result. Each is written whole or not at all, and the JSON last: where it is, the others are.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;
use serde_json::{Value, json};

use super::Source;
use crate::domain::contact::MaskBasis;
use crate::domain::dataset::Problem;
use crate::domain::grid::{DepthMap, Mask};
use crate::domain::rig::{PadId, Text};
use crate::io::names::OUTPUT_MARK;
use crate::io::pt::{PtItem, Tensor};
use crate::io::{atomic, files, images, names, npz, pt};

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

/// Whether the touch was done before: same file, same recipe, no error.
pub(super) fn is_done(stem: &Path, source: &Source, recipe: &Value) -> bool {
    let Ok(text) = files::read(&output(stem, "json"), files::SMALL) else { return false };
    let Ok(before) = serde_json::from_slice::<Value>(&text) else { return false };
    before["error"].is_null() && before["source"] == json!(source) && before["recipe"] == *recipe
}

/// One finger's part of a result.
#[derive(Debug)]
pub(super) struct FingerResult {
    pub finger: PadId,
    pub name: Text,
    pub imprint: DepthMap,
    pub mask: Option<Mask>,
    pub basis: MaskBasis,
}

/// Writes the predictions.
pub(super) fn predictions(stem: &Path, fingers: &[FingerResult], save: &[Save]) -> anyhow::Result<Vec<String>> {
    let mut files = Vec::new();
    let bits = |mask: &Mask| mask.as_slice().iter().map(|&m| u8::from(m)).collect::<Vec<u8>>();
    if save.contains(&Save::Npz) {
        let mut arrays: Vec<(String, Tensor)> = Vec::new();
        for f in fingers {
            let shape = [f.imprint.height(), f.imprint.width()];
            arrays.push((format!("imprint_{}", f.name), Tensor::f32(&shape, f.imprint.as_slice().to_vec())));
            if let Some(mask) = &f.mask {
                arrays.push((format!("mask_{}", f.name), Tensor::u8(&shape, bits(mask))));
            }
        }
        let arrays: Vec<(&str, Tensor)> = arrays.iter().map(|(name, t)| (name.as_str(), t.clone())).collect();
        files.push(output(stem, "npz"));
        npz::write(&files[files.len() - 1], &arrays)?;
    }
    if save.contains(&Save::Png) {
        for f in fingers {
            let picture = f.imprint.map(|&d| ((d + 0.02) * 1e6).clamp(0.0, 65535.0) as u16);
            files.push(output(stem, &format!("{}.png", f.name)));
            images::write_gray16(&files[files.len() - 1], &picture)?;
        }
    }
    if save.contains(&Save::Pt) {
        let [w, h] = fingers.first().map_or([0, 0], |f| f.imprint.size());
        let shape = [fingers.len(), 1, h, w];
        let depths = fingers.iter().flat_map(|f| f.imprint.as_slice()).copied().collect();
        let mut items: Vec<(&str, PtItem)> = vec![
            ("prediction", Tensor::f32(&shape, depths).into()),
            ("fingers", PtItem::Texts(fingers.iter().map(|f| f.name.to_string()).collect())),
        ];
        if fingers.iter().all(|f| f.mask.is_some()) {
            let masks = fingers.iter().filter_map(|f| f.mask.as_ref()).flat_map(bits).collect();
            items.push(("mask", Tensor::u8(&shape, masks).into()));
        }
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
