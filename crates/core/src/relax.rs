//! Obstacle problems on a grid: an elastic sheet that is pulled taut over a shape.
//!
//! Finds `w` with `w >= obstacle`, `-∇²w + k w >= load`, and equality in one of the two at every node (the sheet
//! touches, or it is in equilibrium). Projected successive over-relaxation in red-black order, so the result does
//! not depend on the sweep direction, from a coarse grid to the fine one.

/// A field on a square grid, row by row.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    pub(crate) values: Vec<f32>,
}

impl Field {
    pub(crate) fn filled(columns: usize, rows: usize, value: f32) -> Self {
        Self { columns, rows, values: vec![value; columns * rows] }
    }

    /// Bilinear value at node coordinates; beyond the border the border's value.
    pub(crate) fn at(&self, x: f64, y: f64) -> f64 {
        let x = x.clamp(0.0, (self.columns - 1) as f64 - 1e-6);
        let y = y.clamp(0.0, (self.rows - 1) as f64 - 1e-6);
        let (ix, iy) = (x as usize, y as usize);
        let (tx, ty) = (x - ix as f64, y - iy as f64);
        let i = iy * self.columns + ix;
        let v = |k: usize| f64::from(self.values[k]);
        let top = v(i) + (v(i + 1) - v(i)) * tx;
        let bottom = v(i + self.columns) + (v(i + self.columns + 1) - v(i + self.columns)) * tx;
        top + (bottom - top) * ty
    }

    /// Every second node, with the largest value within `reach` nodes of it.
    pub(crate) fn coarser(&self, reach: usize) -> Field {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let mut out = Field::filled(columns, rows, f32::NEG_INFINITY);
        for y in 0..rows {
            for x in 0..columns {
                let mut best = f32::NEG_INFINITY;
                for j in (2 * y).saturating_sub(reach)..=(2 * y + reach).min(self.rows - 1) {
                    for i in (2 * x).saturating_sub(reach)..=(2 * x + reach).min(self.columns - 1) {
                        best = best.max(self.values[j * self.columns + i]);
                    }
                }
                out.values[y * columns + x] = best;
            }
        }
        out
    }
}

/// The sheet, see the module.
pub(crate) struct Problem<'a> {
    /// Lowest allowed value; `NEG_INFINITY` where nothing is in the way.
    pub(crate) obstacle: &'a Field,
    /// Nodes that can move; the others stay at 0. The border never moves.
    pub(crate) free: &'a [bool],
    /// Load divided by tension, 1/m (per square meter of the grid: the right hand side).
    pub(crate) load: f32,
    /// More of it, node by node.
    pub(crate) more: Option<&'a Field>,
    /// Foundation stiffness divided by tension, 1/m².
    pub(crate) stiffness: f32,
    /// Grid spacing, meters.
    pub(crate) step: f32,
}

