//! Grasps with a known truth, as numpy archives: what registration is measured and tested on.
//!
//! A folder holds `case_*.npz` and `tool_KK.stl` (meters, object frame). Each archive has, for the right and the left
//! finger in this order:
//!
//! | array | shape | meaning |
//! | --- | --- | --- |
//! | `depth_ref`, `depth` | 2 x H x W, f32 | meters along the optical axis; a dropped pixel is 0 or NaN |
//! | `mask`, `mask_clean` | 2 x H x W, u8 | contact as a learned mask has it, and as it is |
//! | `K` | 2 x 3 x 3 | intrinsics of the full camera image |
//! | `T` | 2 x 4 x 4 | camera to grasp frame, nominal: the true one is a little off |
//! | `theta_deg`, `yz` | -, 2 | `grasp_from_object`: degrees about +x, meters |
//! | `predicted` | - | 1 where a model predicted the imprints; may be left out |
//! | `tool`, `stratum` | - | number of the tool's file; 0 nominal, 1 hard, 2 degenerate |

mod corrupt;
mod simulated;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};

use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Grid, Mask};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::lab;
use touch2touch_core::sample::DepthCamera;
use touch2touch_core::sensor::Intrinsics;
use touch2touch_pipeline::io::error::FileError;
use touch2touch_pipeline::io::npz;
use touch2touch_pipeline::io::pt::{Tensor, Values};
use touch2touch_pipeline::io::stl;

pub use simulated::{Suite, spoilt, stratum};

/// Difficulty of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, strum::EnumIter, strum::Display)]
#[strum(serialize_all = "lowercase")]
pub enum Stratum {
    /// An ordinary grasp.
    Nominal = 0,
    /// Weak contact, more noise, a badly spoilt mask.
    Hard = 1,
    /// A straight tool: it can slide along itself.
    Degenerate = 2,
}

/// One grasp of both fingers with its truth. Fingers are indexed as in the lab's rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Reference minus depth, meters; NaN, and where the camera said 0 the reference itself (which lifts to depth 0).
    pub imprints: [DepthMap; 2],
    /// True where a model predicted them.
    pub predicted: bool,
    /// Nominal cameras.
    pub cameras: [DepthCamera; 2],
    /// Contact, spoilt like a learned mask.
    pub masks: [Mask; 2],
    /// Contact as it is.
    pub masks_clean: [Mask; 2],
    /// The truth.
    pub grasp_from_object: PlanarPose,
    /// Number of the tool's file.
    pub tool: usize,
    /// Kind of case.
    pub stratum: Stratum,
}

/// Why a case cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// The archive, or a tool.
    #[error(transparent)]
    File(#[from] FileError),
    /// The folder.
    #[error("cannot read the folder ({}): {source}", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No case in the folder.
    #[error("no case_*.npz found ({}): name the folder that holds them", folder.display())]
    Nothing {
        /// The folder.
        folder: PathBuf,
    },
    /// An array is missing or has another shape or a value that means nothing.
    #[error("array \"{name}\" {reason} ({})", file.display())]
    Array {
        /// The archive.
        file: PathBuf,
        /// The array.
        name: &'static str,
        /// Fault of the array, as the message goes on.
        reason: String,
    },
}

/// The cases of a folder, ordered by name, with the tools they need.
#[derive(Clone, Debug)]
pub struct CaseSet {
    /// Name (without ending) and content of each case.
    pub cases: Vec<(String, Case)>,
    /// CAD models by number, meters.
    pub tools: BTreeMap<usize, TriMesh>,
}

impl CaseSet {
    /// Reads all cases of a folder and their tools.
    ///
    /// # Errors
    /// [`CaseError`]: a folder without cases, or anything in it that cannot be used.
    pub fn open(folder: &Path) -> Result<Self, CaseError> {
        let mut cases = Vec::new();
        let mut tools = BTreeMap::new();
        for file in case_files(folder)? {
            let case = read(&file)?;
            if let std::collections::btree_map::Entry::Vacant(slot) = tools.entry(case.tool) {
                slot.insert(stl::read(&tool_file(folder, case.tool))?.mesh);
            }
            let name = file.file_stem().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
            cases.push((name, case));
        }
        Ok(Self { cases, tools })
    }
}

