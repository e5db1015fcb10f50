//! The catalog of tools: the lab's twelve, plain and on a bare shaft.

mod bend;
mod mesh;
mod shape;

use std::sync::LazyLock;

use glam::DVec2;

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
        for tool in tools() {
            let mesh = tool.mesh();
            assert!(mesh.is_watertight(), "{}", tool.name);
            assert!((500..150_000).contains(&mesh.triangles.len()), "{}: {}", tool.name, mesh.triangles.len());
            let (solid, mut worst) = (tool.solid(), 0.0_f64);
            for i in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(i);
                for p in [a, b, c, (a + b + c) / 3.0] {
                    worst = worst.max(solid.signed_distance(p - DVec3::X * tool.middle_x_m).abs());
                }
            }
            assert!(worst < 1.2e-4, "{}: a mesh point is {worst} m off the surface", tool.name);
            // Positive only if the triangles face outwards.
            let volume = mesh.volume();
            assert!(volume > 1e-7, "{}: volume {volume}", tool.name);
        }
    }
}
