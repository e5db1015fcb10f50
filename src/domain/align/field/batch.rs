//! The field asked about many points at once: the inner loop of registration.
//!
//! Points lie in separate `f32` arrays of cell units about their centroid, a few lanes at a time and without branches,
//! so that the compiler turns the arithmetic into vector instructions. The centroid is taken off in f64 first: no
//! precision is lost to a far origin.

use glam::DVec2;

use super::{CELL_M, DistanceField};
use crate::domain::align::ANGLE_SCALE_M;
use crate::domain::frames::PlanarPose;

/// Points per step: as many as keep the reads of a step in flight together.
const LANES: usize = 16;
/// Adding it to a number below leaves the number's integer part in the low bits.
const MAGIC: f32 = 8_388_608.0;
const MAGIC_MASK: u32 = 0x7f_ffff;
/// Least share of a point's curvature that counts where the kernel bends down.
const FLAT: f32 = 0.1;

/// Points about their centroid, in cells, as separate coordinates; padded to whole steps.
#[derive(Clone, Debug, Default)]
pub(in crate::domain::align) struct Cloud {
    y: Vec<f32>,
    z: Vec<f32>,
    len: usize,
    /// Further points that lie inside the silhouette wherever this cloud is used: they fit and pay nothing.
    resting: usize,
}

impl Cloud {
    /// From points about their centroid, metres.
    pub(in crate::domain::align) fn new(about_centroid: impl ExactSizeIterator<Item = DVec2>) -> Self {
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

    /// Points that it stands for.
    pub(in crate::domain::align) fn len(&self) -> usize {
        self.len + self.resting
    }

    /// Points that are looked up.
    pub(in crate::domain::align) fn asked(&self) -> usize {
        self.len
    }

    /// Greatest distance of a point from the centroid, metres.
    pub(in crate::domain::align) fn radius(&self) -> f64 {
        let squared = self.y.iter().zip(&self.z).map(|(y, z)| y * y + z * z).fold(0f32, f32::max);
        f64::from(squared.sqrt()) * CELL_M
    }

    fn chunks(&self) -> impl Iterator<Item = (&[f32; LANES], &[f32; LANES])> {
        self.y.as_chunks().0.iter().zip(self.z.as_chunks().0)
    }
}

/// `object_from_grasp` about the centroid of a cloud: `q = R(phi) (p - centroid) + place`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::domain::align) struct State {
    pub(in crate::domain::align) phi: f64,
    /// Where the centroid lies in the object frame, metres.
    pub(in crate::domain::align) place: DVec2,
}

impl State {
    pub(in crate::domain::align) fn from_pose(grasp_from_object: PlanarPose, centroid: DVec2) -> Self {
        let inverse = grasp_from_object.inverse();
        Self { phi: inverse.theta_rad, place: inverse.transform_yz(centroid) }
    }

    pub(in crate::domain::align) fn to_pose(self, centroid: DVec2) -> PlanarPose {
        let shift = self.place - DVec2::from_angle(self.phi).rotate(centroid);
        PlanarPose { theta_rad: self.phi, y_m: shift.x, z_m: shift.y }.inverse()
    }

    /// The state after a step of (angle times [`ANGLE_SCALE_M`], y, z).
    pub(in crate::domain::align) fn moved(self, step: [f64; 3]) -> Self {
        Self { phi: self.phi + step[0] / ANGLE_SCALE_M, place: self.place + DVec2::new(step[1], step[2]) }
    }

    /// Whether descents from both will end in the same place.
    pub(in crate::domain::align) fn is_near(&self, other: &Self) -> bool {
        (self.phi - other.phi).abs() * ANGLE_SCALE_M < 3e-4 && self.place.distance(other.place) < 3e-4
    }
}

