//! After a stroke: what was before.

use eframe::egui::{Event, Key, Modifiers, PointerButton, pos2};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{LabelsCommand, LibraryCommand, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::library::Place;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{SceneLayer, Workspace};
use touch2touch::app::state::State;
use touch2touch::app::{labels, results};
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::lab;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];
const MEASURED: ImprintSource = ImprintSource::Measured;

impl Rig {
    /// A brush stroke by command, raw bubble pixels.
    fn dab(&mut self, from: [f32; 2], to: [f32; 2]) {
        let begin = LabelsCommand::BeginStroke { finger: lab::RIGHT, source: MEASURED, at_px: from, erase: false };
        self.send(begin);
        self.send(LabelsCommand::StrokeTo(to));
        self.send(LabelsCommand::EndStroke);
    }
}

fn state(rig: &Rig) -> &State {
    rig.harness.state().state()
}

#[test]
fn what_was_before_a_stroke_stays_visible_until_the_next_or_elsewhere() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    let mask = |rig: &Rig| results::mask_in_force(state(rig), MEASURED, lab::RIGHT).unwrap().mask.clone();
    let angle = |rig: &Rig| results::pose(state(rig), MEASURED).ready().unwrap().angle_rad;
    assert!(labels::ghost(state(&rig), MEASURED).is_none());
    let (first, first_angle) = (mask(&rig), angle(&rig));
    rig.dab([60.0, 40.0], [110.0, 60.0]);
    let (second, second_angle) = (mask(&rig), angle(&rig));
    assert!(first != second && first_angle != second_angle);
    let ghost = labels::ghost(state(&rig), MEASURED).unwrap();
    assert_eq!((ghost.finger, ghost.mask), (lab::RIGHT, &first));
    assert_eq!(ghost.pose.unwrap().angle_rad, first_angle);
    assert!(ghost.clouds.is_some());
    // The list of the 3D view says what was dropped and added, and where the model was.
    rig.harness.get_by_label("Legend").click();
    rig.harness.step();
    rig.settle();
    rig.shoot("label-ghost");
    assert!(rig.harness.query_all_by_label_contains("added: ").next().is_some());
    assert!(rig.harness.query_all_by_label_contains("CAD, before").next().is_some());
    // The next stroke has its own.
    rig.dab([60.0, 80.0], [110.0, 90.0]);
    assert_eq!(labels::ghost(state(&rig), MEASURED).unwrap().mask, &second);
    // A key switches them off and on; undo and going elsewhere end them.
    for shown in [false, true] {
        rig.harness.key_press_modifiers(Modifiers::SHIFT, Key::H);
        rig.harness.step();
        rig.settle();
        assert_eq!(labels::ghost(state(&rig), MEASURED).is_some(), shown);
    }
    rig.send(LabelsCommand::Undo);
    assert!(labels::ghost(state(&rig), MEASURED).is_none(), "it may be what was taken back");
    rig.dab([60.0, 80.0], [110.0, 90.0]);
    assert!(labels::ghost(state(&rig), MEASURED).is_some());
    rig.send(LibraryCommand::Step(1));
    rig.send(LibraryCommand::Step(-1));
    assert!(labels::ghost(state(&rig), MEASURED).is_none());
}

#[test]
#[ignore = "pictures for looking at, into the folder TOUCH2TOUCH_SCREENSHOTS"]
fn pictures_of_the_live_loop() {
    let Some(mut rig) = Rig::live(SIZE, Place::Demo) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(LibraryCommand::Select(PairId(30)));
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.dab([40.0, 50.0], [70.0, 60.0]);
    rig.shoot("live-ghost");
    let picture = rig.harness.get_by_label("Measured imprint right").rect();
    rig.harness.hover_at(picture.center());
    let scene = state(&rig).settings.scene.clone();
    assert!(scene.layer(SceneLayer::Before).shown);
    rig.send(LabelsCommand::ResetMask);
}
