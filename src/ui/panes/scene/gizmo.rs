//! The handles of the pose tool: a disc for y and z, a ring for the angle, and three more out of the plane.
//!
//! They are as large on the screen at any distance. What a drag means is worked out in the plane or along the axis that
//! the handle stands for; seen edge-on, the motion on the screen is taken instead.

use eframe::egui::{PointerButton, Pos2, Shape, Stroke, Ui, vec2};
use glam::{DVec2, DVec3};

use super::Memory;
use crate::app::command::Command;
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::workbench::{SceneTool, WorkbenchCommand};
use crate::gpu::guides::AXIS_COLORS;
use crate::gpu::view::Camera;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::scene_view::SceneOutput;
use touch2touch_core::manual::{ManualPose, PoseAxis};

/// Distance of the pointer from a handle at which it means it, points.
const NEAR: f32 = 9.0;
/// Radius of the disc in the middle, points.
const DISC: f32 = 9.0;
/// Radii of the rings about x, y and z, points.
const RINGS: [f64; 3] = [62.0, 78.0, 94.0];
/// Distance of the handle along x, points.
const ARM: f64 = 44.0;
/// Cosine of the angle between the view and a plane below which a drag in it is not worked out.
const EDGE_ON: f64 = 0.12;

/// Handle that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Handle {
    /// y and z.
    Disc,
    /// A turn about x, y or z.
    Ring(PoseAxis),
    /// Along x.
    Arm,
}

/// A drag under way.
#[derive(Clone, Copy, Debug)]
struct Drag {
    source: ImprintSource,
    handle: Handle,
    /// The pose when it began.
    from: ManualPose,
    /// The pointer when it began, physical pixels of the view.
    began: DVec2,
}

/// The handles' state between frames.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gizmo {
    /// The handle under the pointer.
    hot: Option<(ImprintSource, Handle)>,
    drag: Option<Drag>,
}

impl Gizmo {
    /// True where no handle is dragged.
    pub(super) fn is_free(&self) -> bool {
        self.drag.is_none()
    }

    /// True where the primary button is the handles' and does not turn the view.
    pub(super) fn holds(&self, source: ImprintSource) -> bool {
        self.drag.is_some_and(|d| d.source == source) || self.hot.is_some_and(|(of, _)| of == source)
    }
}

/// The normal of the plane that a ring lies in.
fn normal(axis: PoseAxis) -> DVec3 {
    match axis {
        PoseAxis::Pitch => DVec3::Y,
        PoseAxis::Yaw => DVec3::Z,
        _ => DVec3::X,
    }
}

fn radius(axis: PoseAxis) -> f64 {
    match axis {
        PoseAxis::Pitch => RINGS[1],
        PoseAxis::Yaw => RINGS[2],
        _ => RINGS[0],
    }
}

/// Handles on the screen.
struct Placed {
    center: Pos2,
    arm: Option<Pos2>,
    rings: Vec<(PoseAxis, Vec<Pos2>)>,
}

fn origin(pose: ManualPose) -> DVec3 {
    DVec3::new(pose.x_m, pose.planar.y_m, pose.planar.z_m)
}

/// Meters that are as long as `points` on the screen at the handles.
fn meters(camera: &Camera, output: &SceneOutput, ppp: f32, center: DVec3, points: f64) -> f64 {
    let depth = (camera.eye() - center).dot(camera.axes()[2]);
    let scale = if camera.orthographic { 1.0 } else { depth / camera.distance };
    points * f64::from(ppp) * scale.max(1e-3) / camera.px_per_m(output.size)
}

fn place(camera: &Camera, output: &SceneOutput, ppp: f32, pose: ManualPose, six_dof: bool) -> Option<Placed> {
    let center_m = origin(pose);
    let center = output.on_screen(camera, center_m)?;
    let meter = |points: f64| meters(camera, output, ppp, center_m, points);
    let axes: &[PoseAxis] =
        if six_dof { &[PoseAxis::Theta, PoseAxis::Pitch, PoseAxis::Yaw] } else { &[PoseAxis::Theta] };
    let rings = axes.iter().map(|&axis| {
        let (n, r) = (normal(axis), meter(radius(axis)));
        let (u, v) = n.any_orthonormal_pair();
        let rim = (0..=64).filter_map(|i| {
            let (s, c) = (f64::from(i) / 64.0 * std::f64::consts::TAU).sin_cos();
            output.on_screen(camera, center_m + (u * c + v * s) * r)
        });
        (axis, rim.collect())
    });
    let arm = six_dof.then(|| output.on_screen(camera, center_m + DVec3::X * meter(ARM))).flatten();
    Some(Placed { center, arm, rings: rings.collect() })
}

