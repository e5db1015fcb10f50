//! Depth to pose in one call: what the command line and the studio both use.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::align::{
    AlignConfig, AlignError, AlignReport, Ask, Directions, IcpConfig, LabIcpConfig, RefineConfig, Register, Scene, icp,
};
use super::cloud::{CloudError, ContactCloud, lift};
use super::frames::PlanarPose;
use super::grid::{DepthMap, Mask};
use super::rig::{PadId, PerPad, Rig, Text};
use super::sample::{DepthCamera, Sample};

pub use super::tool::{ToolError, ToolModel};

/// Which registration answers.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    strum::EnumIter,
    strum::Display,
    strum::EnumString,
    strum::IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Engine {
    /// Robust registration on the distance field of the tool's silhouette.
    #[default]
    DistanceField,
    /// The same with a proof by branch and bound.
    Certified,
    /// The lab's planar point-to-point loop.
    LabIcp,
    /// Point to point on the silhouette.
    PlanarPointToPoint,
    /// Point to plane on the silhouette.
    PlanarPointToPlane,
    /// Generalized-ICP in the plane.
    PlanarGicp,
    /// Point to point in space.
    PointToPoint,
    /// Point to plane in space.
    PointToPlane,
    /// Generalized-ICP in space.
    Gicp,
    /// The default in the plane, then against the triangles in space.
    Refined,
}

impl Engine {
    /// Name in settings, files and on the command line, such as `distance_field`.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::DistanceField => "ICP (distance field)",
            Self::Certified => "ICP (distance field), certified",
            Self::LabIcp => "ICP (paper)",
            Self::PlanarPointToPoint => "ICP point-point, planar",
            Self::PlanarPointToPlane => "ICP point-plane, planar",
            Self::PlanarGicp => "GICP, planar",
            Self::PointToPoint => "ICP point-point, 6 DoF",
            Self::PointToPlane => "ICP point-plane, 6 DoF",
            Self::Gicp => "GICP, 6 DoF",
            Self::Refined => "Refined, 6 DoF",
        }
    }

    /// What it does, in one line.
    pub fn description(self) -> &'static str {
        match self {
            Self::DistanceField => "Robust least squares on the distance field of the silhouette: the default",
            Self::Certified => {
                "The default's answer with a proof: branch and bound, no pose of the prior is 2 % better"
            }
            Self::LabIcp => "The paper's loop: planar point to point, one start, up to 200 iterations, no rejection",
            Self::PlanarPointToPoint => {
                "Planar, nearest model points, far pairs left out, closed-form steps, ten starts"
            }
            Self::PlanarPointToPlane => "Planar, distance along the outline's normals, robust kernel, ten starts",
            Self::PlanarGicp => "Planar, surface to surface with both sides' normals, Huber's kernel, ten starts",
            Self::PointToPoint => "Six degrees of freedom, nearest model points, far pairs left out, ten starts",
            Self::PointToPlane => {
                "Six degrees of freedom, distance along the surface's normals, far pairs left out, ten starts"
            }
            Self::Gicp => {
                "Six degrees of freedom, surface to surface with both sides' normals, Huber's kernel, ten starts"
            }
            Self::Refined => {
                "The default, then robust point to plane against the triangles with six degrees of freedom"
            }
        }
    }

    /// The registration with the settings that the product uses.
    pub fn registration(self) -> Box<dyn Register> {
        match self {
            Self::DistanceField => Box::new(AlignConfig::default()),
            Self::Certified => Box::new(AlignConfig::certified()),
            Self::LabIcp => Box::new(LabIcpConfig::default()),
            Self::PlanarPointToPoint => Box::new(IcpConfig::planar_point_to_point()),
            Self::PlanarPointToPlane => Box::new(IcpConfig::planar_point_to_plane()),
            Self::PlanarGicp => Box::new(IcpConfig::planar_gicp()),
            Self::PointToPoint => Box::new(IcpConfig::point_to_point()),
            Self::PointToPlane => Box::new(IcpConfig::point_to_plane()),
            Self::Gicp => Box::new(IcpConfig::gicp()),
            Self::Refined => Box::new(RefineConfig::default()),
        }
    }
}

/// One finger's part of the question.
#[derive(Clone, Copy, Debug)]
pub struct FingerInput<'a> {
    /// Measured or predicted imprint, meters, raw orientation.
    pub imprint: &'a DepthMap,
    /// The camera that saw it, or that would have.
    pub camera: &'a DepthCamera,
    /// Contact pixels; all without one.
    pub mask: Option<&'a Mask>,
}

/// Which fingers take part.
#[derive(Clone, Debug)]
pub struct Fingers<'a> {
    rig: Arc<Rig>,
    inputs: PerPad<FingerInput<'a>>,
}

impl<'a> Fingers<'a> {
    /// Whether no pad takes part.
    pub fn is_empty(&self) -> bool {
        self.inputs.is_empty()
    }

