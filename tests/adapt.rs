//! `adapt` as a user runs it: on simulated grasps, on pictures of a rig with known faults, and on the lab's real pairs.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use serde_json::Value;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::Grid;
use touch2touch_pipeline::error::TaskErrorKind;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::job::{Cancel, JobCx, Progress};
use touch2touch_pipeline::learn::adapt::{AdaptSetup, Tuning, adapt};
use touch2touch_pipeline::steps::bundles::{BundleKind, find};
use touch2touch_pipeline::steps::models::Models;
use touch2touch_pipeline::steps::recipe::Recipe;

use crate::cli_generate::full_size_bundle;
use crate::support::{cancelled_when, error_text, json, run, shared, simulate};

/// Pairs of pictures: a touch somewhere, seen by the lights of a GelSlim, and its imprint, moved and under a pattern.
fn pictures(folder: &Path, count: usize) {
    std::fs::create_dir_all(folder).unwrap();
    for i in 0..count {
        let at = [40.0 + (i * 37 % 48) as f64, 44.0 + (i * 23 % 40) as f64];
        let height = |x: f64, y: f64, [cx, cy]: [f64; 2]| (-((x - cx).powi(2) + 2.0 * (y - cy).powi(2)) / 180.0).exp();
        let slope = |x: usize, y: usize| {
            let (x, y) = (x as f64, y as f64);
            [height(x + 1.0, y, at) - height(x - 1.0, y, at), height(x, y + 1.0, at) - height(x, y - 1.0, at)]
        };
        let lights = [-1.12f64, std::f64::consts::PI, 1.05].map(|a| [a.cos(), a.sin()]);
        let gelslim = Grid::from_fn(128, 128, |x, y| {
            let [p, q] = slope(x, y);
            lights.map(|[u, v]| (128.0 + 300.0 * (u * p + v * q)).clamp(1.0, 254.0) as f32)
        });
        let there = [at[0] + 5.0, at[1] - 3.0];
        let bubble = Grid::from_fn(128, 128, |x, y| {
            (60.0 + 150.0 * height(x as f64, y as f64, there) + 3.0 * ((x * 5 + y * 3) % 4) as f64) as f32
        });
        let name = |kind: &str| folder.join(format!("{i:02}_{kind}.png"));
        images::write_rgb8(&name("gelslim"), &gelslim).unwrap();
        images::write_rgb8(&name("bubble"), &bubble.map(|v| [*v; 3])).unwrap();
    }
}

