//! Carrying a mask to another imprint of the same tool: [`carry`].

use glam::{DAffine3, DMat3, DVec3};

use crate::cloud::{self, CloudError};
use crate::grid::{DepthMap, Mask};
use crate::sample::DepthCamera;

/// An imprint with the camera that felt it.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Imprint, meters.
    pub imprint: &'a DepthMap,
    /// Camera of the same finger.
    pub camera: &'a DepthCamera,
}

/// A mask that was carried.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// The contact, as large as the imprint it was carried to.
    pub mask: Mask,
    /// Median distance of its points from those they were carried from, meters: how far the two membranes disagree about
    /// where the tool is. `None` without contact.
    pub drift_m: Option<f64>,
}

/// The way from one finger's side of the gripper to the other's: the fingers close along x.
pub fn across() -> DAffine3 {
    DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)))
}

/// Carries `mask` from one imprint to another. `from_to` takes points of the grasp frame of `to` to where they lay in that of
/// `from`: with the tool, whose contact moves with it, or [`across`] to the other finger.
///
/// A pixel becomes contact where the surface that it was carried from is contact and no further than `gate_m` away:
/// what the membrane no longer touches is left out.
///
/// # Errors
/// [`CloudError`] if sizes differ or a camera's numbers cannot be right.
pub fn carry(
    from: Surface<'_>,
    mask: &Mask,
    to: Surface<'_>,
    from_to: DAffine3,
    gate_m: f64,
) -> Result<Carried, CloudError> {
    cloud::check(from.imprint, from.camera)?;
    cloud::check(to.imprint, to.camera)?;
    cloud::same_size("mask", mask.size(), from.imprint)?;
    let mut drifts = Vec::new();
    let carried = Mask::from_fn(to.imprint.width(), to.imprint.height(), |x, y| {
        let Some(there) = cloud::lift_pixel(to.imprint, to.camera, x, y) else { return false };
        let there = from_to.transform_point3(there);
        let Some(pixel) = cloud::project(from.camera, there).map(|pixel| pixel.round()) else { return false };
        if pixel.x < 0.0 || pixel.y < 0.0 {
            return false;
        }
        let pixel = (pixel.x as usize, pixel.y as usize);
        if mask.get(pixel.0, pixel.1) != Some(&true) {
            return false;
        }
        let Some(here) = cloud::lift_pixel(from.imprint, from.camera, pixel.0, pixel.1) else { return false };
        let drift = here.distance(there);
        let near = drift <= gate_m;
        if near {
            drifts.push(drift);
        }
        near
    });
    let middle = drifts.len() / 2;
    let drift_m = (!drifts.is_empty()).then(|| *drifts.select_nth_unstable_by(middle, f64::total_cmp).1);
    Ok(Carried { mask: carried, drift_m })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog;
    use crate::label::agreement;
    use crate::rig::lab;
    use crate::sample::Sample;
    use crate::sim::{Grasp, SimConfig, simulate};

    fn grasp(held: Grasp, seed: u64) -> Sample {
        simulate(&catalog::tools()[0], held, seed, &SimConfig::default())
    }

    /// The noise-free imprint of a finger: the grain is somebody else's.
    fn surface(sample: &Sample, finger: usize) -> (Surface<'_>, &Mask) {
        let touch = sample.pad(lab::PADS[finger]).unwrap();
        let truth = touch.depth().unwrap().truth.as_ref().unwrap();
        (Surface { imprint: &truth.imprint, camera: touch.camera().unwrap() }, &truth.contact)
    }

    #[test]
    fn a_mask_follows_its_tool_and_reaches_the_other_finger() {
        let a = grasp(Grasp { theta_rad: 0.0, x_m: 0.0, y_m: 0.0 }, 3);
        let b = grasp(Grasp { theta_rad: 0.15, x_m: 0.004, y_m: -0.003 }, 4);
        let [pa, pb] = [&a, &b].map(|s| s.grasp_from_object.unwrap().to_affine());
        let from_to = pa * pb.inverse();
        let ((from, mask), (to, truth)) = (surface(&a, 0), surface(&b, 0));
        let iou = |mask: &Mask, truth: &Mask| agreement(mask, truth).unwrap().iou;
        let moved = carry(from, mask, to, from_to, 0.0015).unwrap();
        let unmoved = iou(mask, truth);
        assert!(iou(&moved.mask, truth) > 0.8, "{} instead of {unmoved}", iou(&moved.mask, truth));
        assert!(unmoved < 0.7 && moved.drift_m.unwrap() < 0.0005, "{unmoved} {:?}", moved.drift_m);
        let (other, truth) = surface(&a, 1);
        let crossed = carry(from, mask, other, across(), 0.003).unwrap();
        assert!(iou(&crossed.mask, truth) > 0.8, "{}", iou(&crossed.mask, truth));
        let none = Mask::filled(175, 140, false);
        assert_eq!(carry(from, &none, to, from_to, 0.001).unwrap(), Carried { mask: none.clone(), drift_m: None });
        assert!(carry(from, &Mask::filled(3, 3, true), to, from_to, 0.001).is_err());
        let nan = DepthMap::filled(175, 140, f32::NAN);
        let blind = Surface { imprint: &nan, ..to };
        assert_eq!(carry(from, mask, blind, from_to, 0.001).unwrap().mask, none);
    }
}
