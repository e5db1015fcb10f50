//! [`DistanceField`]: the tool's silhouette as a signed distance that costs one look-up.
//!
//! The mesh is projected along x (the closing axis) onto the y-z plane of the object frame. Outside the silhouette
//! the stored distances are exact: to the nearest projected edge. Inside they are exact to about a tenth of a
//! millimeter, which is enough because registration charges nothing there.

use glam::{DVec2, DVec3};

use super::mesh::TriMesh;

/// Cell size, meters.
pub(crate) const CELL_M: f64 = 0.25e-3;
/// Border around the silhouette, meters: the prior's shift plus what a scene adds before it counts as lost anyway.
const MARGIN_M: f64 = 0.012;
/// Why a mesh has no field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// No triangle with finite corners.
    #[error("the mesh has no triangle with finite corners: check that the CAD file is not empty")]
    Empty,
    /// A triangle names a corner that does not exist.
    #[error("triangle {triangle} of the mesh names a corner that does not exist: the CAD file is damaged")]
    Index {
        /// Position in the list of triangles.
        triangle: usize,
    },
    /// The bounding box cannot be a tool in meters.
    #[error(
        "the mesh is {} long, which cannot be meters{}",
        super::units::significant(*.size),
        .scale.map_or(String::new(), |s| format!(": scale it by {s}"))
    )]
    Units {
        /// Longest side of the bounding box, in the file's unit.
        size: f64,
        /// The factor that would make it plausible, if one of the usual ones does.
        scale: Option<f64>,
    },
}

/// Value and slope of the field at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldSample {
    /// Signed distance, meters, negative inside the silhouette.
    pub distance: f64,
    /// Derivative of the distance by y and z; length about 1 outside.
    pub gradient: DVec2,
    /// True where the point lies on the stored grid. Off it, the distance to the grid is added.
    pub on_grid: bool,
}

/// Signed distance to the silhouette in the y-z plane of the object frame, on a regular grid, meters.
#[derive(Clone, Debug, PartialEq)]
pub struct DistanceField {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Center of cell (0, 0).
    pub(super) origin: DVec2,
    /// Row by row: y runs along a row, z over the rows.
    pub(super) values: Vec<f32>,
}