#[test]
fn a_fit_is_scored_on_what_was_left_out_and_becomes_a_bundle_of_its_own() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = full_size_bundle(dir.path());
    let (set, out) = (dir.path().join("set"), dir.path().join("fitted"));
    pictures(&set, 12);
    let [set, out, bundle] = [&set, &out, &bundle].map(|p| p.to_str().unwrap());
    let adapt = |more: &[&str]| {
        let fixed = ["adapt", set, "--bundle", bundle, "--runtime", "rten", "--json"];
        run(&[&fixed[..], more].concat(), dir.path())
    };
    let tried = json(&adapt(&[]));
    assert!(tried["bundle"].is_null() && !Path::new(out).exists());
    // The tiny generator draws the same whatever it sees, which is said of its fit.
    let refused = adapt(&["--out", out]);
    assert!(
        !refused.status.success() && error_text(&refused).contains("do not match their own"),
        "{}",
        error_text(&refused)
    );
    assert!(!Path::new(out).exists());
    let made = json(&adapt(&["--out", out, "--force"]));
    assert_eq!((&made["pairs"], &made["touches"], &made["bundle"]), (&12.into(), &12.into(), &out.into()));
    let db = |which: &str, key: &str| made[which][key].as_f64().unwrap();
    for key in ["psnr_db", "psnr_raw_db", "psnr_line_db"] {
        // The tiny generator draws hardly more than noise: its shape gains least.
        let gain = if key == "psnr_line_db" { 0.3 } else { 1.0 };
        assert!(db("closed_form", key) > db("before", key) + gain, "{key}: {made:#}");
    }
    assert!(made["after"].is_null() && made["steps"] == 0 && made["peak_mib"] != 0, "{made:#}");
    // Trying again is the same to the last bit, and the source is as it was.
    assert_eq!(made["closed_form"], tried["closed_form"]);
    // The new bundle predicts what was scored, and without its fit what the source does.
    let generate = |bundle: &str, more: &[&str]| {
        let to = dir.path().join("pictures");
        let fixed = ["generate", set, "--out", to.to_str().unwrap(), "--runtime", "rten", "--json", "--bundle"];
        json(&run(&[&fixed[..], &[bundle], more].concat(), dir.path()))["mean"].clone()
    };
    let (source, fitted) = (generate(bundle, &[]), generate(out, &[]));
    let raw = |mean: &Value| mean["psnr_raw_db"].as_f64().unwrap();
    let unfitted = generate(out, &["--shift", "exact:none"]);
    assert_eq!(raw(&unfitted), raw(&source), "{source} {unfitted}");
    assert!(raw(&fitted) > raw(&source) + 1.0, "{source} {fitted}");
    let part = generate(out, &["--shift", "exact:offset,field"]);
    assert!(raw(&part) > raw(&source) && raw(&part) < raw(&fitted), "{part}");
    // The source is not overwritten, nor is a folder with something else in it.
    for (folder, why) in [(bundle, "stays as it is"), (set, "holds other files")] {
        let refused = adapt(&["--out", folder]);
        assert!(!refused.status.success() && error_text(&refused).contains(why), "{}", error_text(&refused));
    }
    assert_eq!(json(&adapt(&["--out", out, "--force"]))["bundle"], out, "a fit may be made again");
    let twice = run(&["adapt", set, "--bundle", out, "--runtime", "rten", "--json"], dir.path());
    assert!(
        error_text(&twice).contains("was fitted already") && error_text(&twice).contains("made from"),
        "{}",
        error_text(&twice)
    );
    // A damaged fit is a damaged bundle.
    std::fs::write(Path::new(out).join("fit.npz"), b"no archive").unwrap();
    let broken = run(&["generate", set, "--out", set, "--bundle", out, "--runtime", "rten"], dir.path());
    assert!(
        error_text(&broken).contains("fit.npz") && error_text(&broken).contains("SHA-256"),
        "{}",
        error_text(&broken)
    );
}

#[test]
fn poor_pairs_are_left_out_or_pointed_at_in_plain_words() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = full_size_bundle(dir.path());
    let set = dir.path().join("set");
    pictures(&set, 13);
    let [root, bundle] = [&set, &bundle].map(|p| p.to_str().unwrap());
    let adapt = |more: &[&str]| {
        let fixed = ["adapt", root, "--bundle", bundle, "--runtime", "rten", "--json"];
        run(&[&fixed[..], more].concat(), dir.path())
    };
    let few = adapt(&["--pairs", "01,02,03"]);
    assert!(json(&few)["pairs"] == 3 && error_text(&few).contains("3 pairs are few"), "{}", error_text(&few));
    let one = adapt(&["--pairs", "01"]);
    assert!(json(&one)["closed_form"].is_null(), "nothing can be left out of one pair: {}", error_text(&one));
    std::fs::write(set.join("07_bubble.png"), b"not a picture").unwrap();
    let found = json(&adapt(&[]));
    assert_eq!((found["left_out"][0]["name"].as_str(), &found["pairs"]), (Some("07"), &12.into()), "{found:#}");
    let none = adapt(&["--pairs", "nobody"]);
    assert!(!none.status.success() && error_text(&none).contains("nobody"), "{}", error_text(&none));
}

