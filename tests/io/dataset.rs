//! Opening folders: layouts, names, and everything that can be wrong with them.

use std::path::Path;

use crate::support;
use glam::DVec3;
use touch2touch_core::catalog;
use touch2touch_core::dataset::{PairId, Split};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::Grid;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::{CameraTolerance, lab};
use touch2touch_core::sample::Sample;
use touch2touch_core::turn::Turn;
use touch2touch_pipeline::io::dataset::{Dataset, SourceKind};
use touch2touch_pipeline::io::error::FileErrorKind;
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::io::pt::{PtItem, Tensor, read_dict, write_dict};
use touch2touch_pipeline::io::simulated::{Layout, pair_paths, write_pair, write_tools};

use super::pt::with_pickle;
use super::{touch, touch_file};

fn names(dataset: &Dataset) -> Vec<&str> {
    dataset.index.pairs.iter().map(|p| p.name.as_str()).collect()
}

#[test]
fn a_written_touch_reads_back_whole() {
    let dir = tempfile::tempdir().unwrap();
    for (layout, split) in
        [(Layout::Train, Split::Train), (Layout::Test, Split::Test), (Layout::TrainOnly, Split::TrainOnly)]
    {
        write_pair(dir.path(), layout, "pattern_31_rod", 7, &touch(split as u8 as f32)).unwrap();
    }
    let dataset = Dataset::open(dir.path()).unwrap();
    assert_eq!(
        names(&dataset),
        ["pattern_31_rod/data_7", "train_only/pattern_31_rod_data_7", "test_only/pattern_31_rod_data_7"]
    );
    for (i, pair) in dataset.index.pairs.iter().enumerate() {
        let want = touch(pair.split as u8 as f32);
        let loaded = dataset.load_with_counts(PairId(i as u32)).unwrap();
        assert_eq!(loaded.sample.notes, []);
        let got = loaded.sample;
        let (a, b) = (got.grasp_from_object.unwrap(), want.grasp_from_object.unwrap());
        assert!((a.theta_rad - b.theta_rad).abs() < 1e-15 && (a.y_m - b.y_m).abs() < 1e-15);
        for finger in lab::PADS {
            let (a, b) = (got.pad(finger).unwrap(), want.pad(finger).unwrap());
            let (ga, gb) = (a.color().unwrap(), b.color().unwrap());
            assert_eq!(ga.images.as_ref().unwrap().raw, gb.images.as_ref().unwrap().raw);
            assert_eq!(ga.difference, gb.difference);
            let (ba, bb) = (a.depth().unwrap(), b.depth().unwrap());
            assert_eq!(ba.imprint, bb.imprint);
            assert_eq!(ba.truth.as_ref().unwrap().contact, bb.truth.as_ref().unwrap().contact);
            let (ca, cb) = (ba.camera.as_ref().unwrap(), bb.camera.as_ref().unwrap());
            assert_eq!((&ca.depth_reference, ca.intrinsics), (&cb.depth_reference, cb.intrinsics));
            // Frames are stored as 32-bit numbers around half a meter: 6e-8 each.
            assert!(ca.grasp_from_camera.abs_diff_eq(cb.grasp_from_camera, 5e-7));
        }
    }
}

