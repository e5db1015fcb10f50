//! The image of one finger's membrane: its height over the middle plane, by bands of lengths.

use glam::{DVec2, Vec3};
use nalgebra::{SMatrix, SVector};

use super::smooth::{Band, Smooth};
use crate::align::PadImage;
use crate::mesh::sampling::spread;
use crate::relax::Field;

/// The zone is where the free membrane lies less than this above its floor, at least, meters, and less than this share of
/// the tool's height above it: there the template's plane and the free membrane are the same to the tool.
const ZONE_M: f32 = 0.5e-3;
const ZONE_SHARE: f64 = 0.2;
/// Heights beyond these are no membrane of a closed gripper, meters.
const LOWEST_M: f32 = -0.05;
/// Spacing of the image's grid, meters: the finest band is as wide.
const STEP_M: f64 = 0.75e-3;
/// Highest floor, meters: a gripper that is wide open.
const HIGHEST_M: f32 = 0.05;
/// Greatest height that counts, meters.
const CLIP_M: f32 = 0.012;
/// Margin of the image around the zone, meters.
const MARGIN_M: f64 = 0.003;
/// Pixels nearer to the zone's border are not compared, meters: beyond it the membrane is not the template's.
const BORDER_M: f64 = 3e-3;
/// Columns beyond the zone's that are looked at.
const AROUND: usize = 8;
/// Fewest pixels of a zone.
const MIN_PIXELS: usize = 64;
/// Least weight under the narrowest Gaussian, of 1 where there is a pixel for each node.
const MIN_WEIGHT: f32 = 0.05;

/// Greatest weight of a node, in pixels.
const NODE_WEIGHT: f32 = 1.0;

/// The image of one finger.
pub(super) struct Image {
    /// The sign of x on the finger's side of the middle plane.
    pub(super) side: f64,
    /// The Laplacian of the free membrane's height in the zone, 1/m.
    pub(super) curvature: f64,
    /// Height of the plane that it reaches, over the middle plane, meters.
    pub(super) floor_m: f64,
    origin: DVec2,
    /// Nodes of the zone with depth: column and row.
    nodes: Vec<[u16; 2]>,
    weight: Smooth,
    weighted: Smooth,
}

/// The rays of a camera: the direction of pixel (u, v) is `first + u across + v down`, grasp frame, for a depth of one.
struct Rays {
    first: Vec3,
    across: Vec3,
    down: Vec3,
    from: Vec3,
    side: f32,
}

impl Rays {
    fn new(image: &PadImage<'_>) -> Option<Self> {
        let camera = image.camera;
        let direction = |u: f64, v: f64| camera.grasp_from_camera.matrix3 * camera.lift(u, v, 1.0);
        let first = direction(0.0, 0.0);
        let from = camera.grasp_from_camera.translation;
        let rays = Self {
            first: first.as_vec3(),
            across: (direction(1.0, 0.0) - first).as_vec3(),
            down: (direction(0.0, 1.0) - first).as_vec3(),
            from: from.as_vec3(),
            side: from.x.signum() as f32,
        };
        let all = [rays.first, rays.across, rays.down, rays.from];
        (all.iter().all(|v| v.is_finite()) && from.x != 0.0).then_some(rays)
    }

    #[inline]
    fn height(&self, direction_x: f32, depth: f32) -> f32 {
        self.side * (self.from.x + depth * direction_x)
    }
}

/// Zone in which the free membranes would meet.
struct Zone {
    /// For each row the first and one past the last column.
    spans: Vec<[usize; 2]>,
    /// The same for the pixels farther than [`BORDER_M`] from the zone's border.
    inner: Vec<[usize; 2]>,
    low: DVec2,
    high: DVec2,
    curvature: f64,
    /// Height of the plane that the free membrane reaches: the middle plane, or where it ends before that, meters.
    floor_m: f32,
}

