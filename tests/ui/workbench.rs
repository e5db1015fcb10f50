//! The workbench by keys, clicks and drags: layers, poses by hand, reading points.

use eframe::egui::{Key, Modifiers, Pos2, Vec2, vec2};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{CameraPreset, TasksCommand, UiRequest, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskSource, Workspace};
use touch2touch::app::workbench::{ManualTry, SceneTool};
use touch2touch_core::manual::{PoseAxis, PoseDifference, STEP_M, STEP_RAD};
use touch2touch_core::rig::lab;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::MaskStore;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];
const MEASURED: ImprintSource = ImprintSource::Measured;
const VIEW: &str = "3D view, measured";

impl Rig {
    /// A place in the measured view by shares of its rectangle.
    fn in_view(&self, share: [f32; 2]) -> Pos2 {
        let rect = self.harness.get_by_label(VIEW).rect();
        rect.min + vec2(share[0], share[1]) * rect.size()
    }

    fn move_to(&mut self, at: Pos2) {
        self.harness.hover_at(at);
        self.harness.step();
        self.harness.step();
    }

    pub(super) fn click_at(&mut self, at: Pos2) {
        self.move_to(at);
        self.harness.drag_at(at);
        self.harness.step();
        self.harness.drop_at(at);
        self.harness.step();
        self.settle();
    }

    fn drag(&mut self, from: Pos2, by: Vec2) {
        self.move_to(from);
        self.harness.drag_at(from);
        self.harness.step();
        for i in 1..=4 {
            self.harness.hover_at(from + by * (i as f32 / 4.0));
            self.harness.step();
        }
        self.harness.drop_at(from + by);
        self.harness.step();
        self.settle();
    }

    fn hand(&self) -> ManualTry {
        self.state().workbench.hand(MEASURED).expect("a pose in hand").clone()
    }

    /// The studio on the Align workspace with true masks, the pointer in the measured view, seen from the right.
    pub(super) fn aligned() -> Option<Self> {
        Self::new(SIZE, 1).map(Self::in_align)
    }

    fn in_align(mut self) -> Self {
        let rig = &mut self;
        rig.send(TasksCommand::LogSeen(u64::MAX));
        rig.send(prefer(|s| s.mask.choice.source = MaskSource::Truth));
        rig.send(prefer(|s| s.workspace = Workspace::Align));
        let middle = rig.in_view([0.5, 0.5]);
        rig.move_to(middle);
        rig.send(ViewCommand::Ui(UiRequest::Camera(CameraPreset::Right)));
        rig.send(ViewCommand::Ui(UiRequest::Fit));
        assert!(results::pose(rig.state(), MEASURED).ready().is_some());
        assert_eq!(rig.state().workbench.side, MEASURED, "the pointer says which side");
        self
    }
}

#[test]
fn keys_nudge_the_tool_accept_is_one_undoable_change_and_is_stored() {
    let Some(mut rig) = Rig::aligned() else { return };
    let name = rig.state().pair_name().to_owned();
    // Without the pose tool the keys move nothing.
    rig.key(Modifiers::NONE, Key::ArrowRight);
    assert!(rig.state().workbench.hand.is_none());
    rig.key(Modifiers::NONE, Key::Z);
    assert_eq!(rig.state().workbench.tool, SceneTool::Pose);
    let began = results::manual_begins(rig.state(), MEASURED);
    for (modifiers, key, axis, by) in [
        (Modifiers::NONE, Key::ArrowRight, PoseAxis::Y, STEP_M),
        (Modifiers::SHIFT, Key::ArrowLeft, PoseAxis::Y, -10.0 * STEP_M),
        (Modifiers::CTRL, Key::ArrowDown, PoseAxis::Z, 0.1 * STEP_M),
        (Modifiers::NONE, Key::ArrowUp, PoseAxis::Z, -STEP_M),
        (Modifiers::ALT, Key::ArrowRight, PoseAxis::Theta, STEP_RAD),
        (Modifiers::ALT | Modifiers::SHIFT, Key::ArrowLeft, PoseAxis::Theta, -10.0 * STEP_RAD),
    ] {
        let before = rig.state().workbench.hand(MEASURED).map_or(began, |hand| hand.pose);
        rig.key(modifiers, key);
        let (now, want) = (rig.hand().pose, axis.moved(before, by));
        let off = PoseDifference::between(now, want);
        assert!(off.angle_rad < 1e-12 && off.position_m < 1e-12, "{modifiers:?} {key:?}: {now:?} for {want:?}");
    }
    let hand = rig.hand();
    let (now, was) = (hand.cost.unwrap(), hand.began_cost.unwrap());
    assert!(now.cost_m2 > was.cost_m2, "4.5 degrees off costs more: {now:?} {was:?}");

    // Escape gives it up; nothing was written.
    rig.key(Modifiers::NONE, Key::Escape);
    assert!(rig.state().workbench.hand.is_none() && results::accepted(rig.state(), MEASURED).is_none());

    // Enter takes it over: one gesture, undone and done again, also on the disk.
    rig.key(Modifiers::SHIFT, Key::ArrowRight);
    let pose = rig.hand().pose;
    rig.key(Modifiers::NONE, Key::Enter);
    let stored = |rig: &Rig| {
        let dataset = Dataset::open(&rig.data).unwrap();
        let review = MaskStore::for_dataset(&dataset).unwrap().load_review(&name).unwrap();
        review.and_then(|r| r.accepted.accepted[0])
    };
    assert_eq!(results::by_hand(rig.state(), MEASURED), Some(pose));
    assert_eq!(stored(&rig).map(|a| (a.pose, a.by_hand)), Some((pose, true)));
    assert!(rig.harness.query_all_by_label_contains("Pose by hand").count() > 0, "the figures say so");
    rig.key(Modifiers::CTRL, Key::Z);
    assert_eq!((results::by_hand(rig.state(), MEASURED), stored(&rig)), (None, None));
    rig.key(Modifiers::CTRL | Modifiers::SHIFT, Key::Z);
    assert_eq!(results::by_hand(rig.state(), MEASURED), Some(pose));
    // After a restart it is still there.
    rig.restart(SIZE);
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    assert_eq!(results::by_hand(rig.state(), MEASURED), Some(pose));
}

