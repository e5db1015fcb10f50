//! The bubble's membrane: an inflated elastic sheet over an elliptical rim, pressed onto the tool.
//!
//! Coordinates of one finger: `n` points away from the finger (towards the other one, 0 in the middle plane), `y`
//! and `z` are the grasp frame's. Free, the membrane is the dome `n = dome(y, z)`, the exact solution of
//! "tension times curvature equals pressure" for an elliptical rim. Pressed, it may pass neither the tool nor the
//! middle plane (where it meets the other finger's membrane, which mirrors it); in between it spans freely, so it
//! tents between bars. The pressure acts along the sheet's normal, so it bends a steep sheet more than a flat one: beside
//! a bar the membrane falls off steeply and then levels out. The trapped air cannot leave: part of the volume that the tool takes comes back as extra
//! pressure, which makes the free parts bulge beyond the dome.

use glam::DVec2;

use super::{BubbleConfig, MEMBRANE_STEP_M};
use crate::catalog::ToolSpec;
use crate::frames::PlanarPose;
use crate::relax::{Field, Problem};

/// A pressed membrane.
pub struct Membrane<'a> {
    dome: Dome,
    tool: &'a ToolSpec,
    object_from_grasp: PlanarPose,
    /// Dome minus membrane at the grid nodes, meters.
    pushed: Field,
    /// Cells (and their neighbors) in which a bar begins or lies.
    near_tool: Vec<bool>,
    origin: DVec2,
    #[cfg(test)]
    rest: (Field, Vec<bool>, f32, Field),
}

/// The undeformed membrane.
#[derive(Clone, Copy, Debug)]
pub struct Dome {
    /// Height of the apex, meters.
    pub apex: f64,
    /// Height of the apex over the rim, meters.
    pub rise: f64,
    /// Semi-axes of the rim along y and z, meters.
    pub semi: DVec2,
    /// Center of the rim, (y, z), meters.
    pub center: DVec2,
}

impl Dome {
    /// The dome of a bubble pressed by `config.press_m` onto a tool of this thickness.
    pub fn new(config: &BubbleConfig, half_thickness_m: f64) -> Self {
        Self {
            apex: config.press_m - half_thickness_m,
            rise: config.dome_rise_m,
            semi: DVec2::from_array(config.rim_semi_axes_m),
            center: DVec2::new(0.0, config.rim_center_z_m),
        }
    }

    /// Height at `(y, z)`; beyond the rim it goes on falling.
    pub fn height(&self, yz: DVec2) -> f64 {
        self.apex - self.rise * ((yz - self.center) / self.semi).length_squared()
    }
}

impl<'a> Membrane<'a> {
    /// Solves the contact of the membrane with `tool` held at `object_from_grasp`.
    pub fn press(config: &BubbleConfig, tool: &'a ToolSpec, object_from_grasp: PlanarPose) -> Self {
        let dome = Dome::new(config, tool.half_thickness_m);
        let step = MEMBRANE_STEP_M;
        let size = (2.0 * dome.semi / step).ceil();
        let (columns, rows) = (size.x as usize + 3, size.y as usize + 3);
        let origin = dome.center - dome.semi - step;

        let mut obstacle = Field::filled(columns, rows, f32::NEG_INFINITY);
        let mut free = vec![false; columns * rows];
        let mut near = vec![false; columns * rows];
        for j in 0..rows {
            for i in 0..columns {
                let k = j * columns + i;
                let yz = origin + DVec2::new(i as f64, j as f64) * step;
                free[k] = ((yz - dome.center) / dome.semi).length_squared() < 1.0;
                if !free[k] {
                    continue;
                }
                let s = tool.outline_distance(object_from_grasp.transform_yz(yz));
                near[k] = s < 1.5 * step;
                let surface = if s <= 0.0 { -tool.height_at(s) } else { 0.0 };
                obstacle.values[k] = (dome.height(yz) - surface) as f32;
            }
        }
        let mut problem =
            Problem { obstacle: &obstacle, free: &free, load: 0.0, more: None, stiffness: 0.0, step: step as f32 };
        problem.load = extra_pressure(&problem, config.air_kept, &dome);
        let mut pushed = problem.solve(LEVELS, SWEEPS);
        #[cfg(test)]
        let mut rest = None;
        for _ in 0..BENDINGS {
            let more = bending(&pushed, &dome, problem.load, origin);
            pushed = Problem { more: Some(&more), ..problem }.solve(LEVELS, SWEEPS);
            #[cfg(test)]
            rest.replace((obstacle.clone(), free.clone(), problem.load, more));
        }
        Self {
            dome,
            tool,
            object_from_grasp,
            pushed,
            near_tool: near,
            origin,
            #[cfg(test)]
            rest: rest.expect("it was bent"),
        }
    }

