//! The reference grasps (`pose-cases`): numpy archives with depth, masks, cameras and truth.

use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};
use touch2touch::domain::grid::{DepthMap, Mask};
use touch2touch::domain::sample::BubbleCamera;
use touch2touch::domain::sensor::Intrinsics;

/// One grasp of both fingers with its truth.
pub(crate) struct Case {
    /// Metres.
    pub(crate) imprints: [DepthMap; 2],
    /// Nominal cameras: the true ones are a little off.
    pub(crate) cameras: [BubbleCamera; 2],
    /// Spoilt like a learned mask.
    pub(crate) masks: [Mask; 2],
    /// True angle of `grasp_from_object`.
    pub(crate) theta_rad: f64,
    /// True place, metres.
    pub(crate) yz: [f64; 2],
    /// Number of the tool's file.
    pub(crate) tool: usize,
    /// 0 nominal, 1 hard, 2 degenerate.
    pub(crate) stratum: usize,
}

/// Reads a case; panics with the path if it is damaged.
pub(crate) fn read_case(path: &Path) -> Case {
    let mut npz = Npz::open(path);
    let reference = npz.read("depth_ref");
    let depth = npz.read("depth");
    let mask = npz.read("mask");
    let k = npz.read("K");
    let t = npz.read("T");
    let pixels = 140 * 175;
    let map = |values: &[f64], finger: usize| {
        let part = &values[finger * pixels..(finger + 1) * pixels];
        DepthMap::from_vec(175, 140, part.iter().map(|&v| v as f32).collect()).unwrap()
    };
    let camera = |finger: usize| {
        let k = &k[finger * 9..];
        let t = &t[finger * 16..];
        let column = |c: usize| DVec3::new(t[c], t[4 + c], t[8 + c]);
        BubbleCamera {
            depth_reference: map(&reference, finger),
            intrinsics: Intrinsics { fx: k[0], fy: k[4], cx: k[2], cy: k[5] },
            grasp_from_camera: DAffine3::from_mat3_translation(
                DMat3::from_cols(column(0), column(1), column(2)),
                column(3),
            ),
        }
    };
    let imprint = |finger: usize| {
        let (reference, depth) = (map(&reference, finger), map(&depth, finger));
        DepthMap::from_fn(175, 140, |x, y| reference[(x, y)] - depth[(x, y)])
    };
    let yz = npz.read("yz");
    Case {
        imprints: [imprint(0), imprint(1)],
        cameras: [camera(0), camera(1)],
        masks: [0, 1].map(|finger| map(&mask, finger).map(|&m| m > 0.5)),
        theta_rad: npz.read("theta_deg")[0].to_radians(),
        yz: [yz[0], yz[1]],
        tool: npz.read("tool")[0] as usize,
        stratum: npz.read("stratum")[0] as usize,
    }
}

/// The archives of a folder in order of their names.
pub(crate) fn case_files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "npz"))
        .collect();
    files.sort();
    files
}

/// A numpy archive: arrays by name, flattened in C order, as f64.
pub(crate) struct Npz(zip::ZipArchive<std::fs::File>);

impl Npz {
    /// Opens `path`; panics with the path if that fails.
    pub(crate) fn open(path: &std::path::Path) -> Self {
        let file = std::fs::File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Self(zip::ZipArchive::new(file).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
    }

    /// Reads the array `name` of any number type that the reference data uses.
    pub(crate) fn read(&mut self, name: &str) -> Vec<f64> {
        use npyz::{DType, NpyFile};
        let entry = self.0.by_name(&format!("{name}.npy")).unwrap_or_else(|e| panic!("{name}: {e}"));
        let npy = NpyFile::new(entry).unwrap();
        let DType::Plain(kind) = npy.dtype() else { panic!("{name}: not a plain array") };
        match kind.to_string().as_str() {
            "<f4" => npy.into_vec::<f32>().unwrap().into_iter().map(f64::from).collect(),
            "<f8" => npy.into_vec::<f64>().unwrap(),
            "|u1" => npy.into_vec::<u8>().unwrap().into_iter().map(f64::from).collect(),
            "<i8" => npy.into_vec::<i64>().unwrap().into_iter().map(|v| v as f64).collect(),
            other => panic!("{name}: type {other}"),
        }
    }
}
