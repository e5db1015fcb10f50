//! Tools drawn at random, for training on shapes that are not the lab's.

use glam::DVec2;
use touch2touch_core::catalog::{Bar, Section, ToolSpec};
use touch2touch_core::noise::{Noise, Stream};

/// Point `length_mm` from the origin, `degrees` from +y towards +z, meters.
fn polar(degrees: f64, length_mm: f64) -> DVec2 {
    DVec2::from_angle(degrees.to_radians()) * (length_mm * 1e-3)
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
    for p in tool.bars.iter_mut().flat_map(|bar| &mut bar.path).chain(tool.plates.iter_mut().flatten()) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn meshes_lie_on_the_surface_and_face_outwards() {
        for tool in (0..40).map(random_tool) {
            let (mesh, solid, mut worst) = (tool.mesh(), tool.solid(), 0.0_f64);
            assert!((500..150_000).contains(&mesh.triangles.len()), "{}: {}", tool.name, mesh.triangles.len());
            for i in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(i);
                for p in [a, b, c, (a + b + c) / 3.0] {
                    worst = worst.max(solid.signed_distance(p - DVec3::X * tool.middle_x_m).abs());
                }
            }
            // Where a bar ends on another's flank the step is a slope of one cell.
            assert!(worst < 1.2e-3, "{}: a mesh point is {worst} m off the surface", tool.name);
            assert!(mesh.volume() > 1e-7, "{}: volume {}", tool.name, mesh.volume());
        }
    }
}
