//! The bubble's depth camera before a membrane.

use glam::{DAffine3, DVec2, DVec3};

use super::membrane::{Dome, Membrane};
use crate::grid::{DepthMap, Mask};
use crate::rig::{PadId, lab};
use crate::sensor::Intrinsics;
use crate::sim::outward;

/// Membrane points up to this far from the tool count as contact, meters: the lab labels its masks so.
const CONTACT_DISTANCE_M: f64 = 0.001;

/// Slopes of a membrane are hardly ever steeper.
const MAX_SLOPE: f64 = 2.5;

/// The rays of one camera in the coordinates of its membrane (n, y, z).
pub(super) struct Rays {
    intrinsics: Intrinsics,
    grasp_from_camera: DAffine3,
    outward: f64,
}

impl Rays {
    pub(super) fn new(finger: PadId, intrinsics: Intrinsics, grasp_from_camera: DAffine3) -> Self {
        Self { intrinsics, grasp_from_camera, outward: outward(finger) }
    }

    /// Origin of all rays.
    fn origin(&self) -> DVec3 {
        let t = self.grasp_from_camera.translation;
        DVec3::new(self.outward * t.x, t.y, t.z)
    }

    /// Direction of pixel `(u, v)`: a point at depth `z` is `origin + z * direction`.
    fn direction(&self, u: usize, v: usize) -> DVec3 {
        let d = self.grasp_from_camera.matrix3 * lab::BUBBLE.crop.lift(&self.intrinsics, u as f64, v as f64, 1.0);
        DVec3::new(self.outward * d.x, d.y, d.z)
    }

    /// Depth at which the ray of a pixel first meets a surface that is nowhere lower than `lowest`, meters: behind a bar the
    /// wall hides the membrane.
    fn first_hit(&self, u: usize, v: usize, lowest: f64, surface: impl Fn(DVec2) -> f64) -> f64 {
        let (origin, d) = (self.origin(), self.direction(u, v));
        let above = |z: f64| {
            let p = origin + d * z;
            p.x - surface(DVec2::new(p.y, p.z))
        };
        // With the steepest slope known, a step of the remaining height over that rate cannot jump over the surface.
        let rate = d.x.abs() + MAX_SLOPE * DVec2::new(d.y, d.z).length();
        let mut low = ((lowest - origin.x) / d.x.max(1e-3) - 1e-4).max(0.0);
        let mut f_low = above(low);
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
        rays.first_hit(u, v, lowest, |yz| dome.height(yz)) as f32
    })
}

/// Depth of the pressed membrane, meters, and where it lies on the tool.
pub(super) fn membrane_depth(rays: &Rays, membrane: &Membrane) -> (DepthMap, Mask) {
    let mut contact = Mask::filled(lab::BUBBLE.width, lab::BUBBLE.height, false);
    let lowest = membrane.lowest();
    let depth = DepthMap::from_fn(lab::BUBBLE.width, lab::BUBBLE.height, |u, v| {
        let depth = rays.first_hit(u, v, lowest, |yz| membrane.height(yz));
        let hit = rays.origin() + rays.direction(u, v) * depth;
        let yz = DVec2::new(hit.y, hit.z);
        contact[(u, v)] = membrane.distance_to_tool(hit.x, yz, CONTACT_DISTANCE_M) <= CONTACT_DISTANCE_M;
        depth as f32
    });
    (depth, contact)
}
