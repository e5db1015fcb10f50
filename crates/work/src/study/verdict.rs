//! [`Verdict`]: how much a registered pose can be relied on, in words: one for the 3D views, the figures and the tables.

use crate::pose::PoseResult;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::PoseDifference;
use touch2touch_core::units;

/// Limits of a good and of a usable angle, radians: the paper's.
const ANGLE_RAD: [f64; 2] = [5.0 / 180.0 * std::f64::consts::PI, 10.0 / 180.0 * std::f64::consts::PI];
/// Limits of a good and of a usable place, meters: a tenth and a half of what the gripper leaves open.
const PLACE_M: [f64; 2] = [1e-3, 5e-3];

/// Grade of a pose by how much it can be relied on; a later one is worse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grade {
    /// Nothing is known against it, and nothing for it: there is no truth.
    Open,
    /// Close to the truth.
    Good,
    /// To be looked at.
    Caution,
    /// Not to be used.
    Wrong,
}

impl Grade {
    /// The grade of a number by its limits of good and usable; what is no number is wrong.
    fn of(value: f64, [good, usable]: [f64; 2]) -> Self {
        match value {
            v if v <= good => Self::Good,
            v if v <= usable => Self::Caution,
            _ => Self::Wrong,
        }
    }

    /// The grade of an error of the angle alone, radians: green, amber or red at the paper's 5 and 10 degrees.
    pub fn of_angle_error(error_rad: f64) -> Self {
        Self::of(error_rad, ANGLE_RAD)
    }

    /// The grade of a difference of poses.
    pub(crate) fn of_difference(off: PoseDifference) -> Self {
        Self::of_angle_error(off.angle_rad).max(Self::of(off.position_m, PLACE_M))
    }
}

/// Verdict on a pose: all that speaks for or against it.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The worst of what is known.
    pub grade: Grade,
    /// Everything known, each in a few words, the worst first.
    pub findings: Vec<(Grade, String)>,
}

impl Verdict {
    /// The verdict on a pose; `truth` is `grasp_from_object`, where known.
    pub fn of(pose: &PoseResult, truth: Option<PlanarPose>) -> Self {
        let mut findings = Vec::new();
        if let Some(truth) = truth {
            let off = PoseDifference::between(pose.grasp_from_object, truth);
            let text = format!("off by {}, {}", units::text_deg(off.angle_rad), units::text_mm(off.position_m));
            findings.push((Grade::of_difference(off), text));
        }
        if !pose.report.within_prior {
            findings.push((Grade::Wrong, "the gripper cannot hold it so (±22.5°, ±5 mm)".into()));
        }
        if pose.report.is_degenerate() {
            findings.push((Grade::Caution, "not determined by the contact".into()));
        }
        if pose.report.refused().is_some() {
            findings.push((Grade::Caution, "a cheaper place was refused: the gripper cannot hold it so".into()));
        }
        findings.sort_by_key(|(grade, _)| std::cmp::Reverse(*grade));
        Self { grade: findings.first().map_or(Grade::Open, |(grade, _)| *grade), findings }
    }

    /// The findings in one line.
    pub fn text(&self) -> String {
        let words: Vec<&str> = self.findings.iter().map(|(_, why)| why.as_str()).collect();
        words.join(" · ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_graded_by_its_limits_and_what_is_no_number_is_wrong() {
        let at = |deg: f64| Grade::of_angle_error(deg.to_radians());
        assert_eq!([at(0.0), at(4.9), at(9.0), at(11.0)], [Grade::Good, Grade::Good, Grade::Caution, Grade::Wrong]);
        assert_eq!(at(f64::NAN), Grade::Wrong);
        assert!(Grade::Wrong > Grade::Caution && Grade::Good > Grade::Open);
        // A place far off is not made good by its angle.
        let off = PoseDifference { angle_rad: 0.0, position_m: 0.02 };
        assert_eq!(Grade::of_difference(off), Grade::Wrong);
    }
}
