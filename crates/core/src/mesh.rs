//! Triangle meshes: the CAD models of the tools, in meters and the object frame.

mod axes;
pub mod distance;
pub mod sampling;

use glam::DVec3;

pub use axes::Axes;
pub(crate) use distance::MeshDistance;

/// An indexed triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TriMesh {
    /// Corner positions, meters, object frame.
    pub vertices: Vec<DVec3>,
    /// Corner indices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// The parts of the surface that are further than this from the plane x = 0, meters, on either side.
    #[must_use]
    pub fn beyond(&self, distance_m: f64) -> Self {
        let mut cut = Self { vertices: Vec::new(), triangles: Vec::new() };
        for (side, triangle) in [-1.0, 1.0].into_iter().flat_map(|side| self.triangles.iter().map(move |t| (side, t))) {
            let corners = triangle.map(|at| self.vertices[at as usize]);
            let above = corners.map(|corner| side * corner.x - distance_m);
            let first = cut.vertices.len() as u32;
            for i in 0..3 {
                let (j, a, b) = ((i + 1) % 3, above[i], above[(i + 1) % 3]);
                if a > 0.0 {
                    cut.vertices.push(corners[i]);
                }
                if (a > 0.0) != (b > 0.0) {
                    cut.vertices.push(corners[i].lerp(corners[j], a / (a - b)));
                }
            }
            let last = cut.vertices.len() as u32;
            cut.triangles.extend((first + 2..last).map(|at| [first, at - 1, at]));
        }
        cut
    }

    /// The corners of the triangles of which all are there and finite.
    pub(crate) fn sound_triangles(&self) -> Vec<[DVec3; 3]> {
        let corner = |at: &u32| self.vertices.get(*at as usize).copied().filter(|corner| corner.is_finite());
        self.triangles.iter().filter_map(|[a, b, c]| Some([corner(a)?, corner(b)?, corner(c)?])).collect()
    }

    /// The corners of triangle `index`.
    pub fn corners(&self, index: usize) -> [DVec3; 3] {
        self.triangles[index].map(|v| self.vertices[v as usize])
    }

    /// Smallest and largest corner of the bounding box; `None` without vertices.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let first = *self.vertices.first()?;
        Some(self.vertices.iter().fold([first, first], |[lo, hi], v| [lo.min(*v), hi.max(*v)]))
    }

    /// Surface area, square meters.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|i| triangle_area(self.corners(i))).sum()
    }

    /// Volume of the solid that it bounds, cubic meters; negative if the triangles face inwards.
    pub fn volume(&self) -> f64 {
        let corners = (0..self.triangles.len()).map(|i| self.corners(i));
        corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    /// True where every edge belongs to exactly two triangles, once in each direction.
    pub fn is_watertight(&self) -> bool {
        let mut edges: Vec<_> = self.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
        edges.sort_unstable();
        let unique = edges.windows(2).all(|w| w[0] != w[1]);
        unique && edges.iter().all(|&(a, b)| edges.binary_search(&(b, a)).is_ok())
    }
}

/// Area of a triangle, square meters.
pub fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
