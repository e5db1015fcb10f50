//! Registration: contact points to the planar in-hand pose of the tool.
//!
//! Registrations of several kinds behind one trait ([`Register`]), one kind of result:
//! * [`align`]: robust Levenberg-Marquardt on a [`DistanceField`](super::field::DistanceField) of the tool's silhouette, from a few starts. The
//!   default. Points outside the outline pay their distance, points on the silhouette pay nothing.
//! * [`lab_icp()`]: the lab's planar point-to-point loop, reproduced for comparison.
//!
//! A result is a value ([`AlignReport`]): the pose with everything that says whether to believe it. What is only
//! needed to look inside a run (per-iteration states, per-point residuals) is recorded on request.
//!
//! Source of the method: Fitzgibbon, Robust registration of 2D and 3D point sets, 2003.

mod batch;
mod certify;
pub mod correspond;
mod joint;
pub mod lab_icp;
mod lanes;
mod observability;
mod planar;
pub mod reason;
mod register;
mod samples;
mod search;
#[cfg(test)]
pub(crate) mod testing;
mod tree;
mod uncertainty;
mod windows;

use std::borrow::Cow;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::frames::PlanarPose;
use super::units::angle_error;

pub use joint::{Basis, Elsewhere, Evidence, JointConfig, JointFit, MembraneEvidence, PoseAnswer};
pub use lab_icp::{LabIcp, LabModel, lab_icp};
pub(crate) use observability::DEGENERATE_BELOW;
pub use observability::{Observability, observability};
pub use planar::align;
pub use register::{Ask, Contacts, PadImage, Register, Scene};
pub use uncertainty::{PLACE_OPEN_M, Uncertainty};

/// Length that makes an angle comparable with a shift: one radian counts as this many meters.
///
/// It is the lever arm of typical contact points, so that both halves of a step move points about equally far.
pub(crate) const ANGLE_SCALE_M: f64 = 0.02;
/// Fewest points a pose is computed from.
pub const MIN_POINTS: usize = 32;
/// Distance that a start can be expected to bridge, meters: the prior's shift and the sweep of its angle.
const REACH_M: f64 = 0.012;
/// Fewest points, as a share, that must lie within [`REACH_M`] of the tool at one start, and be near at the end: below, there
/// is nothing to align.
const MIN_SHARE: f64 = 0.05;

/// Settings of [`align`]. The default is what the product uses.
#[derive(Clone, Debug, PartialEq)]
pub struct AlignConfig {
    /// Poses to start from, `grasp_from_object`: exactly these, and no ladder. Empty: the ladder chooses.
    pub starts: Vec<PlanarPose>,
    /// Rungs that the ladder may use, cheapest first. With one alone, its answer is taken as it is.
    pub rungs: Vec<Rung>,
    /// Widths of the Geman-McClure kernel, meters, wide to narrow. The last one decides.
    pub kernels_m: Vec<f64>,
    /// Most steps per kernel width and start.
    pub max_iterations: usize,
    /// Look-ups after which a proof is given up.
    pub budget: usize,
    /// Box where the pose is expected: the ladder searches it, and the report says whether the answer was found there.
    pub prior: Prior,
    /// Keep per-iteration states and per-point residuals.
    pub record: bool,
}

impl AlignConfig {
    /// Width of the kernel that decides, meters; NaN without any, which [`align`] refuses.
    pub fn final_kernel_m(&self) -> f64 {
        self.kernels_m.last().copied().unwrap_or(f64::NAN)
    }
}

impl Default for AlignConfig {
    fn default() -> Self {
        Self {
            starts: Vec::new(),
            rungs: vec![Rung::Single, Rung::Several, Rung::Grid, Rung::Certified],
            kernels_m: vec![8e-3, 2e-3, 1e-3],
            max_iterations: 20,
            budget: 30_000_000,
            prior: Prior::default(),
            record: false,
        }
    }
}

/// The box around zero in which the gripper can hold a tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Largest size of the angle, radians.
    pub theta_rad: f64,
    /// Largest size of y and of z, meters.
    pub shift_m: f64,
}

impl Default for Prior {
    /// The grid of the lab's grasps: ±22.5°, ±5 mm.
    fn default() -> Self {
        Self { theta_rad: 22.5f64.to_radians(), shift_m: 0.005 }
    }
}

