//! Reading one grasp of the lab's files: keys, shapes and units as in the released data set.

use std::path::Path;
use std::sync::Arc;

use glam::DAffine3;

use crate::io::dataset::{InvalidPixels, Loaded, colors, most_invalid, plausible, problem};
use crate::io::error::{FileError, FileErrorKind};
use crate::io::pt::{PtDict, Tensor, read_dict};
use touch2touch_core::dataset::Problem;
use touch2touch_core::frames::{PlanarPose, affine_from_xyz_quat};
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::rig::{PadId, Rig, lab};
use touch2touch_core::sample::{ColorTouch, DepthCamera, DepthTouch, DepthTruth, PadTouch, Sample};
use touch2touch_core::sensor::Intrinsics;

use super::PairFiles;
use super::mirrored::{UNIT_TOLERANCE, recover};

const BUBBLE_SHAPE: [usize; 4] = [2, 1, lab::BUBBLE.height, lab::BUBBLE.width];
const GELSLIM_SHAPE: [usize; 4] = [2, 3, lab::GELSLIM.height, lab::GELSLIM.width];
/// A depth this close to the lens is the camera's way of saying "nothing measured".
const NO_DEPTH_M: f32 = 1e-4;
/// Two halves of one grasp store the same pose; this allows for 32-bit copies of it.
const SAME_POSE: f64 = 1e-5;

impl PairFiles {
    /// Loads one pair; either half may be absent.
    pub(in super::super) fn load(&self, rig: &Arc<Rig>) -> Result<Loaded, FileError> {
        let mut notes = Vec::new();
        let mut invalid = [InvalidPixels::default(); 2];
        let mut fingers = [PadTouch::default(), PadTouch::default()];
        let mut poses: Vec<(&Path, [f64; 3])> = Vec::new();
        if let Some(path) = self.bubble.as_deref() {
            let dict = read_dict(path)?;
            say_coarse(&dict, &mut notes);
            for (finger, touch) in fingers.iter_mut().zip(bubble_touches(&dict, &mut notes, &mut invalid)?) {
                finger.set(lab::BUBBLE_ID, touch);
            }
            poses.extend(pose(&dict, &mut notes)?.map(|p| (path, p)));
        }
        if let Some(path) = self.gelslim.as_deref() {
            let dict = read_dict(path)?;
            for (finger, touch) in fingers.iter_mut().zip(gelslim_touches(&dict, &mut notes)?) {
                finger.set(lab::GELSLIM_ID, touch);
            }
            // Where the bubble file has a pose, that one counts and this one is only compared.
            let mut ignored = Vec::new();
            let here = pose(&dict, if poses.is_empty() { &mut notes } else { &mut ignored })?;
            poses.extend(here.map(|p| (path, p)));
        }
        if let [(a, first), (b, second)] = &poses[..]
            && first.iter().zip(second).any(|(x, y)| (x - y).abs() > SAME_POSE)
        {
            notes.push(problem(
                *b,
                format!("theta, x, y {second:?} differ from {first:?} in {}", a.display()),
                "the two halves are from different grasps; check how the files were named",
            ));
        }
        let grasp_from_object = poses.first().map(|(_, pose)| grasp_from_object(*pose));
        let sample =
            Sample { rig: rig.clone(), pads: fingers.map(Some).into(), grasp_from_object, notes, ..Sample::default() };
        Ok(Loaded { sample, invalid: invalid.map(Some).into() })
    }
}

impl PairFiles {
    /// The true pose of the pair alone, where its files can be read and have one.
    pub(in super::super) fn pose(&self) -> Option<PlanarPose> {
        let dict = read_dict(self.bubble.as_deref().or(self.gelslim.as_deref())?).ok()?;
        pose(&dict, &mut Vec::new()).ok()?.map(grasp_from_object)
    }
}

fn grasp_from_object([theta, x, y]: [f64; 3]) -> PlanarPose {
    PlanarPose::object_from_grasp_of_lab(theta, x, y).inverse()
}

/// A value that the sample can do without: absent, or no tensor, is a note; wrong is an error.
fn optional<T>(
    dict: &PtDict,
    result: Result<T, FileError>,
    without: &str,
    notes: &mut Vec<Problem>,
) -> Result<Option<T>, FileError> {
    match result {
        Ok(value) => Ok(Some(value)),
        // What another program stored in its own way costs no more than itself.
        Err(err) if err.kind == FileErrorKind::Missing => {
            notes.push(problem(dict.file(), format!("{err}: {without}"), err.hint));
            Ok(None)
        }
        Err(err) => Err(err),
    }
}