#[test]
fn handles_move_and_turn_the_tool_and_not_the_view() {
    let Some(mut rig) = Rig::aligned() else { return };
    rig.key(Modifiers::NONE, Key::Z);
    let began = results::manual_begins(rig.state(), MEASURED);
    let origin = rig.harness.state().on_screen(MEASURED, [0.0, began.y_m, began.z_m]).unwrap();
    rig.drag(origin, vec2(30.0, 18.0));
    let moved = rig.hand().pose;
    assert!(moved.y_m != began.y_m && moved.z_m > began.z_m, "down is +z: {moved:?}");
    assert_eq!(moved.theta_rad, began.theta_rad);
    let at = rig.harness.state().on_screen(MEASURED, [0.0, moved.y_m, moved.z_m]).unwrap();
    assert!((at - origin - vec2(30.0, 18.0)).length() < 1.0, "the disc stays under the pointer: {at} from {origin}");
    // The ring: 62 points around the middle.
    rig.drag(at + vec2(62.0, 0.0), vec2(0.0, 25.0));
    let turned = rig.hand().pose;
    let by = (turned.theta_rad - moved.theta_rad).abs();
    assert!((by - (25.0f64 / 62.0).atan()).abs() < 0.06, "{} degrees", by.to_degrees());
    assert!((turned.y_m - moved.y_m).abs() < 1e-12);
    // Beside the handles the same drag turns the view.
    let corner = rig.in_view([0.2, 0.62]);
    rig.drag(corner, vec2(40.0, 0.0));
    assert_eq!(rig.hand().pose, turned);
}

#[test]
fn icp_starts_where_the_hand_left_the_tool() {
    let Some(mut rig) = Rig::aligned() else { return };
    rig.key(Modifiers::NONE, Key::Z);
    for _ in 0..2 {
        rig.key(Modifiers::SHIFT, Key::ArrowRight);
    }
    rig.key(Modifiers::ALT | Modifiers::SHIFT, Key::ArrowRight);
    let from = rig.hand().pose;
    rig.key(Modifiers::SHIFT, Key::Z);
    let hand = rig.hand();
    let run = hand.from_icp.expect("it came from a registration");
    assert_eq!(run.start.map(|s| s.get()), Some(from));
    let report = rig.state().results.runs.get(&run).unwrap().report();
    assert_eq!((report.start, report.runs.len()), (from, 1), "one start: this one");
    // It comes back to where the registration had been by itself.
    let off =
        PoseDifference::between(hand.pose, results::pose(rig.state(), MEASURED).ready().unwrap().grasp_from_object);
    assert!(off.angle_rad.to_degrees() < 1.0 && off.position_m < 1e-3, "{off:?}");
    assert!(hand.cost.unwrap().cost_m2 <= hand.began_cost.unwrap().cost_m2 * 1.05);
}

#[test]
fn a_clicked_point_says_all_about_itself() {
    let Some(mut rig) = Rig::aligned() else { return };
    let clouds = results::cloud(rig.state(), MEASURED).ready().unwrap();
    let cloud = clouds.finger(lab::RIGHT).unwrap();
    let contact = (0..cloud.points.len()).filter(|i| cloud.contact[*i]).nth(40).unwrap();
    let at = rig.harness.state().on_screen(MEASURED, cloud.points[contact].to_array()).unwrap();
    rig.click_at(at);
    let picked = rig.state().workbench.picked.expect("a point");
    let clouds = results::cloud(rig.state(), MEASURED).ready().unwrap();
    let layers = results::layers(rig.state(), MEASURED).ready().expect("reasons are there once they are shown");
    let (reason, _) = layers.at(picked.finger, clouds.finger(picked.finger).unwrap(), picked.pixel).unwrap();
    for label in [format!("Reason {reason}"), format!("Pixel {}", rig.state().finger_name(picked.finger))] {
        assert!(rig.harness.query_all_by_label_contains(&label).count() > 0, "{label}");
    }
    rig.key(Modifiers::NONE, Key::Escape);
    assert_eq!(rig.state().workbench.picked, None);
}
