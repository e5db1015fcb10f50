//! The training of the mask model in the studio: by clicks, to the same bundle as by the verb, in use without a restart.

use std::path::Path;

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{LabelsCommand, LearnCommand, LibraryCommand};
use touch2touch::app::learn::{LearnForm, Network};
use touch2touch::app::library::Place;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;
use touch2touch::app::tasks::TaskKind;
use touch2touch::app::{learn, recipe};
use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::sim;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::simulated::{Layout, write_pair, write_tools};
use touch2touch_pipeline::labels::{Labels, Review};
use touch2touch_pipeline::learn::train::TrainChoice;
use touch2touch_pipeline::steps::bundles::BundleKind;

use super::rig::Rig;
use crate::support::run;
use crate::training::{bytes, corrected};

#[test]
fn the_mask_model_is_trained_by_a_click_to_the_verbs_bundle_and_taken_into_use() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    corrected(&data, 3);
    let Some(mut rig) = Rig::live([1280.0, 800.0], Place::Path(data.clone())) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(LearnCommand::Show(Network::Masks));
    let choice = TrainChoice { held_out_percent: 34, ..TrainChoice::default() };
    rig.send(LearnCommand::SetForm(LearnForm { choice, by_steps: true, steps: 12, ..LearnForm::default() }));
    rig.settle();
    // What it would learn from is said first.
    rig.harness.get_by_label_contains("to learn from: 8 masks of 4 pairs");
    rig.harness.get_by_label_contains("left out for the score: 4 masks of 2 pairs");
    rig.harness.get_by_label_contains("8 masks are few");
    rig.shoot("train-before");
    let shipped = recipe::bundle(rig.harness.state().state(), BundleKind::Mask).unwrap().clone();

    rig.harness.get_by_label("Start training").click();
    rig.harness.step();
    while rig.harness.state().state().tasks.of_kind(TaskKind::Learn).is_some() {
        std::thread::sleep(std::time::Duration::from_millis(50));
        rig.harness.step();
    }
    rig.settle();
    let state = rig.harness.state().state();
    let found = state.learn.trained.clone().expect("the training is there");
    assert_eq!((found.masks, found.pairs, found.steps, found.held_out.len()), (8, 4, 12, 4), "{found:?}");
    assert!(found.curves.iter().any(|curve| curve.unit == "Dice") && found.before.is_some());
    let trained = learn::made(state, Network::Masks).expect("its bundle is among the others").clone();
    assert!(trained.trained && trained.id != shipped.id && trained.name == found.name);
    // In use at once, unless it is worse on what was left out.
    let now = recipe::bundle(state, BundleKind::Mask).unwrap().id.clone();
    assert_eq!(now, if found.is_worse() { shipped.id.clone() } else { trained.id.clone() });
    assert!(state.log.entries.iter().any(|entry| entry.text.starts_with("Trained: ")));
    rig.harness.get_by_label_contains("mean of 4");
    rig.shoot("train-after");
    if found.is_worse() {
        rig.harness.get_by_label("Use the trained model").click();
        rig.harness.step();
        rig.settle();
    }
    assert!(learn::in_use(rig.harness.state().state(), Network::Masks));
    rig.harness.get_by_label("in use");

    // The verb makes the same bundle to the last bit.
    let out = folder.path().join("by-verb");
    let [path, out_text] = [&data, &out].map(|path| path.to_str().unwrap());
    let verb = ["masks", "train", path, "--held-out", "34", "--steps", "12", "--no-cache", "--out", out_text];
    let made = run(&verb, folder.path());
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert!(bytes(&out) == bytes(&found.bundle));
}

/// Nine pairs marked done, all of a folder that is kept for tests: the true reason, and the tick that cures it.
#[test]
fn nothing_to_learn_from_has_its_reason_and_its_tick() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    for_tests(&data, 2);
    let Some(mut rig) = Rig::live([1280.0, 800.0], Place::Path(data.clone())) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    // Nobody looked at anything: masks can come from CAD all the same.
    rig.send(LearnCommand::Show(Network::Masks));
    rig.harness.get_by_label_contains("no mask was corrected or accepted");
    rig.harness.get_by_label("Take masks from CAD");
    rig.shoot("train-nothing");
    // Done on a right automatic mask accepts it, on both fingers where both are looked at.
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    for pair in 0..2 {
        rig.send(LibraryCommand::Select(PairId(pair)));
        rig.send(LibraryCommand::DoneAndNext);
    }
    let labels = Labels::of(&Dataset::open(&data).unwrap());
    let state = rig.harness.state().state();
    let names: Vec<String> = state.library.pairs().iter().map(|entry| entry.name.clone()).collect();
    for name in &names {
        let stored = labels.load(name).unwrap();
        assert_eq!((stored.review, stored.masks.len()), (Review::Done, 2), "{name}");
        assert!(stored.masks.values().all(|mask| mask.base().starts_with("Accepted")), "{name}");
    }
    rig.send(LearnCommand::Show(Network::Masks));
    rig.harness.get_by_label_contains("all pairs with masks to train on are reserved for tests (2 pairs, 4 masks)");
    rig.harness.get_by_label("Train on pairs reserved for tests").click();
    rig.harness.step();
    rig.settle();
    assert!(rig.harness.state().state().learn.form.choice.test_in_train);
    rig.harness.get_by_label_contains("to learn from: 2 masks of 1 pair");
    rig.shoot("train-cured");
    // One undo takes mark and masks back, where they are looked at.
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(LibraryCommand::Select(PairId(0)));
    rig.send(LabelsCommand::Undo);
    let stored = labels.load(&names[0]).unwrap();
    assert!(stored.masks.is_empty() && stored.review == Review::Todo, "{stored:?}");

    // The verb accepts the same masks.
    let path = data.to_str().unwrap();
    let by_studio = labels.load(&names[1]).unwrap();
    let home = folder.path();
    for review in ["todo", "done"] {
        assert!(run(&["label", path, "--pair", &names[1], "--remove-mask", "--review", review], home).status.success());
        let words = ["label", path, "--pair", &names[1], "--review", review];
        assert!(run(&words, home).status.success());
    }
    let by_verb = Labels::of(&Dataset::open(&data).unwrap()).load(&names[1]).unwrap();
    assert_eq!(by_verb.masks.len(), 2);
    for (place, mask) in &by_studio.masks {
        assert!(by_verb.masks[place].is_same(mask), "{place:?}");
    }
}

/// Simulated grasps of one tool in the folder that the lab keeps for tests; nobody labeled them.
fn for_tests(root: &Path, grasps: u64) {
    let tool = &catalog::tools()[0];
    for index in 0..grasps {
        let sample = sim::simulate(tool, sim::random_grasp(index + 3), index, &sim::SimConfig::default());
        write_pair(root, Layout::Test, &tool.name, index, &sample).unwrap();
    }
    write_tools(root, &[(tool.name.as_str(), false, tool.mesh())]).unwrap();
}
