//! Figures of an engine: errors, times and flags over all cases and over each stratum.

use std::collections::BTreeMap;

use serde::Serialize;
use strum::IntoEnumIterator as _;

use touch2touch_bench::known::Stratum;
use touch2touch_core::metrics::AngleSummary;

/// Beyond this an answer is no answer, degrees.
pub(super) const GROSS_DEG: f64 = 20.0;

/// One case as one engine solved it.
#[derive(Clone, Debug)]
pub(super) struct Outcome {
    pub(super) stratum: Stratum,
    /// True where the tool is one straight bar, along which a pose is free.
    pub(super) straight: bool,
    /// Degrees; NaN without a pose.
    pub(super) error_deg: f64,
    /// Millimeters; NaN without a pose.
    pub(super) position_mm: f64,
    /// Median, shortest and first of the repetitions, milliseconds.
    pub(super) ms: f64,
    pub(super) best_ms: f64,
    pub(super) first_ms: f64,
    /// Nearest-surface questions; 0 if the engine does not say.
    pub(super) lookups: f64,
    /// True where the engine said that a direction of the pose is free; `None` if it cannot tell.
    pub(super) flagged: Option<bool>,
    /// Part of the engine that answered, if it says.
    pub(super) rung: Option<String>,
}

/// Metrics of a set of cases. Shares are percent of all cases, 0..100.
#[derive(Clone, Debug, Serialize)]
pub(super) struct AngleMetrics {
    #[serde(flatten)]
    pub(super) angles: AngleSummary,
    /// Largest error, degrees; `null` if no case has a pose.
    max_deg: Option<f64>,
    /// Percent of all cases with an error beyond 20 degrees or without a pose.
    pub(super) gross_20: f64,
    /// Median distance from the true place, millimeters, of the cases whose tool is not a straight bar.
    pub(super) position_median_mm: Option<f64>,
    /// Points to pose, one thread: median and 95th percentile over the cases of each case's median repetition.
    pub(super) median_ms: Option<f64>,
    pub(super) p95_ms: Option<f64>,
    /// Times of each case's fastest repetition, median and 95th percentile: the engine without disturbance by other
    /// programs.
    best_median_ms: Option<f64>,
    best_p95_ms: Option<f64>,
    /// Median over the cases of the first call, which finds nothing in the processor's cache.
    first_median_ms: Option<f64>,
    /// Median number of nearest-surface questions.
    pub(super) lookups_median: Option<f64>,
    /// Straight tools that were flagged as degenerate.
    flagged_right: usize,
    /// Straight tools that were not.
    flagged_missed: usize,
    /// Other tools that were.
    flagged_false: usize,
    /// Number of cases that each part of the engine answered.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) rungs: BTreeMap<String, usize>,
}

/// Metrics over everything and per stratum.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Summary {
    #[serde(flatten)]
    pub(super) all: AngleMetrics,
    /// `nominal`, `hard`, `degenerate`; those without a case are left out.
    pub(super) strata: BTreeMap<String, AngleMetrics>,
}

impl Summary {
    pub(super) fn new(outcomes: &[Outcome]) -> Self {
        let strata = Stratum::iter()
            .filter_map(|s| {
                let part: Vec<&Outcome> = outcomes.iter().filter(|o| o.stratum == s).collect();
                (!part.is_empty()).then(|| (s.to_string(), AngleMetrics::new(&part)))
            })
            .collect();
        Self { all: AngleMetrics::new(&outcomes.iter().collect::<Vec<_>>()), strata }
    }
}

