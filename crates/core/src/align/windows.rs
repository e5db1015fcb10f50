//! Values and slopes of a grid in windows around each cell, for lower bounds of costs over boxes of poses.

use super::lanes::Lattice;

/// For each cell, between which values the slope of a grid lies in a window around it: middle and half range by y and z,
/// per cell.
pub(super) struct Slopes {
    pub(super) cells: Vec<[f32; 4]>,
    /// Reach of the window from anywhere in the cell, meters.
    pub(super) reach: f64,
}

impl Slopes {
    /// Slopes in windows that reach so many cells beyond each cell, from `border` (-y, y, -z, z) at the grid's border and
    /// the grid within.
    pub(super) fn of<const N: usize>(
        grid: Lattice<'_>,
        cell_m: f64,
        reaches: [usize; N],
        border: [f32; 4],
    ) -> [Self; N] {
        // Kept as greatest values of (-y, y, -z, z), so that joining windows is one maximum.
        let (columns, rows) = (grid.columns, grid.rows);
        let mut greatest = vec![border; columns * rows];
        for row in 0..rows - 1 {
            for column in 0..columns - 1 {
                let [a, b, c, d] = grid.cell(column, row);
                let (near, far, left, right) = (b - a, d - c, c - a, d - b);
                let own = [-near.min(far), near.max(far), -left.min(right), left.max(right)];
                let inside = row > 0 && column > 0 && row < rows - 2 && column < columns - 2;
                greatest[row * columns + column] = if inside { own } else { greater(own, border) };
            }
        }
        let mut window = 0;
        reaches.map(|reach| {
            greatest = widen(&greatest, columns, window, reach);
            window = reach;
            let cells = greatest
                .iter()
                .map(|[down, up, back, front]| {
                    [0.5 * (up - down), 0.5 * (front - back), 0.5 * (up + down), 0.5 * (front + back)]
                })
                .collect();
            Self { cells, reach: reach as f64 * cell_m }
        })
    }
}

/// Lower bound of a sum of costs over a box of states: a plane over it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Floor {
    /// Height of the plane in the middle of the box.
    pub(super) low: f64,
    /// Slope of the plane by angle, y and z, per radian and per meter.
    pub(super) slope: [f64; 3],
    /// Cost in the middle itself.
    pub(super) here: f64,
}

impl Floor {
    /// Least cost anywhere in a box whose half widths (angle, y, z) are `half`, less what the sums may have been rounded up.
    pub(super) fn least(&self, half: [f64; 3]) -> f64 {
        let fall: f64 = self.slope.iter().zip(half).map(|(slope, half)| slope.abs() * half).sum();
        (self.low * (1.0 - 1e-5) - fall * (1.0 + 1e-5)).max(0.0)
    }
}

fn greater<const N: usize>(a: [f32; N], b: [f32; N]) -> [f32; N] {
    std::array::from_fn(|i| if b[i] > a[i] { b[i] } else { a[i] })
}

/// The greatest values within `to` cells along both axes, of those within `from` cells.
fn widen<const N: usize>(values: &[[f32; N]], columns: usize, from: usize, to: usize) -> Vec<[f32; N]> {
    let step = to - from;
    // Three windows side by side leave nothing out between them.
    debug_assert!(step <= 2 * from + 1);
    if step == 0 {
        return values.to_vec();
    }
    let mut along_y = values.to_vec();
    for (out, row) in along_y.chunks_exact_mut(columns).zip(values.chunks_exact(columns)) {
        for (column, out) in out.iter_mut().enumerate() {
            let (left, right) = (row[column.saturating_sub(step)], row[(column + step).min(columns - 1)]);
            *out = greater(*out, greater(left, right));
        }
    }
    let rows = values.len() / columns;
    let mut along_z = along_y.clone();
    for (row, out) in along_z.chunks_exact_mut(columns).enumerate() {
        let near = &along_y[row.saturating_sub(step) * columns..][..columns];
        let far = &along_y[(row + step).min(rows - 1) * columns..][..columns];
        for ((out, near), far) in out.iter_mut().zip(near).zip(far) {
            *out = greater(*out, greater(*near, *far));
        }
    }
    along_z
}
