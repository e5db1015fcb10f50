//! The labeling desk by mouse and keys.

use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, pos2};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{CameraPreset, ExportCommand, LabelsCommand, LibraryCommand, UiRequest, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::labels::Review;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskChoice, MaskSource, MaskTool, Workspace};
use touch2touch::app::workbench::SceneTool;
use touch2touch_core::grid::Mask;
use touch2touch_core::label::{CleanKind, Layers};
use touch2touch_core::rig::{PadId, lab};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::exchange::list;
use touch2touch_pipeline::io::masks::MaskStore;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

impl Rig {
    /// What the last plan of an export says.
    fn plan(&self) -> Vec<String> {
        let state = self.state();
        state.results.mask_plans.get(&results::mask_plan_key(state).unwrap()).unwrap().lines()
    }

    /// The mask of a finger that is in force on the measured imprint.
    fn mask(&self, finger: PadId) -> Mask {
        (**results::mask_in_force(self.state(), ImprintSource::Measured, finger).unwrap().mask).clone()
    }

    fn button(&mut self, at: Pos2, pressed: bool) {
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        self.harness.hover_at(at);
        self.harness.event(Event::PointerButton { pos: at, button, pressed, modifiers });
        self.harness.step();
    }

    /// Presses at the first point, goes over the others and lets go at the last.
    fn drag_over(&mut self, way: &[Pos2]) {
        self.button(way[0], true);
        for at in way {
            self.harness.hover_at(*at);
            self.harness.step();
        }
        self.button(way[way.len() - 1], false);
        self.settle();
    }
}

/// Masks that nobody drew are empty: what is drawn is then all there is.
fn with_nothing_automatic(rig: &mut Rig) {
    let mut settings = rig.state().settings.mask.clone();
    settings.choice = MaskChoice { source: MaskSource::Threshold, threshold_m: 0.09, ..settings.choice };
    rig.send(prefer(move |s| s.mask = settings.clone()));
}

fn inside(rect: Rect, x: f32, y: f32) -> Pos2 {
    pos2(rect.left() + rect.width() * x, rect.top() + rect.height() * y)
}

fn count(mask: &Mask) -> usize {
    mask.as_slice().iter().filter(|v| **v).count()
}

#[test]
fn tools_draw_by_mouse_and_a_click_on_the_other_finger_paints_nothing() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(ViewCommand::ShowBothFingers(true));
    with_nothing_automatic(&mut rig);
    let picture = |rig: &Rig, finger: &str| rig.harness.get_by_label(&format!("Measured imprint {finger}")).rect();
    let right = picture(&rig, "right");
    // The first click on the other finger makes it the active one.
    let left = picture(&rig, "left");
    let before = rig.mask(lab::LEFT);
    rig.drag_over(&[left.center(), inside(left, 0.3, 0.3)]);
    assert_eq!(rig.mask(lab::LEFT), before);
    assert_eq!(rig.state().selection.finger, lab::LEFT);
    rig.drag_over(&[left.center(), inside(left, 0.3, 0.3)]);
    assert_ne!(rig.mask(lab::LEFT), before, "the second one paints");
    rig.drag_over(&[right.center(), right.center()]);
    // A lasso by its key, a rectangle, a polygon by clicks.
    let empty = rig.mask(lab::RIGHT);
    rig.harness.key_press(Key::L);
    rig.harness.step();
    assert_eq!(rig.state().settings.mask.tool, MaskTool::Lasso);
    rig.drag_over(&[
        inside(right, 0.1, 0.1),
        inside(right, 0.4, 0.1),
        inside(right, 0.4, 0.5),
        inside(right, 0.1, 0.5),
    ]);
    let lassoed = rig.mask(lab::RIGHT);
    assert!(count(&lassoed) > count(&empty) + 500, "{} {}", count(&empty), count(&lassoed));
    rig.harness.key_press(Key::P);
    rig.harness.step();
    let corners = [[0.6, 0.2], [0.9, 0.2], [0.9, 0.8]].map(|[x, y]| inside(right, x, y));
    for at in corners {
        rig.button(at, true);
        rig.button(at, false);
    }
    rig.button(corners[0], true);
    rig.button(corners[0], false);
    rig.settle();
    assert!(rig.state().document.stroke.is_none(), "the first corner closes it");
    let drawn = rig.mask(lab::RIGHT);
    assert!(count(&drawn) > count(&lassoed) + 500, "{} {}", count(&lassoed), count(&drawn));
    for _ in 0..2 {
        rig.key(Modifiers::CTRL, Key::Z);
    }
    assert_eq!(rig.mask(lab::RIGHT), empty);
    let saved = rig.harness.get_by_label("saved").rect();
    assert!(saved.right() < SIZE[0] - 4.0, "{saved:?} is cut off");
}

