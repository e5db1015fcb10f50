//! A sheet under pressure that stiffens as it is stretched, clamped at a rim and held back by an obstacle.
//!
//! Solves `-div(T(l) / l grad n) = load` for the height `n <= obstacle`, with the stretch `l = sqrt(1 + |grad n|²)` and the
//! tension `T = 1 + stiffening (l - 1)` in units of the flat sheet's: projected over-relaxation on a coarse grid and then on
//! a fine one, the tension renewed in between.

use glam::DVec2;

/// Grids, each twice as fine as the one before; sweeps between two looks at the tension, twice as many on each coarser grid;
/// and those looks.
const LEVELS: usize = 4;
const SWEEPS: usize = 10;
const LOOKS: usize = 2;
const OVER: f64 = 1.85;
/// Least tension: a membrane never goes slack.
const SLACK: f64 = 0.15;

/// A clamped sheet and what holds it back, row by row.
#[derive(Clone)]
pub(super) struct Sheet {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Spacing of the nodes along a row, and of the rows, meters.
    pub(super) step: DVec2,
    /// Highest height at each node, meters.
    pub(super) obstacle: Vec<f64>,
    /// Nodes within the rim; the others stay where the rim is.
    pub(super) free: Vec<bool>,
    /// Height of the rim at the middle row, and how it rises along a row's normal.
    pub(super) rim: [f64; 2],
    /// Pressure over the flat sheet's tension, 1/m.
    pub(super) load: f64,
    /// Growth of the tension with the stretch: 0 for a soap film, 1 for a linear membrane.
    pub(super) stiffening: f64,
}

impl Sheet {
    /// Height at every node, meters.
    pub(super) fn solve(&self) -> Vec<f64> {
        self.solve_from(LEVELS, SWEEPS)
    }

    fn solve_from(&self, levels: usize, sweeps: usize) -> Vec<f64> {
        let mut height: Vec<f64> =
            (0..self.rows).flat_map(|j| (0..self.columns).map(move |_| j)).map(|j| self.rim_at(j)).collect();
        if levels > 1 && self.columns > 16 && self.rows > 16 {
            let coarse = self.coarser();
            let start = coarse.solve_from(levels - 1, 2 * sweeps);
            for k in (0..height.len()).filter(|k| self.free[*k]) {
                let at = |i: usize, of: usize| (0.5 * i as f64).min(of as f64 - 1.001);
                let (x, y) = (at(k % self.columns, coarse.columns), at(k / self.columns, coarse.rows));
                height[k] = coarse.between(&start, DVec2::new(x, y));
            }
        }
        for _ in 0..LOOKS {
            self.relax(&mut height, sweeps);
        }
        height
    }

    fn rim_at(&self, row: usize) -> f64 {
        self.rim[0] + self.rim[1] * self.step.y * (row as f64 - 0.5 * (self.rows - 1) as f64)
    }

    /// Sheet with every other node; its obstacles are the lowest around, because a bar may fall between the nodes.
    fn coarser(&self) -> Self {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let mut obstacle = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            for i in 0..columns {
                let mut lowest = f64::INFINITY;
                for y in (2 * j).saturating_sub(1)..(2 * j + 2).min(self.rows) {
                    for x in (2 * i).saturating_sub(1)..(2 * i + 2).min(self.columns) {
                        lowest = lowest.min(self.obstacle[y * self.columns + x]);
                    }
                }
                obstacle.push(lowest);
            }
        }
        let free =
            (0..columns * rows).map(|k| self.free[2 * (k / columns) * self.columns + 2 * (k % columns)]).collect();
        Self { columns, rows, step: 2.0 * self.step, obstacle, free, ..*self }
    }

    /// Value between the nodes, at a place in steps.
    pub(super) fn between(&self, values: &[f64], at: DVec2) -> f64 {
        let (i, j) = (at.x as usize, at.y as usize);
        let (x, y) = (at.x - i as f64, at.y - j as f64);
        let k = j * self.columns + i;
        let row = |k: usize| values[k] + (values[k + 1] - values[k]) * x;
        row(k) + (row(k + self.columns) - row(k)) * y
    }

    /// Tension over stretch for a slope.
    fn conductance(&self, square_slope: f64) -> f64 {
        let stretch = (1.0 + square_slope).sqrt();
        (1.0 + self.stiffening * (stretch - 1.0)).max(SLACK) / stretch
    }

    /// Red-black sweeps with the tension that the height has now.
    fn relax(&self, n: &mut [f64], sweeps: usize) {
        let (columns, rows) = (self.columns, self.rows);
        let DVec2 { x: hy, y: hz } = self.step;
        let mut along = vec![1.0; columns * rows];
        let mut across = vec![1.0; columns * rows];
        for j in 0..rows - 1 {
            for i in 0..columns - 1 {
                let k = j * columns + i;
                if j > 0 {
                    let a = (n[k + 1] - n[k]) / hy;
                    let b = (n[k + columns] - n[k - columns] + n[k + columns + 1] - n[k - columns + 1]) / (4.0 * hz);
                    along[k] = self.conductance(a * a + b * b) / (hy * hy);
                }
                if i > 0 {
                    let a = (n[k + columns] - n[k]) / hz;
                    let b = (n[k + 1] - n[k - 1] + n[k + columns + 1] - n[k + columns - 1]) / (4.0 * hy);
                    across[k] = self.conductance(a * a + b * b) / (hz * hz);
                }
            }
        }
        for sweep in 0..sweeps {
            let over = if sweep == 0 || sweep + 1 == sweeps { 1.0 } else { OVER };
            for color in 0..2 {
                for j in 1..rows - 1 {
                    for i in (1 + (j + color) % 2..columns - 1).step_by(2) {
                        let k = j * columns + i;
                        if !self.free[k] {
                            continue;
                        }
                        let (east, west, south, north) = (along[k], along[k - 1], across[k], across[k - columns]);
                        let pull = east * n[k + 1] + west * n[k - 1] + south * n[k + columns] + north * n[k - columns];
                        let target = (pull + self.load) / (east + west + south + north);
                        n[k] = (n[k] + over * (target - n[k])).min(self.obstacle[k]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round(load: f64, stiffening: f64, obstacle: f64) -> Sheet {
        let (count, radius) = (101, 0.05);
        let free = |k: usize| {
            let p = DVec2::new((k % count) as f64 - 50.0, (k / count) as f64 - 50.0) * 1e-3;
            p.length() < radius - 1e-6
        };
        Sheet {
            columns: count,
            rows: count,
            step: DVec2::splat(1e-3),
            obstacle: vec![obstacle; count * count],
            free: (0..count * count).map(free).collect(),
            rim: [0.0, 0.0],
            load,
            stiffening,
        }
    }

    #[test]
    fn a_linear_membrane_is_a_paraboloid_and_a_soap_film_part_of_a_sphere() {
        let middle = 50 * 101 + 50;
        // -laplacian = load: rise = load r² / 4.
        let rise = round(16.0, 1.0, f64::INFINITY).solve()[middle];
        assert!((rise - 0.01).abs() < 4e-4, "{rise}");
        // Mean curvature 2 / R = load: R = 0.1, rise = R - sqrt(R² - r²).
        let rise = round(20.0, 0.0, f64::INFINITY).solve()[middle];
        assert!((rise - (0.1 - (0.01_f64 - 0.0025).sqrt())).abs() < 4e-4, "{rise}");
    }
}
