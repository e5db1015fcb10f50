//! Generating as a person sees it: the picture on the way, the presets, the result that is there again after a restart.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::PredictCommand;
use touch2touch::app::keys::{ImprintSource, Preset};
use touch2touch::app::settings::prefer;
use touch2touch::app::{recipe, results};
use touch2touch_core::rig::lab;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

#[test]
fn the_picture_on_the_way_is_shown_until_the_result_lands() {
    let Some((mut rig, gate)) = Rig::gated(SIZE) else { return };
    rig.harness.state_mut().push(prefer(|s| s.hint_dismissed = true));
    rig.harness.state_mut().push(PredictCommand::Generate);
    rig.until("a preview", |state| results::preview(state, lab::RIGHT).is_some());
    for _ in 0..3 {
        rig.harness.step();
    }
    assert!(rig.harness.query_by_label("Predicted imprint right, preview").is_some());
    assert!(rig.harness.query_by_label("Predicted imprint right").is_none(), "it is not taken for the result");
    rig.shoot("generate-preview");
    let state = rig.harness.state().state();
    assert!(results::imprint(state, ImprintSource::Predicted, lab::RIGHT).ready().is_none());
    assert_eq!(results::preview(state, lab::RIGHT).unwrap().picture.step, 4);
    gate.open();
    rig.until("the result", |state| results::imprint(state, ImprintSource::Predicted, lab::RIGHT).ready().is_some());
    for _ in 0..3 {
        rig.harness.step();
    }
    assert!(rig.harness.query_by_label("Predicted imprint right, preview").is_none());
    assert!(rig.harness.query_by_label("Predicted imprint right").is_some());
    assert!(results::preview(rig.harness.state().state(), lab::RIGHT).is_none());
}

#[test]
fn a_color_sensor_is_predicted_in_the_same_pane() {
    let Some(mut rig) = Rig::with_bundle(SIZE, "Tiny generator from Soft Bubble to GelSlim") else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(PredictCommand::Generate);
    let state = rig.harness.state().state();
    let picture =
        results::predicted_color(state, lab::RIGHT).expect("the model predicts a color picture").ready().unwrap();
    assert_eq!(picture.size(), lab::GELSLIM.size());
    assert!(rig.harness.query_by_label("Predicted imprint right").is_some(), "the picture, not a sentence");
    rig.shoot("generate-color");
}

#[test]
fn presets_are_one_click_and_show_their_numbers() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    let steps = |rig: &Rig| {
        let state = rig.harness.state().state();
        recipe::prediction(state, state.touch_key(lab::RIGHT).unwrap()).unwrap().config.steps
    };
    assert_eq!(steps(&rig), 4, "what the bundle recommends");
    for (label, preset) in [("Fast", Preset::Fast), ("Sharp", Preset::Sharp), ("Default", Preset::Default)] {
        let node = rig.harness.get_all_by_label(label).next().unwrap_or_else(|| panic!("no {label}"));
        node.click();
        rig.harness.step();
        rig.settle();
        assert_eq!(rig.harness.state().state().settings.generate.preset, Some(preset));
        rig.shoot(&format!("generate-{}", label.to_lowercase()));
    }
    assert_eq!(steps(&rig), 4);
    assert!(rig.harness.query_by_label("Guidance").is_none(), "this bundle was not trained for it");
}
