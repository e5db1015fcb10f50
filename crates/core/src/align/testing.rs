//! Shapes and contact points for tests of this layer.

use glam::{DVec2, DVec3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::frames::PlanarPose;
use crate::mesh::TriMesh;

/// An axis-aligned box with half sizes `half` about `center`, closed, facing outwards.
pub(crate) fn cuboid(center: DVec3, half: DVec3) -> TriMesh {
    let vertices = (0..8)
        .map(|i| {
            let sign = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            center + half * DVec3::new(sign(0), sign(1), sign(2))
        })
        .collect();
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh { vertices, triangles }
}

/// Half sizes in y-z of the two bars of [`cross`].
pub(crate) const CROSS_BARS: [DVec2; 2] = [DVec2::new(0.02, 0.003), DVec2::new(0.003, 0.03)];

/// Two bars across each other (40 and 60 mm long, 6 mm wide), turned by 30 degrees, overlapping in the middle.
pub(crate) fn cross() -> TriMesh {
    let mut mesh = TriMesh::default();
    let turn = glam::DQuat::from_rotation_x(std::f64::consts::FRAC_PI_6);
    for half in CROSS_BARS {
        let bar = cuboid(DVec3::ZERO, DVec3::new(0.003, half.x, half.y));
        let shift = mesh.vertices.len() as u32;
        mesh.vertices.extend(bar.vertices.iter().map(|v| turn * *v));
        mesh.triangles.extend(bar.triangles.iter().map(|t| t.map(|v| v + shift)));
    }
    mesh
}

/// Points spread over the silhouette of [`cross`] at the given pose, with noise of up to about `noise_m`,
/// `(y, z)` in the grasp frame.
pub(crate) fn cross_contacts(count: usize, grasp_from_object: PlanarPose, noise_m: f64, seed: u64) -> Vec<DVec2> {
    filled(&CROSS_BARS, std::f64::consts::FRAC_PI_6, count, grasp_from_object, noise_m, seed)
}

/// Points spread over bars with the given half sizes, turned by `turn_rad`; the noise has a triangular distribution
/// with standard deviation `noise_m`.
pub(crate) fn filled(
    bars: &[DVec2],
    turn_rad: f64,
    count: usize,
    grasp_from_object: PlanarPose,
    noise_m: f64,
    seed: u64,
) -> Vec<DVec2> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let turn = DVec2::from_angle(turn_rad);
    (0..count)
        .map(|i| {
            let half = bars[i % bars.len()];
            let mut uniform = || rng.random::<f64>() * 2.0 - 1.0;
            let p = DVec2::new(uniform(), uniform()) * half;
            let noise = DVec2::new(uniform() + uniform(), uniform() + uniform()) * (noise_m * 1.22);
            grasp_from_object.transform_yz(turn.rotate(p) + noise)
        })
        .collect()
}
