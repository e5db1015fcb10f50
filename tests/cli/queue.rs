//! A data set of masks: notes, and which to look at first.

use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::MaskStore;

use super::{error_text, json, run};

#[test]
fn notes_are_written_listed_and_removed() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    let path = set.to_str().unwrap();
    let simulate = ["simulate", "--out", path, "--tools", "pattern_36", "--grasps", "1", "--seed", "4"];
    assert!(run(&simulate, dir.path()).status.success());
    let name = Dataset::open(&set).unwrap().index.pairs[0].name.clone();
    let note = |text: &str| run(&["label", path, "--pair", &name, "--note", text, "--json"], dir.path());
    let written = note(" shallow\n at the edge ");
    assert!(written.status.success(), "{}", error_text(&written));
    assert_eq!(json(&written)["pairs"][0]["note"], "shallow at the edge");
    let listed = run(&["label", path], dir.path());
    let text = String::from_utf8_lossy(&listed.stdout).into_owned();
    assert!(text.contains("note: shallow at the edge") && text.contains("1 todo"), "{text}");
    let store = MaskStore::for_dataset(&Dataset::open(&set).unwrap()).unwrap();
    let journal = String::from_utf8(store.journal(&name).unwrap()).unwrap();
    assert!(journal.contains(r#""note":["","shallow at the edge"]"#), "{journal}");
    assert!(note("").status.success());
    assert_eq!(store.load_review(&name).unwrap().unwrap().note, "");
}

#[cfg(feature = "onnx")]
#[test]
fn the_most_uncertain_are_listed_first() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    let path = set.to_str().unwrap();
    let simulate = ["simulate", "--out", path, "--tools", "pattern_36,pattern_31_rod", "--grasps", "2", "--seed", "4"];
    assert!(run(&simulate, dir.path()).status.success());
    let queue = |words: &[&str]| json(&run(&[&["masks", "queue", path, "--json"], words].concat(), dir.path()));
    let plain = queue(&[]);
    let overall: Vec<f64> =
        plain["pairs"].as_array().unwrap().iter().map(|pair| pair["overall"].as_f64().unwrap()).collect();
    assert!(overall.len() >= 4 && overall.is_sorted_by(|a, b| a >= b), "{overall:?}");
    assert!(plain["pairs"][0]["disagreement"].is_null() && plain["pairs"][0]["unsure"].as_f64().unwrap() > 0.0);
    // The last of it is drawn otherwise than the model says.
    let last = plain["pairs"][overall.len() - 1]["pair"].as_str().unwrap().to_owned();
    let grow = ["label", path, "--pair", &last, "--finger", "left", "--clean", "grow=2"];
    assert!(run(&grow, dir.path()).status.success());
    let by = queue(&["--by", "disagreement"]);
    assert_eq!(by["pairs"][0]["pair"], *last);
    let apart = by["pairs"][0]["disagreement"].as_f64().unwrap();
    assert!((0.01..0.9).contains(&apart), "{apart}");
    assert!(by["pairs"][0]["why"].as_str().unwrap().starts_with("Hand against model"));
    assert!(by["pairs"][1]["disagreement"].is_null());
    let angles = queue(&["--by", "angle", "--first", "2"]);
    let angles: Vec<f64> =
        angles["pairs"].as_array().unwrap().iter().map(|pair| pair["angle_error_deg"].as_f64().unwrap()).collect();
    assert!(angles.len() == 2 && angles[0] >= angles[1]);
    // Predictions with two seeds of one pair: their spread is known then, of that pair alone.
    assert!(queue(&["--by", "spread"])["pairs"][0]["seed_spread_mm"].is_null());
    let out = dir.path().join("seeds");
    for seed in ["1", "2"] {
        let words = ["generate", path, "--pair", &last, "--seed", seed, "--steps", "1", "--out", out.to_str().unwrap()];
        let made = run(&words, dir.path());
        assert!(made.status.success(), "{}", error_text(&made));
    }
    let spread = queue(&["--by", "spread"]);
    assert_eq!(spread["pairs"][0]["pair"], *last, "{spread}");
    assert!(
        spread["pairs"][0]["seed_spread_mm"].as_f64().unwrap() > 0.0 && spread["pairs"][1]["seed_spread_mm"].is_null()
    );
    let done = ["label", path, "--pair", &last, "--review", "done"];
    assert!(run(&done, dir.path()).status.success());
    assert_eq!(queue(&["--unfinished"])["pairs"].as_array().unwrap().len(), overall.len() - 1);
    let said = run(&["masks", "queue", path], dir.path());
    assert!(String::from_utf8_lossy(&said.stdout).contains("the most uncertain first"));
}
