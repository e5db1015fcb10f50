//! Look-ups in a grid for a few points at once, without branches, so that the compiler makes vector instructions of them.

/// Points per step: as many as keep the reads of a step in flight together.
pub(super) const LANES: usize = 16;
/// Adding it to a number below leaves the number's integer part in the low bits.
const MAGIC: f32 = 8_388_608.0;
const MAGIC_MASK: u32 = 0x7f_ffff;

/// A grid of numbers, row by row: y runs along a row, z over the rows. Fewer than 2^23 cells.
#[derive(Clone, Copy)]
pub(super) struct Lattice<'a> {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) values: &'a [f32],
}

/// Where the lanes lie on a grid.
pub(super) struct Located {
    /// Cell and position within it, 0 to 1.
    pub(super) index: [usize; LANES],
    pub(super) fy: [f32; LANES],
    pub(super) fz: [f32; LANES],
    /// Whether a lane lies off the grid; it was moved onto it.
    pub(super) off: bool,
}

impl Lattice<'_> {
    /// Where points given in cells lie.
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
