//! The panel *About this data*: what a folder is, what the models are worth on it, and the buttons that better it.

use eframe::egui::Key;
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
use crate::support::shared;

const SIZE: [f32; 2] = [1280.0, 800.0];

fn copied(from: &std::path::Path, to: &std::path::Path) {
    std::fs::create_dir(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let file = entry.unwrap().path();
        std::fs::copy(&file, to.join(file.file_name().unwrap())).unwrap();
    }
}

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
    let worth = rig.harness.state().state().doctor.worth.clone().expect("the models were tried");
    assert!(worth.fit.is_some() && worth.masks.is_some_and(|masks| masks.grasps == 4), "{worth:?}");
    rig.harness.get_by_label_contains(" dB, angle error ");
    rig.harness.get_by_label_contains("with masks from CAD, angle error ");
    rig.shoot("about-simulated");
    // It takes no keyboard: the list is still gone through.
    let before = rig.harness.state().state().selection.pair;
    rig.harness.key_press(Key::D);
    rig.harness.step();
    rig.settle();
    assert_ne!(rig.harness.state().state().selection.pair, before);
    // A cure: the range of these imprints, and then there is nothing left to cure about it.
    rig.send(prefer(|s| s.range.max_m = 0.05));
    let range = rig.harness.state().state().settings.range;
    rig.harness.get_by_label("Fit the range").click();
    rig.harness.step();
    rig.settle();
    let fitted = rig.harness.state().state().settings.range;
    assert!(fitted != range && fitted.max_m > 0.001 && fitted.max_m < 0.03 && fitted.locked, "{fitted:?}");
    // Every pair, on demand.
    assert!(rig.harness.state().state().doctor.examined.is_none());
    rig.harness.get_by_label("Check all 4 pairs").click();
    rig.harness.step();
    rig.settle();
    let examined = rig.harness.state().state().doctor.examined.clone().unwrap();
    assert_eq!((examined.report.pairs, examined.report.examined), (4, 4));
    rig.harness.get_by_label_contains(" of 4 pairs");
    rig.harness.key_press(Key::Escape);
    rig.harness.step();
    rig.settle();
    assert!(!rig.harness.state().state().doctor.shown);
    assert!(rig.harness.query_by_label("Fit the range").is_none());
    // One action away; what was tried is not tried again.
    let again = Action::AboutData.command(rig.harness.state().state()).unwrap();
    rig.send(again);
    rig.harness.get_by_label_contains("4 pairs in the lab's files");
    assert!(std::sync::Arc::ptr_eq(&worth, rig.harness.state().state().doctor.worth.as_ref().unwrap()));
    // The demo is nobody's own.
    rig.send(Action::OpenDemo.command(rig.harness.state().state()).unwrap());
    assert!(!rig.harness.state().state().doctor.shown);
    assert!(!data.join(FOLDER).exists(), "nothing was written beside the data");
}

#[test]
fn real_pairs_are_fitted_from_the_panel_and_the_fit_is_used_at_once() {
    let Some(pairs) = shared("real-pairs") else { return };
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("pairs");
    copied(&pairs, &data);
    let Some(mut rig) = Rig::greeting(SIZE, Place::Path(data), true) else { return };
    rig.harness.get_by_label_contains("36 pairs of images; images carry no depth scale");
    rig.harness.get_by_label_contains("fit to your 36 pairs: ");
    rig.harness.get_by_label_contains("expected about 2");
    rig.shoot("about-pairs");
    rig.harness.get_by_label("Fit to 36 pairs").click();
    rig.harness.step();
    rig.settle();
    // The fit is on screen, before and after, and the panel out of its way.
    let state = rig.harness.state().state();
    assert!(!state.doctor.shown && state.selection.panes.contains(&Pane::Adapt));
    let found = state.learn.adapted.clone().unwrap();
    let [before, after] = [&found.before, found.closed_form.as_ref().unwrap()].map(|scored| scored.psnr_db.unwrap());
    assert!(found.pairs == 36 && after > before + 5.0, "{before} {after}");
    // In the table and over the pictures of a touch that was left out.
    assert_eq!(rig.harness.get_all_by_label("Before").count(), 2);
    rig.harness.get_all_by_label("Fitted").next().expect("the picture of the fit");
    // Used at once: what is on screen is predicted anew.
    assert!(state.results.predictions.iter().next().is_none());
    rig.harness.get_by_label("Use the fitted model").click();
    rig.harness.step();
    rig.settle();
    let state = rig.harness.state().state();
    let fitted = learn::made(state, Network::Generator).unwrap().id.clone();
    let made: Vec<_> = state.results.predictions.iter().map(|(key, _)| key.clone()).collect();
    assert!(!made.is_empty() && made.iter().all(|key| *key.bundle == *fitted), "{made:?}");
    assert!(made.iter().all(|key| Some(key.touch.pair) == state.pair_key()));
    rig.shoot("about-fitted");
}

#[test]
fn data_that_are_read_wrongly_are_read_rightly_by_a_click() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    write_dataset(&data, 3);
    write_read_as(&data, &[ReadAs::NegateTheta]).unwrap();
    let Some(mut rig) = Rig::greeting(SIZE, Place::Path(data.clone()), true) else { return };
    rig.shoot("about-wrong");
    rig.harness.get_by_label("Read as stored").click();
    rig.harness.step();
    rig.settle();
    assert!(!data.join(READ_AS_FILE).exists());
    // It was opened again, and the panel is still there.
    rig.harness.get_by_label_contains("none obvious");
    assert!(rig.harness.query_by_label("Read as stored").is_none());
}
