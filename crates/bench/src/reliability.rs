//! Reliability of the standard deviations that poses come with: how often an error stays within so many of them.

use serde::Serialize;

use touch2touch_core::align::Evidence;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::units::wrap_angle;

/// Errors in standard deviations: angle, y, z.
pub(super) type Scores = [f64; 3];

/// Errors of a pose in the standard deviations that its evidence foretells.
pub(super) fn scores(evidence: &Evidence, estimated: PlanarPose, truth: PlanarPose) -> Scores {
    let turned = wrap_angle(estimated.theta_rad - truth.theta_rad);
    let errors = [turned, estimated.y_m - truth.y_m, estimated.z_m - truth.z_m];
    std::array::from_fn(|i| errors[i] / evidence.uncertainty.covariance[i][i].sqrt())
}

/// Reliability over all cases with a pose.
#[derive(Debug, Serialize)]
pub(super) struct Reliability {
    /// Poses counted.
    poses: usize,
    /// Root of the mean squared score of angle, y and z: 1 where the standard deviations are right, more where they promise
    /// too much.
    rms: [f64; 3],
    /// Percent of the poses within one and within two standard deviations, of angle, y and z; a normal distribution has 68.3
    /// and 95.4.
    within_1: [f64; 3],
    within_2: [f64; 3],
    /// Of the angle: percent of the poses that a normal distribution has within some standard deviations, and that are.
    curve: Vec<[f64; 2]>,
}

impl Reliability {
    /// `None` without any pose.
    pub(super) fn of(scores: &[Scores]) -> Option<Self> {
        if scores.is_empty() {
            return None;
        }
        let within = |i: usize, limit: f64| {
            100.0 * scores.iter().filter(|s| s[i].abs() <= limit).count() as f64 / scores.len() as f64
        };
        let rms = |i: usize| (scores.iter().map(|s| s[i] * s[i]).sum::<f64>() / scores.len() as f64).sqrt();
        let curve =
            (0..=60).map(|step| f64::from(step) * 0.05).map(|limit| [100.0 * normal_within(limit), within(0, limit)]);
        Some(Self {
            poses: scores.len(),
            rms: std::array::from_fn(rms),
            within_1: std::array::from_fn(|i| within(i, 1.0)),
            within_2: std::array::from_fn(|i| within(i, 2.0)),
            curve: curve.collect(),
        })
    }

    /// `angle 0.89 (97 % within 2), y 0.9 (..), z ..`.
    pub(super) fn text(&self) -> String {
        let one = |(name, i): (&str, usize)| format!("{name} {:.2} ({:.0} %)", self.rms[i], self.within_2[i]);
        ["angle", "y", "z"].into_iter().zip(0..).map(one).collect::<Vec<_>>().join(", ")
    }
}

/// Share of a normal distribution within so many standard deviations.
fn normal_within(limit: f64) -> f64 {
    libm::erf(limit / std::f64::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_deviations_give_the_diagonal() {
        for (limit, share) in [(0.0, 0.0), (1.0, 0.682_689_5), (2.0, 0.954_499_7)] {
            assert!((normal_within(limit) - share).abs() < 1e-6, "{limit}");
        }
        // The quantiles of a normal distribution, by bisection.
        let quantile = |share: f64| {
            let (mut low, mut high) = (0.0, 8.0);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if normal_within(middle) < share { low = middle } else { high = middle }
            }
            low
        };
        let scores: Vec<Scores> = (0..2000).map(|i| [quantile((f64::from(i) + 0.5) / 2000.0); 3]).collect();
        let found = Reliability::of(&scores).unwrap();
        assert!((found.rms[0] - 1.0).abs() < 0.01 && (found.within_2[2] - 95.4).abs() < 0.1, "{found:?}");
        assert!(found.curve.iter().all(|[foretold, seen]| (foretold - seen).abs() < 0.1), "{found:?}");
        assert!(Reliability::of(&[]).is_none());
    }
}
