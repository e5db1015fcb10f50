//! The field asked about many points at once: the inner loop of registration.
//!
//! Points lie in separate `f32` arrays of cell units about their centroid, a few lanes at a time and without branches,
//! so that the compiler turns the arithmetic into vector instructions. The centroid is taken off in f64 first: no
//! precision is lost to a far origin.

use glam::DVec2;

use super::ANGLE_SCALE_M;
use super::lanes::{LANES, LaneSums, Lattice, Sums};
use super::windows::{Floor, Slopes};
use crate::field::{CELL_M, DistanceField};
use crate::frames::PlanarPose;

/// Least share of a point's curvature that counts where the kernel bends down.
const FLAT: f32 = 0.1;

/// Points about their centroid, in cells, as separate coordinates; padded to whole steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Cloud {
    y: Vec<f32>,
    z: Vec<f32>,
    len: usize,
    /// Further points that lie inside the silhouette wherever this cloud is used: they fit and pay nothing.
    resting: usize,
}

impl Cloud {
    /// From points about their centroid, meters.
    pub(super) fn new(about_centroid: impl ExactSizeIterator<Item = DVec2>) -> Self {
        let len = about_centroid.len();
        let padded = len.next_multiple_of(LANES);
        let (mut y, mut z) = (Vec::with_capacity(padded), Vec::with_capacity(padded));
        for p in about_centroid {
            y.push((p.x * (1.0 / CELL_M)) as f32);
            z.push((p.y * (1.0 / CELL_M)) as f32);
        }
        y.resize(padded, 0.0);
        z.resize(padded, 0.0);
        Self { y, z, len, resting: 0 }
    }

    /// Cloud with the points far from the centroid first: they move most, so they decide soonest.
    pub(super) fn outermost_first(&self) -> Self {
        let mut order: Vec<usize> = (0..self.len).collect();
        let squared = |i: usize| self.y[i] * self.y[i] + self.z[i] * self.z[i];
        order.sort_by(|&a, &b| squared(b).total_cmp(&squared(a)));
        let at = |i: usize, from: &[f32]| order.get(i).map_or(0.0, |&o| from[o]);
        let (y, z) = (0..self.y.len()).map(|i| (at(i, &self.y), at(i, &self.z))).unzip();
        Self { y, z, len: self.len, resting: self.resting }
    }

    /// Points that it stands for.
    pub(super) fn len(&self) -> usize {
        self.len + self.resting
    }

    /// Points that are looked up.
    pub(super) fn asked(&self) -> usize {
        self.len
    }

    /// Greatest distance of a point from the centroid, meters.
    pub(super) fn radius(&self) -> f64 {
        let squared = self.y.iter().zip(&self.z).map(|(y, z)| y * y + z * z).fold(0f32, f32::max);
        f64::from(squared.sqrt()) * CELL_M
    }

    fn chunks(&self) -> impl Iterator<Item = (&[f32; LANES], &[f32; LANES])> {
        self.y.as_chunks().0.iter().zip(self.z.as_chunks().0)
    }
}

/// `object_from_grasp` about the centroid of a cloud: `q = R(phi) (p - centroid) + place`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    pub(super) phi: f64,
    /// Position of the centroid in the object frame, meters.
    pub(super) place: DVec2,
}

impl State {
    pub(super) fn from_pose(grasp_from_object: PlanarPose, centroid: DVec2) -> Self {
        let inverse = grasp_from_object.inverse();
        Self { phi: inverse.theta_rad, place: inverse.transform_yz(centroid) }
    }

    pub(super) fn to_pose(self, centroid: DVec2) -> PlanarPose {
        let shift = self.place - DVec2::from_angle(self.phi).rotate(centroid);
        PlanarPose { theta_rad: self.phi, y_m: shift.x, z_m: shift.y }.inverse()
    }

