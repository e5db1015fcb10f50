//! Imprint and mask to surface points in the grasp frame: [`clouds`].

use glam::DVec3;

use crate::error::TaskError;
use crate::labels::ImprintSource;
use touch2touch_core::align::PadImage;
use touch2touch_core::cloud;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::{Sight, VisiblePixels};
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;

const WHAT: &str = "Point cloud";

/// The surface points of both fingers in the grasp frame.
#[derive(Clone, Debug, Default)]
pub struct Clouds {
    /// Per finger.
    pub fingers: PerPad<FingerCloud>,
}

/// The surface points of one finger, one per pixel with a measurement, row by row.
#[derive(Clone, Debug, Default)]
pub struct FingerCloud {
    /// Positions, meters, grasp frame.
    pub points: Vec<DVec3>,
    /// The raw bubble pixel `(x, y)` of each point.
    pub pixels: Vec<[u16; 2]>,
    /// True for each point that is a contact point.
    pub contact: Vec<bool>,
}

impl Clouds {
    /// The cloud of one finger.
    pub fn finger(&self, finger: PadId) -> Option<&FingerCloud> {
        self.fingers[finger].as_ref()
    }

    /// The contact points of both fingers, right first: what is registered.
    pub fn contact_points(&self) -> Vec<DVec3> {
        self.fingers.iter().flatten().flat_map(FingerCloud::contact_points).collect()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.fingers.iter().flatten().map(|f| f.points.len() * 32).sum()
    }
}

impl FingerCloud {
    /// The points in contact.
    pub fn contact_points(&self) -> impl Iterator<Item = DVec3> {
        self.points.iter().zip(&self.contact).filter(|(_, contact)| **contact).map(|(point, _)| *point)
    }

    /// The index of the point at a raw bubble pixel. Points are in row order, so this is a binary search.
    pub fn at_pixel(&self, x: usize, y: usize) -> Option<usize> {
        self.pixels.binary_search_by_key(&(y, x), |p| (p[1].into(), p[0].into())).ok()
    }
}

/// The surface points of both fingers of a sample: a finger without imprint or camera is left out, and without a mask no point
/// is of contact.
///
/// # Errors
/// If the sizes differ or the camera's numbers cannot be right.
pub fn clouds(sample: &Sample, imprints: &PerPad<&DepthMap>, masks: &PerPad<&Mask>) -> Result<Clouds, TaskError> {
    let mut clouds = Clouds::default();
    for finger in sample.rig.pads() {
        let camera = sample.pad(finger).and_then(|t| t.camera());
        let (Some(imprint), mask, Some(camera)) = (imprints[finger], masks[finger], camera) else { continue };
        let lifted = cloud::lift(imprint, camera, None).map_err(|err| TaskError::from_error(WHAT, &err))?;
        if let Some(mask) = mask.filter(|mask| mask.size() != imprint.size()) {
            let why = format!("the mask has {:?} pixels, the imprint {:?}", mask.size(), imprint.size());
            return Err(TaskError::new(WHAT, why).with_hint("Remove the correction of this mask."));
        }
        let is_contact = |&[x, y]: &[u16; 2]| mask.is_some_and(|m| m.get(x.into(), y.into()).is_some_and(|&c| c));
        let contact = lifted.pixels.iter().map(is_contact).collect();
        clouds.fingers[finger] = Some(FingerCloud { points: lifted.points, pixels: lifted.pixels, contact });
    }
    Ok(clouds)
}

/// The contact points of both fingers, right first: those of [`Clouds::contact_points`] where nobody looks at the rest of
/// the surface. A finger without imprint, mask or camera is left out.
///
/// # Errors
/// If no finger is left, the sizes differ, or a camera's numbers cannot be right.
pub fn contact_points(
    sample: &Sample,
    imprints: &PerPad<&DepthMap>,
    masks: &PerPad<&Mask>,
) -> Result<Vec<DVec3>, TaskError> {
    let (mut points, mut any) = (Vec::new(), false);
    for pad in sample.rig.pads() {
        let camera = sample.pad(pad).and_then(|t| t.camera());
        let (Some(imprint), Some(mask), Some(camera)) = (imprints[pad], masks[pad], camera) else { continue };
        let lifted = cloud::lift(imprint, camera, Some(mask));
        let why = |err| TaskError::new(WHAT, format!("{} finger: {err}", sample.rig.pad_key(pad)));
        points.extend(lifted.map_err(why)?.points);
        any = true;
    }
    let why = "neither finger has an imprint with camera data, so there are no points to align";
    if any { Ok(points) } else { Err(TaskError::new(WHAT, why)) }
}

