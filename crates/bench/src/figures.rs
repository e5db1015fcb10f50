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
    /// Median of the repetitions, milliseconds.
    pub(super) ms: f64,
}

/// Metrics of a set of cases. Shares are percent of all cases, 0..100.
#[derive(Clone, Debug, Serialize)]
pub(super) struct AngleMetrics {
    #[serde(flatten)]
    pub(super) angles: AngleSummary,
    /// Percent of all cases with an error beyond 20 degrees or without a pose.
    pub(super) gross_20: f64,
    /// Median distance from the true place, millimeters, of the cases whose tool is not a straight bar.
    pub(super) position_median_mm: Option<f64>,
    /// Points to pose, one thread: median and 95th percentile over the cases of each case's median repetition.
    pub(super) median_ms: Option<f64>,
    pub(super) p95_ms: Option<f64>,
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
        Self {
            angles: AngleSummary::from_errors(&errors),
            gross_20: percent(outcomes.iter().filter(|o| o.error_deg.is_nan() || o.error_deg > GROSS_DEG).count()),
            position_median_mm: quantile(outcomes.iter().filter(|o| !o.straight).map(|o| o.position_mm), 0.5),
            median_ms: of(&|o| o.ms, 0.5),
            p95_ms: of(&|o| o.ms, 0.95),
        }
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

    fn outcome(stratum: Stratum, error_deg: f64) -> Outcome {
        Outcome {
            stratum,
            straight: stratum == Stratum::Degenerate,
            error_deg,
            position_mm: 2.0 * error_deg,
            ms: 1.0 + error_deg,
        }
    }

    #[test]
    fn shares_are_percent_of_all_cases_and_failures_count() {
        let outcomes = [
            outcome(Stratum::Nominal, 1.0),
            outcome(Stratum::Nominal, 3.0),
            outcome(Stratum::Hard, 30.0),
            outcome(Stratum::Degenerate, f64::NAN),
        ];
        let summary = Summary::new(&outcomes);
        assert_eq!((summary.all.angles.success_5, summary.all.gross_20), (50.0, 50.0));
        assert_eq!((summary.all.angles.count, summary.all.angles.failed), (4, 1));
        assert_eq!(summary.all.position_median_mm, Some(6.0), "straight tools do not count");
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
