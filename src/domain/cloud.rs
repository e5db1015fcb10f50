//! Point clouds lifted from imprints: one finger in its camera's view, both fingers in the grasp frame.
//!
//! The imprint is an argument of its own, so that a *predicted* imprint goes through the measured camera.

use glam::{DVec2, DVec3};

use super::grid::{DepthMap, Mask};
use super::rig::{PadId, PerPad, Rig, Text};
use super::sample::{DepthCamera, DepthTouch, Sample};

/// Why an imprint cannot be lifted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CloudError {
    /// The source has no camera (an image folder), so there is no third dimension.
    #[error("the {finger} finger has no camera data (intrinsics, reference depth): its pixels have no place in space")]
    NoCamera {
        /// The finger asked for.
        finger: Text,
    },
    /// Two images that must cover the same pixels do not.
    #[error("the {what} is {} x {} pixels, the imprint {} x {}: they must be equal", .size[0], .size[1], .imprint[0], .imprint[1])]
    Size {
        /// Which image differs.
        what: &'static str,
        /// Its width and height.
        size: [usize; 2],
        /// The imprint's width and height.
        imprint: [usize; 2],
    },
    /// More columns or rows than a pixel address holds.
    #[error("an imprint of {} x {} pixels is too large: at most 65535 on a side", .size[0], .size[1])]
    TooLarge {
        /// Width and height.
        size: [usize; 2],
    },
    /// Focal lengths or principal point cannot be a camera's, or the transform is not finite.
    #[error("the camera's {what} cannot be right: read them again from the source")]
    Camera {
        /// Which part of the camera.
        what: &'static str,
    },
}

/// Points of one finger with the pixel each came from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lifted {
    /// Meters, grasp frame, row by row.
    pub points: Vec<DVec3>,
    /// Column and row in the imprint, one per point.
    pub pixels: Vec<[u16; 2]>,
    /// Pixels of the mask without a usable depth: NaN, infinite, zero or negative. They have no point.
    pub invalid: usize,
    /// Pixels that the mask leaves out.
    pub outside_mask: usize,
}

/// Where a point of a [`ContactCloud`] came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointSource {
    /// The finger.
    pub finger: PadId,
    /// Column and row in that finger's imprint.
    pub pixel: [u16; 2],
}

/// What went into a finger's part of a cloud, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FingerCounts {
    /// Pixels that became points.
    pub points: usize,
    /// Pixels of the mask without a usable depth.
    pub invalid: usize,
    /// Pixels that the mask leaves out.
    pub outside_mask: usize,
}

/// The points of both fingers in the grasp frame, right finger first: what registration works on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactCloud {
    /// Meters, grasp frame.
    pub points: Vec<DVec3>,
    /// Finger and pixel, one per point.
    pub sources: Vec<PointSource>,
    /// None for a finger that is missing.
    pub counts: PerPad<FingerCounts>,
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
    lifted.outside_mask = imprint.len() - taken;
    for y in 0..imprint.height() {
        for x in 0..imprint.width() {
            if mask.is_some_and(|m| !m[(x, y)]) {
                continue;
            }
            if let Some(point) = lift_pixel(imprint, camera, x, y) {
                lifted.points.push(point);
                lifted.pixels.push([x as u16, y as u16]);
            } else {
                lifted.invalid += 1;
            }
        }
    }
    Ok(lifted)
}

/// The point of one pixel, meters, grasp frame; `None` outside the images and where the depth is unusable.
pub fn lift_pixel(imprint: &DepthMap, camera: &DepthCamera, x: usize, y: usize) -> Option<DVec3> {
    let reference = *camera.depth_reference.get(x, y)?;
    let depth = reference - imprint.get(x, y)?;
    if !(reference.is_finite() && reference > 0.0 && depth.is_finite() && depth > 0.0) {
        return None;
    }
    let in_camera = camera.lift(x as f64, y as f64, f64::from(depth));
    Some(camera.grasp_from_camera.transform_point3(in_camera))
}

