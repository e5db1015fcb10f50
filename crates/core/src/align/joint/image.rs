//! The image of one finger's membrane: its height over the middle plane, by bands of lengths.

use glam::{DVec2, Vec3};
use nalgebra::{SMatrix, SVector};

use super::smooth::{Band, Layer, Smooth};
use crate::align::PadImage;
use crate::align::lanes::{MAGIC, MAGIC_MASK};
use crate::frames::PlanarPose;
use crate::mesh::sampling::spread;
use crate::tent::FreeShape;

/// The zone is where the free membrane lies less than this above its lowest part, at least, meters, and less than a share of the
/// tool's height above it: one that reaches the middle plane is the template's plane only there, and one that hangs over it falls
/// off to the rim, whatever the tool.
const ZONE_M: f32 = 0.5e-3;
const ZONE_SHARE: f64 = 0.4;
const HANGING_ZONE_SHARE: f64 = 0.65;
/// A free membrane whose lowest part is nearer to the middle plane reaches it, meters.
const REACHES_M: f64 = 1e-3;
/// Heights beyond these are no membrane of a closed gripper, meters.
const LOWEST_M: f32 = -0.05;
/// Spacing of the image's grid, meters: about the width of the narrowest Gaussian.
const STEP_M: f64 = 1e-3;
/// Pixels that are placed at once.
const LANES: usize = 8;
/// Pixels from which the shape of the free membrane is.
const SHAPE_PIXELS: usize = 400;
/// Highest floor, meters: a gripper that is wide open.
const HIGHEST_M: f32 = 0.05;
/// Greatest height over the tool's top that counts, meters.
const CLIP_M: f32 = 0.5e-3;
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
    /// The free membrane about the zone.
    pub(super) free: FreeShape,
    origin: DVec2,
    /// Nodes of the zone with depth: column and row.
    nodes: Vec<[u16; 2]>,
    /// Of weights and weighted heights.
    smooth: Smooth<2>,
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

/// Zone in which the tool shapes the membrane.
struct Zone {
    /// For each row the first and one past the last column.
    spans: Vec<[usize; 2]>,
    /// The same for the pixels farther than [`BORDER_M`] from the zone's border.
    inner: Vec<[usize; 2]>,
    low: DVec2,
    high: DVec2,
    free: FreeShape,
}

impl Zone {
    fn new(image: &PadImage<'_>, rays: &Rays, top_m: f64) -> Option<Self> {
        let reference = &image.camera.depth_reference;
        let floor_m = floor(image, rays);
        let reaches = f64::from(floor_m) < REACHES_M;
        let share = if reaches { ZONE_SHARE } else { HANGING_ZONE_SHARE };
        let zone_m = floor_m + ZONE_M.max((share * (top_m - f64::from(floor_m))) as f32);
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
        let every = (pixels / SHAPE_PIXELS).max(1);
        // Way along the zone's pixels from a row's first one to the next that is asked for the shape.
        let mut next = every - 1;
        for (v, &[first, end]) in spans.iter().enumerate().filter(|(_, span)| span[0] < span[1]) {
            let mut look = |u: usize| {
                let depth = reference[(u, v)];
                let p = rays.from + depth * (rays.first + u as f32 * rays.across + v as f32 * rays.down);
                let height = rays.side * p.x;
                let place = DVec2::new(f64::from(p.y), f64::from(p.z));
                let inside = height < zone_m && height > LOWEST_M;
                if inside {
                    (low, high) = (low.min(place), high.max(place));
                }
                inside.then_some((place, f64::from(height)))
            };
            for u in [first, end - 1] {
                look(u);
            }
            while next < end - first {
                if let Some((place, height)) = look(first + next) {
                    shape.add(place, height);
                }
                next += every;
            }
            next -= end - first;
        }
        let size = high - low;
        let sized = size.is_finite() && size.min_element() > 4.0 * STEP_M && size.max_element() < 0.3;
        let inner = shrunk(&spans, BORDER_M, image);
        sized.then_some(Self { spans, inner, low, high, free: FreeShape { reaches, ..shape.at_origin() } })
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
    /// Makes the terms comparable.
    const UNIT_M: f64 = 0.01;

    fn add(&mut self, yz: DVec2, height: f64) {
        let p = (yz - *self.origin.get_or_insert(yz)) / Self::UNIT_M;
        let terms = SVector::from([1.0, p.x, p.y, p.x * p.x, p.x * p.y, p.y * p.y]);
        self.h += terms * terms.transpose();
        self.g += terms * (height / (Self::UNIT_M * Self::UNIT_M));
    }

    /// The surface about y = z = 0; flat where nothing determines it.
    fn at_origin(self) -> FreeShape {
        let found = self.h.cholesky().map(|c| c.solve(&self.g)).filter(|f| f.iter().all(|v| v.is_finite()));
        let (Some(f), Some(origin)) = (found, self.origin) else { return FreeShape::default() };
        // In units of 0.01 m: terms of the place about the origin of the sums.
        let p = -origin / Self::UNIT_M;
        let height = f[0] + f[1] * p.x + f[2] * p.y + f[3] * p.x * p.x + f[4] * p.x * p.y + f[5] * p.y * p.y;
        let slope = DVec2::new(f[1] + 2.0 * f[3] * p.x + f[4] * p.y, f[2] + f[4] * p.x + 2.0 * f[5] * p.y);
        FreeShape {
            height_m: height * Self::UNIT_M * Self::UNIT_M,
            slope: slope * Self::UNIT_M,
            bend: DVec2::new(2.0 * f[3], 2.0 * f[5]).max(DVec2::ZERO),
            reaches: false,
            of: PlanarPose::default(),
        }
    }
}

/// The middle of a membrane image and what surrounds it, as sums of weights and of heights.
struct Splat {
    origin: DVec2,
    /// Weight and weighted height of each node.
    nodes: Layer<2>,
    inside: Vec<bool>,
}

/// Part of a node's and its right neighbor's weight and weighted height that is from pixels between them.
type Pair = [f32; 4];

/// Pixels of a part of a row: where they lie on the grid, and their heights.
struct Placed {
    node: [u32; LANES],
    nearest: [u32; LANES],
    fy: [f32; LANES],
    fz: [f32; LANES],
    height: [f32; LANES],
}

/// Image, camera and grid, to place pixels on the grid.
struct Placing<'a> {
    rays: &'a Rays,
    /// Origin of the rays about the grid's.
    from: Vec3,
    /// Greatest height that counts, meters.
    clip_m: f32,
    columns: usize,
    rows: usize,
}

