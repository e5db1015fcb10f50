//! The verbs of the depth chain: `ledger`, `stats`, and the shift made from them.

use serde_json::Value;

use super::{error_text, json, run};

/// The demo with two steps on the built-in engine.
const QUICK: [&str; 4] = ["--steps", "2", "--runtime", "rten"];

#[test]
fn the_ledger_of_a_pair_has_every_stage_and_its_pictures() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("pictures");
    let pair = ["ledger", "--input", "demo", "--pair", "pattern_36/data_0", "--json"];
    let done = run(&[&pair[..], &QUICK, &["--out", out.to_str().unwrap()]].concat(), dir.path());
    assert!(done.status.success(), "{}", error_text(&done));
    let report = json(&done);
    let stages = report["stages"].as_array().unwrap();
    let names: Vec<&str> = stages.iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert!(names.starts_with(&["Decoder channel 1"]), "{names:?}");
    assert!(
        names.ends_with(&["Channels to one", "De-normalized", "Shift", "Placed", "Resized", "Rotated"]),
        "{names:?}"
    );
    for stage in stages {
        let pixels: u64 = stage["size"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).product();
        let counted: u64 = stage["histogram"]["counts"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).sum();
        assert_eq!(counted + stage["invalid"].as_u64().unwrap(), pixels, "{}", stage["name"]);
        assert!(stage["stats"]["std"].as_f64().unwrap() > 0.0 && !stage["how"].as_str().unwrap().is_empty());
    }
    let against = &report["against_truth"];
    assert!(against["line"]["slope"].is_number() && against["correlation"]["turned_180"].is_number());
    let joint = &against["joint"];
    let counts = joint["counts"].as_array().unwrap();
    assert_eq!(counts.len() as u64, joint["bins"].as_u64().unwrap());
    let of = |row: &Value| row.as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).sum::<u64>();
    assert_eq!(counts.iter().map(of).sum::<u64>(), against["pixels"].as_u64().unwrap());
    assert!(report["readings"].as_array().unwrap().len() >= 3 && report["ambiguity"]["kind"].is_string());
    let pictures = std::fs::read_dir(&out).unwrap().count();
    assert_eq!(pictures, stages.len() + 1, "one of every stage, and the joint histogram");

    // Read raw, the doubled mapping is flagged; read as it is meant, it is not.
    let raw = run(&[&pair[..], &QUICK, &["--shift", "raw"]].concat(), dir.path());
    let flags = json(&raw)["flags"].clone();
    assert_eq!(flags[0]["kind"], "doubled_mapping", "{flags}");
    for key in ["severity", "stage", "what", "why", "action"] {
        assert!(flags[0][key].as_str().is_some_and(|text| text.len() > 4), "{key}: {flags}");
    }
    let correct = run(&[&pair[..], &QUICK, &["--mapping", "correct"]].concat(), dir.path());
    let report = json(&correct);
    assert_eq!(report["shift"], "Correct mapping");
    assert!(report["flags"].as_array().unwrap().iter().all(|f| f["kind"] != "doubled_mapping"));
    let vague = run(&["ledger", "--input", "demo", "--pair", "pattern"], dir.path());
    assert!(!vague.status.success() && error_text(&vague).contains("say more of the name"));
}

#[test]
fn statistics_are_written_once_and_serve_their_bundle_only() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("stats.json");
    let path = file.to_str().unwrap();
    let stats = ["stats", "--input", "demo", "--limit", "3", "--out", path, "--json"];
    let done = run(&[&stats[..], &QUICK].concat(), dir.path());
    assert!(done.status.success(), "{}", error_text(&done));
    let report = json(&done);
    assert_eq!(report["touches"], 6, "both fingers");
    for key in ["bundle_hash", "dataset", "seed", "steps", "sampler", "made", "predicted_pixels"] {
        assert!(!report[key].is_null(), "{key}: {report}");
    }
    let stored: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    assert_eq!(stored["stats"], report["stats"]);

    let out = dir.path().join("out");
    let generate = ["generate", "--input", "demo", "--limit", "1", "--out", out.to_str().unwrap(), "--json"];
    let refit = ["--shift", "refit", "--stats", path];
    let done = run(&[&generate[..], &QUICK, &refit].concat(), dir.path());
    assert!(done.status.success(), "{}", error_text(&done));
    let pair = &json(&done)["pairs"][0];
    for part in ["seen", "invented"] {
        for key in ["pixels", "psnr_db", "ssim", "mae_m", "bias_m"] {
            assert!(pair[part][key].is_number(), "{part} {key}: {pair}");
        }
    }
    assert!(pair["ambiguity"]["kind"].is_string());
    let ledger = ["ledger", "--input", "demo", "--pair", "pattern_36/data_0", "--json"];
    let done = run(&[&ledger[..], &QUICK, &refit].concat(), dir.path());
    assert_eq!(json(&done)["shift"], "Refit on this data set", "{}", error_text(&done));

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