impl Prior {
    /// True where the pose is in the box, widened by half to allow for error.
    pub fn allows(&self, pose: PlanarPose) -> bool {
        super::units::wrap_angle(pose.theta_rad).abs() <= 1.5 * self.theta_rad
            && pose.y_m.abs() <= 1.5 * self.shift_m
            && pose.z_m.abs() <= 1.5 * self.shift_m
    }
}

/// Poses among which a tool is looked for, as a [`Prior`] of whole numbers: the same in a key, in a text and in the arithmetic.
/// As text `DEGREES,MM`, `free` or `lab`. No smaller than the lab's, which is the prior of all registrations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Range {
    millidegrees: u32,
    micrometers: u32,
}

impl Default for Range {
    /// Any pose.
    fn default() -> Self {
        Self::FREE
    }
}

impl Range {
    /// The grid of the lab's grasps.
    pub const LAB: Self = Self { millidegrees: 22_500, micrometers: 5_000 };
    /// A full turn, and farther than any tool reaches.
    pub const FREE: Self = Self { millidegrees: 180_000, micrometers: 1_000_000 };

    /// The box that it is.
    pub fn prior(self) -> Prior {
        let [degrees, shift_mm] = self.lengths();
        Prior { theta_rad: degrees.to_radians(), shift_m: shift_mm / 1e3 }
    }

    /// Degrees and millimeters.
    pub fn lengths(self) -> [f64; 2] {
        [self.millidegrees, self.micrometers].map(|part| f64::from(part) / 1e3)
    }
}

impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [degrees, shift_mm] = self.lengths();
        write!(f, "{degrees},{shift_mm}")
    }
}

impl std::str::FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "free" || text == "lab" {
            return Ok(if text == "lab" { Self::LAB } else { Self::FREE });
        }
        let ([least_deg, least_mm], [most_deg, most_mm]) = (Self::LAB.lengths(), Self::FREE.lengths());
        let number = |text: &str, within: std::ops::RangeInclusive<f64>| {
            let value = text.trim().parse().ok().filter(|value| within.contains(value));
            value.map(|value: f64| (value * 1e3).round() as u32)
        };
        let parts = text
            .split_once(',')
            .and_then(|(turn, shift)| Some((number(turn, least_deg..=most_deg)?, number(shift, least_mm..=most_mm)?)));
        let (millidegrees, micrometers) = parts.ok_or_else(|| {
            format!(
                "{text:?}: `free`, `lab`, or {least_deg} to {most_deg} degrees and {least_mm} to {most_mm} mm are needed, as in 180,40"
            )
        })?;
        Ok(Self { millidegrees, micrometers })
    }
}

/// Why there is no pose.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AlignError {
    /// The mask is nearly empty, or most of it has no depth.
    #[error("{got} usable contact points are too few for a pose (at least {needed}): enlarge the contact mask")]
    TooFewPoints {
        /// Finite points.
        got: usize,
        /// Points needed.
        needed: usize,
    },
    /// All points lie in one spot.
    #[error("all contact points lie within {:.2} mm: a pose needs a contact area", .extent_m * 1e3)]
    Coincident {
        /// Diagonal of the points' bounding box, meters.
        extent_m: f64,
    },
    /// The points are nowhere near the tool.
    #[error(
        "only {:.0} % of the contact points come near the tool's outline: check units, tool and camera transform",
        .share * 100.0
    )]
    NoOverlap {
        /// Share of points near the silhouette, at the best start or at the end.
        share: f64,
    },
    /// The model has no points to compare with.
    #[error("the tool has {got} surface points, too few to compare with")]
    EmptyModel {
        /// Finite model points.
        got: usize,
    },
    /// A start or a setting is not a finite, positive number, or a list is empty.
    #[error("the registration setting `{what}` is not usable")]
    Config {
        /// Name of the setting.
        what: &'static str,
    },
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, strum::Display)]
#[serde(rename_all = "snake_case")]
pub enum Stop {
    /// The last step moved no point noticeably.
    #[strum(to_string = "converged: the step became negligible")]
    SmallStep,
    /// No direction lowers the cost further.
    #[strum(to_string = "converged: no step lowers the cost")]
    NoDescent,
    /// The nearest points did not change, so no later iteration can change the pose.
    #[strum(to_string = "converged: the correspondences repeat")]
    FixedPoint,
    /// The run came to where another one already was; its end is the other's.
    #[strum(to_string = "met the run of another start")]
    Merged,
    /// The number of iterations was used up while the pose still moved.
    #[strum(to_string = "stopped: iteration limit")]
    IterationLimit,
}