    /// The state after a step of (angle times [`ANGLE_SCALE_M`], y, z).
    pub(super) fn moved(self, step: [f64; 3]) -> Self {
        Self { phi: self.phi + step[0] / ANGLE_SCALE_M, place: self.place + DVec2::new(step[1], step[2]) }
    }

    /// True where descents from both states will end in the same place.
    pub(super) fn is_near(&self, other: &Self) -> bool {
        (self.phi - other.phi).abs() * ANGLE_SCALE_M < 3e-4 && self.place.distance(other.place) < 3e-4
    }
}

/// A state in the field's cell units.
struct Motion {
    cos: f32,
    sin: f32,
    y: f32,
    z: f32,
}

impl Motion {
    fn new(field: &DistanceField, state: State) -> Self {
        let turn = DVec2::from_angle(state.phi);
        let place = (state.place - field.origin) * (1.0 / CELL_M);
        Self { cos: turn.x as f32, sin: turn.y as f32, y: place.x as f32, z: place.y as f32 }
    }
}

/// Moments of the slopes about the cloud's centroid, object frame.
pub(super) struct Moments {
    /// Points that tell.
    pub(super) count: usize,
    /// Sum of their arms about the centroid, meters.
    pub(super) arms: DVec2,
    /// Sums of the products of (slope by the angle, meters; slope by y; slope by z): 00 01 02 11 12 22.
    pub(super) products: [f64; 6],
}

/// Field values of a step of points: arms about the centroid (cells), distance (meters), slope (meters per cell).
struct Read {
    ay: [f32; LANES],
    az: [f32; LANES],
    r: [f32; LANES],
    gy: [f32; LANES],
    gz: [f32; LANES],
    /// Cells, and whether a lane lies off the grid.
    index: [usize; LANES],
    off: bool,
}

/// The size of a box of states.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// Half widths: angle (radians), y, z (meters).
    pub(super) half: [f64; 3],
    /// Farthest way of a point in it: meters, and meters for each meter from the centroid.
    pub(super) shift: f64,
    pub(super) turn: f64,
}

impl Extent {
    pub(super) fn new(half: [f64; 3]) -> Self {
        Self { half, shift: half[1].hypot(half[2]), turn: 2.0 * (0.5 * half[0]).sin() }
    }

    /// The farthest way of a point at most `radius` from the centroid, meters.
    pub(super) fn way(&self, radius: f64) -> f64 {
        self.shift + self.turn * radius
    }
}

impl DistanceField {
    /// Cost, slope and curvature in one pass. `state` maps the cloud's centroid frame to the object frame.
    pub(super) fn sums(&self, cloud: &Cloud, state: State, kernel: f64) -> Sums {
        let motion = Motion::new(self, state);
        let kernel_m = kernel as f32;
        let square = kernel_m * kernel_m;
        let bend_scale = 4.0 / square;
        let mut sums = LaneSums::default();
        let mut left = cloud.len;
        // Neighbors in an image are neighbors here: often all of a step are on the silhouette.
        let mut whole_steps = 0;
        for (y, z) in cloud.chunks() {
            let Read { ay, az, mut r, gy, gz, .. } = self.read(&motion, y, z);
            if left < LANES {
                r[left..].fill(0.0);
            }
            left = left.saturating_sub(LANES);
            if r.iter().all(|r| *r <= 0.0) {
                whole_steps += 1;
                continue;
            }
            for l in 0..LANES {
                // On the silhouette: no cost, no pull, but it fits.
                let pulls = if r[l] > 0.0 { 1.0 } else { 0.0 };
                let r = if r[l] > 0.0 { r[l] } else { 0.0 };
                let r2 = r * r;
                let ratio = square / (square + r2);
                let w = ratio * ratio;
                let near = if r <= kernel_m { 1.0 } else { 0.0 };
                sums.count(l, r2 * ratio, w, near, r2);
                let w = w * pulls;
                let bend = 1.0 - bend_scale * r2 * ratio;
                let bent = if bend > FLAT { bend } else { FLAT };
                sums.pull(l, r, [gz[l] * ay[l] - gy[l] * az[l], gy[l], gz[l]], w, bent);
            }
        }
        // Slopes were taken per cell: meters per cell to meters per meter, arms in cells to meters.
        let found = sums.total([1.0 / ANGLE_SCALE_M, 1.0 / CELL_M, 1.0 / CELL_M]);
        let fitting = cloud.resting + whole_steps * LANES;
        let padding = cloud.y.len() - cloud.len;
        Sums {
            weight: found.weight + fitting as f64 - padding as f64,
            inliers: found.inliers + fitting - padding,
            ..found
        }
    }

