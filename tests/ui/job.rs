//! The whole job, by clicks and keys.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use eframe::egui::{Key, Modifiers, Pos2, vec2};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{LibraryCommand, Pane, PredictCommand, TasksCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::labels::MaskPlace;
use touch2touch::app::library::Place;
use touch2touch::app::results;
use touch2touch::app::settings::{GelView, Workspace};
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::{PadId, lab};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::MaskStore;

use super::rig::Rig;
use crate::support::files_below;

const SIZE: [f32; 2] = [1280.0, 800.0];

impl Rig {
    /// Draws a stroke through shares of the rectangle of the widget `label`.
    fn stroke(&mut self, label: &str, through: &[[f32; 2]]) {
        let rect = self.harness.get_by_label(label).rect();
        let at = |share: &[f32; 2]| -> Pos2 { rect.min + vec2(share[0], share[1]) * rect.size() };
        self.harness.hover_at(at(&through[0]));
        self.harness.step();
        self.harness.drag_at(at(&through[0]));
        self.harness.step();
        for share in &through[1..] {
            self.harness.hover_at(at(share));
            self.harness.step();
        }
        self.harness.drop_at(at(&through[through.len() - 1]));
        self.harness.step();
        self.settle();
    }

    fn stored(&self, pair: &str, finger: PadId) -> Option<usize> {
        let dataset = Dataset::open(&self.data).unwrap();
        let store = MaskStore::for_dataset(&dataset).unwrap();
        store.load(pair, finger).unwrap().map(|m| m.mask.as_slice().iter().filter(|on| **on).count())
    }
}

fn files(folder: &Path) -> BTreeMap<PathBuf, u64> {
    files_below(folder).into_iter().map(|path| (path.clone(), path.metadata().unwrap().len())).collect()
}

#[test]
fn browse_generate_shift_paint_undo() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    let start = rig.state().selection.pair;

    // Step to the next pair, and back.
    rig.key(Modifiers::NONE, Key::D);
    let state = rig.state();
    assert_ne!(state.selection.pair, start);
    let second = state.selection.pair;
    rig.key(Modifiers::NONE, Key::A);
    assert_eq!(rig.state().selection.pair, start);
    rig.key(Modifiers::NONE, Key::PageDown);
    assert_eq!(rig.state().selection.pair, second);

    // An empty pane offers what it lacks; the same by key gives another seed's result when asked so.
    rig.click("Generate (Ctrl+G)");
    let state = rig.state();
    for finger in lab::PADS {
        assert!(results::chosen(state, finger).is_some(), "{finger:?}");
        assert!(results::imprint(state, ImprintSource::Predicted, lab::RIGHT).ready().is_some());
    }
    rig.key(Modifiers::CTRL | Modifiers::SHIFT, Key::G);
    let state = rig.state();
    let touch = state.touch_key(lab::RIGHT).unwrap();
    assert_eq!(state.results.made[&touch].len(), 2, "the first result is kept");

    // Another depth scale, by its button.
    let exact = results::imprint(state, ImprintSource::Predicted, lab::RIGHT).ready().unwrap().clone();
    rig.click("Choice of depth scale");
    rig.click("As in the paper (paper shift)");
    let state = rig.state();
    assert_eq!(state.settings.shift, ShiftMode::PaperShift);
    assert_ne!(*results::imprint(state, ImprintSource::Predicted, lab::RIGHT).ready().unwrap(), exact);

    // Another image in the same place.
    assert_eq!(state.settings.gel, GelView::Difference);
    rig.click("GelSlim image");
    rig.click("raw");
    assert_eq!(rig.state().settings.gel, GelView::Raw);

    // Paint, see the pose follow, find the file.
    rig.click("Label");
    let state = rig.state();
    assert_eq!(state.settings.workspace, Workspace::Label);
    assert!(state.selection.panes.contains(&Pane::Masks) && state.selection.both_fingers);
    let pair = state.pair_name().to_owned();
    let before = results::pose(state, ImprintSource::Measured).ready().expect("a pose before the stroke").clone();
    let area = |rig: &Rig| {
        let mask = results::mask_in_force(rig.state(), ImprintSource::Measured, lab::RIGHT).unwrap();
        mask.mask.as_slice().iter().filter(|on| **on).count()
    };
    let automatic = area(&rig);
    assert_eq!(rig.stored(&pair, lab::RIGHT), None);
    rig.stroke("Measured imprint right", &[[0.1, 0.5], [0.3, 0.45], [0.6, 0.55], [0.9, 0.5]]);
    let state = rig.state();
    assert!(state.document.drawn_mask(&pair, &MaskPlace::measured(lab::RIGHT)).is_some());
    assert!(state.document.drawn_mask(&pair, &MaskPlace::measured(lab::LEFT)).is_none(), "only the finger painted on");
    let painted = area(&rig);
    assert!(painted > automatic, "{painted} > {automatic}");
    let after = results::pose(state, ImprintSource::Measured).ready().expect("a pose after the stroke").clone();
    assert!(after.num_points > before.num_points, "{} > {}", after.num_points, before.num_points);
    assert_eq!(rig.stored(&pair, lab::RIGHT), Some(painted), "saved by itself");

    // Erase with Ctrl-less tool by key, then take both back.
    rig.key(Modifiers::NONE, Key::E);
    rig.stroke("Measured imprint right", &[[0.4, 0.3], [0.5, 0.6]]);
    assert!(area(&rig) < painted);
    rig.key(Modifiers::CTRL, Key::Z);
    assert_eq!(area(&rig), painted);
    assert_eq!(rig.stored(&pair, lab::RIGHT), Some(painted), "undo changes the file too");
    rig.key(Modifiers::CTRL, Key::Z);
    assert_eq!(area(&rig), automatic);
    assert_eq!(results::pose(rig.state(), ImprintSource::Measured).ready().unwrap().num_points, before.num_points);
    rig.key(Modifiers::CTRL | Modifiers::SHIFT, Key::Z);
    assert_eq!(area(&rig), painted);

    // Done, and the next one is shown; after a restart the mask and the state are still there.
    rig.click("Done and next");
    assert_ne!(rig.state().pair_name(), pair);
    rig.restart(SIZE);
    let state = rig.state();
    assert!(state.document.review(&pair).is_finished());
    assert_eq!(rig.stored(&pair, lab::RIGHT), Some(painted));
}

