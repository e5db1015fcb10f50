//! Writing touches in the lab's layout, so that PyTorch, the lab's scripts and this program can read them.
//!
//! Keys, shapes and element types are those of the released data set; `contact_mask` and `imprint_clean`, the
//! simulator's truth, come on top.

mod depths;
mod manifest;

use std::path::{Path, PathBuf};

use glam::{DAffine3, DQuat, DVec3};

use super::error::FileError;
use super::pt::{PtItem, Tensor, write_dict};
use super::stl;
use touch2touch_core::frames::{PlanarPose, xyz_quat_from_affine};
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::lab;
use touch2touch_core::sample::Sample;

pub use depths::{Depths, write_depths};
pub use manifest::{MANIFEST, Writing, unfinished};

/// Layout of the lab's that a simulated data set is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Layout {
    /// `train/{bubbles,gelslims}/data/<tool folder>/data_N.pt`.
    Train,
    /// `test/test_only/{bubbles,gelslims}/<tool>_data_N.pt`.
    Test,
    /// `test/train_only/{bubbles,gelslims}/<tool>_data_N.pt`: the grasps that shift statistics are taken from.
    TrainOnly,
    /// `<tool>.pt`, all touches of a tool in one file: a GelSlim with its own depth.
    #[strum(serialize = "gelslim-depth")]
    GelslimDepth,
}

/// The paths of one pair's GelSlim and bubble file; of [`Layout::GelslimDepth`] the one file of its tool.
pub fn pair_paths(root: &Path, layout: Layout, tool: &str, index: u64) -> [PathBuf; 2] {
    let in_group = |group: &str| {
        ["gelslims", "bubbles"].map(|sensor| root.join(group).join(sensor).join(format!("{tool}_data_{index}.pt")))
    };
    match layout {
        Layout::Train => [
            ("gelslims", format!("gelslim_style_transfer_dataset_gelslim_{tool}")),
            ("bubbles", format!("bubble_style_transfer_dataset_bubbles_{tool}")),
        ]
        .map(|(sensor, folder)| {
            root.join("train").join(sensor).join("data").join(folder).join(format!("data_{index}.pt"))
        }),
        Layout::Test => in_group("test/test_only"),
        Layout::GelslimDepth => [root.join(format!("{tool}.pt")), root.join(format!("{tool}.pt"))],
        Layout::TrainOnly => in_group("test/train_only"),
    }
}

/// Writes both halves of a pair; returns their paths (GelSlim, bubble). Existing files are replaced.
///
/// # Errors
/// [`FileError`] unless the sample has both fingers, both sensors (GelSlim with raw and reference
/// image), cameras and a pose, at the lab's image sizes.
pub fn write_pair(
    root: &Path,
    layout: Layout,
    tool: &str,
    index: u64,
    sample: &Sample,
) -> Result<[PathBuf; 2], FileError> {
    check_name(tool)?;
    let [gelslim_items, bubble_items] = pair_items(sample)?;
    let paths = pair_paths(root, layout, tool, index);
    for (path, items) in paths.iter().zip([gelslim_items, bubble_items]) {
        make_parent(path)?;
        write_dict(path, &items)?;
    }
    Ok(paths)
}

/// Writes the tools' CAD models to `tools_stls` and their split to `tools.pt`: name, seen in training, mesh.
///
/// # Errors
/// [`FileError`].
pub fn write_tools(root: &Path, tools: &[(&str, bool, TriMesh)]) -> Result<(), FileError> {
    write_models(root, tools)?;
    write_split(root, tools.iter().map(|(name, seen, _)| (*name, *seen)))
}

fn write_models(root: &Path, tools: &[(&str, bool, TriMesh)]) -> Result<(), FileError> {
    for (name, _, mesh) in tools {
        check_name(name)?;
        let path = root.join("tools_stls").join(format!("{name}.stl"));
        make_parent(&path)?;
        stl::write(&path, mesh)?;
    }
    Ok(())
}

fn write_split<'a>(root: &Path, tools: impl Iterator<Item = (&'a str, bool)> + Clone) -> Result<(), FileError> {
    let names = |seen: bool| PtItem::Texts(tools.clone().filter(|t| t.1 == seen).map(|t| t.0.to_owned()).collect());
    let path = root.join("tools.pt");
    make_parent(&path)?;
    write_dict(&path, &[("train_tools", names(true)), ("test_tools", names(false))])?;
    Ok(())
}

fn incomplete(missing: &str) -> FileError {
    FileError::new("", format!("the sample has no {missing}, which the lab's files need"), "simulate it again")
}

fn check_name(name: &str) -> Result<(), FileError> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || !name.chars().all(plain) {
        let what = format!("{name:?} cannot name a tool's files; use letters, digits, - and _");
        return Err(FileError::new("", what, "rename the tool"));
    }
    Ok(())
}

fn make_parent(path: &Path) -> Result<(), FileError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    std::fs::create_dir_all(folder).map_err(|err| FileError::io(folder, "cannot make the folder", err))
}

