//! The place from which all 3D pictures of a pair are looked at.

use glam::DVec3;

use super::items;
use crate::gpu::mesh::Look;
use crate::gpu::scene::SceneData;

/// Share of the smaller side of a picture that the model and the contact points span.
pub const FILLED: f64 = 0.72;

/// The points of a scene that a camera is to show: solid models and contact points, and the box around all there is where
/// it has neither. Membrane, outlines and floor may reach beyond the picture. Walks all geometry: call it when a person
/// asks, not at every frame.
pub fn focus(scene: &SceneData) -> Vec<DVec3> {
    let points = |all: bool| -> Vec<DVec3> {
        let meshes = scene.meshes.iter().filter(|m| all || matches!(m.style.look, Look::Solid | Look::XRay));
        let corners = meshes.flat_map(|m| m.mesh.vertices.iter().map(|p| m.style.world_from_mesh.transform_point3(*p)));
        let clouds = scene.clouds.iter().filter(|c| all || c.name.starts_with(items::CONTACT));
        let points = clouds.flat_map(|c| c.points.iter().map(|p| c.style.world_from_points.transform_point3(*p)));
        corners.chain(points).filter(|p| p.is_finite()).collect()
    };
    let found = points(false);
    if !found.is_empty() {
        return found;
    }
    let around = points(true).into_iter().map(|p| [p, p]).reduce(|[lo, hi], [p, _]| [lo.min(p), hi.max(p)]);
    around.map_or_else(Vec::new, Vec::from)
}
