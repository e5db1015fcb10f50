//! [`Verdict`]: how much a registered pose can be relied on, without the truth, in words. One for every view, table and file.

use serde::{Deserialize, Serialize};

use crate::align::{AlignReport, Elsewhere, Evidence};
use crate::manual::PoseDifference;
use crate::units;

/// Limits of a good and of a usable angle, radians: the paper's.
const ANGLE_RAD: [f64; 2] = [5.0 / 180.0 * std::f64::consts::PI, 10.0 / 180.0 * std::f64::consts::PI];
/// Limits of a good and of a usable place, meters: a tenth and a half of what the gripper leaves open.
const PLACE_M: [f64; 2] = [1e-3, 5e-3];

/// Grade of a pose by how much it can be relied on; a later one is worse.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    strum::EnumIter,
    strum::Display,
    strum::EnumString,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Grade {
    /// Nothing speaks against it.
    Good,
    /// To be looked at.
    Check,
    /// Not to be used.
    Wrong,
}

impl Grade {
    /// The grade of a number by its limits of good and usable; what is no number is wrong.
    fn of(value: f64, [good, usable]: [f64; 2]) -> Self {
        match value {
            v if v <= good => Self::Good,
            v if v <= usable => Self::Check,
            _ => Self::Wrong,
        }
    }

    /// The grade of an error of the angle alone, radians: green, amber or red at the paper's 5 and 10 degrees.
    pub fn of_angle_error(error_rad: f64) -> Self {
        Self::of(error_rad.abs(), ANGLE_RAD)
    }

    /// The grade of a difference of poses.
    pub fn of_difference(off: PoseDifference) -> Self {
        Self::of_angle_error(off.angle_rad).max(Self::of(off.position_m, PLACE_M))
    }
}

/// Limits of one sign: beyond the first a pose is to be checked, beyond the second it is wrong. All from right poses on fresh
/// simulated grasps, of which about two of a hundred are doubted (`touch2touch-bench verdict`).
type Limits = [f64; 2];

/// Share of the misfit that goes away if the fingers are swapped. A straight tool fits about as well either way.
const SWAPPED: Limits = [0.08, 0.14];
/// Share of the fingers' misfit that goes away if each may have its own pose.
const FINGERS: Limits = [0.13, 0.2];
/// Difference of the angle and of the place that the fingers then have, radians and meters: below, it is no fault.
const APART_RAD: Limits = [3.0 / 180.0 * std::f64::consts::PI, 5.0 / 180.0 * std::f64::consts::PI];
const APART_M: Limits = [2e-3, 4e-3];
/// Share of the misfit that goes away elsewhere near by, without the mask.
const ELSEWHERE: Limits = [0.1, 0.3];
/// One minus likeness, plus this share of the contact off the tool, of which no more than so much counts: where the relief is
/// like the tool's, the mask is at fault.
const MISFIT: Limits = [0.6, 0.72];
const OFF_COUNTS: f64 = 0.7;
const OFF_CAP: f64 = 0.4;
/// Share of contact off the tool.
const OFF: Limits = [0.5, f64::INFINITY];
/// Standard deviation of the angle, radians.
const ANGLE_SD_RAD: Limits = [2.0 / 180.0 * std::f64::consts::PI, 8.0 / 180.0 * std::f64::consts::PI];
/// Standard deviation of the place where it is known least, meters.
const PLACE_SD_M: Limits = [2e-3, f64::INFINITY];

/// Verdict on a pose: all that speaks against it, without the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// The worst of what was found.
    pub grade: Grade,
    /// The reason, in a sentence: the worst of what was found, or how well it fits.
    pub why: String,
    /// Everything that speaks against it, the worst first.
    pub against: Vec<Sign>,
}

/// Sign that speaks against a pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sign {
    /// Weight of it.
    pub grade: Grade,
    /// In a few words.
    pub what: String,
}

