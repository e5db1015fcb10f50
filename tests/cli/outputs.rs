//! Folders of outputs: each pair has files of its own, and a run that was cut short is known by its report.

use std::path::{Path, PathBuf};

use serde_json::Value;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::names;

use super::{json, run, simulate, succeed};
use crate::cli_generate::full_size_bundle;

/// A dataset of the pairs `a/b` and `a__b`, with both halves each.
fn look_alike(dir: &Path) -> PathBuf {
    let made = dir.join("made");
    simulate(&made, "pattern_36", &["--grasps", "2", "--seed", "3"]);
    let set = dir.join("set");
    for sensor in ["gelslims", "bubbles"] {
        let from = |i: u8| made.join(format!("test/test_only/{sensor}/pattern_36_data_{i}.pt"));
        let to = set.join("train").join(sensor).join("data");
        std::fs::create_dir_all(to.join("a")).unwrap();
        std::fs::copy(from(0), to.join("a/b.pt")).unwrap();
        std::fs::copy(from(1), to.join("a__b.pt")).unwrap();
    }
    let mut names: Vec<String> = Dataset::open(&set).unwrap().index.pairs.into_iter().map(|p| p.name).collect();
    names.sort();
    assert_eq!(names, ["a/b", "a__b"]);
    set
}

fn ending(folder: &Path, ending: &str) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .filter_map(|e| e.unwrap().file_name().to_string_lossy().strip_suffix(ending).map(str::to_owned))
        .collect();
    names.sort();
    names
}

#[test]
fn pairs_that_look_alike_have_files_of_their_own_and_the_report_says_whether_it_is_whole() {
    let dir = tempfile::tempdir().unwrap();
    let set = look_alike(dir.path());
    let out = dir.path().join("out");
    let bundle = full_size_bundle(dir.path());
    let [set_text, out_text, bundle] = [&set, &out, &bundle].map(|path| path.to_str().unwrap());
    let args = ["generate", set_text, "--out", out_text, "--bundle", bundle, "--runtime", "rten", "--json"];
    std::fs::create_dir(&out).unwrap();
    // A link where the report goes is replaced, and what it led to stays what it was.
    let report = out.join("generate.json");
    let elsewhere = dir.path().join("elsewhere");
    std::fs::write(&elsewhere, "mine").unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(&elsewhere, &report).unwrap();
    let done = succeed(&args, dir.path());
    assert_eq!(json(&done)["pairs"].as_array().unwrap().len(), 2);
    let stems = ending(&out, "_right.npy");
    assert_eq!(stems, ["a__b", "a/b"].map(names::output));
    let read = |stem: &str| std::fs::read(out.join(format!("{stem}_right.npy"))).unwrap();
    assert!(read(&stems[0]) != read(&stems[1]), "two grasps");
    let written = std::fs::read(&report).unwrap();
    let whole: Value = serde_json::from_slice(&written).unwrap();
    assert_eq!((&whole["finished"], whole["pairs"].as_array().unwrap().len()), (&Value::from(true), 2));
    assert_eq!(std::fs::read(&elsewhere).unwrap(), b"mine");
    assert!(!std::fs::symlink_metadata(&report).unwrap().is_symlink());

    // A run that is refused leaves the last one's report as it is.
    let refused = run(&[&args[..], &["--shift", "refit:/nowhere.json"]].concat(), dir.path());
    assert_eq!(refused.status.code(), Some(2));
    assert!(std::fs::read(&report).unwrap() == written);
}

#[cfg(unix)]
#[test]
fn a_killed_run_is_known_by_its_report_and_its_leftovers_go() {
    use std::process::{Command, Stdio};
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let bundle = full_size_bundle(dir.path());
    let [out_text, bundle] = [&out, &bundle].map(|path| path.to_str().unwrap());
    let args = |limit: &'static str| {
        ["generate", "demo", "--out", out_text, "--bundle", bundle, "--runtime", "rten", "--no-cache", "--limit", limit]
            .map(str::to_owned)
    };
    let first = args("1");
    let first: Vec<&str> = first.iter().map(String::as_str).collect();
    succeed(&first, dir.path());
    let report = || -> Value { serde_json::from_slice(&std::fs::read(out.join("generate.json")).unwrap()).unwrap() };
    assert_eq!(report()["finished"], true);
    let before = ending(&out, ".npy").len();
    let mut child = Command::new(env!("CARGO_BIN_EXE_touch2touch"))
        .args(args("100"))
        .env("XDG_DATA_HOME", dir.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while ending(&out, ".npy").len() <= before {
        assert!(child.try_wait().unwrap().is_none(), "it ended early");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(report()["finished"], false, "the images are newer than the last report");
    // Half a file, as a run killed in the middle of a write leaves it.
    std::fs::write(out.join(".tmp-killed.part"), "half").unwrap();
    succeed(&first, dir.path());
    assert_eq!((&report()["finished"], ending(&out, ".part").len()), (&Value::from(true), 0));
}
