//! The camera, and the only place where f64 meters become the f32 of the device.
//!
//! World = the grasp frame (see [`touch2touch_core::frames`]): x = closing axis with the left finger at negative x,
//! +z = the direction the tool points, y = lateral. On screen the wrist is up (-z), so the tool hangs down.

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DMat4, DVec2, DVec3, DVec4, Vec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};

use touch2touch_core::frames::CameraPreset;
use touch2touch_core::label::{Layers, Sight};

/// Up on the screen, in world coordinates.
const UP: DVec3 = DVec3::NEG_Z;
/// Distances that make sense for things between a hair and a room, meters.
const DISTANCE: std::ops::RangeInclusive<f64> = 1e-4..=100.0;
/// x of a point that is not finite; see `is_hidden` in `shaders/common/view.wgsl`.
pub(super) const HIDDEN: f32 = f32::MAX;

/// A half line in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ray {
    /// Start, meters.
    pub origin: DVec3,
    /// Unit vector into the scene.
    pub direction: DVec3,
}

impl Ray {
    /// Point where it meets the plane through `point` with `normal`; `None` if it is parallel or points away.
    pub(crate) fn meets_plane(&self, point: DVec3, normal: DVec3) -> Option<DVec3> {
        let along = self.direction.dot(normal);
        let t = (point - self.origin).dot(normal) / along;
        (along.abs() > 1e-12 && t >= 0.0).then(|| self.origin + self.direction * t)
    }
}

/// Nearest distance from the eye that is drawn, as a share of the distance to the target.
const NEAR: f64 = 0.02;
/// Depths of a parallel projection: so many distances to both sides of the target.
const ORTHOGRAPHIC_REACH: f64 = 40.0;

/// A rectangle of a picture: pictures larger than a texture are drawn in several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Width and height of the whole picture, pixels.
    pub of: [u32; 2],
    /// Left and upper pixel of the part.
    pub at: [u32; 2],
    /// Width and height of the part, pixels.
    pub size: [u32; 2],
}

impl Part {
    /// A picture in one.
    pub fn whole(size: [u32; 2]) -> Self {
        Self { of: size, at: [0, 0], size }
    }

    /// The matrix from clip coordinates of the whole picture to those of the part.
    fn clip_from_whole(self) -> DMat4 {
        if self == Self::whole(self.of) {
            return DMat4::IDENTITY;
        }
        let [of, at, size] = [self.of, self.at, self.size].map(|s| DVec2::new(f64::from(s[0]), f64::from(s[1])));
        let scale = of / size.max(DVec2::ONE);
        let middle = (at + 0.5 * size) / of.max(DVec2::ONE) * 2.0 - 1.0;
        // Rows count downwards, clip coordinates upwards.
        DMat4::from_cols(
            DVec4::X * scale.x,
            DVec4::Y * scale.y,
            DVec4::Z,
            DVec4::new(-middle.x * scale.x, middle.y * scale.y, 0.0, 1.0),
        )
    }
}

with_defaults! {
    /// A camera that looks at `target` from `distance`. Plain numbers, so that views can be linked and stored.
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct Camera {
        /// The point in the middle of the screen, meters, world.
        pub target: DVec3 = DVec3::ZERO,
        /// From the eye to the target, meters.
        pub distance: f64 = 0.15,
        /// Direction of the eye seen from the target, radians about the vertical; 0 = positive x, growing towards y.
        pub yaw_rad: f64 = CameraPreset::Oblique.angles_rad()[0],
        /// Elevation of the eye over the horizontal plane, radians in -π/2..π/2; positive = from the wrist's side.
        pub pitch_rad: f64 = CameraPreset::Oblique.angles_rad()[1],
        /// Angle of view of the smaller side, radians: views of any shape show the same things.
        pub fov_rad: f64 = 0.6,
        /// Parallel projection of the same size at the target: lengths on the screen can be compared.
        pub orthographic: bool = false,
    }
}

impl Camera {
    /// The unit vectors right, up and towards the eye, in world coordinates.
    pub fn axes(&self) -> [DVec3; 3] {
        let (sy, cy) = self.yaw_rad.sin_cos();
        let (sp, cp) = self.pitch_rad.sin_cos();
        let back = DVec3::new(cp * cy, cp * sy, 0.0) + UP * sp;
        // From the yaw alone, so that looking straight down is no special case.
        let right = DVec3::new(sy, -cy, 0.0);
        [right, back.cross(right), back]
    }