impl Problem<'_> {
    /// Solves on `levels` grids, each twice as fine as the one before, with `sweeps` sweeps on the finest and twice
    /// as many on each coarser one; the finest alone has [`Self::more`].
    pub(crate) fn solve(&self, levels: usize, sweeps: usize) -> Field {
        self.solve_from(levels, sweeps, 0)
    }

    /// `reach` is how far a coarser obstacle gathers its values: bars are wider than the second finest step, but
    /// could fall between the nodes of the coarser ones.
    fn solve_from(&self, levels: usize, sweeps: usize, reach: usize) -> Field {
        let mut start = if levels > 1 && self.obstacle.columns > 8 && self.obstacle.rows > 8 {
            let (obstacle, free) = self.coarser(reach);
            let coarse = Problem { obstacle: &obstacle, free: &free, more: None, step: 2.0 * self.step, ..*self };
            let w = coarse.solve_from(levels - 1, 2 * sweeps, 1);
            self.refined(&w)
        } else {
            Field::filled(self.obstacle.columns, self.obstacle.rows, 0.0)
        };
        self.relax(&mut start, sweeps);
        start
    }

    /// A field on the grid of twice the spacing at this one's free nodes, 0 at the others.
    pub(crate) fn refined(&self, coarse: &Field) -> Field {
        let mut fine = Field::filled(self.obstacle.columns, self.obstacle.rows, 0.0);
        let mut between = vec![0.0; coarse.columns + 1];
        for (y, to) in fine.values.chunks_exact_mut(self.obstacle.columns).enumerate() {
            let row = |y: usize| &coarse.values[y.min(coarse.rows - 1) * coarse.columns..][..coarse.columns];
            for ((between, above), below) in between.iter_mut().zip(row(y / 2)).zip(row(y.div_ceil(2))) {
                *between = 0.5 * (above + below);
            }
            between[coarse.columns] = between[coarse.columns - 1];
            for (x, (to, free)) in to.iter_mut().zip(&self.free[y * self.obstacle.columns..]).enumerate() {
                let value = 0.5 * (between[x / 2] + between[x.div_ceil(2)]);
                *to = if *free { value } else { 0.0 };
            }
        }
        fine
    }

    /// Obstacle and free nodes on a grid of twice the spacing.
    pub(crate) fn coarser(&self, reach: usize) -> (Field, Vec<bool>) {
        let obstacle = self.obstacle.coarser(reach);
        let mut free = Vec::with_capacity(obstacle.values.len());
        for y in 0..obstacle.rows {
            let row = &self.free[2 * y * self.obstacle.columns..];
            free.extend((0..obstacle.columns).map(|x| row[2 * x]));
        }
        (obstacle, free)
    }

    /// `sweeps` red-black sweeps in place.
    pub(crate) fn relax(&self, w: &mut Field, sweeps: usize) {
        let (columns, rows) = (w.columns, w.rows);
        let h2 = self.step * self.step;
        let inverse = 1.0 / (4.0 + self.stiffness * h2);
        let source = self.load * h2;
        let movable =
            |x: usize, y: usize| self.free[y * columns + x] && x > 0 && x + 1 < columns && y > 0 && y + 1 < rows;
        let mut sheet = Halves::of(columns, rows, 0.0, |x, y| w.values[y * columns + x]);
        let moves = Halves::of(columns, rows, 0.0, |x, y| f32::from(u8::from(movable(x, y))));
        let below_all = f32::NEG_INFINITY;
        let obstacle =
            |x: usize, y: usize| if movable(x, y) { self.obstacle.values[y * columns + x] } else { below_all };
        let obstacle = Halves::of(columns, rows, below_all, obstacle);
        let more =
            Halves::of(columns, rows, 0.0, |x, y| self.more.map_or(0.0, |more| more.values[y * columns + x] * h2));
        let width = sheet.width;
        for sweep in 0..sweeps {
            // over-relaxation from the second sweep on; a last plain one smooths
            let omega = if sweep == 0 || sweep + 1 == sweeps { 1.0 } else { 1.75 };
            for color in 0..2 {
                for y in 1..rows - 1 {
                    let odd = (y + color) % 2 == 0;
                    let [even_half, odd_half] = &mut sheet.halves;
                    let (own, other) = if odd { (odd_half, even_half) } else { (even_half, odd_half) };
                    let row = y * width;
                    let (before, rest) = own[row - width..].split_at_mut(width);
                    let (here, after) = rest.split_at_mut(width);
                    // Of an odd node the neighbors in the row are the even ones at its index and the next.
                    let first = usize::from(!odd);
                    let count = width - 1;
                    let here = &mut here[first..][..count];
                    let (above, below) = (&before[first..][..count], &after[first..][..count]);
                    let (left, right) = (&other[row..][..count], &other[row + 1..][..count]);
                    let half = usize::from(odd);
                    let more = &more.halves[half][row + first..][..count];
                    let moves = &moves.halves[half][row + first..][..count];
                    let obstacle = &obstacle.halves[half][row + first..][..count];
                    for i in 0..count {
                        let target = (left[i] + right[i] + above[i] + below[i] + source + more[i]) * inverse;
                        let moved = here[i] + moves[i] * (omega * (target - here[i]));
                        here[i] = if moved > obstacle[i] { moved } else { obstacle[i] };
                    }
                }
            }
        }
        for y in 0..rows {
            for x in 0..columns {
                w.values[y * columns + x] = sheet.halves[x % 2][y * width + x / 2];
            }
        }
    }
}

/// The even and the odd nodes of each row of a grid apart, so that neighbors of one color lie side by side.
struct Halves {
    halves: [Vec<f32>; 2],
    /// Length of a row: one more than there are even nodes.
    width: usize,
}

impl Halves {
    fn of(columns: usize, rows: usize, beyond: f32, at: impl Fn(usize, usize) -> f32) -> Self {
        let width = columns.div_ceil(2) + 1;
        let halves = [0, 1].map(|half| {
            let mut values = vec![beyond; width * rows];
            for y in 0..rows {
                for (value, x) in values[y * width..].iter_mut().zip((half..columns).step_by(2)) {
                    *value = at(x, y);
                }
            }
            values
        });
        Self { halves, width }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet over a thin ring of posts must satisfy the complementarity conditions.
    #[test]
    fn the_solution_touches_or_is_in_equilibrium() {
        let n = 65;
        let step = 1e-3_f32;
        let mut obstacle = Field::filled(n, n, f32::NEG_INFINITY);
        for (x, y) in [(20, 20), (21, 20), (44, 30), (32, 50)] {
            obstacle.values[y * n + x] = 5e-3;
        }
        let free = vec![true; n * n];
        let problem = Problem { obstacle: &obstacle, free: &free, load: -3.0, more: None, stiffness: 0.0, step };
        let w = problem.solve(4, 400);
        for y in 1..n - 1 {
            for x in 1..n - 1 {
                let i = y * n + x;
                let v = w.values[i];
                let bend = 4.0 * v - w.values[i - 1] - w.values[i + 1] - w.values[i - n] - w.values[i + n];
                let push = bend + 3.0 * step * step;
                assert!(v >= obstacle.values[i], "below the obstacle");
                assert!(push > -1e-6, "pulled down at {x} {y}: {push}");
                assert!(push.abs() < 1e-6 || v <= obstacle.values[i] + 1e-7, "held up by nothing at {x} {y}");
            }
        }
        assert!(w.values.iter().any(|&v| v < 0.0), "the load presses the free parts down");
    }
}
