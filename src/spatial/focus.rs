//! The place from which all 3D pictures of a pair are looked at.

use glam::DVec3;

use super::items;
use crate::gpu::mesh::Look;
use crate::gpu::scene::SceneData;

/// Share of the smaller side of a picture that the model and the contact points span.
pub const FILLED: f64 = 0.72;

/// The points of a scene that a camera is to show: solid models and contact points, and all there is where it has neither.
/// Membrane, outlines and floor may reach beyond the picture.
pub fn focus(scene: &SceneData) -> Vec<DVec3> {
    let meshes = scene.meshes.iter().filter(|m| matches!(m.style.look, Look::Solid | Look::XRay));
    let corners = meshes.flat_map(|m| m.mesh.vertices.iter().map(|p| m.style.world_from_mesh.transform_point3(*p)));
    let contact = scene.clouds.iter().filter(|c| c.name.starts_with(items::CONTACT));
    let points = contact.flat_map(|c| c.points.iter().map(|p| c.style.world_from_points.transform_point3(*p)));
    let found: Vec<DVec3> = corners.chain(points).filter(|p| p.is_finite()).collect();
    if !found.is_empty() {
        return found;
    }
    scene.bounds().map_or_else(Vec::new, |[lo, hi]| vec![lo, hi])
}
