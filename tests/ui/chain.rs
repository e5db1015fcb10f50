//! The depth chain: its flags, the refit, the parts seen and invented, and the warning of a bare shaft.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{LibraryCommand, PredictCommand};
use touch2touch::app::keys::ShiftMode;
use touch2touch::app::library::Place;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch_core::ambiguity::TouchKind;
use touch2touch_core::catalog;
use touch2touch_core::postprocess::FlagKind;
use touch2touch_core::rig::lab;
use touch2touch_core::sim;
use touch2touch_pipeline::io::simulated::{Layout, write_pair, write_tools};

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

#[test]
fn metrics_say_what_is_implausible() {
    let Some(mut rig) = Rig::new(SIZE, 3) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(PredictCommand::Generate);
    rig.send(prefer(|s| s.shift = ShiftMode::Raw));
    let found = results::flags(rig.harness.state().state(), lab::RIGHT).ready().expect("those of the finger shown");
    assert_eq!(found[0].kind, FlagKind::DoubledMapping);
    let what = found[0].what.clone();
    assert!(rig.harness.query_all_by_label_contains(&what).next().is_some(), "{what}");
    rig.shoot("test-flags");
    rig.send(prefer(|s| s.shift = ShiftMode::ExactInverse));
    let found = results::flags(rig.harness.state().state(), lab::RIGHT).ready().unwrap();
    assert!(found.iter().all(|flag| flag.kind != FlagKind::DoubledMapping), "{found:?}");
    assert!(rig.harness.query_all_by_label_contains(&what).next().is_none());
}

#[test]
fn a_refit_is_computed_used_kept_and_refused_by_another_model() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(PredictCommand::Generate);
    rig.send(PredictCommand::Refit);
    let state = rig.harness.state().state();
    let ShiftMode::Refit(refit) = state.settings.shift else { panic!("{:?}", state.settings.shift) };
    assert!(state.log.entries.iter().any(|e| e.text.contains("Shift statistics of 8 touches")), "{:?}", state.log);
    let kept = std::fs::read_dir(rig.config.join("statistics")).unwrap().count();
    assert_eq!(kept, 1);
    // The mean of what is predicted is that of what is measured, over the data set.
    assert!(refit.stats().gt_std > 0.0 && refit.check("quick").is_ok() && refit.check("other").is_err());
    // It is a choice like the others from now on, and survives a restart.
    rig.send(prefer(|s| s.shift = ShiftMode::Raw));
    rig.restart(SIZE);
    assert_eq!(rig.harness.state().state().settings.refit, Some(refit));
}

#[test]
fn seen_and_invented_stand_beside_each_other_and_a_bare_shaft_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let tool = catalog::on_a_shaft(catalog::tools()[3].clone());
    let config = sim::SimConfig::default();
    for index in 0..2 {
        let sample = sim::simulate(&tool, sim::random_grasp(index), index, &config);
        write_pair(folder.path(), Layout::Train, &tool.name, index, &sample).unwrap();
    }
    write_tools(folder.path(), &[(tool.name.as_str(), true, tool.mesh())]).unwrap();
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(LibraryCommand::Open(Place::Path(folder.path().to_owned())));
    rig.send(PredictCommand::Generate);
    let state = rig.harness.state().state();
    assert_eq!(results::ambiguity(state, lab::RIGHT).unwrap().kind, TouchKind::BareShaft);
    let split = results::comparison(state, lab::RIGHT).ready().unwrap().split.unwrap();
    assert!(split.seen.pixels > 1000 && split.invented.pixels > 10 * split.seen.pixels);
    for label in ["Seen ", "Invented ", "The gel shows a bare shaft"] {
        assert!(rig.harness.query_all_by_label_contains(label).next().is_some(), "{label}");
    }
    rig.shoot("test-bare-shaft");
}
