//! The verb `stats`, and the shift made from what it writes.

use serde_json::Value;

use super::{error_text, json, run, succeed};

/// The demo with two steps on the built-in engine.
const QUICK: [&str; 4] = ["--steps", "2", "--runtime", "rten"];

#[test]
fn statistics_are_written_once_and_serve_their_bundle_only() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("stats.json");
    let path = file.to_str().unwrap();
    let stats = ["stats", "demo", "--limit", "3", "--out", path, "--json"];
    let report = json(&succeed(&[&stats[..], &QUICK].concat(), dir.path()));
    assert_eq!(report["touches"], 6, "both fingers");
    for key in ["bundle_hash", "dataset", "seed", "steps", "sampler", "made", "predicted_pixels"] {
        assert!(!report[key].is_null(), "{key}: {report}");
    }
    let stored: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    assert_eq!(stored["stats"], report["stats"]);

    let out = dir.path().join("out");
    let generate = ["generate", "demo", "--limit", "1", "--out", out.to_str().unwrap(), "--json"];
    let refit = ["--shift", &format!("refit:{path}")];
    let done = succeed(&[&generate[..], &QUICK, &refit].concat(), dir.path());
    assert!(json(&done)["pairs"][0]["psnr_db"].is_number());

    // Another bundle's statistics are refused, and both are named.
    let other = report["bundle_hash"].as_str().unwrap();
    let text = std::fs::read_to_string(&file).unwrap().replace(other, &"0f".repeat(32));
    std::fs::write(&file, text).unwrap();
    let refused = run(&[&generate[..], &QUICK, &refit].concat(), dir.path());
    let said = error_text(&refused);
    assert!(!refused.status.success() && said.contains("0f0f0f0f0f0f") && said.contains(&other[..12]), "{said}");
    let without = run(&[&generate[..], &QUICK, &["--shift", "refit"]].concat(), dir.path());
    assert!(!without.status.success() && error_text(&without).contains("touch2touch stats"));
}
