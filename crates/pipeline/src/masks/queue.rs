//! Order of the pairs by how much they are worth a look: [`queue`].
//!
//! A pair's uncertainty has parts, each a metric with its unit. Parts of different units are put together by how a pair
//! stands among all that have the part.

use serde::Serialize;
use strum::{EnumIter, EnumString, IntoEnumIterator as _, IntoStaticStr};

use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::scores::evaluate::{Evaluation, Setup, evaluate, known};
use crate::steps::models::Models;
use touch2touch_core::dataset::{Index, PairId};
use touch2touch_core::evaluation::{Metric, Scores};

/// Metric that a queue is ordered by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, EnumIter, EnumString, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum QueueBy {
    /// All parts together.
    #[default]
    Overall,
    /// Distance of the mask drawn by hand from the mask model's.
    Disagreement,
    /// Share of pixels that the mask model is unsure of.
    Probability,
    /// The error of the angle.
    Angle,
    /// Spread of predictions with different seeds.
    Spread,
}

impl QueueBy {
    /// The name on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        self.metric().map_or("Overall", Metric::name)
    }

    /// Description in a line.
    pub fn tip(self) -> &'static str {
        self.metric().map_or("The mean of the ranks by each metric that the pair has", Metric::tip)
    }

    /// The metric that it is; `None` for all of them.
    pub fn metric(self) -> Option<Metric> {
        Some(match self {
            Self::Overall => return None,
            Self::Disagreement => Metric::Disagreement,
            Self::Probability => Metric::Unsure,
            Self::Angle => Metric::Angle,
            Self::Spread => Metric::SeedSpread,
        })
    }
}

/// One reason to look at a pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Metric that it is a value of.
    pub metric: Metric,
    /// The value, in the metric's own unit (radians, meters, shares).
    pub value: f64,
    /// Share of the other pairs with this metric that are better, 0..1; those that are equal count half.
    pub rank: f64,
}

/// A pair in the queue.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Queued {
    /// Reasons to look at the pair, one for each metric that is known.
    pub parts: Vec<Part>,
    /// The mean of the ranks of the parts; `None` where nothing is known.
    pub overall: Option<f64>,
}

impl Queued {
    /// One of its parts.
    pub fn part(&self, metric: Metric) -> Option<&Part> {
        self.parts.iter().find(|part| part.metric == metric)
    }

    /// Rank that it is ordered by: the greater, the earlier.
    fn weight(&self, by: QueueBy) -> Option<f64> {
        by.metric().map_or(self.overall, |metric| self.part(metric).map(|part| part.rank))
    }

    /// The part that says most why it stands where it does.
    pub fn reason(&self, by: QueueBy) -> Option<&Part> {
        match by.metric() {
            Some(metric) => self.part(metric),
            // The first of equal ones.
            None => self.parts.iter().rev().max_by(|a, b| a.rank.total_cmp(&b.rank)),
        }
    }
}

/// All pairs of a data set with their uncertainty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Queue {
    /// In the order of the index.
    pub pairs: Vec<Queued>,
}

impl Queue {
    /// Of metrics that are known: those of the measured imprints.
    pub fn of(index: &Index, scores: &[Scores]) -> Self {
        let mut pairs = vec![Queued::default(); index.pairs.len()];
        let Some(measured) = scores.iter().find(|scores| scores.upper_bound) else { return Self { pairs } };
        let places: std::collections::BTreeMap<&str, usize> =
            index.pairs.iter().map(|entry| entry.name.as_str()).zip(0..).collect();
        for metric in QueueBy::iter().filter_map(QueueBy::metric) {
            let value = |grasp: &touch2touch_core::evaluation::GraspScore| {
                Some((*places.get(grasp.pair.as_str())?, grasp.metric(metric)?))
            };
            let values: Vec<(usize, f64)> = measured.grasps.iter().filter_map(value).collect();
            let mut sorted: Vec<f64> = values.iter().map(|(_, value)| metric.badness(*value)).collect();
            sorted.sort_by(f64::total_cmp);
            for (at, value) in values {
                let rank = rank(&sorted, metric.badness(value));
                pairs[at].parts.push(Part { metric, value, rank });
            }
        }
        for pair in &mut pairs {
            let sum: f64 = pair.parts.iter().map(|part| part.rank).sum();
            pair.overall = (!pair.parts.is_empty()).then(|| sum / pair.parts.len() as f64);
        }
        Self { pairs }
    }

