//! Following a folder: what arrives is listed, shown, predicted and posed.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::results;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;
use touch2touch::app::state::{Absent, Lookup};
use touch2touch_core::catalog;
use touch2touch_core::rig::lab;
use touch2touch_core::sim;
use touch2touch_pipeline::io::simulated::{Layout, pair_paths, write_pair};

use super::rig::Rig;

#[test]
fn what_arrives_in_a_followed_folder_is_shown_predicted_and_posed() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 2) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    let names = |rig: &Rig| -> Vec<String> { rig.state().library.pairs().iter().map(|p| p.name.clone()).collect() };
    let before = names(&rig);
    let follow = |rig: &mut Rig| {
        rig.key(Modifiers::CTRL | Modifiers::SHIFT, Key::F);
    };
    follow(&mut rig);
    assert!(rig.harness.query_by_label("Stop following").is_some(), "the status says that it follows");

    // A whole grasp.
    let tool = &catalog::tools()[6];
    let sample = |seed| sim::simulate(tool, sim::random_grasp(seed), seed, &sim::SimConfig::default());
    write_pair(&rig.data, Layout::Train, &tool.name, 40, &sample(40)).unwrap();
    rig.harness.step();
    rig.settle();
    let state = rig.state();
    assert_eq!(names(&rig)[..before.len()], before, "the pairs before keep their places");
    assert!(state.pair_name().ends_with("data_40"), "{}", state.pair_name());
    assert!(results::imprint(state, ImprintSource::Predicted, lab::RIGHT).ready().is_some());
    assert!(results::imprint(state, ImprintSource::Measured, lab::RIGHT).ready().is_some());
    assert!(
        results::pose(state, ImprintSource::Predicted).ready().is_some(),
        "{:?}",
        results::pose(state, ImprintSource::Predicted)
    );

    // A GelSlim touch alone: predicted, and posed with the cameras of the others.
    let elsewhere = tempfile::tempdir().unwrap();
    let [gelslim, _] = write_pair(elsewhere.path(), Layout::Train, &tool.name, 41, &sample(41)).unwrap();
    let place = pair_paths(&rig.data, Layout::Train, &tool.name, 41)[0].clone();
    std::fs::copy(gelslim, &place).unwrap();
    rig.harness.step();
    rig.settle();
    let state = rig.state();
    assert!(state.pair_name().ends_with("data_41"), "{}", state.pair_name());
    let measured = results::imprint(state, ImprintSource::Measured, lab::RIGHT);
    assert!(matches!(measured, Lookup::Absent(Absent::NoBubble)), "{measured:?}");
    assert!(results::imprint(state, ImprintSource::Predicted, lab::RIGHT).ready().is_some());
    assert!(
        results::pose(state, ImprintSource::Predicted).ready().is_some(),
        "{:?}",
        results::pose(state, ImprintSource::Predicted)
    );
    assert_eq!(state.library.follow.as_ref().unwrap().arrived, 2);
    rig.send(prefer(|s| s.workspace = Workspace::Inspect));
    let image = rig.harness.render().unwrap();
    assert!(image.pixels().any(|p| p.0[..3] != [0; 3]), "an empty thumbnail must not black out the window");

    // Stopped by its button: what comes now is not looked at, until the folder is read again.
    rig.click("Stop following");
    assert!(rig.harness.query_by_label("Stop following").is_none());
    write_pair(&rig.data, Layout::Train, &tool.name, 42, &sample(42)).unwrap();
    rig.harness.step();
    rig.settle();
    assert_eq!(names(&rig).len(), before.len() + 2);
}
