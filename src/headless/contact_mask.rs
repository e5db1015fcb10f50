//! The options that say where contact masks come from, and the labels that lie by the data.

use std::str::FromStr;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use strum::IntoEnumIterator as _;

use super::Output;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::labels::{Labels, PairLabels};
use touch2touch_pipeline::steps::mask::{MaskChoice, MaskSource};
use touch2touch_pipeline::steps::recipe::{meters, millimeters};

/// Source of contact masks, with its numbers.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct MaskArgs {
    /// Source of the contact masks that nobody drew. A mask drawn by hand wins over all of them; `mask` in the JSON
    /// says what was taken. A flat imprint has no contact whatever the source; where the mask UNet finds none in an
    /// imprint that is clearly not flat, depth decides.
    #[arg(long, default_value = MaskSource::default().key(), value_parser = parse_source())]
    mask: MaskSource,
    /// Imprint depth from which a pixel counts as contact, for `--mask threshold`.
    #[arg(long, value_name = "MM", default_value_t = in_mm(MaskChoice::default().threshold_m), value_parser = finite::<f64>, allow_hyphen_values = true)]
    threshold_mm: f64,
    /// Probability of contact from which a pixel counts, 0 to 1, for the mask model (default: the bundle's own).
    #[arg(long, value_name = "P", value_parser = probability)]
    probability: Option<f32>,
    /// Share of the deepest pixels, for `--mask top_percent`.
    #[arg(long, value_name = "PERCENT", default_value_t = MaskChoice::default().top_percent, value_parser = finite::<f32>)]
    top_percent: f32,
    /// Largest distance to the CAD model at the true pose, for `--mask cad`.
    #[arg(long, value_name = "MM", default_value_t = in_mm(MaskChoice::default().cad_distance_m), value_parser = finite::<f64>)]
    cad_mm: f64,
    /// Leave out the masks that were drawn by hand.
    #[arg(long)]
    pub no_hand: bool,
}

fn parse_source() -> impl TypedValueParser<Value = MaskSource> {
    let name = |source: MaskSource| PossibleValue::new(source.key()).help(source.tooltip());
    // The parser has compared the key with the list.
    PossibleValuesParser::new(MaskSource::iter().map(name)).map(|key| key.parse().unwrap_or_default())
}

fn in_mm(length_m: f32) -> f64 {
    millimeters(length_m).parse().unwrap_or_default()
}

fn finite<T: FromStr + Copy + Into<f64>>(text: &str) -> Result<T, String> {
    let number = text.parse().ok().filter(|number: &T| (*number).into().is_finite());
    number.ok_or_else(|| "a number is needed".to_owned())
}

fn probability(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|p| (0.0..=1.0).contains(p)).ok_or_else(|| "a probability of 0 to 1 is needed".to_owned())
}

impl MaskArgs {
    /// The choice in meters.
    pub(super) fn choice(&self) -> MaskChoice {
        MaskChoice {
            source: self.mask,
            threshold_m: meters(self.threshold_mm),
            probability: self.probability,
            top_percent: self.top_percent,
            cad_distance_m: meters(self.cad_mm),
        }
    }
}

/// The labels of a pair, made in the studio or by `label`; damaged ones are said and do not hold up the rest.
pub(super) fn labels_of(labels: &Labels, name: &str, output: &Output) -> PairLabels {
    readable(labels.load(name), output)
}

/// The labels that were read; none where they cannot be, which is said.
pub(super) fn readable(labels: Result<PairLabels, TaskError>, output: &Output) -> PairLabels {
    labels.unwrap_or_else(|err| {
        output.note(&format!("note: {err}; its labels are left out"));
        PairLabels::default()
    })
}
