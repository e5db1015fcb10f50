//! [`Stage`]: the things about a tool that a trial shows: the block with its hole, or two cups.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::trials::{Cup, Hole};
use touch2touch_work::trials::{Goal, PairTrial};

/// Thickness of the plates behind the plane of the outline, and width of the block beside the hole, meters.
const BLOCK_M: [f64; 2] = [0.012, 0.008];
/// Thickness of a cup's wall, meters.
const WALL_M: f64 = 0.002;
/// Parts of a turn about a cup's axis.
const TURN: usize = 72;

/// The things about a tool in a trial.
pub(super) struct Stage {
    /// Shape that stands in the world: the cut block, or the lower cup.
    pub(super) stands: Arc<TriMesh>,
    /// The cup that moves with the tool.
    pub(super) carried: Option<Carried>,
}

/// The cup that a handle belongs to.
pub(super) struct Carried {
    /// Body, object frame.
    pub(super) body: Arc<TriMesh>,
    cup: Cup,
}

impl Stage {
    pub(super) fn of(trial: &PairTrial) -> Self {
        match &trial.goal {
            Goal::Insertion(insertion) => {
                // Where a tool touches far beside its hole, there is still the block.
                let touched = trial.attempt.contact.map_or(0.0, |touch| touch.point_m.y.abs());
                Self { stands: Arc::new(cut_block(insertion.hole(), touched)), carried: None }
            }
            Goal::Stacking(stacking) => {
                let cup = stacking.cup();
                let lower = body(cup, DVec2::new(0.0, cup.height_m));
                let upper = Carried { body: Arc::new(body(cup, cup.base_at)), cup: *cup };
                Self { stands: Arc::new(lower), carried: Some(upper) }
            }
        }
    }
}

impl Carried {
    /// The center of mass, and the point below it in the plane of the lower rim, for a pose of the handle; world frame, meters.
    pub(super) fn plumb(&self, world_from_object: PlanarPose) -> [DVec3; 2] {
        let mass = world_from_object.transform_yz(self.cup.base_at - DVec2::new(0.0, self.cup.mass_m));
        [DVec3::new(0.0, mass.x, mass.y), DVec3::new(0.0, mass.x, 0.0)]
    }
}

/// A cup of revolution about an axis along z, the middle of its base at `(y, z)`; z points down, so it opens towards -z.
fn body(cup: &Cup, base_at: DVec2) -> TriMesh {
    let (base, rim, height) = (cup.base_m, cup.rim_m, cup.height_m);
    // Radius and height above the base, from the middle below to the middle inside.
    let profile =
        [[0.0, 0.0], [base, 0.0], [rim, height], [rim - WALL_M, height], [base - WALL_M, WALL_M], [0.0, WALL_M]];
    let mut mesh = TriMesh::default();
    for turn in 0..TURN {
        let around = DVec2::from_angle(std::f64::consts::TAU * turn as f64 / TURN as f64);
        let at =
            |[radius, above]: [f64; 2]| DVec3::new(radius * around.x, base_at.x + radius * around.y, base_at.y - above);
        mesh.vertices.extend(profile.map(at));
    }
    let rows = profile.len() as u32;
    let corner = |turn: usize, row: u32| (turn % TURN) as u32 * rows + row;
    for turn in 0..TURN {
        for row in 0..rows - 1 {
            let [a, b] = [corner(turn, row), corner(turn, row + 1)];
            let [c, d] = [corner(turn + 1, row), corner(turn + 1, row + 1)];
            mesh.triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    mesh
}

/// The half of the block behind the plane of the outline, with the hole laid open: plates between its openings, and the floor. It is
/// wider than the hole, and than `out_to_m` to either side, meters.
fn cut_block(hole: &Hole, out_to_m: f64) -> TriMesh {
    let mut mesh = TriMesh::default();
    let shape = hole.shape();
    let reach = hole.plates().flat_map(|(_, openings)| openings.iter().flatten().map(|y| y.abs()).collect::<Vec<_>>());
    let reach = reach.fold(out_to_m, f64::max) + BLOCK_M[1];
    let plates: Vec<(f64, Vec<[f64; 2]>)> = hole.plates().map(|(top, openings)| (top, openings.to_vec())).collect();
    let floor = shape.depth_m + shape.clearance_m;
    for (i, (top, openings)) in plates.iter().enumerate() {
        let bottom = plates.get(i + 1).map_or(floor, |(next, _)| *next);
        let mut from = -reach;
        for [low, high] in openings {
            solid(&mut mesh, [from, *low], [*top, bottom]);
            from = *high;
        }
        solid(&mut mesh, [from, reach], [*top, bottom]);
    }
    solid(&mut mesh, [-reach, reach], [floor, floor + 0.25 * BLOCK_M[1]]);
    mesh
}

/// Adds a box from `y[0]` to `y[1]` and `z[0]` to `z[1]`.
fn solid(mesh: &mut TriMesh, y: [f64; 2], z: [f64; 2]) {
    if y[1] <= y[0] || z[1] <= z[0] {
        return;
    }
    let (x, first) = ([-BLOCK_M[0], 0.0], mesh.vertices.len() as u32);
    for corner in 0..8usize {
        mesh.vertices.push(DVec3::new(x[corner & 1], y[corner >> 1 & 1], z[corner >> 2 & 1]));
    }
    // Corners by bits x, y, z; counter-clockwise seen from outside.
    const SIDES: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    for [a, b, c, d] in SIDES.map(|side| side.map(|corner| first + corner)) {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(mesh: &TriMesh) -> f64 {
        (0..mesh.triangles.len()).map(|i| mesh.corners(i)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn a_cup_is_closed_looks_outwards_and_hangs_on_its_handle() {
        let cup = Cup::default();
        let mesh = body(&cup, cup.base_at);
        // A cone's frustum less that of its inside.
        let frustum = |a: f64, b: f64, h: f64| std::f64::consts::PI * h * (a * a + a * b + b * b) / 3.0;
        let inside = frustum(cup.base_m - WALL_M, cup.rim_m - WALL_M, cup.height_m - WALL_M);
        let wanted = frustum(cup.base_m, cup.rim_m, cup.height_m) - inside;
        assert!((volume(&mesh) / wanted - 1.0).abs() < 0.01, "{} {wanted}", volume(&mesh));
        // Its mass is over the middle of the rim where it stands upright.
        let stacking = touch2touch_core::trials::Stacking::new(cup, 0.01, Default::default()).unwrap();
        let upper = Carried { body: Arc::new(mesh), cup };
        let [mass, below] = upper.plumb(stacking.goal());
        assert!(mass.abs_diff_eq(DVec3::new(0.0, 0.0, -cup.mass_m), 1e-12) && below.length() < 1e-12, "{mass} {below}");
        // The handle reaches its wall, and not its inside.
        let handle = touch2touch_core::catalog::cup_handle().mesh().bounds().unwrap()[1].y;
        let wall = upper.body.vertices.iter().map(|v| v.y).fold(f64::INFINITY, f64::min);
        assert!((handle - wall).abs() < 0.004, "{handle} {wall}");
    }

    #[test]
    fn a_box_is_closed_and_looks_outwards() {
        let mut mesh = TriMesh::default();
        solid(&mut mesh, [0.0, 0.002], [0.001, 0.004]);
        assert!((volume(&mesh) - BLOCK_M[0] * 0.002 * 0.003).abs() < 1e-15, "{}", volume(&mesh));
        solid(&mut mesh, [0.002, 0.001], [0.0, 1.0]);
        assert_eq!(mesh.vertices.len(), 8, "nothing of no width");
    }
}
