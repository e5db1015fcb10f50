//! The angle errors of many grasps in four numbers.

use serde::Serialize;

/// Mean, median and success of the angle errors of a set of grasps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AngleSummary {
    /// Mean error of the grasps that have a pose, degrees; `None` if there is none.
    pub mean_deg: Option<f64>,
    /// Median of the same; the mean of the two middle ones for an even count.
    pub median_deg: Option<f64>,
    /// Percent of *all* grasps within 5 degrees (inclusive, as the lab counts).
    pub success_5: f64,
    /// Percent of all grasps within 10 degrees (inclusive).
    pub success_10: f64,
    /// Grasps in all.
    pub count: usize,
    /// Grasps without a pose: not in the mean, but failures for the success.
    pub failed: usize,
}

impl AngleSummary {
    /// From one error per grasp in *radians*, of either sign; NaN stands for a grasp without a pose.
    pub fn from_errors(errors: &[f64]) -> Self {
        let mut degrees: Vec<f64> = errors.iter().filter(|e| e.is_finite()).map(|e| e.to_degrees().abs()).collect();
        degrees.sort_by(f64::total_cmp);
        let n = degrees.len();
        // Rounding to 1e-9 degrees: five degrees turned to radians and back must stay within five degrees.
        let within = |limit: f64| {
            let hits = degrees.iter().filter(|&&d| d <= limit + 1e-9).count();
            if errors.is_empty() { 0.0 } else { 100.0 * hits as f64 / errors.len() as f64 }
        };
        Self {
            mean_deg: (n > 0).then(|| degrees.iter().sum::<f64>() / n as f64),
            median_deg: (n > 0).then(|| 0.5 * (degrees[(n - 1) / 2] + degrees[n / 2])),
            success_5: within(5.0),
            success_10: within(10.0),
            count: errors.len(),
            failed: errors.len() - n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_count_against_success_but_not_in_the_mean() {
        let errors = [1.0, -5.0, 10.0, 40.0].map(f64::to_radians);
        let all: Vec<f64> = errors.into_iter().chain([f64::NAN]).collect();
        let summary = AngleSummary::from_errors(&all);
        assert!((summary.mean_deg.unwrap() - 14.0).abs() < 1e-9);
        assert!((summary.median_deg.unwrap() - 7.5).abs() < 1e-9);
        assert_eq!((summary.success_5, summary.success_10), (40.0, 60.0));
        assert_eq!((summary.count, summary.failed), (5, 1));
        assert_eq!(AngleSummary::from_errors(&[]), AngleSummary::default());
        assert_eq!(AngleSummary::from_errors(&[f64::NAN]).mean_deg, None);
    }
}
