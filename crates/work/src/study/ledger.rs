//! The depth chain of one prediction, for the studio's pane and the command line.

use super::compare::LAB_PEAK_M;
use crate::error::TaskError;
use crate::imprint::chain_of_pad;
use crate::on_pad::OnPad;
use crate::prediction::Prediction;
use touch2touch_core::postprocess::{ChainReading, DepthChain, Ledger, Mapping, Shift, ShiftMode, ledger, readings};

/// The depth chain of a prediction.
#[derive(Clone, Debug)]
pub struct LedgerResult {
    /// Every stage, the result against the truth, and what is implausible.
    pub ledger: Ledger,
    /// Depth of the picture by every way to meters.
    pub readings: Vec<ChainReading>,
}

/// The ways to meters to be compared: all that a bundle has, and `shift` where it is a data set's own.
fn reading_chains(shift: ShiftMode, chain: impl Fn(ShiftMode) -> Option<DepthChain>) -> Vec<(ShiftMode, DepthChain)> {
    let own = matches!(shift, ShiftMode::Refit(_) | ShiftMode::Parts(_)).then_some(shift);
    ShiftMode::ALL.into_iter().chain(own).filter_map(|mode| Some((mode, chain(mode)?))).collect()
}

/// Every stage of a prediction with `shift`, the result against the measured imprint, and what is implausible.
/// `correct` reads the decoder's range as it is meant instead of twice, which leaves no shift to be done.
///
/// # Errors
/// If the bundle has no such range mapping, or its steps do not fit its output.
pub fn of_prediction(
    prediction: &Prediction,
    shift: ShiftMode,
    correct: bool,
    OnPad { sample, pad }: OnPad<'_>,
) -> Result<LedgerResult, TaskError> {
    let raw = &prediction.raw;
    let measured = sample.pad(pad).and_then(|touch| touch.depth()).map(|bubble| &bubble.imprint);
    let mut own = chain_of_pad(prediction, shift, sample, pad)?;
    if correct {
        (own.mapping, own.shift) = (Mapping::Correct, Shift::None);
    }
    let found = ledger(&own, raw, measured).map_err(|err| TaskError::from_error("Depth chain", &err))?;
    let modes = reading_chains(shift, |mode| chain_of_pad(prediction, mode, sample, pad).ok());
    let readings = readings(&own, &modes, raw, measured, LAB_PEAK_M);
    Ok(LedgerResult { ledger: found, readings })
}
