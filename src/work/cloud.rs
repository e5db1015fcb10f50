//! Imprint and mask to surface points in the grasp frame: [`clouds`].

use glam::DVec3;

use super::error::TaskError;
use crate::domain::cloud;
use crate::domain::grid::{DepthMap, Mask};
use crate::domain::rig::{PadId, PerPad};
use crate::domain::sample::{DepthCamera, Sample};

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
    /// Whether each point is a contact point.
    pub contact: Vec<bool>,
}

impl Clouds {
    /// The cloud of one finger.
    pub fn finger(&self, finger: PadId) -> Option<&FingerCloud> {
        self.fingers[finger].as_ref()
    }

    /// The contact points of both fingers, right first: what is registered.
    pub fn contact_points(&self) -> Vec<DVec3> {
        let fingers = self.fingers.iter().flatten();
        fingers
            .flat_map(|f| f.points.iter().zip(&f.contact).filter(|(_, contact)| **contact).map(|(p, _)| *p))
            .collect()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.fingers.iter().flatten().map(|f| f.points.len() * 32).sum()
    }
}

impl FingerCloud {
    /// The index of the point at a raw bubble pixel. Points are in row order, so this is a binary search.
    pub fn at_pixel(&self, x: usize, y: usize) -> Option<usize> {
        self.pixels.binary_search_by_key(&(y, x), |p| (p[1].into(), p[0].into())).ok()
    }
}

/// The surface points of one finger, with the contact points marked. `None` for the mask marks none.
///
/// # Errors
/// If the sizes differ or the camera's numbers cannot be right.
pub fn finger_cloud(imprint: &DepthMap, camera: &DepthCamera, mask: Option<&Mask>) -> Result<FingerCloud, TaskError> {
    let lifted = cloud::lift(imprint, camera, None).map_err(|err| TaskError::from_error("Point cloud", &err))?;
    if let Some(mask) = mask.filter(|mask| mask.size() != imprint.size()) {
        let why = format!("the mask has {:?} pixels, the imprint {:?}", mask.size(), imprint.size());
        return Err(TaskError::new("Point cloud", why).with_hint("Remove the correction of this mask."));
    }
    let contact = lifted
        .pixels
        .iter()
        .map(|&[x, y]| mask.is_some_and(|m| m.get(x.into(), y.into()).is_some_and(|&contact| contact)))
        .collect();
    Ok(FingerCloud { points: lifted.points, pixels: lifted.pixels, contact })
}

/// The surface points of both fingers of a sample: `parts` holds imprint and mask; a finger without a
/// camera is left out.
///
/// # Errors
/// As [`finger_cloud`].
pub fn clouds(sample: &Sample, parts: &PerPad<(&DepthMap, Option<&Mask>)>) -> Result<Clouds, TaskError> {
    let mut clouds = Clouds::default();
    for finger in sample.rig.pads() {
        let camera = sample.pad(finger).and_then(|t| t.camera());
        if let (Some((imprint, mask)), Some(camera)) = (parts[finger], camera) {
            clouds.fingers[finger] = Some(finger_cloud(imprint, camera, mask)?);
        }
    }
    Ok(clouds)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
