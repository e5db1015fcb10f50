//! Files: what PyTorch wrote, the lab's folders, image folders, masks, export, and everything that can be wrong.

mod dataset;
mod doctor;
mod export;
#[cfg(unix)]
mod hostile;
mod lab;
mod masks;
mod pt;

use std::path::Path;

use glam::{DAffine3, DQuat, DVec3};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::Grid;
use touch2touch_core::rig::lab as rig;
use touch2touch_core::sample::{ColorTouch, DepthCamera, DepthTouch, DepthTruth, PadTouch, Sample};
use touch2touch_core::sensor::Intrinsics;

/// A touch with the sizes of the lab's and values that differ in every pixel, finger and image.
fn touch(seed: f32) -> Sample {
    let pads = rig::PADS.map(|finger| {
        let side = finger.index() as f32;
        let ripple = move |x: usize, y: usize| (x as f32 * 0.1 + seed + side).sin() * (y as f32 * 0.07).cos();
        let depth = |f: &dyn Fn(usize, usize) -> f32| Grid::from_fn(rig::BUBBLE.width, rig::BUBBLE.height, f);
        let picture = |base: f32| {
            Grid::from_fn(rig::GELSLIM.width, rig::GELSLIM.height, |x, y| {
                [base + side, base + (x % 50) as f32, (base + (y % 60) as f32 + seed).floor()]
            })
        };
        // Seen from either side, the optical axis passes near the grasp's origin.
        let turn = if finger == rig::RIGHT {
            DQuat::from_rotation_z(std::f64::consts::PI) * DQuat::from_rotation_y(0.96)
        } else {
            DQuat::from_rotation_y(0.96)
        };
        let grasp_from_camera = DAffine3::from_rotation_translation(turn, turn * DVec3::new(0.0, 0.0, -0.09));
        let imprint = depth(&|x, y| 0.004 + 0.003 * ripple(x, y));
        let depth = DepthTouch {
            camera: Some(DepthCamera {
                depth_reference: depth(&|x, y| 0.09 + 0.002 * ripple(y, x)),
                intrinsics: Intrinsics { fx: 212.0, fy: 211.0, cx: 112.0, cy: 86.0 },
                crop: rig::BUBBLE.crop,
                grasp_from_camera,
            }),
            truth: Some(DepthTruth { imprint: imprint.map(|v| v * 0.5), contact: imprint.map(|&v| v > 0.005) }),
            imprint,
        };
        let color = ColorTouch::from_images(picture(100.0 + seed), picture(90.0));
        Some(PadTouch::default().with(rig::GELSLIM_ID, color).with(rig::BUBBLE_ID, Some(depth)))
    });
    let pose = PlanarPose::object_from_grasp_of_lab(0.1 + f64::from(seed) * 0.01, 0.002, -0.003).inverse();
    Sample { pads: pads.into(), grasp_from_object: Some(pose), ..Sample::default() }
}

/// An empty file, with the folders above it.
fn touch_file(path: &Path) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::File::create(path).unwrap();
}
