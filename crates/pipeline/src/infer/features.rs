//! [`FeatureExtractor`]: imprints to the features of an image network, for a Fréchet distance under published conventions.

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use super::bundle::{Bundle, FeaturesSpec, Role};
use super::engine::{EngineChoice, EngineError, Graph, Input};
use super::sandbox::admit;
use crate::io::images;
use touch2touch_core::diffusion::{ModelError, Tensor};
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::metrics::unit_range;
use touch2touch_core::resample::bilinear;

/// Quality of the JPEG files that the lab's images pass through: OpenCV's default.
const QUALITY: u8 = 95;
/// Imprints that [`Preparation::Plain`] makes black and white, meters: the lab's range of its networks.
const PLAIN_M: [f32; 2] = [-0.0116, 0.0225];

/// Way from an imprint to the picture that an image network sees.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    EnumIter,
    EnumString,
    IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Preparation {
    /// The lab's: each imprint stretched to 0..255 on its own and written as a JPEG of quality 95.
    #[default]
    Lab,
    /// One range for all, -11.6 to 22.5 mm, neither rounded nor compressed.
    Plain,
}

impl Preparation {
    /// The name in commands and files.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The meaning, in a line.
    pub fn description(self) -> &'static str {
        match self {
            Self::Lab => "each imprint stretched to 0..255 on its own and compressed as a JPEG (the lab's)",
            Self::Plain => "imprints from -11.6 to 22.5 mm as 0..1, not compressed",
        }
    }

    /// The picture, 0..1. Pixels without measurement are as deep as the shallowest one, and 0 m.
    fn picture(self, imprint: &DepthMap) -> Result<Grid<f32>, FeaturesError> {
        match self {
            Self::Lab => {
                let stretched = unit_range(imprint);
                let levels = stretched.map(|v| if v.is_finite() { (v * 255.0).round() as u8 } else { 0 });
                let passed =
                    images::through_jpeg(&levels, QUALITY).map_err(|err| FeaturesError::Jpeg(err.to_string()))?;
                Ok(passed.map(|v| f32::from(*v) / 255.0))
            }
            Self::Plain => {
                let [lo, hi] = PLAIN_M;
                Ok(imprint.map(|v| ((if v.is_finite() { *v } else { 0.0 } - lo) / (hi - lo)).clamp(0.0, 1.0)))
            }
        }
    }
}

/// Why there are no features.
#[derive(Debug, thiserror::Error)]
pub enum FeaturesError {
    /// The bundle is of another kind.
    #[error("the bundle \"{0}\" is no feature extractor; choose one whose manifest says kind \"image_features\"")]
    NotAnExtractor(String),
    /// No engine, or it does not take the graph.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The graph failed.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The lab's preparation failed.
    #[error("an imprint cannot be compressed: {0}")]
    Jpeg(String),
}

/// A feature extractor with its graph loaded.
#[derive(Debug)]
pub struct FeatureExtractor {
    spec: FeaturesSpec,
    preparation: Preparation,
    graph: Graph,
}

impl FeatureExtractor {
    /// Loads the graph of a checked bundle.
    ///
    /// # Errors
    /// [`FeaturesError::NotAnExtractor`] and [`FeaturesError::Engine`].
    pub fn open(bundle: &Bundle, choice: EngineChoice, preparation: Preparation) -> Result<Self, FeaturesError> {
        let not = || FeaturesError::NotAnExtractor(bundle.name().to_owned());
        let spec = *bundle.image_features().ok_or_else(not)?;
        let engine = admit(bundle, choice)?;
        let graph = Graph::load(engine, Role::ImageFeatures, bundle.file(Role::ImageFeatures).ok_or_else(not)?)?;
        Ok(Self { spec, preparation, graph })
    }

    /// The features of each imprint (meters, raw orientation, any size).
    ///
    /// # Errors
    /// See [`FeaturesError`].
    pub fn features(&mut self, imprints: &[&DepthMap]) -> Result<Vec<Vec<f32>>, FeaturesError> {
        let [width, height] = self.spec.input.size;
        let length = self.spec.output.features;
        let mut all = Vec::with_capacity(imprints.len());
        for imprint in imprints {
            let picture = bilinear(&self.preparation.picture(imprint)?, width, height);
            let data = picture.as_slice().repeat(3);
            let input = Tensor::new(vec![1, 3, height, width], data).expect("three planes of this size");
            let found = self.graph.run(&[("image", Input::F32(&input))], "features", &[1, length])?;
            all.push(found.data().to_vec());
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_labs_preparation_stretches_and_the_plain_one_does_not() {
        let imprint = Grid::from_fn(32, 24, |x, _| if x == 3 { f32::NAN } else { 0.001 + 0.0001 * x as f32 });
        let lab = Preparation::Lab.picture(&imprint).unwrap();
        let ends = lab.as_slice().iter().fold([1.0f32, 0.0], |[lo, hi], v| [lo.min(*v), hi.max(*v)]);
        assert!(ends[0] < 0.05 && ends[1] > 0.95, "{ends:?}");
        let plain = Preparation::Plain.picture(&imprint).unwrap();
        assert!((plain[(10, 5)] - (0.002 + 0.0116) / 0.0341).abs() < 1e-6);
        assert!((plain[(3, 0)] - 0.0116 / 0.0341).abs() < 1e-6, "no measurement counts as 0 m");
        assert!(Preparation::Lab.picture(&Grid::filled(8, 8, 0.002)).unwrap().as_slice().iter().all(|v| v.is_finite()));
    }
}
