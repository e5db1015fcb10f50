//! The results table of the Evaluate workspace, with the shipped models on a few simulated grasps.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Command, LibraryCommand, Pane};
use touch2touch::app::evaluate::EvaluateCommand;
use touch2touch::app::library::{Place, Sort};
use touch2touch::app::results;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;
use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::Metric;

use super::rig::{Rig, write_dataset};

#[test]
fn a_table_is_made_by_a_click_shown_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("grasps");
    write_dataset(&data, 2);
    let Some(mut rig) = Rig::live([1280.0, 800.0], Place::Path(data.clone())) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Evaluate));
    assert!(rig.state().selection.panes.contains(&Pane::Results));

    rig.click("Predict all");
    let table = rig.state().table.result.clone().expect("the table is there");
    assert!(table.complete && table.skipped.is_empty(), "{:?}", table.skipped);
    let generators = results::evaluated(rig.state()).count();
    assert_eq!((table.rows.len(), table.groups.len()), (1 + generators, 1), "the upper bound and every generator");
    let figures = &table.rows[1].groups[0];
    assert_eq!((figures.grasps, figures.images), (4, 8));
    assert!(figures.named("psnr_db").unwrap().value > 15.0 && figures.named("success_10").is_some());
    let row = format!("{}: 4 grasps, 8 images", table.rows[1].method);
    rig.harness.get_by_label(&row);
    rig.send(Command::Evaluate(EvaluateCommand::Published(true)));
    rig.harness.get_by_label_contains("Measured (upper bound)");

    let out = folder.path().join("out");
    rig.send(Command::Evaluate(EvaluateCommand::Export(out.clone())));
    let csv = std::fs::read_to_string(out.join("evaluation.csv")).unwrap();
    assert!(csv.contains("Paper: latent diffusion") && csv.contains(&table.rows[1].method), "{csv}");
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(out.join("evaluation.json")).unwrap()).unwrap();
    assert_eq!(json["pairs"].as_array().unwrap().len(), table.rows.len());

    // The scores of all pairs are those of the table.
    let value = |rig: &Rig, source: usize, pair: u32, metric: Metric| {
        rig.state().table.scores.sources[source].value(PairId(pair), metric)
    };
    for (source, scores) in table.scores.iter().enumerate() {
        for grasp in &scores.grasps {
            let index = &rig.state().library.open.as_ref().unwrap().source.clone();
            let pair = index.dataset.index.pairs.iter().position(|entry| entry.name == grasp.pair).unwrap() as u32;
            assert_eq!(value(&rig, source, pair, Metric::Angle), grasp.angle_error_rad);
            assert_eq!(value(&rig, source, pair, Metric::Psnr), grasp.metric(Metric::Psnr));
        }
    }
    // The worst first: by key, and the list says the metric.
    let mut errors: Vec<f64> = (0..4).map(|pair| value(&rig, 1, pair, Metric::Angle).unwrap()).collect();
    errors.sort_by(|a, b| b.total_cmp(a));
    for wanted in &errors[..2] {
        rig.key(Modifiers::NONE, Key::N);
        let state = rig.state();
        assert_eq!(state.library.sort, Sort::Score);
        assert_eq!(state.table.value(state.selection.pair.unwrap()), Some(*wanted));
    }

    // By another score, the other way round, from the table's heading.
    let heading = "Sort by PSNR";
    let listed = |rig: &Rig| {
        let state = rig.state();
        state.library.order.iter().map(|pair| value(rig, 1, pair.0, Metric::Psnr).unwrap()).collect::<Vec<f64>>()
    };
    for best_first in [false, true] {
        rig.click(heading);
        let found = listed(&rig);
        assert!(found.windows(2).all(|pair| (pair[0] >= pair[1]) == best_first || pair[0] == pair[1]), "{found:?}");
    }
    // Only what is worse than a bound: a condition in the filter.
    let psnr = listed(&rig);
    let bound = 0.5 * (psnr[1] + psnr[2]);
    rig.send(LibraryCommand::SetFilter(format!("psnr<{bound}")));
    assert_eq!(listed(&rig), psnr[2..]);
    rig.send(LibraryCommand::SetFilter(String::new()));

    // Seven columns at most, and the rest on demand.
    let headings = |rig: &Rig| {
        let all = ["PSNR dB", "clean dB", "SSIM", "angle °", "≤5° %", "≤10° %", "place mm", "IoU", "verdict"];
        let sorted =
            ["PSNR", "PSNR noise-free", "SSIM", "Angle error", "Verdict"].map(|name| format!("Sort by {name}"));
        let is_there = |label: &str| rig.harness.query_all_by_label(label).next().is_some();
        all.iter().filter(|label| is_there(label)).count() + sorted.iter().filter(|label| is_there(label)).count()
    };
    let few = headings(&rig);
    assert!((5..=7).contains(&few), "{few}");
    rig.click("more columns");
    assert!(headings(&rig) > few);
    // A click on a method has the pairs show its scores.
    rig.click(&format!("{}: 4 grasps, 8 images", table.rows[0].method));
    assert!(rig.state().table.by().unwrap().0.upper_bound);

    // A table is of one data set, and there again with it until something of that changes.
    let (angle, psnr) = (value(&rig, 1, 0, Metric::Angle), value(&rig, 1, 0, Metric::Psnr));
    rig.send(LibraryCommand::Open(Place::Demo));
    assert!(rig.state().table.result.is_none());
    assert!(rig.state().table.scores.sources.is_empty());
    rig.send(LibraryCommand::Open(Place::Path(data.clone())));
    let again = rig.state().table.result.clone().expect("the table is kept");
    assert_eq!((&again.rows, &again.setup, again.scored), (&table.rows, &table.setup, table.scored));
    assert_eq!((value(&rig, 1, 0, Metric::Angle), value(&rig, 1, 0, Metric::Psnr)), (angle, psnr));
    let file = rig.state().library.open.as_ref().unwrap().source.dataset.pair_files(PairId(0)).remove(0);
    let file = std::fs::OpenOptions::new().append(true).open(file).unwrap();
    file.set_modified(std::time::SystemTime::UNIX_EPOCH).unwrap();
    rig.send(LibraryCommand::Open(Place::Demo));
    rig.send(LibraryCommand::Open(Place::Path(data)));
    assert!(rig.state().table.result.is_none());
}