#[test]
fn everything_wrong_is_listed_and_the_rest_opens() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path();
    for i in 0..9 {
        write_pair(root, Layout::Test, "pattern_35", i, &touch(i as f32)).unwrap();
    }
    let [gel0, _] = pair_paths(root, Layout::Test, "pattern_35", 0);
    let [_, bubble1] = pair_paths(root, Layout::Test, "pattern_35", 1);
    let bubble = |i| pair_paths(root, Layout::Test, "pattern_35", i)[1].clone();
    std::fs::remove_file(&gel0).unwrap();
    let whole = std::fs::read(&bubble1).unwrap();
    std::fs::write(&bubble1, &whole[..whole.len() / 2]).unwrap();
    let imprint = |values: Vec<f32>, shape: &[usize]| PtItem::from(Tensor::f32(shape, values));
    write_dict(&bubble(2), &[("bubble_imprint", imprint(vec![0.0; 4], &[2, 1, 1, 2]))]).unwrap();
    write_dict(&bubble(3), &[("imprint", imprint(vec![0.0; 4], &[2, 1, 1, 2]))]).unwrap();
    let mut values = vec![0.001; 2 * 140 * 175];
    (values[5], values[6], values[24500]) = (f32::NAN, f32::INFINITY, f32::NAN);
    write_dict(&bubble(4), &[("bubble_imprint", imprint(values, &[2, 1, 140, 175]))]).unwrap();
    std::fs::write(bubble(5), b"").unwrap();
    std::fs::write(bubble(6), b"hello").unwrap();
    touch_file(&root.join("train/bubbles/data/bubble_style_transfer_dataset_bubbles_pattern_32/readme.txt"));
    std::fs::create_dir_all(root.join("train/gelslims")).unwrap();

    let dataset = Dataset::open(root).unwrap();
    assert_eq!(dataset.index.pairs.len(), 8, "the half pair is left out");
    let listed = |file: &str, word: &str| {
        dataset
            .problems
            .iter()
            .any(|p| p.file.to_string_lossy().contains(file) && p.what.contains(word) && !p.hint.is_empty())
    };
    assert!(listed("bubbles/pattern_35_data_0.pt", "other half"), "{:#?}", dataset.problems);
    assert!(listed("tools_stls/pattern_35.stl", "CAD"));
    assert!(listed("bubbles_pattern_32", "empty"));
    assert!(listed("train/gelslims", "no .pt files"));
    let id = |n: u64| PairId(dataset.index.pairs.iter().position(|p| p.number == n).unwrap() as u32);
    let error = |n| dataset.load(id(n)).unwrap_err().to_string();
    assert!(error(1).contains("truncated") && error(1).contains("data_1.pt"), "{}", error(1));
    assert!(error(2).contains("[2, 1, 1, 2]") && error(2).contains("[2, 1, 140, 175]"), "{}", error(2));
    assert!(error(3).contains("bubble_imprint") && error(3).contains("missing"), "{}", error(3));
    assert!(error(5).contains("empty") && error(6).contains("not a PyTorch file"));
    let odd = dataset.load_with_counts(id(4)).unwrap();
    let [right, left] = lab::PADS.map(|finger| odd.invalid[finger].unwrap());
    assert_eq!((right.nan, right.infinite, left.nan), (1, 1, 1));
    let right = odd.sample.pad(lab::RIGHT).unwrap().depth().unwrap();
    assert!(right.imprint[(5, 0)].is_nan() && right.imprint[(6, 0)].is_nan() && right.camera.is_none());
    for key in ["bubble_depth_ref", "\"K\"", "bubbles_tr_quat"] {
        assert!(odd.sample.notes.iter().any(|n| n.what.contains(key)), "{key}: {:#?}", odd.sample.notes);
    }
    assert!(dataset.load(id(7)).is_ok() && dataset.load(id(8)).is_ok());
    assert!(dataset.load(PairId(99)).unwrap_err().what.contains("no pair number 99"));
}

#[test]
fn what_is_mostly_no_measurement_is_refused_with_its_share() {
    for (finger, share, refused) in [(lab::RIGHT, 0.4, false), (lab::RIGHT, 0.6, true), (lab::LEFT, 1.0, true)] {
        for sensor in ["GelSlim", "imprint", "reference"] {
            let dir = tempfile::tempdir().unwrap();
            let mut sample = touch(1.0);
            let touch = sample.pads[finger].as_mut().unwrap();
            let cut = |len: usize| (share * len as f64) as usize;
            match sensor {
                "GelSlim" => {
                    let raw = &mut touch.color_mut().unwrap().images.as_mut().unwrap().raw;
                    let cut = cut(raw.len());
                    raw.as_mut_slice()[..cut].fill([f32::NAN; 3]);
                }
                "imprint" => {
                    let imprint = &mut touch.depth_mut().unwrap().imprint;
                    let cut = cut(imprint.len());
                    imprint.as_mut_slice()[..cut].fill(f32::NAN);
                }
                _ => {
                    let reference = &mut touch.depth_mut().unwrap().camera.as_mut().unwrap().depth_reference;
                    let cut = cut(reference.len());
                    reference.as_mut_slice()[..cut].fill(f32::INFINITY);
                }
            }
            write_pair(dir.path(), Layout::Test, "rod", 0, &sample).unwrap();
            let loaded = Dataset::open(dir.path()).unwrap().load(PairId(0));
            if refused {
                let error = loaded.unwrap_err();
                let (text, percent) = (error.to_string(), format!("{:.0} %", 100.0 * share));
                assert_eq!(error.kind, FileErrorKind::Content, "{text}");
                assert!(text.contains(&percent) && text.contains(sensor) && text.contains("_data_0.pt"), "{text}");
            } else {
                let notes = loaded.unwrap().notes;
                assert!(notes.iter().any(|n| n.what.contains("%") && n.file.is_file()), "{sensor}: {notes:#?}");
            }
        }
    }
}

