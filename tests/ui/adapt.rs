//! The fit to one's own pairs in the studio, with the shipped models on a few simulated grasps.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Pane, UiRequest, ViewCommand};
use touch2touch::app::learn::Network;
use touch2touch::app::library::Place;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;
use touch2touch::app::{learn, recipe};
use touch2touch_pipeline::steps::bundles::BundleKind;

use super::rig::{Rig, write_dataset};

#[test]
fn the_model_is_fitted_by_a_click_scored_and_used() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    write_dataset(&data, 3);
    let Some(mut rig) = Rig::live([1280.0, 800.0], Place::Path(data)) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Evaluate));
    rig.send(ViewCommand::Ui(UiRequest::ShowPane(Pane::Adapt)));
    let shipped = recipe::bundle(rig.state(), BundleKind::Generator).unwrap().clone();
    assert!(!shipped.is_fitted() && learn::made(rig.state(), Network::Generator).is_none());

    rig.click("Fit to my pairs");
    rig.settle();
    let found = rig.state().learn.adapted.clone().expect("the fit is there");
    assert_eq!((found.pairs, found.touches, found.pads.len()), (6, 12, 2), "{found:?}");
    let closed = found.closed_form.as_ref().unwrap();
    assert!(closed.angle.is_some() && closed.psnr_db.unwrap() > 20.0, "{found:?}");
    rig.harness.get_all_by_label("Fitted").next().expect("the scores of the fit");
    rig.harness.get_by_label_contains("6 pairs are few");
    // What was simulated lies near where the model expects it.
    assert!(found.pads.iter().all(|pad| pad.offset_px.iter().all(|off| off.abs() < 6.0)), "{:?}", found.pads);
    // A touch that was left out, before and after.
    let held = learn::held_back(rig.state()).cloned().unwrap();
    assert!(held.before.size() == held.measured.size() && held.before != held.after, "{}", held.name);
    rig.harness.get_all_by_label("Fitted").next().expect("the picture of the fit");
    // Fitted, but not taken yet.
    assert_eq!(recipe::bundle(rig.state(), BundleKind::Generator).unwrap().id, shipped.id);
    rig.click("Use the new model");
    rig.settle();
    let state = rig.state();
    let now = recipe::bundle(state, BundleKind::Generator).unwrap();
    assert!(
        now.is_fitted()
            && now.name.contains("fitted to")
            && Some(now.id.as_ref()) == learn::made(state, Network::Generator).map(|f| &*f.id)
    );
    // It is made again from what it was made from.
    let setup = learn::adapt_setup(rig.state()).unwrap();
    assert_eq!((setup.recipe.generating().unwrap().bundle.id.clone(), setup.pairs.len()), (shipped.id, 6));
}
