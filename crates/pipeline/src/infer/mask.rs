//! [`MaskModel`]: an imprint to a contact mask, with the graph of a bundle.

use super::bundle::{Bundle, Cast, MaskInput, MaskSpec, Role};
use super::engine::{EngineChoice, EngineError, EngineKind, Graph, Input};
use super::sandbox::admit;
use touch2touch_core::contact::{ContactMask, settled_model};
use touch2touch_core::diffusion::{ModelError, Tensor};
use touch2touch_core::grid::{DepthMap, Grid, Mask};
use touch2touch_core::resample::{bilinear, nearest_mask};

/// Why a model of imprints gives no answer.
#[derive(Debug, thiserror::Error)]
pub enum ImprintError {
    /// The bundle is of another kind.
    #[error("the bundle \"{0}\" is not a mask UNet; choose one whose manifest says kind \"mask_unet\"")]
    NotAMaskUnet(String),
    /// The bundle is of another kind.
    #[error("the bundle \"{0}\" is not a tool classifier; choose one whose manifest says kind \"tool_classifier\"")]
    NotAClassifier(String),
    /// No engine, or it does not take the graph.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The graph failed.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An imprint without pixels, or without a single measured one.
    #[error("the imprint of {width} x {height} pixels holds no measurement")]
    Nothing {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

/// A mask UNet with its graph loaded.
#[derive(Debug)]
pub struct MaskModel {
    spec: MaskSpec,
    hash: String,
    engine: EngineKind,
    graph: Graph,
}

impl MaskModel {
    /// Loads the graph of a checked bundle.
    ///
    /// # Errors
    /// [`ImprintError::NotAMaskUnet`] and [`ImprintError::Engine`].
    pub fn open(bundle: &Bundle, choice: EngineChoice) -> Result<Self, ImprintError> {
        let not = || ImprintError::NotAMaskUnet(bundle.name().to_owned());
        let spec = bundle.mask_unet().ok_or_else(not)?.clone();
        let engine = admit(bundle, choice)?;
        let graph = Graph::load(engine, Role::MaskUnet, bundle.file(Role::MaskUnet).ok_or_else(not)?)?;
        Ok(Self { spec, hash: bundle.hash().to_owned(), engine, graph })
    }

    /// The bundle's description.
    pub fn spec(&self) -> &MaskSpec {
        &self.spec
    }

    /// The bundle's hash, for the mask's provenance.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// The engine in use.
    pub fn engine(&self) -> EngineKind {
        self.engine
    }

    /// The contact mask of an imprint (meters, raw orientation), at the imprint's size, and what it is made of in the end
    /// ([`settled_model`]): pixels of at least the given probability, or of the bundle's own.
    ///
    /// # Errors
    /// See [`ImprintError`].
    pub fn contact(&mut self, imprint: &DepthMap) -> Result<ContactMask, ImprintError> {
        let least = self.least_probability();
        Ok(contact_of(&self.probability(imprint)?, imprint, least))
    }

    /// Contact by the model alone, at the imprint's size.
    ///
    /// Pixels without measurement (NaN) are given to the graph as 0 m.
    ///
    /// # Errors
    /// See [`ImprintError`].
    pub fn predict(&mut self, imprint: &DepthMap) -> Result<Mask, ImprintError> {
        let least = self.least_probability();
        Ok(at_least(&self.probability(imprint)?, imprint, least))
    }

    /// The probability from which a pixel counts as contact, as the bundle says.
    pub(crate) fn least_probability(&self) -> f32 {
        self.spec.output.threshold as f32
    }

    /// The probability of contact of each pixel, at the graph's size and in the raw orientation.
    ///
    /// # Errors
    /// See [`ImprintError`].
    pub fn probability(&mut self, imprint: &DepthMap) -> Result<Grid<f32>, ImprintError> {
        if imprint.as_slice().iter().all(|v| !v.is_finite()) {
            return Err(ImprintError::Nothing { width: imprint.width(), height: imprint.height() });
        }
        let [width, height] = self.spec.input.size;
        let input = prepare(imprint, &self.spec.input);
        let classes = self.spec.output.classes;
        let logits = self.graph.run(&[("imprint", Input::F32(&input))], "logits", &[1, classes, height, width])?;
        let plane = width * height;
        let probability = Grid::from_fn(width, height, |x, y| {
            let at = y * width + x;
            let contact = logits.data()[(classes - 1) * plane + at];
            let rest = if classes == 2 { logits.data()[at] } else { 0.0 };
            // Softmax of two, or the sigmoid of one.
            1.0 / (1.0 + (rest - contact).exp())
        });
        Ok(if self.spec.input.rotation_deg == 180 { probability.rotated_180() } else { probability })
    }
}

/// The pixels of an imprint whose probability of contact is at least so much.
fn at_least(probability: &Grid<f32>, imprint: &DepthMap, least: f32) -> Mask {
    nearest_mask(&probability.map(|&p| p >= least), imprint.width(), imprint.height())
}

/// Share of the pixels of a map of contact's probability that say neither yes nor no, 0..1; `None` for an empty map.
fn unsure_share(probability: &Grid<f32>) -> Option<f64> {
    let unsure = probability.as_slice().iter().filter(|p| (0.25..=0.75).contains(*p)).count();
    (!probability.is_empty()).then(|| unsure as f64 / probability.len() as f64)
}

/// The contact mask of an imprint from its map of [`MaskModel::probability`].
pub(crate) fn contact_of(probability: &Grid<f32>, imprint: &DepthMap, least: f32) -> ContactMask {
    let found = settled_model(imprint, at_least(probability, imprint, least));
    ContactMask { unsure: unsure_share(probability), ..found }
}

/// The imprint as the graph wants it, `[1, 1, height, width]`.
///
/// In f32 and truncated, as the lab's `(x - min) / (max - min) * 255` cast to `uint8`.
fn prepare(imprint: &DepthMap, input: &MaskInput) -> Tensor {
    let [width, height] = input.size;
    let filled = imprint.map(|&v| if v.is_finite() { v } else { 0.0 });
    let resized = bilinear(&filled, width, height);
    let turned = if input.rotation_deg == 180 { resized.rotated_180() } else { resized };
    let (min, span) = (input.range_m.min_m as f32, (input.range_m.max_m - input.range_m.min_m) as f32);
    let scale = |&v: &f32| {
        let unit = (v - min) / span;
        match input.cast {
            // `as u8` saturates; through i32 the low eight bits stay, as in C.
            Cast::Saturate => f32::from((unit * 255.0) as u8) / 255.0,
            Cast::Wrap => f32::from((unit * 255.0) as i32 as u8) / 255.0,
            Cast::None => unit.clamp(0.0, 1.0),
        }
    };
    let data = turned.as_slice().iter().map(scale).collect();
    Tensor::new(vec![1, 1, height, width], data).expect("one plane of this size")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::infer::bundle::SensorSpec;
    use touch2touch_core::rig::lab;

    fn input(cast: Cast) -> MaskInput {
        MaskInput {
            sensor: SensorSpec::of(&lab::BUBBLE),
            size: [3, 1],
            range_m: [-0.0116, 0.0225].into(),
            cast,
            rotation_deg: 0,
        }
    }

    #[test]
    fn eight_bits_are_truncated_and_saturate_or_wrap() {
        // The lab's example: 26 mm is 281.2 of 255.
        let imprint = Grid::from_vec(3, 1, vec![0.026, f32::NAN, -0.013]).unwrap();
        let levels = |cast| -> Vec<f32> { prepare(&imprint, &input(cast)).data().iter().map(|v| v * 255.0).collect() };
        let near = |found: Vec<f32>, expected: [f32; 3]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3), "{found:?} for {expected:?}");
        };
        near(levels(Cast::Saturate), [255.0, 86.0, 0.0]);
        near(levels(Cast::Wrap), [25.0, 86.0, 246.0]);
        near(levels(Cast::None), [255.0, 86.744_87, 0.0]);
    }
}
