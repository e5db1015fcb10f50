//! The panel *About this data*: what a folder is, what the models are worth on it, and the buttons that better it.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::action::Action;
use touch2touch::app::command::Pane;
use touch2touch::app::learn;
use touch2touch::app::learn::Network;
use touch2touch::app::library::Place;
use touch2touch::app::settings::prefer;
use touch2touch_core::read_as::ReadAs;
use touch2touch_pipeline::io::dataset::{READ_AS_FILE, write_read_as};
use touch2touch_pipeline::io::masks::FOLDER;

use super::rig::{Rig, write_dataset};
use crate::support::{copy_folder, shared};

const SIZE: [f32; 2] = [1280.0, 800.0];

#[test]
fn a_folder_of_ones_own_says_what_it_is_and_esc_puts_that_away() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    write_dataset(&data, 2);
    let Some(mut rig) = Rig::greeting(SIZE, Place::Path(data.clone()), true) else { return };
    for line in ["4 pairs in the lab's files", "2 tools: ", "2 of 2 usable in meters", "true poses known", "4 todo"] {
        rig.harness.get_by_label_contains(line);
    }
    // The models were tried because it was looked at.
    let worth = rig.state().doctor.worth.clone().expect("the models were tried");
    assert!(worth.fit.is_some() && worth.masks.is_some_and(|masks| masks.grasps == 4), "{worth:?}");
    rig.harness.get_by_label_contains(" dB, angle error ");
    rig.harness.get_by_label_contains("with masks from CAD, angle error ");
    // It takes no keyboard: the list is still gone through.
    let before = rig.state().selection.pair;
    rig.key(Modifiers::NONE, Key::D);
    assert_ne!(rig.state().selection.pair, before);
    // A cure: the range of these imprints, and then there is nothing left to cure about it.
    rig.send(prefer(|s| s.range.max_m = 0.05));
    let range = rig.state().settings.range;
    rig.click("Fit the range");
    let fitted = rig.state().settings.range;
    assert!(fitted != range && fitted.max_m > 0.001 && fitted.max_m < 0.03 && fitted.locked, "{fitted:?}");
    // Every pair, on demand.
    assert!(rig.state().doctor.examined.is_none());
    rig.click("Check all 4 pairs");
    let examined = rig.state().doctor.examined.clone().unwrap();
    assert_eq!((examined.report.pairs, examined.report.examined), (4, 4));
    rig.harness.get_by_label_contains(" of 4 pairs");
    rig.key(Modifiers::NONE, Key::Escape);
    assert!(!rig.state().doctor.shown);
    assert!(rig.harness.query_by_label("Fit the range").is_none());
    // One action away; what was tried is not tried again.
    let again = Action::AboutData.command(rig.state()).unwrap();
    rig.send(again);
    rig.harness.get_by_label_contains("4 pairs in the lab's files");
    assert!(std::sync::Arc::ptr_eq(&worth, rig.state().doctor.worth.as_ref().unwrap()));
    // The demo is nobody's own.
    rig.send(Action::OpenDemo.command(rig.state()).unwrap());
    assert!(!rig.state().doctor.shown);
    assert!(!data.join(FOLDER).exists(), "nothing was written beside the data");
}

#[test]
fn real_pairs_are_fitted_from_the_panel_and_the_fit_is_used_at_once() {
    let Some(pairs) = shared("real-pairs") else { return };
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("pairs");
    copy_folder(&pairs, &data);
    let Some(mut rig) = Rig::greeting(SIZE, Place::Path(data), true) else { return };
    rig.harness.get_by_label_contains("36 pairs of images; images carry no depth scale");
    rig.harness.get_by_label_contains("fit to your 36 pairs: ");
    rig.harness.get_by_label_contains("expected about 2");
    rig.click("Fit to 36 pairs");
    // The fit is on screen, before and after, and the panel out of its way.
    let state = rig.state();
    assert!(!state.doctor.shown && state.selection.panes.contains(&Pane::Adapt));
    let found = state.learn.adapted.clone().unwrap();
    let [before, after] = [&found.before, found.closed_form.as_ref().unwrap()].map(|scored| scored.psnr_db.unwrap());
    assert!(found.pairs == 36 && after > before + 5.0, "{before} {after}");
    // In the table and over the pictures of a touch that was left out.
    assert_eq!(rig.harness.get_all_by_label("Before").count(), 2);
    rig.harness.get_all_by_label("Fitted").next().expect("the picture of the fit");
    // Used at once: what is on screen is predicted anew.
    assert!(state.results.predictions.iter().next().is_none());
    rig.click("Use the new model");
    let state = rig.state();
    let fitted = learn::made(state, Network::Generator).unwrap().id.clone();
    let made: Vec<_> = state.results.predictions.iter().map(|(key, _)| key.clone()).collect();
    assert!(!made.is_empty() && made.iter().all(|key| *key.bundle == *fitted), "{made:?}");
    assert!(made.iter().all(|key| Some(key.touch.pair) == state.pair_key()));
}

#[test]
fn data_that_are_read_wrongly_are_read_rightly_by_a_click() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    write_dataset(&data, 1);
    write_read_as(&data, &[ReadAs::NegateTheta]).unwrap();
    let Some(mut rig) = Rig::greeting(SIZE, Place::Path(data.clone()), true) else { return };
    rig.click("Read as stored");
    assert!(!data.join(READ_AS_FILE).exists());
    // It was opened again, and the panel is still there.
    rig.harness.get_by_label_contains("none obvious");
    assert!(rig.harness.query_by_label("Read as stored").is_none());
}