#[test]
fn halves_of_different_grasps_and_camera_zeros_are_noticed() {
    let dir = tempfile::tempdir().unwrap();
    let mut sample = touch(1.0);
    let bubble = sample.pads[lab::LEFT].as_mut().unwrap().depth_mut().unwrap();
    bubble.imprint[(3, 4)] = bubble.camera.as_ref().unwrap().depth_reference[(3, 4)];
    write_pair(dir.path(), Layout::Test, "rod", 0, &sample).unwrap();
    write_pair(dir.path(), Layout::Test, "rod", 1, &touch(2.0)).unwrap();
    let [gel0, _] = pair_paths(dir.path(), Layout::Test, "rod", 0);
    let [gel1, _] = pair_paths(dir.path(), Layout::Test, "rod", 1);
    std::fs::copy(gel1, gel0).unwrap();
    let loaded = Dataset::open(dir.path()).unwrap().load_with_counts(PairId(0)).unwrap();
    assert_eq!(loaded.invalid[lab::LEFT].unwrap().dropped, 1);
    assert!(loaded.sample.notes[0].what.contains("differ"), "{:#?}", loaded.sample.notes);
}

#[test]
fn layouts_prefixes_order_and_duplicates() {
    let dir = tempfile::tempdir().unwrap();
    // The folder above `data`, bare and prefixed tool folders, the undistorted variant as the only one.
    let train = dir.path().join("data/train");
    for i in [10, 9, 100, 1] {
        touch_file(&train.join(format!("bubbles/data/bubble_style_transfer_dataset_bubbles_rod/data_{i}.pt")));
        touch_file(&train.join(format!("gelslims_no_distortion/data/rod/data_{i}.pt")));
    }
    touch_file(&train.join("bubbles/data/rod/data_9.pt"));
    touch_file(&train.join("bubbles/data/.hidden.pt"));
    let dataset = Dataset::open(dir.path()).unwrap();
    assert_eq!(names(&dataset), ["rod/data_1", "rod/data_9", "rod/data_10", "rod/data_100"]);
    assert_eq!(dataset.root.as_deref(), Some(dir.path().canonicalize().unwrap().join("data").as_path()));
    assert_eq!(dataset.problems.iter().filter(|p| p.what.contains("same name")).count(), 1);
    assert_eq!(Dataset::open(&train.join("bubbles/data/rod/data_9.pt")).unwrap().index.pairs.len(), 4);

    // A flat folder on its own, one sensor only.
    let flat = tempfile::tempdir().unwrap();
    touch_file(&flat.path().join("bubbles/pattern_05_3_lines_angle_2_data_5.pt"));
    let dataset = Dataset::open(flat.path()).unwrap();
    assert_eq!(names(&dataset), ["pattern_05_3_lines_angle_2_data_5"]);
    assert_eq!(dataset.index.pairs[0].tool.as_deref(), Some("pattern_05_3_lines_angle_2"));
    assert!(dataset.problems.iter().any(|p| p.what.contains("one sensor")));
}

