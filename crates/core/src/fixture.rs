//! Fixtures of several modules' tests: a camera of the lab's rig, a view from above, a sheet of points.

use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};

use crate::grid::{DepthMap, Mask};
use crate::label::{Layers, Sight};
use crate::rig::lab;
use crate::sample::DepthCamera;
use crate::sensor::Intrinsics;

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

/// Looks from 0.2 m above along -z at the origin, `scale` pixels per meter there; a picture of 400 x 300 pixels.
pub(crate) fn from_above(scale: f64, layers: Layers) -> Sight {
    let (eye, half) = (0.2, [200.0, 150.0]);
    let focal = half.map(|half| scale * eye / half);
    let clip = DMat4::from_cols(
        DVec4::new(focal[0], 0.0, 0.0, 0.0),
        DVec4::new(0.0, focal[1], 0.0, 0.0),
        DVec4::new(0.0, 0.0, 0.0, -1.0),
        DVec4::new(0.0, 0.0, 0.01, eye),
    );
    Sight { clip_from_grasp: clip.as_mat4(), size_px: [400, 300], layers }
}

/// Pixels that are set.
pub(crate) fn count(mask: &Mask) -> usize {
    mask.as_slice().iter().filter(|&&v| v).count()
}

/// A sheet of 21 x 21 points half a millimeter apart around the axis, at a height.
pub(crate) fn sheet(z: f64) -> (Vec<DVec3>, Vec<[u16; 2]>) {
    let coordinate = |i: u16| (f64::from(i) - 10.0) * 0.0005;
    let pixels: Vec<[u16; 2]> = (0..21).flat_map(|y| (0..21).map(move |x| [x, y])).collect();
    (pixels.iter().map(|[x, y]| DVec3::new(coordinate(*x), coordinate(*y), z)).collect(), pixels)
}
