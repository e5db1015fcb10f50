//! The doctor on good and spoilt data.

use std::ops::ControlFlow;
use std::path::Path;

use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::Grid;
use touch2touch_core::resample;
use touch2touch_core::rig::lab;
use touch2touch_core::sample::Sample;
use touch2touch_core::sim::{self, SimConfig};
use touch2touch_pipeline::io::dataset::{Dataset, ToolUnit};
use touch2touch_pipeline::io::doctor::{DoctorReport, MOST_PAIRS, examine};
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::io::simulated::{Layout, write_pair, write_tools};

use super::touch;
use crate::support::{self, tetrahedron};

fn doctor(root: &Path) -> DoctorReport {
    examine(&Dataset::open(root).unwrap(), MOST_PAIRS, &mut |_, _| ControlFlow::Continue(()))
}

/// Writes one spoilt touch and returns what the doctor says about it.
fn spoilt(spoil: impl FnOnce(&mut Sample)) -> Vec<String> {
    let dir = tempfile::tempdir().unwrap();
    let mut sample = touch(0.0);
    spoil(&mut sample);
    write_tools(dir.path(), &[("rod", true, tetrahedron(0.05))]).unwrap();
    write_pair(dir.path(), Layout::Test, "rod", 0, &sample).unwrap();
    let report = doctor(dir.path());
    assert_eq!((report.pairs, report.examined), (1, 1));
    assert!(
        report.problems.iter().all(|p| !p.hint.is_empty() && p.file.starts_with(dir.path().canonicalize().unwrap()))
    );
    report.problems.into_iter().map(|p| p.what).collect()
}

/// Changes both bubbles.
fn bubbles(sample: &mut Sample, f: impl Fn(&mut touch2touch_core::sample::DepthTouch)) {
    for finger in lab::PADS {
        f(sample.pads[finger].as_mut().unwrap().depth_mut().unwrap());
    }
}

#[test]
fn good_data_has_no_problem_and_every_spoilt_one_is_found() {
    assert_eq!(spoilt(|_| {}), [""; 0]);
    let has = |problems: Vec<String>, word: &str| {
        assert!(problems.iter().any(|p| p.contains(word)), "{word}: {problems:#?}");
    };
    has(spoilt(|s| bubbles(s, |b| b.imprint = b.imprint.map(|v| v * 1e3))), "millimeters?");
    has(spoilt(|s| bubbles(s, |b| b.imprint[(4, 4)] = 0.5)), "single pixels are far off");
    has(spoilt(|s| bubbles(s, |b| b.imprint = Grid::filled(175, 140, 0.0))), "everywhere");
    has(
        spoilt(|s| bubbles(s, |b| b.imprint = Grid::filled(175, 140, f32::NAN))),
        "100 % of the pixels of the right imprint",
    );
    has(spoilt(|s| bubbles(s, |b| b.imprint[(4, 4)] = f32::INFINITY)), "2 infinite".trim_start_matches("2 "));
    has(spoilt(|s| bubbles(s, |b| b.imprint[(4, 4)] = f32::NAN)), "1 of 1 pairs");
    has(spoilt(|s| bubbles(s, |b| b.camera.as_mut().unwrap().intrinsics.fx = 0.2)), "K");
    has(spoilt(|s| bubbles(s, |b| b.camera.as_mut().unwrap().intrinsics.cx = 900.0)), "implausible");
    let scale_reference = |s: &mut Sample, by: f32| {
        bubbles(s, |b| {
            let camera = b.camera.as_mut().unwrap();
            camera.depth_reference = camera.depth_reference.map(|v| v * by);
        });
    };
    has(spoilt(|s| scale_reference(s, 1e3)), "out of the bubble's range: millimeters?");
    has(spoilt(|s| bubbles(s, |b| b.camera.as_mut().unwrap().grasp_from_camera.translation *= 20.0)), "past the grasp");
    has(
        spoilt(|s| {
            let left = s.pads[lab::LEFT].clone();
            s.pads[lab::RIGHT] = left;
        }),
        "same side",
    );
    has(spoilt(|s| s.grasp_from_object.as_mut().unwrap().theta_rad = 12.0), "degrees?");
    has(spoilt(|s| s.grasp_from_object.as_mut().unwrap().y_m = 4.0), "millimeters?");
    has(
        spoilt(|s| {
            let images = s.pads[lab::RIGHT].as_mut().unwrap().color_mut().unwrap().images.as_mut().unwrap();
            images.raw = images.raw.map(|p| p.map(|v| v / 255.0));
        }),
        "not the scale 0..255",
    );
}

