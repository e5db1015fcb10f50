//! Points drawn uniformly from a mesh's surface, and thinning of point lists.

use glam::DVec3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{TriMesh, triangle_area};

impl TriMesh {
    /// `count` points on the surface, meters, object frame; each triangle gets a share by its area.
    ///
    /// One seed gives the same points on every machine. Triangles without an area or with corners that are
    /// not finite get none; a mesh without any area gives an empty list.
    pub fn sample_surface(&self, count: usize, seed: u64) -> Vec<DVec3> {
        self.sample_surface_with_normals(count, seed).into_iter().map(|(point, _)| point).collect()
    }

    /// Points of [`Self::sample_surface`], each with the unit normal of its triangle.
    pub(crate) fn sample_surface_with_normals(&self, count: usize, seed: u64) -> Vec<(DVec3, DVec3)> {
        let mut upto = Vec::with_capacity(self.triangles.len());
        let mut total = 0.0;
        for i in 0..self.triangles.len() {
            let area = triangle_area(self.corners(i));
            if area.is_finite() {
                total += area;
            }
            upto.push(total);
        }
        if total <= 0.0 || !total.is_finite() {
            return Vec::new();
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..count)
            .map(|_| {
                let area = rng.random::<f64>() * total;
                let triangle = upto.partition_point(|&t| t <= area).min(upto.len() - 1);
                let [a, b, c] = self.corners(triangle);
                // The square root makes the density uniform over the triangle instead of denser at one corner.
                let (r, v) = (rng.random::<f64>().sqrt(), rng.random::<f64>());
                let point = a * (1.0 - r) + b * (r * (1.0 - v)) + c * (r * v);
                // Only triangles with an area are drawn, so the product has a direction; its size may be tiny.
                (point, (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::X))
            })
            .collect()
    }
}

/// Indices of at most `count` of `len` items, spread evenly and in order: one from each of `count` equal blocks.
///
/// The item taken of a block is hashed from the block's number, so that the choice neither locks onto the rows of an
/// image (as a fixed stride does) nor changes between runs.
pub fn spread(len: usize, count: usize) -> Vec<usize> {
    if len <= count {
        return (0..len).collect();
    }
    // Block borders are i * len / count, counted up instead of divided out.
    let (whole, part) = (len / count, len % count);
    let (mut from, mut carry) = (0, 0);
    (0..count)
        .map(|i| {
            carry += part;
            let over = usize::from(carry >= count);
            carry -= over * count;
            let to = from + whole + over;
            let hash = (i as u64).wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let hash = hash ^ (hash >> 31);
            let chosen = from + (((hash >> 32) * (to - from) as u64) >> 32) as usize;
            from = to;
            chosen
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_follow_the_area_and_the_seed() {
        // Two triangles in the planes x = 0 (area 0.5) and x = 1 (area 1.5), a needle without area and a broken one.
        let mesh = TriMesh {
            vertices: vec![
                DVec3::ZERO,
                DVec3::Y,
                DVec3::Z,
                DVec3::X,
                DVec3::new(1.0, 3.0, 0.0),
                DVec3::new(1.0, 0.0, 1.0),
                DVec3::NAN,
            ],
            triangles: vec![[0, 1, 2], [3, 4, 5], [0, 0, 1], [0, 1, 6]],
        };
        let points = mesh.sample_surface(4000, 7);
        let far = points.iter().filter(|p| p.x > 0.5).count();
        assert!((2880..3120).contains(&far), "3 of 4 expected, got {far} of 4000");
        assert!(points.iter().all(|p| p.is_finite()));
        assert_eq!(points, mesh.sample_surface(4000, 7));
        assert_ne!(points, mesh.sample_surface(4000, 8));
        assert!(TriMesh::default().sample_surface(10, 0).is_empty());
    }
}