fn under(placed: &Placed, pointer: Pos2) -> Option<Handle> {
    if pointer.distance(placed.center) <= DISC + 3.0 {
        return Some(Handle::Disc);
    }
    if placed.arm.is_some_and(|arm| pointer.distance(arm) <= NEAR) {
        return Some(Handle::Arm);
    }
    let distance = |rim: &Vec<Pos2>| rim.windows(2).map(|w| to_segment(pointer, w[0], w[1])).fold(f32::MAX, f32::min);
    let nearest = placed.rings.iter().map(|(axis, rim)| (*axis, distance(rim))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    (nearest.1 <= NEAR).then_some(Handle::Ring(nearest.0))
}

fn to_segment(p: Pos2, a: Pos2, b: Pos2) -> f32 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
    p.distance(a + along * t)
}

/// The pose that a drag of `handle` from `began` to `now` (physical pixels) leads to.
fn dragged(camera: &Camera, size: [u32; 2], from: ManualPose, handle: Handle, began: DVec2, now: DVec2) -> ManualPose {
    let center_m = origin(from);
    let n = match handle {
        Handle::Ring(axis) => normal(axis),
        Handle::Disc | Handle::Arm => DVec3::X,
    };
    let meet = |px: DVec2| {
        let ray = camera.ray(px, size);
        (ray.direction.dot(n).abs() > EDGE_ON).then(|| ray.meets_plane(center_m, n)).flatten()
    };
    // The motion in the plane of the screen through the tool, meters.
    let on_screen = {
        let [right, up, back] = camera.axes();
        let depth = (camera.eye() - center_m).dot(back);
        let scale = if camera.orthographic { 1.0 } else { depth / camera.distance };
        let px = now - began;
        (right * px.x - up * px.y) * (scale / camera.px_per_m(size))
    };
    match handle {
        Handle::Disc => {
            let by = match (meet(began), meet(now)) {
                (Some(a), Some(b)) => b - a,
                _ => on_screen,
            };
            from.moved(PoseAxis::Y, by.y).moved(PoseAxis::Z, by.z)
        }
        Handle::Arm => {
            // As far along x as the drag goes along the picture of x.
            let [right, up, _] = camera.axes();
            let shown = DVec2::new(right.x, up.x);
            let moved = DVec2::new(on_screen.dot(right), on_screen.dot(up));
            let by = if shown.length_squared() > 0.01 { moved.dot(shown) / shown.length_squared() } else { 0.0 };
            from.moved(PoseAxis::X, by)
        }
        Handle::Ring(axis) => {
            let angle = match (meet(began), meet(now)) {
                (Some(a), Some(b)) => {
                    let (u, v) = (a - center_m, b - center_m);
                    n.dot(u.cross(v)).atan2(u.dot(v))
                }
                // Edge-on a ring is a line: along it, half a turn is its length.
                _ => (now - began).x / radius(axis) * 0.5,
            };
            from.moved(axis, angle)
        }
    }
}

/// Follows the pointer and paints the handles.
pub(super) fn show(cx: &mut Cx<'_>, ui: &Ui, memory: &mut Memory, source: ImprintSource, output: &SceneOutput) {
    let bench = &cx.state.workbench;
    let elsewhere = bench.hand.as_ref().is_some_and(|hand| hand.source != source);
    if bench.tool != SceneTool::Pose || elsewhere || results::tool(cx.state).ready().is_none() {
        if memory.gizmo.holds(source) {
            memory.gizmo = Gizmo::default();
        }
        return;
    }
    let pose = bench.hand(source).map_or_else(|| results::manual_begins(cx.state, source), |hand| hand.pose);
    let six_dof = bench.six_dof;
    let camera = memory.views[source as usize].camera;
    let ppp = ui.pixels_per_point();
    let Some(placed) = place(&camera, output, ppp, pose, six_dof) else { return };
    let pointer = output.response.hover_pos().or_else(|| output.response.interact_pointer_pos());
    let response = &output.response;
    let gizmo = &mut memory.gizmo;
    let to_px = |pos: Pos2| {
        let p = (pos - response.rect.min) * ppp;
        DVec2::new(f64::from(p.x), f64::from(p.y))
    };
    if let (Some((of, handle)), Some(origin)) = (gizmo.hot, ui.input(|i| i.pointer.press_origin()))
        && of == source
        && response.drag_started_by(PointerButton::Primary)
    {
        gizmo.drag = Some(Drag { source, handle, from: pose, began: to_px(origin) });
    }
    let mut to = None;
    match gizmo.drag.filter(|d| d.source == source) {
        Some(drag) if response.dragged_by(PointerButton::Primary) => {
            if let Some(now) = response.interact_pointer_pos() {
                to = Some(dragged(&camera, output.size, drag.from, drag.handle, drag.began, to_px(now)));
            }
        }
        Some(_) => gizmo.drag = None,
        None if !ui.input(|i| i.pointer.any_down()) => {
            let hot = pointer.and_then(|p| under(&placed, p)).map(|handle| (source, handle));
            if hot.is_some() || gizmo.hot.is_some_and(|(of, _)| of == source) {
                gizmo.hot = hot;
            }
        }
        None => {}
    }
    let active = gizmo.drag.map(|d| d.handle).or(gizmo.hot.filter(|(of, _)| *of == source).map(|(_, h)| h));
    if let Some(to) = to.filter(|to| *to != pose) {
        cx.push(Command::Workbench(WorkbenchCommand::SetSide(source)));
        cx.push(Command::Workbench(WorkbenchCommand::SetHandPose(to)));
    }
    paint(cx, ui, output, &placed, active);
}

