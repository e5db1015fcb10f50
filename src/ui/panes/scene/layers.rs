//! Layers in a 3D view: what colors the contact points, and the uncertainty of the pose.

use std::sync::Arc;

use eframe::egui::Color32;
use glam::{DAffine3, DVec2, DVec3};

use super::{Memory, rgb};
use crate::app::keys::{EstimateKey, ImprintSource};
use crate::app::results;
use crate::app::settings::LayerLook;
use crate::app::workbench::Layer;
use crate::gpu::lines::{LinesItem, LinesStyle, Segment};
use crate::gpu::mesh::{MeshItem, MeshStyle};
use crate::gpu::points::{CloudItem, PointColors};
use crate::spatial::items;
use crate::ui::parts::cx::Cx;
use touch2touch_core::align::reason::Reason;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::verdict::Grade;
use touch2touch_pipeline::compare::deviation::DISTANCE_MAP;

/// Bars of a histogram of distances.
const BARS: usize = 37;

/// The colors of residuals: perceptually uniform, and told apart by color-blind eyes.
pub(super) const RESIDUAL_MAP: ColorMap = ColorMap::Viridis;

/// The color of a reason: the palette of Okabe and Ito, made to be told apart by color-blind eyes.
pub(super) fn reason_rgb(reason: Reason) -> [u8; 3] {
    match reason {
        Reason::Inlier => [0x00, 0x9e, 0x73],
        Reason::Inside => [0xf0, 0xe4, 0x42],
        Reason::BeyondGate => [0xd5, 0x5e, 0x00],
        Reason::OutOfFrame => [0x00, 0x72, 0xb2],
        Reason::InvalidDepth => [0xe8, 0xe8, 0xe8],
        Reason::OutsideMask => [0x70, 0x70, 0x70],
    }
}

/// Colors of the contact points of one registration, made once.
pub(super) struct LayerColors {
    key: (EstimateKey, Layer),
    revision: u64,
    /// Values at the ends of the color map, meters; of distances the settings say.
    range: Range,
    fingers: PerPad<PointColors>,
    /// Of distances: the model's painted surface, and the pose that it is of.
    surface: Option<(Arc<TriMesh>, Arc<[f32]>, DAffine3)>,
    /// Of distances: the contact points by distance, along the range.
    pub histogram: Option<[usize; BARS]>,
}

/// Counts of values from one end of a range to the other; those beyond, and those that are no numbers, are left out.
fn counted(points: &PerPad<PointColors>, range: Range) -> [usize; BARS] {
    let mut counts = [0; BARS];
    for (_, colors) in points.entries() {
        let PointColors::Scalar(values) = colors else { continue };
        for value in values.iter().filter(|value| (range.lo..range.hi).contains(value)) {
            let share = (value - range.lo) / (range.hi - range.lo);
            counts[((share * BARS as f32) as usize).min(BARS - 1)] += 1;
        }
    }
    counts
}

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
        histogram: None,
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
        if held.range != range {
            held.range = range;
            held.histogram = Some(counted(&held.fingers, range));
        }
        return;
    }
    let painted = &deviation.surface;
    let surface =
        (Arc::new(painted.mesh.clone()), painted.values.as_slice().into(), deviation.grasp_from_object.to_affine());
    memory.revision += 1;
    let fingers = deviation.points.as_ref().map(|points| points.map(|d| PointColors::Scalar(d.as_slice().into())));
    let histogram = Some(counted(&fingers, range));
    *held = Some(LayerColors { key, revision: memory.revision, range, fingers, surface: Some(surface), histogram });
}

/// Paints the model with its distances to the contact points, where it stands at the pose that they are of.
pub(super) fn paint_model(memory: &Memory, source: ImprintSource, world_from_mesh: DAffine3, item: &mut MeshItem) {
    let Some(colors) = &memory.layer_colors[source as usize] else { return };
    let Some((mesh, values, _)) = colors.surface.as_ref().filter(|(_, _, pose)| *pose == world_from_mesh) else {
        return;
    };
    items::model_by_distance(item, (colors.revision, (mesh.clone(), values.clone())), colors.range.hi);
}

