//! The verdict in the loop: try only where the pose is good, else grasp again, once.

use serde::Serialize;

use super::count::Share;
use crate::verdict::Grade;

/// Grasp with what trying it leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Tried {
    /// The verdict's grade; `None` without a pose.
    pub grade: Option<Grade>,
    /// True where an attempt by this pose succeeds; false without a pose.
    pub success: bool,
}

impl Tried {
    /// True where nothing speaks against the pose: a second grasp is not asked for.
    pub fn is_good(self) -> bool {
        self.grade == Some(Grade::Good)
    }
}

/// Choice of the robot after a second grasp whose pose is not good either.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum After {
    /// It tries, unless there is no pose at all.
    Try,
    /// It gives the tool back to a person.
    GiveUp,
}

/// Counts of trials with the verdict in the loop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Loop {
    /// Choice after a second doubt.
    pub after: After,
    /// Grasps that were made anew.
    pub regrasps: usize,
    /// Trials that ended without an attempt.
    pub refusals: usize,
    /// Successes among all trials.
    pub per_trial: Share,
    /// Successes among the attempts.
    pub per_try: Share,
}

/// Counts trials with the verdict in the loop: each is its first grasp, and the second where one was made.
///
/// A trial whose first grasp was not good and that has no second one counts as refused.
pub fn with_verdict(trials: impl IntoIterator<Item = (Tried, Option<Tried>)>, after: After) -> Loop {
    let (mut regrasps, mut refusals, mut count, mut hits, mut tries) = (0, 0, 0, 0, 0);
    for (first, second) in trials {
        count += 1;
        let held = if first.is_good() {
            Some(first)
        } else {
            regrasps += usize::from(second.is_some());
            second.filter(|held| held.is_good() || (after == After::Try && held.grade.is_some()))
        };
        match held {
            Some(held) => {
                tries += 1;
                hits += usize::from(held.success);
            }
            None => refusals += 1,
        }
    }
    Loop { after, regrasps, refusals, per_trial: Share::new(hits, count), per_try: Share::new(hits, tries) }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let found = with_verdict(trials, After::Try);
        assert_eq!((found.regrasps, found.refusals), (3, 1));
        assert_eq!((found.per_trial, found.per_try), (Share::new(3, 5), Share::new(3, 4)));
        let found = with_verdict(trials, After::GiveUp);
        assert_eq!((found.regrasps, found.refusals), (3, 2));
        assert_eq!((found.per_trial, found.per_try), (Share::new(2, 5), Share::new(2, 3)));
    }
}