impl Placing<'_> {
    /// Every second pixel from `u` on of row `v`; pixels that have no place get the node after the last.
    #[inline]
    fn place(&self, imprint: &[f32; 2 * LANES], reference: &[f32; 2 * LANES], u: usize, v: usize) -> Placed {
        const PER_M: f32 = (1.0 / STEP_M) as f32;
        let rays = self.rays;
        let start = rays.first + v as f32 * rays.down + u as f32 * rays.across;
        let across = 2.0 * rays.across;
        let (last_y, last_z) = ((self.columns - 1) as f32, (self.rows - 1) as f32);
        let columns = self.columns as f32;
        let none = (self.columns * self.rows) as u32;
        let (zero, no_node) = ([0f32; LANES], [none; LANES]);
        let mut placed = Placed { node: no_node, nearest: no_node, fy: zero, fz: zero, height: zero };
        for l in 0..LANES {
            let (imprint, reference, along) = (imprint[2 * l], reference[2 * l], l as f32);
            let depth = reference - imprint;
            let direction_x = start.x + along * across.x;
            let height = rays.height(direction_x, depth);
            let y = (self.from.y + depth * (start.y + along * across.y)) * PER_M;
            let z = (self.from.z + depth * (start.z + along * across.z)) * PER_M;
            // False for what is not a number.
            let usable = (depth > 0.0) & (reference > 0.0) & (height > LOWEST_M);
            let usable = usable & (y >= 0.0) & (z >= 0.0) & (y < last_y) & (z < last_z);
            let (round_y, round_z) = ((y + MAGIC) - MAGIC, (z + MAGIC) - MAGIC);
            let column = if round_y > y { round_y - 1.0 } else { round_y };
            let row = if round_z > z { round_z - 1.0 } else { round_z };
            let whole = |n: f32| if usable { (n + MAGIC).to_bits() & MAGIC_MASK } else { none };
            placed.node[l] = whole(row * columns + column);
            placed.nearest[l] = whole(round_z * columns + round_y);
            placed.fy[l] = y - column;
            placed.fz[l] = z - row;
            let free = rays.height(direction_x, reference);
            let free = if free > 0.0 { free } else { 0.0 };
            placed.height[l] = (if height < self.clip_m { height } else { self.clip_m }) - free;
        }
        placed
    }
}

