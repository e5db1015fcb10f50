//! The reference data set that PyTorch wrote, where it is there.

use glam::DVec3;
use touch2touch_core::dataset::{PairId, Split};
use touch2touch_core::rig::lab;
use touch2touch_pipeline::compare;
use touch2touch_pipeline::io::dataset::{Dataset, SourceKind};

use crate::support;

#[test]
fn every_tensor_of_the_reference_set_is_right() {
    let Some(root) = support::shared("lab-sample") else { return };
    let dataset = Dataset::open(&root).unwrap();
    assert_eq!(dataset.kind, SourceKind::Lab);
    assert_eq!(dataset.problems, []);
    let truth: serde_json::Value = serde_json::from_slice(&std::fs::read(root.join("truth.json")).unwrap()).unwrap();
    let truth = truth.as_object().unwrap();
    assert_eq!(dataset.index.pairs.len(), truth.len());
    for (name, want) in truth {
        let (tool, number) = name.split_once('/').unwrap();
        let number: u64 = number.parse().unwrap();
        let is_it = |p: &touch2touch_core::dataset::PairEntry| p.tool.as_deref() == Some(tool) && p.number == number;
        let id = PairId(dataset.index.pairs.iter().position(is_it).unwrap() as u32);
        let loaded = dataset.load_with_counts(id).unwrap();
        // The set's cameras are mirrored, which no quaternion can say: the loader repairs that and says so.
        assert_eq!(loaded.sample.notes.len(), 1, "{:#?}", loaded.sample.notes);
        assert!(loaded.sample.notes[0].what.contains("mirrored camera frame"));
        let sample = loaded.sample;
        let pose = sample.grasp_from_object.unwrap().inverse();
        let number = |key: &str| want[key].as_f64().unwrap();
        // The truth was written from 32-bit numbers.
        assert!((pose.theta_rad.to_degrees() - number("theta_deg")).abs() < 1e-9, "{name}");
        assert!((pose.y_m + number("x")).abs() < 1e-9 && (pose.z_m + number("y")).abs() < 1e-9, "{name}");
        for finger in lab::PADS {
            let touch = sample.pad(finger).unwrap();
            let imprint = &touch.depth().unwrap().imprint;
            let sum: f64 = imprint.as_slice().iter().map(|&v| f64::from(v)).sum();
            let want_sum = want["imprint_sum"][finger.index()].as_f64().unwrap();
            assert!((sum - want_sum).abs() < 1e-9 * want_sum.abs(), "{name}: {sum} for {want_sum}");
            let raw = &touch.color().unwrap().images.as_ref().unwrap().raw;
            let sum: f64 = raw.as_slice().iter().flatten().map(|&v| f64::from(v)).sum();
            assert_eq!(sum, want["gelslim_sum"][finger.index()].as_f64().unwrap(), "{name}");
        }
        let mesh = dataset.tool_mesh(tool).unwrap().unwrap();
        assert!(mesh.bounds().is_some_and(|[lo, hi]| (hi - lo).max_element() < 0.2));
    }
}

#[test]
fn the_deepest_pixels_of_both_fingers_lie_on_the_tool() {
    let Some(root) = support::shared("lab-sample") else { return };
    let dataset = Dataset::open(&root).unwrap();
    for (i, entry) in dataset.index.pairs.iter().enumerate() {
        let sample = dataset.load(PairId(i as u32)).unwrap();
        let object_from_grasp = sample.grasp_from_object.unwrap().inverse().to_affine();
        let mesh = dataset.tool_mesh(entry.tool.as_deref().unwrap()).unwrap().unwrap();
        let [lo, hi] = mesh.bounds().unwrap();
        for finger in lab::PADS {
            let bubble = sample.pad(finger).unwrap().depth().unwrap();
            let camera = bubble.camera.as_ref().unwrap();
            let mut order: Vec<usize> = (0..bubble.imprint.len()).collect();
            order.sort_by(|&a, &b| bubble.imprint.as_slice()[b].total_cmp(&bubble.imprint.as_slice()[a]));
            let mut inside = 0;
            for &at in &order[..100] {
                let (u, v) = (at % bubble.imprint.width(), at / bubble.imprint.width());
                let depth = f64::from(camera.depth_reference[(u, v)] - bubble.imprint[(u, v)]);
                let in_camera = camera.lift(u as f64, v as f64, depth);
                let p = object_from_grasp * camera.grasp_from_camera;
                let p: DVec3 = p.transform_point3(in_camera);
                // 2 mm for the camera's noise.
                let near = |p: f64, lo: f64, hi: f64| p > lo - 0.002 && p < hi + 0.002;
                inside += usize::from(near(p.x, lo.x, hi.x) && near(p.y, lo.y, hi.y) && near(p.z, lo.z, hi.z));
            }
            assert!(inside >= 90, "{} {}: {inside} of 100", entry.name, finger.index());
        }
    }
}

