//! The shape of a membrane that is pressed onto a tool, on a grid over the y-z plane of the object frame.
//!
//! [`heights`] is the tool's top over the middle plane, seen along the closing axis. A membrane over it is the smallest sheet
//! that bends nowhere more than the free membrane does: the solution of an obstacle problem (an upper envelope).
//!
//! A membrane that reaches the middle plane when nothing is held stands as a [`tent`] on that plane, where the other finger's
//! membrane begins: it depends on the tool alone. One that does not, as the lab's, hangs in facets from crest to crest and leads
//! on to its rim: it is [`lifted`] from its free shape, and depends, little, on the pose of the tool under it. Made for one pose
//! it is looked up at those about it.
//!
//! Left out: the rim's true outline, growing tension, and the air that the tool displaces.

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
/// Radius at which a membrane hangs from its free shape, meters. It matters little: 75 mm give the same poses.
const RIM_M: f64 = 0.055;
/// Least nodes along a side of what is solved, where the rim lies beyond the tool's grid.
const MIN_NODES: f64 = 16.0;
/// Steeper sheets bend no more: near vertical one would hang over, which a height cannot say.
const STEEPEST: f32 = 1.6;
/// Bending of the membrane during a touch over that of the free one: the pressure rises.
const PRESSED: f32 = 1.15;

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
        Self { field: self.field.coarser(0), step_m: 2.0 * self.step_m, ..*self }
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
    /// Height over the middle plane at a place of the grasp frame, meters.
    fn at(&self, yz: DVec2) -> f64 {
        self.height_m + self.slope.dot(yz) + 0.5 * self.bend.dot(yz * yz)
    }
}

/// Height over the free membrane, and over the middle plane where that reaches beyond it, of the smallest sheet over `heights`
/// and the middle plane that hangs from the free membrane at the rim. Of the nodes within the rim alone.
pub(crate) fn lifted(heights: &Sheet, free: &FreeShape) -> Sheet {
    let step_m = heights.step_m;
    let middle = free.of.inverse().transform_yz(DVec2::ZERO);
    let last = DVec2::new((heights.field.columns - 1) as f64, (heights.field.rows - 1) as f64);
    let low = ((middle - RIM_M - heights.origin) / step_m).floor().clamp(DVec2::ZERO, last - MIN_NODES);
    let high = ((middle + RIM_M - heights.origin) / step_m).ceil().clamp(low + MIN_NODES, last);
    let (columns, rows) = ((high.x - low.x) as usize + 1, (high.y - low.y) as usize + 1);
    let origin = heights.origin + low * step_m;
    let (across, first) = (DVec2::from_angle(free.of.theta_rad) * step_m, free.of.transform_yz(origin));
    let mut obstacle = Field::filled(columns, rows, f32::NEG_INFINITY);
    let (mut dome, mut within) = (Field::filled(columns, rows, 0.0), vec![false; columns * rows]);
    for row in 0..rows {
        let first = first + across.perp() * row as f64;
        let tops = &heights.field.values[(low.y as usize + row) * heights.field.columns + low.x as usize..][..columns];
        for (column, top) in tops.iter().enumerate() {
            let (k, place) = (row * columns + column, first + across * column as f64);
            dome.values[k] = free.at(place) as f32;
            within[k] = place.length_squared() < RIM_M * RIM_M;
            if within[k] {
                obstacle.values[k] = top - dome.values[k];
            }
        }
    }
    // About the free membrane the sheet bends by the rest.
    let bend = (free.bend.x + free.bend.y) as f32;
    let load = (1.0 - PRESSED) * bend;
    let problem = Problem { obstacle: &obstacle, free: &within, load, more: None, stiffness: 0.0, step: step_m as f32 };
    let mut field = solved(&problem, &dome, -PRESSED * bend);
    for ((lifted, dome), within) in field.values.iter_mut().zip(&dome.values).zip(&within) {
        *lifted = if *within { *lifted + dome.min(0.0) } else { 0.0 };
    }
    Sheet { field, origin, step_m }
}

/// The smallest sheet over `heights` that touches the middle plane elsewhere and bends by at most `curvature` (the
/// Laplacian of the free membrane's height, 1/m).
pub(crate) fn tent(heights: &Sheet, curvature: f64) -> Sheet {
    let (obstacle, load) = (&heights.field, -curvature as f32);
    let free = vec![true; obstacle.values.len()];
    let problem = Problem { obstacle, free: &free, load, more: None, stiffness: 0.0, step: heights.step_m as f32 };
    let plane = Field::filled(obstacle.columns, obstacle.rows, 0.0);
    Sheet { field: solved(&problem, &plane, load), ..*heights }
}

/// The solution of a problem about a dome, with the pressure's whole load where the sheet is steep.
fn solved(fine: &Problem<'_>, dome: &Field, pressure: f32) -> Field {
    let (obstacle, free) = fine.coarser(0);
    let coarse = Problem { obstacle: &obstacle, free: &free, step: 2.0 * fine.step, ..*fine };
    let mut field = coarse.solve(LEVELS - 1, 2 * SWEEPS);
    let more = steepened(&field, &dome.coarser(0), pressure, coarse.step);
    Problem { more: Some(&more), ..coarse }.relax(&mut field, SWEEPS);
    let (mut field, more) = (fine.refined(&field), fine.refined(&more));
    Problem { more: Some(&more), ..*fine }.relax(&mut field, SWEEPS);
    field
}

/// Addition to the load of a sheet, lifted over a dome, where it is steep: a sheet under pressure bends by that where it is flat
/// and by `(1 + slope^2)^1.5` times as much where it is steep.
fn steepened(lifted: &Field, dome: &Field, load: f32, step: f32) -> Field {
    let (columns, rows) = (lifted.columns, lifted.rows);
    let height = |k: usize| lifted.values[k] + dome.values[k];
    let mut more = Field::filled(columns, rows, 0.0);
    for row in 1..rows - 1 {
        for k in row * columns + 1..(row + 1) * columns - 1 {
            let (y, z) = (height(k + 1) - height(k - 1), height(k + columns) - height(k - columns));
            let square = ((y * y + z * z) / (4.0 * step * step)).min(STEEPEST * STEEPEST);
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
        let free = FreeShape {
            height_m: -0.03,
            bend: DVec2::splat(0.5 * curvature / f64::from(PRESSED)),
            ..FreeShape::default()
        };
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
