//! The tools: bars that meet at a point, with bevelled rims, symmetric about the y-z plane.
//!
//! A tool is the solid `|x| <= height(y, z)`. Its outline is the union of bars (segments or filled convex cores
//! grown by a half width); towards the outline the height falls by a bevel. Everything else (mesh, signed
//! distance, what the fingers feel) follows from the distance of a point to that outline.

use std::sync::LazyLock;

use glam::{DVec2, DVec3, Vec2Swizzles};

use super::noise::{Noise, Stream};
use super::tool_mesh;
use crate::domain::mesh::TriMesh;

/// Edge length of the grid that a tool's mesh is cut from, meters.
const MESH_STEP_M: f64 = 0.0005;

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
    /// Whether the lab trains on it; unseen tools are for testing.
    pub seen: bool,
    /// The parts; the outline is their union.
    pub bars: Vec<Bar>,
    /// Half the extent along the closing axis x, meters.
    pub half_thickness_m: f64,
    /// Width of the bevel along the outline, meters.
    pub bevel_width_m: f64,
    /// How much lower the bevel is at the outline, meters.
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
    pub(super) fn height_at(&self, s: f64) -> f64 {
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
    pub fn outline_bounds(&self) -> [DVec2; 2] {
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

    /// The surface as a watertight mesh, meters, object frame.
    pub fn mesh(&self) -> TriMesh {
        tool_mesh::mesh(self, MESH_STEP_M)
    }
}

/// The lab's twelve tools (names from its data loader, shapes after the published images), seen ones first.
pub fn tools() -> &'static [ToolSpec] {
    static TOOLS: LazyLock<Vec<ToolSpec>> = LazyLock::new(lab_tools);
    &TOOLS
}

/// The direction `degrees` from +z towards +y.
fn direction(degrees: f64) -> DVec2 {
    DVec2::from_angle(degrees.to_radians()).yx()
}

/// A bar from the origin outwards.
fn arm(degrees: f64, length_mm: f64, width_mm: f64) -> Bar {
    line(degrees, 0.0, length_mm, width_mm)
}

/// A bar through the origin, from `back_mm` behind it to `front_mm` in front of it.
fn line(degrees: f64, back_mm: f64, front_mm: f64, width_mm: f64) -> Bar {
    let d = direction(degrees);
    Bar { core: vec![d * (-back_mm * 1e-3), d * (front_mm * 1e-3)], half_width_m: 0.5e-3 * width_mm }
}

fn tool(name: &str, seen: bool, bars: Vec<Bar>) -> ToolSpec {
    ToolSpec {
        name: name.to_owned(),
        seen,
        bars,
        half_thickness_m: 0.0115,
        bevel_width_m: 0.00125,
        bevel_depth_m: 0.0016,
    }
}

/// A closed chain of bars.
fn ring(corners_mm: &[[f64; 2]], width_mm: f64) -> Vec<Bar> {
    let point = |c: [f64; 2]| DVec2::new(c[0], c[1]) * 1e-3;
    (0..corners_mm.len())
        .map(|i| Bar {
            core: vec![point(corners_mm[i]), point(corners_mm[(i + 1) % corners_mm.len()])],
            half_width_m: 0.5e-3 * width_mm,
        })
        .collect()
}

fn lab_tools() -> Vec<ToolSpec> {
    vec![
        tool("pattern_01_2_lines_angle_1", true, vec![line(6.0, 29.0, 32.0, 3.7), line(34.0, 24.0, 20.0, 3.7)]),
        tool("pattern_02_2_lines_angle_2", true, vec![line(-32.0, 30.0, 24.0, 3.7), line(22.0, 22.0, 27.0, 3.7)]),
        tool("pattern_03_2_lines_angle_3", true, vec![line(-4.0, 27.0, 29.0, 3.7), line(80.0, 20.0, 24.0, 3.7)]),
        tool(
            "pattern_04_3_lines_angle_1",
            true,
            vec![arm(180.0, 33.0, 3.7), arm(62.0, 27.0, 3.7), arm(-58.0, 25.0, 3.7)],
        ),
        tool(
            "pattern_06_5_lines_angle_1",
            true,
            vec![
                arm(0.0, 29.0, 3.7),
                arm(72.0, 27.0, 3.7),
                arm(144.0, 27.0, 3.7),
                arm(-144.0, 29.0, 3.7),
                arm(-72.0, 17.0, 3.7),
            ],
        ),
        tool("pattern_31_rod", true, vec![line(0.0, 27.0, 27.0, 4.0)]),
        tool("pattern_32", true, vec![arm(166.0, 32.0, 3.7), arm(-152.0, 35.0, 3.7)]),
        tool("pattern_33", true, vec![arm(8.0, 33.0, 3.7), arm(70.0, 29.0, 3.7)]),
        tool(
            "pattern_37",
            true,
            vec![arm(24.0, 30.0, 3.7), arm(-28.0, 33.0, 3.7), arm(108.0, 21.0, 3.7), arm(-128.0, 25.0, 3.7)],
        ),
        tool(
            "pattern_05_3_lines_angle_2",
            false,
            vec![arm(182.0, 32.0, 3.7), arm(38.0, 29.0, 3.7), arm(-44.0, 25.0, 3.7)],
        ),
        tool("pattern_35", false, vec![arm(140.0, 29.0, 3.7), arm(-138.0, 32.0, 3.7), arm(0.0, 24.0, 3.7)]),
        tool("pattern_36", false, ring(&[[-12.0, 6.0], [1.0, -12.0], [9.0, 10.0]], 3.7)),
    ]
}

