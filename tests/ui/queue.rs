//! A data set at the labeling desk: notes.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{LabelsCommand, LibraryCommand};
use touch2touch::app::labels::Review;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskTool, Workspace};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::MaskStore;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

fn desk(rig: &mut Rig) {
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(prefer(|s| s.person = "Anna".into()));
}

#[test]
fn a_note_is_typed_without_a_key_firing_and_is_found_again() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    desk(&mut rig);
    let name = rig.state().pair_name().to_owned();
    let field = rig.harness.get_by_label("Note");
    field.scroll_to_me();
    rig.settle();
    rig.harness.get_by_label("Note").click();
    rig.harness.step();
    // Each of these letters is a tool's key.
    rig.harness.get_by_label("Note").type_text("blurred edge, see l and p");
    rig.harness.step();
    assert_eq!(rig.state().settings.mask.tool, MaskTool::Brush);
    assert_eq!(rig.state().document.note(&name), "", "it is one change, made when the field is left");
    // Another pair is shown meanwhile: the note stays with the one that it was typed for.
    rig.send(LibraryCommand::Step(1));
    let next = rig.state().pair_name().to_owned();
    assert_ne!(next, name);
    assert_eq!((rig.state().document.note(&name), rig.state().document.note(&next)), ("blurred edge, see l and p", ""));
    rig.send(LibraryCommand::SetFilter("has:note blurred".into()));
    assert_eq!(rig.state().library.order.len(), 1);
    rig.send(LibraryCommand::SetFilter("note:nothing".into()));
    assert!(rig.state().library.order.is_empty());
    rig.send(LibraryCommand::SetFilter(String::new()));
    // It is on the disk, and undo takes it back.
    let store = MaskStore::for_dataset(&Dataset::open(&rig.data).unwrap()).unwrap();
    assert_eq!(store.load_review(&name).unwrap().unwrap().note, "blurred edge, see l and p");
    rig.restart(SIZE);
    assert_eq!(rig.state().document.note(&name), "blurred edge, see l and p");
    rig.send(LibraryCommand::First);
    assert_eq!(rig.state().pair_name(), name);
    rig.send(LabelsCommand::Undo);
    assert_eq!((rig.state().document.note(&name), rig.state().document.review(&name)), ("", Review::Todo));
    rig.send(LabelsCommand::Redo);
    assert_eq!(rig.state().document.note(&name), "blurred edge, see l and p");
}
