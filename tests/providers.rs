//! Models on an execution provider: OpenVINO, which runs on a processor, so that the way to a GPU is walked for real.

use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::support::{self, command, error_text, json, tiny};

fn run(args: &[&str], library: &str, home: &Path) -> Output {
    command(args, home).env("ORT_DYLIB_PATH", library).env("RUST_LOG", "warn").output().unwrap()
}

#[test]
fn a_provider_that_works_is_the_automatic_choice_and_the_others_say_what_to_install() {
    let Some(library) = support::openvino() else { return };
    let home = tempfile::tempdir().unwrap();
    let report = json(&run(&["runtime", "--json"], &library, home.path()));
    assert_eq!(report["engine"], "openvino", "{report}");
    for found in report["providers"].as_array().unwrap() {
        let works = found["provider"] == "openvino";
        assert_eq!(found["works"], works, "{found}");
        let reason = found["reason"].as_str().unwrap_or_default();
        assert_eq!(works, reason.is_empty(), "{found}");
        assert!(works || reason.contains("pip install") || reason.contains("ORT_DYLIB_PATH"), "{found}");
    }
    // One that is not there is asked for by name: nothing is predicted, and it is said why.
    let out = home.path().join("out");
    let refused = run(
        &["generate", "demo", "--limit", "1", "--runtime", "cuda", "--out", out.to_str().unwrap()],
        &library,
        home.path(),
    );
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(
        !refused.status.success() && said.contains("pip install onnxruntime-gpu") && said.contains("cuDNN"),
        "{said}"
    );
}

#[test]
fn a_provider_predicts_and_masks_and_poses_as_the_processor_does() {
    let Some(library) = support::openvino() else { return };
    let home = tempfile::tempdir().unwrap();
    let posed = |runtime: &str| {
        let words =
            ["pose", "demo", "--limit", "3", "--imprint", "predicted", "--mask", "unet", "--no-cache", "--json"];
        json(&run(&[&words[..], &["--runtime", runtime]].concat(), &library, home.path()))
    };
    let [provider, processor, built_in, automatic] = ["openvino", "ort", "rten", "auto"].map(posed);
    let rows = |report: &Value| report["cases"].as_array().unwrap().clone();
    let angle = |row: &Value| row["angle_deg"].as_f64().unwrap();
    assert_eq!(rows(&processor).len(), 3, "{processor}");
    for (a, b) in rows(&provider).iter().zip(rows(&processor)).chain(rows(&built_in).iter().zip(rows(&processor))) {
        // A pixel at the edge of the mask may fall on the other side; no more.
        assert!((angle(a) - angle(&b)).abs() < 0.05, "{a} {b}");
    }
    let angles = |report: &Value| rows(report).iter().map(angle).collect::<Vec<_>>();
    assert_eq!(angles(&automatic), angles(&provider), "the same engine is the same to the last bit");
}

#[test]
fn where_a_provider_computes_otherwise_the_processor_goes_on_and_says_so() {
    let Some(library) = support::openvino() else { return };
    let home = tempfile::tempdir().unwrap();
    let rounding = tiny("rounding").display().to_string();
    let masked = |runtime: &str| {
        let words =
            ["pose", "demo", "--limit", "1", "--mask", "unet", "--mask-bundle", &rounding, "--runtime", runtime];
        run(&words, &library, home.path())
    };
    let automatic = masked("auto");
    assert!(error_text(&automatic).contains("it runs on the processor"), "{}", error_text(&automatic));
    assert!(!error_text(&automatic).contains("differs from the processor by 0.0"), "{}", error_text(&automatic));
    let named = masked("openvino");
    assert!(
        !named.status.success() && error_text(&named).contains("differs from the processor"),
        "{}",
        error_text(&named)
    );
    // What it computes alike is taken.
    let checked = run(&["bundle", "check", &tiny("mask").display().to_string(), "--json"], &library, home.path());
    assert_eq!(json(&checked)["engines"], serde_json::json!(["rten", "ort", "openvino"]));
    let refused = run(&["bundle", "check", &rounding, "--json"], &library, home.path());
    assert_eq!(json(&refused)["engines"], serde_json::json!(["rten", "ort"]));
}