/// Largest number of a tool.
const LAST_TOOL: usize = 9999;

/// The file of tool number `tool`.
pub fn tool_file(folder: &Path, tool: usize) -> PathBuf {
    folder.join(format!("tool_{tool:02}.stl"))
}

/// The archives of a folder in order of their names.
///
/// # Errors
/// [`CaseError::Folder`] and [`CaseError::Nothing`].
pub fn case_files(folder: &Path) -> Result<Vec<PathBuf>, CaseError> {
    let failed = |source| CaseError::Folder { folder: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if name.starts_with("case_") && name.ends_with(".npz") {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(CaseError::Nothing { folder: folder.to_owned() });
    }
    files.sort();
    Ok(files)
}

/// The arrays of one archive with the file's name for messages.
struct Arrays<'a> {
    file: &'a Path,
    arrays: BTreeMap<String, Tensor>,
}

impl Arrays<'_> {
    fn bad(&self, name: &'static str, reason: impl Into<String>) -> CaseError {
        CaseError::Array { file: self.file.to_owned(), name, reason: reason.into() }
    }

    /// Shape and values of an array.
    fn take(&mut self, name: &'static str) -> Result<(Vec<usize>, Vec<f64>), CaseError> {
        let tensor = self.arrays.remove(name).ok_or_else(|| self.bad(name, "is missing"))?;
        Ok((tensor.shape.clone(), tensor.into_f64()))
    }

    fn values(&mut self, name: &'static str, count: usize) -> Result<Vec<f64>, CaseError> {
        let (shape, values) = self.take(name)?;
        if values.len() != count || values.iter().any(|v| !v.is_finite()) {
            return Err(self.bad(name, format!("must be {count} finite numbers; its shape is {shape:?}")));
        }
        Ok(values)
    }

    /// A whole number from 0 to `last`.
    fn whole(&mut self, name: &'static str, last: usize) -> Result<usize, CaseError> {
        let value = self.values(name, 1)?[0];
        if value.fract() != 0.0 || !(0.0..=last as f64).contains(&value) {
            return Err(self.bad(name, format!("is {value}, not a whole number from 0 to {last}")));
        }
        Ok(value as usize)
    }

    /// Two images of one size.
    fn images(&mut self, name: &'static str) -> Result<[Grid<f64>; 2], CaseError> {
        let (shape, values) = self.take(name)?;
        let &[2, height, width] = shape.as_slice() else {
            return Err(self.bad(name, format!("must be 2 x height x width; its shape is {shape:?}")));
        };
        if height == 0 || width == 0 {
            return Err(self.bad(name, format!("has no pixels; its shape is {shape:?}")));
        }
        let half = height * width;
        let image = |finger: usize| Grid::from_fn(width, height, |x, y| values[finger * half + y * width + x]);
        Ok([image(0), image(1)])
    }
}

