//! Layers in a 3D view: what colors the contact points, the ellipse of the weak motion, and the tool swaying along it.

use std::sync::Arc;

use eframe::egui::Color32;
use glam::{DAffine3, DVec2, DVec3};

use super::{Memory, rgb};
use crate::app::command::Pane;
use crate::app::keys::{ImprintSource, PoseKey};
use crate::app::results;
use crate::app::settings::{LayerLook, LayerSize};
use crate::app::workbench::Layer;
use crate::gpu::edges::EdgeStyle;
use crate::gpu::lines::{LinesItem, LinesStyle, Segment};
use crate::gpu::mesh::{Look, MeshItem, MeshStyle};
use crate::gpu::points::{CloudItem, PointColors, PointSize};
use crate::ui::panes::layers::{RESIDUAL_MAP, reason_rgb};
use crate::ui::parts::cx::Cx;
use touch2touch_core::align::Observability;
use touch2touch_core::align::reason::Reason;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::{PadId, PerPad};

/// Change of the contact distances (root mean square) that the drawn ellipse stands for, meters.
pub(crate) const ELLIPSE_TOLERANCE_M: f64 = 5e-4;
/// Longest half axis drawn, meters.
const ELLIPSE_LIMIT_M: f64 = 0.012;
/// Time of one sway to and fro, seconds.
const SWAY_S: f64 = 2.0;

/// Colors of the contact points of one registration, made once.
pub(super) struct LayerColors {
    key: (PoseKey, Layer),
    revision: u64,
    /// Values at the ends of the color map, meters; of distances the settings say.
    range: Range,
    fingers: PerPad<PointColors>,
    /// Of distances: the model's painted surface, and the pose that it is of.
    surface: Option<(Arc<TriMesh>, Arc<[f32]>, DAffine3)>,
}

/// The colors of distances: blue inside, red outside.
pub(crate) const DISTANCE_MAP: ColorMap = ColorMap::Diverging;

/// Makes the colors of a side's contact points, where a layer is on and its figures are there.
pub(super) fn update(cx: &Cx<'_>, memory: &mut Memory, source: ImprintSource) {
    let layer = cx.state.workbench.layer;
    if layer == Layer::Distance {
        return update_distances(cx, memory, source);
    }
    let held = &mut memory.layer_colors[source as usize];
    let layers = results::layers(cx.state, source).ready();
    let (Some(layers), Ok(Some(key)), Layer::Residuals | Layer::Reasons) =
        (layers, results::pose_key(cx.state, source), layer)
    else {
        *held = None;
        return;
    };
    let key = (key, layer);
    if held.as_ref().is_some_and(|h| h.key == key) {
        return;
    }
    let colors = |fits: &Vec<touch2touch_core::align::PointFit>| match layer {
        Layer::Residuals => PointColors::Scalar(fits.iter().map(|fit| fit.residual_m).collect::<Arc<[f32]>>()),
        _ => PointColors::PerPoint(fits.iter().map(|fit| reason_rgb(Reason::from(fit.fate))).collect()),
    };
    memory.revision += 1;
    *held = Some(LayerColors {
        key,
        revision: memory.revision,
        range: Range { lo: 0.0, hi: layers.range_m as f32 },
        fingers: layers.fits.as_ref().map(|fits| fits.map(colors)),
        surface: None,
    });
}

/// Makes the colors of distances, where they are there.
fn update_distances(cx: &Cx<'_>, memory: &mut Memory, source: ImprintSource) {
    let held = &mut memory.layer_colors[source as usize];
    let (Some(deviation), Ok(Some(key))) =
        (results::deviation(cx.state, source).ready(), results::pose_key(cx.state, source))
    else {
        *held = None;
        return;
    };
    let (key, reach) = ((key, Layer::Distance), cx.state.settings.scene.distance_m);
    let range = Range { lo: -reach, hi: reach };
    if let Some(held) = held.as_mut().filter(|h| h.key == key) {
        held.range = range;
        return;
    }
    let painted = &deviation.surface;
    let surface =
        (Arc::new(painted.mesh.clone()), painted.values.as_slice().into(), deviation.grasp_from_object.to_affine());
    memory.revision += 1;
    *held = Some(LayerColors {
        key,
        revision: memory.revision,
        range,
        fingers: deviation.points.as_ref().map(|points| points.map(|d| PointColors::Scalar(d.as_slice().into()))),
        surface: Some(surface),
    });
}

/// Paints the model with its distances to the contact points, where it stands at the pose that they are of.
pub(super) fn paint_model(memory: &Memory, source: ImprintSource, world_from_mesh: DAffine3, item: &mut MeshItem) {
    let Some(colors) = &memory.layer_colors[source as usize] else { return };
    let Some((mesh, values, _)) = colors.surface.as_ref().filter(|(_, _, pose)| *pose == world_from_mesh) else {
        return;
    };
    item.mesh = mesh.clone();
    item.values = values.clone();
    item.revision = colors.revision;
    item.style.map = DISTANCE_MAP;
    item.style.range = colors.range;
    // The edges of its many small triangles are no edges of the model; they would be found anew for each pose.
    item.style.edges = None;
}

