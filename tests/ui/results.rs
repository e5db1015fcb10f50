//! The results table of the Evaluate workspace, with the shipped models on a few simulated grasps.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Command, LibraryCommand, Pane, SettingsCommand, UiRequest, ViewCommand};
use touch2touch::app::evaluate::EvaluateCommand;
use touch2touch::app::library::{Place, Sort};
use touch2touch::app::settings::Workspace;
use touch2touch::domain::evaluation::Figure;

use super::rig::{Rig, write_dataset};

#[test]
fn a_table_is_made_by_a_click_shown_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    write_dataset(&data, 2);
    let Some(mut rig) = Rig::live([1280.0, 800.0], Place::Path(data.clone())) else { return };
    rig.send(SettingsCommand::DismissHint);
    rig.send(SettingsCommand::SetWorkspace(Workspace::Evaluate));
    assert!(rig.harness.state().state().selection.panes.contains(&Pane::Results));
    rig.shoot("results-before");

    rig.harness.get_by_label("Evaluate the data set").click();
    rig.harness.step();
    rig.settle();
    let table = rig.harness.state().state().table.result.clone().expect("the table is there");
    assert!(table.complete && table.skipped.is_empty(), "{:?}", table.skipped);
    let generators = rig.harness.state().state().evaluated().count();
    assert_eq!((table.rows.len(), table.groups.len()), (1 + generators, 1), "the upper bound and every generator");
    let figures = &table.rows[1].groups[0];
    assert_eq!((figures.grasps, figures.images), (4, 8));
    assert!(figures.psnr_db.unwrap().value > 15.0 && figures.success_10.is_some());
    let row = format!("{}: 4 grasps, 8 images", table.rows[1].method);
    rig.harness.get_by_label(&row);
    rig.shoot("results-after");
    rig.send(Command::Evaluate(EvaluateCommand::Published(true)));
    rig.harness.get_by_label_contains("Measured (upper bound)");

    let out = folder.path().join("out");
    rig.send(Command::Evaluate(EvaluateCommand::Export(out.clone())));
    let csv = std::fs::read_to_string(out.join("evaluation.csv")).unwrap();
    assert!(csv.contains("Paper: latent diffusion") && csv.contains(&table.rows[1].method), "{csv}");
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("evaluation.json")).unwrap()).unwrap();
    assert_eq!(json["pairs"].as_array().unwrap().len(), table.rows.len());
    assert!(out.join("evaluation.md").is_file());

    // The worst first: by key, and the list says the figure.
    let scored: Vec<f64> = {
        let found = &rig.harness.state().state().table;
        found.scored().iter().map(|grasp| grasp.angle_error_rad.unwrap()).collect()
    };
    let mut errors = scored.clone();
    errors.sort_by(|a, b| b.total_cmp(a));
    for wanted in &errors[..2] {
        rig.harness.key_press_modifiers(Modifiers::NONE, Key::N);
        rig.harness.step();
        rig.settle();
        let state = rig.harness.state().state();
        assert_eq!(state.library.sort, Sort::WorstAngle);
        assert_eq!(state.table.figure(state.pair_name(), Figure::Angle), Some(*wanted));
    }
    rig.shoot("results-worst");

    // A table is of one data set.
    rig.send(LibraryCommand::Open(Place::Demo));
    assert!(rig.harness.state().state().table.result.is_none());
}

/// Pictures of the test set's table, for looking at.
#[test]
#[ignore = "pictures for looking at, into the folder TOUCH2TOUCH_SCREENSHOTS"]
fn pictures_of_the_results() {
    for (size, name) in [([1280.0, 800.0], "1280"), ([1920.0, 1080.0], "1920")] {
        let Some(mut rig) = Rig::live(size, Place::Path("test-set".into())) else { return };
        rig.send(SettingsCommand::DismissHint);
        rig.send(SettingsCommand::SetWorkspace(Workspace::Evaluate));
        rig.shoot(&format!("{name}-results-empty"));
        rig.send(ViewCommand::Ui(UiRequest::ShowPane(Pane::Adapt)));
        rig.shoot(&format!("{name}-fit-empty"));
        rig.send(ViewCommand::Ui(UiRequest::ShowPane(Pane::Results)));
        rig.send(Command::Evaluate(EvaluateCommand::Grasps(Some(1))));
        rig.send(Command::Evaluate(EvaluateCommand::Published(true)));
        rig.send(Command::Evaluate(EvaluateCommand::Start));
        rig.shoot(&format!("{name}-results"));
    }
}
