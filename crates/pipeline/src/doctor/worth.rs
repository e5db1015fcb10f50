//! [`worth`]: the models tried on a sample of a data set, and what a fit to it would make of them.

use std::collections::BTreeSet;

use serde::Serialize;

use super::{Cure, Fact, Grade, Topic};
use crate::error::TaskError;
use crate::io::dataset::{Dataset, SourceKind};
use crate::job::JobCx;
use crate::learn::adapt::{AdaptSetup, Adapted, Scored, adapt};
use crate::learn::mask_worth::{MaskWorth, mask_worth};
use crate::pairs::spread;
use crate::steps::models::Models;
use crate::steps::recipe::Recipe;
use touch2touch_core::dataset::PairId;
use touch2touch_core::units::counted;

/// Pairs that the models are tried on.
pub const SAMPLE: usize = 24;
/// Most grasps that are posed: the mask model is asked for each finger.
const POSED: usize = 12;
/// Parts in which the pairs of the sample are left out in turn.
const PARTS: usize = 3;
/// A mean angle error from which on masks are worth a training, degrees.
const TOLERABLE_DEG: f64 = 2.0;
/// An overlap with the masks from CAD below which they are as well.
const TOLERABLE_IOU: f64 = 0.8;
/// A gain of a fit that is worth its while, dB.
const GAIN_DB: f64 = 0.5;

/// Worth of the models on a sample.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Worth {
    /// Pairs of the data set.
    pub all: usize,
    /// Fit to the sample, which was only tried; `None` where that was not possible.
    #[serde(skip)]
    pub fit: Option<Adapted>,
    /// Why not.
    pub no_fit: Option<String>,
    /// Name of the generator.
    pub generator: Option<String>,
    /// The mask model where true poses are known.
    pub masks: Option<MaskWorth>,
    /// Name of the mask model.
    pub mask_model: Option<String>,
}

/// Tries the generator, the mask model and the registration of a recipe on a sample: predicts it and fits the generator to two thirds of it in turn, and registers poses from
/// the mask model's masks. Nothing is written. `None` for a simulated set that is built in: the models come from there.
///
/// # Errors
/// If the job was told to stop. That a model cannot be tried is part of the answer.
pub fn worth(dataset: &Dataset, recipe: &Recipe, models: &Models, cx: &JobCx) -> Result<Option<Worth>, TaskError> {
    if dataset.kind == SourceKind::Demo && dataset.read_as().is_empty() {
        return Ok(None);
    }
    let all = dataset.index.pairs.len();
    let pairs: Vec<PairId> = spread(all, Some(SAMPLE)).map(|at| PairId(at as u32)).collect();
    let mut worth = Worth { all, ..Worth::default() };
    if let Some((generator, _)) = &recipe.generator {
        worth.generator = Some(generator.name.clone());
        let fit = AdaptSetup {
            recipe: recipe.clone(),
            pairs: pairs.clone(),
            folds: PARTS,
            tuning: None,
            unfinished: None,
            out: None,
            force: false,
            replace: false,
        };
        match adapt(dataset, &fit, models, cx) {
            Ok(adapted) => worth.fit = Some(adapted),
            Err(err) if err.is_cancelled() => return Err(err),
            Err(err) => worth.no_fit = Some(err.why),
        }
    }
    if let Some(model) = &recipe.mask_model {
        worth.mask_model = Some(model.name.clone());
        let posed: BTreeSet<PairId> = spread(pairs.len(), Some(POSED)).map(|at| pairs[at]).collect();
        let by = (&**model, recipe.engine, recipe.registration);
        worth.masks = match mask_worth(dataset, &posed, by, models, cx) {
            Err(err) if err.is_cancelled() => return Err(err),
            found => found.ok().flatten(),
        };
    }
    Ok(Some(worth))
}

