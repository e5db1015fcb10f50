//! [`MeshDistance`]: how far a point is from a mesh, and on which side.
//!
//! A bounding volume hierarchy serves both questions: the nearest triangle by branch and bound, the side by the
//! generalised winding number, which needs neither a closed mesh nor one without overlapping parts.
//! Source of the side test: Barill et al., Fast Winding Numbers for Soups and Clouds, 2018 (first order).

use std::f64::consts::PI;

use glam::DVec3;

use super::{TriMesh, triangle_area};

/// Triangles in a leaf: small enough that boxes do most of the work.
const LEAF: usize = 4;
/// A node is replaced by its dipole from this many radii on. 2 is the paper's choice; only "above one half" matters.
const FAR: f64 = 2.0;

/// Why a mesh has no distance.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// No triangle has an area.
    #[error("the mesh has no triangle with an area: check that the CAD file is not empty")]
    Empty,
    /// A triangle names a corner that does not exist.
    #[error("triangle {triangle} of the mesh names a corner that does not exist: the CAD file is damaged")]
    Index {
        /// Position in the list of triangles.
        triangle: usize,
    },
}

#[derive(Clone, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// First triangle and number of triangles; an inner node has 0 and its left child follows it.
    start: u32,
    count: u32,
    right: u32,
    /// Area-weighted center, sum of area times normal, and the radius around the center: the far-field dipole.
    center: DVec3,
    moment: DVec3,
    radius: f64,
}

impl Node {
    /// Squared distance from `p` to the box.
    fn distance_squared(&self, p: DVec3) -> f64 {
        (p.clamp(self.low, self.high) - p).length_squared()
    }
}

/// Signed distance to a mesh of up to some 100,000 triangles; built once per tool, shared by threads.
///
/// Holes, overlapping shells, inverted meshes and triangles without an area are tolerated.
#[derive(Clone, Debug)]
pub struct MeshDistance {
    nodes: Vec<Node>,
    triangles: Vec<[DVec3; 3]>,
}

impl MeshDistance {
    /// Sorts the triangles into a hierarchy: about 10 ms for 50,000.
    ///
    /// # Errors
    /// [`MeshError`] if a triangle names a missing corner, or if none has a finite, positive area.
    pub fn new(mesh: &TriMesh) -> Result<Self, MeshError> {
        let corners = mesh.vertices.len();
        if let Some(triangle) = mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= corners)) {
            return Err(MeshError::Index { triangle });
        }
        let mut triangles = mesh.sound_triangles();
        triangles.retain(|triangle| triangle_area(*triangle) > 0.0);
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        let mut nodes = Vec::with_capacity(triangles.len());
        let count = triangles.len();
        build(&mut nodes, &mut triangles, 0, count);
        Ok(Self { nodes, triangles })
    }

    /// Distance to the nearest triangle, meters, without a sign. NaN for a point that is not finite.
    pub(crate) fn unsigned(&self, p: DVec3) -> f64 {
        if p.is_finite() { self.nearest_below(p, f64::INFINITY).sqrt() } else { f64::NAN }
    }

    /// Signed distance, meters, negative inside. NaN for a point that is not finite.
    pub fn signed(&self, p: DVec3) -> f64 {
        let distance = self.unsigned(p);
        if distance.is_finite() && self.contains(p) { -distance } else { distance }
    }

    /// True where `p` is inside the mesh: the size of its winding number is above one half.
    pub fn contains(&self, p: DVec3) -> bool {
        let root = &self.nodes[0];
        if !p.is_finite() || root.distance_squared(p) > 0.0 {
            return false;
        }
        let mut solid_angle = 0.0;
        let mut stack = vec![0u32];
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            let offset = node.center - p;
            let length = offset.length();
            if length > FAR * node.radius {
                solid_angle += offset.dot(node.moment) / (length * length * length);
            } else if node.count == 0 {
                stack.push(index + 1);
                stack.push(node.right);
            } else {
                solid_angle += self.leaf(node).iter().map(|t| triangle_solid_angle(t, p)).sum::<f64>();
            }
        }
        // The size, not the value: a mesh whose triangles all face inwards is still a body.
        (solid_angle / (4.0 * PI)).abs() > 0.5
    }

    /// The signed distance (meters, negative inside) of a point that is at most `limit_m` (not negative) from the surface,
    /// or inside; infinity for all others. NaN for a point that is not finite.
    ///
    /// Much cheaper than [`Self::signed`] for points far away. How deep a point is that lies further inside than the limit is
    /// not said: minus the limit.
    pub(crate) fn signed_within(&self, p: DVec3, limit_m: f64) -> f64 {
        if !p.is_finite() {
            return f64::NAN;
        }
        // One part in 10^9 up, so that a distance of exactly the limit counts.
        let limit_squared = limit_m * limit_m * (1.0 + 1e-9);
        let squared = self.nearest_below(p, limit_squared);
        match (squared < limit_squared, self.contains(p)) {
            (true, inside) => squared.sqrt().min(limit_m) * if inside { -1.0 } else { 1.0 },
            (false, true) => -limit_m,
            (false, false) => f64::INFINITY,
        }
    }

    fn leaf(&self, node: &Node) -> &[[DVec3; 3]] {
        &self.triangles[node.start as usize..(node.start + node.count) as usize]
    }

    /// Squared distance to the nearest triangle, or `limit` if none is nearer than that.
    fn nearest_below(&self, p: DVec3, limit: f64) -> f64 {
        let mut best = limit;
        let mut stack = vec![(0u32, self.nodes[0].distance_squared(p))];
        while let Some((index, distance)) = stack.pop() {
            if distance >= best {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count == 0 {
                let (a, b) = (index + 1, node.right);
                let (da, db) = (self.nodes[a as usize].distance_squared(p), self.nodes[b as usize].distance_squared(p));
                // The nearer child last, so that it is looked into first.
                if da < db {
                    stack.push((b, db));
                    stack.push((a, da));
                } else {
                    stack.push((a, da));
                    stack.push((b, db));
                }
            } else {
                for t in self.leaf(node) {
                    best = best.min((nearest_on_triangle(t, p) - p).length_squared());
                }
            }
        }
        best
    }
}