    /// Those pads of a rig for which there is something.
    pub fn new(rig: &Arc<Rig>, of: impl FnMut(PadId) -> Option<FingerInput<'a>>) -> Self {
        Self { rig: rig.clone(), inputs: rig.pads().map(of).collect() }
    }
}

/// The measured imprints of a sample with the given masks; fingers without a bubble camera are left out.
pub fn fingers_of<'a>(sample: &'a Sample, masks: &PerPad<&'a Mask>) -> Fingers<'a> {
    Fingers::new(&sample.rig, |finger| {
        let bubble = sample.pad(finger)?.depth()?;
        let camera = bubble.camera.as_ref()?;
        Some(FingerInput { imprint: &bubble.imprint, camera, mask: masks[finger] })
    })
}

/// Why there is no pose.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// Neither finger has an imprint with a camera.
    #[error("neither finger has an imprint with camera data, so there are no points to align")]
    NoFinger,
    /// An imprint cannot be lifted.
    #[error("{finger} finger: {source}")]
    Cloud {
        /// The finger's name.
        finger: Text,
        /// The reason.
        source: CloudError,
    },
    /// The points cannot be aligned.
    #[error(transparent)]
    Align(#[from] AlignError),
}

/// A pose with the cloud it was computed from.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseReport {
    /// The registration that answered.
    pub engine: Engine,
    /// The tool's pose in the hand.
    pub grasp_from_object: PlanarPose,
    /// The same the other way round; its angle is the number the lab reports.
    pub object_from_grasp: PlanarPose,
    /// How the answer came about.
    pub report: AlignReport,
    /// Contact points of both fingers, grasp frame.
    pub cloud: ContactCloud,
}

/// Joins the contact points of the fingers in the grasp frame.
///
/// # Errors
/// [`PoseError::NoFinger`] or [`PoseError::Cloud`].
pub fn contact_cloud(fingers: &Fingers<'_>) -> Result<ContactCloud, PoseError> {
    let mut cloud = ContactCloud::default();
    for (finger, input) in fingers.inputs.entries() {
        let lifted = lift(input.imprint, input.camera, input.mask)
            .map_err(|source| PoseError::Cloud { finger: fingers.rig.pad_key(finger), source })?;
        cloud.push(finger, lifted);
    }
    if cloud.counts.is_empty() { Err(PoseError::NoFinger) } else { Ok(cloud) }
}

/// Contact points (grasp frame, meters) to the tool's pose: what every caller ends in. `record` keeps per-iteration
/// states, per-point residuals and the distances both ways.
///
/// # Errors
/// [`AlignError`] for too few points or none near the tool.
pub fn register(points: &[DVec3], tool: &ToolModel, engine: Engine, record: bool) -> Result<AlignReport, AlignError> {
    register_with(&*engine.registration(), points, tool, Ask { starts: None, record })
}

/// The same from one start, `grasp_from_object`, instead of the engine's own.
///
/// # Errors
/// As [`register`], and for a start that is not finite.
pub fn register_from(
    points: &[DVec3],
    tool: &ToolModel,
    engine: Engine,
    start: PlanarPose,
    record: bool,
) -> Result<AlignReport, AlignError> {
    register_with(&*engine.registration(), points, tool, Ask { starts: Some(&[start]), record })
}

/// The same with a registration of other settings.
///
/// # Errors
/// As [`register`], and for settings that make no sense.
pub fn register_with(
    registration: &dyn Register,
    points: &[DVec3],
    tool: &ToolModel,
    ask: Ask<'_>,
) -> Result<AlignReport, AlignError> {
    let scene = Scene::new(points);
    let mut report = registration.run(&scene, tool, ask)?;
    if ask.record {
        report.directions = Directions::at(scene.yz(), &icp::silhouette(tool), report.grasp_from_object);
    }
    Ok(report)
}

/// Imprints, cameras and masks to the tool's pose in the hand. `record` keeps per-iteration states and per-point
/// residuals (see [`AlignReport`]).
///
/// Cost: well under a millisecond with the distance field, up to some hundred with the others.
///
/// # Errors
/// [`PoseError`]; nothing is guessed from too few or misplaced points.
pub fn estimate(
    fingers: &Fingers<'_>,
    tool: &ToolModel,
    engine: Engine,
    record: bool,
) -> Result<PoseReport, PoseError> {
    estimate_with(fingers, tool, engine, &*engine.registration(), Ask { starts: None, record })
}

