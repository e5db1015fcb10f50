//! The training folder for the lab's UNet.

use std::path::Path;

use touch2touch_core::grid::{Grid, Mask};
use touch2touch_core::rig::lab;
use touch2touch_pipeline::io::exchange::{
    Content, ExportConfig, ExportEntry, ExportError, MANIFEST, check_folder, export,
};
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

fn run(folder: &Path, n: usize, config: &ExportConfig) -> Result<[usize; 3], ExportError> {
    export(folder, &entries(n), config, |i| Ok(content(i))).map(|report| report.counts)
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
    let config = ExportConfig::default();
    let report = export(&folder, &entries(20), &config, |i| Ok(content(i))).unwrap();
    let counts = report.counts;
    assert!(counts.iter().sum::<usize>() == 20 && counts[0] > 9 && counts[1] > 0 && counts[2] > 0, "{counts:?}");
    assert_eq!((report.out_of_range_px, report.unmeasured_px), (2 * 20, 20));
    let check = check_folder(&folder);
    assert_eq!((check.counts, check.problems), (counts, vec![]));
    let first = tree(&folder);
    assert_eq!(first.len(), 40);
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
    let config = ExportConfig::default();
    let foreign = dir.path().join("foreign");
    std::fs::create_dir_all(foreign.join("train")).unwrap();
    std::fs::write(foreign.join("train/thesis.txt"), b"x").unwrap();
    let err = run(&foreign, 5, &config).unwrap_err();
    assert!(err.to_string().contains("train/thesis.txt"), "{err}");
    assert!(foreign.join("train/thesis.txt").exists());

    let folder = dir.path().join("unet");
    run(&folder, 5, &config).unwrap();
    let before = tree(&folder);
    let failing =
        export(&folder, &entries(5), &config, |i| if i == 3 { Err("no imprint".into()) } else { Ok(content(i)) });
    assert!(failing.unwrap_err().to_string().contains("no imprint"));
    let wrong = export(&folder, &entries(5), &config, |i| Ok(Content { mask: Mask::filled(3, 3, true), ..content(i) }));
    assert!(matches!(wrong, Err(ExportError::Size { .. })));
    assert!(matches!(run(&folder, 0, &config), Err(ExportError::Nothing)));
    assert_eq!(tree(&folder), before);
    // A file that the export did not write is not thrown away.
    std::fs::write(folder.join("train/imgs/mine.png"), b"x").unwrap();
    assert!(matches!(run(&folder, 5, &config), Err(ExportError::NotOurs { .. })));
    std::fs::remove_file(folder.join("train/imgs/mine.png")).unwrap();
    std::fs::write(folder.join(MANIFEST), b"{}").unwrap();
    assert!(matches!(run(&folder, 5, &config), Err(ExportError::NotOurs { .. })));
}

#[test]
fn the_check_finds_what_the_loader_would_trip_over() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("unet");
    run(&folder, 12, &ExportConfig::default()).unwrap();
    let names: Vec<String> =
        tree(&folder).into_iter().map(|(n, _)| n).filter(|n| n.starts_with("train/masks")).collect();
    let file = |i: usize| folder.join(&names[i]);
    std::fs::remove_file(file(0)).unwrap();
    images::write_gray8(&file(1), &Grid::filled(175, 140, 7)).unwrap();
    images::write_gray8(&file(2), &Grid::filled(17, 14, 255)).unwrap();
    images::write_rgb8(&file(3), &Grid::filled(175, 140, [0.0; 3])).unwrap();
    std::fs::write(file(4), b"no picture").unwrap();
    std::fs::write(folder.join("train/imgs/.DS_Store"), b"x").unwrap();
    std::fs::write(folder.join("val/imgs/a.b.png"), b"x").unwrap();
    std::fs::remove_dir_all(folder.join("test/masks")).unwrap();
    let problems = check_folder(&folder).problems;
    for word in
        ["1 images and 0 masks", "the value 7", "[17, 14]", "Rgb8", "not a readable PNG", "neither", "cannot list"]
    {
        assert!(problems.iter().any(|p| p.what.contains(word)), "{word}: {problems:#?}");
    }
}
