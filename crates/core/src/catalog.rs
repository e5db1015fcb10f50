//! The catalog of tools: the lab's twelve, and tools drawn at random.

mod household;
mod mesh;
mod shape;

use std::sync::LazyLock;

use glam::{DVec2, Vec2Swizzles};

use super::noise::{Noise, Stream};

pub use household::{CUP_AXIS_M, CUP_BASE_M, cup_handle, is_cup_handle, pencil};
pub use shape::{Bar, ToolSpec};

/// Length of shaft between the grasp and an ambiguous pair's pattern, meters: out of the GelSlim's 18 mm, within the
/// bubble's 74 mm.
const SHAFT_M: f64 = 0.018;
/// Ends the name of a tool that was put on a bare shaft.
const SHAFT_SUFFIX: &str = "_on_shaft";

/// The lab's twelve tools (names from its data loader, shapes after the published images), seen ones first.
pub fn tools() -> &'static [ToolSpec] {
    static TOOLS: LazyLock<Vec<ToolSpec>> = LazyLock::new(lab_tools);
    &TOOLS
}

/// The lab's tools, and after them what only a robot is tried with: a pencil, and a cup by its handle.
pub fn all_tools() -> &'static [ToolSpec] {
    static TOOLS: LazyLock<Vec<ToolSpec>> =
        LazyLock::new(|| tools().iter().cloned().chain([pencil(), cup_handle()]).collect());
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

/// The tool pushed towards the tip, on a bare shaft that reaches far back to the wrist; its name says so.
pub fn on_a_shaft(mut tool: ToolSpec) -> ToolSpec {
    let half_width_m = tool.bars.iter().map(|bar| bar.half_width_m).fold(0.0, f64::max);
    for p in tool.bars.iter_mut().flat_map(|bar| &mut bar.core) {
        p.y = if p.y < 0.0 { 0.2 * p.y } else { p.y } + SHAFT_M;
    }
    tool.bars.push(Bar { core: vec![DVec2::new(0.0, -0.07), DVec2::new(0.0, SHAFT_M)], half_width_m });
    tool.name += SHAFT_SUFFIX;
    tool
}

/// The name of the tool whose pattern `tool` carries: the same, or without the shaft it was put on.
pub fn pattern_of(tool: &str) -> &str {
    tool.strip_suffix(SHAFT_SUFFIX).unwrap_or(tool)
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
}
