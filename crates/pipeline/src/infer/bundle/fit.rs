//! The fit of a bundle to a rig, as files: `fit` in the manifest, and an `.npz` of pictures.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::FileEntry;
use crate::io::error::FileError;
use crate::io::npz;
use crate::io::pt::Tensor;
use touch2touch_core::fit::sound::absurd;
use touch2touch_core::fit::{FitSource, Fitted, PadFit};
use touch2touch_core::grid::Grid;
use touch2touch_core::postprocess::{Correction, CorrectionParts, Response};
use touch2touch_core::rig::PerPad;

/// `fit` of a manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitSpec {
    /// The pictures.
    pub file: FileEntry,
    /// The pads' names, in the order of the rig; the fit may know nothing of some.
    pub pads: Vec<String>,
    /// From what it was made.
    pub source: FitSource,
}

/// Writes the pictures of a fit: per pad `NAME_offset_px`, `NAME_line`, `NAME_mean`, `NAME_field`, `NAME_gain` and
/// `NAME_lattice`, and `center`, `basis` and `answers` of all.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, pads: &[String], fitted: &Fitted) -> Result<(), FileError> {
    let mut arrays: Vec<(String, Tensor)> = Vec::new();
    let mut shared = None;
    for (pad, fit) in fitted.pads.entries() {
        let name = &pads[pad.index()];
        let one = &fit.correction;
        arrays.push((format!("{name}_offset_px"), Tensor::f64(&[2], one.offset_px.to_vec())));
        arrays.push((format!("{name}_line"), Tensor::f64(&[2], one.line.to_vec())));
        for (part, picture) in [("mean", &one.mean), ("field", &one.field), ("gain", &one.gain)] {
            arrays.push((format!("{name}_{part}"), tensor(&[picture])));
        }
        if let Some(lattice) = &fit.lattice {
            arrays.push((format!("{name}_lattice"), tensor(&[lattice])));
        }
        shared = shared.or(one.response.as_ref());
    }
    if let Some(response) = shared {
        arrays.push(("center".into(), tensor(&[&response.center])));
        arrays.push(("basis".into(), tensor(&response.basis.iter().collect::<Vec<_>>())));
        arrays.push(("answers".into(), tensor(&response.answers.iter().collect::<Vec<_>>())));
    }
    let named: Vec<(&str, Tensor)> = arrays.iter().map(|(name, tensor)| (name.as_str(), tensor.clone())).collect();
    npz::write(path, &named)
}

fn tensor(pictures: &[&Grid<f32>]) -> Tensor {
    let [width, height] = pictures.first().map_or([0, 0], |p| p.size());
    let values = pictures.iter().flat_map(|p| p.as_slice()).copied().collect();
    Tensor::f32(&[pictures.len(), height, width], values)
}

/// Reads the pictures of a fit for a decoder's picture of this size.
///
/// # Errors
/// A sentence that says what is wrong with them.
pub(super) fn read(path: &Path, bytes: &[u8], spec: &FitSpec, size: [usize; 2]) -> Result<Fitted, String> {
    let mut arrays = npz::read_bytes(path, bytes).map_err(|err| err.to_string())?;
    let response = match pictures(&mut arrays, "basis", size)? {
        Some(basis) => Some(Arc::new(Response {
            center: one(&mut arrays, "center", size)?,
            basis,
            answers: pictures(&mut arrays, "answers", size)?.ok_or("\"answers\" is missing")?,
        })),
        None => None,
    };
    let mut pads: Vec<Option<PadFit>> = Vec::new();
    for name in &spec.pads {
        if !arrays.contains_key(&format!("{name}_offset_px")) {
            pads.push(None);
            continue;
        }
        let correction = Correction {
            offset_px: two(&mut arrays, &format!("{name}_offset_px"))?,
            line: two(&mut arrays, &format!("{name}_line"))?,
            mean: one(&mut arrays, &format!("{name}_mean"), size)?,
            field: one(&mut arrays, &format!("{name}_field"), size)?,
            gain: one(&mut arrays, &format!("{name}_gain"), size)?,
            response: response.clone(),
            parts: CorrectionParts::ALL,
        };
        if !correction.fits(size) {
            return Err(format!(
                "the correction of {name} has numbers that are not finite, or answers without a basis"
            ));
        }
        let lattice = arrays.remove(&format!("{name}_lattice")).and_then(|t| grids(t, None)?.pop());
        let fit = PadFit { correction: Arc::new(correction), lattice };
        if let Some(what) = absurd(&fit) {
            return Err(format!("the correction of {name} has numbers that no fit has: {what}"));
        }
        pads.push(Some(fit));
    }
    Ok(Fitted { source: spec.source.clone(), pads: pads.into_iter().collect::<PerPad<PadFit>>() })
}

type Arrays = BTreeMap<String, Tensor>;

/// The pictures of an array, outermost first; `None` for another shape.
fn grids(tensor: Tensor, size: Option<[usize; 2]>) -> Option<Vec<Grid<f32>>> {
    let &[count, height, width] = tensor.shape.as_slice() else { return None };
    let values = tensor.into_f32();
    if size.is_some_and(|size| size != [width, height]) || width * height == 0 || values.len() != count * width * height
    {
        return None;
    }
    values.chunks_exact(width * height).map(|chunk| Grid::from_vec(width, height, chunk.to_vec()).ok()).collect()
}

fn pictures(arrays: &mut Arrays, name: &str, size: [usize; 2]) -> Result<Option<Vec<Grid<f32>>>, String> {
    let Some(tensor) = arrays.remove(name) else { return Ok(None) };
    let shape = tensor.shape.clone();
    grids(tensor, Some(size))
        .map(Some)
        .ok_or_else(|| format!("\"{name}\" has the shape {shape:?}, not pictures of {size:?}"))
}

fn one(arrays: &mut Arrays, name: &str, size: [usize; 2]) -> Result<Grid<f32>, String> {
    let found = pictures(arrays, name, size)?.and_then(|mut all| if all.len() == 1 { all.pop() } else { None });
    found.ok_or_else(|| format!("\"{name}\" is missing, or not one picture"))
}

fn two(arrays: &mut Arrays, name: &str) -> Result<[f64; 2], String> {
    let values = arrays.remove(name).map(Tensor::into_f64);
    values
        .and_then(|v| <[f64; 2]>::try_from(v).ok())
        .ok_or_else(|| format!("\"{name}\" is missing, or not two numbers"))
}