impl Worth {
    /// Lines about it.
    pub fn facts(&self) -> Vec<Fact> {
        let generator = match (&self.fit, &self.no_fit) {
            (Some(fit), _) => Some(self.of_fit(fit)),
            (None, Some(why)) => Some(Fact::plain(Topic::Generator, format!("not tried: {why}"))),
            (None, None) => None,
        };
        generator.into_iter().chain(self.masks.as_ref().map(|masks| self.of_masks(masks))).collect()
    }

    fn of_fit(&self, fit: &Adapted) -> Fact {
        let db = |scored: &Scored| scored.psnr_db;
        let Some(before) = db(&fit.before) else {
            return Fact::plain(Topic::Generator, "no prediction could be compared with a measurement");
        };
        let angle = |scored: &Scored| scored.angle.and_then(|angle| angle.mean_deg);
        let posed = angle(&fit.before).map_or(String::new(), |deg| format!(", angle error {deg:.1}°"));
        let mut text = format!("{before:.1} dB{posed} on {}", counted(fit.pairs, "pair"));
        let Some(after) = fit.closed_form.as_ref().and_then(db) else { return Fact::plain(Topic::Generator, text) };
        if let Some(objection) = fit.objections.first() {
            text += &format!("; no fit: {objection}");
            return Fact::plain(Topic::Generator, text).graded(Grade::Caution);
        }
        if after < before + GAIN_DB {
            text += &format!("; a fit would not help ({after:.1} dB on pairs that were left out)");
            return Fact::plain(Topic::Generator, text);
        }
        // What is read and predicted grows with the pairs, the rest hardly.
        let seconds = fit.seconds * self.all as f64 / fit.pairs.max(1) as f64;
        text += &format!(
            "; fit to your {}: {}, expected about {after:.0} dB",
            counted(self.all, "pair"),
            duration(seconds)
        );
        Fact::plain(Topic::Generator, text).graded(Grade::Caution).with_cure(Cure::Fit { pairs: self.all })
    }

    fn of_masks(&self, masks: &MaskWorth) -> Fact {
        let text = format!("{} on {}", masks.text(), counted(masks.grasps, "grasp"));
        let fine = masks.iou >= TOLERABLE_IOU && masks.angle.mean_deg.is_some_and(|deg| deg <= TOLERABLE_DEG);
        if fine {
            return Fact::plain(Topic::MaskModel, text);
        }
        // The button stands with the masks.
        Fact::plain(Topic::MaskModel, format!("{text}: train it on masks from CAD")).graded(Grade::Caution)
    }
}

/// A length of time in words.
fn duration(seconds: f64) -> String {
    if seconds < 90.0 { format!("{:.0} s", seconds.max(1.0)) } else { format!("{:.0} min", seconds / 60.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::metrics::AngleSummary;

    #[test]
    fn a_bad_mask_model_is_told_to_learn_and_a_good_one_is_not() {
        let of = |iou, errors: &[f64]| {
            let masks = MaskWorth { grasps: errors.len(), iou, angle: AngleSummary::from_errors(errors) };
            Worth { all: 40, masks: Some(masks), ..Worth::default() }.facts()
        };
        let bad = of(0.6, &[0.01, 0.3]);
        assert_eq!((bad.len(), bad[0].grade), (1, Grade::Caution));
        assert!(bad[0].text.contains("IoU 0.60") && bad[0].text.contains("50 % within 5°"), "{}", bad[0].text);
        assert!(bad[0].text.ends_with("train it on masks from CAD"), "{}", bad[0].text);
        assert_eq!(of(0.9, &[0.01, 0.02])[0].grade, Grade::Plain);
        let lost = of(0.9, &[f64::NAN]);
        assert!(lost[0].text.contains("no pose found") && lost[0].grade == Grade::Caution, "{}", lost[0].text);
        let untried = Worth { no_fit: Some("no pair can be used".into()), ..Worth::default() }.facts();
        assert!(untried[0].text.contains("no pair can be used") && untried[0].cures.is_empty());
        assert_eq!((duration(0.2), duration(61.0), duration(600.0)), ("1 s".into(), "61 s".into(), "10 min".into()));
    }
}
