//! Data that are stored wrongly and look right: the doctor says what is wrong, the verbs say it too, and they are read so for
//! good.

use std::path::Path;

use touch2touch_core::dataset::PairId;
use touch2touch_core::read_as::{Depths, ReadAs};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::simulated::{Layout, write_pair};

use super::{error_text, json};
use crate::support::{run, shared, simulated};

/// Writes every pair of a data set anew, stored wrongly.
fn store(set: &Path, mistake: ReadAs) {
    let dataset = Dataset::open(set).unwrap();
    for (id, entry) in (0u32..).zip(&dataset.index.pairs) {
        let wrong = ReadAs::all(&[mistake], &dataset.load(PairId(id)).unwrap());
        write_pair(set, Layout::Test, entry.tool.as_deref().unwrap(), entry.number, &wrong).unwrap();
    }
}

#[test]
fn fingers_that_were_swapped_are_said_by_every_verb_and_read_right_for_good() {
    let (dir, set) = simulated("pattern_33,pattern_37", &["--grasps", "2", "--seed", "4"]);
    let path = set.to_str().unwrap();
    let doctor =
        |words: &[&str]| json(&run(&[&["doctor", path, "--no-predictions", "--json"], words].concat(), dir.path()));
    let sound = doctor(&[]);
    assert!(sound["problems"] == serde_json::json!([]) && sound["read_as"].is_null(), "{sound}");
    let error = || {
        let done = run(&["pose", path, "--mask", "threshold", "--json"], dir.path());
        let notes = json(&done)["notes"].to_string();
        let mut errors: Vec<f64> = json(&done)["cases"]
            .as_array()
            .unwrap()
            .iter()
            .map(|case| case["error_deg"].as_f64().unwrap_or(90.0))
            .collect();
        errors.sort_by(f64::total_cmp);
        (errors[errors.len() / 2], notes)
    };
    let (right, notes) = error();
    assert!(right < 3.0 && !notes.contains("swapped"), "{right} {notes}");

    store(&set, ReadAs::SwapFingers(Depths::Imprints));
    let wrong = doctor(&[]);
    let said = wrong["problems"][0].to_string();
    assert!(
        said.contains("fingers are swapped") && said.contains("of 4 pairs") && said.contains("--set read-as="),
        "{wrong}"
    );
    let remedy = wrong["read_as"].as_str().unwrap().to_owned();
    assert!(remedy.ends_with("swap-fingers"), "{remedy}");
    let (off, notes) = error();
    assert!(off > 3.0 && notes.contains("fingers are swapped"), "{off} {notes}");
    // For good; then again as it is stored.
    let kept = run(&["doctor", path, "--set", &format!("read-as={remedy}")], dir.path());
    assert!(kept.status.success() && set.join("read-as.txt").is_file(), "{}", error_text(&kept));
    let (for_good, _) = error();
    assert!(for_good < 3.0, "{for_good}");
    let read = doctor(&[]);
    assert_eq!(read["problems"].as_array().map(Vec::len), Some(1), "that it is read so: {read}");
    assert!(read["problems"].to_string().contains("read as ") && read["read_as"].is_null(), "{read}");
    assert!(run(&["doctor", path, "--set", "read-as="], dir.path()).status.success());
    assert!(!set.join("read-as.txt").exists());
    std::fs::write(set.join("read-as.txt"), "swap-toes").unwrap();
    let refused = run(&["pose", path], dir.path());
    assert!(refused.status.code() == Some(2) && error_text(&refused).contains("swap-toes"), "{}", error_text(&refused));
}

/// Data that nobody spoilt, as PyTorch and cameras wrote them.
#[test]
fn real_data_raise_no_doubt() {
    for folder in ["lab-sample", "real-pairs"] {
        let Some(set) = shared(folder) else { continue };
        let dir = tempfile::tempdir().unwrap();
        let doctor = json(&run(&["doctor", set.to_str().unwrap(), "--json"], dir.path()));
        assert!(doctor["read_as"].is_null(), "{doctor}");
        assert!(!doctor["problems"].to_string().contains("do not lie on their CAD models"), "{doctor}");
    }
}