impl Stop {
    /// True where the pose is an end point rather than a way station.
    pub fn converged(self) -> bool {
        self != Self::IterationLimit
    }
}

/// Rung of the ladder, cheapest first: how much was searched for an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[derive(Serialize, Deserialize, strum::Display, strum::EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum Rung {
    /// The caller chose the starts, or the engine has no ladder.
    #[strum(to_string = "given starts")]
    Fixed,
    /// One start in the middle of the prior.
    #[strum(to_string = "one start")]
    Single,
    /// A few starts over the angle.
    #[strum(to_string = "five starts")]
    Several,
    /// A start at every knot of a grid over the prior.
    #[strum(to_string = "grid")]
    Grid,
    /// Scouts over the full turn and all of the model.
    #[strum(to_string = "full turn")]
    Around,
    /// Branch and bound over the prior: nothing in it is better by more than the gap.
    #[strum(to_string = "certified search")]
    Certified,
}

/// Outcome of a rung: why the search stopped with its answer or went on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, strum::Display)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It passes all tests.
    #[strum(to_string = "accepted")]
    Accepted,
    /// It fails a test that more searching cannot make it pass, or no further rung is allowed.
    #[strum(to_string = "taken: no further search")]
    Last,
    /// The run had not come to an end.
    #[strum(to_string = "refused: still moving at the iteration limit")]
    NotConverged,
    /// The pose is not where the gripper can hold a tool.
    #[strum(to_string = "refused: outside the prior")]
    OutsidePrior,
    /// The points lie too far from the silhouette.
    #[strum(to_string = "refused: cost too high")]
    Cost,
    /// Too few points lie on the silhouette.
    #[strum(to_string = "refused: too few inliers")]
    Inliers,
    /// The points do not determine the pose there, though they may elsewhere.
    #[strum(to_string = "refused: weakest direction not determined")]
    Observability,
}

/// One rung that was tried.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RungAttempt {
    /// Rung that was tried.
    pub rung: Rung,
    /// Cost per point of its answer, square meters; comparable between attempts with the same `points`.
    pub cost_m2: f64,
    /// Points it used.
    pub points: usize,
    /// Share of them within the narrowest kernel.
    pub inlier_share: f64,
    /// Smallest eigenvalue of [`Observability`] there.
    pub weakest: f64,
    /// Nearest-surface questions it asked.
    pub lookups: usize,
    /// Why the search went on, or did not.
    pub outcome: Outcome,
}

/// Outcome of branch and bound.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// True where no pose in the box is cheaper by more than the gap. `false`: the budget was used up first.
    pub certified: bool,
    /// Points that the costs are about: thinned, so that the proof takes milliseconds. The answer is then refined
    /// on all.
    pub points: usize,
    /// Cost per point of the best pose found, square meters.
    pub cost_m2: f64,
    /// No pose in the box costs less than this per point, square meters; proved even where `certified` is false.
    pub lower_bound_m2: f64,
    /// Boxes looked at.
    pub nodes: usize,
    /// Nearest-surface questions asked for them.
    pub lookups: usize,
}

impl Certificate {
    /// By which share of its cost the answer could at most be improved, 0 to 1.
    pub fn gap(&self) -> f64 {
        if self.cost_m2 > 0.0 { ((self.cost_m2 - self.lower_bound_m2) / self.cost_m2).clamp(0.0, 1.0) } else { 0.0 }
    }
}

/// One start and where it led.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The start that was asked for, `grasp_from_object`. Only a registration that applies it wrongly differs.
    pub requested: PlanarPose,
    /// Pose where it started, `grasp_from_object`.
    pub start: PlanarPose,
    /// Pose where it ended, `grasp_from_object`.
    pub end: PlanarPose,
    /// Cost per point there, square meters; comparable between the runs of one report.
    pub cost_m2: f64,
    /// Steps taken.
    pub iterations: usize,
    /// Why it ended.
    pub stop: Stop,
}