impl Zone {
    fn new(image: &PadImage<'_>, rays: &Rays, top_m: f64) -> Option<Self> {
        let reference = &image.camera.depth_reference;
        let floor_m = floor(image, rays);
        let zone_m = floor_m + ZONE_M.max((ZONE_SHARE * (top_m - f64::from(floor_m))) as f32);
        let mut spans = vec![[0usize; 2]; reference.height()];
        let mut pixels = 0;
        for (v, span) in spans.iter_mut().enumerate() {
            let start = rays.first.x + v as f32 * rays.down.x;
            let inside = |(u, depth): (usize, &f32)| {
                let height = rays.height(start + u as f32 * rays.across.x, *depth);
                height < zone_m && height > LOWEST_M
            };
            let row = reference.row(v);
            if let Some(first) = row.iter().enumerate().position(inside) {
                let last = row.iter().enumerate().rposition(inside).unwrap_or(first);
                *span = [first, last + 1];
                pixels += last + 1 - first;
            }
        }
        if pixels < MIN_PIXELS {
            return None;
        }
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let mut shape = Quadratic::default();
        let every = (pixels / 400).max(1);
        let mut count = 0;
        for (v, &[first, end]) in spans.iter().enumerate() {
            for u in first..end {
                count += 1;
                let ends = u == first || u + 1 == end;
                if count % every != 0 && !ends {
                    continue;
                }
                let depth = reference[(u, v)];
                let p = rays.from + depth * (rays.first + u as f32 * rays.across + v as f32 * rays.down);
                let height = rays.side * p.x;
                if !(height < zone_m && height > LOWEST_M) {
                    continue;
                }
                let yz = DVec2::new(f64::from(p.y), f64::from(p.z));
                (low, high) = (low.min(yz), high.max(yz));
                if count % every == 0 {
                    shape.add(yz, f64::from(height));
                }
            }
        }
        let size = high - low;
        let sized = size.is_finite() && size.min_element() > 4.0 * STEP_M && size.max_element() < 0.3;
        let inner = shrunk(&spans, BORDER_M, image);
        sized.then_some(Self { spans, inner, low, high, curvature: shape.laplacian(), floor_m })
    }
}

/// Spans without a border of this width, meters.
fn shrunk(spans: &[[usize; 2]], border_m: f64, image: &PadImage<'_>) -> Vec<[usize; 2]> {
    let reference = &image.camera.depth_reference;
    let Some(middle) = spans.iter().position(|s| s[0] < s[1]) else { return spans.to_vec() };
    let depth = f64::from(reference[(spans[middle][0], middle)]);
    let focal = image.camera.intrinsics.fx.min(image.camera.intrinsics.fy);
    let border = (border_m * focal / depth.max(1e-3)).round().min(100.0) as usize;
    let at = |row: usize| {
        let (mut first, mut end) = (0, usize::MAX);
        for other in row.saturating_sub(border)..=row + border {
            let way = border - row.abs_diff(other);
            let [a, b] = spans.get(other).copied().unwrap_or([0, 0]);
            (first, end) = (first.max(a + way), end.min(b.saturating_sub(way)));
        }
        if first < end && row >= border { [first, end] } else { [0, 0] }
    };
    (0..spans.len()).map(at).collect()
}

/// The height that a thirtieth of the free membrane stays below, at least that of the middle plane, meters.
fn floor(image: &PadImage<'_>, rays: &Rays) -> f32 {
    const EVERY: usize = 7;
    let reference = &image.camera.depth_reference;
    let mut heights = Vec::with_capacity(reference.len() / (EVERY * EVERY) + 1);
    for v in (0..reference.height()).step_by(EVERY) {
        let start = rays.first.x + v as f32 * rays.down.x;
        for (u, depth) in reference.row(v).iter().enumerate().skip(v % EVERY).step_by(EVERY) {
            let height = rays.height(start + u as f32 * rays.across.x, *depth);
            if height > LOWEST_M && *depth > 0.0 {
                heights.push(height);
            }
        }
    }
    if heights.is_empty() {
        return 0.0;
    }
    let low = heights.len() / 30;
    heights.select_nth_unstable_by(low, f32::total_cmp).1.clamp(0.0, HIGHEST_M)
}

/// Least squares of a quadratic surface.
#[derive(Default)]
struct Quadratic {
    origin: Option<DVec2>,
    h: SMatrix<f64, 6, 6>,
    g: SVector<f64, 6>,
}

impl Quadratic {
    fn add(&mut self, yz: DVec2, height: f64) {
        /// Makes the terms comparable.
        const UNIT_M: f64 = 0.01;
        let p = (yz - *self.origin.get_or_insert(yz)) / UNIT_M;
        let terms = SVector::from([1.0, p.x, p.y, p.x * p.x, p.x * p.y, p.y * p.y]);
        self.h += terms * terms.transpose();
        self.g += terms * (height / (UNIT_M * UNIT_M));
    }

    /// 1/m; 0 where nothing determines it.
    fn laplacian(self) -> f64 {
        let found = self.h.cholesky().map(|c| c.solve(&self.g));
        found.map(|f| 2.0 * (f[3] + f[5])).filter(|c| c.is_finite()).unwrap_or(0.0)
    }
}

/// The middle of a membrane image and what surrounds it, as sums of heights and of weights.
struct Splat {
    origin: DVec2,
    weight: Field,
    weighted: Field,
    inside: Vec<bool>,
}

