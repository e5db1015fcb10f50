//! How far the masks of two people agree.

use touch2touch_core::rig::lab;
use touch2touch_work::io::dataset::Dataset;
use touch2touch_work::io::masks::MaskStore;

use super::{error_text, json, run};

#[test]
fn masks_of_two_people_are_compared_the_worst_first() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    let path = set.to_str().unwrap();
    let simulate = ["simulate", "--out", path, "--tools", "pattern_36", "--grasps", "2", "--seed", "4"];
    assert!(run(&simulate, dir.path()).status.success());
    let dataset = Dataset::open(&set).unwrap();
    let own = MaskStore::for_dataset(&dataset).unwrap();
    let other = MaskStore::in_folder(dir.path().join("anna"));
    let with = ["masks", "compare", path, "--with", other.folder().to_str().unwrap()];
    let refused = run(&with, dir.path());
    assert!(refused.status.code() == Some(2) && error_text(&refused).contains("there is no folder"));
    let names: Vec<String> = dataset.index.pairs.iter().map(|pair| pair.name.clone()).collect();
    for name in &names {
        let adopt = ["label", path, "--pair", name, "--adopt", "--mask", "threshold"];
        assert!(run(&adopt, dir.path()).status.success());
        for pad in lab::PADS {
            other.save(name, pad, own.load(name, pad).unwrap().as_ref()).unwrap();
        }
    }
    let nothing = run(&["masks", "compare", path, "--with", dir.path().to_str().unwrap()], dir.path());
    assert!(nothing.status.code() == Some(2) && error_text(&nothing).contains("no mask was drawn by both"));
    // One is changed here, one is missing there.
    let grow = ["label", path, "--pair", &names[1], "--finger", "left", "--clean", "grow=1.3"];
    assert!(run(&grow, dir.path()).status.success());
    other.save(&names[0], lab::LEFT, None).unwrap();
    let found = json(&run(&[&with[..], &["--json"]].concat(), dir.path()));
    let masks = found["masks"].as_array().unwrap();
    assert_eq!((masks.len(), &found["only"]), (2 * names.len() - 1, &serde_json::json!([1, 0])));
    assert_eq!((masks[0]["pair"].as_str(), masks[0]["finger"].as_str()), (Some(&*names[1]), Some("left")));
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    assert!(number(&masks[0]["iou"]) < 0.99 && number(&masks[1]["iou"]) == 1.0);
    let edge = number(&masks[0]["edge_mm"]);
    // Holes that were closed lie farther from the new edge than the 1.3 mm that were added.
    assert!((0.7..4.0).contains(&edge), "{edge}");
    assert_eq!(masks[0]["alone_px"][1], 0, "there is nothing that is not here");
    assert!(
        (number(&found["mean_iou"]) - (number(&masks[0]["iou"]) + masks.len() as f64 - 1.0) / masks.len() as f64).abs()
            < 1e-9
    );
    let said = run(&with, dir.path());
    assert!(said.status.success() && String::from_utf8_lossy(&said.stdout).contains("mean of"));
}
