//! A data set of masks: notes, which to look at first, and what they took.

use touch2touch_work::io::dataset::Dataset;
use touch2touch_work::io::masks::MaskStore;

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

#[test]
fn what_masks_took_is_counted_from_their_journals() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    let path = set.to_str().unwrap();
    let simulate = ["simulate", "--out", path, "--tools", "pattern_36,pattern_31_rod", "--grasps", "2", "--seed", "4"];
    assert!(run(&simulate, dir.path()).status.success());
    let names: Vec<String> = Dataset::open(&set).unwrap().index.pairs.iter().map(|pair| pair.name.clone()).collect();
    let none = json(&run(&["masks", "stats", path, "--json"], dir.path()));
    assert_eq!((&none["all"]["todo"], none["seconds_per_mask"].is_null()), (&names.len().into(), true));
    let label = |words: &[&str]| {
        let done = run(&[&["label", path, "--pair", &names[0], "--person", "Anna"], words].concat(), dir.path());
        assert!(done.status.success(), "{}", error_text(&done));
    };
    label(&["--adopt", "--mask", "threshold", "--finger", "right"]);
    label(&["--clean", "grow=1.3", "--finger", "right"]);
    label(&["--review", "done"]);
    let found = json(&run(&["masks", "stats", path, "--person", "Anna", "--json"], dir.path()));
    assert_eq!((&found["all"]["done"], &found["all"]["todo"]), (&1.into(), &(names.len() - 1).into()));
    assert_eq!(found["tools"].as_array().unwrap().len(), 2);
    // One took two edits; the left finger's was right as it was, and done accepted it by one.
    assert_eq!((&found["effort"]["masks"], &found["edits_per_mask"]), (&2.into(), &1.5.into()));
    assert_eq!(found["sources"]["threshold"]["masks"], 1);
    assert_eq!((&found["pairs"][0]["pair"], &found["pairs"][0]["person"]), (&names[0].clone().into(), &"Anna".into()));
    assert!(found["seconds_per_mask"].as_f64().unwrap() <= 60.0);
    // A second mask, as the studio writes it, is listed with how far it is from the first.
    let store = MaskStore::for_dataset(&Dataset::open(&set).unwrap()).unwrap();
    let (right, again) = (touch2touch_core::rig::lab::RIGHT, store.repeats_of("Anna"));
    let mut mask = store.load(&names[0], right).unwrap().unwrap();
    mask.mask = touch2touch_core::label::shrink(&mask.mask, 2.0);
    again.save(&names[0], right, Some(&mask)).unwrap();
    again.save_review(&names[0], &store.load_review(&names[0]).unwrap().unwrap()).unwrap();
    let found = json(&run(&["masks", "stats", path, "--person", "Anna", "--json"], dir.path()));
    let repeat = &found["repeats"]["masks"][0];
    assert!(repeat["pair"] == *names[0] && repeat["dice"].as_f64().unwrap() < 1.0, "{found}");
    let said = run(&["masks", "stats", path, "--person", "Anna"], dir.path());
    let text = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(text.contains("drawn twice") && text.contains("from threshold"), "{text}");
    assert!(
        json(&run(&["masks", "stats", path, "--person", "Ben", "--json"], dir.path()))["repeats"]["masks"]
            .as_array()
            .unwrap()
            .is_empty()
    );
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
    let seeds = ["generate", path, "--pair", &last, "--seeds", "2", "--steps", "1", "--out", out.to_str().unwrap()];
    let made = run(&seeds, dir.path());
    assert!(made.status.success(), "{}", error_text(&made));
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