/// Frame of the simulated gripper in the arm's base frame: any place does, as only relative poses count; this one has
/// no zero in it that could hide a mistake.
fn base_from_grasp() -> DAffine3 {
    let rotation = DQuat::from_rotation_z(0.3) * DQuat::from_rotation_y(1.4) * DQuat::from_rotation_x(-0.2);
    DAffine3::from_rotation_translation(rotation, DVec3::new(0.55, -0.05, 0.42))
}

/// `x y z qx qy qz qw` of each frame, as 32-bit floats.
fn frames(frames: &[DAffine3]) -> Vec<f32> {
    frames.iter().flat_map(xyz_quat_from_affine).map(|v| v as f32).collect()
}

type Items = Vec<(&'static str, PtItem)>;

fn pair_items(sample: &Sample) -> Result<[Items; 2], FileError> {
    let grasp_from_object = sample.grasp_from_object.ok_or_else(|| incomplete("true pose"))?;
    let PlanarPose { theta_rad, y_m, z_m } = grasp_from_object.inverse();
    let base_from_grasp = base_from_grasp();

    let (mut imprint, mut reference, mut contact, mut clean) = (vec![], vec![], vec![], vec![]);
    let (mut k, mut base_from_cameras, mut raw, mut untouched) = (vec![], vec![], vec![], vec![]);
    for finger in lab::PADS {
        let touch = sample.pad(finger).ok_or_else(|| incomplete("second finger"))?;
        let bubble_touch = touch.depth().ok_or_else(|| incomplete("bubble touch"))?;
        let camera = bubble_touch.camera.as_ref().ok_or_else(|| incomplete("bubble camera"))?;
        push_depth(&mut imprint, &bubble_touch.imprint)?;
        push_depth(&mut reference, &camera.depth_reference)?;
        if let Some(truth) = &bubble_touch.truth {
            push_depth(&mut clean, &truth.imprint)?;
            contact.extend(truth.contact.as_slice().iter().map(|&c| u8::from(c)));
        }
        let i = camera.intrinsics;
        k.extend([i.fx, 0.0, i.cx, 0.0, i.fy, i.cy, 0.0, 0.0, 1.0].map(|v| v as f32));
        base_from_cameras.push(base_from_grasp * camera.grasp_from_camera);
        let images = touch.color().and_then(|g| g.images.as_ref()).ok_or_else(|| incomplete("GelSlim images"))?;
        push_planes(&mut raw, &images.raw)?;
        push_planes(&mut untouched, &images.reference)?;
    }

    let pose: Items = vec![
        ("theta", Tensor::f64(&[], vec![theta_rad]).into()),
        ("x", Tensor::f64(&[], vec![-y_m]).into()),
        ("y", Tensor::f64(&[], vec![-z_m]).into()),
        ("grasp_frame_quat", Tensor::f32(&[1, 7], frames(&[base_from_grasp])).into()),
        ("tool_tr_quat", Tensor::f32(&[1, 7], frames(&[base_from_grasp * grasp_from_object.to_affine()])).into()),
        ("finger_tr_quat", Tensor::f32(&[2, 1, 7], frames(&base_from_cameras)).into()),
    ];
    let depth_shape = [2, 1, lab::BUBBLE.height, lab::BUBBLE.width];
    let mut bubble_items: Items = vec![
        ("bubble_imprint", Tensor::f32(&depth_shape, imprint).into()),
        ("bubble_depth_ref", Tensor::f32(&depth_shape, reference).into()),
        ("K", Tensor::f32(&[2, 3, 3], k).into()),
        ("bubbles_tr_quat", Tensor::f32(&[2, 1, 7], frames(&base_from_cameras)).into()),
    ];
    let pixels: usize = depth_shape.iter().product();
    if clean.len() == pixels && contact.len() == pixels {
        bubble_items.push(("contact_mask", Tensor::u8(&depth_shape, contact).into()));
        bubble_items.push(("imprint_clean", Tensor::f32(&depth_shape, clean).into()));
    }
    bubble_items.extend(pose.iter().cloned());
    let image_shape = [2, 3, lab::GELSLIM.height, lab::GELSLIM.width];
    let mut gelslim_items: Items = vec![
        ("gelslim", Tensor::f32(&image_shape, raw).into()),
        ("gelslim_ref", Tensor::f32(&image_shape, untouched).into()),
        ("gelslim_tr_quat", Tensor::f32(&[2, 1, 7], frames(&base_from_cameras)).into()),
    ];
    gelslim_items.extend(pose);
    Ok([gelslim_items, bubble_items])
}

fn push_depth(out: &mut Vec<f32>, map: &DepthMap) -> Result<(), FileError> {
    if map.size() != [lab::BUBBLE.width, lab::BUBBLE.height] {
        return Err(incomplete("bubble image of 175 x 140 pixels"));
    }
    out.extend(map.as_slice());
    Ok(())
}

fn push_planes(out: &mut Vec<f32>, picture: &RgbGrid) -> Result<(), FileError> {
    if picture.size() != [lab::GELSLIM.width, lab::GELSLIM.height] {
        return Err(incomplete("GelSlim image of 427 x 320 pixels"));
    }
    for channel in 0..3 {
        out.extend(picture.as_slice().iter().map(|p| p[channel]));
    }
    Ok(())
}