#[test]
fn a_polygon_grows_by_quick_clicks_whatever_was_drawn_before() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    let right = rig.harness.get_by_label("Measured imprint right").rect();
    let corners = [[0.6, 0.2], [0.9, 0.2], [0.9, 0.8]].map(|[x, y]| inside(right, x, y));
    let quick = |rig: &mut Rig, at: Pos2| {
        rig.harness.event(Event::PointerMoved(at));
        rig.harness.step();
        for pressed in [true, false] {
            let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
            rig.harness.input_mut().events.push(Event::PointerButton { pos: at, button, pressed, modifiers });
        }
        rig.harness.step();
        rig.harness.step();
    };
    let points = |rig: &Rig| rig.state().document.stroke.as_ref().map(|s| s.drawing.points.len());
    let key = |rig: &mut Rig, key| {
        rig.harness.key_press(key);
        rig.harness.step();
    };
    for before in [None, Some(Key::E), Some(Key::Escape), Some(Key::D)] {
        if let Some(before) = before {
            key(&mut rig, before);
            if before == Key::E {
                quick(&mut rig, corners[0]);
            }
            rig.settle();
        }
        key(&mut rig, Key::P);
        for (at, expected) in corners.into_iter().zip([2, 3, 4]) {
            quick(&mut rig, at);
            assert_eq!(points(&rig), Some(expected), "{before:?}");
        }
    }
}

#[test]
fn a_letter_changes_no_labels_elsewhere_and_another_way_can_be_taken_back_at_once() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    let reviewed = |rig: &Rig| {
        let state = rig.state();
        state.document.review(state.pair_name())
    };
    let letters = [Key::T, Key::H, Key::K];
    for (workspace, asking) in [(Workspace::Inspect, false), (Workspace::Inspect, true), (Workspace::Label, true)] {
        rig.send(prefer(move |s| s.workspace = workspace));
        rig.send(ExportCommand::AskMasks(asking));
        rig.settle();
        let before = rig.mask(lab::RIGHT);
        for key in letters {
            rig.harness.key_press(key);
            rig.harness.step();
        }
        rig.settle();
        assert_eq!((rig.mask(lab::RIGHT), reviewed(&rig)), (before, Review::Todo), "{workspace:?} {asking}");
        rig.harness.key_press(Key::Escape);
        rig.settle();
        assert!(!rig.state().export.asking_masks, "Escape closes the form");
    }
    rig.send(prefer(|s| s.workspace = Workspace::Inspect));
    rig.send(LabelsCommand::SetReview(Review::Flagged));
    rig.settle();
    assert_eq!(reviewed(&rig), Review::Flagged);
    rig.harness.get_by_label_contains("were changed: ");
    rig.harness.get_by_label("Undo").click();
    rig.settle();
    assert_eq!(reviewed(&rig), Review::Todo);
    assert!(rig.harness.query_by_label("Undo").is_none(), "it says so once");
}

