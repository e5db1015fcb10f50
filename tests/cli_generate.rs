//! `generate` and what it keeps as a user runs it, with the tiny bundle of the tests.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::support::{copy_folder, edit_json, json, run, simulate, tiny};

/// The tiny bundle, with imprints as large as the simulated ones: they are compared.
pub(crate) fn full_size_bundle(dir: &Path) -> PathBuf {
    let to = dir.join("bundle");
    copy_folder(&tiny("generator"), &to);
    edit_json(&to.join("manifest.json"), |manifest| {
        manifest["output"]["imprint_size"] = serde_json::json!([175, 140]);
    });
    to
}

#[test]
fn predictions_are_kept_and_found_again() {
    let dir = tempfile::tempdir().unwrap();
    let (home, set, out) = (dir.path().join("home"), dir.path().join("set"), dir.path().join("out"));
    let bundle = full_size_bundle(dir.path());
    simulate(&set, "pattern_36", &["--grasps", "1", "--seed", "3"]);
    let [set, out, bundle] = [&set, &out, &bundle].map(|p| p.to_str().unwrap());
    let generate = |more: &[&str]| {
        let fixed = ["generate", set, "--out", out, "--finger", "both", "--bundle", bundle];
        run(&[&fixed[..], &["--runtime", "rten", "--json"], more].concat(), &home)
    };
    let kept = |report: &Value| -> Vec<bool> {
        report["pairs"].as_array().unwrap().iter().map(|p| p["kept"].as_bool().unwrap()).collect()
    };
    let first = json(&generate(&[]));
    assert_eq!(kept(&first), [false, false]);
    let again = json(&generate(&[]));
    assert_eq!(kept(&again), [true, true]);
    assert_eq!(again["pairs"][0]["psnr_db"], first["pairs"][0]["psnr_db"], "the same to the last bit");
    assert_eq!(kept(&json(&generate(&["--no-cache"]))), [false, false]);
    // Another recipe is another prediction.
    let fast = json(&generate(&["--steps", "1"]));
    assert_eq!((kept(&fast), &fast["steps"]), (vec![false, false], &Value::from(1)));
    let steps = json(&generate(&["--steps", "3", "--sampler", "ddpm"]));
    assert_eq!((&steps["steps"], &steps["sampler"]), (&Value::from(3), &Value::from("ddpm")));
}