fn pose(dict: &PtDict, notes: &mut Vec<Problem>) -> Result<Option<[f64; 3]>, FileError> {
    let without = "this file has no true pose";
    let mut values = [0.0; 3];
    for (value, key) in values.iter_mut().zip(["theta", "x", "y"]) {
        match optional(dict, dict.scalar(key), without, notes)? {
            Some(number) if number.is_finite() => *value = number,
            Some(number) => {
                let what = format!("key \"{key}\" is {number}: {without}");
                notes.push(problem(dict.file(), what, "write the file again"));
                return Ok(None);
            }
            None => return Ok(None),
        }
    }
    Ok(Some(values))
}

/// Says which lengths are stored in three digits.
fn say_coarse(dict: &PtDict, notes: &mut Vec<Problem>) {
    let lengths = ["bubble_imprint", "bubble_depth_ref", "bubbles_tr_quat", "grasp_frame_quat", "K", "theta", "x", "y"];
    let coarse = dict.coarse(&lengths);
    if !coarse.is_empty() {
        let what = format!(
            "{} stored as bfloat16, which has three digits: imprints in steps of up to 0.06 mm, depths of 0.5 mm",
            coarse.join(", ")
        );
        notes.push(problem(dict.file(), what, "save these tensors as float32, with .float() before torch.save"));
    }
}

/// Splits a tensor of two fingers.
fn halves<T>(values: &[T]) -> [&[T]; 2] {
    let (a, b) = values.split_at(values.len() / 2);
    [a, b]
}

fn depth_map(values: &[f32]) -> DepthMap {
    Grid::from_vec(lab::BUBBLE.width, lab::BUBBLE.height, values.to_vec()).expect("the shape was checked")
}

fn bubble_touches(
    dict: &PtDict,
    notes: &mut Vec<Problem>,
    invalid: &mut [InvalidPixels; 2],
) -> Result<[DepthTouch; 2], FileError> {
    let imprint = dict.shaped("bubble_imprint", &[&BUBBLE_SHAPE])?.into_f32();
    let without = "points cannot be lifted to the grasp frame";
    let reference =
        optional(dict, dict.shaped("bubble_depth_ref", &[&BUBBLE_SHAPE]), without, notes)?.map(Tensor::into_f32);
    let cameras = cameras(dict, without, notes)?;
    // Only the simulator writes these two.
    let truth = if dict.has("contact_mask") && dict.has("imprint_clean") {
        let [contact, clean] = ["contact_mask", "imprint_clean"].map(|key| dict.shaped(key, &[&BUBBLE_SHAPE]));
        Some((contact?.into_f32(), clean?.into_f32()))
    } else {
        None
    };
    let mut touch = |finger: PadId| -> Result<DepthTouch, FileError> {
        let index = finger.index();
        let mut map = depth_map(halves(&imprint)[index]);
        let reference = reference.as_ref().map(|r| depth_map(halves(r)[index]));
        invalid[index] = invalid_to_nan(&mut map, reference.as_ref());
        let pixels = map.len();
        most_invalid(dict.file(), invalid[index].total(), pixels, || {
            format!("pixels of the {} imprint", Rig::lab().pad_key(finger))
        })?;
        let bad = reference.as_ref().map_or(0, |r| r.as_slice().iter().filter(|v| !v.is_finite()).count());
        if bad > 0 {
            let percent = 100.0 * bad as f64 / pixels as f64;
            let what = format!(
                "key \"bubble_depth_ref\", {} finger: {bad} pixels ({percent:.2} %) are NaN or infinite",
                Rig::lab().pad_key(finger)
            );
            notes.push(problem(dict.file(), what, "these pixels are left out of every cloud"));
        }
        most_invalid(dict.file(), bad, pixels, || {
            format!("pixels of the {} reference depth", Rig::lab().pad_key(finger))
        })?;
        let camera = match (reference, cameras[index]) {
            (Some(depth_reference), Some((intrinsics, grasp_from_camera))) => {
                Some(DepthCamera { depth_reference, intrinsics, crop: lab::BUBBLE.crop, grasp_from_camera })
            }
            _ => None,
        };
        let truth = truth.as_ref().map(|(contact, clean)| DepthTruth {
            imprint: depth_map(halves(clean)[index]),
            contact: depth_map(halves(contact)[index]).map(|&v| v > 0.5),
        });
        Ok(DepthTouch { imprint: map, camera, truth })
    };
    Ok([touch(lab::RIGHT)?, touch(lab::LEFT)?])
}

/// Everything that is no measurement becomes NaN, and is counted.
fn invalid_to_nan(imprint: &mut DepthMap, reference: Option<&DepthMap>) -> InvalidPixels {
    let mut invalid = InvalidPixels::default();
    for (i, value) in imprint.as_mut_slice().iter_mut().enumerate() {
        if value.is_nan() {
            invalid.nan += 1;
        } else if value.is_infinite() {
            invalid.infinite += 1;
        } else if reference.is_some_and(|r| (r.as_slice()[i] - *value).abs() < NO_DEPTH_M) {
            invalid.dropped += 1;
        } else {
            continue;
        }
        *value = f32::NAN;
    }
    invalid
}

