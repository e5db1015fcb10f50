//! The shape of a tool: bars that meet at a point, with bevelled rims, symmetric about the y-z plane.
//!
//! A tool is the solid `|x| <= height(y, z)`. Its outline is the union of bars (segments or filled convex cores
//! grown by a half width); towards the outline the height falls by a bevel. Everything else (mesh, signed
//! distance, what the fingers feel) follows from the distance of a point to that outline.

use glam::{DVec2, DVec3};

/// A bar: all points within `half_width_m` of its core.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// A segment (2 points) or a convex polygon (more, counter-clockwise), as (y, z) in meters, object frame.
    pub core: Vec<DVec2>,
    /// Distance from the core to the outline, meters.
    pub half_width_m: f64,
}

impl Bar {
    /// Distance from `p` to the outline of this bar, meters, negative inside.
    fn outline_distance(&self, p: DVec2) -> f64 {
        let n = self.core.len();
        let mut inside = n > 2;
        let mut nearest = f64::INFINITY;
        let edges = if n > 2 { n } else { n - 1 };
        for i in 0..edges {
            let (a, b) = (self.core[i], self.core[(i + 1) % n]);
            let (ab, ap) = (b - a, p - a);
            let t = (ap.dot(ab) / ab.length_squared().max(1e-18)).clamp(0.0, 1.0);
            nearest = nearest.min((ap - ab * t).length_squared());
            inside &= ab.perp_dot(ap) >= 0.0;
        }
        let distance = nearest.sqrt();
        if inside { -distance - self.half_width_m } else { distance - self.half_width_m }
    }
}

/// A tool that both sensors touch.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolSpec {
    /// The lab's name of the tool, or `random_...`.
    pub name: String,
    /// True where the lab trains on it; unseen tools are for testing.
    pub seen: bool,
    /// The parts; the outline is their union.
    pub bars: Vec<Bar>,
    /// Half the extent along the closing axis x, meters.
    pub half_thickness_m: f64,
    /// Width of the bevel along the outline, meters.
    pub bevel_width_m: f64,
    /// Drop of the surface from the inner edge of the bevel to the outline, meters.
    pub bevel_depth_m: f64,
}

impl ToolSpec {
    /// Distance of `(y, z)` (meters, object frame) to the outline, meters, negative inside.
    pub fn outline_distance(&self, p: DVec2) -> f64 {
        self.bars.iter().map(|bar| bar.outline_distance(p)).fold(f64::INFINITY, f64::min)
    }

    /// Distance of the surface from the y-z plane at `(y, z)`, meters; `None` beside the tool.
    pub fn height(&self, p: DVec2) -> Option<f64> {
        let s = self.outline_distance(p);
        (s <= 0.0).then(|| self.height_at(s))
    }

    /// The height at an outline distance `s <= 0`.
    pub(crate) fn height_at(&self, s: f64) -> f64 {
        self.half_thickness_m - self.bevel_depth_m * (1.0 + s / self.bevel_width_m).max(0.0)
    }

    /// Signed distance of a point (meters, object frame) to the surface, negative inside.
    ///
    /// Exact outside except near re-entrant corners, where it is never more than the true distance.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        self.profile_distance(self.outline_distance(DVec2::new(p.y, p.z)), p.x.abs())
    }

    /// Distance in the plane of (outline distance, height) to the profile: flat top, bevel, wall.
    fn profile_distance(&self, s: f64, h: f64) -> f64 {
        let (top, rim) = (self.half_thickness_m, self.half_thickness_m - self.bevel_depth_m);
        let p = DVec2::new(s, h);
        let segment = |a: DVec2, b: DVec2| {
            let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            (p - a - (b - a) * t).length()
        };
        let crest = DVec2::new(-self.bevel_width_m, top);
        let edge = DVec2::new(0.0, rim);
        let distance =
            segment(DVec2::new(-1.0, top), crest).min(segment(crest, edge)).min(segment(edge, DVec2::new(0.0, 0.0)));
        if s <= 0.0 && h <= self.height_at(s) { -distance } else { distance }
    }

    /// Smallest and largest (y, z) of the outline, meters.
    pub(crate) fn outline_bounds(&self) -> [DVec2; 2] {
        let mut lo = DVec2::splat(f64::INFINITY);
        let mut hi = DVec2::splat(f64::NEG_INFINITY);
        for bar in &self.bars {
            for p in &bar.core {
                lo = lo.min(*p - bar.half_width_m);
                hi = hi.max(*p + bar.half_width_m);
            }
        }
        [lo, hi]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_and_signed_distance_agree() {
        let tool = &super::super::tools()[4];
        for i in 0..400 {
            let p = DVec2::new(f64::from(i % 20) - 10.0, f64::from(i / 20) - 10.0) * 1e-3;
            match tool.height(p) {
                Some(h) => {
                    assert!(tool.signed_distance(DVec3::new(h, p.x, p.y)).abs() < 1e-9);
                    assert!(tool.signed_distance(DVec3::new(-h - 1e-4, p.x, p.y)) > 0.0);
                    assert!(tool.signed_distance(DVec3::new(h - 1e-4, p.x, p.y)) < 0.0);
                }
                None => assert!(tool.signed_distance(DVec3::new(0.0, p.x, p.y)) > 0.0),
            }
        }
    }
}