/// Sums over the points at one state.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::domain::align) struct Sums {
    /// Upper triangle of the weighted Gauss-Newton matrix for (angle times [`ANGLE_SCALE_M`], y, z):
    /// 00 01 02 11 12 22.
    pub(in crate::domain::align) h: [f64; 6],
    /// Weighted slope of half the squared residuals, metres.
    pub(in crate::domain::align) g: [f64; 3],
    /// Geman-McClure cost, square metres.
    pub(in crate::domain::align) cost: f64,
    /// Sum of the weights.
    pub(in crate::domain::align) weight: f64,
    /// Points within the kernel's width of the silhouette, or on it.
    pub(in crate::domain::align) inliers: usize,
    /// Squared residuals of those, square metres.
    pub(in crate::domain::align) inlier_squares: f64,
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
pub(in crate::domain::align) struct Moments {
    /// Points that tell.
    pub(in crate::domain::align) count: usize,
    /// Sum of their arms about the centroid, metres.
    pub(in crate::domain::align) arms: DVec2,
    /// Sums of the products of (slope by the angle, metres; slope by y; slope by z): 00 01 02 11 12 22.
    pub(in crate::domain::align) products: [f64; 6],
}

/// What was read for the points of a step: arms about the centroid (cells), distance (metres), slope (metres per cell).
struct Read {
    ay: [f32; LANES],
    az: [f32; LANES],
    r: [f32; LANES],
    gy: [f32; LANES],
    gz: [f32; LANES],
}

/// Where the lanes lie on the grid.
struct Located {
    /// Cell and position within it, 0 to 1.
    index: [usize; LANES],
    fy: [f32; LANES],
    fz: [f32; LANES],
    /// Whether a lane lies off the grid; it was moved onto it.
    off: bool,
}

