//! Evidence for and against a pose that needs no truth: what the tool explains of contact and membrane, what fits better
//! otherwise, and how well the pose is determined.

use serde::{Deserialize, Serialize};

use super::JointConfig;
use super::answers::{PoseAnswer, shared};
use super::cost::{Joint, Relief};
use super::problem::{Patches, Problem};
use super::smooth::FINEST;
use crate::align::batch::State;
use crate::align::search::{Cost, Progress, minimize};
use crate::align::{AlignReport, Ask, Contacts, PadImage, Prior, Range, Scene, Uncertainty};
use crate::contact::{FLAT_M, rise};
use crate::mesh::sampling::spread;
use crate::symmetry::Symmetry;
use crate::tool::ToolModel;

/// Contact points at most this far outside the silhouette lie on the tool, meters: a pixel of the mask and a half.
const ON_TOOL_M: f64 = 1e-3;
/// Most contact points that are looked at.
const POINTS: usize = 1024;

/// Comparison of reliefs: in lengths that are wide enough to outlast the membrane's law, and narrow enough to be the tool's.
const LOOK: Look = Look { band: 1, kernel_m: 1e-3, places: 800 };
/// Steps of a descent from the pose to where membranes would have it, coarse to fine.
const DESCENT: [Look; 3] = [
    Look { band: 0, kernel_m: 4e-3, places: 200 },
    Look { band: 1, kernel_m: 1e-3, places: 300 },
    Look { band: FINEST, kernel_m: 0.5e-3, places: 600 },
];
const STEPS: usize = 20;
/// Step that moves no point by more than about this ends a descent, meters.
const STEP_M: f64 = 2e-5;

/// Most of the difference between a pose by membranes and mask and the one that the membranes have alone that counts as error,
/// standard deviations: where it is larger the membranes tell less than the mask. From fresh grasps under two laws.
const MOST_OFF: f64 = 1.5;

/// Evidence for and against a pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Share of all contact points with a place that lie on the tool, 0 to 1. 0 without any.
    pub on_tool: f64,
    /// True where one membrane measured no contact and another one did.
    pub blank: bool,
    /// The membranes' part, where their images are known and show where the membranes would meet.
    pub membrane: Option<MembraneEvidence>,
    /// Spread of the errors that the pose may have.
    pub uncertainty: Uncertainty,
}

/// Evidence of the membranes about a pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MembraneEvidence {
    /// Likeness of their relief to the relief that the tool would make: correlation in the lengths of 1 to 3 mm, -1 to 1.
    /// That of the finger with the smaller one.
    pub likeness: f64,
    /// Misfit that the tool leaves of the relief in these lengths: mean of the capped squares, as a share of the cap, 0 to 1. To be
    /// compared between poses and tools of one touch.
    pub misfit: f64,
    /// Pose near by that they would have without the mask.
    pub own: Elsewhere,
    /// Poses that the fingers would have each alone, where there are two.
    pub fingers: Option<Elsewhere>,
    /// Misfit that goes away if the images of the two fingers are exchanged, as a share, in the best pose for that. Below 0
    /// where they fit better as they are. `None` unless there are two fingers of one size.
    pub swapped: Option<f64>,
}

/// Poses that fit better, and how far apart they are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Elsewhere {
    /// Difference of the angles, radians.
    pub angle_rad: f64,
    /// Distance of the tool's point in the middle of the contact, meters.
    pub position_m: f64,
    /// Misfit that goes away, as a share, 0 to 1; of the finger that gains more.
    pub gain: f64,
}

impl Elsewhere {
    fn between(a: State, b: State, gain: f64) -> Self {
        let turned = crate::units::angle_error(a.phi, b.phi).abs();
        Self { angle_rad: turned, position_m: a.place.distance(b.place), gain: gain.clamp(0.0, 1.0) }
    }
}

/// Comparison of membranes with templates: the band of lengths, the kernel (meters) and the number of places.
struct Look {
    band: usize,
    kernel_m: f64,
    places: usize,
}