impl Splat {
    fn new(image: &PadImage<'_>, rays: &Rays, zone: &Zone) -> Self {
        let floor_m = zone.floor_m;
        let origin = zone.low - MARGIN_M;
        let count = ((zone.high + MARGIN_M - origin) / STEP_M).ceil() + 1.0;
        let (columns, rows) = (count.x as usize, count.y as usize);
        let mut splat = Self {
            origin,
            weight: Field::filled(columns, rows, 0.0),
            weighted: Field::filled(columns, rows, 0.0),
            inside: vec![false; columns * rows],
        };
        let scale = (1.0 / STEP_M) as f32;
        let from = Vec3::new(rays.from.x, rays.from.y - origin.x as f32, rays.from.z - origin.y as f32);
        let (last_y, last_z) = ((columns - 1) as f32, (rows - 1) as f32);
        let reference = &image.camera.depth_reference;
        for (v, (&[first, end], inner)) in zone.spans.iter().zip(&zone.inner).enumerate() {
            let start = rays.first + v as f32 * rays.down;
            if first == end {
                continue;
            }
            let columns_seen = first.saturating_sub(AROUND)..(end + AROUND).min(reference.width());
            let pixels = image.imprint.row(v).iter().zip(reference.row(v)).enumerate();
            for (u, (imprint, reference)) in pixels.take(columns_seen.end).skip(columns_seen.start) {
                let depth = reference - imprint;
                let direction = start + u as f32 * rays.across;
                let height = rays.height(direction.x, depth);
                let y = (from.y + depth * direction.y) * scale;
                let z = (from.z + depth * direction.z) * scale;
                let usable = depth > 0.0 && *reference > 0.0 && height > LOWEST_M;
                // False for what is not a number.
                if !(usable && y >= 0.0 && z >= 0.0 && y < last_y && z < last_z) {
                    continue;
                }
                let (column, row) = (y as usize, z as usize);
                let (fy, fz) = (y - column as f32, z - row as f32);
                let at = row * columns + column;
                let height = height.min(CLIP_M) - rays.height(direction.x, *reference).max(floor_m);
                let (near, far) = ([(1.0 - fy) * (1.0 - fz), fy * (1.0 - fz)], [(1.0 - fy) * fz, fy * fz]);
                for (node, weight) in
                    [(at, near[0]), (at + 1, near[1]), (at + columns, far[0]), (at + columns + 1, far[1])]
                {
                    splat.weight.values[node] += weight;
                    splat.weighted.values[node] += weight * height;
                }
                if u >= inner[0] && u < inner[1] {
                    let nearest = at + usize::from(fy >= 0.5) + columns * usize::from(fz >= 0.5);
                    splat.inside[nearest] = true;
                }
            }
        }
        // A slope that faces the camera has more pixels than one that is turned away, and counts no more for that.
        for (weight, weighted) in splat.weight.values.iter_mut().zip(&mut splat.weighted.values) {
            if *weight > NODE_WEIGHT {
                *weighted *= NODE_WEIGHT / *weight;
                *weight = NODE_WEIGHT;
            }
        }
        splat
    }
}

impl Image {
    /// `None` where the free membrane does not reach the middle plane, or the camera cannot be right.
    pub(super) fn new(image: &PadImage<'_>, tops_m: [f64; 2]) -> Option<Self> {
        if image.imprint.size() != image.camera.depth_reference.size() || !image.camera.intrinsics.is_plausible() {
            return None;
        }
        let rays = Rays::new(image)?;
        let zone = Zone::new(image, &rays, tops_m[usize::from(rays.side > 0.0)])?;
        let splat = Splat::new(image, &rays, &zone);
        let columns = splat.weight.columns;
        let (weight, weighted) = (Smooth::new(&splat.weight, STEP_M), Smooth::new(&splat.weighted, STEP_M));
        let nodes: Vec<[u16; 2]> = (0..splat.inside.len())
            .filter(|&i| splat.inside[i])
            .map(|i| [i % columns, i / columns])
            .filter(|[column, row]| weight.at(0, *column, *row) >= MIN_WEIGHT)
            .map(|at| at.map(|n| n as u16))
            .collect();
        let side = f64::from(rays.side);
        Some(Self {
            side,
            curvature: zone.curvature,
            floor_m: f64::from(zone.floor_m),
            origin: splat.origin,
            nodes,
            weight,
            weighted,
        })
    }

    /// Nodes of the zone with depth.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Their area, square meters.
    pub(super) fn area_m2(&self) -> f64 {
        self.nodes.len() as f64 * STEP_M * STEP_M
    }

    /// At most `count` nodes, spread evenly: their places `(y, z)` in the grasp frame and the band of the height there,
    /// meters.
    pub(super) fn sample(&self, band: Band, count: usize) -> impl ExactSizeIterator<Item = (DVec2, f32)> + '_ {
        spread(self.nodes.len(), count).into_iter().map(move |i| {
            let [column, row] = self.nodes[i].map(usize::from);
            let mean = |sigma: usize| self.weighted.at(sigma, column, row) / self.weight.at(sigma, column, row);
            let place = self.origin + DVec2::new(column as f64, row as f64) * STEP_M;
            (place, mean(band[0]) - mean(band[1]))
        })
    }
}
