//! The shape of a membrane that is pressed onto a tool, on a grid over the y-z plane of the object frame.
//!
//! [`heights`] is the tool's top over the middle plane, seen along the closing axis. A membrane over it is the smallest sheet
//! that bends nowhere more than the free membrane does: the solution of an obstacle problem (an upper envelope). It depends on
//! the tool and the free membrane alone, so it is made once, and what a membrane looks like at a pose is a look-up.
//!
//! A membrane that reaches the middle plane when nothing is held stands as a [`tent`] on that plane, where the other finger's
//! membrane begins. One that does not, as the lab's, hangs in facets from crest to crest and leads on to its rim: it is
//! [`lifted`] from its free shape.
//!
//! Left out: the free membrane moves with the hand and not with the tool, which lengths of some millimeters do not show; the
//! rim's true outline, growing tension, and the air that the tool displaces.

use glam::DVec2;

use crate::frames::PlanarPose;
use crate::mesh::TriMesh;
use crate::relax::{Field, Problem};

/// Spacing of the grid, meters.
pub(crate) const STEP_M: f64 = 0.5e-3;
/// Half the side of the grid, meters, about the object's origin: no membrane is larger.
const REACH_M: f64 = 0.07;
/// Greatest height that counts, meters: higher than any finger opens, and far below what numbers cannot hold.
const HIGHEST_M: f64 = 0.05;
/// Grids of the solver, and sweeps on the finest. The error is below 0.1 mm (tested against many sweeps).
const LEVELS: usize = 5;
const SWEEPS: usize = 16;
/// Radius at which a membrane hangs from its free shape, meters. It matters little: 55 mm give the same poses.
const RIM_M: f64 = 0.065;
/// Times that the curvature is corrected for the slopes it led to.
const BENDINGS: usize = 2;
/// Steeper sheets bend no more: near vertical one would hang over, which a height cannot say.
const STEEPEST: f32 = 1.6;
/// Bending of the membrane during a touch over that of the free one: the pressure rises.
const PRESSED: f64 = 1.15;

/// Heights over the middle plane, meters, on a grid.
#[derive(Clone, Debug)]
pub(crate) struct Sheet {
    /// Row by row: y runs along a row, z over the rows.
    pub(crate) field: Field,
    /// `(y, z)` of node (0, 0), object frame, meters.
    pub(crate) origin: DVec2,
    /// Spacing of the nodes, meters.
    pub(crate) step_m: f64,
}

impl Sheet {
    /// Every second node.
    pub(crate) fn thinned(&self) -> Self {
        Self { field: self.field.thinned(), step_m: 2.0 * self.step_m, ..*self }
    }
}

/// The top of a tool on the side of the middle plane where x has the sign of `side`, meters; 0 beside it and where it lies
/// on the other side. `None` if nothing of it is within 70 mm of the object's origin.
///
/// Holes, overlapping parts and inverted triangles do not matter; triangles with corners that are not finite are left out.
pub(crate) fn heights(mesh: &TriMesh, side: f64) -> Option<Sheet> {
    let triangles = mesh.sound_triangles();
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
    let first = DVec2::splat(-(REACH_M / STEP_M).floor());
    let count = 1.0 - 2.0 * first;
    let (columns, rows) = (count.x as usize, count.y as usize);
    let mut field = Field::filled(columns, rows, 0.0);
    let origin = first * STEP_M;
    for triangle in &triangles {
        let corner = triangle.map(|c| ((DVec2::new(c.y, c.z) - origin) / STEP_M, side.signum() * c.x));
        raise(&mut field, corner);
    }
    Some(Sheet { field, origin, step_m: STEP_M })
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

/// The free membrane of a closed gripper: its height over the middle plane about the grasp's origin, meters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FreeShape {
    /// Height at the origin, meters.
    pub(crate) height_m: f64,
    /// Slopes along y and z there.
    pub(crate) slope: DVec2,
    /// Second derivatives along y and z, 1/m.
    pub(crate) bend: DVec2,
    /// True where it reaches the middle plane.
    pub(crate) reaches: bool,
    /// The pose of the tool under it, `grasp_from_object`.
    pub(crate) of: PlanarPose,
}

impl FreeShape {
    /// Height over the middle plane at a place of the object frame, meters.
    fn at(&self, yz: DVec2) -> f64 {
        let yz = self.of.transform_yz(yz);
        self.height_m + self.slope.dot(yz) + 0.5 * self.bend.dot(yz * yz)
    }
}

