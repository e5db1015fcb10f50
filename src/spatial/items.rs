//! Items of a 3D picture, each in its look.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::gpu::edges::EdgeStyle;
use crate::gpu::floor::Floor;
use crate::gpu::guides;
use crate::gpu::lines::{LinesItem, LinesStyle};
use crate::gpu::mesh::{Look, MeshItem, MeshStyle, Shading};
use crate::gpu::points::{CloudItem, CloudStyle, PointColors, PointSize};
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::mesh::TriMesh;
use touch2touch_pipeline::compare::deviation::DISTANCE_MAP;

/// The names of contact points begin so.
pub(crate) const CONTACT: &str = "contact ";
/// Height of the floor, meters along +z (down).
const FLOOR_M: f64 = 0.036;
/// Half the width of the floor, meters.
const REACH_M: f64 = 0.09;
/// Length of the drawn axes, meters.
pub(crate) const AXIS_M: f64 = 0.01;
/// Pixels from one dash of a true pose to the next.
const DASH_PX: f32 = 9.0;

/// A mixture of two colors, sRGB: `share` 0 is the first, 1 the second.
pub fn mix(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

/// A membrane: see-through, its nearest layer alone, thin before the model.
pub fn membrane(finger: &str, (revision, mesh): (u64, Arc<TriMesh>), color: [f32; 3], opacity: f32) -> MeshItem {
    MeshItem {
        name: format!("surface {finger}"),
        revision,
        mesh,
        shading: Shading::Round,
        values: Arc::default(),
        style: MeshStyle { color, opacity, look: Look::Veil, ..MeshStyle::default() },
    }
}

/// Contact points of one finger, in one color.
pub fn contact(finger: &str, (revision, points): (u64, Arc<[DVec3]>), color: [f32; 3], size: PointSize) -> CloudItem {
    let style = CloudStyle { color, size, ..CloudStyle::default() };
    CloudItem { name: format!("{CONTACT}{finger}"), revision, points, colors: PointColors::One, style }
}

/// Colors contact points, each by its own value or color.
pub fn paint_points(item: &mut CloudItem, colors: PointColors, map: ColorMap, range: Range) {
    /// Larger than points of one color: a color has to be told from the next.
    const POINT_M: f32 = 0.000_6;
    item.colors = colors;
    item.style.map = map;
    item.style.range = range;
    if let PointSize::Meters(m) = &mut item.style.size {
        *m = m.max(POINT_M);
    }
}

/// Colors a model by the signed distances of its painted surface, meters, up to `reach_m`.
pub fn model_by_distance(
    item: &mut MeshItem,
    (revision, (mesh, values)): (u64, (Arc<TriMesh>, Arc<[f32]>)),
    reach_m: f32,
) {
    (item.mesh, item.values, item.revision) = (mesh, values, revision);
    item.style.map = DISTANCE_MAP;
    item.style.range = Range::symmetric(reach_m);
    // The edges of its many small triangles are no edges of the model; they would be found anew for each pose.
    item.style.edges = None;
}

/// The edges of a shaded model of a color before a ground: darker than the model before either.
pub fn model_edges(color: [f32; 3], ground: [f32; 3]) -> EdgeStyle {
    let dark = if is_dark(ground) { ground } else { [0.0; 3] };
    EdgeStyle { color: mix(color, dark, 0.7), opacity: 0.75, width_px: 1.2, creases: true, dash_px: 0.0 }
}

/// The look of a model that another one is compared with: its outline alone.
pub fn outline(world_from_mesh: DAffine3, color: [f32; 3], opacity: f32, width_px: f32) -> MeshStyle {
    let edges = EdgeStyle { color, opacity, width_px, creases: true, dash_px: 0.0 };
    MeshStyle { world_from_mesh, color, look: Look::Outline, edges: Some(edges), ..MeshStyle::default() }
}

/// The look of the model at the true pose: a dashed outline, so that it is not taken for the model.
pub fn truth(world_from_mesh: DAffine3, color: [f32; 3], opacity: f32, width_px: f32) -> MeshStyle {
    let whole = outline(world_from_mesh, color, opacity, width_px);
    // The silhouette alone: beside the model's own creases more would be a thicket.
    MeshStyle { edges: whole.edges.map(|edges| EdgeStyle { dash_px: DASH_PX, creases: false, ..edges }), ..whole }
}

fn is_dark(ground: [f32; 3]) -> bool {
    ground.iter().sum::<f32>() < 1.5
}

/// The floor, which takes the shadow: a little away from the ground's color towards `ink`.
pub fn floor(ground: [f32; 3], ink: [f32; 3]) -> Floor {
    let dark = is_dark(ground);
    Floor {
        center: DVec3::new(0.0, 0.0, FLOOR_M),
        reach_m: REACH_M,
        color: if dark { mix(ground, ink, 0.3) } else { mix(ground, [1.0; 3], 0.5) },
        opacity: 0.85,
        shadow: if dark { 0.75 } else { 0.38 },
    }
}

/// The grid on the floor and the axes at its corner; `revision` changes with the colors.
pub fn guides(ground: [f32; 3], ink: [f32; 3], revision: u64) -> [LinesItem; 2] {
    let color = mix(ground, ink, 0.5).map(|v| (v * 255.0).round() as u8);
    let opacity = if is_dark(ground) { 0.42 } else { 0.3 };
    let plain = LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 1.0, opacity, overlay: false };
    let grid = guides::grid(DVec3::new(0.0, 0.0, FLOOR_M), [DVec3::X, DVec3::Y], 0.01, 5, color);
    [
        LinesItem { name: "grid".into(), revision, segments: grid.into(), style: plain },
        LinesItem {
            name: "axes".into(),
            revision: 1,
            segments: guides::axes(axes_origin(), AXIS_M).into(),
            style: LinesStyle { width_px: 1.5, opacity: 1.0, ..plain },
        },
    ]
}

/// The place of the axes: on the floor beside the tool, where they hide nothing.
pub fn axes_origin() -> DVec3 {
    DVec3::new(0.022, -0.022, FLOOR_M)
}
