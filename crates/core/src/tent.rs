//! The shape of a membrane that is pulled over a tool, on a grid over the y-z plane of the object frame.
//!
//! [`heights`] is the tool's top over the middle plane, seen along the closing axis. [`tent`] is the smallest sheet above
//! it whose curvature is nowhere greater than that of the free membrane: the solution of an obstacle problem (an upper
//! envelope). It depends on the tool and the free curvature alone, so it is made once, and what a membrane looks like at
//! a pose is a look-up.
//!
//! Left out: the rim of the membrane, and the air that the tool displaces.

use glam::{DVec2, DVec3};

use crate::mesh::TriMesh;
use crate::relax::{Field, Problem};

/// Spacing of the grid, meters.
pub(crate) const STEP_M: f64 = 0.5e-3;
/// Border around the tool, meters: how far a tent's skirt reaches.
const MARGIN_M: f64 = 0.024;
/// Half the largest side of the grid, meters, about the object's origin: no membrane is larger.
const REACH_M: f64 = 0.07;
/// Greatest height that counts, meters: higher than any finger opens, and far below what numbers cannot hold.
const HIGHEST_M: f64 = 0.05;
/// Grids of the solver, and sweeps on the finest. The error is below 0.1 mm (tested against many sweeps).
const LEVELS: usize = 5;
const SWEEPS: usize = 16;
/// Times that the curvature is corrected for the slopes it led to.
const BENDINGS: usize = 2;
/// Steeper sheets bend no more: near vertical one would hang over, which a height cannot say.
const STEEPEST: f32 = 1.6;

/// Heights over the middle plane, meters, on a grid of [`STEP_M`].
#[derive(Clone, Debug)]
pub(crate) struct Sheet {
    /// Row by row: y runs along a row, z over the rows.
    pub(crate) field: Field,
    /// `(y, z)` of node (0, 0), object frame, meters.
    pub(crate) origin: DVec2,
}

/// The top of a tool on the side of the middle plane where x has the sign of `side`, meters; 0 beside it and where it lies
/// on the other side. `None` if nothing of it is within 70 mm of the object's origin.
///
/// Holes, overlapping parts and inverted triangles do not matter; triangles with corners that are not finite are left out.
pub(crate) fn heights(mesh: &TriMesh, side: f64) -> Option<Sheet> {
    let corners = mesh.vertices.len();
    let triangles: Vec<[DVec3; 3]> = (0..mesh.triangles.len())
        .filter(|&i| mesh.triangles[i].iter().all(|&v| (v as usize) < corners))
        .map(|i| mesh.corners(i))
        .filter(|t| t.iter().all(|c| c.is_finite()))
        .collect();
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for corner in triangles.iter().flatten() {
        let yz = DVec2::new(corner.y, corner.z);
        (low, high) = (low.min(yz), high.max(yz));
    }
    let (low, high) = (low.max(DVec2::splat(-REACH_M)), high.min(DVec2::splat(REACH_M)));
    if !(low.x < high.x && low.y < high.y) {
        return None;
    }
    // Nodes at whole multiples of the spacing: the same heights for a tool and its mirror image.
    let first = ((low - MARGIN_M) / STEP_M).floor();
    let count = ((high + MARGIN_M) / STEP_M).ceil() - first + 1.0;
    let (columns, rows) = (count.x as usize, count.y as usize);
    let mut field = Field::filled(columns, rows, 0.0);
    let origin = first * STEP_M;
    for triangle in &triangles {
        let corner = triangle.map(|c| ((DVec2::new(c.y, c.z) - origin) / STEP_M, side.signum() * c.x));
        raise(&mut field, corner);
    }
    Some(Sheet { field, origin })
}

/// Raises the nodes under a triangle, whose corners are given as (place in nodes, height).
fn raise(field: &mut Field, [(a, ha), (b, hb), (c, hc)]: [(DVec2, f64); 3]) {
    /// Nodes this close to an edge, as a share of the triangle, count as under it.
    const TOUCH: f64 = 1e-9;
    let area = (b - a).perp_dot(c - a);
    if area.abs() < 1e-12 {
        return;
    }
    let last = DVec2::new((field.columns - 1) as f64, (field.rows - 1) as f64);
    let low = a.min(b).min(c).ceil().max(DVec2::ZERO);
    let high = a.max(b).max(c).floor().min(last);
    if low.x > high.x || low.y > high.y {
        return;
    }
    for row in low.y as usize..=high.y as usize {
        for column in low.x as usize..=high.x as usize {
            let p = DVec2::new(column as f64, row as f64);
            let (wb, wc) = ((p - a).perp_dot(c - a) / area, (b - a).perp_dot(p - a) / area);
            if wb >= -TOUCH && wc >= -TOUCH && wb + wc <= 1.0 + TOUCH {
                let height = (ha + (hb - ha) * wb + (hc - ha) * wc).min(HIGHEST_M) as f32;
                let node = &mut field.values[row * field.columns + column];
                *node = node.max(height);
            }
        }
    }
}

