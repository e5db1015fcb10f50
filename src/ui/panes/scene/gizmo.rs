//! The handles of the pose tool: a disc for y and z, and a ring for the angle.
//!
//! They are as large on the screen at any distance. What a drag means is worked out in the plane; seen edge-on, the motion on
//! the screen is taken instead.

use eframe::egui::{PointerButton, Pos2, Shape, Stroke, Ui, vec2};
use glam::{DVec2, DVec3};

use super::Memory;
use super::hands::held;
use crate::app::command::Command;
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::workbench::WorkbenchCommand;
use crate::gpu::guides::AXIS_COLORS;
use crate::gpu::view::Camera;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::scene_view::SceneOutput;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::PoseAxis;

/// Distance of the pointer from a handle at which it means it, points.
const NEAR: f32 = 9.0;
/// Radius of the disc in the middle, points.
const DISC: f32 = 9.0;
/// Radius of the ring, points.
const RING: f64 = 62.0;
/// Cosine of the angle between the view and a plane below which a drag in it is not worked out.
const EDGE_ON: f64 = 0.12;

/// Handle that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Handle {
    /// y and z.
    Disc,
    /// The turn about x.
    Ring,
}

/// A drag under way.
#[derive(Clone, Copy, Debug)]
struct Drag {
    source: ImprintSource,
    handle: Handle,
    /// The pose when it began.
    from: PlanarPose,
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

/// Handles on the screen.
struct Placed {
    center: Pos2,
    ring: Vec<Pos2>,
}

fn origin(pose: PlanarPose) -> DVec3 {
    DVec3::new(0.0, pose.y_m, pose.z_m)
}

/// Meters that are as long as `points` on the screen at the handles.
fn meters(camera: &Camera, output: &SceneOutput, ppp: f32, center: DVec3, points: f64) -> f64 {
    let depth = (camera.eye() - center).dot(camera.axes()[2]);
    let scale = if camera.orthographic { 1.0 } else { depth / camera.distance };
    points * f64::from(ppp) * scale.max(1e-3) / camera.px_per_m(output.size)
}

fn place(camera: &Camera, output: &SceneOutput, ppp: f32, pose: PlanarPose) -> Option<Placed> {
    let center_m = origin(pose);
    let center = output.on_screen(camera, center_m)?;
    let radius = meters(camera, output, ppp, center_m, RING);
    let ring = (0..=64).filter_map(|i| {
        let (s, c) = (f64::from(i) / 64.0 * std::f64::consts::TAU).sin_cos();
        output.on_screen(camera, center_m + (DVec3::Y * c + DVec3::Z * s) * radius)
    });
    Some(Placed { center, ring: ring.collect() })
}

fn under(placed: &Placed, pointer: Pos2) -> Option<Handle> {
    if pointer.distance(placed.center) <= DISC + 3.0 {
        return Some(Handle::Disc);
    }
    let distance = placed.ring.windows(2).map(|w| to_segment(pointer, w[0], w[1])).fold(f32::MAX, f32::min);
    (distance <= NEAR).then_some(Handle::Ring)
}

fn to_segment(p: Pos2, a: Pos2, b: Pos2) -> f32 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
    p.distance(a + along * t)
}

/// The pose that a drag of `handle` from `began` to `now` (physical pixels) leads to.
fn dragged(camera: &Camera, size: [u32; 2], from: PlanarPose, handle: Handle, began: DVec2, now: DVec2) -> PlanarPose {
    let center_m = origin(from);
    let meet = |px: DVec2| {
        let ray = camera.ray(px, size);
        (ray.direction.x.abs() > EDGE_ON).then(|| ray.meets_plane(center_m, DVec3::X)).flatten()
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
            PlanarPose { y_m: from.y_m + by.y, z_m: from.z_m + by.z, ..from }
        }
        Handle::Ring => {
            let angle = match (meet(began), meet(now)) {
                (Some(a), Some(b)) => {
                    let (u, v) = (a - center_m, b - center_m);
                    u.cross(v).x.atan2(u.dot(v))
                }
                // Edge-on a ring is a line: along it, half a turn is its length.
                _ => (now - began).x / RING * 0.5,
            };
            PoseAxis::Theta.moved(from, angle)
        }
    }
}

/// Follows the pointer and paints the handles.
pub(super) fn show(cx: &mut Cx<'_>, ui: &Ui, memory: &mut Memory, source: ImprintSource, output: &SceneOutput) {
    let Some(pose) = held(cx.state, source).filter(|_| results::tool(cx.state).ready().is_some()) else {
        if memory.gizmo.holds(source) {
            memory.gizmo = Gizmo::default();
        }
        return;
    };
    let camera = memory.views[source as usize].camera;
    let ppp = ui.pixels_per_point();
    let Some(placed) = place(&camera, output, ppp, pose) else { return };
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
    let [r, g, b, _] = AXIS_COLORS[0];
    let color = eframe::egui::Color32::from_rgb(r, g, b);
    let stroke = if active == Some(Handle::Ring) { Stroke::new(4.0, cx.p.strong) } else { Stroke::new(2.5, color) };
    painter.add(Shape::line(placed.ring.clone(), Stroke::new(5.0, cx.p.canvas.gamma_multiply(0.7))));
    painter.add(Shape::line(placed.ring.clone(), stroke));
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
    use touch2touch_core::frames::CameraPreset;

    const SIZE: [u32; 2] = [600, 400];

    fn side_view() -> Camera {
        let mut camera = Camera::default();
        camera.look_from(CameraPreset::Right);
        camera
    }

    #[test]
    fn the_disc_follows_the_pointer_in_the_plane() {
        for camera in [side_view(), Camera::default()] {
            let from = PlanarPose { theta_rad: 0.2, y_m: 0.004, z_m: 0.0 };
            let began = camera.project(origin(from), SIZE).unwrap().0;
            let goal = origin(from) + DVec3::new(0.0, 0.003, -0.005);
            let now = camera.project(goal, SIZE).unwrap().0;
            let to = dragged(&camera, SIZE, from, Handle::Disc, began, now);
            assert!((origin(to) - goal).length() < 1e-9, "{to:?}");
            assert_eq!(to.theta_rad, from.theta_rad);
        }
    }

    #[test]
    fn the_ring_turns_by_the_angle_that_the_pointer_goes_around_and_edge_on_drags_stay_finite() {
        let camera = Camera::default();
        let from = PlanarPose { z_m: 0.002, ..PlanarPose::default() };
        let at = |angle: f64| origin(from) + DVec3::new(0.0, angle.cos(), angle.sin()) * 0.01;
        let px = |angle: f64| camera.project(at(angle), SIZE).unwrap().0;
        let to = dragged(&camera, SIZE, from, Handle::Ring, px(0.3), px(0.9));
        assert!((to.theta_rad - 0.6).abs() < 1e-9 && (to.y_m, to.z_m) == (from.y_m, from.z_m), "{to:?}");
        let mut front = Camera::default();
        front.look_from(CameraPreset::Front);
        for handle in [Handle::Disc, Handle::Ring] {
            let to = dragged(&front, SIZE, from, handle, DVec2::new(300.0, 200.0), DVec2::new(340.0, 250.0));
            assert!(to.is_finite() && origin(to).length() < 0.1, "{handle:?} {to:?}");
        }
    }
}
