//! [`ToolClassifier`]: an imprint to the tool that made it, with the graph of a bundle.

use super::bundle::{Bundle, ClassifierInput, ClassifierSpec, Role};
use super::engine::{EngineChoice, EngineKind, Graph, Input};
use super::mask::ImprintError;
use super::sandbox::admit;
use touch2touch_core::diffusion::Tensor;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::resample::bilinear;

/// Verdict of a classifier on one imprint.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The likeliest class: its place in the bundle's list.
    pub class: usize,
    /// One number per class; only their differences mean something.
    pub logits: Vec<f32>,
    /// Input of the last layer; empty if the bundle hands none out.
    pub features: Vec<f32>,
}

/// A tool classifier with its graph loaded.
#[derive(Debug)]
pub struct ToolClassifier {
    spec: ClassifierSpec,
    engine: EngineKind,
    graph: Graph,
}

impl ToolClassifier {
    /// Loads the graph of a checked bundle.
    ///
    /// # Errors
    /// [`ImprintError::NotAClassifier`] and [`ImprintError::Engine`].
    pub fn open(bundle: &Bundle, choice: EngineChoice) -> Result<Self, ImprintError> {
        let not = || ImprintError::NotAClassifier(bundle.name().to_owned());
        let spec = bundle.tool_classifier().ok_or_else(not)?.clone();
        let engine = admit(bundle, choice)?;
        let graph = Graph::load(engine, Role::ToolClassifier, bundle.file(Role::ToolClassifier).ok_or_else(not)?)?;
        Ok(Self { spec, engine, graph })
    }

    /// The bundle's description.
    pub fn spec(&self) -> &ClassifierSpec {
        &self.spec
    }

    /// The engine in use.
    pub fn engine(&self) -> EngineKind {
        self.engine
    }

    /// Says of each imprint (meters, raw orientation, any size) which tool made it.
    ///
    /// Pixels without measurement (NaN) are given to the graph as 0 m.
    ///
    /// # Errors
    /// See [`ImprintError`].
    pub fn classify(&mut self, imprints: &[&DepthMap]) -> Result<Vec<Verdict>, ImprintError> {
        if imprints.is_empty() {
            return Ok(Vec::new());
        }
        let [width, height] = self.spec.input.size;
        let mut data = Vec::with_capacity(imprints.len() * width * height);
        for imprint in imprints {
            if imprint.as_slice().iter().all(|v| !v.is_finite()) {
                return Err(ImprintError::Nothing { width: imprint.width(), height: imprint.height() });
            }
            prepare(imprint, &self.spec.input, &mut data);
        }
        let n = imprints.len();
        let input = Tensor::new(vec![n, 1, height, width], data).expect("one plane of this size per imprint");
        let inputs = [("imprint", Input::F32(&input))];
        let classes = self.spec.output.classes.len();
        let logits = self.graph.run(&inputs, "logits", &[n, classes])?;
        let features = match self.spec.output.features {
            Some(length) => Some((length, self.graph.run(&inputs, "features", &[n, length])?)),
            None => None,
        };
        let verdict = |i: usize| {
            let logits = logits.data()[i * classes..(i + 1) * classes].to_vec();
            // The first of equals, so that the answer does not depend on anything else.
            let class = (1..classes).fold(0, |best, at| if logits[at] > logits[best] { at } else { best });
            let features = features.as_ref().map_or_else(Vec::new, |(d, t)| t.data()[i * d..(i + 1) * d].to_vec());
            Verdict { class, logits, features }
        };
        Ok((0..n).map(verdict).collect())
    }
}

/// Adds the imprint as the graph wants it: turned, resized, its range to -1..1.
fn prepare(imprint: &DepthMap, input: &ClassifierInput, out: &mut Vec<f32>) {
    let [width, height] = input.size;
    let filled = imprint.map(|&v| if v.is_finite() { v } else { 0.0 });
    let turned = if input.rotation_deg == 180 { filled.rotated_180() } else { filled };
    let resized = bilinear(&turned, width, height);
    let (min, span) = (input.range_m.min_m, input.range_m.max_m - input.range_m.min_m);
    out.extend(resized.as_slice().iter().map(|&v| ((f64::from(v) - min) / span * 2.0 - 1.0).clamp(-1.0, 1.0) as f32));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::infer::bundle::SensorSpec;
    use touch2touch_core::grid::Grid;
    use touch2touch_core::rig::lab;

    #[test]
    fn the_imprint_is_turned_and_its_range_becomes_one() {
        let input = ClassifierInput {
            sensor: SensorSpec::of(&lab::BUBBLE),
            size: [4, 1],
            range_m: [-0.01, 0.03].into(),
            rotation_deg: 180,
        };
        let imprint = Grid::from_vec(4, 1, vec![0.03, f32::NAN, -0.01, 0.09]).unwrap();
        let mut out = Vec::new();
        prepare(&imprint, &input, &mut out);
        let expected = [1.0, -1.0, -0.5, 1.0];
        assert!(out.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{out:?}");
    }
}