#[test]
fn masks_are_drawn_on_the_points_of_the_3d_view() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(ViewCommand::ShowBothFingers(true));
    with_nothing_automatic(&mut rig);
    const VIEW: &str = "3D view, measured";
    let look = |rig: &mut Rig, preset| {
        let view = rig.harness.get_by_label(VIEW).rect();
        rig.harness.hover_at(view.center());
        rig.harness.step();
        rig.send(ViewCommand::Ui(UiRequest::Camera(preset)));
        rig.send(ViewCommand::Ui(UiRequest::Fit));
    };
    look(&mut rig, CameraPreset::Right);
    // Where the point of a finger's pixel is on the screen.
    let place = |rig: &Rig, finger: PadId, [x, y]: [usize; 2]| {
        let cloud = results::cloud(rig.state(), ImprintSource::Measured).ready().unwrap().finger(finger).unwrap();
        let point = cloud.points[cloud.at_pixel(x, y).unwrap()];
        rig.harness.state().on_screen(ImprintSource::Measured, point.to_array()).unwrap()
    };
    let [from, to] = [[70, 60], [100, 75]].map(|pixel| place(&rig, lab::RIGHT, pixel));
    let empty = rig.mask(lab::RIGHT);
    // Without the tool a drag turns the view.
    rig.drag_over(&[from, to]);
    assert_eq!(rig.mask(lab::RIGHT), empty);
    look(&mut rig, CameraPreset::Right);
    rig.key(Modifiers::ALT, Key::B);
    assert_eq!(rig.state().workbench.tool, SceneTool::Paint);
    let [from, to] = [[70, 60], [100, 75]].map(|pixel| place(&rig, lab::RIGHT, pixel));
    rig.drag_over(&[from, to]);
    assert_eq!(place(&rig, lab::RIGHT, [70, 60]), from, "the view rests");
    let drawn = rig.mask(lab::RIGHT);
    // A way of 34 px, 8 px wide and with round ends, seen at an angle.
    assert!(drawn[(70, 60)] && drawn[(85, 67)] && drawn[(100, 75)], "what is under the pointer");
    let new = count(&drawn) - count(&empty);
    assert!((150..600).contains(&new), "{new}");
    rig.harness.query_by_label_contains("draws on front-most points").expect("the status line says what is reached");
    rig.key(Modifiers::CTRL, Key::Z);
    assert_eq!(rig.mask(lab::RIGHT), empty, "one undo takes it back");
    // With Shift the pointer turns the view and draws nothing.
    let press = |pressed| Event::PointerButton {
        pos: from,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::SHIFT,
    };
    rig.harness.hover_at(from);
    rig.harness.event(press(true));
    rig.harness.event(press(false));
    rig.harness.step();
    rig.settle();
    assert_eq!(rig.mask(lab::RIGHT), empty);
    // From the other side the other finger is meant: the first press makes it the active one.
    let left = rig.mask(lab::LEFT);
    look(&mut rig, CameraPreset::Left);
    let [from, to] = [[70, 60], [100, 75]].map(|pixel| place(&rig, lab::LEFT, pixel));
    rig.drag_over(&[from, to]);
    assert_eq!(rig.state().selection.finger, lab::LEFT);
    assert_eq!(rig.mask(lab::LEFT), left);
    rig.harness.key_press(Key::L);
    rig.harness.step();
    let corners = [[60, 50], [110, 50], [110, 90], [60, 90]].map(|pixel| place(&rig, lab::LEFT, pixel));
    rig.drag_over(&corners);
    assert_eq!(rig.mask(lab::RIGHT), empty, "one finger's mask");
    let lassoed = count(&rig.mask(lab::LEFT)) - count(&left);
    assert!((1000..2600).contains(&lassoed), "{lassoed} of 50 x 40");
    rig.key(Modifiers::ALT, Key::L);
    assert_eq!(rig.state().settings.mask.layers, Layers::All);
    rig.harness.hover_at(from);
    rig.settle();
    rig.harness.query_by_label_contains("draws on all points").expect("it says so");
}

#[test]
fn an_export_says_what_goes_where_before_it_writes() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(LabelsCommand::AdoptAutomatic);
    rig.send(LibraryCommand::Step(1));
    rig.send(LabelsCommand::AdoptAutomatic);
    rig.send(LabelsCommand::SetReview(Review::Done));
    rig.send(LibraryCommand::Step(1));
    rig.send(LabelsCommand::SetReview(Review::Skip));
    rig.key(Modifiers::CTRL, Key::E);
    let said = rig.plan();
    // Done accepted the other finger's automatic mask.
    assert_eq!(said[0], "2 masks");
    assert!(said.iter().any(|line| line.contains("1 pair begun")) && said.iter().any(|line| line.contains("skip")));
    // What is marked beside the form is in the next plan.
    rig.send(LabelsCommand::SetReview(Review::Done));
    assert_eq!(rig.plan()[0], "4 masks");
    rig.clicks(&["done and in progress"]);
    assert_eq!(rig.plan()[0], "5 masks");
    let folder = rig.data.join("training");
    rig.clicks(&["Choose the folder of the export"]);
    rig.take_to(&folder);
    let written: usize = ["train", "val", "test"]
        .iter()
        .map(|part| std::fs::read_dir(folder.join(part).join("masks")).unwrap().count())
        .sum();
    assert_eq!(written, 5);
    assert!(list(&folder, None).unwrap().refused.is_empty());
    let state = rig.state();
    assert_eq!(state.log.entries.back().unwrap().place.as_deref(), Some(&*folder), "the note leads there");
    assert!(!state.export.asking_masks);
}