    /// Position of the eye, meters, world.
    pub fn eye(&self) -> DVec3 {
        self.target + self.axes()[2] * self.distance
    }

    /// Turns by a drag of `px` pixels (y down): the scene follows the pointer.
    pub fn orbit(&mut self, px: DVec2) {
        const RAD_PER_PX: f64 = 0.008;
        self.yaw_rad = (self.yaw_rad + px.x * RAD_PER_PX).rem_euclid(2.0 * PI);
        self.pitch_rad = (self.pitch_rad + px.y * RAD_PER_PX).clamp(-FRAC_PI_2, FRAC_PI_2);
    }

    /// Moves by a drag of `px` pixels (y down) in a view of `size` pixels: the target's plane follows the pointer.
    pub(crate) fn pan(&mut self, px: DVec2, size: [u32; 2]) {
        let [right, up, _] = self.axes();
        self.target += (up * px.y - right * px.x) / self.px_per_m(size);
    }

    /// Divides the distance by `factor` (> 1 = closer); what is under `anchor` (pixels) stays there if given.
    pub(crate) fn zoom(&mut self, factor: f64, anchor: Option<DVec2>, size: [u32; 2]) {
        if !(factor.is_finite() && factor > 0.0) {
            return;
        }
        let old = self.distance;
        let fixed = anchor.and_then(|px| self.ray(px, size).meets_plane(self.target, self.axes()[2]));
        self.distance = (old / factor).clamp(*DISTANCE.start(), *DISTANCE.end());
        if let Some(fixed) = fixed {
            self.target = fixed + (self.target - fixed) * (self.distance / old);
        }
    }

    /// Turns to a side; target and distance stay.
    pub fn look_from(&mut self, preset: CameraPreset) {
        [self.yaw_rad, self.pitch_rad] = preset.angles_rad();
    }

    /// Moves so that these points (meters, world) span `share` of the smaller side of the view from the present side, in
    /// its middle. Does nothing without a finite point.
    pub fn frame(&mut self, points: &[DVec3], share: f64) {
        let axes = self.axes();
        let along = |p: &DVec3| DVec3::new(p.dot(axes[0]), p.dot(axes[1]), p.dot(axes[2]));
        let seen: Vec<DVec3> = points.iter().filter(|p| p.is_finite()).map(along).collect();
        let Some(first) = seen.first() else { return };
        let [lo, hi] = seen.iter().fold([*first; 2], |[lo, hi], p| [lo.min(*p), hi.max(*p)]);
        let middle = 0.5 * (lo + hi);
        self.target = axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z;
        let tan = (0.5 * self.fov_rad).tan() * share.max(1e-3);
        let needed = |p: &DVec3| {
            let off = *p - middle;
            let nearer = if self.orthographic { 0.0 } else { off.z };
            off.x.abs().max(off.y.abs()) / tan + nearer
        };
        let distance = seen.iter().map(needed).fold(1e-3, f64::max);
        self.distance = distance.clamp(*DISTANCE.start(), *DISTANCE.end());
    }

    /// True where every number is one that can be drawn with: stored state is outside data.
    pub(crate) fn is_valid(&self) -> bool {
        self.target.is_finite()
            && DISTANCE.contains(&self.distance)
            && self.yaw_rad.is_finite()
            && self.pitch_rad.abs() <= FRAC_PI_2 + 1e-9
            && (0.01..3.0).contains(&self.fov_rad)
    }

    /// Pixels per meter at the target.
    pub fn px_per_m(&self, size: [u32; 2]) -> f64 {
        0.5 * f64::from(size[0].min(size[1]).max(1)) / ((0.5 * self.fov_rad).tan() * self.distance)
    }

