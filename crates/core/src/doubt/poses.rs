//! True poses against registered ones: where the files say that the tool was, and where its imprints lie.
//!
//! Registrations that are good without the truth, and a truth that is far from nearly all of them, contradict each other:
//! that much needs no explanation. The explanations that are tried change the truth alone.

use std::collections::BTreeMap;

use glam::DVec2;
use rayon::prelude::*;

use super::fit::{contact_points, grainless, likeness};
use super::{Cause, Doubt, PairInput, median};
use crate::align::{Ask, Contacts, PadImage};
use crate::contact::rest_and_top;
use crate::frames::PlanarPose;
use crate::manual::PoseDifference;
use crate::mesh::TriMesh;
use crate::pose::{Registration, register_with};
use crate::sample::Sample;
use crate::symmetry::Symmetry;
use crate::tool::ToolModel;
use crate::units::{angle_error, fixed, wrap_angle};
use crate::verdict::{Grade, Verdict};

/// Fewest good registrations that can contradict the truth.
const FEWEST: usize = 3;
/// Share of the pairs with a truth whose registration must be good.
const SURE: f64 = 0.5;
/// Share of the good registrations that must be far from the truth.
const FAR: f64 = 0.5;
/// Share of them with which an explanation must agree, and of all registrations that are wrong where the data are in doubt.
const MOST: f64 = 0.8;
/// Poses this near to the truth, in the units of [`off`], are as good as any.
const WELL: f64 = 0.3;
/// A pose further from the truth contradicts it, radians and meters: good registrations are off by 0.6 degrees and 1 mm.
const FAR_RAD: f64 = 2.5 * std::f64::consts::PI / 180.0;
const FAR_M: f64 = 10e-3;
/// Growth of the largest error of an angle that is more than chance, radians.
const WORSE_RAD: f64 = 1.0 * std::f64::consts::PI / 180.0;
/// A frame is moved by at least this, meters.
const MOVED_M: f64 = 3e-3;
/// True angles that differ by less are all the same, radians.
const SAME_RAD: f64 = 1e-3;

/// Difference of true poses from where the imprints are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mismatch {
    /// Each is the inverse.
    Inverse,
    /// The angles are off by the same, radians, in the lab's sense; CAD models that are all turned look the same.
    Angle(f64),
    /// The angles are this many times as large.
    Factor(f64),
    /// All angles are the same.
    Constant,
    /// The pose stored with the pair so many places on is right.
    Neighbor(isize),
    /// They are of another grasp frame: moved by this along y and z, meters, and turned by this, radians.
    GraspFrame(DVec2, f64),
    /// They are of another object frame than the CAD models: moved by this along the object's y and z, meters.
    ObjectFrame(DVec2),
    /// Nothing that was tried explains it.
    Unknown,
}

