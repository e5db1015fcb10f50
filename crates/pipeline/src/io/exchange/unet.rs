//! The lab's UNet layout: `{train,val,test}/{imgs,masks}/<stem>.png`, and its loader's rules, checked on what is on the disk.
//!
//! Per image exactly one mask of the same stem and size, 0 and 255, nothing else in the folders. The loader does not look
//! into `ignore/`: such pixels are free of contact to it.
//!
//! Source: `utils/data_loading.py` lines 22-30, 111-126 and 253-296 of the lab's UNet repository, and
//! `ICP_dataset_cal.py` lines 641-676 for the scale.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::format::gray;
use super::{Content, ExportError, ExportReport, IGNORED, IMAGE_HI_M, IMAGE_LO_M, PARTS, make_folder};
use crate::io::images;
use touch2touch_core::dataset::Problem;
use touch2touch_core::grid::{DepthMap, Grid};

/// Writes an image and its mask into the folders of their part.
pub(super) fn write(part: &Path, stem: &str, content: &Content, report: &mut ExportReport) -> Result<(), ExportError> {
    let file = |kind: &str| part.join(kind).join(format!("{stem}.png"));
    let picture = image_from_imprint(&content.imprint, report);
    let image = file("imgs");
    images::write_gray8(&image, &picture)?;
    if images::read_gray8(&image)? != picture {
        let (what, hint) = ("the file reads back differently".into(), "check the disk".into());
        return Err(ExportError::Check { problems: vec![Problem { file: image, what, hint }] });
    }
    images::write_gray8(&file("masks"), &gray(&content.mask))?;
    if let Some(ignored) = &content.ignored {
        make_folder(&part.join(IGNORED))?;
        images::write_gray8(&file(IGNORED), &gray(ignored))?;
    }
    Ok(())
}

/// The loader's 8-bit image of an imprint, in 32-bit arithmetic as the lab's script has it.
fn image_from_imprint(imprint: &DepthMap, report: &mut ExportReport) -> Grid<u8> {
    let range = (IMAGE_HI_M - IMAGE_LO_M) as f32;
    imprint.map(|&meters| {
        let meters = if meters.is_finite() {
            meters
        } else {
            report.unmeasured_px += 1;
            0.0
        };
        let value = (meters - IMAGE_LO_M as f32) / range * 255.0;
        if !(0.0..256.0).contains(&value) {
            report.out_of_range_px += 1;
        }
        // Truncates like the lab's cast, but saturates where that would wrap around.
        value as u8
    })
}

/// Content of a training folder and everything in it that the loader would refuse.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CheckReport {
    /// Images in train, val and test.
    pub counts: [usize; 3],
    /// Everything that breaks a rule.
    pub problems: Vec<Problem>,
}

/// Reads a training folder with the loader's rules: in every part, each file in `imgs` has exactly one file of the
/// same stem in `masks` and the other way round, no other entries, 8-bit gray, same size, masks of 0 and 255.
pub fn check_folder(folder: &Path) -> CheckReport {
    let mut report = CheckReport::default();
    for (part, name) in PARTS.iter().enumerate() {
        let root = folder.join(name);
        let images = stems(&root.join("imgs"), &mut report.problems);
        let masks = stems(&root.join("masks"), &mut report.problems);
        report.counts[part] = images.len();
        let all: BTreeSet<&String> = images.keys().chain(masks.keys()).collect();
        for stem in all {
            let (i, m) = (images.get(stem).map_or(0, Vec::len), masks.get(stem).map_or(0, Vec::len));
            if i != 1 || m != 1 {
                report.problems.push(Problem {
                    file: root.join("imgs").join(stem),
                    what: format!("{i} images and {m} masks have this stem; exactly one each is needed"),
                    hint: "remove or add files until every image has one mask".into(),
                });
                continue;
            }
            let paths = (root.join("imgs").join(&images[stem][0]), root.join("masks").join(&masks[stem][0]));
            pair(&paths.0, &paths.1, &mut report.problems);
        }
    }
    report
}

/// The files of a folder by stem.
fn stems(folder: &Path, problems: &mut Vec<Problem>) -> BTreeMap<String, Vec<String>> {
    let mut stems: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut add = |file: &Path, what: String| {
        problems.push(Problem { file: file.to_owned(), what, hint: "export the masks again".into() });
    };
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(err) => {
            add(folder, format!("cannot list the folder: {err}"));
            return stems;
        }
    };
    for entry in entries {
        let path = match entry {
            Ok(entry) => entry.path(),
            Err(err) => {
                add(folder, format!("cannot list the folder: {err}"));
                continue;
            }
        };
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        match name.strip_suffix(".png") {
            // The loader cuts at the last dot and then looks for "stem.*": a second dot would match too much.
            Some(stem) if path.is_file() && !stem.is_empty() && !stem.contains(['.', '*', '?', '[', ']']) => {
                stems.entry(stem.to_owned()).or_default().push(name);
            }
            _ => add(&path, "neither an image nor a mask that the loader understands".into()),
        }
    }
    stems
}

fn pair(image_path: &Path, mask_path: &Path, problems: &mut Vec<Problem>) {
    let mut add = |file: &Path, what: String| {
        problems.push(Problem { file: file.to_owned(), what, hint: "export the masks again".into() });
    };
    let image = match images::read_gray8(image_path) {
        Ok(image) => image,
        Err(err) => return add(image_path, err.to_string()),
    };
    let mask = match images::read_gray8(mask_path) {
        Ok(mask) => mask,
        Err(err) => return add(mask_path, err.to_string()),
    };
    if image.size() != mask.size() {
        add(mask_path, format!("the mask has {:?} pixels, its image {:?}", mask.size(), image.size()));
    }
    if let Some(value) = mask.as_slice().iter().find(|&&v| v != 0 && v != 255) {
        add(mask_path, format!("the mask has the value {value}; only 0 and 255 are allowed"));
    }
}