/// The pixel position (column, row; not rounded) that sees a point given in the grasp frame, meters.
///
/// `None` behind the camera, for a point that is not finite, and for a camera whose transform has no inverse.
pub fn project(camera: &DepthCamera, in_grasp: DVec3) -> Option<DVec2> {
    let p = camera.grasp_from_camera.inverse().transform_point3(in_grasp);
    let (u, v) = camera.project(p)?;
    (u.is_finite() && v.is_finite()).then(|| DVec2::new(u, v))
}

/// [`lift`] for the measured imprint of one finger.
///
/// # Errors
/// [`CloudError::NoCamera`] for a touch of an image folder; otherwise as [`lift`].
pub fn lift_finger(touch: &DepthTouch, rig: &Rig, finger: PadId, mask: Option<&Mask>) -> Result<Lifted, CloudError> {
    let camera = touch.camera.as_ref().ok_or_else(|| CloudError::NoCamera { finger: rig.pad_key(finger) })?;
    lift(&touch.imprint, camera, mask)
}

impl ContactCloud {
    /// Joins the measured imprints of a sample; a finger without a mask is taken whole.
    ///
    /// A finger without a bubble image is left out and has no counts.
    ///
    /// # Errors
    /// As [`lift_finger`], for the first finger that fails.
    pub fn from_sample(sample: &Sample, masks: &PerPad<&Mask>) -> Result<Self, CloudError> {
        let mut cloud = Self::default();
        for (finger, touch) in sample.pads.entries() {
            if let Some(bubble) = touch.depth() {
                cloud.push(finger, lift_finger(bubble, &sample.rig, finger, masks[finger])?);
            }
        }
        Ok(cloud)
    }

    /// Adds a finger's points.
    pub fn push(&mut self, finger: PadId, lifted: Lifted) {
        self.counts[finger] = Some(FingerCounts {
            points: lifted.points.len(),
            invalid: lifted.invalid,
            outside_mask: lifted.outside_mask,
        });
        self.points.extend(lifted.points);
        self.sources.extend(lifted.pixels.into_iter().map(|pixel| PointSource { finger, pixel }));
    }

    /// The points in the plane of the tool: `(y, z)`, meters.
    pub fn yz(&self) -> Vec<DVec2> {
        self.points.iter().map(|p| DVec2::new(p.y, p.z)).collect()
    }

    /// Pixels that were asked for but have no usable depth, both fingers.
    pub fn invalid(&self) -> usize {
        self.counts.iter().flatten().map(|c| c.invalid).sum()
    }
}

/// Whether the camera can lift `imprint` at all.
pub(super) fn check(imprint: &DepthMap, camera: &DepthCamera) -> Result<(), CloudError> {
    same_size("reference depth", camera.depth_reference.size(), imprint)?;
    let size = imprint.size();
    if size.iter().any(|&n| n > usize::from(u16::MAX)) {
        return Err(CloudError::TooLarge { size });
    }
    if !camera.intrinsics.is_plausible() {
        return Err(CloudError::Camera { what: "intrinsics" });
    }
    if !camera.grasp_from_camera.is_finite() {
        return Err(CloudError::Camera { what: "position in the grasp frame" });
    }
    Ok(())
}

fn same_size(what: &'static str, size: [usize; 2], imprint: &DepthMap) -> Result<(), CloudError> {
    if size == imprint.size() { Ok(()) } else { Err(CloudError::Size { what, size, imprint: imprint.size() }) }
}

#[cfg(test)]
pub(super) mod testing {
    use super::*;
    use crate::domain::rig::lab;
    use crate::domain::sensor::Intrinsics;
    use glam::{DAffine3, DMat3};