impl Mismatch {
    /// A word for tables.
    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Inverse => "poses-inverse",
            Self::Angle(_) => "poses-angle",
            Self::Factor(_) => "poses-factor",
            Self::Constant => "poses-constant",
            Self::Neighbor(_) => "poses-neighbor",
            Self::GraspFrame(..) => "poses-grasp-frame",
            Self::ObjectFrame(_) => "poses-object-frame",
            Self::Unknown => "poses-unknown",
        }
    }

    /// True where the poses are right but for one motion, or are those of other pairs.
    pub(super) fn is_rigid(self) -> bool {
        !matches!(self, Self::Inverse | Self::Factor(_) | Self::Constant | Self::Unknown)
    }

    fn text(self) -> String {
        let deg = |rad: f64| fixed(rad.to_degrees(), 1);
        let mm = |v: DVec2| format!("{} and {} mm along y and z", fixed(v.x * 1e3, 1), fixed(v.y * 1e3, 1));
        match self {
            Self::Inverse => "they fit as the inverse: object and grasp frame are exchanged".into(),
            Self::Angle(off) => format!("all angles are {}° too large, or all CAD models are turned by that", deg(off)),
            Self::Factor(factor) => format!("the angles are {factor:.3} times what they should be"),
            Self::Constant => "all true angles are the same, the registered ones are not".into(),
            Self::Neighbor(on) => {
                format!("each is the pose of the pair {} it", if on < 0 { "after" } else { "before" })
            }
            Self::GraspFrame(off, turn) => {
                format!("they are of a grasp frame that is moved by {} and turned by {}°", mm(off), deg(turn))
            }
            Self::ObjectFrame(off) => format!("the CAD models have their origin elsewhere, by {}", mm(off)),
            Self::Unknown => "nothing that was tried explains it".into(),
        }
    }

    fn hint(self) -> &'static str {
        match self {
            Self::Inverse => {
                "store the pose of the object in the grasp frame as the lab does, and check the sign of theta"
            }
            Self::Angle(_) | Self::ObjectFrame(_) => {
                "check the zero of the angle, and the frame that the CAD models are drawn in"
            }
            Self::Factor(_) => "check the unit of the angle: theta is in radians",
            Self::Constant => "check what writes theta",
            Self::Neighbor(_) => "check that poses and imprints are numbered alike",
            Self::GraspFrame(..) => "check the calibration of the cameras, and the frame that the poses are given in",
            Self::Unknown => "check that poses and imprints are of the same grasps, and their frames",
        }
    }
}

/// A pair whose registration is good; both poses are `grasp_from_object`.
#[derive(Clone, Copy, Debug)]
struct Sure {
    /// Position among the pairs that are looked at.
    at: usize,
    truth: Option<PlanarPose>,
    found: PlanarPose,
}

/// CAD models of the tools of some pairs, ready to register.
pub(super) type Models<'a> = BTreeMap<&'a str, ToolModel>;

/// The models of these pairs' tools, as far as they can be used.
pub(super) fn models<'a>(pairs: &[PairInput<'a>], tools: &BTreeMap<String, TriMesh>) -> Models<'a> {
    let named: BTreeMap<&str, &TriMesh> =
        pairs.iter().filter_map(|pair| Some((pair.tool?, tools.get(pair.tool?)?))).collect();
    named.par_iter().filter_map(|(name, mesh)| Some((*name, ToolModel::new((*mesh).clone()).ok()?))).collect()
}

/// Figures of the registrations of some pairs, by the verdicts and the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worth {
    /// Pairs with a CAD model and cameras.
    pub tried: usize,
    /// Poses that are good by their verdict.
    pub good: usize,
    /// Poses that are wrong by it.
    pub wrong: usize,
    /// Largest error of an angle, radians; 0 where no truth is known.
    pub largest_error_rad: f64,
}

impl Worth {
    /// True where a cure that leads from the other to this spoils data: fewer poses are good, more are wrong, or the largest
    /// error of an angle clearly grows.
    pub fn is_worse_than(&self, before: &Self) -> bool {
        self.good < before.good
            || self.wrong > before.wrong
            || self.largest_error_rad > before.largest_error_rad + WORSE_RAD
    }
}

/// Registrations of some pairs.
pub(super) struct Registered<'m, 'a> {
    sure: Vec<Sure>,
    models: &'m Models<'a>,
    /// Pairs with a CAD model and cameras, those of them with a truth, and those whose registration is wrong by its verdict.
    pub(super) tried: usize,
    asked: usize,
    wrong: usize,
    /// Poses that contradict the touch: none was found, the verdict calls it wrong, or the angle is far from the true one.
    pub(super) contradicting: usize,
    /// Largest error of a registered angle, radians; 0 where no truth is known.
    largest_error_rad: f64,
}

