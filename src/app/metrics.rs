//! The figures of the pairs looked at so far, found among the results: with settings and labels as they are now.

use std::collections::{BTreeMap, BTreeSet};

use super::keys::{ComparisonKey, ImprintKey, ImprintSource, MaskVersion, PoseKey};
use super::state::State;
use crate::domain::dataset::PairId;
use crate::domain::rig::PadId;
use crate::domain::units;
use crate::work::compare::Comparison;
use crate::work::pose::PoseResult;

/// Figures of one prediction, or of a pair that was only aligned.
#[derive(Clone, Debug)]
pub struct PairMetrics<'a> {
    /// The pair.
    pub pair: PairId,
    /// The finger predicted; `None` where no prediction of the pair was compared.
    pub finger: Option<PadId>,
    /// The prediction shown for it against the measurement.
    pub comparison: Option<&'a Comparison>,
    /// The pair's poses, by [`ImprintSource`].
    pub poses: [PoseMetric; 2],
}

/// How far a pose is off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseMetric {
    /// Size of the angle's error, radians, where the truth is known.
    pub error_rad: Option<f64>,
    /// Whether a person set the pose.
    pub by_hand: bool,
}

impl State {
    /// The figures of every pair of the open data set that was compared or aligned as the settings say.
    pub fn metrics_so_far(&self) -> Vec<PairMetrics<'_>> {
        let Some(open) = &self.library.open else { return Vec::new() };
        let poses = self.poses_so_far();
        let chosen = self.results.chosen.iter().filter(|(touch, _)| touch.pair.dataset == open.seq);
        let mut found: Vec<PairMetrics<'_>> = chosen
            .filter_map(|(touch, recipe)| {
                // A finger that was not on screen was not compared.
                let comparison = self.results.comparisons.get(&ComparisonKey(recipe.clone(), self.settings.shift))?;
                let pair = touch.pair.pair;
                let poses = poses.get(&pair).copied().unwrap_or_default();
                Some(PairMetrics { pair, finger: Some(touch.finger), comparison: Some(comparison), poses })
            })
            .collect();
        let compared: BTreeSet<PairId> = found.iter().map(|figures| figures.pair).collect();
        let others = poses.into_iter().filter(|(pair, _)| !compared.contains(pair));
        found.extend(others.map(|(pair, poses)| PairMetrics { pair, finger: None, comparison: None, poses }));
        found
    }

    /// Of the poses among the results those that count now: of each pair and imprint the one from the most masks, and
    /// of these the most drawn by hand.
    fn poses_so_far(&self) -> BTreeMap<PairId, [PoseMetric; 2]> {
        let mut best: BTreeMap<(PairId, ImprintSource), ([usize; 2], &PoseResult)> = BTreeMap::new();
        for (key, pose) in self.results.poses.iter() {
            let Some(place) = self.place_now(key) else { continue };
            let masks = || key.cloud.parts.entries().filter_map(|(_, (_, mask))| mask.as_ref());
            let rank = [masks().count(), masks().filter(|mask| matches!(mask, MaskVersion::Hand(_))).count()];
            if best.get(&place).is_none_or(|(other, _)| *other < rank) {
                best.insert(place, (rank, pose));
            }
        }
        let mut found: BTreeMap<PairId, [PoseMetric; 2]> = BTreeMap::new();
        for ((pair, source), (_, pose)) in best {
            let labels = self.library.entry(pair).and_then(|entry| self.document.pair(&entry.name));
            // What a person set counts before what was registered.
            let hand = labels.and_then(|labels| labels.accepted(source)).filter(|accepted| accepted.by_hand);
            let error_rad = match (hand, pose.truth_rad) {
                (None, _) => pose.error_rad,
                (Some(_), None) => None,
                (Some(hand), Some(truth)) => Some(units::angle_error(hand.pose.planar.inverse().theta_rad, truth)),
            };
            found.entry(pair).or_default()[source as usize] = PoseMetric { error_rad, by_hand: hand.is_some() };
        }
        found
    }

    /// The pair and imprint that a pose is of, if it was made as settings, labels and chosen predictions say now.
    fn place_now(&self, key: &PoseKey) -> Option<(PairId, ImprintSource)> {
        let open = self.library.open.as_ref()?;
        let mut place = None;
        for (finger, (imprint, mask)) in key.cloud.parts.entries() {
            let touch = imprint.touch();
            let shown = match imprint {
                ImprintKey::Measured(_) => true,
                ImprintKey::Predicted(recipe, shift) => {
                    *shift == self.settings.shift && self.results.chosen.get(&touch) == Some(recipe)
                }
                ImprintKey::Mean(_) | ImprintKey::Picture(_) => false,
            };
            let in_force = match mask {
                None => true,
                Some(MaskVersion::Auto(recipe)) => self.automatic_recipe().as_ref() == Ok(recipe),
                Some(MaskVersion::Hand(revision)) => {
                    let name = &self.library.entry(touch.pair.pair)?.name;
                    self.document.hand_mask(name, finger).is_some_and(|hand| hand.revision == *revision)
                }
            };
            if !shown || !in_force || touch.pair.dataset != open.seq {
                return None;
            }
            place = Some((touch.pair.pair, imprint.side()));
        }
        place.filter(|_| key.engine == self.settings.pose_engine)
    }
}
