//! The program as it is handed on: one file, on a machine that has nothing else of ours.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::support::json;

/// Runs a copy of the program that lies alone in `home`, with nothing of this machine's settings.
fn alone(home: &Path, args: &[&str]) -> Output {
    let copy = home.join("touch2touch");
    if !copy.exists() {
        let program = Path::new(env!("CARGO_BIN_EXE_touch2touch"));
        std::fs::hard_link(program, &copy).or_else(|_| std::fs::copy(program, &copy).map(drop)).unwrap();
    }
    Command::new(copy).args(args).current_dir(home).env_clear().env("HOME", home).output().unwrap()
}

#[test]
fn a_copied_program_predicts_and_poses_the_demo() {
    let home = tempfile::tempdir().unwrap();
    let generate = ["generate", "demo", "--limit", "1", "--runtime", "rten", "--out", "out", "--json"];
    let report = json(&alone(home.path(), &generate));
    assert!(report["mean"]["psnr_db"].as_f64().unwrap() > 15.0, "{report}");
    let pose =
        ["pose", "demo", "--limit", "1", "--imprint", "predicted", "--mask", "unet", "--runtime", "rten", "--json"];
    let report = json(&alone(home.path(), &pose));
    assert!(report["cases"][0]["error_deg"].as_f64().unwrap().abs() < 10.0, "{report}");
    let check = alone(home.path(), &["bundle", "check", "built-in:generator_ldm", "--json"]);
    assert_eq!(json(&check)["problems"], Value::Array(Vec::new()));
    let absent = alone(home.path(), &["bundle", "check", "built-in:absent"]);
    assert!(!absent.status.success() && String::from_utf8_lossy(&absent.stdout).contains("cannot be read"));
}
