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

    /// Every second node.
    pub(crate) fn thinned(&self) -> Field {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let mut out = Field::filled(columns, rows, 0.0);
        for y in 0..rows {
            for x in 0..columns {
                out.values[y * columns + x] = self.values[2 * y * self.columns + 2 * x];
            }
        }
        out
    }

    /// Every second node, with the largest value within `reach` nodes of it.
    fn coarser(&self, reach: usize) -> Field {
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
    /// as many on each coarser one.
    pub(crate) fn solve(&self, levels: usize, sweeps: usize) -> Field {
        self.solve_from(levels, sweeps, 0)
    }

    /// `reach` is how far a coarser obstacle gathers its values: bars are wider than the second finest step, but
    /// could fall between the nodes of the coarser ones.
    fn solve_from(&self, levels: usize, sweeps: usize, reach: usize) -> Field {
        let mut start = if levels > 1 && self.obstacle.columns > 8 && self.obstacle.rows > 8 {
            let (obstacle, free) = self.coarser(reach);
            let more = self.more.map(Field::thinned);
            let coarse =
                Problem { obstacle: &obstacle, free: &free, more: more.as_ref(), step: 2.0 * self.step, ..*self };
            let w = coarse.solve_from(levels - 1, 2 * sweeps, 1);
            let mut fine = Field::filled(self.obstacle.columns, self.obstacle.rows, 0.0);
            for y in 0..fine.rows {
                for x in 0..fine.columns {
                    if self.free[y * fine.columns + x] {
                        fine.values[y * fine.columns + x] = w.at(x as f64 * 0.5, y as f64 * 0.5) as f32;
                    }
                }
            }
            fine
        } else {
            Field::filled(self.obstacle.columns, self.obstacle.rows, 0.0)
        };
        self.relax(&mut start, sweeps);
        start
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
        let columns = w.columns;
        let h2 = self.step * self.step;
        let inverse = 1.0 / (4.0 + self.stiffness * h2);
        let source = self.load * h2;
        let none = vec![0.0; columns];
        for sweep in 0..sweeps {
            // over-relaxation from the second sweep on; a last plain one smooths
            let omega = if sweep == 0 || sweep + 1 == sweeps { 1.0 } else { 1.75 };
            for color in 0..2 {
                for y in 1..w.rows - 1 {
                    let row = y * columns;
                    let first = 1 + (y + color) % 2;
                    let (above, rest) = w.values[row - columns..].split_at_mut(columns);
                    let (here, below) = rest.split_at_mut(columns);
                    let below = &below[..columns];
                    let obstacle = &self.obstacle.values[row..row + columns];
                    let free = &self.free[row..row + columns];
                    let more = self.more.map_or(&none[..], |more| &more.values[row..row + columns]);
                    let mut x = first;
                    while x + 1 < columns {
                        if free[x] {
                            let sum = here[x - 1] + here[x + 1] + above[x] + below[x];
                            let target = (sum + source + more[x] * h2) * inverse;
                            here[x] = (here[x] + omega * (target - here[x])).max(obstacle[x]);
                        }
                        x += 2;
                    }
                }
            }
        }
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