/// The same with other settings of the engine, or from other starts.
///
/// # Errors
/// [`PoseError`].
pub fn estimate_with(
    fingers: &Fingers<'_>,
    tool: &ToolModel,
    engine: Engine,
    registration: &dyn Register,
    ask: Ask<'_>,
) -> Result<PoseReport, PoseError> {
    let cloud = contact_cloud(fingers)?;
    let report = register_with(registration, &cloud.points, tool, ask)?;
    Ok(PoseReport {
        engine,
        grasp_from_object: report.grasp_from_object,
        object_from_grasp: report.grasp_from_object.inverse(),
        report,
        cloud,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::align::testing::cross;
    use crate::domain::cloud::testing::camera;
    use crate::domain::contact::{LAB_CAD_DISTANCE_M, cad_signed_distance};
    use crate::domain::mesh::TriMesh;
    use crate::domain::rig::lab;
    use glam::{DAffine3, DQuat};
    use strum::IntoEnumIterator as _;

    /// A flat pad through the grasp origin that carries the cross: the label at the true pose gives the pose back.
    #[test]
    fn the_true_mask_gives_the_true_pose_with_both_engines() {
        let tool = ToolModel::new(cross()).unwrap();
        let truth = PlanarPose { theta_rad: 0.12, y_m: 0.002, z_m: -0.001 };
        let mut camera = camera(175, 140);
        // Looking straight along the closing axis, so that the pad lies in the plane of the tool.
        camera.grasp_from_camera = DAffine3::from_rotation_translation(
            DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2),
            DVec3::new(-0.09, 0.0, 0.0),
        );
        let imprint = DepthMap::filled(175, 140, 0.0);
        let mask = cad_signed_distance(&imprint, &camera, &tool.distance, truth.inverse(), LAB_CAD_DISTANCE_M).unwrap();
        assert!(mask.as_slice().iter().filter(|&&m| m).count() > 200);
        let input = FingerInput { imprint: &imprint, camera: &camera, mask: Some(&mask) };
        let fingers = Fingers::new(&Rig::lab(), |pad| (pad == lab::RIGHT).then_some(input));
        for (engine, limit_deg) in [(Engine::DistanceField, 2.0), (Engine::LabIcp, 12.0)] {
            let report = estimate(&fingers, &tool, engine, false).unwrap();
            let error = (report.grasp_from_object.theta_rad - truth.theta_rad).to_degrees();
            assert!(error.abs() < limit_deg, "{engine}: {error} deg");
            assert_eq!(report.object_from_grasp.theta_rad, report.report.lab_angle_rad());
            assert_eq!(report.cloud.points.len(), report.report.offered);
        }
    }

    #[test]
    fn pixels_without_depth_change_nothing() {
        let tool = ToolModel::new(cross()).unwrap();
        let camera = camera(175, 140);
        let mut imprint = DepthMap::from_fn(175, 140, |x, y| 1e-4 * ((x * 7 + y * 13) % 20) as f32);
        let mask = Mask::from_fn(175, 140, |x, y| (40..130).contains(&x) && (60..72).contains(&y));
        let mut thinned = mask.clone();
        for i in 0..200 {
            let (x, y) = (40 + (i * 37) % 90, 60 + i % 12);
            // NaN, infinite, zero and negative depth in turn.
            imprint[(x, y)] = [f32::NAN, f32::NEG_INFINITY, 0.09, 0.2][i % 4];
            thinned[(x, y)] = false;
        }
        for engine in [Engine::DistanceField, Engine::LabIcp] {
            let ask = |mask| {
                let input = FingerInput { imprint: &imprint, camera: &camera, mask: Some(mask) };
                let fingers = Fingers::new(&Rig::lab(), |pad| (pad == lab::RIGHT).then_some(input));
                estimate(&fingers, &tool, engine, false).unwrap()
            };
            let (with, without) = (ask(&mask), ask(&thinned));
            assert_eq!(with.grasp_from_object, without.grasp_from_object, "bit for bit");
            assert!(with.cloud.invalid() > 150 && without.cloud.invalid() == 0);
        }
    }

    #[test]
    fn missing_and_empty_inputs_are_errors() {
        let tool = ToolModel::new(cross()).unwrap();
        assert_eq!(
            estimate(&Fingers::new(&Rig::lab(), |_| None), &tool, Engine::default(), false),
            Err(PoseError::NoFinger)
        );
        let camera = camera(175, 140);
        let imprint = DepthMap::filled(175, 140, f32::NAN);
        let input = FingerInput { imprint: &imprint, camera: &camera, mask: None };
        let fingers = Fingers::new(&Rig::lab(), |pad| (pad == lab::LEFT).then_some(input));
        for engine in [Engine::DistanceField, Engine::LabIcp] {
            let error = estimate(&fingers, &tool, engine, false).unwrap_err();
            assert!(matches!(error, PoseError::Align(AlignError::TooFewPoints { got: 0, .. })), "{error}");
        }
        let small = DepthMap::filled(4, 4, 0.0);
        let input = FingerInput { imprint: &small, camera: &camera, mask: None };
        let fingers = Fingers::new(&Rig::lab(), |pad| (pad == lab::LEFT).then_some(input));
        let error = estimate(&fingers, &tool, Engine::default(), false).unwrap_err();
        assert!(error.to_string().starts_with("left finger: the reference depth is"), "{error}");
        assert!(ToolModel::new(TriMesh::default()).is_err());
        for engine in Engine::iter() {
            assert_eq!(engine.key().parse(), Ok(engine));
            assert_eq!(serde_json::to_value(engine).unwrap(), engine.key());
        }
    }
}
