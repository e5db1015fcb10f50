//! What a hostile day found about files and streams: nothing is lost or mixed without a word, and nothing ends in a panic.

use std::path::Path;
#[cfg(unix)]
use std::process::{Command, Stdio};

use serde_json::Value;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::MaskStore;
use touch2touch_pipeline::io::simulated::MANIFEST;

use super::{error_text, json, run};

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
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    let made = simulate(&set, &["--grasps", "2", "--seed", "7"]);
    assert!(made.status.success(), "{}", error_text(&made));
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
    let mut cut: Value = serde_json::from_str(&text).unwrap();
    cut["parts"]["test"]["finished"] = false.into();
    std::fs::write(&manifest, cut.to_string()).unwrap();
    let set_text = set.to_str().unwrap();
    let doctor = json(&run(&["doctor", set_text, "--json"], dir.path())).to_string();
    assert!(doctor.contains("was not finished"), "{doctor}");
    assert!(simulate(&set, &["--grasps", "2", "--seed", "7"]).status.success(), "it can be taken up again");
    let doctor = json(&run(&["doctor", set_text, "--json"], dir.path())).to_string();
    assert!(!doctor.contains("was not finished"), "{doctor}");
}

#[cfg(unix)]
#[test]
fn a_killed_simulation_is_seen_by_the_doctor() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    let mut child = Command::new(env!("CARGO_BIN_EXE_touch2touch"))
        .args(["simulate", "--tools", "pattern_36", "--grasps", "2000", "--out", set.to_str().unwrap()])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let bubbles = set.join("test/test_only/bubbles");
    while !std::fs::read_dir(&bubbles).is_ok_and(|mut files| files.next().is_some()) {
        assert!(child.try_wait().unwrap().is_none(), "it ended early");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let doctor = run(&["doctor", set.to_str().unwrap(), "--json"], dir.path());
    assert!(json(&doctor).to_string().contains("was not finished"), "{}", error_text(&doctor));
}

#[cfg(target_os = "linux")]
#[test]
fn a_closed_or_full_standard_output_is_no_panic() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    assert!(simulate(&set, &["--grasps", "1"]).status.success());
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
    for args in [&["doctor", set, "--json"][..], &["cache"], &["--help"], &["pose", "--help"]] {
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
fn more_threads_than_a_system_starts_are_not_started() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    assert!(simulate(&set, &["--grasps", "1"]).status.success());
    let out = Command::new(env!("CARGO_BIN_EXE_touch2touch"))
        .args(["doctor", set.to_str().unwrap(), "--json"])
        .env("RAYON_NUM_THREADS", "100000")
        .env("TOUCH2TOUCH_CACHE", dir.path())
        .output()
        .unwrap();
    assert!(json(&out)["pairs"].as_u64().is_some_and(|pairs| pairs > 0), "{}", error_text(&out));
    assert!(error_text(&out).contains("256 are used"), "{}", error_text(&out));
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
fn every_verb_takes_the_dataset_as_a_path_and_no_number_of_nothing() {
    let verbs = ["generate", "stats", "evaluate", "pose", "masks export", "doctor", "watch"];
    for verb in verbs {
        let needed: &[&str] = match verb {
            "generate" | "stats" | "masks export" => &["--out", "x"],
            _ => &[],
        };
        let check = |dataset: &[&str]| {
            let words = ["touch2touch"].into_iter().chain(verb.split(' ')).chain(dataset.iter().copied());
            touch2touch::headless::check_command(words.chain(needed.iter().copied()))
        };
        check(&["demo"]).unwrap_or_else(|err| panic!("{verb}: {err}"));
        check(&["demo"]).unwrap_or_else(|err| panic!("{verb}: {err}"));
        assert!(check(&["demo", "demo"]).is_err() && check(&[]).is_err(), "{verb}");
    }
    for words in [
        "generate demo --out x --limit 0",
        "stats demo --out x --limit 0",
        "pose demo --limit 0",
        "masks export demo --out x --limit 0",
        "simulate --out x --grasps 0",
        "evaluate demo --grasps 0",
    ] {
        let refused = touch2touch::headless::check_command(["touch2touch"].into_iter().chain(words.split(' ')));
        assert!(refused.is_err_and(|err| err.contains("leaves nothing to do")), "{words}");
    }
}

#[test]
fn what_the_system_says_is_said_once() {
    let dir = tempfile::tempdir().unwrap();
    let refused = run(&["doctor", "/no/such/folder"], dir.path());
    let said = error_text(&refused);
    assert_eq!(said.matches("os error 2").count(), 1, "{said}");
    let file = dir.path().join("none.json");
    let args = ["stats", "demo", "--out", file.to_str().unwrap(), "--shift", "refit:/no/such/file"];
    let said = error_text(&run(&args, dir.path()));
    assert!(said.matches("os error 2").count() <= 1, "{said}");
}

#[test]
fn all_damaged_masks_are_listed_and_leftovers_of_killed_exports_go() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    assert!(simulate(&set, &["--grasps", "3"]).status.success());
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
    let done = run(&[&export[..], &["--pairs", "all", "--mask", "truth"]].concat(), dir.path());
    assert!(done.status.success(), "{}", error_text(&done));
    assert!(!left.exists() && out.join("train/imgs").is_dir());
    // The stems say whose they are in the manifest.
    let manifest = std::fs::read(out.join(touch2touch_pipeline::io::exchange::MANIFEST)).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    let named: Vec<&str> = manifest["stems"].as_object().unwrap().values().map(|v| v[0].as_str().unwrap()).collect();
    assert!(dataset.index.pairs.iter().all(|entry| named.contains(&entry.name.as_str())), "{named:?}");
}