/// Puts the node over `triangles[start..end]` and all below it at the end of `nodes`; returns its index.
fn build(nodes: &mut Vec<Node>, triangles: &mut [[DVec3; 3]], start: usize, end: usize) -> u32 {
    let part = &mut triangles[start..end];
    let corners = || part.iter().flatten();
    let first = part[0][0];
    let (low, high) = corners().fold((first, first), |(l, h), p| (l.min(*p), h.max(*p)));
    let (mut center, mut moment, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for [a, b, c] in part.iter() {
        let n = 0.5 * (*b - *a).cross(*c - *a);
        center += (*a + *b + *c) / 3.0 * n.length();
        moment += n;
        area += n.length();
    }
    center /= area;
    let radius = corners().map(|p| p.distance(center)).fold(0.0, f64::max);
    let index = nodes.len();
    let count = if part.len() <= LEAF { part.len() } else { 0 };
    nodes.push(Node { low, high, start: start as u32, count: count as u32, right: 0, center, moment, radius });
    if count == 0 {
        let size = high - low;
        let axis = if size.x >= size.y && size.x >= size.z { 0 } else { usize::from(size.z > size.y) + 1 };
        let middle = part.len() / 2;
        let key = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        part.select_nth_unstable_by(middle, |s, t| key(s).total_cmp(&key(t)));
        build(nodes, triangles, start, start + middle);
        let right = build(nodes, triangles, start + middle, end);
        nodes[index].right = right;
    }
    index as u32
}

/// Solid angle of a triangle seen from `p`, positive if its front is turned away from `p`.
///
/// Source: Van Oosterom and Strackee, The solid angle of a plane triangle, 1983.
fn triangle_solid_angle([a, b, c]: &[DVec3; 3], p: DVec3) -> f64 {
    let (a, b, c) = (*a - p, *b - p, *c - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let numerator = a.dot(b.cross(c));
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * numerator.atan2(denominator)
}

/// The point of a triangle nearest to `p`.
///
/// Source: Ericson, Real-Time Collision Detection, 2004, section 5.1.5.
fn nearest_on_triangle([a, b, c]: &[DVec3; 3], p: DVec3) -> DVec3 {
    let (ab, ac, ap) = (*b - *a, *c - *a, p - *a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let bp = p - *b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return *a + ab * (d1 / (d1 - d3));
    }
    let cp = p - *c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return *a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return *b + (*c - *b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    *a + ab * (vb * scale) + ac * (vc * scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::testing::cuboid;
    use proptest::prelude::*;

    /// The exact signed distance of an axis-aligned box with half sizes `h` about `c`.
    fn cuboid_distance(c: DVec3, h: DVec3, p: DVec3) -> f64 {
        let q = (p - c).abs() - h;
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
    }

    proptest! {
        #[test]
        fn agrees_with_the_exact_box(x in -0.03..0.03f64, y in -0.03..0.03f64, z in -0.03..0.03f64) {
            let (c, h) = (DVec3::new(0.001, 0.002, -0.003), DVec3::new(0.004, 0.01, 0.02));
            let distance = MeshDistance::new(&cuboid(c, h)).unwrap();
            let p = DVec3::new(x, y, z);
            let exact = cuboid_distance(c, h, p);
            prop_assert!((distance.signed(p) - exact).abs() < 1e-12, "{} for {exact}", distance.signed(p));
            let near = distance.signed_within(p, 0.001);
            prop_assert_eq!(near <= 0.001, exact <= 0.001);
            prop_assert!(exact.abs() > 0.001 || (near - exact).abs() < 1e-12);
        }
    }

    #[test]
    fn holes_overlaps_inversion_and_needles_are_tolerated() {
        let half = DVec3::new(0.004, 0.01, 0.02);
        let mut mesh = cuboid(DVec3::ZERO, half);
        // A second body through the first one, a triangle without an area and one that is not finite.
        let other = cuboid(DVec3::ZERO, DVec3::new(0.003, 0.02, 0.01));
        let shift = mesh.vertices.len() as u32;
        mesh.vertices.extend(other.vertices);
        mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + shift)));
        mesh.vertices.push(DVec3::NAN);
        mesh.triangles.extend([[0, 0, 1], [0, 1, 16]]);
        let distance = MeshDistance::new(&mesh).unwrap();
        assert!(distance.contains(DVec3::new(0.0001, 0.0002, 0.0003)), "inside both bodies is inside");
        assert!(distance.contains(DVec3::new(0.0001, 0.015, 0.0003)));
        assert!(!distance.contains(DVec3::new(0.0001, 0.015, 0.015)));
        for t in &mut mesh.triangles {
            t.swap(0, 1);
        }
        assert!(MeshDistance::new(&mesh).unwrap().contains(DVec3::new(0.0001, 0.015, 0.0003)));
        let mut open = cuboid(DVec3::ZERO, half);
        open.triangles.pop();
        let open = MeshDistance::new(&open).unwrap();
        assert!(open.contains(DVec3::new(0.0, 0.001, 0.002)));
        assert!(!open.contains(DVec3::new(0.0039, 0.02, 0.0)));
    }
}