    /// The pair's uncertainty.
    pub fn get(&self, pair: PairId) -> Option<&Queued> {
        self.pairs.get(pair.0 as usize).filter(|queued| !queued.parts.is_empty())
    }

    /// Pairs of which something is known.
    pub fn known(&self) -> usize {
        self.pairs.iter().filter(|queued| !queued.parts.is_empty()).count()
    }

    /// Sorts pairs, the most uncertain first; of equal ones, and of those of which nothing is known, as they stood.
    pub fn sort(&self, pairs: &mut [PairId], by: QueueBy) {
        let weight = |id: &PairId| self.get(*id).and_then(|queued| queued.weight(by)).unwrap_or(-1.0);
        pairs.sort_by(|a, b| weight(b).total_cmp(&weight(a)));
    }

    /// All pairs in their order.
    pub fn order(&self, by: QueueBy) -> Vec<PairId> {
        let mut all: Vec<PairId> = (0u32..).map(PairId).take(self.pairs.len()).collect();
        self.sort(&mut all, by);
        all
    }
}

/// The share of other values below this one, of sorted values that it is among.
fn rank(sorted: &[f64], value: f64) -> f64 {
    let below = sorted.partition_point(|other| other.total_cmp(&value).is_lt());
    let equal = sorted.partition_point(|other| other.total_cmp(&value).is_le()) - below;
    let others = sorted.len().saturating_sub(1);
    if others == 0 { 0.5 } else { (below as f64 + 0.5 * equal.saturating_sub(1) as f64) / others as f64 }
}

/// Setup that scores the measured imprints alone: no generator is run.
pub fn measured_only(setup: &Setup) -> Setup {
    Setup { bundles: Vec::new(), grasps_per_tool: None, ..setup.clone() }
}

/// Ranks all pairs of a data set: scores the measured imprints of those that were not scored before, and looks up what is
/// kept. With what could not be scored.
///
/// # Errors
/// As [`evaluate`]: a source without depth in meters has nothing to be scored.
pub fn queue(dataset: &Dataset, setup: &Setup, models: &Models, cx: &JobCx) -> Result<(Queue, Evaluation), TaskError> {
    let evaluation = evaluate(dataset, &measured_only(setup), models, cx)?;
    let scores = known(dataset, setup, models)?;
    Ok((Queue::of(&dataset.index, &scores), evaluation))
}

/// A line of a queue, for programs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// The pair's name.
    pub pair: String,
    /// Tool of the pair.
    pub tool: Option<String>,
    /// Review state of the pair.
    pub review: &'static str,
    /// Mean of the ranks, 0..1.
    pub overall: Option<f64>,
    /// One minus the Dice of hand and model, 0..1.
    pub disagreement: Option<f64>,
    /// Share of pixels with a probability near one half, 0..1.
    pub unsure: Option<f64>,
    /// Error of the angle; missing (with `no_pose`) where there is no pose.
    pub angle_error_deg: Option<f64>,
    /// True where no pose was found.
    pub no_pose: bool,
    /// Standard deviation between seeds.
    pub seed_spread_mm: Option<f64>,
    /// Why it stands where it does, in words; empty where nothing is known.
    pub why: String,
}

impl Queue {
    /// The lines of the queue in their order.
    pub fn lines(&self, index: &Index, by: QueueBy, review: impl Fn(&str) -> crate::labels::Review) -> Vec<Line> {
        let line = |id: PairId| {
            let (entry, queued) = (index.get(id)?, self.pairs.get(id.0 as usize)?);
            let value = |metric: Metric| queued.part(metric).map(|part| part.value);
            let shown = |metric: Metric| value(metric).map(|v| metric.shown(v)).filter(|v| v.is_finite());
            Some(Line {
                pair: entry.name.clone(),
                tool: entry.tool.clone(),
                review: review(&entry.name).stored(),
                overall: queued.overall,
                disagreement: value(Metric::Disagreement),
                unsure: value(Metric::Unsure),
                angle_error_deg: shown(Metric::Angle),
                no_pose: value(Metric::Angle).is_some_and(f64::is_nan),
                seed_spread_mm: shown(Metric::SeedSpread),
                why: queued.reason(by).map_or_else(String::new, Part::text),
            })
        };
        self.order(by).into_iter().filter_map(line).collect()
    }
}