#[test]
fn exchanged_colors_and_negatives_of_pictures_are_named() {
    // Pairs as a program saves them that stretches the difference around gray.
    let said = |saved: fn([f32; 3]) -> [f32; 3]| {
        let dir = tempfile::tempdir().unwrap();
        for (number, tool) in catalog::tools().iter().take(3).enumerate() {
            let touch = sim::simulate(tool, sim::random_grasp(number as u64), number as u64, &SimConfig::default());
            let touch = touch.pad(lab::RIGHT).unwrap();
            let difference = resample::bilinear_rgb(&touch.color().unwrap().difference, 128, 128);
            let tile = difference.map(|pixel| saved(pixel.map(|v| 120.0 + v)));
            images::write_rgb8(&dir.path().join(format!("{number}_gelslim.png")), &tile).unwrap();
        }
        doctor(dir.path()).problems.iter().map(|p| p.what.clone()).collect::<Vec<_>>()
    };
    for (saved, named) in [
        ((|[r, g, b]| [b, g, r]) as fn([f32; 3]) -> [f32; 3], Some("red and blue are exchanged in all 3 pairs")),
        (
            |pixel| pixel.map(|v| 255.0 - v),
            Some("all 3 pairs lie upside down, or their GelSlim pictures are negatives"),
        ),
        (|pixel| pixel, None),
    ] {
        let said = said(saved);
        assert_eq!(said.iter().any(|what| what.contains("light's colors")), named.is_some(), "{said:?}");
        assert!(named.is_none_or(|named| said.iter().any(|what| what.contains(named))), "{said:?}");
    }
}

#[test]
fn test_pairs_that_are_in_the_training_set_are_named() {
    let dir = tempfile::tempdir().unwrap();
    write_tools(dir.path(), &[("rod", true, tetrahedron(0.05))]).unwrap();
    for (layout, number, angle) in
        [(Layout::Train, 0, 0.0), (Layout::Train, 1, 0.1), (Layout::Test, 0, 0.1), (Layout::Test, 1, 0.2)]
    {
        write_pair(dir.path(), layout, "rod", number, &touch(angle)).unwrap();
    }
    let said: Vec<String> = doctor(dir.path()).problems.into_iter().map(|p| p.what).collect();
    assert!(said.iter().any(|what| what.starts_with("1 of 2 test pairs are also in the training set")), "{said:?}");
}

