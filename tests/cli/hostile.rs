//! What a hostile day found about files and streams: nothing is lost or mixed without a word, and nothing ends in a panic.

use std::path::Path;
#[cfg(unix)]
use std::process::{Command, Stdio};

use serde_json::Value;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::MaskStore;
use touch2touch_pipeline::io::simulated::MANIFEST;

use super::{error_text, json, run, simulated, succeed};
use crate::support::edit_json;

/// A small simulated dataset.
fn simulate(out: &Path, more: &[&str]) -> std::process::Output {
    let args = ["simulate", "--out", out.to_str().unwrap(), "--tools", "pattern_36", "--json"];
    run(&[&args[..], more].concat(), out.parent().unwrap())
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_simulation_never_mixes_with_another_dataset_and_says_that_it_was_cut_short() {
    let (dir, set) = simulated("pattern_36", &["--grasps", "2", "--seed", "7"]);
    let whole = files(&set);

    // The same again replaces it; other grasps would mix with it.
    assert!(simulate(&set, &["--grasps", "2", "--seed", "7"]).status.success());
    for other in [["--grasps", "3", "--seed", "7"], ["--grasps", "2", "--seed", "8"]] {
        let refused = simulate(&set, &other);
        assert_eq!(refused.status.code(), Some(2));
        assert!(error_text(&refused).contains("choose a new folder"), "{}", error_text(&refused));
    }
    assert_eq!(files(&set), whole);
    let foreign = dir.path().join("foreign");
    std::fs::create_dir(&foreign).unwrap();
    std::fs::write(foreign.join("a_gelslim.png"), "mine").unwrap();
    let refused = simulate(&foreign, &["--grasps", "1"]);
    assert!(error_text(&refused).contains("a_gelslim.png"), "{}", error_text(&refused));
    assert_eq!(files(&foreign), ["a_gelslim.png"]);
    // The other half of a dataset with the same tools is no other dataset.
    let train = simulate(&set, &["--grasps", "1", "--seed", "1", "--part", "train"]);
    assert!(train.status.success(), "{}", error_text(&train));
    let faults = run(&["simulate", "--faults", "--out", set.to_str().unwrap()], dir.path());
    assert_eq!(faults.status.code(), Some(2), "other tools are");

    // As a killed run leaves it: the manifest says what was begun.
    let manifest = set.join(MANIFEST);
    let text = std::fs::read_to_string(&manifest).unwrap();
    assert!(!text.contains("false,\n      \"pairs\""), "{text}");
    edit_json(&manifest, |cut| cut["parts"]["test"]["finished"] = false.into());
    let set_text = set.to_str().unwrap();
    let doctor = json(&run(&["doctor", set_text, "--no-predictions", "--json"], dir.path())).to_string();
    assert!(doctor.contains("was not finished"), "{doctor}");
    assert!(simulate(&set, &["--grasps", "2", "--seed", "7"]).status.success(), "it can be taken up again");
    let doctor = json(&run(&["doctor", set_text, "--no-predictions", "--json"], dir.path())).to_string();
    assert!(!doctor.contains("was not finished"), "{doctor}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_closed_or_full_standard_output_is_no_panic() {
    let (dir, set) = simulated("pattern_36", &["--grasps", "1"]);
    let set = set.to_str().unwrap();
    let start = |args: &[&str], out: Stdio| {
        Command::new(env!("CARGO_BIN_EXE_touch2touch"))
            .args(args)
            .env("XDG_DATA_HOME", dir.path())
            .env("XDG_CONFIG_HOME", dir.path())
            .env("TOUCH2TOUCH_CACHE", dir.path())
            .stdout(out)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    for args in [&["doctor", set, "--no-predictions", "--json"][..], &["--help"], &["pose", "--help"]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let full = start(args, full.into()).wait_with_output().unwrap();
        assert_eq!(full.status.code(), Some(2), "{args:?}: {}", error_text(&full));
        let said = error_text(&full);
        assert!(said.contains("standard output") && said.contains("No space left"), "{args:?}: {said}");
        // Closed before the program begins: a short text could else be written before the reader is gone.
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let closed = start(args, writer.into()).wait_with_output().unwrap();
        assert_eq!(closed.status.code(), Some(141), "{args:?}: {}", error_text(&closed));
        assert_eq!(error_text(&closed), "", "{args:?}");
    }
    // Nowhere to complain either.
    let full = || std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let mute = Command::new(env!("CARGO_BIN_EXE_touch2touch"))
        .args(["doctor", "/no/such/folder"])
        .stdout(full())
        .stderr(full())
        .status()
        .unwrap();
    assert_eq!(mute.code(), Some(2));
}

#[test]
fn a_mistyped_verb_opens_no_window_and_names_the_nearest() {
    let dir = tempfile::tempdir().unwrap();
    for (words, nearest) in [
        (&["generat"][..], "`touch2touch generate`"),
        (&["Pose"], "`touch2touch pose`"),
        (&["evalute", "demo"], "`touch2touch evaluate`"),
        (&["/no/such/folder"], "--help"),
        (&["--reset-ui", "docter"], "`touch2touch doctor`"),
    ] {
        let refused = run(words, dir.path());
        let said = error_text(&refused);
        assert_eq!(refused.status.code(), Some(2), "{words:?}: {said}");
        assert!(said.contains("neither a verb nor") && said.contains(nearest), "{words:?}: {said}");
    }
    let deeper = run(&["masks", "exprt"], dir.path());
    assert!(error_text(&deeper).contains("export"), "{}", error_text(&deeper));
}

#[test]
fn all_damaged_masks_are_listed_and_leftovers_of_killed_exports_go() {
    let (dir, set) = simulated("pattern_36", &["--grasps", "3"]);
    let dataset = Dataset::open(&set).unwrap();
    let store = MaskStore::for_dataset(&dataset).unwrap();
    std::fs::create_dir_all(store.folder()).unwrap();
    for entry in &dataset.index.pairs {
        std::fs::write(store.mask_file(&entry.name, lab::LEFT), "{").unwrap();
    }
    // As a killed export leaves it: the lock is nobody's.
    let left = dir.path().join(".touch2touch-new-killed");
    std::fs::create_dir_all(left.join("new/train")).unwrap();
    std::fs::write(left.join("lock"), "masks").unwrap();
    let out = dir.path().join("masks");
    let export = ["masks", "export", set.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let refused = run(&[&export[..], &["--pairs", "begun"]].concat(), dir.path());
    let said = error_text(&refused);
    assert_eq!(refused.status.code(), Some(2), "{said}");
    for entry in &dataset.index.pairs {
        assert!(said.contains(&format!("{}, left finger", entry.name)), "{} in {said}", entry.name);
    }
    assert!(!out.exists());
    for entry in &dataset.index.pairs {
        std::fs::remove_file(store.mask_file(&entry.name, lab::LEFT)).unwrap();
    }
    succeed(&[&export[..], &["--pairs", "all", "--mask", "truth"]].concat(), dir.path());
    assert!(!left.exists() && out.join("train/imgs").is_dir());
    // The stems say whose they are in the manifest.
    let manifest = std::fs::read(out.join(touch2touch_pipeline::io::exchange::MANIFEST)).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    let named: Vec<&str> = manifest["stems"].as_object().unwrap().values().map(|v| v[0].as_str().unwrap()).collect();
    assert!(dataset.index.pairs.iter().all(|entry| named.contains(&entry.name.as_str())), "{named:?}");
}