impl<'m, 'a> Registered<'m, 'a> {
    /// Registers the pairs.
    pub(super) fn of(pairs: &[PairInput<'_>], models: &'m Models<'a>) -> Self {
        let tried: Vec<(usize, &Sample, &ToolModel)> = (0..)
            .zip(pairs)
            .filter_map(|(at, pair)| Some((at, pair.sample, models.get(pair.tool?)?)))
            .filter(|(_, sample, _)| sample.pads.iter().flatten().any(|t| t.depth().is_some() && t.camera().is_some()))
            .collect();
        let asked = tried.iter().filter(|(_, sample, _)| sample.grasp_from_object.is_some()).count();
        let found: Vec<Option<(Grade, PlanarPose)>> =
            tried.par_iter().map(|(_, sample, model)| graded_pose(sample, model)).collect();
        let wrong = found.iter().flatten().filter(|(grade, _)| *grade == Grade::Wrong).count();
        let sure = tried.iter().zip(&found).filter_map(|((at, sample, _), found)| {
            let (_, found) = found.filter(|(grade, _)| *grade == Grade::Good)?;
            Some(Sure { at: *at, truth: sample.grasp_from_object, found })
        });
        let errors = tried.iter().zip(&found).filter_map(|((_, sample, _), found)| {
            let truth = sample.grasp_from_object?;
            // No pose is no smaller error than any.
            Some(found.map_or(std::f64::consts::PI, |(_, found)| angle_error(found.theta_rad, truth.theta_rad)))
        });
        let largest_error_rad = errors.clone().fold(0.0, f64::max);
        let far = errors.filter(|error| *error > FAR_RAD).count();
        let lost = found.iter().filter(|found| found.is_none_or(|(grade, _)| grade == Grade::Wrong)).count();
        let contradicting = far.max(lost);
        Self { sure: sure.collect(), models, tried: tried.len(), asked, wrong, contradicting, largest_error_rad }
    }

    /// Figures that a cure must not worsen.
    pub(super) fn worth(&self) -> Worth {
        let Self { tried, wrong, largest_error_rad, .. } = *self;
        Worth { tried, good: self.sure.len(), wrong, largest_error_rad }
    }

    /// Good registrations that are near the truth, where it is known.
    pub(super) fn right(&self) -> usize {
        self.sure.iter().filter(|sure| sure.truth.is_none_or(|truth| is_near(sure.found, truth))).count()
    }

    /// The good registrations with a truth: found and true pose.
    fn known(&self) -> impl Iterator<Item = (&Sure, PlanarPose)> + Clone {
        self.sure.iter().filter_map(|sure| Some((sure, sure.truth?)))
    }

    fn near(&self) -> usize {
        self.known().filter(|(sure, truth)| is_near(sure.found, *truth)).count()
    }

    /// True where every pair has a truth and a good registration that agrees with it: CAD models and poses are right.
    pub(super) fn agree(&self) -> bool {
        self.tried > 0 && self.near() == self.tried
    }

    /// True where, after a cure, most registrations are good and near the truth, no fewer than before, and no further from it.
    pub(super) fn is_cured_by(&self, cured: &Self) -> bool {
        let off = |all: &Self| median(all.known().map(|(sure, truth)| off(sure.found, truth))).unwrap_or(f64::INFINITY);
        let most = |count: usize, before: usize, of: usize| count >= before && count as f64 >= SURE * of as f64;
        !cured.worth().is_worse_than(&self.worth())
            && most(cured.sure.len(), self.sure.len(), self.tried)
            && most(cured.near(), self.near(), self.asked)
            && (self.asked == 0 || off(cured) <= off(self).max(WELL))
    }

    /// Nothing that was tried mends what is wrong, as far as something is.
    pub(super) fn unexplained(&self) -> Option<Doubt> {
        ((self.sure.len() as f64) < SURE * self.tried as f64)
            .then(|| no_cure(&format!("{} of {} registered poses are good", self.sure.len(), self.tried)))
    }

    /// Most registrations are wrong by their own verdict, and nothing else shows.
    pub(super) fn mostly_wrong(&self) -> Option<Doubt> {
        (self.wrong >= FEWEST && self.wrong as f64 >= MOST * self.tried as f64)
            .then(|| no_cure(&format!("{} of {} registered poses are wrong", self.wrong, self.tried)))
    }

    /// The mismatch of truth and registrations where they contradict each other, with the mean likeness where it is mended.
    pub(super) fn mismatch(&self, pairs: &[PairInput<'_>]) -> Option<(Mismatch, f64)> {
        let count = self.known().count();
        let far = count - self.near();
        if count < FEWEST || (count as f64) < SURE * self.asked as f64 || (far as f64) < FAR * count as f64 {
            return None;
        }
        let explained = self.explanations(pairs).into_iter().filter_map(|(mismatch, truths)| {
            let both = truths.iter().zip(self.known());
            let off = both.map(|(truth, (sure, _))| truth.map_or(f64::INFINITY, |truth| off(sure.found, truth)));
            let near = off.clone().filter(|off| *off <= 1.0).count();
            (near as f64 >= MOST * count as f64).then_some((near, median(off)?, mismatch, truths))
        });
        let best = explained.max_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        let (mismatch, truths) = match best {
            Some((_, _, mismatch, truths)) => (mismatch, truths),
            None => (Mismatch::Unknown, self.known().map(|(sure, _)| Some(sure.found)).collect()),
        };
        Some((mismatch, self.likeness(pairs, &truths)))
    }

    /// The mean likeness of the good registrations with a truth at these poses.
    fn likeness(&self, pairs: &[PairInput<'_>], poses: &[Option<PlanarPose>]) -> f64 {
        let one = |((sure, _), pose): ((&Sure, PlanarPose), &Option<PlanarPose>)| {
            let pair = pairs[sure.at];
            Some(likeness(&grainless(pair.sample), &self.models.get(pair.tool?)?.field, (*pose)?))
        };
        let found: f64 = self.known().zip(poses).filter_map(one).sum();
        found / self.known().count().max(1) as f64
    }

    /// Explanations of what is wrong with the truth, and the truths of the good registrations if it is.
    fn explanations(&self, pairs: &[PairInput<'_>]) -> Vec<(Mismatch, Vec<Option<PlanarPose>>)> {
        let known: Vec<(Sure, PlanarPose)> = self.known().map(|(sure, truth)| (*sure, truth)).collect();
        let all = |of: &dyn Fn(&Sure, PlanarPose) -> PlanarPose| {
            known.iter().map(|(sure, truth)| Some(of(sure, *truth))).collect::<Vec<_>>()
        };
        let with_angle = |of: &dyn Fn(f64) -> f64| {
            all(&|_, truth| {
                let lab = truth.inverse();
                PlanarPose { theta_rad: of(lab.theta_rad), ..lab }.inverse()
            })
        };
        let mut tried = vec![(Mismatch::Inverse, all(&|_, truth| truth.inverse()))];
        for factor in [2.0, 0.5, 1f64.to_degrees(), 1f64.to_radians()] {
            tried.push((Mismatch::Factor(factor), with_angle(&|theta| theta / factor)));
        }
        let first = known.first().map_or(0.0, |(_, truth)| truth.theta_rad);
        if known.iter().all(|(_, truth)| angle_error(truth.theta_rad, first) < SAME_RAD) {
            // Whatever the angles are, they are not these.
            tried.push((Mismatch::Constant, all(&|sure, _| sure.found)));
        } else if let Some(off) =
            median(known.iter().map(|(sure, truth)| wrap_angle(sure.found.theta_rad - truth.theta_rad)))
        {
            tried.push((Mismatch::Angle(off), with_angle(&|theta| theta - off)));
        }
        for on in [-1, 1] {
            let truths = known.iter().map(|(sure, _)| (pairs[sure.at].beside?)(on));
            tried.push((Mismatch::Neighbor(on), truths.collect()));
        }
        // One rigid motion on the side of the gripper, or of the object; a mere turn is that of the angles.
        let moves = |motion: &PlanarPose| motion.y_m.hypot(motion.z_m) > MOVED_M;
        let of_gripper = typical(known.iter().map(|(sure, truth)| sure.found.compose(truth.inverse())));
        if let Some(motion) = of_gripper.filter(moves) {
            let mismatch = Mismatch::GraspFrame(-DVec2::new(motion.y_m, motion.z_m), -motion.theta_rad);
            tried.push((mismatch, all(&|_, truth| motion.compose(truth))));
        }
        let of_object = typical(known.iter().map(|(sure, truth)| truth.inverse().compose(sure.found)));
        if let Some(motion) = of_object.filter(moves) {
            let mismatch = Mismatch::ObjectFrame(-DVec2::new(motion.y_m, motion.z_m));
            tried.push((mismatch, all(&|_, truth| truth.compose(motion))));
        }
        tried
    }

    /// The doubt about the true poses, in words.
    pub(super) fn doubt(&self, mismatch: Mismatch) -> Doubt {
        let apart = self.known().map(|(sure, truth)| PoseDifference::between(sure.found, truth));
        let angle = median(apart.clone().map(|apart| apart.angle_rad));
        let place = median(apart.map(|apart| apart.position_m));
        let what = format!(
            "the true poses contradict the imprints: registered without them, {} of {} poses are good, and they are a median of \
             {}° and {} mm away from the stored ones; {}",
            self.known().count(),
            self.asked,
            fixed(angle.unwrap_or(f64::NAN).to_degrees(), 1),
            fixed(1e3 * place.unwrap_or(f64::NAN), 1),
            mismatch.text()
        );
        Doubt::new(Cause::Poses(mismatch), what, mismatch.hint())
    }
}

/// Imprints and CAD models do not go together, and it is not known why.
fn no_cure(figures: &str) -> Doubt {
    let what =
        format!("the imprints do not lie well on their CAD models: {figures}, and nothing that was tried fixes it");
    Doubt::new(
        Cause::Unexplained,
        what,
        "check the cameras, the depths without contact, and the frames of CAD models and poses",
    )
}

/// Distance of two poses; from 1 on they contradict each other.
fn off(a: PlanarPose, b: PlanarPose) -> f64 {
    let apart = PoseDifference::between(a, b);
    (apart.angle_rad / FAR_RAD).max(apart.position_m / FAR_M)
}

fn is_near(a: PlanarPose, b: PlanarPose) -> bool {
    off(a, b) <= 1.0
}

/// The motion in the middle of all.
fn typical(motions: impl Iterator<Item = PlanarPose> + Clone) -> Option<PlanarPose> {
    Some(PlanarPose {
        theta_rad: median(motions.clone().map(|m| wrap_angle(m.theta_rad)))?,
        y_m: median(motions.clone().map(|m| m.y_m))?,
        z_m: median(motions.map(|m| m.z_m))?,
    })
}

/// The registered pose, from membranes and contact by depth alone, and the verdict on it.
fn graded_pose(sample: &Sample, tool: &ToolModel) -> Option<(Grade, PlanarPose)> {
    let points = contact_points(sample)?;
    let depths = sample.pads.iter().flatten().filter_map(|touch| touch.depth().zip(touch.camera()));
    let depths = depths.filter(|(depth, _)| rest_and_top(&depth.imprint).is_some());
    let tolerance = sample.rig.camera_tolerance;
    let images =
        depths.map(|(depth, camera)| PadImage { imprint: &depth.imprint, camera, predicted: false, tolerance });
    let images: Vec<_> = images.collect();
    let contacts = Contacts { points: &points, images: &images };
    let ask = Ask { evidence: true, in_lab_grid: sample.in_lab_grid, ..Ask::default() };
    let report = register_with(&*Registration::default().method(), contacts, tool, ask).ok()?;
    // Of answers that fit about as well the one that is stored, if one is.
    let answers =
        || std::iter::once(report.grasp_from_object).chain(report.answers.iter().map(|a| a.grasp_from_object));
    let nearest = |truth: PlanarPose| answers().map(move |found| Symmetry::of(tool).nearest(found, truth));
    let stored = sample.grasp_from_object.and_then(|truth| nearest(truth).find(|found| is_near(*found, truth)));
    Some((Verdict::of(&report)?.grade, stored.unwrap_or(report.grasp_from_object)))
}
