//! Additions of a registration's steps to a 3D view: the CAD model at the step shown, lines to the counterparts.

use std::sync::Arc;

use eframe::egui::Color32;
use glam::{DAffine3, DVec3};

use super::Memory;
use crate::app::inspect::{Inspected, Inspection};
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::workbench::Layer;
use crate::gpu::lines::{LinesItem, LinesStyle, Segment};
use crate::gpu::scene::SceneData;
use crate::ui::parts::cx::Cx;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::units;

/// Lines drawn at most: more hide each other.
const MOST_LINES: usize = 300;
/// Shorter ones are specks on the model, not lines, meters.
const SHORTEST_M: f64 = 0.000_3;
/// Opacity of a line that weighs nothing, and what full weight adds to it.
const OPACITY: [f64; 2] = [0.2, 0.8];

/// The lines of one step as the renderer takes them.
pub(super) struct StepLines {
    of: (Arc<Inspection>, usize, usize),
    color: Color32,
    revision: u64,
    segments: Arc<[Segment]>,
    /// Their median and largest length in words.
    about: String,
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
    let color = cx.p.accent;
    let same = |l: &StepLines| Arc::ptr_eq(&l.of.0, inspection) && (l.of.1, l.of.2, l.color) == (run, at, color);
    if memory.step_lines.as_ref().is_some_and(same) {
        return;
    }
    let matches = inspection.counterparts.at(&inspection.points, &tool.model, step, MOST_LINES);
    let segments = matches.list.iter().filter(|m| m.residual_m > SHORTEST_M).filter_map(|m| {
        let from = *inspection.points.get(m.point)?;
        let alpha = (255.0 * (OPACITY[0] + OPACITY[1] * m.weight)) as u8;
        // The registration is planar: the counterpart has the point's own x.
        let ends = [from, DVec3::new(from.x, m.foot_yz.x, m.foot_yz.y)];
        Some(Segment { ends, rgba: [color.r(), color.g(), color.b(), alpha] })
    });
    let lengths = matches.median_and_max_m().map_or(String::new(), |[median, max]| {
        format!(", {} (median), {} (largest)", units::text_mm(median), units::text_mm(max))
    });
    memory.revision += 1;
    memory.step_lines = Some(StepLines {
        of: (inspection.clone(), run, at),
        color,
        revision: memory.revision,
        segments: segments.collect(),
        about: format!("pull lines of {} in {} points{lengths}", matches.list.len(), matches.of),
    });
}

/// The lines of a side, if they are to be drawn.
fn lines<'a>(cx: &Cx<'_>, memory: &'a Memory, source: ImprintSource) -> Option<&'a StepLines> {
    let on = cx.state.workbench.layer == Layer::Correspondences;
    let shown = results::inspected_in(cx.state, source).filter(|_| on)?;
    memory.step_lines.as_ref().filter(|lines| Arc::ptr_eq(&lines.of.0, shown.inspection))
}

/// The color and the words of the lines, for the legend.
pub(super) fn legend<'a>(cx: &Cx<'_>, memory: &'a Memory, source: ImprintSource) -> Option<(Color32, &'a str)> {
    lines(cx, memory, source).map(|lines| (lines.color, lines.about.as_str()))
}

/// Adds the lines of the step shown.
pub(super) fn add(cx: &Cx<'_>, memory: &Memory, source: ImprintSource, scene: &mut SceneData) {
    if let Some(lines) = lines(cx, memory, source) {
        scene.lines.push(LinesItem {
            name: "pull lines".into(),
            revision: lines.revision,
            segments: lines.segments.clone(),
            style: LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 1.5, opacity: 1.0, overlay: true },
        });
    }
}