fn paint(cx: &Cx<'_>, ui: &Ui, output: &SceneOutput, placed: &Placed, active: Option<Handle>) {
    let painter = ui.painter_at(output.response.rect);
    let color = |axis: usize| {
        let [r, g, b, _] = AXIS_COLORS[axis];
        eframe::egui::Color32::from_rgb(r, g, b)
    };
    let stroke = |handle: Handle, axis: usize| {
        if active == Some(handle) { Stroke::new(4.0, cx.p.strong) } else { Stroke::new(2.5, color(axis)) }
    };
    for (axis, rim) in &placed.rings {
        let which = match axis {
            PoseAxis::Pitch => 1,
            PoseAxis::Yaw => 2,
            _ => 0,
        };
        painter.add(Shape::line(rim.clone(), Stroke::new(5.0, cx.p.canvas.gamma_multiply(0.7))));
        painter.add(Shape::line(rim.clone(), stroke(Handle::Ring(*axis), which)));
    }
    if let Some(arm) = placed.arm {
        painter.line_segment([placed.center, arm], stroke(Handle::Arm, 0));
        painter.circle(arm, 6.0, color(0), stroke(Handle::Arm, 0));
    }
    let on = active == Some(Handle::Disc);
    let fill = if on { cx.p.strong } else { cx.p.accent };
    painter.circle(placed.center, DISC, fill.gamma_multiply(0.85), Stroke::new(1.5, cx.p.canvas));
    for arm in [vec2(1.0, 0.0), vec2(0.0, 1.0)] {
        painter.line_segment([placed.center - arm * 5.0, placed.center + arm * 5.0], Stroke::new(1.5, cx.p.canvas));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::view::Preset;

    const SIZE: [u32; 2] = [600, 400];

    fn side_view() -> Camera {
        let mut camera = Camera::default();
        camera.look_from(Preset::Right);
        camera
    }

    #[test]
    fn the_disc_follows_the_pointer_in_the_plane() {
        for camera in [side_view(), Camera::default()] {
            let from = ManualPose::default().moved(PoseAxis::Y, 0.004).moved(PoseAxis::Theta, 0.2);
            let began = camera.project(origin(from), SIZE).unwrap().0;
            let goal = origin(from) + DVec3::new(0.0, 0.003, -0.005);
            let now = camera.project(goal, SIZE).unwrap().0;
            let to = dragged(&camera, SIZE, from, Handle::Disc, began, now);
            assert!((origin(to) - goal).length() < 1e-9, "{to:?}");
            assert_eq!(to.planar.theta_rad, from.planar.theta_rad);
        }
    }

    #[test]
    fn rings_turn_by_the_angle_that_the_pointer_goes_around() {
        let camera = Camera::default();
        let from = ManualPose::default().moved(PoseAxis::Z, 0.002);
        for axis in [PoseAxis::Theta, PoseAxis::Pitch, PoseAxis::Yaw] {
            let (u, v) = normal(axis).any_orthonormal_pair();
            // Both orders of the pair are right-handed about the normal or not: ask the cross product.
            let sign = u.cross(v).dot(normal(axis)).signum();
            let at = |angle: f64| origin(from) + (u * angle.cos() + v * angle.sin()) * 0.01;
            let px = |angle: f64| camera.project(at(angle), SIZE).unwrap().0;
            let to = dragged(&camera, SIZE, from, Handle::Ring(axis), px(0.3), px(0.9));
            let want = from.moved(axis, 0.6 * sign);
            let close = (to.planar.theta_rad - want.planar.theta_rad).abs()
                + (to.pitch_rad - want.pitch_rad).abs()
                + (to.yaw_rad - want.yaw_rad).abs();
            assert!(close < 1e-9, "{axis:?}: {to:?}");
        }
    }

    #[test]
    fn the_arm_moves_along_x_and_edge_on_drags_stay_finite() {
        let camera = Camera { yaw_rad: 1.2, ..Camera::default() };
        let from = ManualPose::default();
        let px = |p: DVec3| camera.project(p, SIZE).unwrap().0;
        let to = dragged(&camera, SIZE, from, Handle::Arm, px(DVec3::ZERO), px(DVec3::X * 0.002));
        assert!((to.x_m - 0.002).abs() < 1e-4 && to.planar == from.planar, "{to:?}");
        let mut front = Camera::default();
        front.look_from(Preset::Front);
        for handle in [Handle::Disc, Handle::Arm, Handle::Ring(PoseAxis::Theta)] {
            let to = dragged(&front, SIZE, from, handle, DVec2::new(300.0, 200.0), DVec2::new(340.0, 250.0));
            assert!(to.is_finite() && origin(to).length() < 0.1, "{handle:?} {to:?}");
        }
    }
}