    /// The matrix from world to clip coordinates (depth reversed: 1 near, 0 far).
    pub(crate) fn clip_from_world(&self, size: [u32; 2]) -> DMat4 {
        let [right, up, back] = self.axes();
        let eye = self.eye();
        let row = |axis: DVec3| axis.extend(-axis.dot(eye));
        let [x, y, z] = [right, up, back].map(row);
        let [width, height] = spans(size);
        let focal = 1.0 / (0.5 * self.fov_rad).tan();
        let rows = if self.orthographic {
            // Parallel rays have no near side.
            let scale = focal / self.distance;
            let reach = ORTHOGRAPHIC_REACH * self.distance;
            let depth = z / (2.0 * reach) + DVec4::W * (0.5 + self.distance / (2.0 * reach));
            [x * (scale / width), y * (scale / height), depth, DVec4::W]
        } else {
            // Infinite far plane.
            [x * (focal / width), y * (focal / height), DVec4::W * (NEAR * self.distance), -z]
        };
        DMat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose()
    }

    /// Projection of a point (meters, world): pixels from the upper left corner, and its distance in front of the eye
    /// in meters. `None` behind the eye and for a point that is not finite.
    pub fn project(&self, p_in_world: DVec3, size: [u32; 2]) -> Option<(DVec2, f64)> {
        Projector::new(self, size).project(p_in_world)
    }

    /// The ray through pixel position `px` (from the upper left corner; the middle of the first pixel is 0.5, 0.5).
    pub(crate) fn ray(&self, px: DVec2, size: [u32; 2]) -> Ray {
        let [right, up, back] = self.axes();
        let [width, height] = size.map(|s| f64::from(s.max(1)));
        let half = (0.5 * self.fov_rad).tan();
        let [wide, high] = spans(size);
        let x = (2.0 * px.x / width - 1.0) * half * wide;
        let y = (1.0 - 2.0 * px.y / height) * half * high;
        if self.orthographic {
            Ray { origin: self.eye() + (right * x + up * y) * self.distance, direction: -back }
        } else {
            Ray { origin: self.eye(), direction: (right * x + up * y - back).normalize() }
        }
    }

    /// The unit vector towards the key light, world: above the eye, to its left.
    pub(super) fn key_light(&self) -> DVec3 {
        let [right, up, back] = self.axes();
        (back + 0.55 * up - 0.45 * right).normalize()
    }

    /// The picture of `size` pixels, as what a mask is drawn on.
    pub fn sight(&self, size: [u32; 2], layers: Layers) -> Sight {
        Sight { clip_from_grasp: self.clip_from_world(size).as_mat4(), size_px: size, layers }
    }

    /// The camera for the device; `unit_px` pixels are one of a screen.
    pub(super) fn uniform(&self, part: Part, unit_px: f32) -> ViewUniform {
        let size = part.of;
        let [_, up, back] = self.axes();
        let (eye, at_one, depth) = if self.orthographic {
            let reach = ORTHOGRAPHIC_REACH * self.distance;
            (back.extend(0.0), 1.0, [self.distance + reach, 2.0 * reach, 1.0, self.distance])
        } else {
            (self.eye().extend(1.0), self.distance, [NEAR * self.distance, 0.0, 0.0, self.distance])
        };
        ViewUniform {
            clip_from_world: (part.clip_from_whole() * self.clip_from_world(size)).as_mat4().to_cols_array(),
            eye_in_world: eye.as_vec4().to_array(),
            up_in_world: up.extend(0.0).as_vec4().to_array(),
            key_in_world: self.key_light().extend(0.0).as_vec4().to_array(),
            depth: depth.map(|v| v as f32),
            size_px: part.size.map(|s| s.max(1) as f32),
            px_per_m: (self.px_per_m(size) * at_one) as f32,
            unit_px: if unit_px.is_finite() { unit_px.max(0.01) } else { 1.0 },
        }
    }
}

/// Projects many points with one matrix.
pub(super) struct Projector {
    clip: DMat4,
    size: DVec2,
    depth_row: DVec4,
}

impl Projector {
    /// For points of the world.
    pub(super) fn new(camera: &Camera, size: [u32; 2]) -> Self {
        let back = camera.axes()[2];
        Self {
            clip: camera.clip_from_world(size),
            size: DVec2::new(f64::from(size[0].max(1)), f64::from(size[1].max(1))),
            depth_row: (-back).extend(back.dot(camera.eye())),
        }
    }