    /// The part of the cloud that may come to lie outside the silhouette while no point moves farther than `margin`
    /// (meters) from where `state` puts it. The other points rest.
    pub(super) fn restless(&self, cloud: &Cloud, state: State, margin: f64) -> Cloud {
        let margin = -margin as f32;
        let mut kept = Cloud::default();
        self.keep(cloud, state, &mut kept, |r, _, _| r > margin);
        kept
    }

    /// The points of which `keeps` holds, by their distance and their place about the centroid; the others rest. `into` is
    /// overwritten.
    fn keep(&self, cloud: &Cloud, state: State, into: &mut Cloud, keeps: impl Fn(f32, f32, f32) -> bool) {
        let motion = Motion::new(self, state);
        for list in [&mut into.y, &mut into.z] {
            list.clear();
            list.reserve(cloud.y.len());
        }
        let mut left = cloud.len;
        for (y, z) in cloud.chunks() {
            let r = self.read(&motion, y, z).r;
            for l in 0..LANES.min(left) {
                if keeps(r[l], y[l], z[l]) {
                    into.y.push(y[l]);
                    into.z.push(z[l]);
                }
            }
            left = left.saturating_sub(LANES);
        }
        into.len = into.y.len();
        into.resting = cloud.resting + cloud.len - into.len;
        let padded = into.len.next_multiple_of(LANES);
        into.y.resize(padded, 0.0);
        into.z.resize(padded, 0.0);
    }

    /// Moments of the slopes of all points up to `reach` (meters) outside the silhouette.
    pub(super) fn moments(&self, cloud: &Cloud, state: State, reach: f64) -> Moments {
        let motion = Motion::new(self, state);
        let reach = reach as f32;
        let mut sums = [[0f32; LANES]; 9];
        let mut left = cloud.len;
        for (y, z) in cloud.chunks() {
            let Read { ay, az, mut r, gy, gz, .. } = self.read(&motion, y, z);
            if left < LANES {
                r[left..].fill(f32::INFINITY);
            }
            left = left.saturating_sub(LANES);
            for l in 0..LANES {
                let tells = if r[l] >= 0.0 && r[l] <= reach { 1.0 } else { 0.0 };
                let (j0, j1, j2) = (gz[l] * ay[l] - gy[l] * az[l], gy[l], gz[l]);
                let (t1, t2) = (tells * j1, tells * j2);
                sums[0][l] += tells * j0 * j0;
                sums[1][l] += t1 * j0;
                sums[2][l] += t2 * j0;
                sums[3][l] += t1 * j1;
                sums[4][l] += t1 * j2;
                sums[5][l] += t2 * j2;
                sums[6][l] += tells * ay[l];
                sums[7][l] += tells * az[l];
                sums[8][l] += tells;
            }
        }
        let total = sums.map(|lanes| lanes.iter().map(|v| f64::from(*v)).sum::<f64>());
        let (slope, arm) = (1.0 / CELL_M, CELL_M);
        Moments {
            count: total[8] as usize,
            arms: DVec2::new(total[6], total[7]) * arm,
            products: [
                total[0],
                total[1] * slope,
                total[2] * slope,
                total[3] * slope * slope,
                total[4] * slope * slope,
                total[5] * slope * slope,
            ],
        }
    }

