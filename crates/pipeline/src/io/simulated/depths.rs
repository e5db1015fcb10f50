//! Writing touches in the form of the lab's depth data set: one file a tool.

use std::path::Path;

use super::{check_name, make_parent};
use crate::io::error::FileError;
use crate::io::pt::{Tensor, write_dict};
use touch2touch_core::catalog::ToolSpec;
use touch2touch_core::grid::RgbGrid;
use touch2touch_core::rig::lab;
use touch2touch_core::sim::{self, Grasp, SimConfig};

/// Touches of a tool, in the order of the file.
#[derive(Debug, Default)]
pub struct Depths {
    touched: Vec<u8>,
    untouched: Vec<u8>,
    depths_mm: Vec<f32>,
    poses: Vec<f32>,
    widths_mm: Vec<f32>,
}

impl Depths {
    /// Adds a simulated touch; `seed` draws the noise of its pictures.
    pub fn push(&mut self, tool: &ToolSpec, grasp: Grasp, seed: u64, config: &SimConfig) {
        let sample = sim::simulate(tool, grasp, seed, config);
        // The left finger comes first.
        for finger in lab::PADS.into_iter().rev() {
            let images = sample.pad(finger).and_then(|touch| touch.color()?.images.as_ref());
            if let Some(images) = images {
                planes(&mut self.touched, &images.raw);
                if self.widths_mm.is_empty() {
                    planes(&mut self.untouched, &images.reference);
                }
            }
            let depth = sim::gelslim_depth(tool, grasp, finger);
            self.depths_mm.extend(depth.as_slice().iter().map(|pushed| -1e3 * pushed));
        }
        let pose = grasp.object_from_grasp().inverse();
        self.poses.extend([1e3 * pose.y_m, 1e3 * pose.z_m, pose.theta_rad].map(|v| v as f32));
        self.widths_mm.push((2e3 * (tool.half_thickness_m - sim::GEL_PRESS_M)) as f32);
    }
}

fn planes(out: &mut Vec<u8>, picture: &RgbGrid) {
    for channel in 0..3 {
        out.extend(picture.as_slice().iter().map(|p| p[channel].round().clamp(0.0, 255.0) as u8));
    }
}

/// Writes the touches of a tool. An existing file is replaced.
///
/// # Errors
/// [`FileError`].
pub fn write_depths(root: &Path, tool: &str, touches: Depths) -> Result<(), FileError> {
    check_name(tool)?;
    let path = root.join(format!("{tool}.pt"));
    make_parent(&path)?;
    let (n, [width, height]) = (touches.widths_mm.len(), lab::GELSLIM_DEPTH.size());
    let items = [
        ("tactile_image", Tensor::u8(&[n, 6, height, width], touches.touched).into()),
        ("base_tactile_image", Tensor::u8(&[1, 6, height, width], touches.untouched).into()),
        ("depth_images", Tensor::f32(&[n, 2, height, width], touches.depths_mm).into()),
        ("in_hand_pose", Tensor::f32(&[n, 3], touches.poses).into()),
        ("grasp_widths", Tensor::f32(&[n], touches.widths_mm).into()),
    ];
    write_dict(&path, &items)
}
