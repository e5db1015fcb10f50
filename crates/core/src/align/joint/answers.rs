//! All the poses that the evidence does not tell apart, with their weights.

use serde::{Deserialize, Serialize};

use super::cost::Joint;
use super::problem::{KERNELS_M, LAST, POINTS, Problem, alike};
use super::smooth::DECIDING;
use crate::align::batch::State;
use crate::align::search::Cost as _;
use crate::align::{AlignReport, Range};
use crate::frames::PlanarPose;
use crate::symmetry::Symmetry;
use crate::units::angle_error;

/// Share of the difference of costs that counts: model errors make costs differ by more than noise does. From fresh grasps.
const COUNTS: f64 = 0.04;
/// Least weight of an answer that is told.
const LEAST: f64 = 0.1;
/// Ends at most this far apart are one: radians, meters. Farther ones are where the cost between them is hardly higher, as a
/// share: a tool that slides along itself.
const SAME_RAD: f64 = 4.0 / 180.0 * std::f64::consts::PI;
const SAME_M: f64 = 2e-3;
const VALLEY: f64 = 0.02;

/// Pose of the tool that the touch allows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseAnswer {
    /// The tool in the hand.
    pub grasp_from_object: PlanarPose,
    /// Chance that it is this one, 0 to 1.
    pub weight: f64,
    /// True for the first one, and for those that the tool's symmetry makes of it.
    pub alike: bool,
}

/// Answers of poses with weights: each with those that the tool's symmetry makes of it, in the range, by equal parts. The first
/// pose stays the first.
pub(super) fn shared(poses: Vec<(PlanarPose, f64)>, symmetry: &Symmetry, range: Range) -> Vec<PoseAnswer> {
    let mut all = Vec::new();
    for (i, (pose, weight)) in poses.into_iter().enumerate() {
        let mut copies: Vec<PlanarPose> =
            symmetry.alike(pose).skip(1).filter(|copy| range.prior().allows(*copy)).collect();
        copies.insert(0, pose);
        let weight = weight / copies.len() as f64;
        all.extend(copies.into_iter().map(|grasp_from_object| PoseAnswer { grasp_from_object, weight, alike: i == 0 }));
    }
    if let Some((_, others)) = all.split_first_mut() {
        others.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    }
    all
}

impl Problem<'_> {
    /// The answers, of which the report's is the first.
    pub(super) fn answers(&self, report: &AlignReport, symmetry: &Symmetry) -> Vec<PoseAnswer> {
        let centroid = self.centroid();
        let own = State::from_pose(report.grasp_from_object, centroid);
        let mut ends = vec![(own, f64::INFINITY)];
        ends.extend(report.ends.iter().map(|(pose, cost)| (State::from_pose(*pose, centroid), *cost)));
        let mut distinct: Vec<(State, f64)> = Vec::new();
        for (state, cost) in ends {
            match distinct.iter_mut().find(|(known, _)| self.same(*known, state, symmetry)) {
                Some((_, known)) => *known = known.min(cost),
                None => distinct.push((state, cost)),
            }
        }
        let least = distinct.iter().map(|(_, cost)| *cost).fold(f64::INFINITY, f64::min);
        if !least.is_finite() {
            return shared(vec![(report.grasp_from_object, 1.0)], symmetry, report.range);
        }
        let telling = self.telling(&self.patches_at(DECIDING, POINTS[LAST], own), own);
        let chance = |cost: f64| (-0.5 * COUNTS * telling * (cost - least)).exp();
        let sum: f64 = distinct.iter().map(|(_, cost)| chance(*cost)).sum();
        distinct[1..].sort_by(|a, b| a.1.total_cmp(&b.1));
        let told = distinct.iter().enumerate().filter(|(i, (_, cost))| *i == 0 || chance(*cost) >= LEAST * sum);
        let mut told: Vec<(PlanarPose, f64)> =
            told.map(|(_, (at, cost))| (at.to_pose(centroid), chance(*cost))).collect();
        // Its own pose, which a state rounds.
        told[0].0 = report.grasp_from_object;
        shared(told.into_iter().map(|(pose, chance)| (pose, chance / sum)).collect(), symmetry, report.range)
    }

    /// True where two ends are one answer, up to the tool's symmetry.
    fn same(&self, a: State, b: State, symmetry: &Symmetry) -> bool {
        symmetry.alike(b.to_pose(self.centroid())).any(|copy| {
            let copy = State::from_pose(copy, self.centroid());
            let turned = angle_error(a.phi, copy.phi);
            alike(&a, &copy) || turned < SAME_RAD && (a.place.distance(copy.place) < SAME_M || self.slides(a, copy))
        })
    }

    /// True where the cost half way between two states of about one angle is hardly higher than at the dearer one.
    fn slides(&self, a: State, b: State) -> bool {
        let middle = State { phi: a.phi, place: 0.5 * (a.place + b.place) };
        let [from, half, to] = [a, middle, b].map(|at| {
            let fingers = self.patches_at(DECIDING, POINTS[LAST - 1], at);
            Joint { fingers: &fingers, kernel_m: KERNELS_M[LAST], mask: None, lookups: 0 }.sums(at).cost
        });
        half <= from.max(to) * (1.0 + VALLEY)
    }
}
