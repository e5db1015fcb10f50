//! [`Outline`]: a tool's silhouette along the closing axis, as line segments.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;
use touch2touch_core::mesh::TriMesh;

/// Corners closer than this are one, meters.
const SAME_M: f64 = 1e-9;
/// A corner this close to the line between its neighbors is left out, meters.
const STRAIGHT_M: f64 = 1e-7;

/// Outline of a tool in the plane of the in-hand angle, convex or not, perhaps of several loops.
///
/// The segments hold the whole boundary of the silhouette, in no order; a fold inside it may be among them, which changes
/// nothing of what the silhouette covers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Outline {
    /// Ends of each segment as (y, z), meters, object frame.
    segments: Vec<[DVec2; 2]>,
}

/// A corner as a key: the grid of [`SAME_M`].
type Key = [i64; 2];

fn key(p: DVec2) -> Key {
    [p.x, p.y].map(|v| (v / SAME_M).round() as i64)
}

fn point(key: Key) -> DVec2 {
    DVec2::new(key[0] as f64, key[1] as f64) * SAME_M
}

impl Outline {
    /// The outline of a mesh (meters, object frame) along x: the edges where its surface turns away.
    ///
    /// # Errors
    /// If it is a mesh that is empty, flat along x, or not finite.
    pub(super) fn of_mesh(mesh: &TriMesh) -> anyhow::Result<Self> {
        if mesh.vertices.iter().any(|v| !v.is_finite()) {
            anyhow::bail!("the tool has no outline: its mesh is not finite");
        }
        // For each edge the sides that its triangles face: along x, against it, or neither.
        let mut faces: BTreeMap<(u32, u32), Vec<i8>> = BTreeMap::new();
        for (i, t) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(i);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let side = if normal.x.abs() < 1e-9 { 0 } else { normal.x.signum() as i8 };
            for (from, to) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                faces.entry((from.min(to), from.max(to))).or_default().push(side);
            }
        }
        let turns = |sides: &[i8]| sides.len() != 2 || sides[0] == 0 || sides[0] != sides[1];
        let at = |v: u32| {
            let p = mesh.vertices[v as usize];
            key(DVec2::new(p.y, p.z))
        };
        let edges = faces.iter().filter(|(_, sides)| turns(sides)).map(|((a, b), _)| [at(*a), at(*b)]);
        Self::of_edges(edges)
    }

    /// The outline of a polygon given by its corners as (y, z), meters.
    ///
    /// # Errors
    /// For fewer than three corners, or corners that are not finite or on one line.
    #[cfg(test)]
    pub(super) fn polygon(corners: &[DVec2]) -> anyhow::Result<Self> {
        if corners.iter().any(|p| !p.is_finite()) {
            anyhow::bail!("the tool has no outline: a corner is not finite");
        }
        let area: f64 = (0..corners.len()).map(|i| corners[i].perp_dot(corners[(i + 1) % corners.len()])).sum();
        if corners.len() < 3 || area.abs() < 1e-12 {
            anyhow::bail!("the tool has no outline: its corners span no area");
        }
        Self::of_edges((0..corners.len()).map(|i| [key(corners[i]), key(corners[(i + 1) % corners.len()])]))
    }

    fn of_edges(edges: impl Iterator<Item = [Key; 2]>) -> anyhow::Result<Self> {
        let mut beside: BTreeMap<Key, BTreeSet<Key>> = BTreeMap::new();
        for [a, b] in edges.filter(|[a, b]| a != b) {
            beside.entry(a).or_default().insert(b);
            beside.entry(b).or_default().insert(a);
        }
        straighten(&mut beside);
        let pairs = beside.iter().flat_map(|(a, to)| to.iter().filter(move |b| a < *b).map(|b| [point(*a), point(*b)]));
        let segments: Vec<_> = pairs.collect();
        if segments.len() < 3 {
            anyhow::bail!("the tool has no outline: it has no extent across the closing axis");
        }
        Ok(Self { segments })
    }

    /// The segments, ends as (y, z), meters, object frame.
    pub(super) fn segments(&self) -> &[[DVec2; 2]] {
        &self.segments
    }

    /// Smallest and largest (y, z), meters.
    pub(super) fn bounds(&self) -> [DVec2; 2] {
        let first = self.segments[0][0];
        let points = self.segments.iter().flatten();
        points.fold([first, first], |[lo, hi], p| [lo.min(*p), hi.max(*p)])
    }
}

/// Leaves out corners between two segments that are one.
fn straighten(beside: &mut BTreeMap<Key, BTreeSet<Key>>) {
    for corner in beside.keys().copied().collect::<Vec<_>>() {
        let ends: Vec<Key> = beside.get(&corner).into_iter().flatten().copied().collect();
        let &[a, b] = ends.as_slice() else { continue };
        let (from, to, p) = (point(a), point(b), point(corner));
        let along = to - from;
        let off = along.perp_dot(p - from).abs() / along.length().max(SAME_M);
        let between = (p - from).dot(along) > 0.0 && (to - p).dot(along) > 0.0;
        // Two segments whose far ends are joined already would become one with that.
        let joined = beside.get(&a).is_some_and(|of| of.contains(&b));
        if off < STRAIGHT_M && between && !joined {
            beside.remove(&corner);
            for (end, other) in [(a, b), (b, a)] {
                let of = beside.entry(end).or_default();
                of.remove(&corner);
                of.insert(other);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trials::tools::{cup_handle, pencil};
    use glam::DVec3;
    use touch2touch_core::catalog::tools;

    #[test]
    fn every_corner_of_a_tools_outline_lies_on_its_outline() {
        for spec in tools().iter().cloned().chain([pencil(), cup_handle()]) {
            let outline = Outline::of_mesh(&spec.mesh()).unwrap();
            let (solid, segments) = (spec.solid(), outline.segments());
            for [a, b] in segments {
                // A cell of the mesh's grid, 0.5 mm wide, cuts re-entrant corners off.
                for (p, within) in [(*a, 1e-5), (*b, 1e-5), ((*a + *b) * 0.5, 4e-4)] {
                    let off = solid.outline_distance(p);
                    assert!(off.abs() < within, "{}: {p} is {off} m off", spec.name);
                }
            }
            assert!((4..600).contains(&segments.len()), "{}: {} segments", spec.name, segments.len());
            let [lo, hi] = outline.bounds();
            let mesh = spec.mesh().bounds().unwrap();
            assert!((lo.x - mesh[0].y).abs() + (hi.y - mesh[1].z).abs() < 1e-8, "{}", spec.name);
        }
    }

    #[test]
    fn straight_edges_are_one_segment_and_what_has_no_outline_says_so() {
        let p = |y: f64, z: f64| DVec2::new(y, z) * 1e-3;
        let square = [p(0.0, 0.0), p(1.0, 0.0), p(2.0, 0.0), p(2.0, 2.0), p(0.0, 2.0), p(0.0, 1.0)];
        assert_eq!(Outline::polygon(&square).unwrap().segments().len(), 4);
        for bad in [&square[..2], &square[..3], &[p(0.0, 0.0), p(1.0, 0.0), p(f64::NAN, 1.0)]] {
            assert!(Outline::polygon(bad).unwrap_err().to_string().contains("no outline"), "{bad:?}");
        }
        assert!(Outline::of_mesh(&TriMesh::default()).is_err());
        let flat =
            TriMesh { vertices: vec![DVec3::ZERO, DVec3::X, DVec3::new(2.0, 0.0, 0.0)], triangles: vec![[0, 1, 2]] };
        assert!(Outline::of_mesh(&flat).is_err());
    }
}