/// Colors the contact points of one finger, if the layer is of this very cloud.
pub(super) fn paint(memory: &Memory, source: ImprintSource, finger: PadId, item: &mut CloudItem) {
    let Some(colors) = &memory.layer_colors[source as usize] else { return };
    let same = memory.clouds[source as usize].as_ref().is_some_and(|cloud| cloud.key == colors.key.0.cloud);
    if !same {
        return;
    }
    let Some(own) = colors.fingers.get(finger) else { return };
    item.colors = own.clone();
    item.revision = colors.revision;
    item.style.map = if colors.surface.is_some() { DISTANCE_MAP } else { RESIDUAL_MAP };
    item.style.range = colors.range;
    // Larger than uncolored ones: a color has to be told from the next.
    if let PointSize::Meters(m) = &mut item.style.size {
        *m = m.max(0.000_6);
    }
}

/// The look of a model that another one is compared with: its outline alone.
pub(crate) fn outline(world_from_mesh: DAffine3, color: Color32, look: LayerLook) -> MeshStyle {
    let width_px = match look.size {
        LayerSize::Px(px) | LayerSize::Mm(px) => px,
    };
    let edges = EdgeStyle { color: rgb(color), opacity: look.opacity, width_px, creases: true };
    MeshStyle { world_from_mesh, color: rgb(color), look: Look::Outline, edges: Some(edges), ..MeshStyle::default() }
}

/// Observability of the registered pose of a side.
fn observability<'a>(cx: &'a Cx<'_>, source: ImprintSource) -> Option<&'a Observability> {
    results::pose(cx.state, source).shown()?.report.observability.as_ref()
}

/// The registered pose moved along its weakest direction at time `seconds`, while that is shown.
pub(super) fn swayed(cx: &Cx<'_>, source: ImprintSource, pose: PlanarPose, seconds: f64) -> PlanarPose {
    match observability(cx, source) {
        Some(o) if cx.state.workbench.animate_weakest => {
            o.moved_along_weakest(pose, (seconds * std::f64::consts::TAU / SWAY_S).sin())
        }
        _ => pose,
    }
}

/// The ellipse of shifts that change the fit equally, with the weakest direction as a line through it.
pub(super) fn ellipse(cx: &Cx<'_>, source: ImprintSource) -> Option<LinesItem> {
    let shown = cx.state.workbench.animate_weakest || cx.state.selection.panes.contains(&Pane::Layers);
    let o = observability(cx, source).filter(|_| shown)?;
    let ellipse = o.ellipse(ELLIPSE_TOLERANCE_M, ELLIPSE_LIMIT_M);
    let color = if o.degenerate { cx.p.caution } else { cx.p.accent };
    let bits = [o.center.x, o.center.y, o.eigenvalues[0], o.eigenvalues[2], o.weakest[0], o.weakest[1], o.weakest[2]];
    let revision = bits.iter().fold(u64::from(color.r()), |hash, v| hash.rotate_left(9) ^ v.to_bits());
    let at = |yz: DVec2| DVec3::new(0.0, yz.x, yz.y);
    let mut segments = Vec::new();
    let rgba = |c: Color32, alpha: u8| [c.r(), c.g(), c.b(), alpha];
    let mut line = |a: DVec2, b: DVec2, alpha: u8| {
        segments.push(Segment { ends: [at(o.center + a), at(o.center + b)], rgba: rgba(color, alpha) });
    };
    const SIDES: i32 = 48;
    let rim = |i: i32| {
        let (s, c) = (f64::from(i) / f64::from(SIDES) * std::f64::consts::TAU).sin_cos();
        ellipse.half_axes[0] * c + ellipse.half_axes[1] * s
    };
    for i in 0..SIDES {
        line(rim(i), rim(i + 1), 255);
    }
    let [turn, y, z] = o.weakest;
    if turn.abs() > y.hypot(z) {
        // It turns: an arc around the center, as far as it may turn.
        let reach = ellipse.turn_rad.min(1.2);
        for i in -12..12 {
            let on = |i: i32| DVec2::from_angle(reach * f64::from(i) / 12.0) * 0.015;
            line(on(i), on(i + 1), 255);
        }
    } else {
        let along = DVec2::new(y, z).normalize_or_zero() * 0.015;
        line(-along, along, 255);
        for end in [along, -along] {
            for side in [0.5, -0.5] {
                line(end, end - DVec2::from_angle(side).rotate(end) * 0.18, 255);
            }
        }
    }
    Some(LinesItem {
        name: "weak motion".into(),
        revision,
        segments: segments.into(),
        style: LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 2.0, opacity: 1.0, overlay: true },
    })
}
