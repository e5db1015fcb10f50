//! Layers in a 3D view: what colors the contact points.

use std::sync::Arc;

use glam::DAffine3;

use super::Memory;
use crate::app::keys::{EstimateKey, ImprintSource};
use crate::app::results;
use crate::app::workbench::Layer;
use crate::gpu::mesh::MeshItem;
use crate::gpu::points::{CloudItem, PointColors};
use crate::spatial::items;
use crate::ui::parts::cx::Cx;
use touch2touch_core::align::reason::Reason;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_pipeline::compare::deviation::DISTANCE_MAP;

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
    let fingers = deviation.points.as_ref().map(|points| points.map(|d| PointColors::Scalar(d.as_slice().into())));
    *held = Some(LayerColors { key, revision: memory.revision, range, fingers, surface: Some(surface) });
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
