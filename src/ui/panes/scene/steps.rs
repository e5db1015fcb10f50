//! Additions of a registration's steps to a 3D view: the CAD model at the step shown, lines to the counterparts.

use std::sync::Arc;

use eframe::egui::{Align2, Color32, FontId, Rect, Sense, Ui, pos2};
use glam::{DAffine3, DVec3};

use super::Memory;
use crate::app::inspect::Inspected;
use crate::app::keys::{ImprintSource, Inspection};
use crate::app::results;
use crate::app::workbench::Layer;
use crate::gpu::lines::{LinesItem, LinesStyle, Segment};
use crate::gpu::scene::SceneData;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{DARK, Palette};
use crate::ui::parts::widget::colorbar::gradient;
use touch2touch_core::colormap::ColorMap;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::units;

/// Correspondences drawn at most: more hide each other.
const MOST_LINES: usize = 300;
/// Shorter ones are specks on the model, not lines, meters.
const SHORTEST_M: f64 = 0.000_3;
/// The residual of the last color, millimeters; larger ones have it too.
const RESIDUAL_MM: f32 = 4.0;
/// Opacity of a correspondence that weighs nothing, and what full weight adds to it.
const OPACITY: [f64; 2] = [0.2, 0.8];

/// The correspondences of one step as the renderer takes them.
pub(super) struct StepLines {
    of: Arc<Inspection>,
    run: usize,
    at: usize,
    dark: bool,
    revision: u64,
    segments: Arc<[Segment]>,
    /// Correspondences shown, and contact points there are.
    shown: [usize; 2],
    /// Median and largest residual of those shown, meters.
    residual_m: Option<[f64; 2]>,
}

/// The pose at which the step shown has the CAD model, if the pane of the steps looks at this side.
pub(super) fn pose(cx: &Cx<'_>, source: ImprintSource) -> Option<PlanarPose> {
    results::inspected_in(cx.state, source).map(|shown| shown.step.grasp_from_object)
}

/// Makes the lines of the step shown, once per step.
pub(super) fn update(cx: &Cx<'_>, memory: &mut Memory, source: ImprintSource) {
    if cx.state.workbench.layer != Layer::Correspondences {
        return;
    }
    let Some(Inspected { inspection, run, at, step }) = results::inspected_in(cx.state, source) else { return };
    let Some(tool) = results::tool(cx.state).ready() else { return };
    let dark = *cx.p == DARK;
    let same = |l: &StepLines| Arc::ptr_eq(&l.of, inspection) && (l.run, l.at, l.dark) == (run, at, dark);
    if memory.step_lines.as_ref().is_some_and(same) {
        return;
    }
    let matches = inspection.counterparts.at(&inspection.points, &tool.model, step, MOST_LINES);
    let segments = matches.list.iter().filter(|m| m.residual_m > SHORTEST_M).filter_map(|m| {
        let from = *inspection.points.get(m.point)?;
        let [r, g, b, _] = residual_color(cx.p, m.residual_m).to_array();
        let alpha = (255.0 * (OPACITY[0] + OPACITY[1] * m.weight)) as u8;
        // The registration is planar: the counterpart has the point's own x.
        Some(Segment { ends: [from, DVec3::new(from.x, m.foot_yz.x, m.foot_yz.y)], rgba: [r, g, b, alpha] })
    });
    memory.revision += 1;
    memory.step_lines = Some(StepLines {
        of: inspection.clone(),
        run,
        at,
        dark,
        revision: memory.revision,
        segments: segments.collect(),
        shown: [matches.list.len(), matches.of],
        residual_m: matches.median_and_max_m(),
    });
}

/// The lines of a side, if they are to be drawn.
fn lines<'a>(cx: &Cx<'_>, memory: &'a Memory, source: ImprintSource) -> Option<&'a StepLines> {
    let on = cx.state.workbench.layer == Layer::Correspondences;
    let shown = results::inspected_in(cx.state, source).filter(|_| on)?;
    memory.step_lines.as_ref().filter(|l| Arc::ptr_eq(&l.of, shown.inspection))
}

/// Adds the lines of the step shown.
pub(super) fn add(cx: &Cx<'_>, memory: &Memory, source: ImprintSource, scene: &mut SceneData) {
    if let Some(lines) = lines(cx, memory, source) {
        scene.lines.push(LinesItem {
            name: "correspondences".into(),
            revision: lines.revision,
            segments: lines.segments.clone(),
            style: LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 1.5, opacity: 1.0, overlay: true },
        });
    }
}

/// The color of a residual. The end of the map that would vanish before the background is left out.
fn residual_color(p: &Palette, residual_m: f64) -> Color32 {
    color_at(p, units::mm(residual_m) as f32 / RESIDUAL_MM)
}

fn color_at(p: &Palette, share: f32) -> Color32 {
    let share = share.clamp(0.0, 1.0);
    let [r, g, b] = ColorMap::Viridis.rgb8(if *p == DARK { 0.3 + 0.7 * share } else { 0.8 - 0.8 * share });
    Color32::from_rgb(r, g, b)
}

/// Bar of the lines' colors, with their numbers; what is in it is said behind `bar`.
pub(super) fn bar(cx: &Cx<'_>, ui: &Ui, memory: &Memory, source: ImprintSource, bar: Rect) {
    let Some(lines) = lines(cx, memory, source) else { return };
    let painter = ui.painter();
    gradient(painter, bar, 32, |share| color_at(cx.p, share));
    let font = FontId::proportional(10.0);
    let text = pos2(bar.right(), bar.top() - 3.0);
    painter.text(text, Align2::RIGHT_BOTTOM, "residual of the pull lines", font.clone(), cx.p.text);
    painter.text(bar.left_bottom(), Align2::LEFT_TOP, "0", font.clone(), cx.p.text);
    painter.text(bar.right_bottom(), Align2::RIGHT_TOP, format!("{RESIDUAL_MM:.0} mm"), font, cx.p.text);
    let [shown, of] = lines.shown;
    let mut about = format!("{shown} of {of} points have a line");
    if let Some([median, max]) = lines.residual_m {
        about += &format!("; residual {} (median), {} (largest)", units::text_mm(median), units::text_mm(max));
    }
    ui.interact(bar.expand(8.0), ui.scope_id().with("pull lines"), Sense::hover()).on_hover_text(about);
}