/// Reads one case.
///
/// # Errors
/// [`CaseError`] naming the file and the array.
pub fn read(file: &Path) -> Result<Case, CaseError> {
    let mut arrays = Arrays { file, arrays: npz::read(file)? };
    let reference = arrays.images("depth_ref")?;
    let size = reference[0].size();
    let mut images = |name| {
        let images = arrays.images(name)?;
        if images[0].size() != size {
            return Err(arrays.bad(name, format!("is {:?} pixels, depth_ref {size:?}", images[0].size())));
        }
        Ok(images)
    };
    let depth = images("depth")?;
    let masks = images("mask")?.map(|m| m.map(|&v| v > 0.5));
    let masks_clean = images("mask_clean")?.map(|m| m.map(|&v| v > 0.5));
    let k = arrays.values("K", 18)?;
    let t = arrays.values("T", 32)?;
    let theta_rad = arrays.values("theta_deg", 1)?[0].to_radians();
    let yz = arrays.values("yz", 2)?;
    let predicted = arrays.arrays.contains_key("predicted") && arrays.whole("predicted", 1)? == 1;
    let tool = arrays.whole("tool", LAST_TOOL)?;
    let stratum = match arrays.whole("stratum", 2)? {
        0 => Stratum::Nominal,
        1 => Stratum::Hard,
        _ => Stratum::Degenerate,
    };
    let imprint = |f: usize| {
        let [width, height] = size;
        // In 32 bits, as a camera's driver would have it.
        DepthMap::from_fn(width, height, |x, y| reference[f][(x, y)] as f32 - depth[f][(x, y)] as f32)
    };
    let camera = |f: usize| {
        let (k, t) = (&k[9 * f..], &t[16 * f..]);
        let column = |c: usize| DVec3::new(t[c], t[4 + c], t[8 + c]);
        DepthCamera {
            depth_reference: reference[f].map(|&z| z as f32),
            intrinsics: Intrinsics { fx: k[0], fy: k[4], cx: k[2], cy: k[5] },
            crop: lab::BUBBLE.crop,
            grasp_from_camera: DAffine3::from_mat3_translation(
                DMat3::from_cols(column(0), column(1), column(2)),
                column(3),
            ),
        }
    };
    Ok(Case {
        imprints: [imprint(0), imprint(1)],
        predicted,
        cameras: [camera(0), camera(1)],
        masks,
        masks_clean,
        grasp_from_object: PlanarPose { theta_rad, y_m: yz[0], z_m: yz[1] },
        tool,
        stratum,
    })
}