/// A tool drawn at random, for training on shapes that are not the lab's: 1 to 5 bars at random angles, lengths
/// and widths, as crosses, stars, chains, V-shapes and closed or filled triangles.
pub fn random_tool(seed: u64) -> ToolSpec {
    let mut noise = Noise::new(seed, Stream::Tool, 0);
    let width = noise.uniform(3.0, 5.0);
    let mut bars = Vec::new();
    match noise.below(20) {
        0..8 => {
            // lines that end at, or run through, a common point
            let count = 1 + noise.below(5);
            let through = noise.unit() < 0.45;
            let mut angle = noise.uniform(-180.0, 180.0);
            for _ in 0..count {
                let front = noise.uniform(12.0, 36.0);
                let back = if through || count == 1 { noise.uniform(5.0, 32.0) } else { 0.0 };
                bars.push(line(angle, back, front, width));
                angle += noise.uniform(22.0, if through { 90.0 } else { 125.0 });
            }
        }
        8..12 => {
            // V, sometimes with a third bar
            let angle = noise.uniform(-180.0, 180.0);
            let half = noise.uniform(14.0, 55.0);
            bars.push(arm(angle - half, noise.uniform(16.0, 36.0), width));
            bars.push(arm(angle + half, noise.uniform(16.0, 36.0), width));
            if noise.unit() < 0.4 {
                let turn = if noise.unit() < 0.5 { 0.0 } else { 180.0 };
                bars.push(arm(angle + turn + noise.uniform(-15.0, 15.0), noise.uniform(12.0, 32.0), width));
            }
        }
        12..15 => {
            // a star with jitter
            let count = 3 + noise.below(3);
            let first = noise.uniform(-180.0, 180.0);
            for i in 0..count {
                let angle = first + 360.0 * i as f64 / count as f64 + noise.uniform(-14.0, 14.0);
                bars.push(arm(angle, noise.uniform(12.0, 34.0), width));
            }
        }
        kind => {
            let angle = noise.uniform(-180.0, 180.0);
            let corners: Vec<[f64; 2]> = (0..3)
                .map(|i| {
                    let d = direction(angle - 120.0 * f64::from(i) + noise.uniform(-25.0, 25.0));
                    (d * noise.uniform(9.0, 22.0)).to_array()
                })
                .collect();
            if kind < 18 {
                bars = ring(&corners, width);
                if noise.unit() < 0.3 {
                    bars.pop();
                }
            } else {
                let core = corners.iter().map(|c| DVec2::from_array(*c) * 1e-3).collect::<Vec<_>>();
                let turn = (core[1] - core[0]).perp_dot(core[2] - core[0]);
                let core = if turn >= 0.0 { core } else { core.into_iter().rev().collect() };
                bars.push(Bar { core, half_width_m: 0.5e-3 * width });
            }
        }
    }
    // the bars of one tool rarely meet exactly at its origin
    let shift = DVec2::new(noise.uniform(-2.0, 2.0), noise.uniform(-2.0, 2.0)) * 1e-3;
    for p in bars.iter_mut().flat_map(|bar| &mut bar.core) {
        *p += shift;
    }
    let half_width_m = 0.5e-3 * width;
    ToolSpec {
        name: format!("random_{seed}"),
        seen: true,
        bars,
        half_thickness_m: noise.uniform(0.0095, 0.0125),
        bevel_width_m: half_width_m * noise.uniform(0.5, 0.85),
        bevel_depth_m: noise.uniform(0.001, 0.0025),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_labs() {
        let unseen: Vec<&str> = tools().iter().filter(|t| !t.seen).map(|t| t.name.as_str()).collect();
        assert_eq!(unseen, ["pattern_05_3_lines_angle_2", "pattern_35", "pattern_36"]);
        assert_eq!(tools().len(), 12);
    }

    #[test]
    fn every_mesh_is_watertight_and_lies_on_the_surface() {
        let randoms: Vec<ToolSpec> = (0..60).map(random_tool).collect();
        for tool in tools().iter().chain(&randoms) {
            let mesh = tool.mesh();
            assert!(mesh.is_watertight(), "{}", tool.name);
            assert!((500..60_000).contains(&mesh.triangles.len()), "{}: {}", tool.name, mesh.triangles.len());
            let mut worst = 0.0_f64;
            for i in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(i);
                for p in [a, b, c, (a + b + c) / 3.0] {
                    worst = worst.max(tool.signed_distance(p).abs());
                }
            }
            assert!(worst < 2.5e-4, "{}: a mesh point is {worst} m off the surface", tool.name);
            // the volume is positive only if the triangles face outwards
            let volume: f64 = (0..mesh.triangles.len())
                .map(|i| {
                    let [a, b, c] = mesh.corners(i);
                    a.dot(b.cross(c)) / 6.0
                })
                .sum();
            assert!(volume > 1e-7, "{}: volume {volume}", tool.name);
        }
    }

    #[test]
    fn height_and_signed_distance_agree() {
        let tool = &tools()[4];
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