    /// As [`Camera::project`].
    pub(super) fn project(&self, p: DVec3) -> Option<(DVec2, f64)> {
        let p = p.extend(1.0);
        let clip = self.clip * p;
        let depth = self.depth_row.dot(p);
        let place_px = DVec2::new(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * self.size;
        // Reversed depth: in front of the near plane means z <= w.
        (place_px.is_finite() && clip.w > 0.0 && clip.z <= clip.w && clip.z >= 0.0).then_some((place_px, depth))
    }
}

/// Width and height in units of the smaller one.
fn spans(size: [u32; 2]) -> [f64; 2] {
    let size = size.map(|s| f64::from(s.max(1)));
    size.map(|s| s / size[0].min(size[1]))
}

/// The camera as the shaders see it; twin of the struct in `shaders/common/view.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct ViewUniform {
    pub(super) clip_from_world: [f32; 16],
    pub(super) eye_in_world: [f32; 4],
    pub(super) up_in_world: [f32; 4],
    pub(super) key_in_world: [f32; 4],
    pub(super) depth: [f32; 4],
    pub(super) size_px: [f32; 2],
    pub(super) px_per_m: f32,
    pub(super) unit_px: f32,
}

/// A position for the device; one that is not finite (or not in reach of f32) becomes one that shaders leave out.
pub(super) fn position(p: DVec3) -> [f32; 3] {
    let q: Vec3 = p.as_vec3();
    if q.is_finite() && q.x.abs() < 1e30 { q.to_array() } else { [HIDDEN, 0.0, 0.0] }
}