impl DistanceField {
    /// Projects the mesh and measures it: a few milliseconds for a tool of 10,000 triangles.
    ///
    /// Holes in the mesh, overlapping parts, inverted and degenerate triangles do not matter; triangles with corners
    /// that are not finite are left out.
    ///
    /// # Errors
    /// [`FieldError`] if nothing is left, an index is wrong, or the size cannot be meters.
    pub fn from_mesh(mesh: &TriMesh) -> Result<Self, FieldError> {
        let corners = mesh.vertices.len();
        if let Some(triangle) = mesh.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= corners)) {
            return Err(FieldError::Index { triangle });
        }
        let triangles = mesh.sound_triangles();
        let bounds = triangles.iter().flatten().map(|c| [*c, *c]).reduce(|[lo, hi], [c, _]| [lo.min(c), hi.max(c)]);
        let [low, high] = bounds.ok_or(FieldError::Empty)?;
        let size = (high - low).max_element();
        let scale = super::units::scale_to_meters(size);
        if scale != Some(1.0) {
            return Err(FieldError::Units { size, scale });
        }
        let silhouette = [DVec2::new(low.y, low.z), DVec2::new(high.y, high.z)];
        let origin = silhouette[0] - MARGIN_M;
        let cells = ((silhouette[1] + MARGIN_M - origin) / CELL_M).ceil();
        let raster = Raster { columns: cells.x as usize + 1, rows: cells.y as usize + 1, origin };
        let values = raster.signed_distance(&triangles);
        Ok(Self { columns: raster.columns, rows: raster.rows, origin, values })
    }

    /// Columns (along y) and rows (along z).
    pub fn size(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// The stored value of a cell, meters, and its center `(y, z)`; `None` outside the grid.
    pub fn cell(&self, column: usize, row: usize) -> Option<(DVec2, f32)> {
        (column < self.columns && row < self.rows).then(|| {
            let center = self.origin + DVec2::new(column as f64, row as f64) * CELL_M;
            (center, self.values[row * self.columns + column])
        })
    }

    /// Signed distance (meters) and slope at `(y, z)` in the object frame, bilinear between cell centers.
    ///
    /// A point that is not finite gives NaN.
    #[inline]
    pub fn sample(&self, yz: DVec2) -> FieldSample {
        let grid = (yz - self.origin) * (1.0 / CELL_M);
        let (max_x, max_y) = ((self.columns - 1) as f64, (self.rows - 1) as f64);
        if !(grid.x >= 0.0 && grid.y >= 0.0 && grid.x < max_x && grid.y < max_y) {
            return self.sample_off_grid(yz);
        }
        let (column, row) = (grid.x as usize, grid.y as usize);
        let (fx, fy) = (grid.x - column as f64, grid.y - row as f64);
        let index = row * self.columns + column;
        let low = &self.values[index..index + 2];
        let high = &self.values[index + self.columns..index + self.columns + 2];
        let (a, b, c, d) = (f64::from(low[0]), f64::from(low[1]), f64::from(high[0]), f64::from(high[1]));
        let (ab, cd) = (b - a, d - c);
        let (near, far) = (a + ab * fx, c + cd * fx);
        FieldSample {
            distance: near + (far - near) * fy,
            gradient: DVec2::new(ab + (cd - ab) * fy, far - near) * (1.0 / CELL_M),
            on_grid: true,
        }
    }

    /// The value at the nearest point of the grid plus the way there.
    #[cold]
    fn sample_off_grid(&self, yz: DVec2) -> FieldSample {
        if !yz.is_finite() {
            return FieldSample { distance: f64::NAN, gradient: DVec2::NAN, on_grid: false };
        }
        // Half a cell inwards, so that the look-up below is on the grid and never comes back here.
        let end = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64);
        let low = self.origin + 0.5 * CELL_M;
        let high = self.origin + (end - 0.5) * CELL_M;
        let edge = yz.clamp(low, high);
        let inner = self.sample(edge);
        let way = yz - edge;
        let length = way.length();
        let outwards = way / length.max(1e-12);
        // Along a side of the grid the inner value still changes; across it the way does.
        let slope = |way: f64, outwards: f64, inner: f64| if way == 0.0 { inner } else { outwards };
        let gradient =
            DVec2::new(slope(way.x, outwards.x, inner.gradient.x), slope(way.y, outwards.y, inner.gradient.y));
        FieldSample { distance: inner.distance + length, gradient, on_grid: false }
    }
}

/// No candidate yet.
const NONE: u32 = u32::MAX;

/// Working grid in cell units: cell `(i, j)` has its center at `(i, j)`.
struct Raster {
    columns: usize,
    rows: usize,
    origin: DVec2,
}