#[test]
fn cad_in_millimeters_is_found_and_progress_can_end_it() {
    let dir = tempfile::tempdir().unwrap();
    write_tools(dir.path(), &[("rod", true, tetrahedron(50.0)), ("cross", false, tetrahedron(0.05))]).unwrap();
    for i in 0..20 {
        write_pair(dir.path(), Layout::Train, "rod", i, &touch(0.0)).unwrap();
    }
    let report = doctor(dir.path());
    assert_eq!(report.problems.len(), 1, "{:#?}", report.problems);
    assert!(report.problems[0].what.contains("cannot be meters: scale it by 0.001"));
    let dataset = Dataset::open(dir.path()).unwrap();
    let mut calls = Vec::new();
    let stopped = examine(&dataset, MOST_PAIRS, &mut |done, total| {
        calls.push((done, total));
        if done > 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert_eq!((stopped.pairs, stopped.examined), (20, 16));
    assert_eq!(calls, [(0, 20), (16, 20)]);
    // Of a large data set some are looked at, up to its end.
    std::fs::write(dataset.pair_files(PairId(15)).first().unwrap(), "no tensor").unwrap();
    let some = examine(&dataset, 4, &mut |_, _| ControlFlow::Continue(()));
    assert_eq!((some.pairs, some.examined, some.problems.len()), (20, 4, 2), "{:#?}", some.problems);
    assert!(write_tools(dir.path(), &[("../x", true, tetrahedron(1.0))]).unwrap_err().what.contains("cannot name"));
    let empty = Sample::default();
    assert!(write_pair(dir.path(), Layout::Train, "rod", 0, &empty).unwrap_err().what.contains("has no"));
}

/// What loading says of a pair and of its CAD model is what the doctor says.
#[test]
fn the_doctor_and_loading_give_the_same_verdict() {
    let dir = tempfile::tempdir().unwrap();
    let mut twice = touch(0.0);
    bubbles(&mut twice, |b| {
        let k = &mut b.camera.as_mut().unwrap().intrinsics;
        for number in [&mut k.fx, &mut k.fy, &mut k.cx, &mut k.cy] {
            *number *= 2.0;
        }
    });
    write_pair(dir.path(), Layout::Test, "rod", 0, &twice).unwrap();
    write_tools(dir.path(), &[("rod", true, tetrahedron(50.0))]).unwrap();
    let unit = dir.path().join("tools_stls/unit.txt");
    for (text, verdict) in [
        (None, Some("cannot be meters")),
        (Some("mm"), None),
        (Some("auto"), None),
        (Some("in"), Some("unit.txt")),
        (Some("furlong"), Some("unit.txt")),
    ] {
        if let Some(text) = text {
            std::fs::write(&unit, text).unwrap();
        }
        let dataset = Dataset::open(dir.path()).unwrap();
        let loaded = dataset.load(PairId(0)).unwrap();
        assert!(loaded.notes.iter().any(|n| n.what.contains("K is implausible")), "{:#?}", loaded.notes);
        let report = doctor(dir.path());
        let listed = |what: &str| report.problems.iter().any(|p| p.what == what);
        assert!(listed(&loaded.notes[0].what));
        match (dataset.tool_mesh("rod"), verdict) {
            (Ok(Some(_)), None) => assert!(report.problems.iter().all(|p| p.what.contains("K is"))),
            (Err(err), Some(word)) => {
                assert!(listed(&err.to_string()) && err.to_string().contains(word), "{err}: {:#?}", report.problems);
            }
            (other, _) => panic!("{text:?}: {other:?}"),
        }
    }
    // Both fingers' cameras are one finding.
    let report = doctor(dir.path());
    assert!(report.problems.iter().any(|p| p.count == 2 && p.what.contains("K is implausible")));
}

#[test]
fn a_whole_dataset_of_broken_files_is_a_page() {
    let dir = tempfile::tempdir().unwrap();
    let pairs = 2_000;
    for sensor in ["bubbles", "gelslims"] {
        let folder = dir.path().join("train").join(sensor).join("data/pattern_31_rod");
        std::fs::create_dir_all(&folder).unwrap();
        for i in 0..pairs {
            let text: &[u8] = if i % 2 == 0 { b"" } else { b"not a tensor" };
            std::fs::write(folder.join(format!("data_{i}.pt")), text).unwrap();
        }
    }
    let mut told = 0;
    let dataset = Dataset::open(dir.path()).unwrap();
    let report = examine(&dataset, MOST_PAIRS, &mut |_, _| {
        told += 1;
        ControlFlow::Continue(())
    });
    assert_eq!((report.pairs, report.examined), (pairs, pairs));
    assert!(told > 10);
    // No CAD model, empty files, files of something else.
    assert_eq!(report.problems.len(), 3, "{:#?}", report.problems);
    assert_eq!(report.problems.iter().map(|p| p.count).sum::<usize>(), 1 + pairs);
    assert!(report.problems.iter().all(|p| p.examples.len() <= 5 && p.examples[0] == p.file));
}

#[test]
fn the_reference_sets_are_healthy() {
    let Some(pictures) = support::shared("real-pairs") else { return };
    let Some(lab) = support::shared("lab-sample") else { return };
    let pictures = doctor(&pictures);
    assert_eq!((pictures.pairs, pictures.problems.len()), (36, 1), "{:#?}", pictures.problems);
    assert!(pictures.problems[0].what.contains("do not lie upright"));
    // The lab's sample has mirrored cameras in every file and nothing else.
    let lab = doctor(&lab);
    assert_eq!((lab.pairs, lab.problems.len()), (4, 1), "{:#?}", lab.problems);
    assert!(lab.problems[0].what.contains("mirrored camera frame"));
    assert_eq!((lab.problems[0].count, lab.problems[0].examples.len()), (4, 4));
}

#[test]
fn what_the_simulator_writes_is_healthy() {
    let dir = tempfile::tempdir().unwrap();
    let demo = Dataset::demo();
    let tools: Vec<_> = catalog::tools().iter().map(|t| (t.name.as_str(), t.seen, t.mesh())).collect();
    write_tools(dir.path(), &tools).unwrap();
    for i in [0, 120, 250] {
        let pair = demo.index.get(PairId(i)).unwrap();
        let sample = demo.load(PairId(i)).unwrap();
        write_pair(dir.path(), Layout::Test, pair.tool.as_deref().unwrap(), pair.number, &sample).unwrap();
    }
    let report = doctor(dir.path());
    // Dropped pixels are the camera's, and summed up in one entry; nothing else may be odd.
    let odd: Vec<_> = report.problems.iter().filter(|p| !p.what.contains("without measurement")).collect();
    assert!(report.pairs == 3 && odd.is_empty() && report.problems.len() <= 1, "{odd:#?}");
}

#[test]
fn a_unit_that_is_not_written_holds_as_long_as_the_data_set_is_open() {
    let dir = tempfile::tempdir().unwrap();
    write_pair(dir.path(), Layout::Test, "rod", 0, &touch(0.0)).unwrap();
    write_tools(dir.path(), &[("rod", true, tetrahedron(50.0))]).unwrap();
    let dataset = Dataset::open(dir.path()).unwrap();
    assert!(dataset.tool_mesh("rod").is_err());
    dataset.hold_unit("rod", ToolUnit::Millimeters);
    let length = |dataset: &Dataset| dataset.tool_mesh("rod").unwrap().unwrap().bounds().map(|[lo, hi]| hi.x - lo.x);
    let held = length(&dataset).unwrap();
    // A copy of it, as jobs have, reads the same.
    assert_eq!(length(&dataset.clone()), Some(held));
    std::fs::write(dir.path().join("tools_stls/unit.txt"), "mm").unwrap();
    assert_eq!(length(&Dataset::open(dir.path()).unwrap()), Some(held));
}
