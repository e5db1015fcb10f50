//! The bubble's membrane: a sheet over a deep elliptical rim, blown up and pressed onto the tool.
//!
//! Coordinates of one finger: `n` points away from the finger (towards the other one, 0 in the tool's middle plane), `y` and
//! `z` are the grasp frame's. Free, the membrane is a dome over the rim. Pressed, it may not pass the tool; in between it
//! spans freely, so it hangs in flat facets from bead to bead and falls off steeply beside a bar (see [`super::sheet`]).
//! The law and its constants were fitted to half of 36 published imprints and kept on the other half: the best touch of the
//! same tool then resembles a real one to 28.2 dB (best straight line, 64 px).
//!
//! Left out: friction between membrane and tool, the air that the tool displaces, the other finger's membrane.

use glam::DVec2;

use super::sheet::Sheet;
use super::{BubbleConfig, MEMBRANE_STEP_M};
use crate::catalog::{Solid, ToolSpec};
use crate::frames::PlanarPose;
use crate::rig::PadId;

/// A pressed membrane.
pub struct Membrane {
    dome: Dome,
    tool: Solid,
    object_from_grasp: PlanarPose,
    sheet: Sheet,
    /// Height at each node, meters.
    height: Vec<f64>,
    /// Nodes that a bar lies beside or under.
    near_tool: Vec<bool>,
    origin: DVec2,
}

/// The undeformed membrane.
#[derive(Clone, Copy, Debug)]
pub struct Dome {
    /// Height of the apex, meters.
    pub apex: f64,
    /// Height of the apex over the rim, meters.
    pub rise: f64,
    /// Share by which it is fuller than a paraboloid.
    pub fullness: f64,
    /// Slope of the rim's plane along z.
    pub tilt: f64,
    /// Semi-axes of the rim along y and z, meters.
    pub semi: DVec2,
    /// Center of the rim, (y, z), meters.
    pub center: DVec2,
}

impl Dome {
    /// The dome of a finger's bubble pressed by `config.press_m` onto a tool of this thickness.
    pub fn new(config: &BubbleConfig, half_thickness_m: f64, finger: PadId) -> Self {
        Self {
            apex: config.press_m - half_thickness_m,
            rise: config.dome_rise_m,
            fullness: config.dome_fullness,
            tilt: config.rim_tilt,
            semi: DVec2::from_array(config.rim_semi_axes_m),
            center: DVec2::from_array(config.rim_centers_m[finger.index()]),
        }
    }

    /// Height at `(y, z)`; beyond the rim that of the rim's plane.
    pub fn height(&self, yz: DVec2) -> f64 {
        let share = ((yz - self.center) / self.semi).length_squared().min(1.0);
        self.apex - self.rise * share * (1.0 - self.fullness * (1.0 - share)) + self.tilt * (yz.y - self.center.y)
    }

    /// Height of the rim's plane at `(y, z)`.
    fn rim(&self, yz: DVec2) -> f64 {
        self.apex - self.rise + self.tilt * (yz.y - self.center.y)
    }
}

impl Membrane {
    /// Solves the contact of a finger's membrane with `tool` held at `object_from_grasp`.
    pub fn press(config: &BubbleConfig, tool: &ToolSpec, object_from_grasp: PlanarPose, finger: PadId) -> Self {
        let dome = Dome::new(config, tool.half_thickness_m, finger);
        let tool = tool.solid();
        let count = (2.0 * dome.semi / MEMBRANE_STEP_M).ceil();
        let step = 2.0 * dome.semi / count;
        let (columns, rows) = (count.x as usize + 3, count.y as usize + 3);
        let origin = dome.center - dome.semi - step;
        let mut sheet = Sheet {
            columns,
            rows,
            step,
            obstacle: vec![f64::INFINITY; columns * rows],
            free: vec![false; columns * rows],
            rim: [dome.apex - dome.rise, dome.tilt],
            load: config.pressure_per_m,
            stiffening: config.stiffening,
        };
        let mut near_tool = vec![false; columns * rows];
        for (k, near) in near_tool.iter_mut().enumerate() {
            let yz = origin + DVec2::new((k % columns) as f64, (k / columns) as f64) * step;
            sheet.free[k] = ((yz - dome.center) / dome.semi).length_squared() < 1.0;
            let p = object_from_grasp.transform_yz(yz);
            let beside = tool.outline_distance(p);
            *near = beside < 1.5 * step.max_element();
            if sheet.free[k] && beside < WIDER_M {
                // A thin bead may fall between the nodes: the tool is a little wider for them.
                let around = [DVec2::ZERO, DVec2::X, -DVec2::X, DVec2::Y, -DVec2::Y].map(|to| p + to * WIDER_M);
                let highest = around.into_iter().filter_map(|p| tool.height(p)).reduce(f64::max);
                sheet.obstacle[k] = highest.map_or(f64::INFINITY, |height| -height);
            }
        }
        let height = sheet.solve();
        Self { dome, tool, object_from_grasp, sheet, height, near_tool, origin }
    }