/// A transform for the device.
pub(super) fn matrix(a: &DAffine3) -> [f32; 16] {
    DMat4::from(*a).as_mat4().to_cols_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [800, 500];

    fn cameras() -> Vec<Camera> {
        let mut out = Vec::new();
        for orthographic in [false, true] {
            for preset in [CameraPreset::Left, CameraPreset::Right, CameraPreset::Front, CameraPreset::Top] {
                let mut c = Camera { orthographic, target: DVec3::new(0.01, -0.02, 0.03), ..Camera::default() };
                out.push(c);
                c.look_from(preset);
                out.push(c);
            }
        }
        out
    }

    #[test]
    fn the_ray_through_a_projected_point_meets_it() {
        for camera in cameras() {
            for p in [DVec3::new(0.02, 0.01, 0.0), DVec3::new(-0.01, -0.03, 0.05), camera.target] {
                let (px, depth) = camera.project(p, SIZE).unwrap();
                let ray = camera.ray(px, SIZE);
                let along = (p - ray.origin).dot(ray.direction);
                assert!((ray.origin + ray.direction * along - p).length() < 1e-12);
                assert!((depth - (camera.eye() - p).dot(camera.axes()[2])).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_sight_shows_points_where_the_camera_does() {
        for camera in cameras() {
            let sight = camera.sight(SIZE, Layers::Front);
            for p in [DVec3::new(0.02, 0.01, 0.0), DVec3::new(-0.01, -0.03, 0.05), camera.target] {
                let (px, _) = camera.project(p, SIZE).unwrap();
                // There the middle of the first pixel is 0.5, here 0.
                assert!((sight.project(p).unwrap() + 0.5 - px).length() < 0.01, "{camera:?} {p}");
            }
            let scale = sight.px_per_m(camera.target).unwrap();
            assert!((scale / camera.px_per_m(SIZE) - 1.0).abs() < 1e-4, "{camera:?} {scale}");
        }
    }

    #[test]
    fn presets_show_the_sides_that_their_names_say() {
        let on_screen = |preset, p| {
            let mut c = Camera::default();
            c.look_from(preset);
            c.project(p, SIZE).unwrap().0 - DVec2::new(400.0, 250.0)
        };
        let tip = DVec3::new(0.0, 0.0, 0.02);
        for preset in [CameraPreset::Left, CameraPreset::Right, CameraPreset::Front] {
            assert!(on_screen(preset, tip).y > 10.0, "the tool hangs down from {preset:?}");
        }
        let left_finger = DVec3::new(-0.02, 0.0, 0.0);
        assert!(on_screen(CameraPreset::Front, left_finger).x < -10.0);
        assert!(on_screen(CameraPreset::Top, left_finger).x < -10.0);
        let eye = |preset| {
            let mut c = Camera::default();
            c.look_from(preset);
            c.eye()
        };
        assert!(
            eye(CameraPreset::Left).x < -0.1 && eye(CameraPreset::Right).x > 0.1 && eye(CameraPreset::Top).z < -0.1
        );
        let lateral = DVec3::new(0.0, 0.01, 0.0);
        assert!(
            on_screen(CameraPreset::Left, lateral).x * on_screen(CameraPreset::Right, lateral).x < 0.0,
            "they mirror"
        );
    }

    #[test]
    fn axes_are_right_handed_and_depth_is_reversed() {
        for camera in cameras() {
            let [right, up, back] = camera.axes();
            assert!((right.cross(up) - back).length() < 1e-12);
            assert!(up.dot(UP) >= -1e-12);
            let m = camera.clip_from_world(SIZE);
            let ndc = |p: DVec3| {
                let c = m * p.extend(1.0);
                c.z / c.w
            };
            let near = ndc(camera.target + back * 0.05);
            let far = ndc(camera.target - back * 0.05);
            assert!(1.0 > near && near > far && far > 0.0, "{near} {far}");
        }
    }

    #[test]
    fn a_framed_box_is_shown_whole_and_zoom_keeps_the_anchor() {
        for mut camera in cameras() {
            for size in [[800, 500], [200, 700]] {
                let bounds = [DVec3::new(-0.01, -0.03, 0.0), DVec3::new(0.01, 0.03, 0.09)];
                let pick = |i: usize, axis: usize| bounds[i >> axis & 1][axis];
                let corners: Vec<DVec3> = (0..8).map(|i| DVec3::new(pick(i, 0), pick(i, 1), pick(i, 2))).collect();
                camera.frame(&corners, 0.95);
                for corner in corners {
                    let (px, _) = camera.project(corner, size).unwrap();
                    assert!(
                        px.x >= 0.0 && px.y >= 0.0 && px.x <= f64::from(size[0]) && px.y <= f64::from(size[1]),
                        "{px}"
                    );
                }
                let anchor = DVec2::new(150.0, 90.0);
                let before = camera.ray(anchor, size).meets_plane(camera.target, camera.axes()[2]).unwrap();
                camera.zoom(1.7, Some(anchor), size);
                assert!((camera.project(before, size).unwrap().0 - anchor).length() < 1e-6);
                let before = camera.target;
                camera.pan(DVec2::new(30.0, -20.0), size);
                let moved = camera.project(before, size).unwrap().0
                    - DVec2::new(f64::from(size[0]) / 2.0, f64::from(size[1]) / 2.0);
                assert!((moved - DVec2::new(30.0, -20.0)).length() < 1e-6, "{moved}");
            }
        }
    }

    #[test]
    fn the_scene_follows_an_orbiting_pointer() {
        let mut camera = Camera::default();
        let front = camera.target + camera.axes()[2] * 0.01;
        let before = camera.project(front, SIZE).unwrap().0;
        camera.orbit(DVec2::new(20.0, 10.0));
        let moved = camera.project(front, SIZE).unwrap().0 - before;
        assert!(moved.x > 0.0 && moved.y > 0.0, "{moved}");
        camera.orbit(DVec2::new(0.0, 1e9));
        assert_eq!(camera.pitch_rad, FRAC_PI_2);
    }

    #[test]
    fn bad_input_is_refused() {
        let camera = Camera::default();
        assert_eq!(camera.project(DVec3::NAN, SIZE), None);
        assert_eq!(camera.project(camera.eye() + camera.axes()[2], SIZE), None);
        assert!(camera.is_valid());
        assert!(!Camera { distance: f64::NAN, ..camera }.is_valid());
        let mut same = camera;
        same.frame(&[DVec3::NAN], 0.9);
        same.zoom(0.0, None, SIZE);
        assert_eq!(same, camera);
        assert_eq!(position(DVec3::new(f64::NAN, 1.0, 1.0))[0], HIDDEN);
        assert_eq!(position(DVec3::new(1e300, 1.0, 1.0))[0], HIDDEN);
        let json = serde_json::to_string(&camera).unwrap();
        assert_eq!(serde_json::from_str::<Camera>(&json).unwrap(), camera);
        assert!(camera.project(camera.target, [0, 0]).is_some());
    }
}
