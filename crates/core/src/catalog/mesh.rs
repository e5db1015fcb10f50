//! A tool's surface as one watertight mesh.
//!
//! A triangulated grid in the y-z plane is cut along the lines of the outline and along those that the height bends at;
//! what lies inside is lifted to both sides and closed by walls. Vertices lie exactly on the surface.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::shape::{Section, Solid, Stretch, ToolSpec};
use crate::mesh::TriMesh;

/// Edge length of the grid that a mesh is cut from, meters. Straight lines are cut exactly at any.
const STEP_M: f64 = 0.002_5;
/// Triangles at the outline thinner than this are no part of the tool, meters.
const SLIVER_M: f64 = 2e-6;
/// Angles from the middle of a rounding that it is cut at, degrees: of crowns and bends, and of beads.
const ROUND_DEG: [f64; 8] = [10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0];
const BEAD_DEG: [f64; 3] = [22.5, 45.0, 67.5];

/// A triangulation of a part of the plane.
struct Sheet {
    points: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
}

impl ToolSpec {
    /// The surface as a watertight mesh, meters, in the object frame of the CAD model.
    pub fn mesh(&self) -> TriMesh {
        let solid = self.solid();
        let mut sheet = Sheet::grid(self, &solid);
        for (i, bar) in solid.parts.iter().enumerate() {
            for Stretch { from, to, along, mitres } in &bar.stretches {
                for (mitre, end) in mitres.iter().zip([*from, *to]) {
                    sheet.split(&|p| mitre.unwrap_or(*along).dot(p - end), &[0.0]);
                }
            }
            sheet.split(&|p| bar.beside(p), &[-bar.half_width_m, 0.0, bar.half_width_m]);
            for bend in &bar.bends {
                for line in bend.contacts() {
                    sheet.split(&|p| line.perp_dot(p - bend.at), &[0.0]);
                }
                // The arc's chords.
                for degrees in (0..180).step_by(15) {
                    let ray = DVec2::from_angle(f64::from(degrees).to_radians());
                    sheet.split(&|p| ray.perp_dot(p - bend.center()), &[0.0]);
                }
                let mut levels = ROUND_DEG.map(|degrees| bend.radius_m * degrees.to_radians().sin()).to_vec();
                levels.push(bend.radius_m);
                sheet.split(&|p| p.distance(bend.center()), &levels);
            }
            // The valleys between two bars.
            for other in &solid.parts[..i] {
                sheet.split(&|p| bar.beside(p) - other.beside(p), &[0.0]);
                sheet.split(&|p| bar.beside(p) + other.beside(p), &[0.0]);
            }
        }
        for plate in &self.plates {
            let corners = plate.len();
            for i in 0..corners {
                let line = |i: usize, p: DVec2| {
                    let (a, b) = (plate[i], plate[(i + 1) % corners]);
                    (b - a).normalize_or(DVec2::X).perp_dot(p - a)
                };
                sheet.split(&|p| line(i, p), &[0.0]);
                for j in 0..i {
                    sheet.split(&|p| line(i, p) - line(j, p), &[0.0]);
                }
            }
        }
        sheet.triangles.retain({
            let points = &sheet.points;
            |t| solid.outline_distance(t.iter().map(|&i| points[i as usize]).sum::<DVec2>() / 3.0) < -SLIVER_M
        });
        // Within a part the height follows the distance from its wall.
        let half_width = self.bars.iter().map(|bar| bar.half_width_m).fold(0.0, f64::max);
        match self.section {
            Section::Bevel { width_m, .. } => sheet.split(&|p| solid.inset(p), &[width_m]),
            Section::Crown { bead_m } => {
                let crown = ROUND_DEG.map(|degrees| half_width * (1.0 - degrees.to_radians().sin()));
                let bead = BEAD_DEG.map(|degrees| half_width - bead_m * degrees.to_radians().sin());
                // At the foot of the bead the crown begins a little lower.
                let foot = [1.0, 1.02].map(|share| half_width - bead_m * share);
                sheet.split(&|p| solid.inset(p), &[&crown[..], &bead[..], &foot[..]].concat());
            }
        }
        sheet.extrude(&solid, self.middle_x_m)
    }
}

