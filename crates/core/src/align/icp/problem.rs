//! Pairs of contacts and model points at a pose, and the step that the pairs ask for.

use std::num::NonZero;

use glam::{DMat3, DQuat, DVec2, DVec3};
use nalgebra::{Matrix3, Matrix6, Vector6};

use super::IcpConfig;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

use super::policy::{Dof, Kernel, Rejector, Residual, Solver, Target};
use super::prepared;
use super::samples::{Matcher, Samples};
use crate::align::closed_form::closest_rotation;
use crate::align::{ANGLE_SCALE_M, Fate};
use crate::frames::PlanarPose;
use crate::linear::{eigen_symmetric, solve_symmetric};
use crate::mesh::MeshDistance;
use crate::tool::ToolModel;

/// Spread of a surface across itself for one along it, in Generalized-ICP. Its authors take 0.001 for walls and
/// streets; contacts tell most by where they end, which is along their surface, so that must keep a voice.
const ACROSS: f64 = 0.1;
/// Contacts whose spread gives a contact's normal.
const NEIGHBORS: NonZero<usize> = NonZero::new(20).expect("twenty is not zero");
/// Distance below which a pair counts as an inlier in reports, meters.
pub(super) const INLIER_M: f64 = 1e-3;

/// `object_from_grasp` about the contacts' centroid: `q = rotation (p - centroid) + place`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    pub(super) rotation: DQuat,
    pub(super) place: DVec3,
}

impl State {
    pub(super) fn from_pose(grasp_from_object: PlanarPose, centroid: DVec3) -> Self {
        let inverse = grasp_from_object.inverse();
        let yz = inverse.transform_yz(DVec2::new(centroid.y, centroid.z));
        Self { rotation: DQuat::from_rotation_x(inverse.theta_rad), place: DVec3::new(centroid.x, yz.x, yz.y) }
    }

    /// `grasp_from_object`.
    pub(super) fn to_affine(self, centroid: DVec3) -> glam::DAffine3 {
        let back = self.rotation.inverse();
        glam::DAffine3::from_rotation_translation(back, centroid - back * self.place)
    }

    /// The planar `grasp_from_object` nearest to this one: the angle about x that fits the whole rotation best,
    /// which is defined where the third of three Euler angles is not, and the shift that keeps the contacts'
    /// centroid where it is on the tool.
    pub(super) fn to_planar(self, centroid: DVec3) -> PlanarPose {
        let m = DMat3::from_quat(self.rotation);
        let phi = (m.y_axis.z - m.z_axis.y).atan2(m.y_axis.y + m.z_axis.z);
        let grasp = DVec2::new(centroid.y, centroid.z);
        let shift = DVec2::new(self.place.y, self.place.z) - DVec2::from_angle(phi).rotate(grasp);
        PlanarPose { theta_rad: phi, y_m: shift.x, z_m: shift.y }.inverse()
    }

    /// The state after a step of (turn times [`ANGLE_SCALE_M`], shift), three numbers each.
    fn moved(self, step: &[f64; 6]) -> Self {
        let turn = DVec3::new(step[0], step[1], step[2]) / ANGLE_SCALE_M;
        let rotation = (DQuat::from_scaled_axis(turn) * self.rotation).normalize();
        Self { rotation, place: self.place + DVec3::new(step[3], step[4], step[5]) }
    }

    /// The step from `other` to here.
    fn since(self, other: Self) -> [f64; 6] {
        let turn = (self.rotation * other.rotation.inverse()).to_scaled_axis() * ANGLE_SCALE_M;
        let shift = self.place - other.place;
        [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
    }
}

/// Size of a step, meters: the larger of its turn (times [`ANGLE_SCALE_M`]) and its shift.
fn size(step: &[f64; 6]) -> f64 {
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    norm(&step[..3]).max(norm(&step[3..]))
}

/// A contact with its model point.
#[derive(Clone, Copy, Debug)]
struct Pair {
    /// From the contacts' centroid, turned into the object frame.
    arm: DVec3,
    model: DVec3,
    normal: DVec3,
    /// Weighs the difference of the two: `residual^2 = d . precision d`.
    precision: DMat3,
    residual: f64,
    distance: f64,
    weight: f64,
    rejected: Option<Fate>,
}

/// Sums over the pairs at one state.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// Per contact that counts, square meters.
    pub(super) cost: f64,
    pub(super) weight: f64,
    pub(super) inliers: usize,
    pub(super) inlier_squares: f64,
    /// True where a contact has another nearest model point than at the last look.
    pub(super) changed: bool,
}