    /// A camera as on the lab's rig: optical axis 35 degrees off the closing axis, 93 mm from the grasp origin.
    pub(crate) fn camera(width: usize, height: usize) -> DepthCamera {
        let x = DVec3::new(0.5729, 0.0, -0.8196).normalize();
        let z = DVec3::new(0.8196, 0.0, 0.5729).normalize();
        DepthCamera {
            depth_reference: DepthMap::filled(width, height, 0.09),
            intrinsics: Intrinsics { fx: 212.0, fy: 211.0, cx: 112.3, cy: 86.1 },
            crop: lab::BUBBLE.crop,
            grasp_from_camera: DAffine3::from_mat3_translation(
                DMat3::from_cols(x, DVec3::Y, z),
                DVec3::new(-0.0764, 0.0, -0.0541),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::rig::lab;
    use crate::domain::sample::PadTouch;

    const WIDTH: usize = lab::BUBBLE.width;
    const HEIGHT: usize = lab::BUBBLE.height;

    fn imprint() -> DepthMap {
        DepthMap::from_fn(WIDTH, HEIGHT, |x, y| 1e-4 * ((x * 7 + y * 13) % 100) as f32)
    }

    #[test]
    fn every_pixel_comes_back_to_its_place() {
        let camera = testing::camera(WIDTH, HEIGHT);
        let lifted = lift(&imprint(), &camera, None).unwrap();
        assert_eq!(lifted.points.len(), WIDTH * HEIGHT);
        for (point, pixel) in lifted.points.iter().zip(&lifted.pixels) {
            let back = project(&camera, *point).unwrap();
            assert!((back - DVec2::new(pixel[0].into(), pixel[1].into())).length() < 1e-9);
        }
        assert_eq!(project(&camera, DVec3::new(-1.0, 0.0, -1.0)), None);
        assert_eq!(project(&camera, DVec3::NAN), None);
    }

    #[test]
    fn unusable_depth_is_dropped_and_counted() {
        let mut camera = testing::camera(4, 2);
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
        assert_eq!((lifted.invalid, lifted.outside_mask), (5, 1));
        assert_eq!(lifted.pixels, [[1, 1], [2, 1]]);
    }

    #[test]
    fn fingers_are_joined_and_a_missing_one_is_fine() {
        let bubble = DepthTouch { imprint: imprint(), camera: Some(testing::camera(WIDTH, HEIGHT)), truth: None };
        let touch = |bubble| Some(PadTouch::default().with(lab::BUBBLE_ID, Some(bubble)));
        let mut sample = Sample { pads: [None, touch(bubble.clone())].into(), ..Sample::default() };
        let mask = Mask::from_fn(WIDTH, HEIGHT, |x, _| x < 10);
        let cloud = ContactCloud::from_sample(&sample, &[None, Some(&mask)].into()).unwrap();
        assert_eq!(cloud.points.len(), 10 * HEIGHT);
        assert_eq!(cloud.sources[0], PointSource { finger: lab::LEFT, pixel: [0, 0] });
        assert_eq!(cloud.counts[lab::RIGHT], None);
        sample.pads[lab::RIGHT] = touch(bubble.clone());
        let both = ContactCloud::from_sample(&sample, &[Some(&mask), Some(&mask)].into()).unwrap();
        assert_eq!((both.points.len(), both.yz().len(), both.invalid()), (20 * HEIGHT, 20 * HEIGHT, 0));
        sample.pads[lab::RIGHT] = touch(DepthTouch { camera: None, ..bubble });
        assert_eq!(
            ContactCloud::from_sample(&sample, &PerPad::default()),
            Err(CloudError::NoCamera { finger: "right".into() })
        );
    }

    #[test]
    fn cameras_that_do_not_fit_are_refused() {
        let camera = testing::camera(4, 2);
        assert!(matches!(lift(&imprint(), &camera, None), Err(CloudError::Size { what: "reference depth", .. })));
        let small = DepthMap::filled(4, 2, 0.0);
        let mask = Mask::filled(2, 4, true);
        assert!(matches!(lift(&small, &camera, Some(&mask)), Err(CloudError::Size { what: "mask", .. })));
        let mut broken = camera.clone();
        broken.intrinsics.fx = f64::NAN;
        assert_eq!(lift(&small, &broken, None), Err(CloudError::Camera { what: "intrinsics" }));
        let mut lost = camera;
        lost.grasp_from_camera.translation.x = f64::INFINITY;
        assert!(matches!(lift(&small, &lost, None), Err(CloudError::Camera { .. })));
    }
}
