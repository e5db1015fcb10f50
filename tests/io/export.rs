//! The training folder for the lab's UNet.

use std::path::Path;

use touch2touch_core::grid::{Grid, Mask};
use touch2touch_core::rig::{Rig, lab};
use touch2touch_pipeline::io::error::FileError;
use touch2touch_pipeline::io::exchange::{Content, ExportChoice, ExportEntry, MANIFEST, export, list};
use touch2touch_pipeline::io::images;

fn entries(n: usize) -> Vec<ExportEntry> {
    (0..n)
        .map(|i| ExportEntry {
            pair: format!("pattern_31_rod/data_{i}"),
            tool: Some("pattern_31_rod".into()),
            finger: lab::RIGHT,
            held_out: false,
        })
        .collect()
}

fn content(i: usize) -> Content {
    let imprint = Grid::from_fn(175, 140, |x, y| match (x, y) {
        (0, 0) => -0.0116,
        (1, 0) => 0.0,
        (2, 0) => 0.0225,
        (3, 0) => 0.03,
        (4, 0) => f32::NAN,
        (5, 0) => -0.02,
        _ => 0.0001 * (i + x) as f32 / 2.0,
    });
    Content { mask: imprint.map(|&v| v > 0.005), imprint, ignored: None }
}

fn run(folder: &Path, n: usize, config: &ExportChoice) -> Result<[usize; 3], FileError> {
    export(folder, &entries(n), config, &Rig::lab(), |i| Ok(content(i))).map(|report| report.counts)
}

fn tree(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut out = Vec::new();
    for part in ["train", "val", "test"] {
        for kind in ["imgs", "masks"] {
            for entry in std::fs::read_dir(folder.join(part).join(kind)).unwrap() {
                let path = entry.unwrap().path();
                let relative = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                out.push((relative, std::fs::read(path).unwrap()));
            }
        }
    }
    out.sort();
    out
}

#[test]
fn the_folder_is_what_the_loader_accepts() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("new/unet");
    let config = ExportChoice::default();
    let report = export(&folder, &entries(20), &config, &Rig::lab(), |i| Ok(content(i))).unwrap();
    let counts = report.counts;
    assert!(counts.iter().sum::<usize>() == 20 && counts[0] > 9 && counts[1] > 0 && counts[2] > 0, "{counts:?}");
    assert_eq!((report.out_of_range_px, report.unmeasured_px), (2 * 20, 20));
    let read = list(&folder, None).unwrap();
    assert!(read.masks.len() == 20 && read.refused.is_empty(), "{:?}", read.refused);
    let first = tree(&folder);
    // One mask to each image, and no dot or wildcard in a stem, which the loader would trip over.
    let of = |kind: &str| first.iter().filter(|(n, _)| n.contains(kind)).map(|(n, _)| n.replace(kind, "")).collect();
    let [images, masks]: [Vec<String>; 2] = ["/imgs/", "/masks/"].map(of);
    assert!(images == masks && images.len() == 20 && !images.iter().any(|n| n.trim_end_matches(".png").contains('.')));
    let (image, _) =
        first.iter().find(|(name, _)| name.ends_with("data_3_right.png") && name.contains("imgs")).unwrap();
    assert!(image.contains("pattern_31_rod"));
    let pixels = images::read_gray8(&folder.join(image)).unwrap();
    // 0.0 -> 0.0116 / 0.0341 * 255 = 86.7, cut; unmeasured counts as 0; outside is limited.
    assert_eq!(&pixels.row(0)[..6], &[0, 86, 255, 255, 86, 0]);
    let mask = images::read_gray8(&folder.join(image.replace("imgs", "masks"))).unwrap();
    assert!(mask.as_slice().iter().all(|v| [0, 255].contains(v)));
    // Again over the previous export: same bytes; nothing else is left beside it.
    run(&folder, 20, &config).unwrap();
    assert_eq!(tree(&folder), first);
    run(&folder, 10, &config).unwrap();
    assert_eq!(tree(&folder).len(), 20, "what the previous export wrote is gone");
    assert_eq!(std::fs::read_dir(dir.path().join("new")).unwrap().count(), 1);
}

#[test]
fn foreign_folders_and_failures_leave_everything_as_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let config = ExportChoice::default();
    let foreign = dir.path().join("foreign");
    std::fs::create_dir_all(foreign.join("train")).unwrap();
    std::fs::write(foreign.join("train/thesis.txt"), b"x").unwrap();
    let err = run(&foreign, 5, &config).unwrap_err();
    assert!(err.to_string().contains("train/thesis.txt"), "{err}");
    assert!(foreign.join("train/thesis.txt").exists());

    let folder = dir.path().join("unet");
    run(&folder, 5, &config).unwrap();
    let before = tree(&folder);
    let failing = export(&folder, &entries(5), &config, &Rig::lab(), |i| {
        if i == 3 { Err(anyhow::anyhow!("no imprint")) } else { Ok(content(i)) }
    });
    assert!(failing.unwrap_err().to_string().contains("no imprint"));
    let wrong = export(&folder, &entries(5), &config, &Rig::lab(), |i| {
        Ok(Content { mask: Mask::filled(3, 3, true), ..content(i) })
    });
    assert!(wrong.unwrap_err().what.contains("pixels, its imprint"));
    assert!(run(&folder, 0, &config).unwrap_err().what.contains("no mask"));
    assert_eq!(tree(&folder), before);
    // A file that the export did not write is not thrown away.
    std::fs::write(folder.join("train/imgs/mine.png"), b"x").unwrap();
    assert!(run(&folder, 5, &config).unwrap_err().what.contains("not a previous export"));
    std::fs::remove_file(folder.join("train/imgs/mine.png")).unwrap();
    std::fs::write(folder.join(MANIFEST), b"{}").unwrap();
    assert!(run(&folder, 5, &config).unwrap_err().what.contains("not a previous export"));
}