#[test]
fn at_rest_nothing_is_drawn_uploaded_or_written() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(PredictCommand::Generate);
    // A note on the screen goes by itself: the one thing that is waited for.
    rig.send(TasksCommand::LogSeen(u64::MAX));
    rig.settle();
    let uploads = rig.harness.state().uploads();
    let before = files(&rig.data);
    for _ in 0..5 {
        rig.harness.step();
        let delays: Vec<_> = rig.harness.output().viewport_output.values().map(|v| v.repaint_delay).collect();
        assert!(delays.iter().all(|d| *d > std::time::Duration::from_secs(3600)), "a repaint is asked for: {delays:?}");
    }
    assert_eq!(rig.harness.state().uploads(), uploads);
    assert_eq!(before, files(&rig.data));
}

#[test]
fn a_wrong_path_is_said_where_it_was_typed_and_what_is_open_stays() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    let pairs = rig.state().library.pairs().len();
    let said = rig.state().log.unseen().count();
    rig.key(Modifiers::CTRL, Key::O);
    rig.harness.get_by_label("Path").type_text("/nowhere/at/all");
    rig.harness.step();
    rig.settle();
    rig.harness.key_press(Key::Enter);
    rig.settle();
    rig.harness.get_by_label("There is nothing at /nowhere/at/all");
    // It can be typed on: the box has the focus.
    for letter in ["/", "x"] {
        rig.harness.event(eframe::egui::Event::Text(letter.into()));
        rig.settle();
    }
    rig.click("Use this path");
    rig.harness.get_by_label("There is nothing at /nowhere/at/all/x");
    rig.harness.key_press(Key::Escape);
    rig.settle();
    assert!(rig.harness.query_by_label("Use this path").is_none());
    assert_eq!(rig.state().log.unseen().count(), said);
    // What was opened before and is gone is said in the log.
    rig.send(LibraryCommand::Open(Place::Path("/nowhere/at/all".into())));
    let state = rig.state();
    assert_eq!(state.library.pairs().len(), pairs);
    assert!(state.log.unseen().any(|e| e.level == touch2touch::app::tasks::Level::Error));
    rig.click("Dismiss");
    assert_eq!(rig.state().log.unseen().count(), 0);
}