impl Raster {
    fn signed_distance(&self, triangles: &[[DVec3; 3]]) -> Vec<f32> {
        let triangles: Vec<[DVec2; 3]> =
            triangles.iter().map(|t| t.map(|p| (DVec2::new(p.y, p.z) - self.origin) * (1.0 / CELL_M))).collect();
        let inside = self.fill(&triangles);

        // Outside: the nearest edge of any triangle. Seeds next to the silhouette, then carried outwards.
        let segments: Vec<Segment> = triangles
            .iter()
            .flat_map(|&[a, b, c]| [Segment::new(a, b), Segment::new(b, c), Segment::new(c, a)])
            .collect();
        let mut outside = Sweep::new(self.columns, self.rows, inside.iter().map(|i| !i));
        for id in 0..segments.len() {
            outside.seed_along(id as u32, &segments);
        }
        outside.spread(&segments);

        // Inside: short pieces of the outline, each around the point that an outside cell found. They are used
        // instead of the edges because edges run on through the body where parts cross.
        let mut pieces: Vec<Segment> = Vec::new();
        let mut interior = Sweep::new(self.columns, self.rows, inside.iter().copied());
        for row in 0..self.rows {
            for column in 0..self.columns {
                let cell = outside.get(column, row);
                if cell.owner == NONE || cell.squared > 2.3 {
                    continue;
                }
                let center = DVec2::new(column as f64, row as f64);
                let segment = &segments[cell.owner as usize];
                let foot = segment.nearest(center);
                let away = (center - foot).try_normalize().unwrap_or_else(|| segment.along.perp());
                let half = away.try_normalize().unwrap_or(DVec2::X).perp() * 0.7;
                pieces.push(Segment::new(foot - half, foot + half));
                interior.seed_around(pieces.len() as u32 - 1, foot, &pieces);
            }
        }
        interior.spread(&pieces);

        let mut values = Vec::with_capacity(inside.len());
        for (i, inside) in inside.iter().enumerate() {
            let (column, row) = (i % self.columns, i / self.columns);
            let cells = if *inside {
                -interior.get(column, row).squared.sqrt()
            } else {
                outside.get(column, row).squared.sqrt()
            };
            values.push((cells * CELL_M) as f32);
        }
        values
    }

    /// Cells whose center lies in or on a projected triangle, row by row.
    fn fill(&self, triangles: &[[DVec2; 3]]) -> Vec<bool> {
        /// Centers this close to an edge (in cells) count as inside, so that shared edges leave no gaps.
        const TOUCH: f64 = 1e-9;
        let mut inside = vec![false; self.columns * self.rows];
        for t in triangles {
            let low = t[0].min(t[1]).min(t[2]);
            let high = t[0].max(t[1]).max(t[2]);
            let rows = (low.y - TOUCH).ceil().max(0.0) as usize..=high.y.floor() as usize;
            for row in rows {
                let y = row as f64;
                let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
                for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                    let (a, b) = if a.y <= b.y { (a, b) } else { (b, a) };
                    if y < a.y - TOUCH || y > b.y + TOUCH {
                        continue;
                    }
                    let rise = b.y - a.y;
                    if rise <= TOUCH {
                        from = from.min(a.x.min(b.x));
                        to = to.max(a.x.max(b.x));
                    } else {
                        let x = a.x + (b.x - a.x) * ((y - a.y) / rise).clamp(0.0, 1.0);
                        from = from.min(x);
                        to = to.max(x);
                    }
                }
                let (from, to) = ((from - TOUCH).ceil().max(0.0), (to + TOUCH).floor());
                if from <= to {
                    let start = row * self.columns;
                    inside[start + from as usize..=start + to as usize].fill(true);
                }
            }
        }
        inside
    }
}

/// A segment in cell units, prepared for many distance questions.
#[derive(Clone, Copy)]
struct Segment {
    from: DVec2,
    along: DVec2,
    /// One over the squared length; 0 for a point.
    scale: f64,
}

impl Segment {
    fn new(from: DVec2, to: DVec2) -> Self {
        let along = to - from;
        let squared = along.length_squared();
        Self { from, along, scale: if squared > 0.0 { 1.0 / squared } else { 0.0 } }
    }

    fn nearest(&self, p: DVec2) -> DVec2 {
        self.from + self.along * ((p - self.from).dot(self.along) * self.scale).clamp(0.0, 1.0)
    }
}

/// Nearest-segment transform: every member cell learns its nearest segment by asking its neighbors for theirs.
///
/// The grid has a border of one cell that never takes part, so that neighbors need no bounds check.
struct Sweep {
    columns: usize,
    rows: usize,
    /// Cells from one row to the next.
    stride: usize,
    cells: Vec<SweepCell>,
}

#[derive(Clone, Copy)]
struct SweepCell {
    /// Squared distance in cells; negative for cells that do not take part, so that nothing is nearer.
    squared: f64,
    owner: u32,
}

