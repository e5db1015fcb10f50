//! Look-ups in a grid for a few points at once, without branches, so that the compiler makes vector instructions of them.

/// Points per step: as many as keep the reads of a step in flight together.
pub(super) const LANES: usize = 16;
/// Adding it to a number below leaves the number's integer part in the low bits.
pub(super) const MAGIC: f32 = 8_388_608.0;
pub(super) const MAGIC_MASK: u32 = 0x7f_ffff;

/// A grid of numbers, row by row: y runs along a row, z over the rows. Fewer than 2^23 cells.
#[derive(Clone, Copy)]
pub(super) struct Lattice<'a> {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) values: &'a [f32],
}

/// Positions of the lanes on a grid.
pub(super) struct Located {
    /// Cell and position within it, 0 to 1.
    pub(super) index: [usize; LANES],
    pub(super) fy: [f32; LANES],
    pub(super) fz: [f32; LANES],
    /// True where a lane lies off the grid; it was moved onto it.
    pub(super) off: bool,
}

impl Lattice<'_> {
    /// Values at the four corners of a cell.
    pub(super) fn cell(&self, column: usize, row: usize) -> [f32; 4] {
        let at = row * self.columns + column;
        [0, 1, self.columns, self.columns + 1].map(|corner| self.values[at + corner])
    }

    /// Positions of points given in cells.
    #[inline]
    pub(super) fn locate(&self, y: &[f32; LANES], z: &[f32; LANES]) -> Located {
        let (last_y, last_z) = ((self.columns - 1) as f32, (self.rows - 1) as f32);
        let columns = self.columns as f32;
        let mut at = Located { index: [0; LANES], fy: [0.0; LANES], fz: [0.0; LANES], off: false };
        let mut bits = [0u32; LANES];
        let mut off = 0u32;
        for l in 0..LANES {
            let (cy, cz) = (clamp(y[l], last_y), clamp(z[l], last_z));
            off |= u32::from(cy != y[l]) | u32::from(cz != z[l]);
            let (column, row) = (whole(cy, last_y - 1.0), whole(cz, last_z - 1.0));
            at.fy[l] = cy - column;
            at.fz[l] = cz - row;
            bits[l] = (row * columns + column + MAGIC).to_bits() & MAGIC_MASK;
        }
        at.index = bits.map(|b| b as usize);
        at.off = off != 0;
        at
    }

    /// Values at the four corners around each lane.
    #[inline]
    pub(super) fn corners_of(&self, at: &Located) -> [[f32; LANES]; 4] {
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
}

/// Sums over the points at one state.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// Upper triangle of the weighted Gauss-Newton matrix for (angle times [`super::ANGLE_SCALE_M`], y, z):
    /// 00 01 02 11 12 22.
    pub(super) h: [f64; 6],
    /// Weighted slope of half the squared residuals, meters.
    pub(super) g: [f64; 3],
    /// Geman-McClure cost, square meters.
    pub(super) cost: f64,
    /// Sum of the weights.
    pub(super) weight: f64,
    /// Points within the kernel's width of the silhouette, or on it.
    pub(super) inliers: usize,
    /// Squared residuals of those, square meters.
    pub(super) inlier_squares: f64,
}

/// Sums of robust residuals, lane by lane: curvature (upper triangle by rows), slope, and cost.
#[derive(Default)]
pub(super) struct LaneSums {
    h: [[f32; LANES]; 6],
    g: [[f32; LANES]; 3],
    cost: [f32; LANES],
    weight: [f32; LANES],
    inliers: [f32; LANES],
    squares: [f32; LANES],
}

impl LaneSums {
    /// Adds to a lane what a residual `r` with its Jacobian `j` pulls: `w` is the weight of its slope, `bent` that of its
    /// curvature as a share of `w`.
    #[inline(always)]
    pub(super) fn pull(&mut self, l: usize, r: f32, j: [f32; 3], w: f32, bent: f32) {
        let [j0, j1, j2] = j;
        let (g0, g1, g2) = (w * j0, w * j1, w * j2);
        let (w0, w1, w2) = (bent * g0, bent * g1, bent * g2);
        self.h[0][l] += w0 * j0;
        self.h[1][l] += w0 * j1;
        self.h[2][l] += w0 * j2;
        self.h[3][l] += w1 * j1;
        self.h[4][l] += w1 * j2;
        self.h[5][l] += w2 * j2;
        self.g[0][l] += g0 * r;
        self.g[1][l] += g1 * r;
        self.g[2][l] += g2 * r;
    }

    /// Adds to a lane what a residual costs: its cost, its weight, and its square where it is an inlier (`near` 1, else 0).
    #[inline(always)]
    pub(super) fn count(&mut self, l: usize, cost: f32, weight: f32, near: f32, r2: f32) {
        self.cost[l] += cost;
        self.weight[l] += weight;
        self.inliers[l] += near;
        self.squares[l] += near * r2;
    }

    /// All lanes together; `slope` brings the three derivatives to the solver's units.
    pub(super) fn total(&self, slope: [f64; 3]) -> Sums {
        let total = |lanes: &[f32; LANES]| lanes.iter().map(|v| f64::from(*v)).sum::<f64>();
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        Sums {
            h: std::array::from_fn(|i| total(&self.h[i]) * slope[pairs[i].0] * slope[pairs[i].1]),
            g: std::array::from_fn(|i| total(&self.g[i]) * slope[i]),
            cost: total(&self.cost),
            weight: total(&self.weight),
            inliers: total(&self.inliers) as usize,
            inlier_squares: total(&self.squares),
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