/// Views of the pads' depth cameras, for registrations that look at more than contact points. A pad without imprint or
/// camera is left out, and a gel: what they look at is a membrane.
pub fn images<'a>(sample: &'a Sample, imprints: &PerPad<&'a DepthMap>, source: ImprintSource) -> Vec<PadImage<'a>> {
    let predicted = source == ImprintSource::Predicted;
    let tolerance = sample.rig.camera_tolerance;
    let image =
        |pad| Some(PadImage { imprint: imprints[pad]?, camera: sample.pad(pad)?.camera()?, predicted, tolerance });
    sample.rig.pads().filter(|_| !sample.rig.is_gel()).filter_map(image).collect()
}

/// Pixels of a finger's imprint that are visible in a 3D picture that its mask is drawn on, with their places in it.
/// Points of the other fingers can hide them.
///
/// # Errors
/// If the finger has no imprint or no camera, or as [`clouds`].
pub fn seen(
    sample: &Sample,
    imprints: &PerPad<&DepthMap>,
    pad: PadId,
    sight: &Sight,
) -> Result<VisiblePixels, TaskError> {
    const WHAT: &str = "Draw in 3D";
    let mut lifted = PerPad::default();
    for other in sample.rig.pads() {
        let camera = sample.pad(other).and_then(|t| t.camera());
        if let (Some(imprint), Some(camera)) = (imprints[other], camera) {
            let points = cloud::lift(imprint, camera, None).map_err(|err| TaskError::from_error(WHAT, &err))?;
            lifted[other] = Some(points);
        }
    }
    let lacks = || {
        let why = format!(
            "the {} finger has no points in space: it takes an imprint and its camera",
            sample.rig.pad_key(pad)
        );
        TaskError::new(WHAT, why).with_hint("Draw on the image instead.")
    };
    let own = lifted[pad].as_ref().ok_or_else(lacks)?;
    let others: Vec<&[DVec3]> =
        lifted.entries().filter(|(other, _)| *other != pad).map(|(_, points)| points.points.as_slice()).collect();
    Ok(VisiblePixels::new(sight, (&own.points, &own.pixels), &others))
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::rig::lab;

    #[test]
    fn points_are_found_by_pixel() {
        let cloud = FingerCloud {
            points: vec![DVec3::ZERO; 3],
            pixels: vec![[5, 0], [1, 2], [3, 2]],
            contact: vec![false, true, true],
        };
        assert_eq!(cloud.at_pixel(3, 2), Some(2));
        assert_eq!(cloud.at_pixel(2, 2), None);
        let clouds = Clouds { fingers: [None, Some(cloud)].into() };
        assert_eq!(clouds.contact_points().len(), 2);
    }

    #[test]
    fn contact_points_are_those_of_the_surface_bit_for_bit() {
        let (spec, config) = (&touch2touch_core::catalog::tools()[0], touch2touch_core::sim::SimConfig::default());
        let sample = touch2touch_core::sim::simulate(spec, touch2touch_core::sim::random_grasp(3), 3, &config);
        let imprint = |pad| sample.pad(pad)?.depth().map(|bubble| bubble.imprint.clone());
        let mut imprints: PerPad<DepthMap> = sample.rig.pads().map(imprint).collect();
        // Holes within the mask have no point, in either way.
        imprints[lab::LEFT].as_mut().unwrap().as_mut_slice()[5000..9000].fill(f32::NAN);
        let masks: PerPad<Mask> = imprints.clone().map(|i| i.map(|i| i.map(|&d| d.is_nan() || d >= 0.004)));
        let surface = clouds(&sample, &imprints.as_ref(), &masks.as_ref()).unwrap();
        let points = contact_points(&sample, &imprints.as_ref(), &masks.as_ref()).unwrap();
        assert!(points.len() > 500 && points == surface.contact_points());
        // A finger without a mask gives none, and none at all is an error.
        let right = [masks[lab::RIGHT].as_ref(), None].into();
        assert_eq!(
            contact_points(&sample, &imprints.as_ref(), &right).unwrap(),
            points[..surface.fingers[lab::RIGHT].as_ref().unwrap().contact.iter().filter(|c| **c).count()]
        );
        assert!(contact_points(&sample, &imprints.as_ref(), &PerPad::default()).is_err());
    }
}