type Camera = (Intrinsics, DAffine3);

/// Intrinsics and camera-to-grasp transform of each finger, where the file has them and they make sense.
///
/// Source: `ICP_dataset_cal.py` lines 222-240 and 443-463: both poses are given in the arm's base frame.
fn cameras(dict: &PtDict, without: &str, notes: &mut Vec<Problem>) -> Result<[Option<Camera>; 2], FileError> {
    let k = optional(dict, dict.shaped("K", &[&[2, 3, 3], &[2, 1, 3, 3]]), without, notes)?;
    let bubbles = optional(dict, dict.shaped("bubbles_tr_quat", &[&[2, 1, 7], &[2, 7]]), without, notes)?;
    let grasp = optional(dict, dict.shaped("grasp_frame_quat", &[&[1, 7], &[7], &[1, 1, 7]]), without, notes)?;
    let (Some(k), Some(bubbles), Some(grasp)) = (k, bubbles, grasp) else { return Ok([None, None]) };
    let [k, bubbles, grasp] = [k, bubbles, grasp].map(Tensor::into_f64);
    let Some((base_from_grasp, length)) = rigid(&grasp) else {
        notes.push(no_frame(dict, "grasp_frame_quat", &grasp, without));
        return Ok([None, None]);
    };
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        notes.push(not_unit(dict, "grasp_frame_quat", length, "normalized"));
    }
    notes.extend(plausible::rounded_place(dict.file(), "grasp_frame_quat", &grasp));
    notes.extend(plausible::rounded_place(dict.file(), "bubbles_tr_quat", &bubbles));
    let mut out = [None, None];
    let mut repaired: Option<(f64, &str)> = None;
    for finger in lab::PADS {
        let i = finger.index();
        let m = halves(&k)[i];
        let intrinsics = Intrinsics { fx: m[0], fy: m[4], cx: m[2], cy: m[5] };
        if !intrinsics.is_plausible() {
            let what = format!(
                "key \"K\", {} finger: {intrinsics:?} is not a camera matrix: {without}",
                Rig::lab().pad_key(finger)
            );
            notes.push(problem(dict.file(), what, "expected 3 x 3 pinhole matrices in pixels of the 224 x 171 image"));
            continue;
        }
        let numbers = halves(&bubbles)[i];
        let Some((mut base_from_camera, length)) = rigid(numbers) else {
            notes.push(no_frame(dict, "bubbles_tr_quat", numbers, without));
            continue;
        };
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            let quaternion = [numbers[3], numbers[4], numbers[5], numbers[6]];
            let mirrored = recover(base_from_camera.translation, quaternion, base_from_grasp.translation);
            let how = if mirrored.is_some() {
                "it comes from a mirrored camera frame, which was recovered by letting the camera look at the grasp"
            } else {
                "normalized"
            };
            base_from_camera = mirrored.unwrap_or(base_from_camera);
            repaired = Some((length, how));
        }
        out[i] = Some((intrinsics, base_from_grasp.inverse() * base_from_camera));
    }
    notes.extend(repaired.map(|(length, how)| not_unit(dict, "bubbles_tr_quat", length, how)));
    Ok(out)
}

/// The transform of `x y z qx qy qz qw` with the quaternion normalized, and the quaternion's length.
fn rigid(values: &[f64]) -> Option<(DAffine3, f64)> {
    let numbers: [f64; 7] = values.try_into().ok()?;
    let length = numbers[3..].iter().map(|q| q * q).sum::<f64>().sqrt();
    Some((affine_from_xyz_quat(numbers)?, length))
}

fn no_frame(dict: &PtDict, key: &str, values: &[f64], without: &str) -> Problem {
    let what = format!("key \"{key}\" {values:?} is not a rigid transform: {without}");
    problem(dict.file(), what, "expected x y z qx qy qz qw, all finite")
}

fn not_unit(dict: &PtDict, key: &str, length: f64, how: &str) -> Problem {
    let what = format!("key \"{key}\": a quaternion has length {length:.4}, not 1: {how}");
    problem(dict.file(), what, "expected x y z qx qy qz qw of a rotation; check how the frames were converted")
}

fn gelslim_touches(dict: &PtDict, notes: &mut Vec<Problem>) -> Result<[ColorTouch; 2], FileError> {
    let keys = ["gelslim", "gelslim_ref"];
    let [raw, reference] = keys.map(|key| dict.shaped(key, &[&GELSLIM_SHAPE]));
    colors::touches(dict.file(), keys, [raw?.into_f32(), reference?.into_f32()], [0, 1], notes)
}
