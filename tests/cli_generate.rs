//! `generate` and what it keeps as a user runs it, with the tiny bundle of the tests.

use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use crate::support::run;

fn json(output: &Output) -> Value {
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|err| panic!("{err}: {error}"))
}

/// The tiny bundle, with imprints as large as the simulated ones: they are compared.
pub(crate) fn full_size_bundle(dir: &Path) -> PathBuf {
    let (from, to) = (Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bundles/generator"), dir.join("bundle"));
    std::fs::create_dir(&to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
    }
    let manifest = to.join("manifest.json");
    let mut value: Value = serde_json::from_slice(&std::fs::read(&manifest).unwrap()).unwrap();
    value["output"]["imprint_size"] = serde_json::json!([175, 140]);
    std::fs::write(manifest, value.to_string()).unwrap();
    to
}

#[test]
fn predictions_are_kept_and_found_again() {
    let dir = tempfile::tempdir().unwrap();
    let (home, set, out) = (dir.path().join("home"), dir.path().join("set"), dir.path().join("out"));
    let bundle = full_size_bundle(dir.path());
    let [set, out, bundle] = [&set, &out, &bundle].map(|p| p.to_str().unwrap());
    let made = run(&["simulate", "--out", set, "--tools", "pattern_36", "--grasps", "1", "--seed", "3"], &home);
    assert!(made.status.success());
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
