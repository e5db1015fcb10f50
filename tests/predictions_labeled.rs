//! Masks drawn on a prediction, and poses accepted of it, are found by what decided that prediction, in the studio and by the verbs
//! alike.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;
use touch2touch::app::command::{Command, Pane, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::library::Place;
use touch2touch::app::results;
use touch2touch::app::runtime::Runtime;
use touch2touch::app::services::Services;
use touch2touch::app::settings::{GenerateSettings, Settings};
use touch2touch::app::state::State;
use touch2touch_core::diffusion::Sampler;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::steps::bundles;

use crate::cli_generate::full_size_bundle;
use crate::support::{copy_folder, edit_json, error_text, json, run, simulate};

/// A simulated pair with labels: a mask on the right finger's prediction (DDIM,
/// 2 steps, eta 0.1), an accepted pose of it, a note. And the bundle that predicted it.
fn labeled(dir: &Path) -> [PathBuf; 2] {
    let (set, bundle) = (dir.join("set"), full_size_bundle(dir));
    simulate(&set, "pattern_36", &["--grasps", "1", "--seed", "3"]);
    let id = bundles::open("test", bundle.as_path()).unwrap().id;
    let labels = set.join("touch2touch_masks");
    std::fs::create_dir(&labels).unwrap();
    for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/labels")).unwrap() {
        let file = entry.unwrap().path();
        let text = std::fs::read_to_string(&file).unwrap();
        // The tests' bundle has another identity wherever its manifest is written anew.
        let text = text.replace("3bba1b752350ca0aed061dfaaba2ef551efc19ed9d429e04f4e79ed7dd4a188c", &id);
        std::fs::write(labels.join(file.file_name().unwrap()), text).unwrap();
    }
    [set, bundle]
}

/// How many other predictions a pose was accepted of, as the studio says; it shows a drawn mask and an accepted pose of the
/// one with seed 42.
fn in_studio(home: &Path, [set, bundle]: &[PathBuf; 2]) -> usize {
    let mut state = State::default();
    let services = Services::with_config_folder(Some(home.to_owned()));
    let settings = Settings {
        bundle_folders: vec![bundle.clone()],
        runtime: EngineChoice::Rten,
        generate: GenerateSettings {
            bundle: Some(bundles::open("test", bundle.as_path()).unwrap().name),
            preset: None,
            steps: 2,
            eta: 0.1,
            sampler: Sampler::Ddim,
            ..GenerateSettings::default()
        },
        ..Settings::default()
    };
    let file = home.join("settings.json");
    std::fs::write(&file, serde_json::to_vec(&settings).unwrap()).unwrap();
    let mut runtime = Runtime::inline(Arc::new(services));
    runtime.start(&mut state, Some(Place::Path(set.clone())));
    runtime.tick(&mut state, vec![Command::View(ViewCommand::ShowPanes([Pane::Predicted, Pane::Scene].into()))]);
    runtime.settle(&mut state);
    let shown = results::chosen(&state, lab::RIGHT).expect("it is predicted by itself");
    assert_eq!((shown.config.steps, shown.config.eta, results::outdated(&state, lab::RIGHT)), (2, 0.1, None));
    assert!(results::drawn_mask(&state, ImprintSource::Predicted, lab::RIGHT).is_some());
    assert!(results::by_hand(&state, ImprintSource::Predicted).is_some());
    results::accepted_elsewhere(&state).len()
}

#[test]
fn a_mask_on_a_prediction_is_found_by_what_decided_the_prediction() {
    let dir = tempfile::tempdir().unwrap();
    let places = labeled(dir.path());
    let [set, bundle] = places.each_ref().map(|path| path.to_str().unwrap());
    let choices = ["--runtime", "rten", "--steps", "2", "--eta", "0.1", "--sampler", "ddim"];
    let pose = |more: &[&str]| -> Value {
        let fixed = ["pose", set, "--imprint", "predicted", "--mask", "top_percent", "--bundle", bundle, "--json"];
        let done = run(&[&fixed[..], &choices, more].concat(), dir.path());
        json(&done)["cases"][0].clone()
    };
    let found = pose(&[]);
    assert_eq!(found["mask"], "hand, top_percent", "{found:#}");
    assert_eq!(found["accepted"]["by_hand"], true, "{found:#}");
    assert_eq!(pose(&["--seed", "7"])["mask"], "top_percent", "another prediction has its own");
    assert_eq!(in_studio(dir.path(), &places), 0);
}