enum Model<'a> {
    Samples(Samples),
    Mesh(&'a MeshDistance),
}

pub(super) struct Problem<'a> {
    config: &'a IcpConfig,
    model: Model<'a>,
    /// Contacts from their centroid, grasp frame.
    arms: Vec<DVec3>,
    /// Normals of the contacts where they are needed.
    normals: Vec<DVec3>,
    matcher: Matcher,
    pairs: Vec<Pair>,
    /// Distances at the last look at the mesh, as a bound for the next one: (where, how far).
    seen: Vec<(DVec3, f64)>,
    pub(super) lookups: usize,
}

impl<'a> Problem<'a> {
    /// `points` are to be aligned; `cloud` are all there are, from which normals are taken. Both are finite, in the
    /// grasp frame, with x = 0 if the target is the silhouette.
    pub(super) fn new(
        config: &'a IcpConfig,
        tool: &'a ToolModel,
        points: &[DVec3],
        cloud: &[DVec3],
        centroid: DVec3,
    ) -> Self {
        let model = match config.target {
            Target::Silhouette => Model::Samples(prepared::silhouette(tool)),
            Target::Surface => Model::Samples(prepared::in_space(tool)),
            Target::Mesh => prepared::instead_of_triangles(tool).map_or(Model::Mesh(&tool.distance), Model::Samples),
        };
        let arms: Vec<DVec3> = points.iter().map(|p| *p - centroid).collect();
        let normals = if config.residual == Residual::Generalized { normals(points, cloud) } else { Vec::new() };
        Self {
            config,
            model,
            matcher: Matcher::new(arms.len()),
            pairs: Vec::with_capacity(arms.len()),
            seen: vec![(DVec3::ZERO, f64::INFINITY); arms.len()],
            arms,
            normals,
            lookups: 0,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.arms.len()
    }

    /// Model points to compare with; any mesh has enough.
    pub(super) fn model_points(&self) -> usize {
        match &self.model {
            Model::Samples(samples) => samples.len(),
            Model::Mesh(_) => usize::MAX,
        }
    }

    /// Pairs every contact under `state` and weighs the pairs.
    pub(super) fn look(&mut self, state: State, kernel: Kernel, anchor: State) -> Sums {
        let turn = DMat3::from_quat(state.rotation);
        let mut sums = Sums::default();
        self.pairs.clear();
        for (i, arm) in self.arms.iter().enumerate() {
            let arm = turn * *arm;
            let q = arm + state.place;
            let (model, normal) = match &self.model {
                Model::Samples(samples) => {
                    let (item, changed) = self.matcher.find(samples, i, q);
                    sums.changed |= changed;
                    (samples.point(item), samples.normal(item))
                }
                Model::Mesh(mesh) => {
                    self.lookups += 1;
                    sums.changed = true;
                    // The surface cannot be farther than it was plus the way since.
                    let (at, distance) = self.seen[i];
                    let limit = (distance + at.distance(q)) * (1.0 + 1e-6) + 1e-9;
                    let found = mesh.closest(q, limit).or_else(|| mesh.closest(q, f64::INFINITY));
                    let (point, normal) = found.unwrap_or((q, DVec3::ZERO));
                    self.seen[i] = (q, point.distance(q));
                    (point, normal)
                }
            };
            let precision = match self.config.residual {
                Residual::PointToPoint => DMat3::IDENTITY,
                Residual::PointToPlane => outer(normal),
                Residual::Generalized => precision(normal, turn * self.normals[i]),
            };
            let d = q - model;
            let residual = d.dot(precision * d).max(0.0).sqrt();
            let weight = kernel.weight(residual);
            self.pairs.push(Pair {
                arm,
                model,
                normal,
                precision,
                residual,
                distance: d.length(),
                weight,
                rejected: None,
            });
        }
        let counted = self.reject(kernel, &mut sums.cost);
        for pair in self.pairs.iter().filter(|p| p.rejected.is_none()) {
            sums.cost += kernel.cost(pair.residual);
            sums.weight += pair.weight;
            if pair.residual <= INLIER_M {
                sums.inliers += 1;
                sums.inlier_squares += pair.residual * pair.residual;
            }
        }
        if let Model::Samples(_) = self.model {
            self.lookups = self.matcher.lookups;
        }
        sums.cost /= counted as f64;
        sums.cost += self.config.anchor * state.since(anchor).iter().map(|x| x * x).sum::<f64>();
        sums
    }

    /// Marks the pairs that take no part; what they pay all the same goes to `cost`. The number of pairs that pay.
    fn reject(&mut self, kernel: Kernel, cost: &mut f64) -> usize {
        match self.config.rejector {
            Rejector::None => self.pairs.len(),
            Rejector::MaxDistance { distance_m } => {
                for pair in self.pairs.iter_mut().filter(|p| p.distance > distance_m) {
                    pair.weight = 0.0;
                    pair.rejected = Some(Fate::BeyondGate);
                    *cost += kernel.cost(distance_m);
                }
                self.pairs.len()
            }
            Rejector::Trimmed { keep } => {
                let kept = ((self.pairs.len() as f64 * keep).ceil() as usize).clamp(1, self.pairs.len());
                let mut order: Vec<usize> = (0..self.pairs.len()).collect();
                // By position where equal, so that the choice does not depend on the sort.
                order.sort_by(|&a, &b| self.pairs[a].residual.total_cmp(&self.pairs[b].residual).then(a.cmp(&b)));
                for &i in &order[kept..] {
                    self.pairs[i].weight = 0.0;
                    self.pairs[i].rejected = Some(Fate::Trimmed);
                }
                kept
            }
        }
    }

    /// The state that the pairs of the last [`Self::look`] ask for, and how far away it is, meters. `None` if the
    /// pairs determine none with this much damping.
    pub(super) fn step(&self, state: State, damping: f64, anchor: State) -> Option<(State, f64)> {
        match self.config.solver {
            Solver::ClosedForm => {
                let next = match self.config.dof {
                    Dof::Planar => self.closest_in_plane(state)?,
                    Dof::Full => self.closest_in_space(state)?,
                };
                Some((next, size(&next.since(state))))
            }
            Solver::LevenbergMarquardt => {
                let step = self.damped_step(state, damping, anchor)?;
                Some((state.moved(&step), size(&step)))
            }
        }
    }

    fn damped_step(&self, state: State, damping: f64, anchor: State) -> Option<[f64; 6]> {
        let mut h = Matrix6::<f64>::zeros();
        let mut g = Vector6::<f64>::zeros();
        let mut weight = 0.0;
        for pair in self.pairs.iter().filter(|p| p.weight > 0.0) {
            weight += pair.weight;
            let arm = pair.arm / ANGLE_SCALE_M;
            let slopes = [
                DVec3::new(0.0, -arm.z, arm.y),
                DVec3::new(arm.z, 0.0, -arm.x),
                DVec3::new(-arm.y, arm.x, 0.0),
                DVec3::X,
                DVec3::Y,
                DVec3::Z,
            ];
            let pull = pair.precision * (pair.arm + state.place - pair.model);
            for (i, slope) in slopes.iter().enumerate() {
                let weighed = pair.weight * (pair.precision * *slope);
                g[i] += pair.weight * slope.dot(pull);
                for (j, other) in slopes[..=i].iter().enumerate() {
                    h[(i, j)] += weighed.dot(*other);
                }
            }
        }
        let away = state.since(anchor);
        let stiffness = self.config.anchor * self.pairs.len() as f64;
        for i in 0..6 {
            // The same in all directions: one without slope gets no step instead of an arbitrary one.
            h[(i, i)] += damping * weight.max(1e-12) + stiffness;
            g[i] = -(g[i] + stiffness * away[i]);
        }
        solve_symmetric(h, g, self.config.dof.free()).map(Into::into)
    }

    /// Weighted means of the contacts (from their centroid) and of their model points.
    fn means(&self) -> Option<(DVec3, DVec3)> {
        let (mut arms, mut models, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for pair in &self.pairs {
            arms += pair.weight * pair.arm;
            models += pair.weight * pair.model;
            weight += pair.weight;
        }
        (weight > 0.0 && arms.is_finite() && models.is_finite()).then(|| (arms / weight, models / weight))
    }

    /// The turn about x and the shift in y and z that bring the pairs closest. Read from the correlation directly,
    /// which unlike a decomposition cannot return a reflection.
    fn closest_in_plane(&self, state: State) -> Option<State> {
        let (arm, model) = self.means()?;
        let (mut dot, mut cross) = (0.0, 0.0);
        for pair in &self.pairs {
            let (a, m) = (pair.arm - arm, pair.model - model);
            dot += pair.weight * (a.y * m.y + a.z * m.z);
            cross += pair.weight * (a.y * m.z - a.z * m.y);
        }
        let turn = DQuat::from_rotation_x(cross.atan2(dot));
        let place = (model - turn * arm).with_x(state.place.x);
        Some(State { rotation: (turn * state.rotation).normalize(), place })
    }

    /// The turn and the shift that bring the pairs closest.
    fn closest_in_space(&self, state: State) -> Option<State> {
        let (arm, model) = self.means()?;
        let mut correlation = DMat3::ZERO;
        for pair in &self.pairs {
            let (a, m) = (pair.arm - arm, pair.weight * (pair.model - model));
            correlation += DMat3::from_cols(a * m.x, a * m.y, a * m.z);
        }
        let turn = closest_rotation(correlation)?;
        Some(State { rotation: (turn * state.rotation).normalize(), place: model - turn * arm })
    }

    /// Residual (meters), weight and fate of every contact at the last look.
    pub(super) fn outcome(&self, kernel: Kernel) -> impl Iterator<Item = (f64, f64, Fate)> + '_ {
        /// Kernel widths from which on a pull is negligible.
        const GATE: f64 = 3.0;
        self.pairs.iter().map(move |pair| {
            let fate = pair.rejected.unwrap_or({
                if pair.residual > GATE * kernel.width_m() {
                    Fate::BeyondGate
                } else if self.config.residual == Residual::PointToPlane && pair.normal == DVec3::ZERO {
                    Fate::Inside
                } else {
                    Fate::Inlier
                }
            });
            (pair.residual, pair.weight, fate)
        })
    }
}

fn outer(n: DVec3) -> DMat3 {
    DMat3::from_cols(n * n.x, n * n.y, n * n.z)
}

/// Inverse of the sum of two surfaces' spreads, each 1 along the surface and [`ACROSS`] along its normal. Scaled so
/// that the residual across two surfaces with the same normal is their distance: kernels stay in meters.
fn precision(a: DVec3, b: DVec3) -> DMat3 {
    2.0 * ACROSS * (2.0 * DMat3::IDENTITY - (1.0 - ACROSS) * (outer(a) + outer(b))).inverse()
}

/// The direction in which each point's neighbors in the cloud spread least.
fn normals(points: &[DVec3], cloud: &[DVec3]) -> Vec<DVec3> {
    let places: Vec<[f64; 3]> = cloud.iter().map(DVec3::to_array).collect();
    let Ok(tree) = ImmutableKdTree::<f64, 3>::new_from_slice(&places) else {
        return vec![DVec3::ZERO; points.len()];
    };
    points
        .iter()
        .map(|p| {
            let near = tree.query(&p.to_array()).nearest_n::<SquaredEuclidean<f64>>(NEIGHBORS).execute();
            let mean = near.iter().map(|n| cloud[n.item as usize]).sum::<DVec3>() / near.len().max(1) as f64;
            let spread: DMat3 = near.iter().map(|n| outer(cloud[n.item as usize] - mean)).sum();
            let found = eigen_symmetric(Matrix3::from(spread.to_cols_array_2d()));
            found.map_or(DVec3::ZERO, |(_, vectors)| DVec3::from_array(vectors.column(0).into()))
        })
        .collect()
}
