//! The depth chain of one prediction, for the studio's pane and the command line.

use super::super::error::TaskError;
use super::super::keys::ShiftMode;
use super::super::results::{LedgerResult, Prediction};
use super::compute::{LAB_PEAK_M, chain};
use crate::domain::grid::DepthMap;
use crate::domain::postprocess::{DepthChain, ledger, readings};

/// The ways to metres to be compared: all that a bundle has, and `shift` where it is a data set's own.
pub fn reading_chains(
    shift: ShiftMode,
    chain: impl Fn(ShiftMode) -> Option<DepthChain>,
) -> Vec<(ShiftMode, DepthChain)> {
    let own = matches!(shift, ShiftMode::Refit(_)).then_some(shift);
    ShiftMode::ALL.into_iter().chain(own).filter_map(|mode| Some((mode, chain(mode)?))).collect()
}

/// Every stage of a prediction with `shift`, the result against the measured imprint, and what is implausible.
///
/// # Errors
/// If the bundle has no such range mapping, or its steps do not fit its output.
pub fn of_prediction(
    prediction: &Prediction,
    shift: ShiftMode,
    measured: Option<&DepthMap>,
) -> Result<LedgerResult, TaskError> {
    let raw = &prediction.output.raw;
    let own = chain(prediction, shift)?;
    let found = ledger(&own, raw, measured).map_err(|err| TaskError::from_error("Depth chain", &err))?;
    let modes = reading_chains(shift, |mode| chain(prediction, mode).ok());
    let readings = readings(&own, &modes, raw, measured, LAB_PEAK_M);
    Ok(LedgerResult { ledger: found, readings })
}