/// The smallest sheet over `heights` that touches the middle plane elsewhere and bends by at most `curvature` (the
/// Laplacian of the free membrane's height, 1/m).
///
/// A sheet under pressure bends by that where it is flat and by `(1 + slope^2)^1.5` times as much where it is steep.
pub(crate) fn tent(heights: &Sheet, curvature: f64) -> Sheet {
    let obstacle = &heights.field;
    let free = vec![true; obstacle.values.len()];
    let load = -curvature as f32;
    let plain = Problem { obstacle, free: &free, load, more: None, stiffness: 0.0, step: STEP_M as f32 };
    let mut field = plain.solve(LEVELS, SWEEPS);
    for _ in 0..BENDINGS {
        let more = bending(&field, load);
        let bent = Problem { more: Some(&more), ..plain };
        bent.relax(&mut field, SWEEPS);
    }
    Sheet { field, origin: heights.origin }
}

/// Addition of a sheet's slopes to its load.
fn bending(sheet: &Field, load: f32) -> Field {
    let (columns, rows) = (sheet.columns, sheet.rows);
    let mut more = Field::filled(columns, rows, 0.0);
    let scale = 0.5 / STEP_M as f32;
    for row in 1..rows.saturating_sub(1) {
        for k in row * columns + 1..(row + 1) * columns - 1 {
            let w = &sheet.values;
            let (y, z) = ((w[k + 1] - w[k - 1]) * scale, (w[k + columns] - w[k - columns]) * scale);
            let square = (y * y + z * z).min(STEEPEST * STEEPEST);
            more.values[k] = load * ((1.0 + square) * (1.0 + square).sqrt() - 1.0);
        }
    }
    more
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::testing::{cross, cuboid};

    /// The same equation by plain sweeps, until nothing moves.
    fn slow(heights: &Sheet, curvature: f64) -> Field {
        let mut field = Field::filled(heights.field.columns, heights.field.rows, 0.0);
        let free = vec![true; field.values.len()];
        for _ in 0..8 {
            let more = bending(&field, -curvature as f32);
            let problem = Problem {
                obstacle: &heights.field,
                free: &free,
                load: -curvature as f32,
                more: Some(&more),
                stiffness: 0.0,
                step: STEP_M as f32,
            };
            problem.relax(&mut field, 600);
        }
        field
    }

    #[test]
    fn few_sweeps_are_enough() {
        let heights = heights(&cross(), -1.0).unwrap();
        for curvature in [20.0, 60.0] {
            let (fast, slow) = (tent(&heights, curvature).field, slow(&heights, curvature));
            let error = |(a, b): (&f32, &f32)| (a - b).abs();
            let worst = fast.values.iter().zip(&slow.values).map(error).fold(0.0, f32::max);
            assert!(worst < 1.5e-4, "{curvature}: {worst}");
            assert!(fast.values.iter().zip(&heights.field.values).all(|(sheet, height)| sheet >= height));
        }
    }

    #[test]
    fn the_skirt_of_a_low_wall_is_a_parabola() {
        let (height, curvature) = (5e-4, 20.0);
        let wall = cuboid(DVec3::ZERO, DVec3::new(height, 0.004, 0.06));
        let sheet = tent(&heights(&wall, 1.0).unwrap(), curvature);
        let reach = (2.0 * height / curvature).sqrt();
        let row = ((0.0 - sheet.origin.y) / STEP_M).round() as usize;
        for column in 0..sheet.field.columns {
            let y = (sheet.origin.x + column as f64 * STEP_M).abs() - 0.004;
            let expected = if y <= 0.0 { height } else { 0.5 * curvature * (reach - y).max(0.0).powi(2) };
            let found = f64::from(sheet.field.values[row * sheet.field.columns + column]);
            assert!((found - expected).abs() < 4e-5, "{y}: {found} {expected}");
        }
    }

    #[test]
    fn each_side_has_its_own_heights_and_what_is_broken_none() {
        let block = cuboid(DVec3::new(0.002, 0.01, 0.0), DVec3::new(0.003, 0.004, 0.006));
        let top = |side| heights(&block, side).unwrap().field.values.iter().copied().fold(0.0, f32::max);
        assert!((top(1.0) - 0.005).abs() < 1e-7 && (top(-1.0) - 0.001).abs() < 1e-7);
        assert!(heights(&TriMesh::default(), 1.0).is_none());
        let far = cuboid(DVec3::new(0.0, 1.0, 0.0), DVec3::splat(0.01));
        assert!(heights(&far, 1.0).is_none());
        let mut broken = block.clone();
        broken.vertices.iter_mut().for_each(|v| v.y = f64::NAN);
        broken.triangles.push([0, 1, 99]);
        assert!(heights(&broken, 1.0).is_none());
        let huge = cuboid(DVec3::ZERO, DVec3::splat(1e9));
        let sheet = tent(&heights(&huge, 1.0).unwrap(), 20.0);
        assert!(sheet.field.values.len() < 250_000 && sheet.field.values.iter().all(|v| v.is_finite()));
    }
}
