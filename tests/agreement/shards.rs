//! A run in parts: merged, they are what one run prints, whatever their number.

use std::path::Path;

use serde_json::Value;
use touch2touch_core::dataset::PairId;
use touch2touch_work::io::dataset::Dataset;

use super::{json, lab_folder};
use crate::support::{command, run};

/// A value without what no two runs share: times, and whether a prediction was kept.
fn timeless(mut value: Value) -> Value {
    match &mut value {
        Value::Object(map) => {
            for key in ["seconds", "ms", "median_ms", "kept"] {
                map.remove(key);
            }
            map.values_mut().for_each(|part| *part = timeless(part.take()));
        }
        Value::Array(parts) => parts.iter_mut().for_each(|part| *part = timeless(part.take())),
        _ => {}
    }
    value
}

/// Runs a verb in parts and merges them, in another order.
fn merged(words: &[&str], of: usize, home: &Path) -> Value {
    let part = |at: usize| {
        let share = format!("{at}/{of}");
        let output = run(&[words, &["--shard", &share, "--json"]].concat(), home);
        let file = home.join(format!("part-{at}.json"));
        std::fs::write(&file, &output.stdout).unwrap();
        file.display().to_string()
    };
    let mut files: Vec<String> = (1..=of).map(part).collect();
    files.reverse();
    let words: Vec<&str> = std::iter::once("merge").chain(files.iter().map(String::as_str)).collect();
    json(&words, home)
}

#[test]
pub(super) fn parts_of_a_run_are_merged_to_what_one_run_prints() {
    let home = tempfile::tempdir().unwrap();
    let lab = lab_folder(home.path());
    // A bubble without its GelSlim: every part notes it when it opens the data set, and the whole once.
    let lonely = Dataset::open(&lab).unwrap().gelslim_file(PairId(2)).unwrap();
    std::fs::remove_file(lonely).unwrap();
    let path = lab.to_str().unwrap();
    let [one, parts] = ["one", "parts"].map(|name| home.path().join(name).display().to_string());
    for (words, of) in [
        (vec!["pose", path, "--imprint", "both", "--engine", "all"], 2),
        (vec!["pose", "demo", "--limit", "4", "--imprint", "measured"], 5),
    ] {
        let (whole, merged) = (json(&words, home.path()), merged(&words, of, home.path()));
        let is_noted = !merged["notes"].as_array().unwrap().is_empty();
        assert_eq!(is_noted, words[1] == path, "{merged}");
        assert_eq!(timeless(merged), timeless(whole), "{words:?} in {of}");
    }
    let words = |out: &str| ["generate", path, "--finger", "both", "--out", out].map(str::to_owned);
    let own = |out: &str| words(out).to_vec();
    let (whole, all) = (own(&one), own(&parts));
    let [whole, all] = [&whole, &all].map(|words| words.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(timeless(merged(&all, 2, home.path())), timeless(json(&whole, home.path())));
    let files = |folder: &str| {
        let names = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.filter(|name| !name.ends_with(".json")).collect();
        names.sort();
        names.into_iter().map(|name| (std::fs::read(Path::new(folder).join(&name)).unwrap(), name)).collect::<Vec<_>>()
    };
    assert_eq!(files(&one), files(&parts));
}

#[test]
pub(super) fn masks_are_proposed_in_parts_as_at_once() {
    let [home, other] = [0; 2].map(|_| tempfile::tempdir().unwrap());
    let words = |lab: &str| ["masks", "propose", lab, "--source", "cad_truth", "--person", "Ada"].map(str::to_owned);
    let [one, parts] = [&home, &other].map(|home| words(lab_folder(home.path()).to_str().unwrap()));
    let [one, parts] = [&one, &parts].map(|words| words.iter().map(String::as_str).collect::<Vec<_>>());
    let whole = json(&one, home.path());
    // More parts than pairs: some have nothing to do.
    assert_eq!(timeless(merged(&parts, 4, other.path())), timeless(whole));
    let masks = |home: &Path| {
        let set = home.join("lab").display().to_string();
        let mut listed = json(&["label", &set], home);
        listed["folder"].take();
        listed
    };
    assert_eq!(masks(other.path()), masks(home.path()));
}

#[test]
pub(super) fn an_evaluation_finds_what_its_parts_have_kept() {
    let [home, other] = [0; 2].map(|_| tempfile::tempdir().unwrap());
    let words = ["evaluate", "demo", "--resamples", "20", "--pairs"];
    // The demo has more pairs than a test needs: its first tool alone, as a data set of its own.
    let lab = lab_folder(home.path()).display().to_string();
    let words = words.map(|word| if word == "demo" { lab.as_str() } else { word });
    let one = json(&words, other.path());
    for share in ["1/2", "2/2"] {
        let part = json(&[&words[..], &["--shard", share]].concat(), home.path());
        assert!(part["rows"].as_array().is_some_and(|rows| !rows.is_empty()), "{share}");
    }
    let whole = json(&words, home.path());
    for part in ["rows", "pairs", "groups"] {
        assert_eq!(timeless(whole[part].clone()), timeless(one[part].clone()), "{part}");
    }
}

#[test]
fn what_is_no_whole_run_is_not_merged() {
    let home = tempfile::tempdir().unwrap();
    let part = |share: &str, limit: &str| {
        let file = home.path().join(format!("{}-{limit}.json", share.replace('/', "-")));
        let output = run(&["pose", "demo", "--limit", limit, "--shard", share, "--json"], home.path());
        std::fs::write(&file, output.stdout).unwrap();
        file.display().to_string()
    };
    let (first, second, other) = (part("1/2", "2"), part("2/2", "2"), part("2/2", "3"));
    let whole = home.path().join("whole.json").display().to_string();
    std::fs::write(&whole, run(&["pose", "demo", "--limit", "1", "--json"], home.path()).stdout).unwrap();
    for (files, why) in [
        (vec![&first], "part 2 of 2 is missing"),
        (vec![&second], "part 1 of 2 is missing"),
        (vec![&first, &first, &second], "part 1 is there twice"),
        (vec![&first, &other], "of another run"),
        (vec![&whole], "no part of a run"),
    ] {
        let words: Vec<&str> = std::iter::once("merge").chain(files.into_iter().map(String::as_str)).collect();
        let output = command(&words, home.path()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(why), "{said}");
    }
    let text = run(&["merge", &first, &second], home.path());
    assert!(String::from_utf8_lossy(&text.stdout).contains("registration/imprint"));
    assert!(!run(&["pose", "demo", "--shard", "1/2"], home.path()).status.success(), "parts are JSON objects");
}
