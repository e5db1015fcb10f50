//! The benchmarks run.

#![allow(clippy::unwrap_used, reason = "in a test an unexpected error is a failure")]

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

mod training_data;

fn run(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touch2touch-bench")).args(arguments).output().unwrap()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

fn error_text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn every_engine_is_measured_on_fresh_cases_and_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let (folder, out) = (dir.path().join("cases"), dir.path().join("bench.json"));
    let folder_text = folder.to_str().unwrap();
    let made = run(&["cases", "--out", folder_text, "--count", "10", "--seed", "3", "--json"]);
    assert!(made.status.success(), "{}", error_text(&made));
    assert_eq!(json(&made)["cases"], 10);
    let again = run(&["cases", "--out", folder_text, "--count", "2"]);
    assert!(error_text(&again).contains("already holds cases"), "{}", error_text(&again));

    // Without Python the peers are left out, and that is said.
    let args = ["registration", "--cases", folder_text, &format!("--json={}", out.display()), "--limit", "3"];
    let done = run(&[&args[..], &["--python", "/no/such/python"]].concat());
    assert!(done.status.success(), "{}", error_text(&done));
    let table = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(table.contains("<- default") && table.contains("were not run"), "{table}");
    let report: Value = serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap();
    let engines = report["engines"].as_array().unwrap();
    assert!(engines.iter().any(|e| e["name"] == report["default"]), "{report}");
    assert_eq!(engines.len(), <touch2touch_core::pose::Registration as strum::IntoEnumIterator>::iter().count());
    for engine in engines {
        for key in ["mean_deg", "median_deg", "success_5", "success_10", "gross_20", "median_ms", "p95_ms"] {
            assert!(engine[key].is_number(), "{key} of {engine}");
            assert!(engine["strata"]["nominal"][key].is_number(), "{key} of {engine}");
        }
        assert_eq!(engine["error_deg"].as_array().unwrap().len(), 3);
    }
    assert!(!report["front"].as_array().unwrap().is_empty());
}

#[test]
fn the_other_benchmarks_run() {
    let (dir, from) =
        (tempfile::tempdir().unwrap(), Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/bundles"));
    for entry in std::fs::read_dir(from.join("generator")).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, dir.path().join(path.file_name().unwrap())).unwrap();
    }
    // Its pictures are small; as large as the imprints they are compared with.
    let manifest = dir.path().join("manifest.json");
    let mut value: Value = serde_json::from_slice(&std::fs::read(&manifest).unwrap()).unwrap();
    value["output"]["imprint_size"] = serde_json::json!([175, 140]);
    std::fs::write(manifest, value.to_string()).unwrap();
    let bundle = dir.path();
    let bundle = bundle.to_str().unwrap();
    let generator = ["generator", "--grasps", "1", "--engine", "rten", "--steps", "1", "--bundle", bundle, "--json"];
    let doctor =
        ["doctor", "--sets", "1", "--sound", "1", "--pairs", "1", "--only", "theta", "--no-generator", "--json"];
    let verdict = ["verdict", "--count", "2", "--json"];
    let trials = ["trials", "--count", "1", "--runtime", "rten", "--steps", "1", "--bundle", bundle, "--json"];
    for arguments in [&generator[..], &doctor, &verdict, &trials] {
        let done = run(arguments);
        assert!(done.status.success(), "{arguments:?}: {}", error_text(&done));
        assert!(json(&done).is_object(), "{arguments:?}");
    }
}
