//! Layers in a 3D view: what colors the contact points, the ellipse of the weak motion, and the tool swaying along it.

use std::sync::Arc;

use eframe::egui::Color32;
use glam::{DAffine3, DVec2, DVec3};

use super::Memory;
use crate::app::command::Pane;
use crate::app::keys::{ImprintSource, PoseKey};
use crate::app::workbench::Layer;
use crate::domain::align::Observability;
use crate::domain::align::reason::Reason;
use crate::domain::colormap::Range;
use crate::domain::frames::PlanarPose;
use crate::domain::rig::{PadId, PerPad};
use crate::gpu::lines::{LinesItem, LinesStyle, Segment};
use crate::gpu::points::{CloudItem, PointColors, PointSize};
use crate::ui::cx::Cx;
use crate::ui::layers::{RESIDUAL_MAP, reason_rgb};

/// Change of the contact distances (root mean square) that the drawn ellipse stands for, meters.
pub(in crate::ui) const ELLIPSE_TOLERANCE_M: f64 = 5e-4;
/// Longest half axis drawn, meters.
const ELLIPSE_LIMIT_M: f64 = 0.012;
/// Time of one sway to and fro, seconds.
const SWAY_S: f64 = 2.0;

/// Colors of the contact points of one registration, made once.
pub(super) struct LayerColors {
    key: (PoseKey, Layer),
    revision: u64,
    range: Range,
    fingers: PerPad<PointColors>,
}

/// Makes the colors of a side's contact points, where a layer is on and its figures are there.
pub(super) fn update(cx: &Cx<'_>, memory: &mut Memory, source: ImprintSource) {
    let layer = cx.state.workbench.layer;
    let held = &mut memory.layer_colors[source as usize];
    let layers = cx.state.layers(source).ready();
    let (Some(layers), Ok(Some(key)), Layer::Residuals | Layer::Reasons) = (layers, cx.state.pose_key(source), layer)
    else {
        *held = None;
        return;
    };
    let key = (key, layer);
    if held.as_ref().is_some_and(|h| h.key == key) {
        return;
    }
    let colors = |fits: &Vec<crate::domain::align::PointFit>| match layer {
        Layer::Residuals => PointColors::Scalar(fits.iter().map(|fit| fit.residual_m).collect::<Arc<[f32]>>()),
        _ => PointColors::PerPoint(fits.iter().map(|fit| reason_rgb(Reason::from(fit.fate))).collect()),
    };
    memory.revision += 1;
    *held = Some(LayerColors {
        key,
        revision: memory.revision,
        range: Range { lo: 0.0, hi: layers.range_m as f32 },
        fingers: layers.fits.as_ref().map(|fits| fits.map(colors)),
    });
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
    item.style.map = RESIDUAL_MAP;
    item.style.range = colors.range;
    // Larger than uncolored ones: a color has to be told from the next.
    item.style.size = PointSize::Meters(0.000_6);
}

/// How well the registered pose of a side is determined.
fn observability<'a>(cx: &'a Cx<'_>, source: ImprintSource) -> Option<&'a Observability> {
    cx.state.pose(source).shown()?.report.observability.as_ref()
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
