//! The training of the mask model in the studio: by clicks, to the same bundle as by the verb, in use without a restart.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Pane, TrainCommand, UiRequest, ViewCommand};
use touch2touch::app::library::Place;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;
use touch2touch::app::tasks::TaskKind;
use touch2touch::app::train::TrainForm;
use touch2touch::app::{recipe, train};
use touch2touch_work::bundles::BundleKind;
use touch2touch_work::train::TrainChoice;

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
    rig.send(ViewCommand::Ui(UiRequest::ShowPane(Pane::Train)));
    let choice = TrainChoice { held_out_percent: 34, ..TrainChoice::default() };
    rig.send(TrainCommand::SetForm(TrainForm { choice, by_steps: true, steps: 12, ..TrainForm::default() }));
    rig.settle();
    // What it would learn from is said first.
    rig.harness.get_by_label_contains("to learn from: 8 masks of 4 pairs");
    rig.harness.get_by_label_contains("left out for the score: 4 masks of 2 pairs");
    rig.harness.get_by_label_contains("8 masks are few");
    rig.shoot("train-before");
    let shipped = recipe::bundle(rig.harness.state().state(), BundleKind::Mask).unwrap().clone();

    rig.harness.get_by_label("Start training").click();
    rig.harness.step();
    while rig.harness.state().state().tasks.of_kind(TaskKind::Train).is_some() {
        std::thread::sleep(std::time::Duration::from_millis(50));
        rig.harness.step();
    }
    rig.settle();
    let state = rig.harness.state().state();
    let found = state.train.result.clone().expect("the training is there");
    assert_eq!((found.masks, found.pairs, found.steps, found.held_out.len()), (8, 4, 12, 4), "{found:?}");
    assert!(found.curves.iter().any(|curve| curve.unit == "Dice") && found.before.is_some());
    let trained = train::trained(state).expect("its bundle is among the others").clone();
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
    assert!(train::uses_trained(rig.harness.state().state()));
    rig.harness.get_by_label("in use");

    // The verb makes the same bundle to the last bit.
    let out = folder.path().join("by-verb");
    let [path, out_text] = [&data, &out].map(|path| path.to_str().unwrap());
    let verb = ["masks", "train", path, "--held-out", "34", "--steps", "12", "--no-cache", "--out", out_text];
    let made = run(&verb, folder.path());
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert!(bytes(&out) == bytes(&found.bundle));
}
