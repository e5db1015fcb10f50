//! Shift statistics of a data set: one pass over its predictions and measurements.

use std::sync::Arc;

use crate::error::TaskError;
use crate::io::masks::now_unix_s;
use crate::io::statistics::{Provenance, ShiftStatistics, utc_text};
use crate::job::JobCx;
use crate::steps::models::Models;
use crate::steps::recipe::Recipe;
use touch2touch_core::dataset::PairId;
use touch2touch_core::postprocess::{ShiftFit, ShiftMode};
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::{Sample, Scale};

/// Pairs that a pass takes at most, spread evenly, where no other number is asked for: minutes, not hours.
pub const PAIRS: usize = 96;

/// Name of the job in errors.
const WHAT: &str = "Shift statistics";

/// Pairs and predictions that statistics are made of.
#[derive(Clone, Debug)]
pub struct StatisticsSetup {
    /// The pairs. Any order of them gives the same figures.
    pub pairs: Vec<PairId>,
    /// Whose touches.
    pub fingers: Vec<PadId>,
    /// Recipe of the predictions; the mapping to meters decides nothing.
    pub recipe: Recipe,
    /// The data set's title, for the statistics' provenance.
    pub dataset: String,
}

/// Predicts every touch that has both a GelSlim image and a measured imprint, and adds it up. Returns the statistics
/// and the touches that could not be used.
///
/// # Errors
/// If the recipe has no generator, the job was told to stop, or no touch could be used.
pub fn statistics(
    setup: &StatisticsSetup,
    load: impl Fn(PairId) -> Result<Arc<Sample>, TaskError>,
    models: &Models,
    cx: &JobCx,
) -> Result<(ShiftStatistics, Vec<TaskError>), TaskError> {
    let generating = setup.recipe.generating()?;
    let (mut fit, mut failed) = (ShiftFit::default(), Vec::new());
    let (mut scale, mut engine) = (Scale::Measured, String::new());
    // The steps of each prediction are not worth showing.
    let quiet = cx.quiet();
    for (done, pair) in setup.pairs.iter().enumerate() {
        cx.check(WHAT)?;
        cx.progress(done as u64, setup.pairs.len() as u64, format!("pair {} of {}", done + 1, setup.pairs.len()));
        let sample = match load(*pair) {
            Ok(sample) => sample,
            Err(err) => {
                failed.push(err);
                continue;
            }
        };
        if sample.scale == Scale::Assumed {
            scale = Scale::Assumed;
        }
        for finger in &setup.fingers {
            let bubble = sample.pad(*finger).and_then(|touch| touch.depth());
            let (Some(picture), Some(bubble)) = (generating.picture(&sample, *finger)?, bubble) else { continue };
            cx.check(WHAT)?;
            let added = generating.of(models, &[picture], &quiet).and_then(|predictions| {
                let prediction = predictions.first();
                let prediction =
                    prediction.ok_or_else(|| TaskError::new(WHAT, "the generator returned no prediction"))?;
                let chain = crate::steps::imprint::chain(prediction, ShiftMode::Raw)?;
                engine.clone_from(&prediction.engine);
                fit.add(&chain, &prediction.raw, &bubble.imprint).map_err(|err| TaskError::from_error(WHAT, &err))
            });
            match added {
                Ok(()) => {}
                Err(err) if err.is_cancelled() => return Err(TaskError::cancelled(WHAT)),
                Err(err) => failed.push(err),
            }
        }
    }
    let config = generating.config;
    let provenance = Provenance {
        bundle: generating.bundle.name.clone(),
        bundle_hash: generating.bundle.id.to_string(),
        dataset: setup.dataset.clone(),
        seed: config.seed,
        steps: config.steps,
        sampler: config.sampler.key().into(),
        eta: config.eta,
        engine,
        scale: scale.key().into(),
        made: utc_text(now_unix_s()),
    };
    match ShiftStatistics::new(provenance, &fit) {
        Some(found) => Ok((found, failed)),
        None => {
            let why = match failed.first() {
                Some(err) => format!("no touch could be used; the first failure: {err}"),
                None => "no pair has both a GelSlim image and a measured imprint".into(),
            };
            Err(TaskError::new(WHAT, why).with_hint("Statistics need measured imprints beside GelSlim images."))
        }
    }
}