    /// The undeformed shape.
    pub fn dome(&self) -> &Dome {
        &self.dome
    }

    /// A dome that the membrane is nowhere below.
    pub(super) fn lowest_dome(&self) -> Dome {
        let deepest = self.pushed.values.iter().fold(0.0_f32, |a, &w| a.max(w));
        // between nodes the tool's exact surface counts, a little deeper than the grid's
        Dome { apex: self.dome.apex - f64::from(deepest) - 2e-3, ..self.dome }
    }

    /// Height of the membrane at `(y, z)`, meters.
    pub fn height(&self, yz: DVec2) -> f64 {
        let grid = (yz - self.origin) / MEMBRANE_STEP_M;
        let free = self.dome.height(yz) - self.pushed.at(grid.x, grid.y);
        // between the nodes the tool's edges are sharper than the grid
        if self.is_near(grid) {
            let s = self.tool.outline_distance(self.object_from_grasp.transform_yz(yz));
            if s <= 0.0 {
                return free.min(-self.tool.height_at(s));
            }
        }
        free
    }

    fn is_near(&self, grid: DVec2) -> bool {
        let columns = self.pushed.columns;
        if grid.x < 0.0 || grid.y < 0.0 {
            return false;
        }
        let (i, j) = (grid.x as usize, grid.y as usize);
        if i + 1 >= columns || j + 1 >= self.pushed.rows {
            return false;
        }
        let k = j * columns + i;
        self.near_tool[k] || self.near_tool[k + 1] || self.near_tool[k + columns] || self.near_tool[k + columns + 1]
    }

    /// Distance of the membrane's point `(n, y, z)` from the tool's surface, meters, negative inside; more than
    /// `limit` is only known to be more.
    pub(crate) fn distance_to_tool(&self, n: f64, yz: DVec2, limit: f64) -> f64 {
        let p = self.object_from_grasp.transform_yz(yz);
        let s = self.tool.outline_distance(p);
        if s > limit { s } else { self.tool.signed_distance(glam::DVec3::new(n, p.x, p.y)) }
    }

    /// Largest and mean difference, meters, from the solution after many more sweeps.
    #[cfg(test)]
    fn error_against_many_sweeps(&self, sweeps: usize) -> (f64, f64) {
        let (obstacle, free, load, more) = &self.rest;
        let step = MEMBRANE_STEP_M as f32;
        let problem = Problem { obstacle, free, load: *load, more: Some(more), stiffness: 0.0, step };
        let mut converged = self.pushed.clone();
        problem.relax(&mut converged, sweeps);
        let error = |(a, b): (&f32, &f32)| f64::from((a - b).abs());
        let errors: Vec<f64> = converged.values.iter().zip(&self.pushed.values).map(error).collect();
        (errors.iter().copied().fold(0.0, f64::max), errors.iter().sum::<f64>() / errors.len() as f64)
    }

    /// Largest depth of a grid node inside the tool, meters.
    pub fn worst_gap(&self) -> f64 {
        let mut worst = 0.0_f64;
        for j in 0..self.pushed.rows {
            for i in 0..self.pushed.columns {
                let yz = self.origin + DVec2::new(i as f64, j as f64) * MEMBRANE_STEP_M;
                if let Some(h) = self.tool.height(self.object_from_grasp.transform_yz(yz)) {
                    let n = self.dome.height(yz) - f64::from(self.pushed.values[j * self.pushed.columns + i]);
                    worst = worst.max(n + h);
                }
            }
        }
        worst
    }
}

