//! Shift statistics of a data set: one pass over its predictions and measurements.

use std::sync::Arc;

use super::super::error::TaskError;
use super::super::keys::{PairKey, Recipe, ShiftMode, TouchKey};
use super::super::library::BundleInfo;
use super::super::results::Prediction;
use super::super::services::{DataSource, GenerateItem, Services};
use super::JobCx;
use super::compute::chain;
use crate::domain::dataset::PairId;
use crate::domain::grid::RgbGrid;
use crate::domain::mesh::sampling::spread;
use crate::domain::postprocess::{DepthChain, RawPrediction, ShiftFit};
use crate::domain::rig::{PadId, SensorId};
use crate::domain::sample::Sample;
use crate::io::masks::now_unix_s;
use crate::io::statistics::{Provenance, ShiftStatistics, utc_text};

/// Pairs that the studio's pass takes at most, spread evenly: minutes, not hours. The command line takes all.
pub const STUDIO_PAIRS: usize = 96;

/// Name of the job in errors.
const WHAT: &str = "Shift statistics";

/// A picture of the decoder with the chain that maps it raw.
pub type Predicted = (RawPrediction, DepthChain);

/// What a pass found.
#[derive(Debug, Default)]
pub struct Pass {
    /// The sums.
    pub fit: ShiftFit,
    /// Touches that could not be used.
    pub failed: Vec<TaskError>,
}

/// Predicts every touch of `pairs` that has both a GelSlim image and a measured imprint, and adds it up. Any order of
/// the pairs gives the same figures, bit for bit.
///
/// # Errors
/// If the job was told to stop, or no touch could be used.
pub fn pass(
    pairs: &[PairId],
    fingers: &[PadId],
    input: SensorId,
    load: impl Fn(PairId) -> Result<Arc<Sample>, TaskError>,
    mut predict: impl FnMut(PairId, PadId, &RgbGrid) -> Result<Predicted, TaskError>,
    cx: &JobCx,
) -> Result<Pass, TaskError> {
    let mut pass = Pass::default();
    for (done, pair) in pairs.iter().enumerate() {
        cx.check(WHAT)?;
        cx.progress(done as u64, pairs.len() as u64, format!("pair {} of {}", done + 1, pairs.len()));
        let sample = match load(*pair) {
            Ok(sample) => sample,
            Err(err) => {
                pass.failed.push(err);
                continue;
            }
        };
        for finger in fingers {
            let touch = sample.pad(*finger);
            let (Some(picture), Some(bubble)) = (touch.and_then(|t| t.picture(input)), touch.and_then(|t| t.depth()))
            else {
                continue;
            };
            cx.check(WHAT)?;
            let added = predict(*pair, *finger, &picture).and_then(|(raw, chain)| {
                pass.fit.add(&chain, &raw, &bubble.imprint).map_err(|err| TaskError::from_error(WHAT, &err))
            });
            match added {
                Ok(()) => {}
                Err(err) if err.is_cancelled() => return Err(TaskError::cancelled(WHAT)),
                Err(err) => pass.failed.push(err),
            }
        }
    }
    if pass.fit.stats().is_none() {
        let why = match pass.failed.first() {
            Some(err) => format!("no touch could be used; the first failure: {err}"),
            None => "no pair has both a GelSlim image and a measured imprint".into(),
        };
        return Err(TaskError::new(WHAT, why).with_hint("Statistics need measured imprints beside GelSlim images."));
    }
    Ok(pass)
}

/// The studio's pass: pairs spread evenly over an open data set, both fingers, predicted as `recipe` says.
///
/// # Errors
/// As [`pass`].
pub fn of_data_set(
    services: &dyn Services,
    source: &dyn DataSource,
    recipe: &Recipe,
    bundle: &BundleInfo,
    cx: &JobCx,
) -> Result<ShiftStatistics, TaskError> {
    let all = source.index().pairs.len();
    let pairs: Vec<PairId> = spread(all, STUDIO_PAIRS).into_iter().map(|i| PairId(i as u32)).collect();
    let mut engine = String::new();
    let scale = std::cell::Cell::new("measured");
    // The steps of each prediction are not worth showing; cancelling it is.
    let ends = bundle.ends(&source.rig()).transpose().map_err(|err| TaskError::from_error(WHAT, &err))?;
    let input = ends.ok_or_else(|| TaskError::new(WHAT, "the bundle is not a generator"))?.input;
    let quiet = JobCx::new(cx.cancel.clone(), Arc::new(|_| {}));
    let pass = pass(
        &pairs,
        &source.rig().pad_list(),
        input,
        |pair| {
            let sample = source.load(pair)?;
            if sample.scale == crate::domain::sample::Scale::Assumed {
                scale.set("assumed");
            }
            Ok(Arc::new(sample))
        },
        |pair, finger, difference| {
            let touch = TouchKey { pair: PairKey { pair, ..recipe.touch.pair }, finger };
            let item = GenerateItem { recipe: Recipe { touch, ..recipe.clone() }, difference, size: [0, 0] };
            let made = services.generate(bundle, std::slice::from_ref(&item), &quiet)?;
            let output = made.into_iter().next().ok_or_else(|| TaskError::new(WHAT, "the model gave no answer"))?;
            engine.clone_from(&output.runtime);
            let prediction = Prediction { recipe: item.recipe, output, seconds: 0.0 };
            let chain = chain(&prediction, ShiftMode::Raw)?;
            Ok((prediction.output.raw, chain))
        },
        cx,
    )?;
    let provenance = Provenance {
        bundle: bundle.name.clone(),
        bundle_hash: bundle.id.to_string(),
        dataset: source.title().to_owned(),
        seed: recipe.seed,
        steps: recipe.steps,
        sampler: recipe.sampler.key().into(),
        eta: f64::from(recipe.eta.get()),
        engine,
        scale: scale.get().into(),
        made: utc_text(now_unix_s()),
    };
    ShiftStatistics::new(provenance, &pass.fit).ok_or_else(|| TaskError::new(WHAT, "no pixel was a number"))
}