#[test]
fn measured_meters_are_fitted_too_and_other_data_are_warned_of() {
    let dir = tempfile::tempdir().unwrap();
    let bundle = full_size_bundle(dir.path());
    let (set, out, pairs) = (dir.path().join("set"), dir.path().join("fitted"), dir.path().join("pairs"));
    pictures(&pairs, 2);
    simulate(&set, "pattern_36,pattern_35", &["--grasps", "3", "--seed", "3"]);
    let [set, out, bundle, pairs] = [&set, &out, &bundle, &pairs].map(|p| p.to_str().unwrap());
    let fixed = [
        "adapt",
        set,
        "--bundle",
        bundle,
        "--runtime",
        "rten",
        "--json",
        "--mask",
        "threshold",
        "--out",
        out,
        "--force", // The tiny generator draws the same whatever it sees.
    ];
    let found = json(&run(&fixed, dir.path()));
    assert_eq!((&found["pairs"], &found["touches"]), (&6.into(), &12.into()), "{found:#}");
    assert_eq!(found["pads"].as_array().unwrap().len(), 2);
    let angle = |which: &str| found[which]["angle"]["count"].as_u64();
    assert_eq!((angle("before"), angle("closed_form")), (Some(6), Some(6)), "{found:#}");
    // By the registration that is asked for: one that may not look at all leaves no pose.
    let tried = [&fixed[..9], &["--engine", "distance_field:gate=0.05"]].concat();
    let strict = json(&run(&tried, dir.path()));
    assert_ne!(strict["before"]["angle"], found["before"]["angle"], "{strict:#}");
    let gain = found["closed_form"]["psnr_db"].as_f64().unwrap() - found["before"]["psnr_db"].as_f64().unwrap();
    assert!(gain > 1.0, "{found:#}");
    let to = dir.path().join("pictures");
    let other =
        run(&["generate", pairs, "--out", to.to_str().unwrap(), "--bundle", out, "--runtime", "rten"], dir.path());
    assert!(error_text(&other).contains("was fitted to 6 pairs"), "{}", error_text(&other));
}

#[test]
fn a_run_that_is_stopped_goes_on_to_the_same_last_bit() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    pictures(&set, 4);
    let dataset = Dataset::open(&set).unwrap();
    let bundle = find(&[]).take(BundleKind::Generator, None, &dataset.rig).unwrap();
    let info = bundle.generator.as_ref().unwrap();
    let setup = |unfinished: Option<PathBuf>| AdaptSetup {
        recipe: Recipe {
            generator: Some((bundle.clone().into(), GenerateConfig { steps: 2, ..info.defaults })),
            engine: EngineChoice::Rten,
            ..Recipe::default()
        },
        pairs: (0..4).map(PairId).collect(),
        folds: 2,
        tuning: Some(Tuning::Steps(2)),
        unfinished,
        out: None,
        force: false,
        replace: false,
    };
    let models = Models::new(None);
    let straight = adapt(&dataset, &setup(None), &models, &JobCx::unwatched()).unwrap();
    assert_eq!((straight.steps, straight.curves.len()), (2, 5), "{:?}", straight.curves);
    assert!(straight.warnings.iter().any(|w| w.contains("2 tuning steps are few")), "{:?}", straight.warnings);
    // Stopped in the run on all, between its steps.
    let kept = dir.path().join("unfinished");
    let stopping = cancelled_when(|progress| progress.total == 6 && progress.done >= 5);
    let stopped = adapt(&dataset, &setup(Some(kept.clone())), &models, &stopping);
    assert_eq!(stopped.unwrap_err().kind, TaskErrorKind::Cancelled);
    let seen = Arc::new(Mutex::new(Vec::new()));
    let sink = seen.clone();
    let watch = move |progress: Progress| {
        if progress.total == 6 {
            sink.lock().unwrap().push(progress.done);
        }
    };
    let again = JobCx::new(Cancel::default(), Arc::new(watch));
    let resumed = adapt(&dataset, &setup(Some(kept.clone())), &models, &again).unwrap();
    assert_eq!(*seen.lock().unwrap(), [6], "only the last step was made");
    assert_eq!((&resumed.curves, &resumed.held_back), (&straight.curves, &straight.held_back));
    assert_eq!(std::fs::read_dir(&kept).unwrap().count(), 0, "nothing is left of a finished run");
}

/// The recipe's own figures for the closed form, cross-validated on the lab's 36 real pairs: 24.2 dB.
#[test]
fn real_pairs_are_fitted_in_closed_form_as_well_as_the_recipe_says() {
    let Some(real) = shared("real-pairs") else { return };
    let dir = tempfile::tempdir().unwrap();
    let found = json(&run(&["adapt", real.to_str().unwrap(), "--json"], dir.path()));
    let closed = |key: &str| found["closed_form"][key].as_f64().unwrap();
    assert_eq!((&found["pairs"], found["pads"].as_array().unwrap().len()), (&36.into(), 2), "{found:#}");
    assert!(closed("psnr_db") > 24.1 && closed("psnr_line_db") > 25.7, "{found:#}");
    assert_eq!(found["doubtful"].as_array().unwrap().len(), 0, "{found:#}");
}
