//! The steps of a registration, by keys and clicks.

use eframe::egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::Pane;
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskSource, Workspace};

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

impl Rig {
    /// Moves the pointer to a share of the widget's rectangle, and clicks there.
    fn click_in(&mut self, label: &str, share: [f32; 2]) {
        let rect = self.harness.get_by_label(label).rect();
        let at = rect.min + vec2(share[0], share[1]) * rect.size();
        self.click_at(at);
    }

    fn at(&self) -> [usize; 2] {
        let shown = results::inspected(self.state()).expect("a step is shown");
        [shown.run, shown.at]
    }

    /// The Align workspace on a grasp with its true contact.
    fn align() -> Option<Self> {
        let mut rig = Self::new(SIZE, 1)?;
        rig.send(prefer(|s| s.mask.choice.source = MaskSource::Truth));
        assert!(rig.state().results.runs.is_empty(), "nobody looks yet");
        rig.send(prefer(|s| s.workspace = Workspace::Align));
        Some(rig)
    }
}

#[test]
fn steps_by_keys_by_the_slider_and_in_the_curves() {
    let Some(mut rig) = Rig::align() else { return };
    let state = rig.state();
    assert!(state.selection.panes.contains(&Pane::Steps));
    let shown = results::inspected(state).expect("the winner's last step");
    let (run, last) = (shown.run, shown.at);
    assert!(shown.is_last() && last > 3);
    assert_eq!(
        shown.step.grasp_from_object,
        results::pose(state, ImprintSource::Measured).ready().unwrap().grasp_from_object,
        "at its end it shows the registered pose"
    );
    rig.key(Modifiers::NONE, Key::Comma);
    rig.key(Modifiers::NONE, Key::Comma);
    assert_eq!(rig.at(), [run, last - 2]);
    rig.key(Modifiers::NONE, Key::Period);
    assert_eq!(rig.at(), [run, last - 1]);
    // The slider and the curves do the same.
    rig.click_in("Step", [0.01, 0.5]);
    assert_eq!(rig.at(), [run, 0]);
    rig.click_in("Step", [0.99, 0.5]);
    assert_eq!(rig.at(), [run, last]);
    rig.click_in("Cost over the steps", [0.35, 0.5]);
    let [_, at] = rig.at();
    assert!(at > 0 && at < last, "{at}");
    // Another start by its button.
    rig.click("Start 1");
    assert_eq!(rig.at()[0], 0);
    assert_eq!(rig.state().results.runs.len(), 1, "scrubbing registers nothing");
}