/// Height over the free membrane, and over the middle plane where that reaches beyond it, of the smallest sheet over `heights`
/// and the middle plane that hangs from the free membrane at the rim.
pub(crate) fn lifted(heights: &Sheet, free: &FreeShape) -> Sheet {
    let (columns, rows) = (heights.field.columns, heights.field.rows);
    let place = |k: usize| heights.origin + DVec2::new((k % columns) as f64, (k / columns) as f64) * heights.step_m;
    let dome: Vec<f32> = (0..columns * rows).map(|k| free.at(place(k)) as f32).collect();
    let within: Vec<bool> = (0..columns * rows).map(|k| free.of.transform_yz(place(k)).length() < RIM_M).collect();
    let mut obstacle = Field::filled(columns, rows, f32::NEG_INFINITY);
    for k in (0..columns * rows).filter(|k| within[*k]) {
        obstacle.values[k] = heights.field.values[k] - dome[k];
    }
    // About the free membrane the sheet bends by the rest.
    let load = ((1.0 - PRESSED) * (free.bend.x + free.bend.y)) as f32;
    let problem =
        Problem { obstacle: &obstacle, free: &within, load, more: None, stiffness: 0.0, step: heights.step_m as f32 };
    let mut field = problem.solve(LEVELS, SWEEPS);
    for (k, lifted) in field.values.iter_mut().enumerate() {
        *lifted = if within[k] { *lifted + dome[k].min(0.0) } else { 0.0 };
    }
    Sheet { field, ..*heights }
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
    Sheet { field, ..*heights }
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
    use crate::align::testing::cuboid;
    use glam::DVec3;

    const HERE: PlanarPose = PlanarPose { theta_rad: 0.0, y_m: 0.0, z_m: 0.0 };
    /// A membrane like the first simulator's, which reaches the middle plane, and one like the lab's, which does not.
    const SHAPES: [FreeShape; 2] = [
        FreeShape {
            height_m: -0.7e-3,
            slope: DVec2::new(0.0, -0.04),
            bend: DVec2::new(14.0, 7.0),
            reaches: true,
            of: HERE,
        },
        FreeShape {
            height_m: 7e-3,
            slope: DVec2::new(0.0, 0.17),
            bend: DVec2::new(18.0, 12.0),
            reaches: false,
            of: HERE,
        },
    ];

    #[test]
    fn the_skirt_of_a_low_wall_is_a_parabola() {
        let (height, curvature) = (5e-4, 20.0);
        let wall = cuboid(DVec3::ZERO, DVec3::new(height, 0.004, 0.06));
        // Pressed far beyond the middle plane.
        let free = FreeShape { height_m: -0.03, bend: DVec2::splat(0.5 * curvature / PRESSED), ..FreeShape::default() };
        let sheet = lifted(&heights(&wall, 1.0).unwrap(), &free);
        let reach = (2.0 * height / curvature).sqrt();
        let row = ((0.0 - sheet.origin.y) / STEP_M).round() as usize;
        for column in 60..sheet.field.columns - 60 {
            let y = (sheet.origin.x + column as f64 * STEP_M).abs() - 0.004;
            let expected = if y <= 0.0 { height } else { 0.5 * curvature * (reach - y).max(0.0).powi(2) };
            let found = f64::from(sheet.field.values[row * sheet.field.columns + column]);
            assert!((found - expected).abs() < 4e-5, "{y}: {found} {expected}");
        }
    }

    #[test]
    fn a_deep_membrane_hangs_from_bar_to_bar_and_does_not_reach_its_free_shape_beside() {
        let bar = |y| cuboid(DVec3::new(0.0, y, 0.0), DVec3::new(0.0185, 0.002, 0.03));
        let mut bars = bar(-0.008);
        let other = bar(0.008);
        let first = bars.vertices.len() as u32;
        bars.vertices.extend(other.vertices);
        bars.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
        let [_, free] = SHAPES;
        let sheet = lifted(&heights(&bars, 1.0).unwrap(), &free);
        let height = |y: f64| {
            let at = (DVec2::new(y, 0.0) - sheet.origin) / STEP_M;
            sheet.field.at(at.x, at.y) + free.at(DVec2::new(y, 0.0))
        };
        let [on, between, beside] = [0.008, 0.0, 0.024].map(height);
        assert!((on - 0.0185).abs() < 1e-5 && between > on - 2e-3 && between < on, "{on} {between}");
        assert!(beside > free.at(DVec2::new(0.024, 0.0)) + 2e-3, "lifted far beside the tool: {beside}");
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
        let sheet = lifted(&heights(&huge, 1.0).unwrap(), &SHAPES[0]);
        assert!(sheet.field.values.len() < 250_000 && sheet.field.values.iter().all(|v| v.is_finite()));
    }
}
