//! The catalog of tools: the lab's twelve, and tools drawn at random.

mod bend;
mod mesh;
mod shape;

use std::sync::LazyLock;

use glam::DVec2;

use super::noise::{Noise, Stream};

pub use shape::{Bar, Section, Solid, ToolSpec};

/// Length of shaft between the grasp and an ambiguous pair's pattern, meters: out of the GelSlim's 18 mm, within the
/// bubble's 74 mm.
const SHAFT_M: f64 = 0.027;
/// Share of a pattern's length behind the grasp that is left before the shaft.
const BEHIND: f64 = 0.1;
/// Ends the name of a tool that was put on a bare shaft.
const SHAFT_SUFFIX: &str = "_on_shaft";

/// Half the width of the lab's bars, which is the radius of their crowns, meters.
const LAB_HALF_WIDTH_M: f64 = 0.0075;
/// Section of the lab's bars.
const LAB_SECTION: Section = Section::Crown { bead_m: 0.001 };
/// Length of the lab's bars from the object's origin, mm.
const LAB_ARM_MM: f64 = 30.0;
/// Radius that the lab rounds the outer corner of its tools of two arms with, meters.
const LAB_ROUNDING_M: f64 = 0.005;

/// The lab's twelve tools (names from its data loader, shapes after the published images), seen ones first.
pub fn tools() -> &'static [ToolSpec] {
    static TOOLS: LazyLock<Vec<ToolSpec>> = LazyLock::new(lab_tools);
    &TOOLS
}

/// Point `length_mm` from the origin, `degrees` from +y towards +z, meters.
fn polar(degrees: f64, length_mm: f64) -> DVec2 {
    DVec2::from_angle(degrees.to_radians()) * (length_mm * 1e-3)
}

/// A tool of the lab: bars through the origin, from it outwards, and pairs of arms that meet there in a rounded corner, at
/// angles in degrees.
fn lab_tool(name: &str, seen: bool, through: &[f64], arms: &[f64], corner: Option<[f64; 2]>) -> ToolSpec {
    let at = |degrees: f64| polar(degrees, LAB_ARM_MM);
    let straight = |from, to| Bar::straight(from, to, LAB_HALF_WIDTH_M);
    let mut bars: Vec<Bar> = through.iter().map(|&a| straight(-at(a), at(a))).collect();
    bars.extend(arms.iter().map(|&a| straight(DVec2::ZERO, at(a))));
    bars.extend(corner.map(|[a, b]| Bar {
        path: vec![at(a), DVec2::ZERO, at(b)],
        half_width_m: LAB_HALF_WIDTH_M,
        rounding_m: LAB_ROUNDING_M,
    }));
    ToolSpec {
        name: name.to_owned(),
        seen,
        bars,
        plates: Vec::new(),
        section: LAB_SECTION,
        half_thickness_m: 0.0185,
        middle_x_m: -0.004,
    }
}

/// Names and geometry are those of the CAD models that the lab published.
fn lab_tools() -> Vec<ToolSpec> {
    vec![
        lab_tool("pattern_01_2_lines_angle_1", true, &[0.0, 30.0], &[], None),
        lab_tool("pattern_02_2_lines_angle_2", true, &[0.0, -60.0], &[], None),
        lab_tool("pattern_03_2_lines_angle_3", true, &[0.0, 90.0], &[], None),
        lab_tool("pattern_04_3_lines_angle_1", true, &[], &[-90.0, 30.0, 150.0], None),
        lab_tool("pattern_06_5_lines_angle_1", true, &[], &[90.0, 18.0, -54.0, -126.0, 162.0], None),
        lab_tool("pattern_31_rod", true, &[90.0], &[], None),
        lab_tool("pattern_32", true, &[], &[], Some([-90.0, -60.0])),
        lab_tool("pattern_33", true, &[], &[], Some([-90.0, -45.0])),
        lab_tool("pattern_37", true, &[90.0], &[135.0, -135.0], None),
        lab_tool("pattern_05_3_lines_angle_2", false, &[], &[180.0, 30.0, -120.0], None),
        lab_tool("pattern_35", false, &[], &[], Some([-90.0, 0.0])),
        lab_tool("pattern_36", false, &[0.0], &[90.0], None),
    ]
}