impl Sweep {
    /// `member` says row by row which cells take part.
    fn new(columns: usize, rows: usize, member: impl Iterator<Item = bool>) -> Self {
        let stride = columns + 2;
        let mut cells = vec![SweepCell { squared: -1.0, owner: NONE }; stride * (rows + 2)];
        for (i, _) in member.enumerate().filter(|(_, takes_part)| *takes_part) {
            cells[(i / columns + 1) * stride + i % columns + 1].squared = f64::INFINITY;
        }
        Self { columns, rows, stride, cells }
    }

    fn get(&self, column: usize, row: usize) -> SweepCell {
        self.cells[(row + 1) * self.stride + column + 1]
    }

    #[inline]
    fn offer(&mut self, index: usize, center: DVec2, id: u32, segments: &[Segment]) {
        let squared = (segments[id as usize].nearest(center) - center).length_squared();
        let cell = &mut self.cells[index];
        if squared < cell.squared {
            *cell = SweepCell { squared, owner: id };
        }
    }

    /// Offers a segment to the cells around a point of the grid.
    fn seed_around(&mut self, id: u32, point: DVec2, segments: &[Segment]) {
        let (column, row) = (point.x.round() as usize, point.y.round() as usize);
        for r in row.saturating_sub(1)..=(row + 1).min(self.rows - 1) {
            for c in column.saturating_sub(1)..=(column + 1).min(self.columns - 1) {
                let index = (r + 1) * self.stride + c + 1;
                if self.cells[index].squared > 0.0 {
                    self.offer(index, DVec2::new(c as f64, r as f64), id, segments);
                }
            }
        }
    }

    /// Offers a segment to the cells along it.
    fn seed_along(&mut self, id: u32, segments: &[Segment]) {
        let Segment { from, along, .. } = segments[id as usize];
        let steps = (along.length() * 0.8).ceil().max(1.0);
        for i in 0..=steps as usize {
            self.seed_around(id, from + along * (i as f64 / steps), segments);
        }
    }

    /// Two passes over the grid, each asking the neighbors that were visited before, there and back in a row.
    fn spread(&mut self, segments: &[Segment]) {
        let s = self.stride;
        for row in 0..self.rows {
            let start = (row + 1) * s + 1;
            for column in 0..self.columns {
                let index = start + column;
                self.ask(index, column, row, [index - 1, index - s - 1, index - s, index - s + 1], segments);
            }
            for column in (0..self.columns).rev() {
                self.ask(start + column, column, row, [start + column + 1], segments);
            }
        }
        for row in (0..self.rows).rev() {
            let start = (row + 1) * s + 1;
            for column in (0..self.columns).rev() {
                let index = start + column;
                self.ask(index, column, row, [index + 1, index + s + 1, index + s, index + s - 1], segments);
            }
            for column in 0..self.columns {
                self.ask(start + column, column, row, [start + column - 1], segments);
            }
        }
    }