impl Part {
    /// The value with its metric and unit, e.g. `Model unsure 4.1 %`.
    pub fn text(&self) -> String {
        format!("{} {}", self.metric.name(), self.metric.text(self.value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::dataset::{PairEntry, Split};
    use touch2touch_core::evaluation::{GraspScore, Group};
    use touch2touch_core::label::Doubt;
    use touch2touch_core::sample::Scale;

    fn index(names: &[&str]) -> Index {
        let entry = |name: &&str| PairEntry { name: (*name).into(), tool: None, split: Split::None, number: 0 };
        Index { pairs: names.iter().map(entry).collect() }
    }

    fn grasp(pair: &str, angle_deg: Option<f64>, unsure: Option<f64>, disagreement: Option<f64>) -> GraspScore {
        GraspScore {
            pair: pair.into(),
            tool: None,
            group: Group::Unknown,
            scale: Scale::Measured,
            images: Vec::new(),
            position_error_m: None,
            angle_error_rad: angle_deg.map(f64::to_radians),
            verdict: None,
            doubt: Doubt { unsure, disagreement },
            seed_spread_m: None,
        }
    }

    fn scores(grasps: Vec<GraspScore>) -> Vec<Scores> {
        vec![Scores { method: "Measured".into(), upper_bound: true, grasps, measured_features: Vec::new() }]
    }

    #[test]
    fn the_most_uncertain_come_first_and_say_why() {
        let index = index(&["a", "b", "c", "d"]);
        let queue = Queue::of(
            &index,
            &scores(vec![
                grasp("b", Some(1.0), Some(0.01), Some(0.5)),
                grasp("c", Some(f64::NAN), Some(0.02), None),
                grasp("d", Some(9.0), Some(0.005), None),
                grasp("elsewhere", Some(90.0), Some(0.9), Some(0.9)),
            ]),
        );
        let names = |by| -> String { queue.order(by).iter().map(|id| index.get(*id).unwrap().name.as_str()).collect() };
        // Without a pose is worse than any error; of "a" nothing is known.
        assert_eq!(names(QueueBy::Angle), "cdba");
        assert_eq!(names(QueueBy::Probability), "cbda");
        assert_eq!(names(QueueBy::Disagreement), "bacd", "the others as they stood");
        assert_eq!(names(QueueBy::Spread), "abcd");
        assert_eq!(names(QueueBy::Overall), "cbda");
        assert_eq!(queue.known(), 3);
        let b = queue.get(PairId(1)).unwrap();
        // Alone with its disagreement, it is neither high nor low by it.
        assert_eq!(b.parts.iter().map(|p| p.rank).collect::<Vec<_>>(), [0.5, 0.5, 0.0]);
        assert!((b.overall.unwrap() - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(b.reason(QueueBy::Probability).unwrap().text(), "Model unsure 1.0 %");
        assert_eq!(queue.get(PairId(2)).unwrap().reason(QueueBy::Overall).unwrap().text(), "Model unsure 2.0 %");
        let lines = queue.lines(&index, QueueBy::Angle, |_| Default::default());
        assert!(lines[0].no_pose && lines[0].angle_error_deg.is_none());
        assert_eq!((lines[3].why.as_str(), lines[3].overall), ("", None));
    }

    #[test]
    fn nothing_known_and_nothing_there_are_in_order() {
        let none = Queue::of(&index(&["a", "b"]), &[]);
        assert_eq!((none.order(QueueBy::Overall), none.known()), (vec![PairId(0), PairId(1)], 0));
        assert!(Queue::of(&index(&[]), &scores(Vec::new())).order(QueueBy::Angle).is_empty());
        // Equal ones share their rank.
        assert_eq!(rank(&[1.0, 1.0, 1.0], 1.0), 0.5);
        assert_eq!((rank(&[1.0, 2.0], 2.0), rank(&[1.0, 2.0], 1.0), rank(&[1.0], 1.0)), (1.0, 0.0, 0.5));
    }

    #[test]
    fn keys_are_the_ones_typed() {
        for by in QueueBy::iter() {
            assert_eq!(by.key().parse(), Ok(by));
        }
    }
}
