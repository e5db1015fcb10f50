//! Things that are no tools of the lab's data set, for trials of a robot: a pencil, and a cup by its handle.

use glam::DVec2;
use touch2touch_core::catalog::{Bar, Section, ToolSpec};

/// Name of the cup.
pub(super) const CUP: &str = "cup";

/// Place of the cup's axis along y, meters, object frame: its wall is farther from the grip than the membranes reach.
pub(super) const CUP_AXIS_M: f64 = 0.075;
/// Place of the cup's base along z, meters, object frame.
pub(super) const CUP_BASE_M: f64 = 0.045;
/// Distance from the grip to the cup's wall, meters.
const HANDLE_M: f64 = 0.035;
/// Half the height of the handle's opening, meters.
const HALF_GRIP_M: f64 = 0.02;
/// Half the width of the handle's strap, meters.
const HALF_STRAP_M: f64 = 0.0025;
/// Half the thickness of both, meters.
const HALF_THICKNESS_M: f64 = 0.0115;

/// A tool of flat parts about the middle of the object frame.
fn flat(name: &str, bars: Vec<Bar>, plates: Vec<Vec<DVec2>>, width_m: f64, depth_m: f64) -> ToolSpec {
    ToolSpec {
        name: name.to_owned(),
        seen: false,
        bars,
        plates,
        section: Section::Bevel { width_m, depth_m },
        half_thickness_m: HALF_THICKNESS_M,
        middle_x_m: 0.0,
    }
}

/// A pencil: a rod of 7 mm, whose cone of 14 mm ends in a tip of 1 mm, 34.5 mm from the grip.
pub(super) fn pencil() -> ToolSpec {
    let outline = [(-3.5, -60.5), (3.5, -60.5), (3.5, 20.0), (0.5, 34.5), (-0.5, 34.5), (-3.5, 20.0)];
    let outline = outline.map(|(y, z)| DVec2::new(y, z) * 1e-3).to_vec();
    flat("pencil", Vec::new(), vec![outline], 0.002, 0.002)
}

/// The handle that a cup is held by: a strap along the cup's axis, with an arm to the wall at each end.
///
/// Held at the strap the cup's tilt is that of a bar between two arms, which the fingers feel; held by its round wall, only
/// the rim would tell, which no finger is sure to meet.
pub(super) fn cup_handle() -> ToolSpec {
    let path = [(HANDLE_M, -HALF_GRIP_M), (0.0, -HALF_GRIP_M), (0.0, HALF_GRIP_M), (HANDLE_M, HALF_GRIP_M)];
    let path = path.map(|(y, z)| DVec2::new(y, z)).to_vec();
    let strap = Bar { path, half_width_m: HALF_STRAP_M, rounding_m: 0.0 };
    flat(CUP, vec![strap], Vec::new(), 0.00125, 0.0016)
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::catalog::tools;
    use touch2touch_core::rig::lab;
    use touch2touch_core::sample::Sample;
    use touch2touch_core::sim::{Grasp, SimConfig, simulate};
    use touch2touch_core::tool::ToolModel;

    #[test]
    fn they_are_solid_can_be_felt_and_leave_the_catalog_alone() {
        for spec in [pencil(), cup_handle()] {
            assert!(tools().iter().all(|tool| tool.name != spec.name));
            let mesh = spec.mesh();
            assert!(mesh.is_watertight(), "{}", spec.name);
            ToolModel::new(mesh).unwrap();
            let estimate = |degrees: f64| {
                let grasp = Grasp { theta_rad: degrees.to_radians(), ..Grasp::default() };
                simulate(&spec, grasp, 1, &SimConfig::default())
            };
            let (upright, turned) = (estimate(0.0), estimate(15.0));
            let pad = lab::RIGHT;
            let contact = |sample: &Sample| {
                let truth = sample.pad(pad).unwrap().depth().unwrap().truth.as_ref().unwrap().contact.clone();
                (truth.as_slice().iter().filter(|c| **c).count(), truth)
            };
            let ((count, a), (_, b)) = (contact(&upright), contact(&turned));
            assert!(count > 500, "{}: {count} pixels of contact", spec.name);
            assert_ne!(a, b, "{}: its angle can be seen", spec.name);
        }
        let tip = pencil().mesh().bounds().unwrap()[1].z;
        assert!((tip - 0.0345).abs() < 1e-4, "{tip}");
    }
}