    #[inline]
    fn ask<const N: usize>(
        &mut self,
        index: usize,
        column: usize,
        row: usize,
        neighbors: [usize; N],
        segments: &[Segment],
    ) {
        let cell = self.cells[index];
        if cell.squared <= 0.0 {
            return;
        }
        // Neighbors mostly agree with each other and with the cell: ask about each segment once.
        let (own, mut last) = (cell.owner, NONE);
        for neighbor in neighbors {
            let id = self.cells[neighbor].owner;
            if id != NONE && id != last && id != own {
                last = id;
                self.offer(index, DVec2::new(column as f64, row as f64), id, segments);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::testing::{cross, cuboid};
    use glam::DVec3;
    use proptest::prelude::*;

    fn rectangle_distance(half: DVec2, p: DVec2) -> f64 {
        let q = p.abs() - half;
        q.max(DVec2::ZERO).length() + q.max_element().min(0.0)
    }

    fn field_of_cross() -> &'static DistanceField {
        static FIELD: std::sync::OnceLock<DistanceField> = std::sync::OnceLock::new();
        FIELD.get_or_init(|| DistanceField::from_mesh(&cross()).unwrap())
    }

    proptest! {
        #[test]
        fn agrees_with_the_exact_cross(y in -0.05..0.05f64, z in -0.05..0.05f64) {
            // The cross of two bars turned by 30 degrees: outside, the distance is the smaller of the two.
            let p = DVec2::new(y, z);
            let turned = DVec2::from_angle(-std::f64::consts::FRAC_PI_6).rotate(p);
            let exact = rectangle_distance(DVec2::new(0.02, 0.003), turned)
                .min(rectangle_distance(DVec2::new(0.003, 0.03), turned));
            let sample = field_of_cross().sample(p);
            prop_assert!(sample.on_grid || exact > 0.01);
            if exact > 2e-4 && sample.on_grid {
                // Cell values are exact; what is left is bilinear interpolation where two edges are equally near.
                prop_assert!((sample.distance - exact).abs() < 1.2e-4, "{} for {exact}", sample.distance);
            } else if sample.on_grid {
                // Inside, each bar alone gives a bound: where they cross, the outline is farther than either says.
                prop_assert!(sample.distance < exact + 2e-4, "{} for {exact}", sample.distance);
                prop_assert!(sample.distance > -6e-3, "no point is deeper than the crossing");
            }
            let step = 1e-7;
            for (axis, slope) in [(DVec2::X, sample.gradient.x), (DVec2::Y, sample.gradient.y)] {
                let numeric = (field_of_cross().sample(p + axis * step).distance - sample.distance) / step;
                // A step over a cell border is a kink of the interpolation, not an error of the slope.
                prop_assert!((numeric - slope).abs() < 0.6, "{numeric} for {slope}");
            }
        }
    }

    #[test]
    fn units_are_checked_and_a_scale_is_offered() {
        let scaled = |s: f64| {
            let mesh = cuboid(DVec3::ZERO, DVec3::new(0.003, 0.003, 0.03) * s);
            DistanceField::from_mesh(&mesh).map(|_| ())
        };
        assert_eq!(scaled(1.0), Ok(()));
        assert!(matches!(scaled(1000.0), Err(FieldError::Units { scale: Some(s), .. }) if s == 1e-3));
        assert!(matches!(scaled(1e-3), Err(FieldError::Units { scale: Some(s), .. }) if s == 1e3));
        assert!(matches!(scaled(1e9), Err(FieldError::Units { scale: None, .. })));
        let text = scaled(1000.0).unwrap_err().to_string();
        assert!(text.contains("60 long") && text.contains("scale it by 0.001"), "{text}");
    }

    #[test]
    fn broken_meshes_are_refused_or_cleaned() {
        assert_eq!(DistanceField::from_mesh(&TriMesh::default()), Err(FieldError::Empty));
        let mut mesh = cross();
        let clean = DistanceField::from_mesh(&mesh).unwrap();
        mesh.vertices.push(DVec3::NAN);
        let nan = mesh.vertices.len() as u32 - 1;
        mesh.triangles.extend([[0, 1, nan], [0, 0, 0]]);
        assert_eq!(DistanceField::from_mesh(&mesh).unwrap(), clean);
        mesh.triangles.push([0, 1, nan + 1]);
        assert!(matches!(DistanceField::from_mesh(&mesh), Err(FieldError::Index { .. })));
    }

    #[test]
    fn off_grid_and_bad_points_are_answered() {
        let field = field_of_cross();
        let far = field.sample(DVec2::new(1.0, 0.0));
        assert!(!far.on_grid && far.distance > 0.9 && (far.gradient.x - 1.0).abs() < 1e-9);
        assert!(field.sample(DVec2::new(f64::NAN, 0.0)).distance.is_nan());
        assert!(field.sample(DVec2::new(f64::INFINITY, 0.0)).distance.is_nan());
        assert_eq!(field.cell(usize::MAX, 0), None);
        assert!(field.cell(0, 0).unwrap().1 > 0.01);
    }
}
