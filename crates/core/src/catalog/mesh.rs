//! A tool's surface as one watertight mesh.
//!
//! The outline is cut out of a triangulated grid in the y-z plane, along the foot of the bevel and along the
//! outline; the result is lifted to both sides and closed by walls. Vertices lie exactly on the surface.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::shape::ToolSpec;
use crate::mesh::TriMesh;

/// Edge length of the grid that a tool's mesh is cut from, meters.
const MESH_STEP_M: f64 = 0.0005;

/// A triangulation of a part of the plane, with the outline distance at each vertex.
struct PlanarMesh {
    points: Vec<DVec2>,
    values: Vec<f64>,
    triangles: Vec<[u32; 3]>,
}

impl ToolSpec {
    /// The surface as a watertight mesh, meters, object frame.
    pub fn mesh(&self) -> TriMesh {
        let mut sheet = grid(self, MESH_STEP_M);
        sheet.split(self, -self.bevel_width_m, MESH_STEP_M);
        sheet.split(self, 0.0, MESH_STEP_M);
        sheet.keep_inside(self);
        sheet.extrude(self)
    }
}

/// The grid over the bounding box, split along alternating diagonals.
fn grid(tool: &ToolSpec, step: f64) -> PlanarMesh {
    let [lo, hi] = tool.outline_bounds();
    let columns = ((hi.x - lo.x) / step).ceil() as usize + 3;
    let rows = ((hi.y - lo.y) / step).ceil() as usize + 3;
    let mut sheet = PlanarMesh { points: Vec::new(), values: Vec::new(), triangles: Vec::new() };
    for j in 0..rows {
        for i in 0..columns {
            let p = lo + DVec2::new(i as f64 - 1.0, j as f64 - 1.0) * step;
            sheet.points.push(p);
            sheet.values.push(tool.outline_distance(p));
        }
    }
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let vertex = |di: usize, dj: usize| ((j + dj) * columns + i + di) as u32;
            let (a, b, c, d) = (vertex(0, 0), vertex(1, 0), vertex(1, 1), vertex(0, 1));
            // cells wholly outside are never part of the tool
            if [a, b, c, d].iter().all(|&v| sheet.values[v as usize] > 2.0 * step) {
                continue;
            }
            if (i + j) % 2 == 0 {
                sheet.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                sheet.triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    sheet
}

impl PlanarMesh {
    /// Cuts every triangle along the line where the outline distance is `level`, so that afterwards each lies on
    /// one side of it. A cut point belongs to an edge, so neighbors stay connected.
    fn split(&mut self, tool: &ToolSpec, level: f64, step: f64) {
        // a vertex that is nearly on the line becomes one of it: no slivers
        for value in &mut self.values {
            if (*value - level).abs() < 1e-3 * step {
                *value = level;
            }
        }
        let mut cuts: HashMap<(u32, u32), u32> = HashMap::new();
        let mut triangles = Vec::with_capacity(self.triangles.len());
        for t in std::mem::take(&mut self.triangles) {
            let side = t.map(|v| (self.values[v as usize] - level).total_cmp(&0.0) as i8);
            let (below, above) = (side.contains(&-1), side.contains(&1));
            if !(below && above) {
                triangles.push(t);
                continue;
            }
            if let Some(k) = side.iter().position(|&s| s == 0) {
                // through a corner: two triangles
                let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                let m = self.cut(tool, level, b, c, &mut cuts);
                triangles.extend([[a, b, m], [a, m, c]]);
            } else {
                // one corner is alone on its side
                let k = (0..3).find(|&k| side[k] != side[(k + 1) % 3] && side[k] != side[(k + 2) % 3]).unwrap_or(0);
                let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                let m = self.cut(tool, level, a, b, &mut cuts);
                let n = self.cut(tool, level, a, c, &mut cuts);
                triangles.extend([[a, m, n], [m, b, c], [m, c, n]]);
            }
        }
        self.triangles = triangles;
    }

    /// The vertex where edge `a b` crosses `level`, found by bisection.
    fn cut(&mut self, tool: &ToolSpec, level: f64, a: u32, b: u32, cuts: &mut HashMap<(u32, u32), u32>) -> u32 {
        *cuts.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let (mut low, mut high) = (self.points[a as usize], self.points[b as usize]);
            if self.values[a as usize] > level {
                std::mem::swap(&mut low, &mut high);
            }
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if tool.outline_distance(middle) < level { low = middle } else { high = middle }
            }
            self.points.push(0.5 * (low + high));
            self.values.push(level);
            (self.points.len() - 1) as u32
        })
    }

    /// Drops what lies outside the outline.
    fn keep_inside(&mut self, tool: &ToolSpec) {
        let (points, values) = (&self.points, &self.values);
        self.triangles.retain(|t| {
            let v = t.map(|i| values[i as usize]);
            if v.iter().all(|&v| v == 0.0) {
                let center = t.iter().map(|&i| points[i as usize]).sum::<DVec2>() / 3.0;
                return tool.outline_distance(center) < 0.0;
            }
            v.iter().all(|&v| v <= 0.0)
        });
    }

    /// Both faces and the walls between them.
    fn extrude(self, tool: &ToolSpec) -> TriMesh {
        let mut index = vec![u32::MAX; self.points.len()];
        let mut vertices = Vec::new();
        for &v in self.triangles.iter().flatten() {
            if index[v as usize] == u32::MAX {
                index[v as usize] = vertices.len() as u32;
                let (p, h) = (self.points[v as usize], tool.height_at(self.values[v as usize].min(0.0)));
                vertices.push(DVec3::new(h, p.x, p.y));
                vertices.push(DVec3::new(-h, p.x, p.y));
            }
        }
        let mut edges: Vec<(u32, u32)> = Vec::with_capacity(self.triangles.len() * 3);
        let mut triangles = Vec::with_capacity(self.triangles.len() * 2);
        for t in &self.triangles {
            let [a, b, c] = t.map(|v| index[v as usize]);
            triangles.push([a, b, c]);
            triangles.push([a + 1, c + 1, b + 1]);
            edges.extend([(a, b), (b, c), (c, a)]);
        }
        edges.sort_unstable();
        for &(a, b) in &edges {
            if edges.binary_search(&(b, a)).is_err() {
                triangles.push([b, a, a + 1]);
                triangles.push([b, a + 1, b + 1]);
            }
        }
        TriMesh { vertices, triangles }
    }
}
