//! Several predictions of one touch against each other: [`ensemble`].

use std::sync::Arc;

use crate::error::TaskError;
use crate::imprint::chain_of_pad;
use crate::on_pad::OnPad;
use crate::prediction::Prediction;
use touch2touch_core::ensemble::{Spread, channel_spread};
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::postprocess::{DepthChain, ShiftMode};

/// Several predictions of one touch against each other.
#[derive(Clone, Debug)]
pub struct Ensemble {
    /// Around their mean, meters.
    pub spread: Spread,
    /// Mean over them of the spread of the decoder's channels, meters; `None` for a decoder of one channel.
    pub channels: Option<DepthMap>,
}

impl Ensemble {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        4 * (2 * self.spread.mean.len() + self.channels.as_ref().map_or(0, Grid::len))
    }
}

/// Mean and spreads of several predictions, `imprints` being the same in meters; all of one pad of a sample.
///
/// # Errors
/// If there is none, or their sizes differ.
pub fn ensemble(
    predictions: &[Arc<Prediction>],
    imprints: &[Arc<DepthMap>],
    shift: ShiftMode,
    OnPad { sample, pad }: OnPad<'_>,
) -> Result<Ensemble, TaskError> {
    const WHAT: &str = "Spread of the seeds";
    let spread = Spread::of(&imprints.iter().map(|i| &**i).collect::<Vec<_>>())
        .ok_or_else(|| TaskError::new(WHAT, "the predictions differ in size"))?;
    let mut apart = Vec::new();
    for prediction in predictions {
        let chain = DepthChain { size: spread.mean.size(), ..chain_of_pad(prediction, shift, sample, pad)? };
        let found = channel_spread(&prediction.raw, &chain).map_err(|err| TaskError::from_error(WHAT, &err))?;
        apart.extend(found);
    }
    let channels = Spread::of(&apart.iter().collect::<Vec<_>>()).map(|of| of.mean);
    Ok(Ensemble { spread, channels })
}