/// A tool drawn at random, for training on shapes that are not the lab's: one to five bars at any angles, curved bars,
/// polygons and disks.
pub fn random_tool(seed: u64) -> ToolSpec {
    let mut noise = Noise::new(seed, Stream::Tool, 0);
    let flat = noise.unit() < 0.15;
    let half_width_m = if flat { noise.uniform(0.002, 0.007) } else { noise.uniform(0.004, 0.01) };
    let section = if flat {
        Section::Bevel { width_m: half_width_m * noise.uniform(0.1, 0.8), depth_m: noise.uniform(0.0005, 0.0025) }
    } else {
        Section::Crown { bead_m: if noise.unit() < 0.25 { 0.0 } else { noise.uniform(0.0005, 0.0015) } }
    };
    let mut tool = ToolSpec {
        name: format!("random_{seed}"),
        seen: true,
        bars: Vec::new(),
        plates: Vec::new(),
        section,
        half_thickness_m: noise.uniform(0.0155, 0.0205),
        middle_x_m: noise.uniform(-0.005, 0.005),
    };
    match noise.below(20) {
        0..12 => tool.bars = random_arms(&mut noise, half_width_m),
        12..16 => tool.bars = vec![random_curve(&mut noise, half_width_m)],
        kind => {
            tool.section =
                Section::Bevel { width_m: noise.uniform(0.0003, 0.002), depth_m: noise.uniform(0.0003, 0.002) };
            let corners = if kind < 18 { 3 + noise.below(4) } else { 16 };
            let semi = [noise.uniform(7.0, 23.0), noise.uniform(7.0, 23.0)];
            let turn = noise.uniform(-180.0, 180.0);
            let corner = |i: usize| {
                let [y, z] = (polar(360.0 * i as f64 / corners as f64, 1.0) * DVec2::from_array(semi)).to_array();
                DVec2::from_angle(turn.to_radians()).rotate(DVec2::new(y, z))
            };
            tool.plates = vec![(0..corners).map(corner).collect()];
        }
    }
    // Not every tool is held where its bars meet.
    let shift = DVec2::new(noise.uniform(-3.0, 3.0), noise.uniform(-3.0, 3.0)) * 1e-3;
    for p in tool.points_mut() {
        *p += shift;
    }
    tool
}

/// One to five arms that meet at the origin; some run through it.
fn random_arms(noise: &mut Noise, half_width_m: f64) -> Vec<Bar> {
    /// Least angle between two arms, degrees.
    const APART: f64 = 25.0;
    let count = 1 + noise.below(5);
    // Round angles as well as any: the gaps between the arms fill the circle, each with its least.
    let shares: Vec<f64> = (0..count).map(|_| noise.uniform(0.05, 1.0)).collect();
    let free = (360.0 - APART * count as f64) / shares.iter().sum::<f64>();
    let gaps: Vec<f64> = shares.iter().map(|share| APART + share * free).collect();
    // The first two arms lie beside the widest gap.
    let widest = (0..count).max_by(|&a, &b| gaps[a].total_cmp(&gaps[b])).unwrap_or(0);
    let mut angle = noise.uniform(-180.0, 180.0);
    let mut ends = Vec::new();
    for i in 0..count {
        ends.push(polar(angle, noise.uniform(18.0, 36.0)));
        angle += gaps[(widest + 1 + i) % count];
    }
    if count == 1 || noise.unit() < 0.35 {
        return ends
            .iter()
            .map(|&end| Bar::straight(-end.normalize() * noise.uniform(0.012, 0.036), end, half_width_m))
            .collect();
    }
    let rounding_m = half_width_m * noise.uniform(0.3, 1.0);
    let corner = Bar { path: vec![ends[0], DVec2::ZERO, ends[count - 1]], half_width_m, rounding_m };
    let others = ends[1..count - 1].iter().map(|&end| Bar::straight(DVec2::ZERO, end, half_width_m));
    std::iter::once(corner).chain(others).collect()
}