/// A bundle of another name and note, written anew in another folder.
fn rebuilt(bundle: &Path, dir: &Path) -> PathBuf {
    let to = dir.join("rebuilt");
    copy_folder(bundle, &to);
    edit_json(&to.join("manifest.json"), |keys| {
        keys["name"] = "the same again".into();
        keys["provenance"] = serde_json::json!({"note": "written anew"});
    });
    to
}

#[test]
fn what_was_drawn_and_kept_under_a_bundle_is_found_when_it_was_written_anew() {
    let dir = tempfile::tempdir().unwrap();
    let [set, bundle] = labeled(dir.path());
    let again = rebuilt(&bundle, dir.path());
    let pose = |bundle: &Path| -> Value {
        let fixed = ["pose", set.to_str().unwrap(), "--imprint", "predicted", "--mask", "top_percent", "--json"];
        let choices = ["--runtime", "rten", "--steps", "2", "--eta", "0.1", "--sampler", "ddim"];
        let done = run(&[&fixed[..], &choices, &["--bundle", bundle.to_str().unwrap()]].concat(), dir.path());
        json(&done)["cases"][0].clone()
    };
    let rebuilt = pose(&again);
    assert_eq!(rebuilt["mask"], "hand, top_percent", "{rebuilt:#}");
    assert_eq!(in_studio(dir.path(), &[set.clone(), again]), 0);
}

#[test]
fn an_accepted_pose_is_of_one_prediction() {
    let dir = tempfile::tempdir().unwrap();
    let places = labeled(dir.path());
    let [set, bundle] = places.each_ref().map(|path| path.to_str().unwrap());
    let verb = |words: &[&str], seed: &str| -> Value {
        let choices = ["--runtime", "rten", "--steps", "2", "--eta", "0.1", "--sampler", "ddim", "--seed", seed];
        let done = run(&[words, &["--bundle", bundle, "--json"], &choices].concat(), dir.path());
        assert_eq!(done.status.code(), Some(0), "{}", error_text(&done));
        json(&done)
    };
    let y_mm = |seed: &str| {
        let report = verb(&["pose", set, "--imprint", "predicted", "--mask", "top_percent"], seed);
        report["cases"][0]["accepted"]["y_m"].as_f64().map(|y_m| (y_m * 1e3).round())
    };
    let name = "test_only/pattern_36_data_0";
    let first = y_mm("42");
    assert!(first.is_some() && y_mm("7").is_none(), "{first:?}");
    let accept = ["label", set, "--pair", name, "--accept", "predicted", "--pose", "3,4,5"];
    let stored = verb(&accept, "7")["pairs"][0]["accepted"].clone();
    assert_eq!(stored.as_array().map(Vec::len), Some(2), "{stored:#}");
    let own = y_mm("7");
    assert!(own.is_some() && own != first && y_mm("42") == first, "{own:?}");
    assert_eq!(in_studio(dir.path(), &places), 1);
    let withdraw = ["label", set, "--pair", name, "--withdraw", "predicted"];
    verb(&withdraw, "42");
    assert_eq!([y_mm("42"), y_mm("7")], [None, own]);
    let refused = run(&[&withdraw[..], &["--bundle", bundle, "--steps", "2", "--seed", "9"]].concat(), dir.path());
    let why = error_text(&refused);
    assert!(!refused.status.success() && why.contains("seed 9") && why.contains("seed 7"), "{why}");
}