    /// The undeformed shape.
    pub fn dome(&self) -> &Dome {
        &self.dome
    }

    /// Height that the membrane is nowhere below, meters.
    pub(super) fn lowest(&self) -> f64 {
        // Between the nodes the tool's exact surface counts, a little deeper than the grid's.
        self.height.iter().copied().fold(f64::INFINITY, f64::min) - 2e-3
    }

    /// Height of the membrane at `(y, z)`, meters.
    pub fn height(&self, yz: DVec2) -> f64 {
        let (free, near_tool) = self.between_nodes(yz);
        // Between the nodes the tool's edges are sharper than the grid.
        let tool = if near_tool { self.tool.height(self.object_from_grasp.transform_yz(yz)) } else { None };
        tool.map_or(free, |height| free.min(-height))
    }

    /// Height that the membrane is hardly ever below at `(y, z)`, without asking the tool, meters.
    pub(super) fn floor(&self, yz: DVec2) -> f64 {
        /// The membrane's slope times a node's distance.
        const STEEP_M: f64 = 3e-3;
        let (free, near_tool) = self.between_nodes(yz);
        if near_tool { free - STEEP_M } else { free }
    }

    /// Height of the grid at `(y, z)`, and whether the tool is near.
    fn between_nodes(&self, yz: DVec2) -> (f64, bool) {
        let at = (yz - self.origin) / self.sheet.step;
        let (columns, rows) = (self.sheet.columns, self.sheet.rows);
        if !(at.x >= 0.0 && at.y >= 0.0 && at.x < (columns - 1) as f64 && at.y < (rows - 1) as f64) {
            return (self.dome.rim(yz), false);
        }
        let k = at.y as usize * columns + at.x as usize;
        let near_tool = [k, k + 1, k + columns, k + columns + 1].iter().any(|&k| self.near_tool[k]);
        (self.sheet.between(&self.height, at), near_tool)
    }

    /// Distance of the membrane's point `(n, y, z)` from the tool's surface, meters, negative inside; more than
    /// `limit` is only known to be more.
    pub(crate) fn distance_to_tool(&self, n: f64, yz: DVec2, limit: f64) -> f64 {
        let p = self.object_from_grasp.transform_yz(yz);
        let s = self.tool.outline_distance(p);
        if s > limit { s } else { self.tool.signed_distance(glam::DVec3::new(n, p.x, p.y)) }
    }
}

/// Widening of the tool for the nodes, meters.
const WIDER_M: f64 = 0.000_4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::tools;
    use crate::rig::lab;
    use crate::sim::{Grasp, SimConfig};

    #[test]
    fn the_membrane_hangs_from_the_beads_and_falls_off_beside_the_tool() {
        let tool = &tools()[2];
        let config = SimConfig::default().bubble;
        let membrane = Membrane::press(&config, tool, Grasp::default().object_from_grasp(), lab::RIGHT);
        let at = |y: f64, z: f64| membrane.height(DVec2::new(y, z) * 1e-3);
        let top = -tool.half_thickness_m;
        assert!((at(0.0, 0.0) - top).abs() < 1e-4, "on the bead");
        // Between two bars it does not reach the walls' feet; beyond the tool's end it falls on towards the rim.
        assert!(at(8.0, 8.0) > top + 1e-3 && at(8.0, 8.0) < top + 0.012, "{}", at(8.0, 8.0));
        assert!(at(0.0, 37.0) < top - 2e-3, "{}", at(0.0, 37.0));
    }
}