impl DistanceField {
    /// Cost, slope and curvature in one pass. `state` maps the cloud's centroid frame to the object frame.
    pub(in crate::domain::align) fn sums(&self, cloud: &Cloud, state: State, kernel: f64) -> Sums {
        let motion = Motion::new(self, state);
        let kernel_m = kernel as f32;
        let square = kernel_m * kernel_m;
        let bend_scale = 4.0 / square;
        let mut h = [[0f32; LANES]; 6];
        let mut g = [[0f32; LANES]; 3];
        let [mut cost, mut weight, mut inliers, mut squares] = [[0f32; LANES]; 4];
        let mut left = cloud.len;
        // Neighbours in an image are neighbours here: often all of a step are on the silhouette.
        let mut whole_steps = 0;
        for (y, z) in cloud.chunks() {
            let Read { ay, az, mut r, gy, gz } = self.read(&motion, y, z);
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
                cost[l] += r2 * ratio;
                weight[l] += w;
                let near = if r <= kernel_m { 1.0 } else { 0.0 };
                inliers[l] += near;
                squares[l] += near * r2;
                let (j0, j1, j2) = (gz[l] * ay[l] - gy[l] * az[l], gy[l], gz[l]);
                let w = w * pulls;
                let bend = 1.0 - bend_scale * r2 * ratio;
                let bent = if bend > FLAT { bend } else { FLAT };
                let (g0, g1, g2) = (w * j0, w * j1, w * j2);
                let (w0, w1, w2) = (bent * g0, bent * g1, bent * g2);
                h[0][l] += w0 * j0;
                h[1][l] += w0 * j1;
                h[2][l] += w0 * j2;
                h[3][l] += w1 * j1;
                h[4][l] += w1 * j2;
                h[5][l] += w2 * j2;
                g[0][l] += g0 * r;
                g[1][l] += g1 * r;
                g[2][l] += g2 * r;
            }
        }
        let total = |lanes: [f32; LANES]| lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
        // Slopes were taken per cell: metres per cell to metres per metre, arms in cells to metres.
        let slope = [1.0 / ANGLE_SCALE_M, 1.0 / CELL_M, 1.0 / CELL_M];
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        let fitting = cloud.resting + whole_steps * LANES;
        let padding = cloud.y.len() - cloud.len;
        Sums {
            h: std::array::from_fn(|i| total(h[i]) * slope[pairs[i].0] * slope[pairs[i].1]),
            g: std::array::from_fn(|i| total(g[i]) * slope[i]),
            cost: total(cost),
            weight: total(weight) + fitting as f64 - padding as f64,
            inliers: total(inliers) as usize + fitting - padding,
            inlier_squares: total(squares),
        }
    }

    /// The part of the cloud that may come to lie outside the silhouette while no point moves farther than `margin`
    /// (metres) from where `state` puts it. The other points rest.
    pub(in crate::domain::align) fn restless(&self, cloud: &Cloud, state: State, margin: f64) -> Cloud {
        let motion = Motion::new(self, state);
        let margin = -margin as f32;
        let mut kept = Cloud {
            y: Vec::with_capacity(cloud.y.len()),
            z: Vec::with_capacity(cloud.y.len()),
            len: 0,
            resting: cloud.resting,
        };
        let mut left = cloud.len;
        for (y, z) in cloud.chunks() {
            let read = self.read(&motion, y, z);
            for l in 0..LANES.min(left) {
                if read.r[l] > margin {
                    kept.y.push(y[l]);
                    kept.z.push(z[l]);
                }
            }
            left = left.saturating_sub(LANES);
        }
        kept.len = kept.y.len();
        kept.resting += cloud.len - kept.len;
        let padded = kept.len.next_multiple_of(LANES);
        kept.y.resize(padded, 0.0);
        kept.z.resize(padded, 0.0);
        kept
    }

    /// Moments of the slopes of all points up to `reach` (metres) outside the silhouette.
    pub(in crate::domain::align) fn moments(&self, cloud: &Cloud, state: State, reach: f64) -> Moments {
        let motion = Motion::new(self, state);
        let reach = reach as f32;
        let mut sums = [[0f32; LANES]; 9];
        let mut left = cloud.len;
        for (y, z) in cloud.chunks() {
            let Read { ay, az, mut r, gy, gz } = self.read(&motion, y, z);
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

    /// What the field says about a step of points.
    #[inline]
    fn read(&self, motion: &Motion, y: &[f32; LANES], z: &[f32; LANES]) -> Read {
        let zero = [0f32; LANES];
        let mut read = Read { ay: zero, az: zero, r: zero, gy: zero, gz: zero };
        for l in 0..LANES {
            read.ay[l] = motion.cos * y[l] - motion.sin * z[l];
            read.az[l] = motion.sin * y[l] + motion.cos * z[l];
        }
        let at = self.locate(motion, &read.ay, &read.az);
        let [a, b, c, d] = self.corners_of(&at);
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
        read
    }

    #[inline]
    fn locate(&self, motion: &Motion, ay: &[f32; LANES], az: &[f32; LANES]) -> Located {
        let (last_y, last_z) = ((self.columns - 1) as f32, (self.rows - 1) as f32);
        let columns = self.columns as f32;
        let mut at = Located { index: [0; LANES], fy: [0.0; LANES], fz: [0.0; LANES], off: false };
        let mut bits = [0u32; LANES];
        let mut off = 0u32;
        for l in 0..LANES {
            let (gy, gz) = (ay[l] + motion.y, az[l] + motion.z);
            let (cy, cz) = (clamp(gy, last_y), clamp(gz, last_z));
            off |= u32::from(cy != gy) | u32::from(cz != gz);
            let (column, row) = (whole(cy, last_y - 1.0), whole(cz, last_z - 1.0));
            at.fy[l] = cy - column;
            at.fz[l] = cz - row;
            // Exact: a field has fewer than 2^23 cells.
            bits[l] = (row * columns + column + MAGIC).to_bits() & MAGIC_MASK;
        }
        at.index = bits.map(|b| b as usize);
        at.off = off != 0;
        at
    }

    /// Values at the four corners around each lane.
    #[inline]
    fn corners_of(&self, at: &Located) -> [[f32; LANES]; 4] {
        let mut corners = [[0f32; LANES]; 4];
        let reach = self.columns + 2;
        for (l, index) in at.index.iter().enumerate() {
            let cell = &self.values[*index..][..reach];
            corners[0][l] = cell[0];
            corners[1][l] = cell[1];
            corners[2][l] = cell[reach - 2];
            corners[3][l] = cell[reach - 1];
        }
        corners
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

/// Between 0 and `high`; not a number becomes 0.
#[inline]
fn clamp(x: f32, high: f32) -> f32 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < high { x } else { high }
}

/// The integer part, at most `high`, of a number from 0 to 2^22.
#[inline]
fn whole(x: f32, high: f32) -> f32 {
    let rounded = (x + MAGIC) - MAGIC;
    let below = if rounded > x { rounded - 1.0 } else { rounded };
    if below < high { below } else { high }
}
