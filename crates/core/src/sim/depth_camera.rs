//! Depth camera of the bubble: what it sees of a membrane, and what it makes of it.

use glam::{DAffine3, DVec2, DVec3};

use super::membrane::{Dome, Membrane};
use super::{BubbleConfig, rig};
use crate::grid::{DepthMap, Grid, Mask};
use crate::noise::{Noise, Stream, blur3};
use crate::rig::{PadId, lab};

/// Membrane points up to this far from the tool count as contact, meters: the lab labels its masks so.
pub(crate) const CONTACT_DISTANCE_M: f64 = 0.001;

/// Slopes of a membrane are hardly ever steeper: tools' bevels are not, nor does it fall off beside a bar.
const MAX_SLOPE: f64 = 2.5;

/// The rays of one camera in the coordinates of its membrane (n, y, z).
pub(super) struct Rays {
    grasp_from_camera: DAffine3,
    outward: f64,
}

impl Rays {
    pub(super) fn new(finger: PadId, grasp_from_camera: DAffine3) -> Self {
        Self { grasp_from_camera, outward: rig::outward(finger) }
    }

    /// Origin of all rays.
    fn origin(&self) -> DVec3 {
        let t = self.grasp_from_camera.translation;
        DVec3::new(self.outward * t.x, t.y, t.z)
    }

    /// Direction of pixel `(u, v)`: a point at depth `z` is `origin + z * direction`.
    fn direction(&self, u: usize, v: usize) -> DVec3 {
        let d = self.grasp_from_camera.matrix3 * lab::BUBBLE.crop.lift(&rig::INTRINSICS, u as f64, v as f64, 1.0);
        DVec3::new(self.outward * d.x, d.y, d.z)
    }

    /// Depth at which the ray of a pixel first meets a surface that is nowhere lower than `lowest`, meters: behind a bar the
    /// wall hides the membrane. `floor` is cheaper to ask than `surface` and hardly ever above it.
    fn first_hit(
        &self,
        [u, v]: [usize; 2],
        lowest: f64,
        floor: impl Fn(DVec2) -> f64,
        surface: impl Fn(DVec2) -> f64,
    ) -> f64 {
        let (origin, d) = (self.origin(), self.direction(u, v));
        let over = |z: f64, height: &dyn Fn(DVec2) -> f64| {
            let p = origin + d * z;
            p.x - height(DVec2::new(p.y, p.z))
        };
        let above = |z: f64| over(z, &surface);
        // With the steepest slope known, a step of the remaining height over that rate cannot jump over the surface.
        let rate = d.x.abs() + MAX_SLOPE * DVec2::new(d.y, d.z).length();
        let start = ((lowest - origin.x) / d.x.max(1e-3) - 1e-4).max(0.0);
        let (mut low, mut next) = (start, start);
        for _ in 0..300 {
            let f = over(next, &floor);
            if f >= 0.0 {
                break;
            }
            low = next;
            next += (-f / rate).max(1e-4);
        }
        let mut f_low = above(low);
        if f_low >= 0.0 {
            low = start;
            f_low = above(low);
        }
        let (mut high, mut f_high) = (low, f_low);
        for _ in 0..300 {
            if f_high >= 0.0 {
                break;
            }
            (low, f_low) = (high, f_high);
            high += (-f_high / rate).max(1e-4);
            f_high = above(high);
        }
        // false position where the surface is straight in the bracket, halving at edges
        for i in 0..10 {
            if f_high < 1e-6 || high - low < 1e-6 {
                break;
            }
            let part = if i < 3 { (f_low / (f_low - f_high)).clamp(0.0, 1.0) } else { 0.5 };
            let z = low + (high - low) * part;
            let f = above(z);
            if f < 0.0 { (low, f_low) = (z, f) } else { (high, f_high) = (z, f) }
        }
        high
    }
}

/// Depth of the free dome, meters.
pub(super) fn dome_depth(rays: &Rays, dome: &Dome) -> DepthMap {
    let lowest = dome.apex - dome.rise - (dome.tilt * dome.semi.y).abs();
    DepthMap::from_fn(lab::BUBBLE.width, lab::BUBBLE.height, |u, v| {
        rays.first_hit([u, v], lowest, |_| f64::NEG_INFINITY, |yz| dome.height(yz)) as f32
    })
}

