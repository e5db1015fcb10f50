//! Generating as a person sees it: the picture on the way, the presets, the result that is there again after a restart.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{PredictCommand, TasksCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch_core::rig::lab;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

#[test]
fn the_picture_on_the_way_is_shown_until_the_result_lands() {
    let Some(mut rig) = Rig::threaded(SIZE) else { return };
    // So many steps that nobody sees the end of them.
    rig.harness.state_mut().push(prefer(|s| (s.generate.preset, s.generate.steps) = (None, 1000)));
    rig.harness.state_mut().push(PredictCommand::Generate);
    rig.until("a preview", |state| results::preview(state, lab::RIGHT).is_some());
    for _ in 0..3 {
        rig.harness.step();
    }
    assert!(rig.harness.query_by_label("Predicted imprint right, preview").is_some());
    assert!(rig.harness.query_by_label("Predicted imprint right").is_none(), "it is not taken for the result");
    let state = rig.state();
    assert!(results::imprint(state, ImprintSource::Predicted, lab::RIGHT).ready().is_none());
    rig.harness.state_mut().push(TasksCommand::CancelAll);
    rig.until("the end", |state| state.tasks.running.is_empty());
    // What was under way is not shown any more; two steps end by themselves.
    rig.harness.state_mut().push(prefer(|s| s.generate.steps = 2));
    rig.harness.state_mut().push(PredictCommand::Generate);
    rig.until("the result", |state| results::imprint(state, ImprintSource::Predicted, lab::RIGHT).ready().is_some());
    for _ in 0..3 {
        rig.harness.step();
    }
    assert!(rig.harness.query_by_label("Predicted imprint right, preview").is_none());
    assert!(rig.harness.query_by_label("Predicted imprint right").is_some());
    assert!(results::preview(rig.state(), lab::RIGHT).is_none());
}
