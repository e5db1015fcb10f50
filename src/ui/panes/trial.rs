//! Trial of a robot with the pose, played in 3D: the tool let down into a hole of its own outline, or a cup onto a cup.

mod stage;

use std::sync::Arc;

use eframe::egui::{self, RichText, Slider, Ui, vec2};
use glam::{DAffine3, DVec3};

use stage::Stage;

use super::images;
use super::scene::{SceneMesh, rgb, update_mesh};
use crate::app::command::Pane;
use crate::app::keys::{ImprintSource, PairKey};
use crate::app::results;
use crate::app::state::Lookup;
use crate::gpu::lines::{LinesItem, LinesStyle, Segment};
use crate::gpu::mesh::{Look, MeshItem, MeshStyle, Shading};
use crate::gpu::points::PointSize;
use crate::gpu::scene::SceneData;
use crate::gpu::view::Camera;
use crate::spatial::items;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::scene_view::{Grip, SceneView};
use crate::ui::parts::theme::{SMALL, caption, pane_frame};
use crate::ui::parts::widget::empty;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::trials::Waypoint;
use touch2touch_core::units::{text_deg, text_mm};
use touch2touch_work::trials::{Goal, PairTrial};

/// Time of a whole trial while it plays, seconds.
const TRIAL_S: f64 = 4.0;
/// Time between two pictures while it plays, seconds.
const PACE_S: f64 = 0.05;
/// Way of a tool's rim for a turn of one radian, meters: turns take time, too.
const REACH_M: f64 = 0.03;
/// Diameter of the mark of the first touch, meters.
const TOUCH_M: f32 = 0.001_2;
/// Diameter of the mark of a cup's center of mass, meters.
const MASS_M: f32 = 0.004;
/// Opacity of the cup that is held: its handle and its center of mass show through.
const CUP: f32 = 0.4;
/// Height over the mouth up to which the camera shows a tool, meters.
const NEAR_M: f64 = 0.022;
/// Depth under the mouth or the rim down to which it shows what stands there, meters: a block whole, a cup's upper part.
const BELOW_M: f64 = 0.03;
/// Direction of the camera at first, degrees: from before the cut block, a little from above.
const CAMERA_DEG: [f64; 2] = [20.0, 14.0];

/// The view, what it shows, and the clock of what plays.
#[derive(Default)]
pub(crate) struct Memory {
    view: SceneView,
    /// The pair and the imprint that the view was framed for.
    of: Option<(PairKey, ImprintSource)>,
    stage: Option<(Arc<PairTrial>, Arc<Stage>)>,
    tool: Option<SceneMesh>,
    revision: u64,
    /// Share of the trial that is over, 0 to 1.
    share: f64,
    /// When the last picture came while playing, seconds.
    played_at: Option<f64>,
}

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    let source = cx.state.workbench.side;
    pane_frame(cx.p).inner_margin(egui::Margin::symmetric(8, 4)).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        match results::trial(cx.state, source) {
            Lookup::Ready(trial) | Lookup::Stale(trial) => {
                let trial = trial.clone();
                said(cx, ui, source, &trial);
                transport(ui, memory);
                picture(cx, ui, memory, source, &trial);
            }
            Lookup::Failed(err) => {
                empty::show(ui, "No trial", &err.why, None);
            }
            Lookup::Absent(absent) => images::absent_text(cx, ui, absent),
            Lookup::Waiting => {
                empty::show(ui, "Computing…", "", None);
            }
        }
    });
}

/// The end in words, and what led to it.
fn said(cx: &Cx<'_>, ui: &mut Ui, source: ImprintSource, trial: &PairTrial) {
    let attempt = &trial.attempt;
    let color = if attempt.end.is_success() { cx.p.good } else { cx.p.wrong };
    let (details, tip) = terms(trial);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        images::side_mark(ui, cx.p, source);
        ui.label(RichText::new(format!("By the {} pose: {}", source.key(), attempt.end)).color(color));
        ui.label(caption(details, cx.p)).on_hover_text(tip);
    });
    let mut text = format!(
        "tilted {} and {} beside the middle before anything gives way",
        text_deg(attempt.tilt_rad),
        text_mm(attempt.offset_m.abs())
    );
    if let (Some(touch), Goal::Insertion(_)) = (attempt.contact, &trial.goal) {
        text += &format!(
            "; first touch {} deep, overlap at the bottom {}",
            text_mm(touch.depth_m),
            text_mm(touch.interference_m)
        );
    }
    ui.add(egui::Label::new(RichText::new(text).size(SMALL).color(cx.p.weak)).wrap());
}

