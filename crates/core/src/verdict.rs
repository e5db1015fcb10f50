//! [`Verdict`]: how much a registered pose can be relied on, without the truth, in words. One for every view, table and file.

use glam::DVec2;
use serde::{Deserialize, Serialize, Serializer};
use serde_json::json;

use crate::align::{self, AlignReport, Basis, Evidence, PLACE_OPEN_M, Prior};
use crate::manual::PoseDifference;
use crate::units;

/// Limits of a good and of a usable angle, radians: the paper's.
const ANGLE_RAD: [f64; 2] = [5.0 / 180.0 * std::f64::consts::PI, 10.0 / 180.0 * std::f64::consts::PI];

/// Grade of a pose by how much it can be relied on; a later one is worse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::Display, strum::EnumString)]
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
}

/// Limits of one sign: beyond the first a pose is to be checked, beyond the second it is wrong. All from right poses on fresh
/// simulated grasps, of which about three of a hundred are doubted (`touch2touch-bench verdict`).
type Limits = [f64; 2];

/// Limits of the signs whose meaning depends on the membranes.
struct Membranes {
    /// Share of the misfit that goes away if the fingers are swapped. A straight tool fits about as well either way.
    swapped: Limits,
    /// Share of the fingers' misfit that goes away if each may have its own pose.
    fingers: Limits,
    /// Share of the misfit that goes away elsewhere near by, without the mask.
    elsewhere: Limits,
    /// One minus likeness, plus [`OFF_COUNTS`] times the share of the contact off the tool, of which no more than [`OFF_CAP`] counts:
    /// where the relief is like the tool's, the mask is at fault.
    misfit: Limits,
    /// Standard deviation of the angle, radians.
    angle_rad: Limits,
}

/// Membranes that the tool explains.
const EXPLAINED: Membranes = Membranes {
    swapped: [0.08, 0.14],
    fingers: [0.13, 0.2],
    elsewhere: [0.1, 0.3],
    misfit: [0.6, 0.72],
    angle_rad: [3.5 / 180.0 * std::f64::consts::PI, 12.0 / 180.0 * std::f64::consts::PI],
};
/// Predictions that are no membrane of this tool at this pressure ([`Basis::Unlike`]), most of them of light grasps. The mask gives
/// the pose and every one is to be checked for it; wrong is only what such predictions of right poses do not show. Where the
/// membranes would rather have the tool, which is what spreads the angle there, says nothing.
const UNLIKE: Membranes = Membranes {
    swapped: [0.45; 2],
    fingers: [0.3; 2],
    elsewhere: [f64::INFINITY; 2],
    misfit: [0.9; 2],
    angle_rad: [EXPLAINED.angle_rad[0], f64::INFINITY],
};
/// Weight of contact off the tool beside likeness, and the largest share of it that counts.
const OFF_COUNTS: f64 = 0.7;
const OFF_CAP: f64 = 0.3;
/// Difference of the angle and of the place that the fingers then have, radians and meters: below, it is no fault.
const APART_RAD: Limits = [3.0 / 180.0 * std::f64::consts::PI, 5.0 / 180.0 * std::f64::consts::PI];
const APART_M: Limits = [2e-3, 4e-3];
/// Share of contact off the tool.
const OFF: Limits = [0.5, f64::INFINITY];
/// Standard deviation of the place where it is known least, meters.
const PLACE_SD_M: Limits = [PLACE_OPEN_M, f64::INFINITY];

/// Limits of the misfit of a pose beyond the lab's grasps, and the weights in it of contact off the tool and of the misfit that goes
/// away near by: among all poses any tool fits somewhere, and the likeness alone does not detect it. From other tools at fresh grasps;
/// a mask by depth alone, a third of which lies off the tool, makes no pose wrong.
const ANYWHERE: Limits = [0.55, 1.15];
const ANYWHERE_OFF: f64 = 2.0;
const ANYWHERE_ELSEWHERE: f64 = 4.0;
/// Chance of the answer below which another one is told.
const LIKELIEST: f64 = 0.5;

/// Verdict on the angle of a pose, or on its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// The worst of what was found about it.
    pub grade: Grade,
    /// Standard deviation, radians or meters.
    pub sd: f64,
}