#[cfg(unix)]
#[test]
fn a_number_of_numpy_costs_the_true_pose_alone_and_three_digits_are_said() {
    let dir = tempfile::tempdir().unwrap();
    write_pair(dir.path(), Layout::Train, "pattern_31_rod", 7, &touch(0.0)).unwrap();
    let [gelslim, bubble] = pair_paths(dir.path(), Layout::Train, "pattern_31_rod", 7);
    let whole = std::fs::read(&bubble).unwrap();
    let key = b"X\x05\0\0\0theta";
    let numpy = b"cnumpy.core.multiarray\nscalar\nU\x02f8U\x08\0\0\0\0\0\0\xe0?\x86RX\x06\0\0\0tensor";
    std::fs::write(&bubble, with_pickle(&whole, key, &[key.as_slice(), numpy].concat())).unwrap();
    let sample = Dataset::open(dir.path()).unwrap().load(PairId(0)).unwrap();
    let [note] = &sample.notes[..] else { panic!("{:?}", sample.notes) };
    assert!(note.what.contains("numpy") && note.what.contains("this file has no true pose"), "{}", note.what);
    assert!(note.hint.contains("torch.as_tensor"), "{}", note.hint);
    // The other half of the pair says it as well.
    assert!(sample.grasp_from_object.is_some() && sample.pad(lab::RIGHT).unwrap().depth().is_some());
    let other = std::fs::read(&gelslim).unwrap();
    std::fs::write(&gelslim, with_pickle(&other, key, &[key.as_slice(), numpy].concat())).unwrap();
    let sample = Dataset::open(dir.path()).unwrap().load(PairId(0)).unwrap();
    assert!(sample.grasp_from_object.is_none() && sample.pad(lab::RIGHT).unwrap().color().is_some());
    std::fs::write(&gelslim, other).unwrap();
    std::fs::write(&bubble, with_pickle(&whole, b"FloatStorage", b"BFloat16Storage")).unwrap();
    let sample = Dataset::open(dir.path()).unwrap().load(PairId(0)).unwrap();
    assert!(sample.notes[0].what.contains("stored as bfloat16"), "{:?}", sample.notes);
}