/// Depth of the pressed membrane, meters, and where it lies on the tool.
pub(super) fn membrane_depth(rays: &Rays, membrane: &Membrane) -> (DepthMap, Mask) {
    let mut contact = Mask::filled(lab::BUBBLE.width, lab::BUBBLE.height, false);
    let lowest = membrane.lowest();
    let depth = DepthMap::from_fn(lab::BUBBLE.width, lab::BUBBLE.height, |u, v| {
        let depth = rays.first_hit([u, v], lowest, |yz| membrane.floor(yz), |yz| membrane.height(yz));
        let hit = rays.origin() + rays.direction(u, v) * depth;
        let yz = DVec2::new(hit.y, hit.z);
        contact[(u, v)] = membrane.distance_to_tool(hit.x, yz, CONTACT_DISTANCE_M) <= CONTACT_DISTANCE_M;
        depth as f32
    });
    (depth, contact)
}

/// Reference minus depth as the camera measures it, meters.
///
/// * the camera's finite pixels: a slight blur;
/// * white noise, correlated over about a pixel, growing with the distance squared;
/// * slow distortion of the whole image, another one in each frame;
/// * the noise of the one reference frame, the same in every image of a sensor: grain and speckles, because the
///   texture printed on the membrane disturbs the camera;
/// * flying pixels between foreground and background at depth steps; dropped pixels, which read 0.
pub(super) fn measure(
    reference: &DepthMap,
    depth: &DepthMap,
    config: &BubbleConfig,
    finger: PadId,
    seed: u64,
) -> DepthMap {
    let (w, h) = (lab::BUBBLE.width, lab::BUBBLE.height);
    let mut noise = Noise::new(seed, Stream::Depth, finger.index());
    let texture = texture(config, finger);
    let grain = correlated(&mut noise, w, h);
    let drift = noise.smooth(w, h, 45.0);
    let seen = blur3(depth, config.blur);
    DepthMap::from_fn(w, h, |u, v| {
        let z = seen[(u, v)];
        let range = (z / rig::RANGE_M as f32).powi(2);
        let mut imprint = reference[(u, v)] - z
            + texture[(u, v)]
            + config.noise_m as f32 * range * grain[(u, v)]
            + config.drift_m as f32 * drift[(u, v)];
        let (lo, hi) = neighbor_range(depth, u, v);
        let roll = noise.unit();
        if hi - lo > 0.003 && roll < config.flying_share {
            imprint = reference[(u, v)] - (lo + (hi - lo) * noise.unit() as f32);
        } else if roll < config.dropped_share {
            imprint = 0.0;
        }
        imprint
    })
}

/// White noise blurred to the grain of the real images (correlation 0.5 at one pixel), deviation 1.
fn correlated(noise: &mut Noise, w: usize, h: usize) -> Grid<f32> {
    let mut grain = blur3(&noise.white(w, h), 0.25);
    // the blur keeps 0.25 + 2 * 0.0625 of the variance along each axis
    for g in grain.as_mut_slice() {
        *g /= 0.375;
    }
    grain
}

/// The fixed pattern of a sensor's reference frame, meters.
fn texture(config: &BubbleConfig, finger: PadId) -> Grid<f32> {
    let (w, h) = (lab::BUBBLE.width, lab::BUBBLE.height);
    let mut noise = Noise::new(config.texture_seed, Stream::DepthTexture, finger.index());
    let grain = correlated(&mut noise, w, h);
    let slow = noise.smooth(w, h, 30.0);
    let mut texture = Grid::from_fn(w, h, |u, v| {
        config.texture_m as f32 * grain[(u, v)] + 0.5 * config.drift_m as f32 * slow[(u, v)]
    });
    let count = (config.speckle_density * (w * h) as f64) as usize;
    for _ in 0..count {
        let (cx, cy) = (noise.uniform(0.0, w as f64), noise.uniform(0.0, h as f64));
        let height = config.speckle_m * noise.uniform(0.4, 1.0) * if noise.unit() < 0.65 { -1.0 } else { 0.8 };
        let radius = noise.uniform(0.8, 1.5);
        for v in (cy - 4.0).max(0.0) as usize..((cy + 4.0) as usize).min(h) {
            for u in (cx - 4.0).max(0.0) as usize..((cx + 4.0) as usize).min(w) {
                let r2 = (u as f64 - cx).powi(2) + (v as f64 - cy).powi(2);
                texture[(u, v)] += (height * (-0.5 * r2 / (radius * radius)).exp()) as f32;
            }
        }
    }
    texture
}

/// Smallest and largest depth among the 3 x 3 pixels around `(u, v)`.
fn neighbor_range(depth: &DepthMap, u: usize, v: usize) -> (f32, f32) {
    let mut range = (f32::INFINITY, f32::NEG_INFINITY);
    for y in v.saturating_sub(1)..=(v + 1).min(depth.height() - 1) {
        for &z in &depth.row(y)[u.saturating_sub(1)..=(u + 1).min(depth.width() - 1)] {
            range = (range.0.min(z), range.1.max(z));
        }
    }
    range
}