impl Part {
    fn in_deg<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map([("grade", json!(self.grade)), ("sd_deg", json!(self.sd.to_degrees()))])
    }

    fn in_mm<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map([("grade", json!(self.grade)), ("sd_mm", json!(units::mm(self.sd)))])
    }
}

/// Verdict on a pose: all that speaks against it, without the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// The worse one of angle and place.
    pub grade: Grade,
    /// The angle.
    #[serde(serialize_with = "Part::in_deg")]
    pub angle: Part,
    /// The place.
    #[serde(serialize_with = "Part::in_mm")]
    pub place: Part,
    /// The reason, in a sentence: the worst of what was found, or how well it fits.
    pub why: String,
    /// Everything that speaks against it, the worst first.
    pub against: Vec<Sign>,
}

/// Kind of a sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SignKind {
    /// One of the fingers measured no contact.
    Blank,
    /// It lies outside the range that was searched.
    Beyond,
    /// Another pose is likelier.
    Several,
    /// The imprints fit better with the fingers swapped.
    Swapped,
    /// The fingers have it at different places.
    Fingers,
    /// The membranes fit better elsewhere.
    Elsewhere,
    /// The contact is not like this tool's.
    Misfit,
    /// The contact mask lies off the tool.
    OffTool,
    /// The contact leaves the angle open.
    AngleOpen,
    /// The contact leaves the place open.
    PlaceOpen,
    /// The mask alone gave the pose.
    MaskAlone,
}

/// Sign that speaks against a pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sign {
    /// Kind of it.
    pub kind: SignKind,
    /// Weight of it: the greater one of those for the angle and the place.
    pub grade: Grade,
    /// Weights for the angle and for the place.
    #[serde(skip)]
    pub parts: [Grade; 2],
    /// In a few words.
    pub what: String,
}

impl Verdict {
    /// The verdict on the answer of a registration; `None` unless its evidence was asked for.
    pub fn of(report: &AlignReport) -> Option<Self> {
        let evidence = report.evidence.as_ref()?;
        let place_m = evidence.uncertainty.place_m(report.grasp_from_object);
        let mut against = signs(report, evidence, place_m);
        let worst = |part: usize| against.iter().map(|sign| sign.parts[part]).max().unwrap_or(Grade::Good);
        let angle = Part { grade: worst(0), sd: evidence.uncertainty.angle_rad() };
        let place = Part { grade: worst(1), sd: place_m };
        against.retain(|sign| sign.grade > Grade::Good);
        against.sort_by_key(|sign| std::cmp::Reverse(sign.grade));
        let why = against.first().map_or_else(|| fits(evidence), |sign| sign.what.clone());
        Some(Self { grade: angle.grade.max(place.grade), angle, place, why, against })
    }

    /// `angle good (±0.3°), place uncertain (±3.20 mm)`.
    pub fn parts_text(&self) -> String {
        let word =
            |part: Part| if part.grade == Grade::Check { "uncertain".to_owned() } else { part.grade.to_string() };
        let (turn, shift) = (units::text_deg(self.angle.sd), units::text_mm(self.place.sd));
        format!("angle {} (±{turn}), place {} (±{shift})", word(self.angle), word(self.place))
    }
}

/// The sentence of a pose that nothing speaks against.
fn fits(evidence: &Evidence) -> String {
    let on = format!("{:.0} % of the contact lies on the tool", 100.0 * evidence.on_tool);
    match evidence.membrane {
        Some(membrane) => format!("{on}, the membrane has the tool's shape (similarity {:.2})", membrane.likeness),
        None => on,
    }
}