#[test]
fn a_lab_folder_says_its_tolerance_its_axes_and_where_its_poses_lie() {
    let dir = tempfile::tempdir().unwrap();
    let write = |index, theta_rad| {
        let grasp_from_object = Some(PlanarPose { theta_rad, ..PlanarPose::default() });
        let touch = Sample { grasp_from_object, ..touch(0.0) };
        write_pair(dir.path(), Layout::Train, "pattern_31_rod", index, &touch).unwrap();
    };
    (0..12).for_each(|index| write(index, 0.05 * index as f64 - 0.3));
    let rod = catalog::tools().iter().find(|tool| tool.name == "pattern_31_rod").unwrap().mesh();
    write_tools(dir.path(), &[("pattern_31_rod", true, rod.clone())]).unwrap();
    std::fs::write(dir.path().join("rig.json"), r#"{"camera_tolerance": {"angle_deg": 3, "place_mm": 1}}"#).unwrap();
    std::fs::write(dir.path().join("read-as.txt"), "cad-axes=yzx").unwrap();
    let dataset = Dataset::open(dir.path()).unwrap();
    let sample = dataset.load(PairId(3)).unwrap();
    assert_eq!(sample.rig.camera_tolerance, CameraTolerance { angle_deg: 3.0, place_mm: 1.0 });
    assert!(sample.in_lab_grid && sample.notes.is_empty(), "{:?}", sample.notes);
    let size = |mesh: &TriMesh| mesh.bounds().map(|[lo, hi]| hi - lo).unwrap();
    let (read, own) = (size(&dataset.tool_mesh("pattern_31_rod").unwrap().unwrap()), size(&rod));
    assert!(read.abs_diff_eq(DVec3::new(own.y, own.z, own.x), 1e-6), "{read} of {own}");
    write(11, 1.0);
    assert!(!Dataset::open(dir.path()).unwrap().load(PairId(3)).unwrap().in_lab_grid);
    std::fs::write(dir.path().join("rig.json"), r#"{"camera_tolerance": {"angle_deg": -3, "place_mm": 1}}"#).unwrap();
    assert!(Dataset::open(dir.path()).unwrap_err().to_string().contains("angle_deg must be 0 to 20"));
}

/// Where names in other letters are other files.
#[cfg(target_os = "linux")]
#[test]
fn a_second_model_of_a_tool_is_named_and_the_same_one_is_always_used() {
    let dir = tempfile::tempdir().unwrap();
    write_pair(dir.path(), Layout::Train, "pattern_31_rod", 7, &touch(0.0)).unwrap();
    let folder = dir.path().join("tools_stls");
    std::fs::create_dir(&folder).unwrap();
    for name in ["pattern_31_rod.STL", "pattern_31_rod.stl", "pattern_31_rod.Stl"] {
        std::fs::write(folder.join(name), name).unwrap();
    }
    let dataset = Dataset::open(dir.path()).unwrap();
    assert_eq!(dataset.tool_mesh_file("pattern_31_rod").unwrap().file_name().unwrap(), "pattern_31_rod.stl");
    let mut said: Vec<String> = dataset.problems.iter().map(|p| p.file.display().to_string()).collect();
    said.sort();
    assert!(said.len() == 2 && said[0].ends_with(".STL") && said[1].ends_with(".Stl"), "{said:?}");
    assert!(dataset.problems.iter().all(|p| p.what.ends_with("pattern_31_rod.stl is used")), "{:?}", dataset.problems);
}

/// As above.
#[cfg(target_os = "linux")]
#[test]
fn sensors_declared_under_a_name_in_other_letters_are_said_not_to_be_read() {
    let dir = tempfile::tempdir().unwrap();
    images::write_rgb8(&dir.path().join("a_gelslim.png"), &Grid::from_fn(64, 48, |x, _| [x as f32; 3])).unwrap();
    std::fs::write(dir.path().join("Rig.json"), "{}").unwrap();
    let dataset = Dataset::open(dir.path()).unwrap();
    let [said] = &dataset.problems[..] else { panic!("{:?}", dataset.problems) };
    assert!(said.file.ends_with("Rig.json") && said.hint.contains("rename it to rig.json"), "{said:?}");
}

#[test]
fn links_are_followed_and_loops_end() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path().join("set");
    write_pair(&dir.path().join("store"), Layout::Test, "rod", 3, &touch(0.0)).unwrap();
    std::fs::create_dir_all(root.join("test")).unwrap();
    std::os::unix::fs::symlink("../../store/test/test_only", root.join("test/test_only")).unwrap();
    let bubbles = dir.path().join("store/test/test_only/bubbles");
    std::os::unix::fs::symlink("..", bubbles.join("loop")).unwrap();
    std::os::unix::fs::symlink("nowhere", bubbles.join("rod_data_9.pt")).unwrap();
    let dataset = Dataset::open(&root).unwrap();
    assert!(names(&dataset).contains(&"test_only/rod_data_3"));
    let id = dataset.index.pairs.iter().position(|p| p.name == "test_only/rod_data_3").unwrap();
    assert!(dataset.load(PairId(id as u32)).is_ok());
    assert!(dataset.problems.iter().any(|p| p.what.contains("leads nowhere")), "{:#?}", dataset.problems);
}

#[test]
fn picture_folders() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| dir.path().join(name);
    for name in ["b2", "b10"] {
        images::write_rgb8(&file(&format!("{name}_gelslim.png")), &Grid::from_fn(64, 48, |x, _| [x as f32; 3]))
            .unwrap();
        images::write_gray8(&file(&format!("{name}_bubble.png")), &Grid::from_fn(128, 128, |x, y| (x + y) as u8))
            .unwrap();
    }
    images::write_gray8(&file("lone_bubble.png"), &Grid::filled(8, 8, 1)).unwrap();
    std::fs::write(file("b10_bubble.png"), b"\x89PNG broken").unwrap();
    std::fs::write(file("notes.txt"), b"x").unwrap();
    let dataset = Dataset::open(dir.path()).unwrap();
    assert_eq!((names(&dataset), dataset.kind), (vec!["b2", "b10"], SourceKind::Pictures));
    assert_eq!(dataset.problems.len(), 1);
    assert!(dataset.problems[0].what.contains("lone_gelslim.png"));
    let touch = dataset.load(PairId(0)).unwrap();
    let imprint = &touch.pad(lab::RIGHT).unwrap().depth().unwrap().imprint;
    assert!(imprint[(0, 0)] > imprint[(174, 139)], "turned back by 180 degrees");
    assert!(dataset.load(PairId(1)).unwrap_err().to_string().contains("b10_bubble.png"));
    assert_eq!(dataset.vqvae_tile(PairId(0), Turn::default()).unwrap(), None);
    assert_eq!(dataset.tool_mesh("rod").unwrap(), None);
}

