//! Models that contacts are compared with, prepared once for each tool and kept with it.

use glam::{DVec2, DVec3};

use super::samples::Samples;
use crate::tool::{SURFACE_SEED, ToolModel};

/// Samples this close to the outline of the silhouette, meters, get its normal.
const OUTLINE_M: f64 = 0.5e-3;
/// Points of the surface that stand for triangles which are too dear to search: less than half a millimeter apart on a
/// hand-held tool.
const DENSE_POINTS: usize = 50_000;
/// Most triangles that a search may look at, on average. Ordinary meshes take some ten, however many they have.
const MAX_EFFORT: usize = 500;
/// Searches that tell, each this far from the surface, meters.
const EFFORT_SEARCHES: usize = 64;
const EFFORT_OFFSET_M: f64 = 1e-3;

struct InSpace(Samples);
struct Silhouette(Samples);
/// `None` where the triangles themselves can be searched.
struct Dense(Option<Samples>);

/// Points of the tool's surface with the normals of their triangles, in space.
pub fn in_space(tool: &ToolModel) -> Samples {
    tool.derived(|tool| InSpace(Samples::in_space(tool.surface()))).0.clone()
}

/// Samples of the surface projected along the closing axis (x = 0). Those on the outline of the silhouette carry its
/// normal; the others, which say nothing about the place in the plane, carry none (zero).
pub fn silhouette(tool: &ToolModel) -> Samples {
    let project = |tool: &ToolModel| {
        let flat: Vec<(DVec3, DVec3)> = tool
            .surface()
            .iter()
            .map(|(p, _)| {
                let sample = tool.field.sample(DVec2::new(p.y, p.z));
                let normal = if sample.distance > -OUTLINE_M {
                    sample.gradient.try_normalize().unwrap_or(DVec2::ZERO)
                } else {
                    DVec2::ZERO
                };
                (DVec3::new(0.0, p.y, p.z), DVec3::new(0.0, normal.x, normal.y))
            })
            .collect();
        Silhouette(Samples::in_plane(&flat))
    };
    tool.derived(project).0.clone()
}

/// Samples of the surface, close together, each with the plane of its triangle, in place of the triangles where looking
/// for the nearest triangle takes too long. `None` for nearly all tools.
pub(crate) fn instead_of_triangles(tool: &ToolModel) -> Option<Samples> {
    let dense = |tool: &ToolModel| {
        let (mut effort, mut searches) = (0, 0);
        for (i, (point, normal)) in tool.surface().iter().take(EFFORT_SEARCHES).enumerate() {
            // In turn outside and inside.
            let side = if i % 2 == 0 { EFFORT_OFFSET_M } else { -EFFORT_OFFSET_M };
            let at = *point + *normal * side;
            if at.is_finite() {
                effort += tool.distance.effort(at);
                searches += 1;
            }
        }
        let slow = effort > MAX_EFFORT * searches;
        Dense(slow.then(|| Samples::in_space(&tool.mesh.sample_surface_with_normals(DENSE_POINTS, SURFACE_SEED))))
    };
    tool.derived(dense).0.clone()
}
