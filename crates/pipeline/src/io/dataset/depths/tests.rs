use super::*;
use crate::io::dataset::Dataset;
use crate::io::pt::{PtItem, Tensor, read_dict, write_dict};
use crate::io::simulated::{Depths as Written, write_depths};
use crate::job::JobCx;
use crate::labels::PairLabels;
use crate::steps::estimate::{Touch, estimate};
use crate::steps::models::Models;
use crate::steps::recipe::{Recipe, Stage};
use crate::steps::tool::load_tool;
use touch2touch_core::catalog::{self, ToolSpec};
use touch2touch_core::contact::signed_distances;
use touch2touch_core::dataset::PairId;
use touch2touch_core::sim::{self, Grasp, SimConfig};

fn tool() -> &'static ToolSpec {
    catalog::tools().iter().find(|tool| tool.name == "pattern_36").unwrap()
}

fn grasp(at: u64) -> Grasp {
    sim::random_grasp(at)
}

/// A simulated set of this many touches of a tool, with its CAD model.
fn set(root: &Path, touches: u64) -> PathBuf {
    let mut written = Written::default();
    (0..touches).for_each(|at| written.push(tool(), grasp(at), at, &SimConfig::default()));
    write_depths(root, &tool().name, written).unwrap();
    let stl = root.join(CAD_FOLDER).join(format!("{}.stl", tool().name));
    std::fs::create_dir_all(stl.parent().unwrap()).unwrap();
    crate::io::stl::write(&stl, &tool().mesh()).unwrap();
    root.join(format!("{}.pt", tool().name))
}

#[test]
fn a_set_opens_as_pairs_and_its_depths_are_registered() {
    let dir = tempfile::tempdir().unwrap();
    set(dir.path(), 3);
    let dataset = Dataset::open(dir.path()).unwrap();
    assert!(dataset.problems.is_empty(), "{:?}", dataset.problems);
    assert_eq!(*dataset.rig, lab::depth_rig());
    let names: Vec<&str> = dataset.index.pairs.iter().map(|pair| pair.name.as_str()).collect();
    assert_eq!(names, ["pattern_36/data_0", "pattern_36/data_1", "pattern_36/data_2"]);
    let model = load_tool(&dataset, &tool().name).unwrap().model;
    for at in 0..3 {
        let sample = dataset.load(PairId(at)).unwrap();
        assert!(sample.notes.is_empty(), "{:?}", sample.notes);
        let truth = grasp(at.into()).object_from_grasp().inverse();
        let told = sample.grasp_from_object.unwrap();
        assert!((told.theta_rad - truth.theta_rad).abs() < 1e-6 && (told.y_m - truth.y_m).abs() < 1e-8);
        for pad in lab::PADS {
            let touch = sample.pad(pad).unwrap();
            let (imprint, meant) = (&touch.depth().unwrap().imprint, sim::gelslim_depth(tool(), grasp(at.into()), pad));
            assert!(imprint.as_slice().iter().zip(meant.as_slice()).all(|(a, b)| (a - b).abs() < 1e-8));
            assert_eq!(touch.color().unwrap().difference.size(), [WIDTH, HEIGHT]);
            // What is deepest lies on the CAD model at the true pose.
            let camera = touch.camera().unwrap();
            let object_from_grasp = told.inverse().to_affine();
            let off = signed_distances(imprint, camera, &model.distance, object_from_grasp, 1e-3).unwrap();
            let felt = off.as_slice().iter().zip(imprint.as_slice()).filter(|(_, imprint)| **imprint > 2e-4);
            let wide: Vec<f64> = felt.map(|(off, _)| off.abs()).filter(|off| *off > 1.5e-4).collect();
            assert!(wide.len() < 50, "{pad:?}: {} px, {wide:.5?}", wide.len());
        }
        let labels = PairLabels::default();
        let touch = Touch { dataset: &dataset, pair: PairId(at), sample: &sample, tool: Ok(&model), labels: &labels };
        let found = estimate(touch, &Recipe::default(), Stage::Pose, &Models::new(None), &JobCx::unwatched()).unwrap();
        let pose = found.pose().unwrap();
        eprintln!(
            "{at}: {:.2} deg off, {} points, {:.1} ms, {:?}",
            pose.error_rad.unwrap().to_degrees(),
            pose.num_points,
            pose.ms,
            pose.verdict
        );
        assert!(pose.error_rad.unwrap().to_degrees() < 1.5, "{pose:?}");
    }
    let doubts = crate::doubts::examine_reading(&dataset, 3, None, &JobCx::unwatched());
    assert!(doubts.is_empty(), "{doubts:?}");
}