    /// Lower bound of the cloud's cost anywhere in a box of states about `state` (square meters, summed over the points).
    ///
    /// Without `slopes`: in the box a point moves by at most its way, its distance to the silhouette shrinks by no more
    /// than that (see [`widened`]), and the kernel grows with the distance. The sums stop at `enough`.
    ///
    /// With `slopes`, of a window at least as wide as every way: where the field is nearly straight within the way of a
    /// point, the kernel of its distance lies above its tangent less what bends, and tangents of different points
    /// cancel. Near the best pose that is a far better bound, because there the sum has no slope.
    pub(super) fn bound(
        &self,
        cloud: &Cloud,
        state: State,
        kernel: f64,
        extent: Extent,
        slopes: Option<&Slopes>,
        enough: f64,
    ) -> Floor {
        /// Steps between two looks at the sum.
        const LOOK: usize = 4;
        /// Below this share of the kernel's width it bends up, so that it lies above its tangent.
        const CONVEX: f32 = 0.577;
        let motion = Motion::new(self, state);
        let square = (kernel * kernel) as f32;
        let convex_m = CONVEX * kernel as f32;
        let (shift, turn) = ((extent.shift / CELL_M) as f32, extent.turn as f32);
        let bow = 0.5 * (extent.half[0] * extent.half[0]) as f32;
        let zero = [0f32; LANES];
        let (mut low, mut here) = (zero, zero);
        let mut slope = [zero; 3];
        let mut left = cloud.len;
        let sum = |lanes: &[f32; LANES]| lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
        for (i, (y, z)) in cloud.chunks().enumerate() {
            let Read { ay, az, mut r, index, off, .. } = self.read(&motion, y, z);
            if left < LANES {
                r[left..].fill(0.0);
            }
            left = left.saturating_sub(LANES);
            let (mut arm, mut way, mut least, mut at) = (zero, zero, zero, zero);
            for l in 0..LANES {
                arm[l] = (y[l] * y[l] + z[l] * z[l]).sqrt();
                way[l] = shift + turn * arm[l];
                let r0 = if r[l] > 0.0 { r[l] } else { 0.0 };
                let near = r[l] - widened(way[l]);
                let near = if near > 0.0 { near } else { 0.0 };
                at[l] = r0 * r0 * square / (square + r0 * r0);
                least[l] = near * near * square / (square + near * near);
                here[l] += at[l];
            }
            let Some(slopes) = slopes.filter(|_| !off) else {
                for l in 0..LANES {
                    low[l] += least[l];
                }
                if slopes.is_none() && i % LOOK == LOOK - 1 && sum(&low) >= enough {
                    break;
                }
                continue;
            };
            let mut ranges = [zero; 4];
            for (l, index) in index.iter().enumerate() {
                let cell = slopes.cells[*index];
                for (range, value) in ranges.iter_mut().zip(cell) {
                    range[l] = value;
                }
            }
            let [my, mz, hy, hz] = ranges;
            for l in 0..LANES {
                let r0 = if r[l] > 0.0 { r[l] } else { 0.0 };
                let ratio = square / (square + r0 * r0);
                let pull = 2.0 * r0 * ratio * ratio;
                let change = widened(way[l]);
                let bends = if r0 + change > convex_m { 0.25 * change * change } else { 0.0 };
                let steep = my[l].abs() + mz[l].abs();
                let lost = pull * ((hy[l] + hz[l]) * way[l] + steep * bow * arm[l]) + bends;
                let tangent = if lost < 0.5 * (at[l] - least[l]) { 1.0 } else { 0.0 };
                low[l] += tangent * (at[l] - lost) + (1.0 - tangent) * least[l];
                let pull = tangent * pull;
                slope[0][l] += pull * (mz[l] * ay[l] - my[l] * az[l]);
                slope[1][l] += pull * my[l];
                slope[2][l] += pull * mz[l];
            }
        }
        let [turn, y, z] = slope.map(|lanes| sum(&lanes));
        Floor { low: sum(&low), slope: [turn, y / CELL_M, z / CELL_M], here: sum(&here) }
    }

