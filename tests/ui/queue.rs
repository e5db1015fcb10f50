//! A data set at the labeling desk: notes, and what the mask model is least sure of first.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{EvaluateCommand, LabelsCommand, LibraryCommand};
use touch2touch::app::labels::Review;
use touch2touch::app::library::{Place, Sort};
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskTool, Workspace};
use touch2touch::app::state::State;
use touch2touch_core::evaluation::Metric;
use touch2touch_core::label::{CleanKind, CleanUp};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::MaskStore;

use super::rig::{Rig, write_dataset};

const SIZE: [f32; 2] = [1280.0, 800.0];

fn state(rig: &Rig) -> &State {
    rig.harness.state().state()
}

fn desk(rig: &mut Rig) {
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(prefer(|s| s.person = "Anna".into()));
}

fn press(rig: &mut Rig, modifiers: Modifiers, key: Key) {
    rig.harness.key_press_modifiers(modifiers, key);
    rig.harness.step();
    rig.settle();
}

#[test]
fn a_note_is_typed_without_a_key_firing_and_is_found_again() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    desk(&mut rig);
    let name = state(&rig).pair_name().to_owned();
    let field = rig.harness.get_by_label("Note");
    field.scroll_to_me();
    rig.settle();
    rig.harness.get_by_label("Note").click();
    rig.harness.step();
    // Each of these letters is a tool's key.
    rig.harness.get_by_label("Note").type_text("blurred edge, see l and p");
    rig.harness.step();
    assert_eq!(state(&rig).settings.mask.tool, MaskTool::Brush);
    assert_eq!(state(&rig).document.note(&name), "", "it is one change, made when the field is left");
    // Another pair is shown meanwhile: the note stays with the one that it was typed for.
    rig.send(LibraryCommand::Step(1));
    let next = state(&rig).pair_name().to_owned();
    assert_ne!(next, name);
    assert_eq!((state(&rig).document.note(&name), state(&rig).document.note(&next)), ("blurred edge, see l and p", ""));
    rig.send(LibraryCommand::SetFilter("has:note blurred".into()));
    rig.shoot("queue-note");
    assert_eq!(state(&rig).library.order.len(), 1);
    rig.send(LibraryCommand::SetFilter("note:nothing".into()));
    assert!(state(&rig).library.order.is_empty());
    rig.send(LibraryCommand::SetFilter(String::new()));
    // It is on the disk, and undo takes it back.
    let store = MaskStore::for_dataset(&Dataset::open(&rig.data).unwrap()).unwrap();
    assert_eq!(store.load_review(&name).unwrap().unwrap().note, "blurred edge, see l and p");
    rig.restart(SIZE);
    assert_eq!(state(&rig).document.note(&name), "blurred edge, see l and p");
    rig.send(LibraryCommand::First);
    assert_eq!(state(&rig).pair_name(), name);
    rig.send(LabelsCommand::Undo);
    assert_eq!((state(&rig).document.note(&name), state(&rig).document.review(&name)), ("", Review::Todo));
    rig.send(LabelsCommand::Redo);
    assert_eq!(state(&rig).document.note(&name), "blurred edge, see l and p");
}

#[test]
fn what_the_mask_model_is_least_sure_of_comes_first() {
    let folder = tempfile::tempdir().unwrap();
    write_dataset(folder.path(), 3);
    let Some(mut rig) = Rig::live(SIZE, Place::Path(folder.path().to_owned())) else { return };
    desk(&mut rig);
    rig.send(EvaluateCommand::Rank);
    rig.settle();
    let (by, metric) = state(&rig).table.by().unwrap();
    assert_eq!((state(&rig).library.sort, by.upper_bound, metric), (Sort::Score, true, Metric::Unsure));
    assert!(state(&rig).table.result.is_none(), "a ranking is no results table");
    rig.shoot("queue-uncertain");
    let order = state(&rig).library.order.clone();
    let unsure: Vec<f64> = order.iter().map(|id| state(&rig).table.value(*id).unwrap()).collect();
    assert!(unsure.len() == 6 && unsure.is_sorted_by(|a, b| a >= b) && unsure[0] > unsure[5], "{unsure:?}");
    rig.send(LibraryCommand::Last);
    rig.send(LabelsCommand::SetReview(Review::Done));
    for expected in [0, 1, 2, 3, 4, 0] {
        press(&mut rig, Modifiers::SHIFT, Key::N);
        assert_eq!(state(&rig).selection.pair, Some(order[expected]), "the last is done");
    }
    // A mask that is drawn otherwise is a disagreement, once it is ranked again.
    rig.send(LabelsCommand::AdoptAutomatic);
    rig.send(LabelsCommand::CleanUp(CleanUp { kind: CleanKind::Grow, size_mm: 3.0 }));
    rig.send(EvaluateCommand::Rank);
    rig.settle();
    let pair = state(&rig).selection.pair.unwrap();
    let (by, _) = state(&rig).table.by().unwrap();
    let apart = by.value(pair, Metric::Disagreement);
    assert!(apart.is_some_and(|apart| apart > 0.05), "{apart:?}");
}