#[test]
fn every_folder_of_the_reference_set_opens_the_same_pairs() {
    let Some(root) = support::shared("lab-sample") else { return };
    let whole = Dataset::open(&root).unwrap();
    let bubbles = "train/bubbles/data/bubble_style_transfer_dataset_bubbles_pattern_35";
    for (sub, pairs) in [("train", 2), ("test", 2), ("test/test_only", 2), ("train/bubbles", 2), (bubbles, 1)] {
        let part = Dataset::open(&root.join(sub)).unwrap();
        assert_eq!(part.root, whole.root, "{sub}");
        assert_eq!(part.index.pairs.len(), pairs, "{sub}");
        for pair in &part.index.pairs {
            assert!(whole.index.pairs.contains(pair), "{sub}: {pair:?}");
            assert!(part.tool_mesh(pair.tool.as_deref().unwrap()).unwrap().is_some());
        }
    }
    let splits: Vec<Split> = whole.index.pairs.iter().map(|p| p.split).collect();
    assert_eq!(splits, [Split::Train, Split::Train, Split::Test, Split::Test]);
    assert_eq!(whole.index.pairs[0].name, "pattern_31_rod/data_0");
    assert_eq!(whole.index.pairs[2].name, "test_only/pattern_02_2_lines_angle_2_data_35");
}

#[test]
fn the_real_pictures_open_without_a_problem() {
    let Some(root) = support::shared("real-pairs") else { return };
    let dataset = Dataset::open(&root).unwrap();
    assert_eq!((dataset.kind, dataset.index.pairs.len()), (SourceKind::Pictures, 36));
    assert_eq!(dataset.problems, []);
    assert_eq!(dataset.index.pairs[7].name, "07");
    let mut squares = [0f64; 3];
    // Pictures that the lab's color jitter left alone; see the module's documentation of the gain.
    let clean = [2, 3, 7, 8, 12, 13, 14, 16, 17, 19, 21, 22, 23, 24, 26, 32, 33, 34, 35];
    for i in 0..36 {
        let loaded = dataset.load_with_counts(PairId(i)).unwrap();
        assert_eq!(loaded.sample.notes, []);
        let touch = loaded.sample.pad(lab::RIGHT).unwrap();
        let imprint = &touch.depth().unwrap().imprint;
        assert_eq!(imprint.size(), [175, 140]);
        let largest = imprint.as_slice().iter().copied().fold(0f32, f32::max);
        assert!((0.015..=0.0180001).contains(&largest), "{i}: {largest}");
        let laid = loaded.sample.laid;
        assert_eq!(dataset.bubble_tile(PairId(i), laid).unwrap().unwrap().size(), [128, 128]);
        assert_eq!(dataset.vqvae_tile(PairId(i), laid).unwrap().unwrap().size(), [128, 128]);
        assert_eq!(compare::beside(&dataset, PairId(i), &loaded.sample).unwrap().unwrap().imprint.size(), [175, 140]);
        let difference = &touch.color().unwrap().difference;
        for (c, sum) in squares.iter_mut().enumerate() {
            let mean_square: f64 =
                difference.as_slice().iter().map(|p| f64::from(p[c]).powi(2)).sum::<f64>() / difference.len() as f64;
            assert!(mean_square.sqrt() < 40.0, "{i}: {}", mean_square.sqrt());
            if clean.contains(&i) {
                *sum += mean_square / clean.len() as f64;
            }
        }
    }
    // The released training set's spread on the 0..255 scale.
    for (square, want) in squares.iter().zip([17.5, 10.9, 14.7]) {
        assert!((square.sqrt() / want - 1.0).abs() < 0.05, "{} for {want}", square.sqrt());
    }
}
