//! The training of the mask model in the studio: by clicks, to the same bundle as by the verb, in use without a restart.

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
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::simulated::Layout;
use touch2touch_pipeline::labels::{Labels, Review};
use touch2touch_pipeline::learn::train::TrainChoice;
use touch2touch_pipeline::steps::bundles::BundleKind;

use super::rig::Rig;
use crate::support::write_grasps;
use crate::training::corrected;

#[test]
fn the_mask_model_is_trained_by_a_click_to_the_verbs_bundle_and_taken_into_use() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    corrected(&data, 3);
    let Some(mut rig) = Rig::live([1280.0, 800.0], Place::Path(data.clone())) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(LearnCommand::Show(Network::Masks));
    let choice = TrainChoice { held_out_percent: 34, ..TrainChoice::default() };
    rig.send(LearnCommand::SetForm(LearnForm { choice, by_steps: true, steps: 3, ..LearnForm::default() }));
    rig.settle();
    // What it would learn from is said first.
    rig.harness.get_by_label_contains("to learn from: 8 masks of 4 pairs");
    rig.harness.get_by_label_contains("left out for the score: 4 masks of 2 pairs");
    rig.harness.get_by_label_contains("8 masks are few");
    let shipped = recipe::bundle(rig.state(), BundleKind::Mask).unwrap().clone();

    rig.harness.get_by_label("Start training").click();
    rig.harness.step();
    while rig.state().tasks.of_kind(TaskKind::Learn).is_some() {
        std::thread::sleep(std::time::Duration::from_millis(50));
        rig.harness.step();
    }
    rig.settle();
    let state = rig.state();
    let found = state.learn.trained.clone().expect("the training is there");
    assert_eq!((found.masks, found.pairs, found.steps, found.held_out.len()), (8, 4, 3, 4), "{found:?}");
    assert!(found.curves.iter().any(|curve| curve.unit == "Dice") && found.before.is_some());
    let trained = learn::made(state, Network::Masks).expect("its bundle is among the others").clone();
    assert!(trained.trained && trained.id != shipped.id && trained.name == found.name);
    // In use at once, unless it is worse on what was left out.
    let now = recipe::bundle(state, BundleKind::Mask).unwrap().id.clone();
    assert_eq!(now, if found.is_worse() { shipped.id.clone() } else { trained.id.clone() });
    assert!(state.log.entries.iter().any(|entry| entry.text.starts_with("Trained: ")));
    rig.harness.get_by_label_contains("mean of 4");
    if found.is_worse() {
        rig.click("Use the new model");
    }
    assert!(learn::in_use(rig.state(), Network::Masks));
    rig.harness.get_by_label("in use");
}

/// Nine pairs marked done, all of a folder that is kept for tests: the true reason, and the tick that cures it.
#[test]
fn nothing_to_learn_from_has_its_reason_and_its_tick() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    // The folder that the lab keeps for tests; nobody labeled them.
    write_grasps(&data, Layout::Test, &catalog::tools()[..1], 2);
    let Some(mut rig) = Rig::live([1280.0, 800.0], Place::Path(data.clone())) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    // Nobody looked at anything: masks can come from CAD all the same.
    rig.send(LearnCommand::Show(Network::Masks));
    rig.harness.get_by_label_contains("no mask was corrected or accepted");
    rig.harness.get_by_label("Take masks from CAD");
    // Done on a right automatic mask accepts it, on both fingers where both are looked at.
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    for pair in 0..2 {
        rig.send(LibraryCommand::Select(PairId(pair)));
        rig.send(LibraryCommand::DoneAndNext);
    }
    let labels = Labels::of(&Dataset::open(&data).unwrap());
    let state = rig.state();
    let names: Vec<String> = state.library.pairs().iter().map(|entry| entry.name.clone()).collect();
    for name in &names {
        let stored = labels.load(name).unwrap();
        assert_eq!((stored.review, stored.masks.len()), (Review::Done, 2), "{name}");
        assert!(stored.masks.values().all(|mask| mask.base().starts_with("Accepted")), "{name}");
    }
    rig.send(LearnCommand::Show(Network::Masks));
    rig.harness.get_by_label_contains("all pairs with masks to train on are reserved for tests (2 pairs, 4 masks)");
    rig.click("Train on pairs reserved for tests");
    assert!(rig.state().learn.form.choice.test_in_train);
    rig.harness.get_by_label_contains("to learn from: 2 masks of 1 pair");
    // One undo takes mark and masks back, where they are looked at.
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(LibraryCommand::Select(PairId(0)));
    rig.send(LabelsCommand::Undo);
    let stored = labels.load(&names[0]).unwrap();
    assert!(stored.masks.is_empty() && stored.review == Review::Todo, "{stored:?}");
}
