//! Points lifted from an imprint to the grasp frame.
//!
//! The imprint is an argument of its own, so that a *predicted* imprint goes through the measured camera.

mod membrane;

pub use membrane::membrane;

use glam::DVec3;

use super::grid::{DepthMap, Mask};
use super::sample::DepthCamera;

/// Why an imprint cannot be lifted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct CloudError(String);

/// Points of one finger with the pixel each came from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lifted {
    /// Meters, grasp frame, row by row.
    pub points: Vec<DVec3>,
    /// Column and row in the imprint, one per point.
    pub pixels: Vec<[u16; 2]>,
    /// Pixels of the mask without a usable depth: NaN, infinite, zero or negative. They have no point.
    pub invalid: usize,
}

/// Lifts the pixels of `imprint` that `mask` contains (all without one) to the grasp frame.
///
/// Depth is `camera.depth_reference - imprint`, in meters along the optical axis. Pixels whose depth or reference
/// is NaN, infinite, zero or negative are counted in [`Lifted::invalid`] and left out.
///
/// # Errors
/// [`CloudError`] if sizes differ or the camera's numbers cannot be right.
///
/// # Source
/// The lab's `ICP_dataset_cal.py` lines 426-463 (pinhole with crop offset, camera to grasp); the lab does not drop
/// invalid pixels.
pub fn lift(imprint: &DepthMap, camera: &DepthCamera, mask: Option<&Mask>) -> Result<Lifted, CloudError> {
    check(imprint, camera)?;
    if let Some(mask) = mask {
        same_size("mask", mask.size(), imprint)?;
    }
    let mut lifted = Lifted::default();
    let taken = mask.map_or(imprint.len(), |m| m.as_slice().iter().filter(|&&m| m).count());
    lifted.points.reserve_exact(taken);
    lifted.pixels.reserve_exact(taken);
    for y in 0..imprint.height() {
        let pixels = imprint.row(y).iter().zip(camera.depth_reference.row(y)).enumerate();
        let mask = mask.map(|mask| mask.row(y));
        for (x, (imprint, reference)) in pixels.filter(|(x, _)| mask.is_none_or(|mask| mask[*x])) {
            if let Some(depth) = usable_depth(*imprint, *reference) {
                lifted.points.push(lift_depth(f64::from(depth), camera, x, y));
                lifted.pixels.push([x as u16, y as u16]);
            } else {
                lifted.invalid += 1;
            }
        }
    }
    Ok(lifted)
}

/// The point of one pixel, meters, grasp frame; `None` outside the images and where the depth is unusable.
pub(crate) fn lift_pixel(imprint: &DepthMap, camera: &DepthCamera, x: usize, y: usize) -> Option<DVec3> {
    let depth = usable_depth(*imprint.get(x, y)?, *camera.depth_reference.get(x, y)?)?;
    Some(lift_depth(f64::from(depth), camera, x, y))
}

/// Depth along the optical axis, meters, of a pixel whose depth and reference can be right.
#[inline]
fn usable_depth(imprint: f32, reference: f32) -> Option<f32> {
    let depth = reference - imprint;
    (reference.is_finite() && reference > 0.0 && depth.is_finite() && depth > 0.0).then_some(depth)
}

/// The point of a pixel at a depth along the optical axis, meters, grasp frame.
#[inline]
fn lift_depth(depth: f64, camera: &DepthCamera, x: usize, y: usize) -> DVec3 {
    camera.grasp_from_camera.transform_point3(camera.lift(x as f64, y as f64, depth))
}

/// Checks that the camera can lift `imprint` at all.
pub(super) fn check(imprint: &DepthMap, camera: &DepthCamera) -> Result<(), CloudError> {
    same_size("reference depth", camera.depth_reference.size(), imprint)?;
    let [width, height] = imprint.size();
    if width.max(height) > usize::from(u16::MAX) {
        let why = format!("an imprint of {width} x {height} pixels is too large: at most 65535 on a side");
        return Err(CloudError(why));
    }
    let wrong = |what| CloudError(format!("the camera's {what} cannot be right: read them again from the source"));
    if !camera.intrinsics.is_plausible() {
        return Err(wrong("intrinsics"));
    }
    if !camera.grasp_from_camera.is_finite() {
        return Err(wrong("position in the grasp frame"));
    }
    Ok(())
}

pub(super) fn same_size(what: &'static str, size: [usize; 2], imprint: &DepthMap) -> Result<(), CloudError> {
    if size == imprint.size() {
        return Ok(());
    }
    let ([width, height], [columns, rows]) = (size, imprint.size());
    let why = format!("the {what} is {width} x {height} pixels, the imprint {columns} x {rows}: they must be equal");
    Err(CloudError(why))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::camera;
    use crate::rig::lab;

    const WIDTH: usize = lab::BUBBLE.width;
    const HEIGHT: usize = lab::BUBBLE.height;

    fn imprint() -> DepthMap {
        DepthMap::from_fn(WIDTH, HEIGHT, |x, y| 1e-4 * ((x * 7 + y * 13) % 100) as f32)
    }

    #[test]
    fn every_pixel_comes_back_to_its_place() {
        let camera = camera(WIDTH, HEIGHT);
        let lifted = lift(&imprint(), &camera, None).unwrap();
        assert_eq!(lifted.points.len(), WIDTH * HEIGHT);
        for (point, pixel) in lifted.points.iter().zip(&lifted.pixels) {
            let (u, v) = camera.project(camera.grasp_from_camera.inverse().transform_point3(*point)).unwrap();
            assert!((u - f64::from(pixel[0])).abs() < 1e-9 && (v - f64::from(pixel[1])).abs() < 1e-9);
        }
    }

    #[test]
    fn unusable_depth_is_dropped_and_counted() {
        let mut camera = camera(4, 2);
        let mut imprint = DepthMap::filled(4, 2, 0.001);
        imprint[(0, 0)] = f32::NAN;
        imprint[(1, 0)] = f32::NEG_INFINITY;
        imprint[(2, 0)] = 0.09; // depth zero, as a dropped pixel reads
        imprint[(3, 0)] = 0.1;
        camera.depth_reference[(0, 1)] = 0.0;
        imprint[(0, 1)] = -0.09; // the depth itself looks fine, but it was never compared with anything
        let mut mask = Mask::filled(4, 2, true);
        mask[(3, 1)] = false;
        let lifted = lift(&imprint, &camera, Some(&mask)).unwrap();
        assert_eq!(lifted.invalid, 5);
        assert_eq!(lifted.pixels, [[1, 1], [2, 1]]);
    }

    #[test]
    fn cameras_that_do_not_fit_are_refused() {
        let camera = camera(4, 2);
        let refused =
            |imprint: &DepthMap, camera: &DepthCamera, mask| lift(imprint, camera, mask).unwrap_err().to_string();
        assert!(refused(&imprint(), &camera, None).starts_with("the reference depth is 4 x 2 pixels"));
        let small = DepthMap::filled(4, 2, 0.0);
        let mask = Mask::filled(2, 4, true);
        assert!(refused(&small, &camera, Some(&mask)).starts_with("the mask is 2 x 4 pixels"));
        let mut broken = camera.clone();
        broken.intrinsics.fx = f64::NAN;
        assert!(refused(&small, &broken, None).contains("intrinsics"));
        let mut lost = camera;
        lost.grasp_from_camera.translation.x = f64::INFINITY;
        assert!(refused(&small, &lost, None).contains("position"));
    }
}