#[test]
fn a_pair_costs_its_own_rows() {
    let dir = tempfile::tempdir().unwrap();
    let file = set(dir.path(), 3);
    let dataset = Dataset::open(dir.path()).unwrap();
    let before = dataset.load(PairId(1)).unwrap();
    // Pictures of the first touch are damaged: nobody else reads them.
    let mut bytes = files::read(&file, 1 << 30).unwrap();
    let start = bytes.windows(4).position(|w| w == b"data").unwrap() + (1 << 16);
    bytes[start..start + 1000].fill(0xff);
    std::fs::write(&file, bytes).unwrap();
    let again = dataset.load(PairId(1)).unwrap();
    let red = |sample: &Sample| sample.pad(lab::LEFT).unwrap().color().unwrap().difference.clone();
    assert_eq!(red(&before), red(&again));
    assert!(read_dict(&file).unwrap().tensor(TOUCHED).is_err(), "the checksum of all of it is wrong");
}

/// A file of two touches of zeros in which one thing is another; `None` leaves it out.
fn file(path: &Path, key: &str, item: Option<PtItem>) {
    let mut items: Vec<(&str, PtItem)> = vec![
        (TOUCHED, Tensor::u8(&[2, 6, HEIGHT, WIDTH], vec![90; 12 * PIXELS]).into()),
        (UNTOUCHED, Tensor::u8(&[1, 6, HEIGHT, WIDTH], vec![80; 6 * PIXELS]).into()),
        (DEPTHS[0], Tensor::f32(&[2, 2, HEIGHT, WIDTH], vec![-0.5; 4 * PIXELS]).into()),
        (POSE, Tensor::f32(&[2, 3], vec![1.0, -2.0, 0.1, 3.0, 4.0, 0.2]).into()),
        (WIDTHS, Tensor::f32(&[2], vec![12.0, 12.5]).into()),
    ];
    items.retain(|(known, _)| *known != key);
    items.extend(item.map(|item| (key, item)));
    write_dict(path, &items).unwrap();
}