impl Splat {
    fn new(image: &PadImage<'_>, rays: &Rays, zone: &Zone, top_m: f64) -> Self {
        let origin = zone.low - MARGIN_M;
        let count = ((zone.high + MARGIN_M - origin) / STEP_M).ceil() + 1.0;
        let (columns, rows) = (count.x as usize, count.y as usize);
        let from = Vec3::new(rays.from.x, rays.from.y - origin.x as f32, rays.from.z - origin.y as f32);
        let placing = Placing { rays, from, clip_m: top_m as f32 + CLIP_M, columns, rows };
        // One more than there are, for the pixels that have no place.
        let mut pairs: Vec<Pair> = vec![[0.0; 4]; columns * (rows + 1) + 1];
        let mut inside = vec![false; columns * rows + 1];
        let reference = &image.camera.depth_reference;
        let width = reference.width();
        for (v, (&[first, end], inner)) in zone.spans.iter().zip(&zone.inner).enumerate() {
            if first == end {
                continue;
            }
            // Every second pixel, as on a chessboard.
            let first = first.saturating_sub(AROUND) / 2 * 2 + v % 2;
            let end = (end + AROUND).min(width);
            for u in (first..end).step_by(2 * LANES) {
                let part = |row: &[f32]| -> [f32; 2 * LANES] {
                    let row = &row[u..end.min(u + 2 * LANES)];
                    row.try_into().unwrap_or_else(|_| {
                        let mut part = [f32::NAN; 2 * LANES];
                        part[..row.len()].copy_from_slice(row);
                        part
                    })
                };
                let placed = placing.place(&part(image.imprint.row(v)), &part(reference.row(v)), u, v);
                for l in 0..LANES {
                    let (fy, fz, height) = (placed.fy[l], placed.fz[l], placed.height[l]);
                    let pair = [1.0 - fy, (1.0 - fy) * height, fy, fy * height];
                    let above = placed.node[l] as usize;
                    for (at, share) in [(above, 1.0 - fz), (above + columns, fz)] {
                        pairs[at].iter_mut().zip(pair).for_each(|(sum, value)| *sum += share * value);
                    }
                    let pixel = u + 2 * l;
                    if pixel >= inner[0] && pixel < inner[1] {
                        inside[placed.nearest[l] as usize] = true;
                    }
                }
            }
        }
        inside.pop();
        Self { origin, nodes: at_nodes(&pairs, columns, rows), inside }
    }
}

/// Weight and weighted height of the nodes.
fn at_nodes(pairs: &[Pair], columns: usize, rows: usize) -> Layer<2> {
    let mut nodes = Layer::zero(columns, rows);
    for (row, pairs) in pairs.chunks_exact(columns).take(rows).enumerate() {
        let mut left = [0.0; 2];
        for (node, &[weight, weighted, right_weight, right_weighted]) in nodes.row_mut(row).iter_mut().zip(pairs) {
            let weight = left[0] + weight;
            // A slope that faces the camera has more pixels than one that is turned away, and counts no more for that.
            let scale = NODE_WEIGHT / if weight > NODE_WEIGHT { weight } else { NODE_WEIGHT };
            *node = [weight * scale, (left[1] + weighted) * scale];
            left = [right_weight, right_weighted];
        }
    }
    nodes
}

impl Image {
    /// `None` where the free membrane lies too far from the tool, or the camera cannot be right.
    pub(super) fn new(image: &PadImage<'_>, tops_m: [f64; 2]) -> Option<Self> {
        if image.imprint.size() != image.camera.depth_reference.size() || !image.camera.intrinsics.is_plausible() {
            return None;
        }
        let rays = Rays::new(image)?;
        let top_m = tops_m[usize::from(rays.side > 0.0)];
        let zone = Zone::new(image, &rays, top_m)?;
        let splat = Splat::new(image, &rays, &zone, top_m);
        let columns = splat.nodes.columns;
        let smooth = Smooth::new(&splat.nodes, STEP_M, STEP_M * STEP_M / 6.0);
        let nodes: Vec<[u16; 2]> = (0..splat.inside.len())
            .filter(|&i| splat.inside[i])
            .map(|i| [i % columns, i / columns])
            .filter(|[column, row]| smooth.at(0, *column, *row)[0] >= MIN_WEIGHT)
            .map(|at| at.map(|n| n as u16))
            .collect();
        let side = f64::from(rays.side);
        Some(Self { side, free: zone.free, origin: splat.origin, nodes, smooth })
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
            let mean = |sigma: usize| {
                let [weight, weighted] = self.smooth.at(sigma, column, row);
                weighted / weight
            };
            let place = self.origin + DVec2::new(column as f64, row as f64) * STEP_M;
            (place, mean(band[0]) - mean(band[1]))
        })
    }
}