/// Writes one case; what [`read`] gives back equals it to 32 bits.
///
/// # Errors
/// [`CaseError`] if the disk refuses.
pub fn write(file: &Path, case: &Case) -> Result<(), CaseError> {
    let [width, height] = case.imprints[0].size();
    let shape = [2, height, width];
    let both = |f: &dyn Fn(usize) -> Vec<f32>| [f(0), f(1)].concat();
    let depth_of = |f: usize| {
        let (imprint, reference) = (&case.imprints[f], &case.cameras[f].depth_reference);
        reference.as_slice().iter().zip(imprint.as_slice()).map(|(r, i)| r - i).collect()
    };
    let mask =
        |masks: &[Mask; 2]| Tensor::u8(&shape, masks.iter().flat_map(|m| m.as_slice()).map(|&m| u8::from(m)).collect());
    let k = case.cameras.iter().flat_map(|c| {
        let i = c.intrinsics;
        [i.fx, 0.0, i.cx, 0.0, i.fy, i.cy, 0.0, 0.0, 1.0]
    });
    let t = case.cameras.iter().flat_map(|c| {
        let (m, t) = (c.grasp_from_camera.matrix3, c.grasp_from_camera.translation);
        let row = |r: usize| [m.col(0)[r], m.col(1)[r], m.col(2)[r], t[r]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]].concat()
    });
    let pose = case.grasp_from_object;
    let whole = |v: i64| Tensor { shape: vec![], values: Values::I64(vec![v]) };
    npz::write(
        file,
        &[
            ("depth_ref", Tensor::f32(&shape, both(&|f| case.cameras[f].depth_reference.as_slice().to_vec()))),
            ("depth", Tensor::f32(&shape, both(&depth_of))),
            ("mask", mask(&case.masks)),
            ("mask_clean", mask(&case.masks_clean)),
            ("K", Tensor::f64(&[2, 3, 3], k.collect())),
            ("T", Tensor::f64(&[2, 4, 4], t.collect())),
            ("theta_deg", Tensor::f64(&[], vec![pose.theta_rad.to_degrees()])),
            ("yz", Tensor::f64(&[2], vec![pose.y_m, pose.z_m])),
            ("predicted", whole(case.predicted.into())),
            ("tool", whole(case.tool as i64)),
            ("stratum", whole(case.stratum as i64)),
        ],
    )?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case() -> Case {
        let camera = DepthCamera {
            depth_reference: DepthMap::from_fn(6, 4, |x, y| 0.09 + 1e-3 * (x + y) as f32),
            intrinsics: Intrinsics { fx: 212.0, fy: 211.0, cx: 112.3, cy: 86.1 },
            crop: lab::BUBBLE.crop,
            grasp_from_camera: DAffine3::from_mat3_translation(
                DMat3::from_rotation_y(0.96),
                DVec3::new(-0.0764, 0.001, -0.0541),
            ),
        };
        let mut imprint = DepthMap::from_fn(6, 4, |x, y| 1e-3 * (x * y) as f32);
        imprint[(1, 1)] = camera.depth_reference[(1, 1)];
        let mask = Mask::from_fn(6, 4, |x, _| x > 2);
        Case {
            imprints: [imprint.clone(), imprint],
            predicted: true,
            cameras: [camera.clone(), camera],
            masks: [mask.clone(), mask.map(|m| !m)],
            masks_clean: [mask.clone(), mask],
            grasp_from_object: PlanarPose { theta_rad: 0.2, y_m: 1e-3, z_m: -2e-3 },
            tool: 7,
            stratum: Stratum::Hard,
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("case_000.npz");
        let mut original = case();
        write(&file, &original).unwrap();
        let back = read(&file).unwrap();
        for f in 0..2 {
            for (a, b) in back.imprints[f].as_slice().iter().zip(original.imprints[f].as_slice()) {
                assert!((a - b).abs() < 1e-7);
            }
        }
        assert!((back.grasp_from_object.theta_rad - 0.2).abs() < 1e-15);
        // The dropped pixel has depth exactly 0.
        assert_eq!(back.imprints[0][(1, 1)], back.cameras[0].depth_reference[(1, 1)]);
        original.imprints = back.imprints.clone();
        original.grasp_from_object = back.grasp_from_object;
        assert_eq!(back, original);
        assert!(matches!(CaseSet::open(dir.path()), Err(CaseError::File(_))), "its tool is missing");
    }

    #[test]
    fn a_tool_is_a_whole_number_that_names_a_file() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("case_000.npz");
        write(&file, &case()).unwrap();
        let good = npz::read(&file).unwrap();
        for (name, bad) in [("tool", -1.0), ("tool", 0.5), ("tool", 1e12), ("stratum", -1.0), ("stratum", 3.0)] {
            let with = good.iter().map(|(key, tensor)| {
                (key.as_str(), if key == name { Tensor::f64(&[], vec![bad]) } else { tensor.clone() })
            });
            npz::write(&file, &with.collect::<Vec<_>>()).unwrap();
            let text = read(&file).unwrap_err().to_string();
            assert!(text.contains(&format!("\"{name}\" is {bad}")) && text.contains("case_000.npz"), "{text}");
        }
    }

    #[test]
    fn what_is_missing_or_odd_is_named() {
        let dir = tempfile::tempdir().unwrap();
        assert!(matches!(CaseSet::open(dir.path()), Err(CaseError::Nothing { .. })));
        assert!(matches!(CaseSet::open(&dir.path().join("no")), Err(CaseError::Folder { .. })));
        let file = dir.path().join("case_1.npz");
        let depth = Tensor::f32(&[2, 4, 6], vec![0.1; 48]);
        for (arrays, name) in [
            (vec![], "depth_ref"),
            (vec![("depth_ref", Tensor::f32(&[48], vec![0.1; 48]))], "depth_ref"),
            (vec![("depth_ref", depth.clone()), ("depth", Tensor::f32(&[2, 6, 4], vec![0.1; 48]))], "depth"),
            (vec![("depth_ref", depth.clone()), ("depth", depth.clone()), ("mask", depth.clone())], "mask_clean"),
        ] {
            npz::write(&file, &arrays).unwrap();
            let error = read(&file).unwrap_err();
            assert!(matches!(error, CaseError::Array { name: n, .. } if n == name), "{error}");
            assert!(error.to_string().contains("case_1.npz"));
        }
    }
}
