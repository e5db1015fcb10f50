//! A data set at the labeling desk: notes, the most uncertain first, and pairs that come back.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{LabelsCommand, LibraryCommand, TasksCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::labels::Review;
use touch2touch::app::library::{Place, Sort};
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskTool, Workspace};
use touch2touch::app::state::State;
use touch2touch_core::grid::Mask;
use touch2touch_core::label::{CleanKind, CleanUp};
use touch2touch_core::rig::lab;
use touch2touch_work::io::dataset::Dataset;
use touch2touch_work::io::masks::MaskStore;

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
fn the_most_uncertain_come_first_by_key_and_say_why() {
    let folder = tempfile::tempdir().unwrap();
    write_dataset(folder.path(), 3);
    let Some(mut rig) = Rig::live(SIZE, Place::Path(folder.path().to_owned())) else { return };
    desk(&mut rig);
    // The first press ranks the pairs, the next ones go through them.
    press(&mut rig, Modifiers::ALT, Key::N);
    assert_eq!((state(&rig).library.sort, state(&rig).table.scores.queue.known()), (Sort::Uncertain, 6));
    assert!(state(&rig).table.result.is_none(), "a ranking is no results table");
    rig.shoot("queue-uncertain");
    let order = state(&rig).library.order.clone();
    let queue = &state(&rig).table.scores.queue;
    let overall: Vec<f64> = order.iter().map(|id| queue.get(*id).unwrap().overall.unwrap()).collect();
    assert!(overall.is_sorted_by(|a, b| a >= b) && overall[0] > overall[5], "{overall:?}");
    rig.send(LibraryCommand::Last);
    rig.send(LabelsCommand::SetReview(Review::Done));
    for expected in [0, 1, 2, 3, 4, 0] {
        press(&mut rig, Modifiers::ALT, Key::N);
        assert_eq!(state(&rig).selection.pair, Some(order[expected]), "the last is done");
    }
    // A mask that is drawn otherwise is a disagreement, once it is ranked again.
    rig.send(LabelsCommand::AdoptAutomatic);
    rig.send(LabelsCommand::CleanUp(CleanUp { kind: CleanKind::Grow, size_mm: 3.0 }));
    rig.harness.get_by_label("Rank by uncertainty").click();
    rig.harness.step();
    rig.settle();
    let pair = state(&rig).selection.pair.unwrap();
    let queued = state(&rig).table.scores.queue.get(pair).unwrap().clone();
    let disagreement = queued.parts.iter().find(|part| part.text().starts_with("Hand against model"));
    assert!(disagreement.is_some_and(|part| part.value > 0.05), "{queued:?}");
    rig.shoot("queue-disagreement");
}

fn drawn(rig: &Rig) -> Option<Mask> {
    let hand = results::drawn_mask(state(rig), ImprintSource::Measured, lab::RIGHT)?;
    Some((*hand.mask).clone())
}

#[test]
fn what_was_done_comes_back_without_its_mask_and_is_compared_with_it() {
    let Some(mut rig) = Rig::new(SIZE, 7) else { return };
    desk(&mut rig);
    rig.send(prefer(|s| s.repeats_percent = 100.0));
    let store = MaskStore::for_dataset(&Dataset::open(&rig.data).unwrap()).unwrap();
    let first = state(&rig).pair_name().to_owned();
    let mut done = 0;
    while !state(&rig).document.repeats.contains_key(state(&rig).pair_name()) {
        rig.send(LabelsCommand::AdoptAutomatic);
        press(&mut rig, Modifiers::CTRL, Key::Enter);
        done += 1;
        assert!(done < 14, "nothing comes back");
    }
    assert_eq!((done, state(&rig).pair_name()), (12, &*first), "the first, ten others having been done since");
    // It looks as if nobody had drawn on it, and nothing of before can be undone into it.
    assert_eq!((state(&rig).document.review(&first), drawn(&rig)), (Review::Todo, None));
    assert!(state(&rig).document.is_editable(&first));
    assert!(state(&rig).history.done().iter().all(|gesture| gesture.pair() != first));
    let before = std::fs::read(store.mask_file(&first, lab::RIGHT)).unwrap();
    let review = store.load_review(&first).unwrap();
    rig.shoot("queue-repeat");
    rig.send(LabelsCommand::AdoptAutomatic);
    rig.send(LabelsCommand::CleanUp(CleanUp { kind: CleanKind::Grow, size_mm: 1.0 }));
    let second = drawn(&rig).unwrap();
    // What is painted then lies apart, and an export takes the first.
    let again = store.repeats_of("Anna");
    assert_eq!(again.load(&first, lab::RIGHT).unwrap().unwrap().mask, second);
    assert!(!state(&rig).document.own_labels().contains_key(&first));
    press(&mut rig, Modifiers::CTRL, Key::Enter);
    assert!(state(&rig).document.repeats.is_empty(), "it is over when it is written and left");
    assert_eq!(std::fs::read(store.mask_file(&first, lab::RIGHT)).unwrap(), before);
    assert_eq!(store.load_review(&first).unwrap(), review);
    assert_eq!(state(&rig).document.review(&first), Review::Done);
    // Shown again, it is the first one, with its past.
    rig.send(LibraryCommand::First);
    assert_eq!(state(&rig).pair_name(), first);
    assert_ne!(drawn(&rig).unwrap(), second);
    assert!(state(&rig).history.done().iter().any(|gesture| gesture.pair() == first));
    let stats = state(&rig).document.stats.clone().unwrap();
    assert_eq!(stats.repeats.masks.len(), 1, "{:?}", stats.repeats);
    let compared = &stats.repeats.masks[0].compared;
    assert!(compared.pair == first && compared.agreement.dice < 1.0 && compared.agreement.edge_mm.unwrap() > 0.1);
    assert!(!stats.repeats.due.contains(&first), "once is enough");
    // Of each pair one mask was taken over, and the other finger's was right and accepted.
    assert_eq!((stats.all.of(Review::Done), stats.effort.masks), (12, 24));
    let drawn_twice = rig.harness.get_by_label_contains("Drawn twice");
    drawn_twice.scroll_to_me();
    rig.settle();
    rig.harness.get_by_label_contains("Drawn twice").click();
    rig.harness.step();
    rig.settle();
    rig.harness.get_by_label_contains("All 2 tools").click();
    rig.harness.step();
    rig.settle();
    rig.shoot("queue-progress");
    // A restart in the middle of another one leaves the first mask in force.
    rig.send(TasksCommand::LogSeen(u64::MAX));
    rig.restart(SIZE);
    assert!(state(&rig).document.repeats.is_empty());
    assert_eq!(state(&rig).document.review(&first), Review::Done);
}
