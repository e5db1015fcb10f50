//! [`Register`]: what every registration is, so that the studio, the bench and the command line run all alike.

use glam::{DVec2, DVec3};

use super::{AlignConfig, AlignError, AlignReport, MIN_SHARE, REACH_M, align};
use crate::field::DistanceField;
use crate::frames::PlanarPose;
use crate::grid::DepthMap;
use crate::rig::CameraTolerance;
use crate::sample::DepthCamera;
use crate::tool::ToolModel;

/// View of the depth camera of one pad.
#[derive(Clone, Copy, Debug)]
pub struct PadImage<'a> {
    /// Reference minus depth, meters, raw orientation.
    pub imprint: &'a DepthMap,
    /// The camera, with the depth of the free membrane.
    pub camera: &'a DepthCamera,
    /// True where a model predicted it. Such an image has no pixel noise: its errors are of shape, wider than the finest band.
    pub predicted: bool,
    /// Tolerance of the camera's pose.
    pub tolerance: CameraTolerance,
}

impl<'a> PadImage<'a> {
    /// Measurement of a camera in a good mount.
    pub fn measured(imprint: &'a DepthMap, camera: &'a DepthCamera) -> Self {
        Self { imprint, camera, predicted: false, tolerance: CameraTolerance::default() }
    }
}

/// Contact points of a grasp, and the images of the membranes that they are from.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contacts<'a> {
    /// Points of all masks, grasp frame, meters. Those that are not finite are dropped and counted by the registrations.
    pub points: &'a [DVec3],
    /// Images of the pads; none where only the points are known.
    pub images: &'a [PadImage<'a>],
}

impl<'a> From<&'a [DVec3]> for Contacts<'a> {
    fn from(points: &'a [DVec3]) -> Self {
        Self { points, images: &[] }
    }
}

impl<'a> From<&'a Vec<DVec3>> for Contacts<'a> {
    fn from(points: &'a Vec<DVec3>) -> Self {
        points.as_slice().into()
    }
}

impl<'a, const N: usize> From<&'a [DVec3; N]> for Contacts<'a> {
    fn from(points: &'a [DVec3; N]) -> Self {
        points.as_slice().into()
    }
}

/// Input of a registration: contact points in space and in the plane of the tool, and the images they are from.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    contacts: Contacts<'a>,
    yz: Vec<DVec2>,
}

impl<'a> Scene<'a> {
    /// Contact points, with the images where they are known.
    pub fn new(contacts: impl Into<Contacts<'a>>) -> Self {
        let contacts = contacts.into();
        Self { contacts, yz: contacts.points.iter().map(|p| DVec2::new(p.y, p.z)).collect() }
    }

    /// The points in the grasp frame, meters.
    pub fn points(&self) -> &'a [DVec3] {
        self.contacts.points
    }

    /// Tolerance of its cameras' poses.
    pub(super) fn tolerance(&self) -> CameraTolerance {
        self.images().first().map(|image| image.tolerance).unwrap_or_default()
    }

    /// The images of the pads.
    pub fn images(&self) -> &'a [PadImage<'a>] {
        self.contacts.images
    }

    /// Points along the closing axis: `(y, z)`, meters.
    pub fn yz(&self) -> &[DVec2] {
        &self.yz
    }
}

/// Options of one run of a registration, beyond its own settings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ask<'a> {
    /// Poses to start from, `grasp_from_object`; the registration's own without them. Not empty.
    pub starts: Option<&'a [PlanarPose]>,
    /// Keep per-iteration states and per-point residuals.
    pub record: bool,
    /// The pose probably lies in the lab's grid: one in it that stands is not looked beyond, and one outside must be ahead by
    /// more. It decides no verdict.
    pub in_lab_grid: bool,
    /// Gather the evidence for and against the answer.
    pub evidence: bool,
}

/// A registration with its settings.
pub trait Register {
    /// Finds the tool's pose in the hand.
    ///
    /// The result depends on the arguments alone: not on threads, clocks or earlier calls.
    ///
    /// # Errors
    /// [`AlignError`]; nothing is guessed from too few, coincident or misplaced points.
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError>;
}

impl Register for AlignConfig {
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError> {
        let mut config = self.clone();
        config.record = ask.record;
        if let Some(starts) = ask.starts {
            if starts.is_empty() {
                // Without any, the ladder would choose.
                return Err(AlignError::Config { what: "starts" });
            }
            config.starts = starts.to_vec();
        }
        align(scene.yz(), &tool.field, &config)
    }
}

/// Refuses points of which next to none come near the silhouette at any start: a nearest neighbor always exists,
/// and its distance alone does not say that there is nothing to align.
pub(super) fn check_overlap(
    yz: impl Iterator<Item = DVec2> + Clone,
    field: &DistanceField,
    starts: &[PlanarPose],
) -> Result<(), AlignError> {
    let share_at = |start: &PlanarPose| {
        let object_from_grasp = start.inverse();
        let (mut near, mut all) = (0usize, 0usize);
        for p in yz.clone() {
            all += 1;
            near += usize::from(field.sample(object_from_grasp.transform_yz(p)).distance <= REACH_M);
        }
        near as f64 / all.max(1) as f64
    };
    let share = starts.iter().map(share_at).fold(0.0, f64::max);
    if share < MIN_SHARE { Err(AlignError::NoOverlap { share }) } else { Ok(()) }
}