#[test]
fn undo_and_redo_go_on_where_they_were_after_a_restart() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    with_nothing_automatic(&mut rig);
    rig.send(prefer(|s| s.person = "Anna".into()));
    let picture = |rig: &Rig| rig.harness.get_by_label("Measured imprint right").rect();
    let mut masks = vec![rig.mask(lab::RIGHT)];
    for way in [[[0.2, 0.2], [0.4, 0.3]], [[0.6, 0.6], [0.8, 0.7]], [[0.5, 0.1], [0.9, 0.1]]] {
        let rect = picture(&rig);
        rig.drag_over(&way.map(|[x, y]| inside(rect, x, y)));
        masks.push(rig.mask(lab::RIGHT));
    }
    rig.send(LabelsCommand::CleanUp(rig.state().settings.mask.clean_up(CleanKind::Grow)));
    masks.push(rig.mask(lab::RIGHT));
    rig.send(LabelsCommand::Undo);
    assert!(masks.windows(2).all(|pair| pair[0] != pair[1]));
    // Who did it stands in the file and in the journal.
    let store = MaskStore::for_dataset(&Dataset::open(&rig.data).unwrap()).unwrap();
    let name = rig.state().pair_name().to_owned();
    assert_eq!(store.load(&name, lab::RIGHT).unwrap().unwrap().person, "Anna");
    let journal = String::from_utf8(store.journal(&name).unwrap()).unwrap();
    assert_eq!(journal.lines().filter(|line| line.contains("\"person\":\"Anna\"")).count(), 5, "{journal}");
    assert!(journal.lines().next().unwrap().contains("\"tool\":\"brush\""));
    rig.restart(SIZE);
    assert_eq!(rig.mask(lab::RIGHT), masks[3]);
    let names = |rig: &Rig| -> Vec<String> {
        rig.state().history.done().iter().map(|gesture| gesture.name.to_string()).collect()
    };
    assert_eq!(names(&rig), ["brush stroke"; 3]);
    rig.send(LabelsCommand::Redo);
    assert_eq!(rig.mask(lab::RIGHT), masks[4], "what was taken back before");
    for mask in masks[..4].iter().rev() {
        rig.send(LabelsCommand::Undo);
        assert_eq!(rig.mask(lab::RIGHT), *mask);
    }
    assert_eq!(rig.state().document.review(rig.state().pair_name()), Review::Todo);
    rig.restart(SIZE);
    assert!(names(&rig).is_empty());
    for mask in &masks[1..] {
        rig.send(LabelsCommand::Redo);
        assert_eq!(rig.mask(lab::RIGHT), *mask);
    }
    // Another program changes the mask: what led elsewhere cannot be taken back any more.
    let dataset = Dataset::open(&rig.data).unwrap();
    let name = rig.state().pair_name().to_owned();
    let store = MaskStore::for_dataset(&dataset).unwrap();
    store.save(&name, lab::RIGHT, None).unwrap();
    rig.restart(SIZE);
    assert!(names(&rig).is_empty());
    assert_eq!(rig.mask(lab::RIGHT), masks[0]);
}

#[test]
fn masks_are_exported_as_pictures_and_imported_again_by_clicks() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    with_nothing_automatic(&mut rig);
    rig.send(LabelsCommand::AdoptAutomatic);
    let at = rig.harness.get_by_label("Measured imprint right").rect();
    rig.drag_over(&[inside(at, 0.3, 0.4), inside(at, 0.6, 0.5)]);
    let drawn = rig.mask(lab::RIGHT);
    rig.send(LabelsCommand::SetReview(Review::Done));
    rig.clicks(&["Open", "Export masks…"]);
    rig.clicks(&["PNG"]);
    let folder = rig.data.join("pictures");
    rig.clicks(&["Choose the folder of the export"]);
    rig.take_to(&folder);
    assert!(folder.join("train").is_dir());
    rig.harness.get_all_by_label("Open folder").next().expect("the note opens the folder");

    // The mask is another one when it comes back, and nobody judged the pair.
    rig.send(LabelsCommand::SetReview(Review::Todo));
    rig.send(LabelsCommand::ResetMask);
    assert_ne!(rig.mask(lab::RIGHT), drawn);
    rig.clicks(&["Open", "Import masks…"]);
    rig.take_to(&folder);
    rig.harness.get_by_label("Format: PNG");
    rig.harness.get_by_label("1 mask new");
    rig.clicks(&["Import these masks"]);
    assert_eq!(rig.mask(lab::RIGHT), drawn);
    rig.key(Modifiers::CTRL, Key::Z);
    assert_ne!(rig.mask(lab::RIGHT), drawn, "undo brings back what was");

    // What cannot be read is said in the form, with its place.
    rig.clicks(&["Open", "Import masks…"]);
    let empty = rig.data.join("empty");
    std::fs::create_dir(&empty).unwrap();
    rig.take_to(&empty);
    rig.harness.get_by_label_contains("there are no masks here");
    rig.key(Modifiers::NONE, Key::Escape);
    assert!(rig.state().export.importing.is_none());
}