    /// The part of the cloud that may lie outside the silhouette somewhere in a box of states as in
    /// [`Self::bound`]; `into` is overwritten. The others cost nothing anywhere in it.
    pub(super) fn undecided(&self, cloud: &Cloud, state: State, extent: Extent, into: &mut Cloud) {
        let (shift, turn) = ((extent.shift / CELL_M) as f32, extent.turn as f32);
        self.keep(cloud, state, into, |r, y, z| r + widened(shift + turn * (y * y + z * z).sqrt()) > 0.0);
    }

    /// Reads the field for a step of points.
    #[inline]
    fn read(&self, motion: &Motion, y: &[f32; LANES], z: &[f32; LANES]) -> Read {
        let zero = [0f32; LANES];
        let mut read = Read { ay: zero, az: zero, r: zero, gy: zero, gz: zero, index: [0; LANES], off: false };
        for l in 0..LANES {
            read.ay[l] = motion.cos * y[l] - motion.sin * z[l];
            read.az[l] = motion.sin * y[l] + motion.cos * z[l];
        }
        let lattice = Lattice { columns: self.columns, rows: self.rows, values: &self.values };
        let at = lattice.locate(&read.ay.map(|y| y + motion.y), &read.az.map(|z| z + motion.z));
        let [a, b, c, d] = lattice.corners_of(&at);
        for l in 0..LANES {
            let (ab, cd) = (b[l] - a[l], d[l] - c[l]);
            let (near, far) = (a[l] + ab * at.fy[l], c[l] + cd * at.fy[l]);
            read.r[l] = near + (far - near) * at.fz[l];
            read.gy[l] = ab + (cd - ab) * at.fz[l];
            read.gz[l] = far - near;
        }
        if at.off {
            self.correct_off_grid(motion, &mut read);
        }
        (read.index, read.off) = (at.index, at.off);
        read
    }

    /// [`Slopes`] for windows of one, two and four cells around each cell.
    pub(super) fn slopes(&self) -> [Slopes; 3] {
        let grid = Lattice { columns: self.columns, rows: self.rows, values: &self.values };
        // At the border of the grid nothing is known of what comes behind.
        Slopes::of(grid, CELL_M, [1, 2, 4], [CELL_M as f32 * 100.0; 4])
    }

    /// Replaces what was read for lanes off the grid.
    #[cold]
    fn correct_off_grid(&self, motion: &Motion, read: &mut Read) {
        for l in 0..LANES {
            let grid = DVec2::new(f64::from(read.ay[l] + motion.y), f64::from(read.az[l] + motion.z));
            let sample = self.sample(self.origin + grid * CELL_M);
            if !sample.on_grid {
                read.r[l] = sample.distance as f32;
                read.gy[l] = (sample.gradient.x * CELL_M) as f32;
                read.gz[l] = (sample.gradient.y * CELL_M) as f32;
            }
        }
    }
}

/// By how much (meters) the interpolated field can differ between two places `way` cells apart.
///
/// Interpolating is taking the mean over the four cells with weights that are a product of two two-valued
/// distributions. Coupled monotonically, the weights of two places differ by `way` in the mean, with a variance of at
/// most 1/4 along each axis; so the mean distance is at most `sqrt(way^2 + 1/2)`, and also at most the sum along the
/// axes, `sqrt(2) way`.
#[inline]
fn widened(way: f32) -> f32 {
    let (far, near) = ((way * way + 0.5).sqrt(), std::f32::consts::SQRT_2 * way);
    (if far < near { far } else { near }) * CELL_M as f32
}
