//! Things that are no tools of the lab's data set, for trials of a robot: a pencil, and a cup by its handle.
//!
//! They are not in [`tools()`](super::tools()), which training, tests and tables count on.

use std::sync::LazyLock;

use glam::{DVec2, DVec3};

use super::shape::{Bar, Section, ToolSpec};
use crate::mesh::TriMesh;

/// Place of the cup's axis along y, meters, object frame: its wall is farther from the grip than the membranes reach.
pub const CUP_AXIS_M: f64 = 0.075;
/// Place of the cup's base along z, meters, object frame.
pub const CUP_BASE_M: f64 = 0.045;
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
pub fn pencil() -> ToolSpec {
    let outline = [(-3.5, -60.5), (3.5, -60.5), (3.5, 20.0), (0.5, 34.5), (-0.5, 34.5), (-3.5, 20.0)];
    let outline = outline.map(|(y, z)| DVec2::new(y, z) * 1e-3).to_vec();
    flat("pencil", Vec::new(), vec![outline], 0.002, 0.002)
}

/// The handle that a cup is held by: a strap along the cup's axis, with an arm to the wall at each end.
///
/// Held at the strap the cup's tilt is that of a bar between two arms, which the fingers feel; held by its round wall, only
/// the rim would tell, which no finger is sure to meet.
pub fn cup_handle() -> ToolSpec {
    let path = [(HANDLE_M, -HALF_GRIP_M), (0.0, -HALF_GRIP_M), (0.0, HALF_GRIP_M), (HANDLE_M, HALF_GRIP_M)];
    let path = path.map(|(y, z)| DVec2::new(y, z)).to_vec();
    let strap = Bar { path, half_width_m: HALF_STRAP_M, rounding_m: 0.0 };
    flat("cup", vec![strap], Vec::new(), 0.00125, 0.0016)
}

/// True for the model of [`cup_handle`], however its vertices are ordered: a tool of its extent and its number of triangles.
pub fn is_cup_handle(mesh: &TriMesh) -> bool {
    /// Rounding of a file, meters.
    const SAME_M: f64 = 1e-6;
    // The model is made once: every trial of every tool asks.
    static HANDLE: LazyLock<(usize, Option<[DVec3; 2]>)> = LazyLock::new(|| {
        let handle = cup_handle().mesh();
        (handle.triangles.len(), handle.bounds())
    });
    let (triangles, bounds) = *HANDLE;
    let near = |(a, b): (&DVec3, &DVec3)| a.abs_diff_eq(*b, SAME_M);
    mesh.triangles.len() == triangles && mesh.bounds().zip(bounds).is_some_and(|(a, b)| a.iter().zip(&b).all(near))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::tools;
    use crate::sim::{Grasp, SimConfig, simulate};
    use crate::tool::ToolModel;

    #[test]
    fn they_are_solid_can_be_felt_and_leave_the_catalog_alone() {
        for spec in [pencil(), cup_handle()] {
            assert!(tools().iter().all(|tool| tool.name != spec.name));
            let mesh = spec.mesh();
            assert!(mesh.is_watertight(), "{}", spec.name);
            ToolModel::new(mesh).unwrap();
            let felt = |degrees: f64| {
                let grasp = Grasp { theta_rad: degrees.to_radians(), ..Grasp::default() };
                simulate(&spec, grasp, 1, &SimConfig::default())
            };
            let (upright, turned) = (felt(0.0), felt(15.0));
            let pad = crate::rig::lab::RIGHT;
            let contact = |sample: &crate::sample::Sample| {
                let truth = sample.pad(pad).unwrap().depth().unwrap().truth.as_ref().unwrap().contact.clone();
                (truth.as_slice().iter().filter(|c| **c).count(), truth)
            };
            let ((count, a), (_, b)) = (contact(&upright), contact(&turned));
            assert!(count > 500, "{}: {count} pixels of contact", spec.name);
            assert_ne!(a, b, "{}: its angle can be seen", spec.name);
        }
        let is_cup = |spec: &ToolSpec| is_cup_handle(&spec.mesh());
        assert!(is_cup(&cup_handle()) && !is_cup(&pencil()) && !tools().iter().any(is_cup));
        assert!(!is_cup_handle(&TriMesh::default()));
        let tip = pencil().mesh().bounds().unwrap()[1].z;
        assert!((tip - 0.0345).abs() < 1e-4, "{tip}");
    }
}