impl Sheet {
    /// A triangulated grid over the outline, two cells more on each side.
    fn grid(tool: &ToolSpec, solid: &Solid) -> Self {
        let [lo, hi] = tool.outline_bounds();
        let size = ((hi - lo) / STEP_M).ceil();
        let (columns, rows) = (size.x as usize + 4, size.y as usize + 4);
        let node = |k: usize| lo + DVec2::new((k % columns) as f64 - 1.37, (k / columns) as f64 - 1.41) * STEP_M;
        let points: Vec<DVec2> = (0..columns * rows).map(node).collect();
        let mut triangles = Vec::new();
        for j in 0..rows - 1 {
            for i in 0..columns - 1 {
                let vertex = |di: usize, dj: usize| ((j + dj) * columns + i + di) as u32;
                let (a, b, c, d) = (vertex(0, 0), vertex(1, 0), vertex(1, 1), vertex(0, 1));
                // Cells wholly outside are never part of the tool.
                if [a, b, c, d].iter().all(|&v| solid.outline_distance(points[v as usize]) > 2.0 * STEP_M) {
                    continue;
                }
                if (i + j) % 2 == 0 {
                    triangles.extend([[a, b, c], [a, c, d]]);
                } else {
                    triangles.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
        Self { points, triangles }
    }

    /// Cuts every triangle along the lines where `value` is one of `levels`, so that afterwards each lies on one side of
    /// them. A cut point belongs to an edge, so neighbors stay connected.
    fn split(&mut self, value: &dyn Fn(DVec2) -> f64, levels: &[f64]) {
        for &level in levels {
            // A vertex that is nearly on the line becomes one of it: no slivers.
            let snap = 1e-3 * STEP_M;
            let mut values: Vec<f64> = self.points.iter().map(|p| value(*p) - level).collect();
            values.iter_mut().filter(|v| v.abs() < snap).for_each(|v| *v = 0.0);
            let mut cuts: HashMap<(u32, u32), u32> = HashMap::new();
            let points = &mut self.points;
            let mut cut = |a: u32, b: u32| {
                *cuts.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let (mut low, mut high) = (points[a as usize], points[b as usize]);
                    if values[a as usize] > 0.0 {
                        std::mem::swap(&mut low, &mut high);
                    }
                    for _ in 0..40 {
                        let middle = 0.5 * (low + high);
                        if value(middle) < level { low = middle } else { high = middle }
                    }
                    points.push(0.5 * (low + high));
                    (points.len() - 1) as u32
                })
            };
            let mut triangles = Vec::with_capacity(self.triangles.len());
            for t in std::mem::take(&mut self.triangles) {
                let side = t.map(|v| values[v as usize].partial_cmp(&0.0).map_or(0, |order| order as i8));
                if !(side.contains(&-1) && side.contains(&1)) {
                    triangles.push(t);
                } else if let Some(k) = side.iter().position(|&s| s == 0) {
                    // Through a corner: two triangles.
                    let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                    let m = cut(b, c);
                    triangles.extend([[a, b, m], [a, m, c]]);
                } else {
                    // One corner is alone on its side.
                    let alone = |k: &usize| side[*k] != side[(*k + 1) % 3] && side[*k] != side[(*k + 2) % 3];
                    let k = (0..3).find(alone).unwrap_or(0);
                    let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
                    let (m, n) = (cut(a, b), cut(a, c));
                    triangles.extend([[a, m, n], [m, b, c], [m, c, n]]);
                }
            }
            self.triangles = triangles;
        }
    }

    /// Both faces and the walls between them.
    fn extrude(self, solid: &Solid, middle_x_m: f64) -> TriMesh {
        let mut index = vec![u32::MAX; self.points.len()];
        let mut vertices = Vec::new();
        for &v in self.triangles.iter().flatten() {
            if index[v as usize] == u32::MAX {
                index[v as usize] = vertices.len() as u32;
                let p = self.points[v as usize];
                // A vertex of the outline may be rounded to the outside: then the wall's own height counts.
                let h = solid.height(p).or_else(|| solid.height(p - 3e-6 * gradient(solid, p))).unwrap_or(0.0);
                vertices.push(DVec3::new(middle_x_m + h, p.x, p.y));
                vertices.push(DVec3::new(middle_x_m - h, p.x, p.y));
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

/// Direction out of the outline at `p`.
fn gradient(solid: &Solid, p: DVec2) -> DVec2 {
    const STEP_M: f64 = 1e-6;
    let along = |axis: DVec2| solid.outline_distance(p + axis * STEP_M) - solid.outline_distance(p - axis * STEP_M);
    DVec2::new(along(DVec2::X), along(DVec2::Y)).normalize_or_zero()
}
