//! Fits to data that are wrong in one way are refused, those to sound data are not: `adapt` on simulated grasps that are
//! spoilt before they are fitted.

use std::path::{Path, PathBuf};

use serde_json::Value;
use touch2touch_core::dataset::PairId;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::pt::{PtItem, Tensor, read_dict, write_dict};

use crate::support::{error_text, run, simulate};

/// The files of all pairs: GelSlim, then bubble.
fn pairs(set: &Path) -> Vec<[PathBuf; 2]> {
    let dataset = Dataset::open(set).unwrap();
    let all = 0..dataset.index.pairs.len() as u32;
    all.map(|id| <[PathBuf; 2]>::try_from(dataset.pair_files(PairId(id))).unwrap()).collect()
}

/// Writes a file anew with one array changed.
fn change(file: &Path, key: &str, change: impl Fn(&mut [f32])) {
    let dict = read_dict(file).unwrap();
    let keys = dict.keys();
    let items: Vec<(&str, PtItem)> = keys
        .iter()
        .map(|name| {
            let tensor = dict.tensor(name).unwrap();
            let tensor = if name == key {
                let shape = tensor.shape.clone();
                let mut values = tensor.into_f32();
                change(&mut values);
                Tensor::f32(&shape, values)
            } else {
                tensor
            };
            (name.as_str(), PtItem::from(tensor))
        })
        .collect();
    write_dict(file, &items).unwrap();
}

fn swap_halves(values: &mut [f32]) {
    let half = values.len() / 2;
    values.rotate_left(half);
}

/// One way to spoil a data set, and a part of what is then said.
type Spoiling = (&'static str, fn(&Path), &'static [&'static str]);

const SPOILT: [Spoiling; 2] = [
    ("fingers swapped", |set| each_bubble(set, swap_halves), &["fingers are swapped"]),
    ("GelSlims of other pairs", other_gelslims, &["do not match their own imprints"]),
];

const TOOLS: &str = "pattern_36,pattern_35,pattern_37";

fn each_bubble(set: &Path, spoil: impl Fn(&mut [f32])) {
    for [_, bubble] in pairs(set) {
        change(&bubble, "bubble_imprint", &spoil);
    }
}

fn other_gelslims(set: &Path) {
    let gelslims: Vec<PathBuf> = pairs(set).into_iter().map(|[gelslim, _]| gelslim).collect();
    let images: Vec<[Vec<f32>; 2]> = gelslims
        .iter()
        .map(|file| {
            let dict = read_dict(file).unwrap();
            ["gelslim", "gelslim_ref"].map(|key| dict.tensor(key).unwrap().into_f32())
        })
        .collect();
    for (i, file) in gelslims.iter().enumerate() {
        let other = &images[(i + 3) % images.len()];
        change(file, "gelslim", |values| values.clone_from_slice(&other[0]));
        change(file, "gelslim_ref", |values| values.clone_from_slice(&other[1]));
    }
}

/// `adapt --out`, with the shipped generator in two steps.
fn adapt(dir: &Path, set: &Path, out: &Path) -> (std::process::Output, Value) {
    let [set, out] = [set, out].map(|p| p.to_str().unwrap());
    let ran = run(&["adapt", set, "--out", out, "--steps", "2", "--json"], dir);
    let json = serde_json::from_slice(&ran.stdout).unwrap_or(Value::Null);
    (ran, json)
}

#[test]
fn a_fit_to_spoilt_data_is_refused_and_one_to_sound_data_is_written() {
    let dir = tempfile::tempdir().unwrap();
    for (name, spoil, reasons) in SPOILT {
        let set = dir.path().join(name);
        simulate(&set, TOOLS, &["--grasps", "2", "--seed", "5"]);
        spoil(&set);
        let out = dir.path().join(format!("fitted to {name}"));
        let (ran, found) = adapt(dir.path(), &set, &out);
        let objections = found["objections"].to_string();
        assert!(reasons.iter().any(|reason| objections.contains(reason)), "{name}: {objections} {}", error_text(&ran));
        assert!(found["bundle"].is_null() && !out.exists(), "{name}: {found:#}");
        assert_eq!(ran.status.code(), Some(1), "{name}");
        assert!(error_text(&ran).contains("against this fit"), "{name}: {}", error_text(&ran));
        if name == "fingers swapped" {
            assert!(
                run(&["doctor", set.to_str().unwrap(), "--set", "read-as=swap-fingers"], dir.path()).status.success()
            );
            let (ran, found) = adapt(dir.path(), &set, &out);
            assert!(found["bundle"].is_string() && out.is_dir(), "read rightly it is fitted: {}", error_text(&ran));
        }
    }
    // Bubbles that grasped elsewhere than the GelSlims pull a good model away from the poses.
    let set = dir.path().join("misaligned");
    simulate(&set, TOOLS, &["--grasps", "2", "--seed", "5", "--condition", "misaligned"]);
    let (ran, found) = adapt(dir.path(), &set, &dir.path().join("fitted to misaligned"));
    assert!(found["objections"].to_string().contains("in-hand angle gets worse"), "misaligned: {}", error_text(&ran));
}