/// A bar with a round bend between two straight legs.
fn random_curve(noise: &mut Noise, half_width_m: f64) -> Bar {
    /// Angle between two points of the bend, degrees.
    const STEP: f64 = 10.0;
    let radius_mm = noise.uniform(1e3 * half_width_m + 2.0, 24.0);
    let steps = (noise.uniform(30.0, 160.0) / STEP).round();
    let mut angle = noise.uniform(-180.0, 180.0);
    let turn = if noise.unit() < 0.5 { STEP } else { -STEP };
    let mut at = polar(angle, -noise.uniform(0.0, 15.0));
    let mut path = vec![at - polar(angle, noise.uniform(10.0, 30.0)), at];
    for _ in 0..steps as usize {
        angle += 0.5 * turn;
        at += polar(angle, 2.0 * radius_mm * (0.5 * STEP).to_radians().sin());
        angle += 0.5 * turn;
        path.push(at);
    }
    path.push(at + polar(angle, noise.uniform(10.0, 30.0)));
    Bar { path, half_width_m, rounding_m: 0.0 }
}

/// The tool pushed towards the tip, on a bare shaft that reaches far back to the wrist; its name says so.
pub fn on_a_shaft(mut tool: ToolSpec) -> ToolSpec {
    let half_width_m = tool.bars.iter().map(|bar| bar.half_width_m).fold(0.0, f64::max);
    let half_width_m = if half_width_m > 0.0 { half_width_m } else { LAB_HALF_WIDTH_M };
    for p in tool.points_mut() {
        p.y = if p.y < 0.0 { BEHIND * p.y } else { p.y } + SHAFT_M;
    }
    tool.bars.push(Bar::straight(DVec2::new(0.0, -0.07), DVec2::new(0.0, SHAFT_M), half_width_m));
    tool.name += SHAFT_SUFFIX;
    tool
}

/// The name of the tool whose pattern `tool` carries: the same, or without the shaft it was put on.
pub fn pattern_of(tool: &str) -> &str {
    tool.strip_suffix(SHAFT_SUFFIX).unwrap_or(tool)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Volumes (mm^3), and the highest z (mm), of the models that the lab published.
    #[test]
    fn the_labs_tools_are_as_large_as_the_labs_models() {
        let labs = [
            (44_058.0, 21.5),
            (49_767.0, 29.73),
            (50_812.0, 30.0),
            (40_248.0, 21.5),
            (60_339.0, 30.0),
            (28_778.0, 30.0),
            (27_004.0, 14.33),
            (27_870.0, 11.03),
            (47_724.0, 30.0),
            (39_342.0, 21.5),
            (28_623.0, 7.5),
            (39_795.0, 30.0),
        ];
        for (tool, (volume, top)) in tools().iter().zip(labs) {
            let mesh = tool.mesh();
            let [lo, hi] = mesh.bounds().unwrap().map(|p| p * 1e3);
            assert!((mesh.volume() * 1e9 / volume - 1.0).abs() < 0.005, "{}: {}", tool.name, mesh.volume() * 1e9);
            assert!((hi.z - top).abs() < 0.02, "{}: {}", tool.name, hi.z);
            assert!((lo.x + 22.5).abs() < 0.02 && (hi.x - 14.5).abs() < 0.02, "{}: {lo} {hi}", tool.name);
        }
    }

    #[test]
    fn meshes_are_watertight_and_lie_on_the_surface() {
        let randoms: Vec<ToolSpec> = (0..40).map(random_tool).collect();
        for tool in tools().iter().chain(&randoms) {
            let mesh = tool.mesh();
            // Where an arc of a drawn tool just misses a corner two walls may share an edge.
            assert!(mesh.is_watertight() || !tools().contains(tool), "{}", tool.name);
            assert!((500..150_000).contains(&mesh.triangles.len()), "{}: {}", tool.name, mesh.triangles.len());
            let (solid, mut worst) = (tool.solid(), 0.0_f64);
            for i in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(i);
                for p in [a, b, c, (a + b + c) / 3.0] {
                    worst = worst.max(solid.signed_distance(p - DVec3::X * tool.middle_x_m).abs());
                }
            }
            // Where a bar of a drawn tool ends on another's flank the step is a slope of one cell.
            let most = if tool.name.starts_with("random") { 1.2e-3 } else { 1.2e-4 };
            assert!(worst < most, "{}: a mesh point is {worst} m off the surface", tool.name);
            // Positive only if the triangles face outwards.
            let volume = mesh.volume();
            assert!(volume > 1e-7, "{}: volume {volume}", tool.name);
        }
    }
}