/// The goal's terms in a few words, and what they leave out.
fn terms(trial: &PairTrial) -> (String, String) {
    match &trial.goal {
        Goal::Insertion(insertion) => {
            let shape = insertion.hole().shape();
            let needs = match trial.room.and_then(|room| room.needs_m) {
                Some(room) => format!("{} of room would do", text_mm(room)),
                None => "5 mm of room would not do".to_owned(),
            };
            let tip = format!(
                "The hole is the tool's own outline, {} deep. The gripper gives way by {}; nothing slips or bends",
                text_mm(shape.depth_m),
                insertion.compliance()
            );
            (format!("{} of room to each side; {needs}", text_mm(shape.clearance_m)), tip)
        }
        Goal::Stacking(stacking) => {
            let (cup, margin) = (stacking.cup(), text_mm(stacking.margin_m()));
            let tip = format!(
                "It is let go on the rim of another ({} wide), and stands while its center of mass, {} above its base, is over \
                 that rim, {margin} inside. The gripper levels it by up to {}; nothing slides",
                text_mm(2.0 * cup.rim_m),
                text_mm(cup.mass_m),
                text_deg(stacking.compliance().turn_rad)
            );
            (format!("a margin of {margin} is asked of it"), tip)
        }
    }
}

/// Play, and the time. Nothing is painted for it while nothing plays.
fn transport(ui: &mut Ui, memory: &mut Memory) {
    let now = ui.input(|i| i.time);
    if let Some(last) = memory.played_at {
        memory.share = (memory.share + (now - last) / TRIAL_S).min(1.0);
        memory.played_at = (memory.share < 1.0).then_some(now);
        ui.ctx().request_repaint_after(std::time::Duration::from_secs_f64(PACE_S));
    }
    ui.horizontal(|ui| {
        let plays = memory.played_at.is_some();
        let button = egui::Button::new(if plays { "Pause" } else { "Play" }).min_size(vec2(52.0, 20.0));
        let button = ui.add(button).accessible_name("Play the trial");
        if button.on_hover_text("Lets the robot try: approach, first touch, and how it ends").clicked() {
            let again = memory.share >= 1.0;
            memory.share = if again && !plays { 0.0 } else { memory.share };
            memory.played_at = (!plays).then_some(now);
        }
        ui.spacing_mut().slider_width = (ui.available_width() - 8.0).max(40.0);
        let slider = ui.add(Slider::new(&mut memory.share, 0.0..=1.0).show_value(false));
        if slider.accessible_name("Time of the trial").on_hover_text("Drag through the trial").changed() {
            memory.played_at = None;
        }
    });
}

/// The tool and its hole at the time.
fn picture(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, source: ImprintSource, trial: &Arc<PairTrial>) {
    let device = match cx.device {
        Ok(device) => device,
        Err(why) => {
            empty::show(ui, "No 3D views on this graphics device", why, None);
            return;
        }
    };
    update(cx, memory, trial);
    let tool = memory.tool.as_ref().map(|held| held.mesh.clone());
    let (Some(tool), Some((_, stage))) = (tool, memory.stage.clone()) else { return };
    let scene = scene(cx, (&tool, &stage, memory.revision), trial, memory.share);
    let output = memory.view.interact(ui, "3D view, trial", Grip::Nothing);
    let of = cx.state.pair_key().map(|pair| (pair, source));
    if output.fit || memory.of != of || !memory.view.placed {
        memory.of = of;
        let [yaw, pitch] = CAMERA_DEG.map(f64::to_radians);
        let camera = Camera { yaw_rad: yaw, pitch_rad: pitch, ..Camera::default() };
        memory.view.camera = camera;
        memory.view.camera.frame(&whole_way(&tool, &stage, trial), 0.95);
        memory.view.placed = true;
    }
    let scene = SceneData { moving: output.moved || memory.played_at.is_some(), ..scene };
    memory.view.draw(ui, device, &output, &scene);
    if output.moved {
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(120));
    }
}

/// Makes the meshes, where the trial or the tool changed.
fn update(cx: &Cx<'_>, memory: &mut Memory, trial: &Arc<PairTrial>) {
    update_mesh(cx, &mut memory.tool, &mut memory.revision);
    if memory.stage.as_ref().is_none_or(|(of, _)| !Arc::ptr_eq(of, trial)) {
        memory.stage = Some((trial.clone(), Arc::new(Stage::of(trial))));
        memory.revision += 1;
    }
}

/// The corners of all that stands and of what comes near it on the whole way: what the camera has to show.
fn whole_way(tool: &TriMesh, stage: &Stage, trial: &PairTrial) -> Vec<DVec3> {
    let path = &trial.attempt.path;
    let ends = || [path.first(), path.last()].into_iter().flatten().map(|at| at.world_from_object.to_affine());
    let tools = ends().flat_map(|world_from_object| {
        let placed = tool.vertices.iter().map(move |p| world_from_object.transform_point3(*p));
        placed.filter(|p| p.z > -NEAR_M)
    });
    let cups = stage.carried.iter().flat_map(|cup| {
        let of =
            |world_from_object: DAffine3| cup.body.vertices.iter().map(move |p| world_from_object.transform_point3(*p));
        ends().flat_map(of)
    });
    let stands = stage.stands.vertices.iter().copied().filter(|p| p.z < BELOW_M);
    tools.chain(cups).chain(stands).collect()
}