/// Load that the slopes of the sheet add to the load `extra`: a pressure p (over tension) bends a sheet of slope s by p
/// (1 + s²)^1.5, the flat-sheet equation by p. The dome's own pressure and slopes are in its shape already.
fn bending(pushed: &Field, dome: &Dome, extra: f32, origin: DVec2) -> Field {
    let (columns, rows) = (pushed.columns, pushed.rows);
    let rest = 2.0 * dome.rise * dome.semi.powf(-2.0).element_sum();
    let pressure = rest - f64::from(extra);
    let bent = |slope: DVec2| (1.0 + slope.length_squared().min(STEEPEST * STEEPEST)).powf(1.5);
    let mut more = Field::filled(columns, rows, 0.0);
    for j in 1..rows - 1 {
        for i in 1..columns - 1 {
            let k = j * columns + i;
            let w = |k: usize| f64::from(pushed.values[k]);
            let slope = DVec2::new(w(k + 1) - w(k - 1), w(k + columns) - w(k - columns)) / (2.0 * MEMBRANE_STEP_M);
            let yz = origin + DVec2::new(i as f64, j as f64) * MEMBRANE_STEP_M;
            let dome_slope = -2.0 * dome.rise * (yz - dome.center) / (dome.semi * dome.semi);
            let added = pressure * (bent(dome_slope - slope) - 1.0) - rest * (bent(dome_slope) - 1.0);
            more.values[k] = -added as f32;
        }
    }
    more
}

/// The trapped air: the load that brings back the share `kept` of the volume that the tool takes without it. A grid
/// four times as coarse is fine enough for a volume.
fn extra_pressure(problem: &Problem<'_>, kept: f64, dome: &Dome) -> f32 {
    let (obstacle, free) = problem.coarser(0);
    let half = Problem { obstacle: &obstacle, free: &free, step: 2.0 * problem.step, ..*problem };
    let (obstacle, free) = half.coarser(1);
    let mut coarse = Problem { obstacle: &obstacle, free: &free, step: 2.0 * half.step, ..half };
    let cell = f64::from(coarse.step).powi(2);
    let volume = |w: &Field| w.values.iter().map(|&w| f64::from(w)).sum::<f64>() * cell;
    let mut w = coarse.solve(3, 12);
    let taken = volume(&w);
    // without any contact a load gives back this volume per unit
    let (a, b) = (dome.semi.x, dome.semi.y);
    let free_response = std::f64::consts::PI * a * b / (4.0 * (a.powi(-2) + b.powi(-2)));
    let mut response = free_response;
    for _ in 0..4 {
        coarse.load = -(kept * taken / response) as f32;
        coarse.relax(&mut w, 30);
        let back = taken - volume(&w);
        if coarse.load == 0.0 || back <= 0.0 {
            break;
        }
        // the contact holds the membrane: less comes back, but never less than a quarter
        response = (back / -f64::from(coarse.load)).clamp(0.25 * free_response, free_response);
    }
    -(kept * taken / response) as f32
}

/// Grids in the solver, the coarsest 8 times the finest step.
const LEVELS: usize = 4;
/// Times that the load is corrected for the slopes it led to.
const BENDINGS: usize = 2;
/// Slopes beyond this one bend no more: near vertical the sheet would hang over, which a height cannot say.
const STEEPEST: f64 = 1.6;
/// Sweeps on each grid. 24 leave an error below 0.1 mm against a thousand (tested).
const SWEEPS: usize = 24;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::tools;
    use crate::sim::{Grasp, SimConfig, random_grasp};

    #[test]
    fn few_sweeps_are_enough() {
        for (i, tool) in tools().iter().enumerate().step_by(4) {
            let membrane =
                Membrane::press(&SimConfig::default().bubble, tool, random_grasp(i as u64).object_from_grasp());
            let before = membrane.pushed.clone();
            let (worst, mean) = membrane.error_against_many_sweeps(3000);
            assert!(worst < 2e-4 && mean < 8e-5, "{}: worst {worst}, mean {mean}", tool.name);
            assert!(before.values.iter().any(|&w| w < -1e-3), "the free parts bulge");
        }
    }

    #[test]
    fn without_contact_the_membrane_is_the_dome() {
        let config = BubbleConfig { press_m: -0.002, ..BubbleConfig::default() };
        let membrane = Membrane::press(&config, &tools()[0], Grasp::default().object_from_grasp());
        assert!(membrane.pushed.values.iter().all(|w| w.abs() < 1e-7), "nothing touches, nothing moves");
    }
}