/// A registration's answer with its reasons.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AlignReport {
    /// The tool's pose in the hand.
    pub grasp_from_object: PlanarPose,
    /// True where the winning run reached an end point.
    pub converged: bool,
    /// Why the winning run ended.
    pub stop: Stop,
    /// Pose where the winning run started, `grasp_from_object`.
    pub start: PlanarPose,
    /// Every start with its end, in the order of the starts.
    pub runs: Vec<Run>,
    /// Position of the winner in `runs`.
    pub winner: usize,
    /// Rung of the ladder that answered.
    pub rung: Rung,
    /// Every rung that was tried, in order, with the reason why the search went on; empty for an engine without one.
    pub ladder: Vec<RungAttempt>,
    /// Outcome of branch and bound, if it was asked.
    pub certificate: Option<Certificate>,
    /// Steps of all runs together.
    pub iterations: usize,
    /// Nearest-surface questions asked: the work done.
    pub lookups: usize,
    /// Points offered.
    pub offered: usize,
    /// Points not used because a coordinate was not finite.
    pub not_finite: usize,
    /// Points the answer is computed from.
    pub used: usize,
    /// Share of the used points within the narrowest kernel of the silhouette (or of the model points).
    pub inlier_share: f64,
    /// Root mean square residual of those, meters.
    pub inlier_rms_m: f64,
    /// True where the pose is where the gripper can hold a tool.
    pub within_prior: bool,
    /// Observability: how well the points determine the pose; `None` if the engine had no field to tell from.
    pub observability: Option<Observability>,
    /// Use of the membrane, from the registration that uses it.
    pub joint: Option<JointFit>,
    /// Evidence for and against the answer, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evidence: Option<Evidence>,
    /// Poses that the touch allows, with their chances, the answer first; where the evidence was asked for and the range is wide.
    #[serde(skip)]
    pub answers: Vec<PoseAnswer>,
    /// Poses that came near to being the answer, and it, with costs to compare; none where the first one stood.
    #[serde(skip)]
    pub ends: Vec<(PlanarPose, f64)>,
    /// Poses among which it looked.
    #[serde(skip)]
    pub range: Range,
    /// Per-iteration states of all runs; empty unless recorded.
    pub trace: Vec<TraceStep>,
    /// Fate of every offered point, in order; empty unless recorded.
    pub fits: Vec<PointFit>,
}

impl AlignReport {
    /// True where the membranes had a say.
    pub fn has_membrane(&self) -> bool {
        self.joint.is_some_and(|fit| fit.basis.has_membrane())
    }

    /// A report of `runs` about `used` points, with the inliers of the winner and the sum of their squared distances.
    fn of(runs: Vec<Run>, winner: usize, rung: Rung, used: usize, (inliers, squares): (usize, f64)) -> Self {
        let Run { start, end, stop, .. } = runs[winner];
        Self {
            grasp_from_object: end,
            converged: stop.converged(),
            stop,
            start,
            winner,
            rung,
            ladder: Vec::new(),
            certificate: None,
            iterations: runs.iter().map(|run| run.iterations).sum(),
            lookups: 0,
            offered: 0,
            not_finite: 0,
            used,
            inlier_share: inliers as f64 / used.max(1) as f64,
            inlier_rms_m: (squares / (inliers as f64).max(1.0)).sqrt(),
            within_prior: false,
            observability: None,
            joint: None,
            evidence: None,
            answers: Vec::new(),
            ends: Vec::new(),
            range: Range::LAB,
            trace: Vec::new(),
            fits: Vec::new(),
            runs,
        }
    }

    /// `1 of 5 equal answers`, or `2 of 3 possible answers (31 %)`; `None` where a pose is not one of several answers.
    pub fn answers_text(&self, pose: PlanarPose) -> Option<String> {
        let at = self.answers.iter().position(|answer| answer.grasp_from_object == pose)?;
        let (number, of, percent) = (at + 1, self.answers.len(), 100.0 * self.answers[at].weight);
        let equal = self.answers.iter().all(|answer| answer.alike);
        let some = if equal { "equal answers".to_owned() } else { format!("possible answers ({percent:.0} %)") };
        (of > 1).then(|| format!("{number} of {of} {some}"))
    }

    /// Takes, of the poses that the tool's symmetry makes of the answer, the one whose angle is nearest to that of another pose:
    /// a tool that is followed does not turn over.
    pub fn keep_to(&mut self, last: PlanarPose) {
        let turned = |answer: &PoseAnswer| angle_error(answer.grasp_from_object.theta_rad, last.theta_rad);
        let alike = self.answers.iter().enumerate().filter(|(_, answer)| answer.alike);
        let Some((nearest, _)) = alike.min_by(|(_, a), (_, b)| turned(a).total_cmp(&turned(b))) else { return };
        self.answers.swap(0, nearest);
        let (from, to) = (self.grasp_from_object, self.answers[0].grasp_from_object);
        if let Some(evidence) = &mut self.evidence {
            evidence.uncertainty = evidence.uncertainty.moved(from, to);
        }
        self.grasp_from_object = to;
    }