fn scene(
    cx: &Cx<'_>,
    (tool, stage, revision): (&Arc<TriMesh>, &Stage, u64),
    trial: &PairTrial,
    share: f64,
) -> SceneData {
    let (ground, path) = (rgb(cx.p.canvas), &trial.attempt.path);
    let mut scene = SceneData { background: ground, eye_dome: true, ..SceneData::default() };
    let mesh = |name: &str, mesh: &Arc<TriMesh>, style: MeshStyle| MeshItem {
        name: name.into(),
        revision,
        mesh: mesh.clone(),
        shading: Shading::Smooth,
        values: Arc::default(),
        style,
    };
    let solid = |color: [f32; 3], pose: PlanarPose| MeshStyle {
        color,
        look: Look::Solid,
        edges: Some(items::model_edges(color, ground)),
        ..items::outline(pose.to_affine(), color, 1.0, 1.2)
    };
    let Some((at, depth_m)) = place(path, share) else { return scene };
    scene.meshes.push(mesh("tool", tool, solid(rgb(cx.p.cad), at)));
    let wood = items::mix(rgb(cx.p.accent), rgb(cx.p.weak), 0.6);
    scene.meshes.push(mesh("stands", &stage.stands, MeshStyle { edges: None, ..solid(wood, PlanarPose::default()) }));
    if let Some(cup) = &stage.carried {
        let veil = MeshStyle { edges: None, look: Look::Veil, opacity: CUP, ..solid(rgb(cx.p.cad), at) };
        scene.meshes.push(mesh("cup", &cup.body, veil));
        let ends = cup.plumb(at);
        let color = if trial.attempt.end.is_success() { cx.p.good } else { cx.p.wrong };
        let look = (PointSize::Meters(MASS_M), 1.0);
        // Its place changes at every picture of the way.
        let moved = revision.wrapping_add(share.to_bits());
        scene.clouds.push(items::contact("mass", (moved, vec![ends[0]].into()), rgb(color), look));
        let segments = [Segment { ends, rgba: color.to_array() }].into();
        let style = LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 1.5, opacity: 1.0, overlay: true };
        scene.lines.push(LinesItem { name: "plumb".into(), revision: moved, segments, style });
    }
    if let Some(last) = path.last() {
        let end = items::truth(last.world_from_object.to_affine(), rgb(cx.p.strong), 0.5, 1.0);
        scene.meshes.push(mesh("end", tool, end));
    }
    if let Some(touch) = trial.attempt.contact.filter(|touch| depth_m >= touch.depth_m) {
        let points = vec![touch.point_m + DVec3::X * 1e-4];
        let look = (PointSize::Meters(TOUCH_M), 1.0);
        scene.clouds.push(items::contact("trial", (revision, points.into()), rgb(cx.p.wrong), look));
    }
    scene
}

/// The tool's pose after a share of the trial, and the depth of its lowest point, meters.
fn place(path: &[Waypoint], share: f64) -> Option<(PlanarPose, f64)> {
    let way = |[a, b]: [&Waypoint; 2]| {
        let (from, to) = (a.world_from_object, b.world_from_object);
        (b.depth_m - a.depth_m).abs() + (to.theta_rad - from.theta_rad).abs() * REACH_M + (to.y_m - from.y_m).abs()
    };
    let legs = || path.windows(2).map(|pair| [&pair[0], &pair[1]]);
    let mut left = share.clamp(0.0, 1.0) * legs().map(way).sum::<f64>();
    for leg in legs() {
        let length = way(leg);
        if left <= length && length > 0.0 {
            let [a, b] = leg;
            let along = |from: f64, to: f64| from + (to - from) * left / length;
            let (from, to) = (a.world_from_object, b.world_from_object);
            let pose = PlanarPose {
                theta_rad: along(from.theta_rad, to.theta_rad),
                y_m: along(from.y_m, to.y_m),
                z_m: along(from.z_m, to.z_m),
            };
            return Some((pose, along(a.depth_m, b.depth_m)));
        }
        left -= length;
    }
    path.last().map(|last| (last.world_from_object, last.depth_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::trials::Phase;

    fn at(depth_m: f64, y_m: f64) -> Waypoint {
        let world_from_object = PlanarPose { y_m, z_m: depth_m, ..PlanarPose::default() };
        Waypoint { phase: Phase::Approach, depth_m, world_from_object, world_from_grasp: world_from_object }
    }

    #[test]
    fn the_way_is_gone_at_one_pace() {
        let path = [at(-0.01, 0.0), at(0.0, 0.0), at(0.0, 0.01)];
        let places = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| place(&path, share).unwrap().0);
        let wanted = [[0.0, -0.01], [0.0, -0.005], [0.0, 0.0], [0.005, 0.0], [0.01, 0.0]];
        for (found, [y, z]) in places.iter().zip(wanted) {
            assert!((found.y_m - y).abs() < 1e-12 && (found.z_m - z).abs() < 1e-12, "{found:?}");
        }
        assert_eq!(place(&path, f64::NAN).map(|(pose, _)| pose.z_m.is_finite()), Some(true));
        assert_eq!(place(&[], 0.5), None);
    }
}
