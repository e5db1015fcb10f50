//! Lines that give a scene its scale: a floor grid, the axes, the edges of a box.

use glam::DVec3;

use super::lines::Segment;

/// sRGB of the x, y and z axes.
pub const AXIS_COLORS: [[u8; 4]; 3] = [[226, 88, 80, 255], [108, 184, 92, 255], [84, 140, 236, 255]];

/// A square grid in the plane through `center` that `u` and `v` (unit vectors) span, `cells` cells of `spacing`
/// meters to each side. Every fifth line from the center is stronger. Empty if a number makes no sense.
pub fn grid(center: DVec3, [u, v]: [DVec3; 2], spacing: f64, cells: u32, rgb: [u8; 3]) -> Vec<Segment> {
    let cells = cells.min(500) as i32;
    let reach = spacing * f64::from(cells);
    if !(reach.is_finite() && reach > 0.0 && center.is_finite()) {
        return Vec::new();
    }
    let [r, g, b] = rgb;
    let line = |i: i32, across: DVec3, along: DVec3| {
        let middle = center + across * (f64::from(i) * spacing);
        let alpha = if i % 5 == 0 { 150 } else { 60 };
        Segment { ends: [middle - along * reach, middle + along * reach], rgba: [r, g, b, alpha] }
    };
    (-cells..=cells).flat_map(|i| [line(i, u, v), line(i, v, u)]).collect()
}

/// The axes x (red), y (green) and z (blue) at `origin`, `length` meters long, with arrow heads.
pub fn axes(origin: DVec3, length: f64) -> Vec<Segment> {
    let mut out = Vec::with_capacity(9);
    for (axis, rgba) in AXIS_COLORS.into_iter().enumerate() {
        let along = DVec3::AXES[axis] * length;
        let across = DVec3::AXES[(axis + 1) % 3] * (length * 0.05);
        let tip = origin + along;
        out.push(Segment { ends: [origin, tip], rgba });
        for side in [across, -across] {
            out.push(Segment { ends: [tip, origin + along * 0.86 + side], rgba });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn length(s: &Segment) -> f64 {
        (s.ends[1] - s.ends[0]).length()
    }

    #[test]
    fn lengths_and_counts() {
        let lines = grid(DVec3::ZERO, [DVec3::X, DVec3::Y], 0.005, 4, [90; 3]);
        assert_eq!(lines.len(), 18);
        assert!(lines.iter().all(|s| (length(s) - 0.04).abs() < 1e-15 && s.ends[0].z == 0.0));
        assert!(grid(DVec3::ZERO, [DVec3::X, DVec3::Y], f64::NAN, 4, [90; 3]).is_empty());
        assert_eq!(axes(DVec3::ZERO, 0.02).iter().filter(|s| s.ends[0] == DVec3::ZERO).count(), 3);
    }
}
