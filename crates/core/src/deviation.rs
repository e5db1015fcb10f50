//! Deviation of a cloud from a model: signed distances of its points, also painted on the model's surface.

use glam::{DAffine3, DVec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::mesh::{MeshDistance, TriMesh};

/// Longest edge of the painted surface near the cloud, meters: about two pixels of a Soft Bubble.
const EDGE_M: f64 = 0.000_8;
/// A triangle is halved so many times at most: one of half a meter is then as fine as this.
const MOST_CUTS: u32 = 20;

/// Signed distances of points to a model, meters: positive outside, negative inside, NaN of a point that is not finite.
/// `object_from_points` brings the points into the model's frame.
pub fn of_points(points: &[DVec3], object_from_points: &DAffine3, distance: &MeshDistance) -> Vec<f32> {
    points.par_iter().map(|p| distance.signed(object_from_points.transform_point3(*p)) as f32).collect()
}

/// Finds the nearest of some points. Those that are not finite are left out.
struct Nearest {
    points: Vec<[f64; 3]>,
    tree: Option<ImmutableKdTree<f64, 3>>,
}

impl Nearest {
    fn new(points: &[DVec3]) -> Self {
        let points: Vec<[f64; 3]> = points.iter().filter(|p| p.is_finite()).map(|p| p.to_array()).collect();
        let tree = ImmutableKdTree::new_from_slice(&points).ok().filter(|_| !points.is_empty());
        Self { points, tree }
    }

    /// The nearest point and its distance.
    fn of(&self, p: DVec3) -> Option<(DVec3, f64)> {
        let nearest = self.tree.as_ref()?.query(&p.to_array()).nearest_one::<SquaredEuclidean<f64>>().execute();
        Some((DVec3::from_array(*self.points.get(nearest.item as usize)?), nearest.distance.sqrt()))
    }
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
/// About a microsecond per vertex; some ten triangles per square millimeter near the points, none elsewhere.
pub fn on_surface(mesh: &TriMesh, points: &[DVec3], reach_m: f64) -> Painted {
    let tree = Nearest::new(points);
    let nearest = |p: DVec3| tree.of(p);
    let triangles = mesh.sound_triangles();
    let parts: Vec<Vec<([DVec3; 3], [f32; 3])>> = triangles
        .par_iter()
        .map(|&corners| {
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a).try_normalize();
            let value = |p: DVec3| match (nearest(p), normal) {
                (Some((q, distance)), Some(normal)) if distance <= reach_m => (q - p).dot(normal) as f32,
                _ => f32::NAN,
            };
            let near = |triangle: &[DVec3; 3]| {
                let center = triangle.iter().sum::<DVec3>() / 3.0;
                let radius = triangle.iter().map(|p| (*p - center).length()).fold(0.0, f64::max);
                nearest(center).is_some_and(|(_, distance)| distance <= radius + reach_m)
            };
            let (mut waiting, mut done) = (vec![(corners, 0)], Vec::new());
            while let Some((triangle, cuts)) = waiting.pop() {
                if normal.is_none() || !near(&triangle) {
                    done.push((triangle, [f32::NAN; 3]));
                } else if cuts < MOST_CUTS
                    && let Some(halves) = halved(&triangle)
                {
                    waiting.extend(halves.map(|half| (half, cuts + 1)));
                } else {
                    done.push((triangle, triangle.map(value)));
                }
            }
            done
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

/// A triangle cut across its longest edge, wound the same way; `None` if that is short enough.
fn halved(&[a, b, c]: &[DVec3; 3]) -> Option<[[DVec3; 3]; 2]> {
    let edges = [(a, b, c), (b, c, a), (c, a, b)];
    let (p, q, apex) = edges.into_iter().max_by(|x, y| {
        let length = |(p, q, _): &(DVec3, DVec3, DVec3)| (*q - *p).length_squared();
        length(x).total_cmp(&length(y))
    })?;
    let middle = 0.5 * (p + q);
    ((q - p).length() > EDGE_M).then_some([[p, middle, apex], [middle, q, apex]])
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
            assert!(seen[0] > 100 && seen[1] > 0, "{seen:?}");
            // Where no point is near, the model's own triangles do.
            assert!(painted.mesh.triangles.len() < 4000, "{}", painted.mesh.triangles.len());
            let area: f64 = (0..painted.mesh.triangles.len())
                .map(|i| painted.mesh.corners(i))
                .map(|[a, b, c]| (b - a).cross(c - a).z / 2.0)
                .sum();
            assert!((area - 4e-4).abs() < 1e-12, "the same surface, wound the same way: {area}");
        }
    }

    #[test]
    fn points_are_signed_and_bad_input_is_no_panic() {
        let cube = crate::align::testing::cuboid(DVec3::ZERO, DVec3::splat(0.01));
        let distance = MeshDistance::new(&cube).unwrap();
        let shift = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.002));
        let distances =
            of_points(&[DVec3::new(0.0, 0.0, 0.01), DVec3::new(0.0, 0.0, 0.005), DVec3::NAN], &shift, &distance);
        assert!(
            (distances[0] - 0.002).abs() < 1e-7 && (distances[1] + 0.003).abs() < 1e-7 && distances[2].is_nan(),
            "{distances:?}"
        );
        let (mesh, _) = scene(0.0);
        let bare = on_surface(&mesh, &[DVec3::NAN], 0.002);
        assert!(bare.mesh.triangles.len() == 2 && bare.values.iter().all(|v| v.is_nan()));
        assert_eq!(on_surface(&TriMesh::default(), &[DVec3::ZERO], 0.002), Painted::default());
    }
}