    /// The angle as the lab reports it: the rotation of `object_from_grasp`, radians.
    pub fn lab_angle_rad(&self) -> f64 {
        self.grasp_from_object.inverse().theta_rad
    }

    /// The cheapest place that was found and refused, because the gripper cannot hold the tool there while a dearer place
    /// is possible. `None` where the answer is the cheapest.
    pub fn refused(&self) -> Option<&Run> {
        let won = self.runs.get(self.winner)?.cost_m2;
        let outside = |run: &&Run| run.cost_m2 < won && !self.range.prior().allows(run.end);
        let cheapest = |a: &&Run, b: &&Run| a.cost_m2.total_cmp(&b.cost_m2);
        self.runs.iter().filter(|_| self.within_prior).filter(outside).min_by(cheapest)
    }

    /// True where the points leave a direction of the pose open (a straight rod slides, a disc turns).
    pub fn is_degenerate(&self) -> bool {
        self.observability.is_some_and(|o| o.degenerate)
    }
}

/// One state on the way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TraceStep {
    /// Start of the run (position in [`AlignReport::runs`]).
    pub run: usize,
    /// Number of the step within the run; 0 is the start as applied.
    pub iteration: usize,
    /// The pose, `grasp_from_object`.
    pub grasp_from_object: PlanarPose,
    /// Cost per point, square meters; comparable only at the same kernel width and number of points.
    pub cost_m2: f64,
    /// Part of it that is the mask's, where the rest is the membranes'; square meters.
    pub mask_cost_m2: Option<f64>,
    /// Share of the points within the kernel's width.
    pub inlier_share: f64,
    /// Width of the kernel, meters; infinite without one.
    pub kernel_m: f64,
    /// Points in use.
    pub points: usize,
}

/// Fate of a point at the final pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// Near the surface; it pulls.
    Inlier,
    /// On the silhouette; it fits and pays nothing.
    Inside,
    /// Beyond three kernel widths; its pull is negligible.
    BeyondGate,
    /// Outside the stored field.
    OutOfField,
    /// A coordinate is NaN or infinite.
    NotFinite,
}

/// Residual, weight and fate of a point at the final pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointFit {
    /// Distance it pays for, meters; NaN if the point is not finite.
    pub residual_m: f32,
    /// Weight in [0, 1].
    pub weight: f32,
    /// Fate of the point.
    pub fate: Fate,
}

/// Centroid and size of the finite points, computed about a local origin in f64.
struct Cleaned<'a> {
    /// Finite points: the offered ones where all are.
    points: Cow<'a, [DVec2]>,
    centroid: DVec2,
    not_finite: usize,
}

/// Drops points that are not finite and refuses sets without a size.
fn clean(points: &[DVec2], needed: usize) -> Result<Cleaned<'_>, AlignError> {
    /// Four cells of the field: below this no outline can be told from a dot.
    const MIN_EXTENT_M: f64 = 4.0 * super::field::CELL_M;
    // Larger coordinates would lose the millimeters that matter; no gripper is a kilometer long.
    const MAX_COORDINATE_M: f64 = 1e6;
    // False for NaN too.
    let usable = |p: &DVec2| p.x.abs() <= MAX_COORDINATE_M && p.y.abs() <= MAX_COORDINATE_M;
    let got = points.iter().filter(|p| usable(p)).count();
    if got < needed {
        return Err(AlignError::TooFewPoints { got, needed });
    }
    let finite: Cow<'_, [DVec2]> = if got == points.len() {
        Cow::Borrowed(points)
    } else {
        Cow::Owned(points.iter().copied().filter(usable).collect())
    };
    let origin = finite[0];
    let (mut sum, mut low, mut high) = (DVec2::ZERO, DVec2::ZERO, DVec2::ZERO);
    for p in finite.iter() {
        let p = *p - origin;
        sum += p;
        low = low.min(p);
        high = high.max(p);
    }
    let extent_m = (high - low).length();
    if extent_m < MIN_EXTENT_M {
        return Err(AlignError::Coincident { extent_m });
    }
    Ok(Cleaned { centroid: origin + sum / got as f64, not_finite: points.len() - got, points: finite })
}
