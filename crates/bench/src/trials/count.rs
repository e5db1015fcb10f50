//! Counts of trials: [`Share`], and [`with_verdict`] for a robot that tries only where the pose is good, else grasps again, once.

use serde::Serialize;
use touch2touch_core::verdict::Grade;

/// Normal quantile of a two-sided 95 % interval.
const Z: f64 = 1.959_963_985;

/// So many of so many, with the 95 % interval of Wilson's score, which holds for small counts and at none and all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Share {
    pub(super) hits: usize,
    pub(super) of: usize,
    /// Lower and upper end of the interval of the share, 0..1; 0 and 1 where nothing was tried.
    interval: [f64; 2],
}

impl Share {
    /// The share of `hits` among `of`.
    pub(super) fn new(hits: usize, of: usize) -> Self {
        let n = of as f64;
        let interval = if of == 0 {
            [0.0, 1.0]
        } else {
            let p = hits as f64 / n;
            let middle = p + Z * Z / (2.0 * n);
            let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
            let scale = 1.0 + Z * Z / n;
            // Rounding must not put an end beyond the share itself.
            [((middle - half) / scale).clamp(0.0, p), ((middle + half) / scale).clamp(p, 1.0)]
        };
        Self { hits, of, interval }
    }

    /// The share of the true ones.
    pub(super) fn count(successes: impl IntoIterator<Item = bool>) -> Self {
        let (hits, of) = successes.into_iter().fold((0, 0), |(hits, of), one| (hits + usize::from(one), of + 1));
        Self::new(hits, of)
    }
}

impl std::fmt::Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, high] = self.interval.map(|end| 100.0 * end);
        write!(f, "{}/{} ({low:.0}-{high:.0} %)", self.hits, self.of)
    }
}

/// Grasp with what trying it leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tried {
    /// The verdict's grade; `None` without a pose.
    pub(super) grade: Option<Grade>,
    /// True where an attempt by this pose succeeds; false without a pose.
    pub(super) success: bool,
}

impl Tried {
    /// True where nothing speaks against the pose: a second grasp is not asked for.
    pub(super) fn is_good(self) -> bool {
        self.grade == Some(Grade::Good)
    }
}

/// Counts of trials with the verdict in the loop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Loop {
    /// What comes after a second grasp whose pose is not good either: the robot tries, unless there is no pose at all.
    after: &'static str,
    /// Grasps that were made anew.
    pub(super) regrasps: usize,
    /// Trials that ended without an attempt.
    pub(super) refusals: usize,
    /// Successes among all trials.
    pub(super) per_trial: Share,
    /// Successes among the attempts.
    pub(super) per_try: Share,
}

/// Counts trials with the verdict in the loop: each is its first grasp, and the second where one was made.
///
/// A trial whose first grasp was not good and that has no second one counts as refused.
pub(super) fn with_verdict(trials: impl IntoIterator<Item = (Tried, Option<Tried>)>) -> Loop {
    let (mut regrasps, mut refusals, mut count, mut hits, mut tries) = (0, 0, 0, 0, 0);
    for (first, second) in trials {
        count += 1;
        let held = if first.is_good() {
            Some(first)
        } else {
            regrasps += usize::from(second.is_some());
            second.filter(|held| held.grade.is_some())
        };
        match held {
            Some(held) => {
                tries += 1;
                hits += usize::from(held.success);
            }
            None => refusals += 1,
        }
    }
    Loop { after: "try", regrasps, refusals, per_trial: Share::new(hits, count), per_try: Share::new(hits, tries) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_wilsons() {
        // Newcombe 1998, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29, score method without correction.
        for (hits, of, low, high) in
            [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)]
        {
            let share = Share::new(hits, of);
            assert!((share.interval[0] - low).abs() < 5e-5 && (share.interval[1] - high).abs() < 5e-5, "{share:?}");
        }
        assert_eq!(Share::new(0, 0).interval, [0.0, 1.0]);
    }

    #[test]
    fn a_good_pose_is_tried_and_any_other_is_grasped_again() {
        let tried = |grade, success| Tried { grade, success };
        let trials = [
            // Good at once: the second grasp is never looked at.
            (tried(Some(Grade::Good), true), None),
            (tried(Some(Grade::Good), false), Some(tried(Some(Grade::Good), true))),
            // Doubted, then good.
            (tried(Some(Grade::Check), false), Some(tried(Some(Grade::Good), true))),
            // Doubted twice.
            (tried(Some(Grade::Wrong), false), Some(tried(Some(Grade::Check), true))),
            // Never a pose.
            (tried(None, false), Some(tried(None, false))),
        ];
        let found = with_verdict(trials);
        assert_eq!((found.regrasps, found.refusals), (3, 1));
        assert_eq!((found.per_trial, found.per_try), (Share::new(3, 5), Share::new(3, 4)));
    }
}