impl AngleMetrics {
    fn new(outcomes: &[&Outcome]) -> Self {
        let errors: Vec<f64> = outcomes.iter().map(|o| o.error_deg.to_radians()).collect();
        let percent =
            |count: usize| if outcomes.is_empty() { 0.0 } else { 100.0 * count as f64 / outcomes.len() as f64 };
        let of = |value: &dyn Fn(&Outcome) -> f64, q: f64| quantile(outcomes.iter().map(|o| value(o)), q);
        let flags = |straight: bool, flag: bool| {
            outcomes.iter().filter(|o| o.straight == straight && o.flagged == Some(flag)).count()
        };
        let mut rungs = BTreeMap::new();
        for rung in outcomes.iter().filter_map(|o| o.rung.clone()) {
            *rungs.entry(rung).or_default() += 1;
        }
        Self {
            angles: AngleSummary::from_errors(&errors),
            max_deg: of(&|o| o.error_deg, 1.0),
            gross_20: percent(outcomes.iter().filter(|o| o.error_deg.is_nan() || o.error_deg > GROSS_DEG).count()),
            position_median_mm: quantile(outcomes.iter().filter(|o| !o.straight).map(|o| o.position_mm), 0.5),
            median_ms: of(&|o| o.ms, 0.5),
            p95_ms: of(&|o| o.ms, 0.95),
            best_median_ms: of(&|o| o.best_ms, 0.5),
            best_p95_ms: of(&|o| o.best_ms, 0.95),
            first_median_ms: of(&|o| o.first_ms, 0.5),
            lookups_median: of(&|o| o.lookups, 0.5).filter(|&n| n > 0.0),
            flagged_right: flags(true, true),
            flagged_missed: flags(true, false),
            flagged_false: flags(false, true),
            rungs,
        }
    }

    /// `6 of 7 straight tools flagged, 0 others`.
    pub(super) fn flags_text(&self) -> String {
        let straight = self.flagged_right + self.flagged_missed;
        format!("{} of {straight} straight tools flagged, {} others", self.flagged_right, self.flagged_false)
    }
}

/// The `q`-quantile of the values that are numbers, linear between neighbors; `None` without any.
pub(super) fn quantile(values: impl Iterator<Item = f64>, q: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let rank = q * last as f64;
    let low = values[rank.floor() as usize];
    Some(low + (values[rank.ceil() as usize] - low) * rank.fract())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(stratum: Stratum, error_deg: f64, flagged: bool) -> Outcome {
        Outcome {
            stratum,
            straight: stratum == Stratum::Degenerate,
            error_deg,
            position_mm: 2.0 * error_deg,
            ms: 1.0 + error_deg,
            best_ms: 1.0,
            first_ms: 9.0,
            lookups: 10.0,
            flagged: Some(flagged),
            rung: Some("fast".into()),
        }
    }

    #[test]
    fn shares_are_percent_of_all_cases_and_failures_count() {
        let outcomes = [
            outcome(Stratum::Nominal, 1.0, false),
            outcome(Stratum::Nominal, 3.0, true),
            outcome(Stratum::Hard, 30.0, false),
            outcome(Stratum::Degenerate, f64::NAN, true),
        ];
        let summary = Summary::new(&outcomes);
        assert_eq!((summary.all.angles.success_5, summary.all.gross_20), (50.0, 50.0));
        assert_eq!((summary.all.angles.count, summary.all.angles.failed), (4, 1));
        assert_eq!(summary.all.position_median_mm, Some(6.0), "straight tools do not count");
        assert_eq!((summary.all.flagged_right, summary.all.flagged_missed, summary.all.flagged_false), (1, 0, 1));
        assert_eq!(summary.all.rungs["fast"], 4);
        let nominal = &summary.strata["nominal"];
        assert_eq!((nominal.angles.mean_deg, nominal.median_ms), (Some(2.0), Some(3.0)));
        assert_eq!(summary.strata["degenerate"].median_ms, None);
        let json = serde_json::to_value(&summary).unwrap();
        for key in ["mean_deg", "median_deg", "success_5", "success_10", "gross_20", "median_ms", "p95_ms"] {
            assert!(json[key].is_number() && json["strata"]["hard"][key].is_number(), "{key}");
        }
    }

    #[test]
    fn quantiles_lie_between_neighbors() {
        let values = [4.0, 1.0, f64::NAN, 3.0, 2.0];
        assert_eq!(quantile(values.into_iter(), 0.5), Some(2.5));
        assert_eq!(quantile(values.into_iter(), 1.0), Some(4.0));
        assert_eq!(quantile(std::iter::empty(), 0.5), None);
    }
}