/// Colors the contact points of one finger, if the layer is of this very cloud.
pub(super) fn paint(memory: &Memory, source: ImprintSource, finger: PadId, item: &mut CloudItem) {
    let Some(colors) = &memory.layer_colors[source as usize] else { return };
    let same = memory.clouds[source as usize].as_ref().is_some_and(|cloud| cloud.key.parts == colors.key.0.parts);
    if !same {
        return;
    }
    let Some(own) = colors.fingers.get(finger) else { return };
    item.revision = colors.revision;
    let map = if colors.surface.is_some() { DISTANCE_MAP } else { RESIDUAL_MAP };
    items::paint_points(item, own.clone(), map, colors.range);
}

/// The look of a model that another one is compared with: its outline alone.
pub(crate) fn outline(world_from_mesh: DAffine3, color: Color32, look: LayerLook) -> MeshStyle {
    items::outline(world_from_mesh, rgb(color), look.opacity, look.size.value())
}

/// The look of the model at the true pose.
pub(super) fn dashed(world_from_mesh: DAffine3, color: Color32, look: LayerLook) -> MeshStyle {
    items::truth(world_from_mesh, rgb(color), look.opacity, look.size.value())
}

/// The uncertainty of the pose as it is: the ellipse of two deviations of the place where the tool is held, and the fan of
/// two deviations of the angle about it. Where the pose is doubted.
pub(super) fn uncertainty(cx: &Cx<'_>, source: ImprintSource) -> Option<LinesItem> {
    /// Half length of the fan, meters; beyond this share of it an ellipse is cut off, and beyond these radians a fan.
    const REACH_M: f64 = 0.03;
    const WIDEST: f64 = 0.5;
    const SIDES: i32 = 48;
    let found = results::pose(cx.state, source).shown()?;
    found.verdict.as_ref().filter(|verdict| verdict.grade > Grade::Good)?;
    let told = found.report.evidence?.uncertainty;
    let pose = found.grasp_from_object;
    let center = told.center;
    let axes = told.half_axes(pose).map(|axis| (2.0 * axis).clamp_length_max(WIDEST * REACH_M));
    let turn = (2.0 * told.angle_rad()).min(WIDEST);
    let color = cx.p.caution;
    let bits = [center.x, center.y, axes[0].x, axes[0].y, axes[1].length(), turn, pose.theta_rad];
    let revision = bits.iter().fold(u64::from(color.r()), |hash, v| hash.rotate_left(9) ^ v.to_bits());
    let at = |yz: DVec2| DVec3::new(0.0, (center + yz).x, (center + yz).y);
    let rgba = [color.r(), color.g(), color.b(), 255];
    let rim = |i: i32| {
        let (s, c) = (f64::from(i) / f64::from(SIDES) * std::f64::consts::TAU).sin_cos();
        axes[0] * c + axes[1] * s
    };
    let mut segments: Vec<Segment> = (0..SIDES).map(|i| Segment { ends: [at(rim(i)), at(rim(i + 1))], rgba }).collect();
    // About the object's z axis, both ways.
    for side in [REACH_M, -REACH_M] {
        let on = |share: f64| DVec2::from_angle(pose.theta_rad + share * turn).perp() * side;
        segments.extend([-1.0, 1.0].map(|share| Segment { ends: [at(DVec2::ZERO), at(on(share))], rgba }));
        let arc = (-4..4).map(|i| [i, i + 1].map(|i| at(on(f64::from(i) / 4.0))));
        segments.extend(arc.map(|ends| Segment { ends, rgba }));
    }
    Some(LinesItem {
        name: "uncertainty".into(),
        revision,
        segments: segments.into(),
        style: LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 1.2, opacity: 0.9, overlay: true },
    })
}
