//! The manifest of a feature extractor.

use serde::Deserialize;
use serde_json::{Map, Value};

use super::super::Problems;
use super::{BundleSpec, SIDES, section, sides};

/// A network whose features a Fréchet distance is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeaturesSpec {
    /// Size of the picture.
    pub input: FeaturesInput,
    /// Number of the features.
    pub output: FeaturesOutput,
}

/// Picture that a feature extractor takes: three channels, 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeaturesInput {
    /// `[width, height]`.
    pub size: [usize; 2],
}

/// Output of a feature extractor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeaturesOutput {
    /// Their number.
    pub features: usize,
}

pub(super) fn parse(keys: &mut Map<String, Value>, problems: &mut Problems) -> Option<BundleSpec> {
    let input: Option<FeaturesInput> = section(keys, "input", problems);
    let output: Option<FeaturesOutput> = section(keys, "output", problems);
    if input.is_some_and(|input| !sides(&input.size)) {
        problems.add("input.size: out of range", SIDES);
    }
    if output.is_some_and(|output| !sides(&[output.features])) {
        problems.add("output.features: out of range", "give 1 to 4096");
    }
    Some(BundleSpec::ImageFeatures(FeaturesSpec { input: input?, output: output? }))
}
