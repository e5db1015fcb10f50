//! Distances of the contact points from the registered model: [`deviation`].

use crate::steps::cloud::Clouds;
use touch2touch_core::colormap::ColorMap;
use touch2touch_core::deviation::{Painted, of_points, on_surface};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::PerPad;

/// The colors of signed distances: blue inside, red outside.
pub const DISTANCE_MAP: ColorMap = ColorMap::Diverging;
/// Distances at which these colors can end, meters.
pub const DISTANCES_M: std::ops::RangeInclusive<f64> = 1e-5..=0.05;
/// Contact points within this distance of the model's surface are painted on it, meters.
const REACH_M: f64 = 0.004;

/// Signed distances between contact points and a model at a pose, both ways.
#[derive(Clone, Debug)]
pub struct Deviation {
    /// The pose that they are of, `grasp_from_object`.
    pub grasp_from_object: PlanarPose,
    /// Of each contact point, in the order of the cloud, meters; positive outside the model.
    pub points: PerPad<Vec<f32>>,
    /// The model's surface in its own frame.
    pub surface: Painted,
}

impl Deviation {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let points: usize = self.points.iter().flatten().map(Vec::len).sum();
        4 * points + 28 * self.surface.mesh.vertices.len() + 12 * self.surface.mesh.triangles.len()
    }
}

/// Measures the contact points of both fingers against the model at a pose.
pub fn deviation(clouds: &Clouds, tool: &ToolModel, grasp_from_object: PlanarPose) -> Deviation {
    let object_from_grasp = grasp_from_object.to_affine().inverse();
    let points = clouds.fingers.as_ref().map(|cloud| {
        cloud.map(|cloud| {
            let contact: Vec<_> = cloud.contact_points().collect();
            of_points(&contact, &object_from_grasp, &tool.distance)
        })
    });
    let in_object: Vec<_> = clouds.contact_points().iter().map(|p| object_from_grasp.transform_point3(*p)).collect();
    Deviation { grasp_from_object, points, surface: on_surface(&tool.mesh, &in_object, REACH_M) }
}