#[test]
fn the_demo_renders_what_is_asked_for() {
    let demo = Dataset::demo();
    let pairs = demo.index.pairs.len();
    assert_eq!((demo.kind, demo.index.pairs.len(), demo.index.tools().len()), (SourceKind::Demo, pairs, 12));
    assert!(demo.problems.is_empty() && demo.root.is_none());
    let mut seen: Vec<&str> = names(&demo);
    seen.sort();
    seen.dedup();
    assert!(seen.len() == pairs && pairs >= 12 * 20);
    let (a, again, b) = (demo.load(PairId(3)).unwrap(), demo.load(PairId(3)).unwrap(), demo.load(PairId(4)).unwrap());
    let imprint = |s: &touch2touch_core::sample::Sample| {
        let map = &s.pad(lab::LEFT).unwrap().depth().unwrap().imprint;
        map.as_slice().iter().map(|v| v.to_bits()).collect::<Vec<u32>>()
    };
    assert_eq!(imprint(&a), imprint(&again));
    assert_ne!(imprint(&a), imprint(&b));
    for tool in demo.index.tools() {
        assert!(demo.tool_mesh(&tool).unwrap().unwrap().is_watertight(), "{tool}");
    }
    assert!(demo.load(PairId(pairs as u32)).is_err());
}

#[test]
fn what_is_no_dataset_says_what_would_be() {
    let dir = tempfile::tempdir().unwrap();
    let err = Dataset::open(dir.path()).unwrap_err();
    assert!(err.kind == FileErrorKind::NothingFound && err.hint.contains("tools_stls"));
    assert!(!err.to_problem().what.is_empty());
    assert!(Dataset::open(Path::new("/no/such/folder")).unwrap_err().what.contains("cannot read the folder"));
}

#[test]
fn tens_of_thousands_of_pairs_are_indexed_by_name_alone() {
    let dir = tempfile::tempdir().unwrap();
    let tools = 12;
    let per_tool = 1344;
    for (sensor, prefix) in
        [("bubbles", "bubble_style_transfer_dataset_bubbles_"), ("gelslims", "gelslim_style_transfer_dataset_gelslim_")]
    {
        for tool in 0..tools {
            // Both fingers of the paper's count are in one file, so twice the grasps make its 32,256 pairs.
            let folder = dir.path().join(format!("train/{sensor}/data/{prefix}pattern_{tool:02}"));
            std::fs::create_dir_all(&folder).unwrap();
            for i in 0..2 * per_tool {
                std::fs::File::create(folder.join(format!("data_{i}.pt"))).unwrap();
            }
        }
    }
    let start = std::time::Instant::now();
    let dataset = Dataset::open(dir.path()).unwrap();
    eprintln!("{} pairs opened in {:.0} ms", dataset.index.pairs.len(), start.elapsed().as_secs_f64() * 1e3);
    assert_eq!(dataset.index.pairs.len(), 2 * tools * per_tool);
    assert_eq!(dataset.problems.len(), tools, "only the CAD models are missing");
    assert!(dataset.load(PairId(0)).unwrap_err().to_string().contains("empty"), "content shows when it is loaded");
}

/// Needs a Python with PyTorch, named by `TOUCH2TOUCH_TORCH_PYTHON`.
#[test]
fn pytorch_reads_a_written_pair() {
    let dir = tempfile::tempdir().unwrap();
    let [gelslim, bubble] = write_pair(dir.path(), Layout::Train, "pattern_32", 0, &touch(0.0)).unwrap();
    assert!(read_dict(&bubble).unwrap().keys().contains(&"contact_mask".to_string()));
    let script = "
import sys, torch
g, b = (torch.load(p, weights_only=True) for p in sys.argv[1:])
f32, f64 = torch.float32, torch.float64
want = {'bubble_imprint': (2,1,140,175), 'bubble_depth_ref': (2,1,140,175), 'K': (2,3,3), 'bubbles_tr_quat': (2,1,7),
        'grasp_frame_quat': (1,7), 'tool_tr_quat': (1,7), 'finger_tr_quat': (2,1,7), 'imprint_clean': (2,1,140,175)}
for k, s in want.items(): assert b[k].shape == s and b[k].dtype == f32, k
assert b['contact_mask'].dtype == torch.uint8 and set(b['contact_mask'].unique().tolist()) == {0, 1}
for d in (g, b):
    for k in ('theta', 'x', 'y'): assert d[k].shape == () and d[k].dtype == f64, k
for k in ('gelslim', 'gelslim_ref'): assert g[k].shape == (2,3,320,427) and g[k].dtype == f32, k
assert abs(b['theta'].item() - 0.1) < 1e-12 and abs(b['x'].item() - 0.002) < 1e-12 and abs(b['y'].item() + 0.003) < 1e-12
assert g['gelslim'][1,0,0,0] == 101 and g['gelslim'][0,1,5,7] == 107
";
    support::torch_runs(script, &[gelslim, bubble]);
}