impl Verdict {
    /// The verdict on the answer of a registration; `None` unless its evidence was asked for.
    pub fn of(report: &AlignReport) -> Option<Self> {
        let evidence = report.evidence.as_ref()?;
        let mut against = signs(report, evidence);
        against.retain(|sign| sign.grade > Grade::Good);
        against.sort_by_key(|sign| std::cmp::Reverse(sign.grade));
        let (grade, why) = match against.first() {
            Some(sign) => (sign.grade, sign.what.clone()),
            None => (Grade::Good, fits(evidence)),
        };
        Some(Self { grade, why, against })
    }
}

/// The sentence of a pose that nothing speaks against.
fn fits(evidence: &Evidence) -> String {
    let on = format!("{:.0} % of the contact lies on the tool", 100.0 * evidence.on_tool);
    match evidence.membrane {
        Some(membrane) => format!("{on}, the membrane's relief is like the tool's ({:.2})", membrane.likeness),
        None => on,
    }
}

fn signs(report: &AlignReport, evidence: &Evidence) -> Vec<Sign> {
    let mut signs = Vec::new();
    let mut sign = |grade, what| signs.push(Sign { grade, what });
    if !report.within_prior {
        sign(Grade::Wrong, "the gripper cannot hold it so (±22.5°, ±5 mm)".to_owned());
    }
    let off = 1.0 - evidence.on_tool;
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    if let Some(membrane) = evidence.membrane {
        if let Some(gain) = membrane.swapped {
            sign(Grade::of(gain, SWAPPED), "the imprints fit better with the fingers swapped".to_owned());
        }
        let way = |to: Elsewhere| format!("{} and {}", units::text_deg(to.angle_rad), units::text_mm(to.position_m));
        if let Some(fingers) = membrane.fingers {
            let apart = Grade::of(fingers.angle_rad, APART_RAD).max(Grade::of(fingers.position_m, APART_M));
            let what = format!("the fingers do not agree: they are {} apart", way(fingers));
            sign(Grade::of(fingers.gain, FINGERS).min(apart), what);
        }
        let what = format!("the membranes fit better {} from here: look at the mask", way(membrane.own));
        sign(Grade::of(membrane.own.gain, ELSEWHERE), what);
        let grade = Grade::of(1.0 - membrane.likeness + OFF_COUNTS * off.min(OFF_CAP), MISFIT);
        let (likeness, off) = (membrane.likeness, percent(off));
        let what = format!("the contact is not like this tool's (likeness {likeness:.2}, {off} of it off the tool)");
        sign(grade, what);
    }
    sign(Grade::of(off, OFF), format!("{} of the contact mask lie off the tool", percent(off)));
    let angle_rad = evidence.uncertainty.angle_rad();
    let what = format!("the contact leaves the angle open (±{})", units::text_deg(angle_rad));
    sign(Grade::of(angle_rad, ANGLE_SD_RAD), what);
    let place_m = evidence.uncertainty.place_m(report.grasp_from_object);
    let what = format!("the contact leaves the place open (±{})", units::text_mm(place_m));
    sign(Grade::of(place_m, PLACE_SD_M), what);
    if let Some(fit) = report.joint.filter(|fit| !fit.basis.has_membrane()) {
        sign(Grade::Check, fit.basis.to_string());
    }
    signs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_graded_by_its_limits_and_what_is_no_number_is_wrong() {
        let at = |deg: f64| Grade::of_angle_error(deg.to_radians());
        assert_eq!([at(0.0), at(-4.9), at(9.0), at(11.0)], [Grade::Good, Grade::Good, Grade::Check, Grade::Wrong]);
        assert_eq!(at(f64::NAN), Grade::Wrong);
        assert!(Grade::Wrong > Grade::Check && Grade::Check > Grade::Good);
        // A place far off is not made good by its angle.
        let off = PoseDifference { angle_rad: 0.0, position_m: 0.02 };
        assert_eq!(Grade::of_difference(off), Grade::Wrong);
        assert_eq!(("check".parse(), Grade::Wrong.to_string()), (Ok(Grade::Check), "wrong".to_owned()));
    }
}
