//! The depth chain: its pane, its flags, the refit, the parts seen and invented, and the warning of a bare shaft.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{LibraryCommand, Pane, PredictCommand, UiRequest, ViewCommand};
use touch2touch::app::keys::ShiftMode;
use touch2touch::app::library::Place;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{Theme, Workspace};
use touch2touch_core::ambiguity::TouchKind;
use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::postprocess::FlagKind;
use touch2touch_core::rig::lab;
use touch2touch_core::sim;
use touch2touch_work::io::simulated::{Layout, write_pair, write_tools};

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

impl Rig {
    fn take(&mut self, label: &str) {
        self.harness.get_all_by_label(label).next().expect(label).click();
        self.harness.step();
        self.settle();
    }

    fn chains(&self) -> usize {
        self.harness.state().state().results.ledgers.len()
    }
}

#[test]
fn the_pane_shows_every_stage_and_only_where_it_is_seen() {
    let Some(mut rig) = Rig::new(SIZE, 3) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    rig.send(PredictCommand::Generate);
    rig.send(prefer(|s| s.workspace = Workspace::Evaluate));
    rig.fill("Compare");
    assert!(!rig.harness.state().state().selection.panes.contains(&Pane::Ledger));
    let chains = rig.chains();
    rig.send(prefer(|s| s.shift = ShiftMode::Raw));
    assert_eq!(rig.chains(), chains, "out of sight nothing is computed");
    rig.take("Back to all panes");
    // By the palette's action, from a workspace that has no such pane.
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    rig.send(ViewCommand::Ui(UiRequest::ShowPane(Pane::Ledger)));
    let state = rig.harness.state().state();
    assert_eq!(state.settings.workspace, Workspace::Inspect);
    assert!(state.selection.panes.contains(&Pane::Ledger));
    let found = results::ledger(state, lab::RIGHT).ready().expect("the chain of the finger shown");
    assert_eq!(found.ledger.flags[0].kind, FlagKind::DoubledMapping);
    for stage in &found.ledger.stages {
        let name = format!("Stage {}:", stage.stage.name());
        assert!(rig.harness.query_all_by_label_contains(&name).next().is_some(), "{name}");
    }
    assert!(rig.harness.query_all_by_label_contains("Joint histogram: slope").next().is_some());
    let what = found.ledger.flags[0].what.clone();
    assert!(rig.harness.query_all_by_label_contains(&what).next().is_some(), "{what}");
    rig.shoot("test-depth-chain-raw");
    // A reading is taken by a click; the flag goes.
    rig.fill("Depth chain");
    rig.take("Reading Exact inverse");
    let state = rig.harness.state().state();
    assert_eq!(state.settings.shift, ShiftMode::ExactInverse);
    let found = results::ledger(state, lab::RIGHT).ready().unwrap();
    assert!(found.ledger.flags.iter().all(|f| f.kind != FlagKind::DoubledMapping), "{:?}", found.ledger.flags);
    rig.take("Depth chain of the left finger");
    rig.shoot("test-depth-chain-maximized");
    assert_eq!(rig.harness.state().state().selection.finger, lab::LEFT);
    assert!(results::ledger(rig.harness.state().state(), lab::LEFT).ready().is_some());
}

#[test]
fn a_refit_is_computed_used_kept_and_refused_by_another_model() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(PredictCommand::Generate);
    rig.send(ViewCommand::Ui(UiRequest::ShowPane(Pane::Ledger)));
    rig.take("Refit on this data set");
    let state = rig.harness.state().state();
    let ShiftMode::Refit(refit) = state.settings.shift else { panic!("{:?}", state.settings.shift) };
    assert!(state.log.entries.iter().any(|e| e.text.contains("Shift statistics of 8 touches")), "{:?}", state.log);
    assert!(results::ledger(state, lab::RIGHT).ready().is_some());
    let kept = std::fs::read_dir(rig.config.join("statistics")).unwrap().count();
    assert_eq!(kept, 1);
    // The mean of what is predicted is that of what is measured, over the data set.
    assert!(refit.stats().gt_std > 0.0 && refit.check("quick").is_ok() && refit.check("other").is_err());
    rig.shoot("test-depth-chain-refit");
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

/// Pictures for looking at, with the shipped model: only where a folder for them is given.
#[test]
#[ignore = "pictures for looking at, into the folder TOUCH2TOUCH_SCREENSHOTS"]
fn pictures_of_the_depth_chain() {
    for (size, name) in [([1280.0, 800.0], "1280"), ([1920.0, 1080.0], "1920")] {
        let Some(mut rig) = Rig::live(size, Place::Demo) else { return };
        rig.send(prefer(|s| s.hint_dismissed = true));
        rig.send(LibraryCommand::Select(PairId(30)));
        rig.send(PredictCommand::Generate);
        rig.send(ViewCommand::Ui(UiRequest::ShowPane(Pane::Ledger)));
        for theme in [Theme::Dark, Theme::Light] {
            rig.send(prefer(move |s| s.theme = theme));
            rig.send(prefer(|s| s.shift = ShiftMode::ExactInverse));
            rig.shoot(&format!("{name}-chain-{theme:?}").to_lowercase());
            rig.fill("Depth chain");
            rig.send(prefer(|s| s.shift = ShiftMode::Raw));
            rig.shoot(&format!("{name}-chain-full-{theme:?}").to_lowercase());
            rig.take("Back to all panes");
        }
    }
}