#[test]
fn what_is_wrong_is_said_with_its_file() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("rod_train.pt");
    let open = || Dataset::open(dir.path());
    file(&path, "", None);
    let dataset = open().unwrap();
    let entry = &dataset.index.pairs[0];
    assert_eq!(
        (entry.name.as_str(), entry.tool.as_deref(), entry.split),
        ("rod_train/data_0", Some("rod"), Split::Train)
    );
    let sample = dataset.load(PairId(0)).unwrap();
    assert_eq!(sample.grasp_from_object.unwrap().y_m, 1e-3);
    assert!((sample.pad(lab::RIGHT).unwrap().camera().unwrap().grasp_from_camera.translation.x - 2.006).abs() < 1e-6);
    // Said when the folder is opened; the file is left out.
    for (key, item, says) in [
        (
            DEPTHS[0],
            Some(Tensor::f32(&[3, 2, 4, 4], vec![0.0; 96]).into()),
            "has shape [3, 2, 4, 4], expected [2, 2, 320, 427]",
        ),
        (POSE, Some(Tensor::f32(&[3, 3], vec![0.0; 9]).into()), "expected [2, 3]"),
        (UNTOUCHED, Some(Tensor::u8(&[6, 2, 2], vec![0; 24]).into()), "expected [2, 6, 320, 427]"),
    ] {
        file(&path, key, item);
        let dataset = open().unwrap();
        let said: Vec<String> = dataset.problems.iter().map(|p| format!("{} {}", p.what, p.hint)).collect();
        assert!(
            dataset.index.pairs.is_empty() && said[0].contains(says) && said[0].contains("rod_train.pt"),
            "{said:?}"
        );
    }
    // Said of the pair.
    let nan = |at: usize| {
        let mut poses = vec![1.0, -2.0, 0.1, 3.0, 4.0, 0.2];
        poses[at] = f32::NAN;
        Some(Tensor::f32(&[2, 3], poses).into())
    };
    let depths = |depth: f32| Some(Tensor::f32(&[2, 2, HEIGHT, WIDTH], vec![depth; 4 * PIXELS]).into());
    for (key, item, says) in [
        (DEPTHS[0], None, "there is no measured imprint"),
        (UNTOUCHED, None, "there is no GelSlim difference"),
        (POSE, None, "no true pose"),
        (POSE, nan(1), "it is not a true pose"),
        (WIDTHS, None, "10 mm apart"),
        (DEPTHS[0], depths(0.5), "the depths are positive"),
        (DEPTHS[0], depths(-0.001), "meters?"),
    ] {
        file(&path, key, item);
        let sample = open().unwrap().load(PairId(0)).unwrap();
        let said: Vec<String> = sample.notes.iter().map(|p| format!("{} {}", p.file.display(), p.what)).collect();
        assert!(said.iter().any(|line| line.contains(says) && line.contains("rod_train.pt")), "{key}: {said:?}");
    }
    file(&path, DEPTHS[0], depths(f32::NAN));
    let why = open().unwrap().load(PairId(0)).unwrap_err().to_string();
    assert!(why.contains("100 % of the pixels of the right depth") && why.contains("rod_train.pt"), "{why}");
    file(&path, POSE, Some(Tensor::f32(&[2, 3], vec![1e-3, -2e-3, 0.1, 3e-3, 4e-3, 0.2]).into()));
    assert!((open().unwrap().load(PairId(0)).unwrap().grasp_from_object.unwrap().z_m + 2e-3).abs() < 1e-9);
    // Cut off after it was opened, and before.
    let dataset = open().unwrap();
    let whole = files::read(&path, 1 << 30).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let why = dataset.load(PairId(0)).unwrap_err().to_string();
    assert!(why.contains("truncated") && why.contains("rod_train.pt"), "{why}");
    file(&dir.path().join("peg.pt"), "", None);
    let dataset = open().unwrap();
    assert!(dataset.index.pairs.len() == 2 && dataset.problems.iter().any(|p| p.what.contains("rod_train.pt")));
}

#[test]
fn the_published_folders_and_another_scale_are_read() {
    let dir = tempfile::tempdir().unwrap();
    for (folder, name) in [("train_data", "rod_train.pt"), ("test_data", "rod_test.pt"), ("real_data", "peg.pt")] {
        std::fs::create_dir_all(dir.path().join(folder)).unwrap();
        file(&dir.path().join(folder).join(name), WIDTHS, None);
    }
    std::fs::write(dir.path().join(WIDTHS_FILE), "rod: 14.0\npeg: None\n").unwrap();
    let mut rig = lab::depth_rig();
    rig.sensors[1].px_per_m = 26_667.0;
    std::fs::write(dir.path().join(RIG_JSON), serde_json::to_vec(&rig).unwrap()).unwrap();
    let dataset = Dataset::open(dir.path()).unwrap();
    let names: Vec<&str> = dataset.index.pairs.iter().map(|pair| pair.name.as_str()).collect();
    assert_eq!(names.len(), 6);
    assert!(names.contains(&"peg/data_1") && names.contains(&"rod_test/data_0"), "{names:?}");
    let at = names.iter().position(|name| *name == "rod_train/data_1").unwrap();
    let sample = dataset.load(PairId(at as u32)).unwrap();
    let camera = sample.pad(lab::LEFT).unwrap().camera().unwrap();
    assert!((camera.grasp_from_camera.translation.x + 2.007).abs() < 1e-9);
    assert_eq!(camera.intrinsics.fx, 26_667.0 * CAMERA_M);
    let part = Dataset::open(&dir.path().join("test_data")).unwrap();
    assert_eq!((part.index.pairs.len(), part.root == dataset.root), (2, true));
    std::fs::write(
        dir.path().join(RIG_JSON),
        serde_json::to_vec(&Rig { pads: rig.pads[..1].to_vec(), ..rig }).unwrap(),
    )
    .unwrap();
    assert!(Dataset::open(dir.path()).is_err());
}
