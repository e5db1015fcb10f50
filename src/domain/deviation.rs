//! How far a cloud lies from a model: signed distances of its points, and the same painted on the model's surface.

use glam::{DAffine3, DVec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::mesh::{MeshDistance, TriMesh};

/// Longest edge of the painted surface near the cloud, meters: finer than a Soft Bubble's pixels are apart.
const EDGE_M: f64 = 0.000_6;
/// Most parts that one edge is cut into.
const MOST_PARTS: f64 = 96.0;

/// Signed distances of points to a model, meters: positive outside, negative inside, NaN of a point that is not finite.
/// `object_from_points` brings the points into the model's frame.
pub fn of_points(points: &[DVec3], object_from_points: &DAffine3, distance: &MeshDistance) -> Vec<f32> {
    points.par_iter().map(|p| distance.signed(object_from_points.transform_point3(*p)) as f32).collect()
}

/// A surface with a value per vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Painted {
    /// The model's triangles, cut up where points are near. Corners are not shared.
    pub mesh: TriMesh,
    /// Meters along the outward normal from each vertex to the nearest point; NaN where none is within reach.
    pub values: Vec<f32>,
}

/// A model's surface painted with its distance to points (meters, in the model's frame) that lie within `reach_m`.
/// Points that are not finite are left out.
///
/// # Cost
/// About a microsecond per vertex, one per 0.2 mm² near the points.
pub fn on_surface(mesh: &TriMesh, points: &[DVec3], reach_m: f64) -> Painted {
    let finite: Vec<[f64; 3]> = points.iter().filter(|p| p.is_finite()).map(|p| p.to_array()).collect();
    let tree = ImmutableKdTree::<f64, 3>::new_from_slice(&finite).ok().filter(|_| !finite.is_empty());
    let nearest = |p: DVec3| {
        let found = tree.as_ref()?.query(&p.to_array()).nearest_one::<SquaredEuclidean<f64>>().execute();
        Some((DVec3::from_array(*finite.get(found.item as usize)?), found.distance.sqrt()))
    };
    let triangles: Vec<[DVec3; 3]> = (0..mesh.triangles.len())
        .filter(|&i| mesh.triangles[i].iter().all(|&v| (v as usize) < mesh.vertices.len()))
        .map(|i| mesh.corners(i))
        .filter(|corners| corners.iter().all(|p| p.is_finite()))
        .collect();
    let parts: Vec<Vec<([DVec3; 3], [f32; 3])>> = triangles
        .par_iter()
        .map(|&[a, b, c]| {
            let center = (a + b + c) / 3.0;
            let radius = [a, b, c].map(|p| (p - center).length()).into_iter().fold(0.0, f64::max);
            let near = nearest(center).is_some_and(|(_, distance)| distance <= radius + reach_m);
            let Some(normal) = (b - a).cross(c - a).try_normalize().filter(|_| near) else {
                return vec![([a, b, c], [f32::NAN; 3])];
            };
            let value = |p: DVec3| match nearest(p) {
                Some((q, distance)) if distance <= reach_m => (q - p).dot(normal) as f32,
                _ => f32::NAN,
            };
            let longest = [b - a, c - b, a - c].map(DVec3::length).into_iter().fold(0.0, f64::max);
            let n = (longest / EDGE_M).ceil().clamp(1.0, MOST_PARTS) as u32;
            cut(&[a, b, c], n).into_iter().map(|corners| (corners, corners.map(value))).collect()
        })
        .collect();
    let mut painted = Painted::default();
    for (corners, values) in parts.into_iter().flatten() {
        let first = painted.mesh.vertices.len() as u32;
        painted.mesh.vertices.extend(corners);
        painted.mesh.triangles.push([first, first + 1, first + 2]);
        painted.values.extend(values);
    }
    painted
}

/// A triangle cut into `n * n` of the same shape, wound the same way.
fn cut(&[a, b, c]: &[DVec3; 3], n: u32) -> Vec<[DVec3; 3]> {
    let steps = f64::from(n);
    let at = |i: u32, j: u32| a + (b - a) * (f64::from(i) / steps) + (c - a) * (f64::from(j) / steps);
    let mut out = Vec::with_capacity((n * n) as usize);
    for j in 0..n {
        for i in 0..n - j {
            out.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 1 < n {
                out.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The surface z = 0, wound so that its normal is +z, and a plane of points at height `z` over a part of it.
    fn scene(z: f64) -> (TriMesh, Vec<DVec3>) {
        let corner = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let mesh = TriMesh {
            vertices: vec![corner(0.0, 0.0), corner(0.02, 0.0), corner(0.02, 0.02), corner(0.0, 0.02)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let steps = || (0..25).map(|i| f64::from(i) * 0.000_4);
        (mesh, steps().flat_map(|y| steps().map(move |x| DVec3::new(x, y, z))).collect())
    }

    #[test]
    fn the_surface_shows_the_height_of_the_points_and_nothing_beyond_them() {
        for z in [0.000_7, -0.001_2] {
            let (mesh, points) = scene(z);
            let painted = on_surface(&mesh, &points, 0.002);
            assert_eq!(painted.values.len(), painted.mesh.vertices.len());
            let mut seen = [0, 0];
            for (p, v) in painted.mesh.vertices.iter().zip(&painted.values) {
                if p.x < 0.009 && p.y < 0.009 {
                    assert!((f64::from(*v) - z).abs() < 1e-7, "{p} {v}");
                    seen[0] += 1;
                } else if p.x > 0.013 || p.y > 0.013 {
                    assert!(v.is_nan(), "{p} {v}");
                    seen[1] += 1;
                }
            }
            assert!(seen.iter().all(|n| *n > 100), "{seen:?}");
            let area: f64 = (0..painted.mesh.triangles.len())
                .map(|i| painted.mesh.corners(i))
                .map(|[a, b, c]| (b - a).cross(c - a).z / 2.0)
                .sum();
            assert!((area - 4e-4).abs() < 1e-12, "the same surface, wound the same way: {area}");
        }
    }

    #[test]
    fn points_are_signed_and_bad_input_is_no_panic() {
        let cube = crate::domain::align::testing::cuboid(DVec3::ZERO, DVec3::splat(0.01));
        let distance = MeshDistance::new(&cube).unwrap();
        let shift = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.002));
        let found =
            of_points(&[DVec3::new(0.0, 0.0, 0.01), DVec3::new(0.0, 0.0, 0.005), DVec3::NAN], &shift, &distance);
        assert!((found[0] - 0.002).abs() < 1e-7 && (found[1] + 0.003).abs() < 1e-7 && found[2].is_nan(), "{found:?}");
        let (mesh, _) = scene(0.0);
        let bare = on_surface(&mesh, &[DVec3::NAN], 0.002);
        assert!(bare.mesh.triangles.len() == 2 && bare.values.iter().all(|v| v.is_nan()));
        assert_eq!(on_surface(&TriMesh::default(), &[DVec3::ZERO], 0.002), Painted::default());
    }
}
