//! Several seeds of one touch: its predictions around their mean ([`seeds_of`]) and the fan of their poses ([`fan`]).

mod picture;

use std::collections::BTreeMap;
use std::sync::Arc;

use super::ensemble::{Ensemble, ensemble};
use crate::error::TaskError;
use crate::feel::{Felt, Touch};
use crate::imprint::imprint_of;
use crate::job::JobCx;
use crate::models::Models;
use crate::on_pad::OnPad;
use crate::prediction::Prediction;
use crate::recipe::{Recipe, Stage};
use touch2touch_core::align::Ask;
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::ensemble::{AngleFan, seeds};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::PerPad;

pub use picture::picture;

/// The predictions of one finger with several seeds.
#[derive(Clone, Debug)]
pub struct FingerSeeds {
    /// The predictions, one per seed.
    pub predictions: Vec<Arc<Prediction>>,
    /// Meters, one per seed.
    pub imprints: Vec<Arc<DepthMap>>,
    /// Their mean and spreads.
    pub ensemble: Ensemble,
}

/// Predicts one finger with `count` seeds, from the recipe's on.
///
/// # Errors
/// If the finger has no picture to start from, or a prediction fails.
pub fn seeds_of(
    of: OnPad<'_>,
    recipe: &Recipe,
    count: usize,
    models: &Models,
    cx: &JobCx,
) -> Result<FingerSeeds, TaskError> {
    let generating = recipe.generating()?;
    let list = seeds(generating.config.seed, count);
    let made = generating.seeds(models, of, &list, cx)?;
    let predictions: Vec<Arc<Prediction>> = made.into_iter().map(Arc::new).collect();
    let imprint = |made: &Arc<Prediction>| imprint_of(made, recipe.shift, of.sample, of.pad).map(Arc::new);
    let imprints = predictions.iter().map(imprint).collect::<Result<Vec<_>, _>>()?;
    let ensemble = ensemble(&predictions, &imprints, recipe.shift, of)?;
    Ok(FingerSeeds { predictions, imprints, ensemble })
}

/// The poses of several seeds of one grasp.
#[derive(Clone, Debug)]
pub struct Fan {
    /// The seeds.
    pub seeds: Vec<u64>,
    /// The lab's angle with each, radians; `None` without a pose.
    pub angles_rad: Vec<Option<f64>>,
    /// The angle of the mean imprint, radians.
    pub of_mean_rad: Option<f64>,
    /// The angles around their mean; `None` where there are none.
    pub fan: Option<AngleFan>,
    /// Number of masks (one per seed and one of the mean imprint) that are not of the source that was asked, by finger
    /// and what they are of instead.
    pub otherwise: BTreeMap<String, usize>,
}

/// Predicts all fingers with `count` seeds and registers each, and the mean imprint.
///
/// # Errors
/// If a prediction or a mask fails. A seed without a pose is part of the result.
pub fn fan(touch: Touch<'_>, recipe: &Recipe, count: usize, models: &Models, cx: &JobCx) -> Result<Fan, TaskError> {
    let sample = touch.sample;
    let generating = recipe.generating()?;
    let mut fingers: PerPad<FingerSeeds> = PerPad::default();
    for (pad, _) in sample.pads.entries() {
        if generating.picture(sample, pad)?.is_some() {
            fingers[pad] = Some(seeds_of(OnPad { sample, pad }, recipe, count, models, cx)?);
        }
    }
    let mut otherwise = BTreeMap::new();
    let mut angle = |felt: Felt| -> Result<Option<f64>, TaskError> {
        let felt = felt.reach_asking(touch, Stage::Pose, Ask::default(), models, cx)?;
        let contact = felt.contact();
        for (pad, found) in contact.masks.entries().filter(|(_, found)| found.basis != MaskBasis::Source) {
            let made_of = format!("{} finger: {}", sample.rig.pad_key(pad), found.basis.key(contact.source().key()));
            *otherwise.entry(made_of).or_insert(0) += 1;
        }
        Ok(felt.pose().ok().map(|found| found.angle_rad))
    };
    let seeds = seeds(generating.config.seed, count);
    let mut angles_rad = Vec::new();
    for (at, &seed) in seeds.iter().enumerate() {
        let made = fingers.as_ref().map(|finger| Some((*finger?.predictions[at]).clone()));
        angles_rad.push(angle(Felt::of_predictions(&recipe.with_seed(seed), made))?);
    }
    let means = fingers.as_ref().map(|finger| Some(finger?.ensemble.spread.mean.clone()));
    let of_mean_rad = angle(Felt::of_imprints(recipe, means))?;
    let fan = AngleFan::of(&angles_rad.iter().flatten().copied().collect::<Vec<_>>());
    Ok(Fan { seeds, angles_rad, of_mean_rad, fan, otherwise })
}