fn signs(report: &AlignReport, evidence: &Evidence, place_m: f64) -> Vec<Sign> {
    use SignKind::{
        AngleOpen, Beyond, Blank, Elsewhere, Fingers, MaskAlone, Misfit, OffTool, PlaceOpen, Several, Swapped,
    };
    let mut signs = Vec::new();
    let mut sign = |kind, [angle, place]: [Grade; 2], what| {
        signs.push(Sign { kind, grade: angle.max(place), parts: [angle, place], what });
    };
    // What slides along itself may be found elsewhere, and is no wrong pose for that.
    let worst_place = if place_m > PLACE_SD_M[0] { Grade::Check } else { Grade::Wrong };
    if evidence.blank {
        sign(Blank, [Grade::Wrong; 2], "one finger measured no contact".to_owned());
    }
    if !report.within_prior {
        let [degrees, shift_mm] = report.range.lengths();
        let what = format!("the pose lies outside the search range (±{degrees}°, ±{shift_mm} mm)");
        sign(Beyond, [Grade::Check; 2], what);
    }
    let own: f64 = report.answers.iter().filter(|answer| answer.alike).map(|answer| answer.weight).sum();
    if let Some(other) = report.answers.iter().find(|answer| !answer.alike).filter(|_| own < LIKELIEST) {
        let off = PoseDifference::between(report.grasp_from_object, other.grasp_from_object);
        let (turned, moved) = (units::text_deg(off.angle_rad), units::text_mm(off.position_m));
        let angle = Grade::of_angle_error(off.angle_rad).min(Grade::Check);
        sign(Several, [angle, Grade::Check], format!("another pose fits as well, {turned} and {moved} away"));
    }
    let off = 1.0 - evidence.on_tool;
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let limits = match report.joint {
        Some(fit) if fit.basis == Basis::Unlike => &UNLIKE,
        _ => &EXPLAINED,
    };
    let mut matches = false;
    if let Some(membrane) = evidence.membrane {
        if let Some(gain) = membrane.swapped {
            let what = "the imprints fit better with the fingers swapped".to_owned();
            sign(Swapped, [Grade::of(gain, limits.swapped); 2], what);
        }
        let way =
            |to: align::Elsewhere| format!("{} and {}", units::text_deg(to.angle_rad), units::text_mm(to.position_m));
        if let Some(fingers) = membrane.fingers {
            let gain = Grade::of(fingers.gain, limits.fingers);
            let place = Grade::of(fingers.position_m, APART_M).min(worst_place);
            let what = format!("the fingers do not agree: they are {} apart", way(fingers));
            sign(Fingers, [Grade::of(fingers.angle_rad, APART_RAD), place].map(|apart| apart.min(gain)), what);
        }
        let what = format!("the membranes fit better {} away: check the mask", way(membrane.own));
        let gain = Grade::of(membrane.own.gain, limits.elsewhere);
        let angle = Grade::of(membrane.own.angle_rad, APART_RAD).min(gain);
        sign(Elsewhere, [angle, gain.min(worst_place)], what);
        let (unlike, off_tool) = (1.0 - membrane.likeness, off.min(OFF_CAP));
        let by_membrane = report.has_membrane();
        let grade = if by_membrane && !Prior::default().allows(report.grasp_from_object) {
            Grade::of(unlike + ANYWHERE_OFF * off_tool + ANYWHERE_ELSEWHERE * membrane.own.gain, ANYWHERE)
        } else {
            Grade::of(unlike + OFF_COUNTS * off_tool, limits.misfit)
        };
        matches = by_membrane && grade == Grade::Good;
        let (likeness, off) = (membrane.likeness, percent(off));
        let what = format!("the contact does not match this tool (similarity {likeness:.2}, {off} of it off the tool)");
        sign(Misfit, [grade; 2], what);
    }
    // A mask off the tool is no fault of the pose where the membranes have the tool's shape.
    if !matches {
        sign(OffTool, [Grade::of(off, OFF); 2], format!("{} of the contact mask lies off the tool", percent(off)));
    }
    let angle_rad = evidence.uncertainty.angle_rad();
    let what = format!("the contact does not determine the angle (±{})", units::text_deg(angle_rad));
    sign(AngleOpen, [Grade::of(angle_rad, limits.angle_rad), Grade::Good], what);
    let [along, across] = evidence.uncertainty.half_axes(report.grasp_from_object).map(DVec2::length);
    let one_way = along > PLACE_SD_M[0] && across <= PLACE_SD_M[0] && angle_rad <= limits.angle_rad[0];
    let what = if one_way {
        "a straight edge leaves the position along it open"
    } else {
        "the contact does not determine the position"
    };
    let what = format!("{what} (±{})", units::text_mm(place_m));
    sign(PlaceOpen, [Grade::Good, Grade::of(place_m, PLACE_SD_M)], what);
    if let Some(fit) = report.joint.filter(|fit| !fit.basis.has_membrane()) {
        sign(MaskAlone, [Grade::Check; 2], fit.basis.to_string());
    }
    signs
}