impl Evidence {
    /// The evidence about the answer of a registration. About a millisecond, and the first time for a tool what its
    /// templates take.
    pub fn about(scene: &Scene<'_>, tool: &ToolModel, report: &AlignReport) -> (Self, Vec<PoseAnswer>) {
        let pose = report.grasp_from_object;
        let finite: Vec<_> = scene.yz().iter().filter(|p| p.is_finite()).collect();
        let object_from_grasp = pose.inverse();
        let chosen = spread(finite.len(), POINTS);
        let on = chosen
            .iter()
            .filter(|&&i| tool.field.sample(object_from_grasp.transform_yz(*finite[i])).distance <= ON_TOOL_M);
        let on_tool = on.count() as f64 / chosen.len().max(1) as f64;
        let config = JointConfig { range: report.range };
        let problem = Problem::new(scene, tool, config, Ask::default()).ok().flatten();
        let found = problem.as_ref().map(|problem| problem.evidence(scene, State::from_pose(pose, problem.centroid())));
        let by_membrane = report.has_membrane();
        let of_mask = || Uncertainty::of_mask(scene.yz(), &tool.field, pose, scene.tolerance());
        let uncertainty = match (&problem, found) {
            (Some(problem), Some((_, own))) => {
                let (spread, most) =
                    if by_membrane { (problem.uncertainty(pose), MOST_OFF) } else { (of_mask(), f64::INFINITY) };
                spread.with_other(pose, own.to_pose(problem.centroid()), most)
            }
            _ => of_mask(),
        };
        let membrane = found.map(|(evidence, _)| evidence);
        let answers = match &problem {
            _ if report.range == Range::LAB => Vec::new(),
            Some(problem) if by_membrane => problem.answers(report, &Symmetry::of(tool)),
            _ => shared(vec![(pose, 1.0)], &Symmetry::of(tool), report.range),
        };
        let touched = scene.images().iter().filter(|image| rise(image.imprint) >= FLAT_M).count();
        let blank = (1..scene.images().len()).contains(&touched);
        (Self { on_tool, blank, membrane, uncertainty }, answers)
    }

    /// Adds the evidence about its answer to a report, and the other answers.
    pub fn gather(scene: &Scene<'_>, tool: &ToolModel, report: &mut AlignReport) {
        let (evidence, answers) = Self::about(scene, tool, report);
        (report.evidence, report.answers) = (Some(evidence), answers);
    }
}

impl Problem<'_> {
    /// The evidence of the membranes about a pose, and the pose near by that they would have without the mask.
    fn evidence(&self, scene: &Scene<'_>, at: State) -> (MembraneEvidence, State) {
        let look = self.patches_at(LOOK.band, LOOK.places, at);
        let likeness = look
            .chunks(1)
            .filter(|finger| finger[0].1.len() > 0)
            .map(|finger| Relief::of(finger, at, LOOK.kernel_m).likeness())
            .fold(1.0, f64::min);
        let descent =
            DESCENT.map(|look| (self.patches_at(look.band.min(self.finest()), look.places, at), look.kernel_m));
        let all = 0..descent[0].0.len();
        let (own, gain) = descend(&descent, all.clone(), at);
        let alone: Vec<(State, f64)> = all.map(|finger| descend(&descent, finger..finger + 1, own)).collect();
        let fingers = match alone[..] {
            [(right, gain_right), (left, gain_left)] => {
                Some(Elsewhere::between(right, left, gain_right.max(gain_left)))
            }
            _ => None,
        };
        let misfit = Relief::of(&look, at, LOOK.kernel_m).misfit();
        let swapped = self.swapped_misfit(scene, at).filter(|_| misfit > 0.0).map(|swapped| 1.0 - swapped / misfit);
        (MembraneEvidence { likeness, misfit, own: Elsewhere::between(at, own, gain), fingers, swapped }, own)
    }

    /// Misfit in the best pose for the images of two fingers exchanged.
    fn swapped_misfit(&self, scene: &Scene<'_>, at: State) -> Option<f64> {
        let [a, b] = scene.images() else { return None };
        if a.imprint.size() != b.imprint.size() {
            return None;
        }
        let images = [PadImage { camera: a.camera, ..*b }, PadImage { camera: b.camera, ..*a }];
        let scene = Scene::new(Contacts { points: &[], images: &images });
        let swapped = Problem::new(&scene, self.tool, self.config, Ask::default()).ok()??;
        let mut found = Ok(swapped.report(&[], swapped.solve()));
        if !Prior::default().allows(at.to_pose(self.centroid())) {
            found = swapped.look_around(&[], found);
        }
        let end = State::from_pose(found.ok()?.grasp_from_object, swapped.centroid());
        Some(Relief::of(&swapped.patches_at(LOOK.band, LOOK.places, end), end, LOOK.kernel_m).misfit())
    }
}

/// End of a descent of some fingers alone, without the mask, and the share of their misfit that went away.
fn descend(descent: &[(Patches, f64)], fingers: std::ops::Range<usize>, from: State) -> (State, f64) {
    let mut at = Progress::new(from);
    let (mut before, mut after) = (0.0, 0.0);
    for (patches, kernel_m) in descent {
        let mut joint = Joint { fingers: &patches[fingers.clone()], kernel_m: *kernel_m, mask: None, lookups: 0 };
        before = joint.sums(from).cost;
        after = minimize(&mut joint, &mut at, STEPS, STEP_M).cost;
    }
    (at.state, if before > 0.0 { 1.0 - after / before } else { 0.0 })
}
