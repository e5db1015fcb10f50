//! The options that say where contact masks come from, and the labels that lie by the data.

use clap::Args;
use clap::builder::PossibleValue;
use strum::IntoEnumIterator as _;

use super::Output;
use super::args::{Listed, listed};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::labels::{Labels, PairLabels};
use touch2touch_pipeline::steps::mask::{MaskChoice, MaskSource};

/// Source of contact masks, with its number.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct MaskArgs {
    /// Source of the contact masks that nobody drew. A mask drawn by hand wins over all of them; `mask` in the JSON
    /// says what was taken. A flat imprint has no contact whatever the source; where the mask UNet finds none in an
    /// imprint that is clearly not flat, depth decides. A number of the source's own follows a colon: `threshold:mm=4`,
    /// `unet:probability=0.4`, `cad:mm=1` (largest distance to the CAD model), `top_percent:percent=10`.
    #[arg(long, value_name = "SOURCE", default_value = MaskSource::default().key(), value_parser = sources())]
    pub mask: MaskChoice,
    /// Leave out the masks that were drawn by hand.
    #[arg(long)]
    pub no_hand: bool,
}

fn sources() -> Listed<MaskChoice> {
    listed(|| MaskSource::iter().map(|source| PossibleValue::new(source.key()).help(source.tooltip())).collect())
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
