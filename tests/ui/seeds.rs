//! Several seeds: nothing runs out of sight; the grid, the spreads and the fan come with the predictions.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Command, LibraryCommand, Pane, PredictCommand};
use touch2touch::app::results;
use touch2touch::app::seeds::SeedsCommand;
use touch2touch::app::settings::prefer;
use touch2touch_core::ensemble::AngleFan;
use touch2touch_core::rig::lab;

use super::rig::Rig;

fn click(rig: &mut Rig, label: &str) {
    let node = rig.harness.get_all_by_label(label).next().unwrap_or_else(|| panic!("no {label:?} on screen"));
    node.click();
    rig.harness.step();
    rig.settle();
}

/// Predictions of the ensemble of the active finger that are there.
fn there(rig: &Rig) -> usize {
    let state = rig.harness.state().state();
    let recipes = results::seed_recipes(state, lab::RIGHT).unwrap();
    recipes.iter().filter(|r| state.results.predictions.contains(r)).count()
}

#[test]
fn seeds_run_in_sight_only_and_show_where_they_disagree() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 2) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    // Behind a tab: told to run, but nobody looks.
    rig.send(Command::Seeds(SeedsCommand::Run(true)));
    assert!(!rig.harness.state().state().selection.panes.contains(&Pane::Seeds));
    assert_eq!(there(&rig), 0);
    click(&mut rig, "Seeds");
    assert_eq!(there(&rig), 8);

    let state = rig.harness.state().state();
    let ensemble = results::ensemble(state, lab::RIGHT).ready().expect("mean and spread");
    assert_eq!(ensemble.spread.count, 8);
    let recipes = results::seed_recipes(state, lab::RIGHT).unwrap();
    let imprints: Vec<_> = recipes.iter().map(|r| results::seed_imprint(state, r).unwrap()).collect();
    let at = (90, 70);
    let mean = imprints.iter().map(|i| f64::from(i[at])).sum::<f64>() / 8.0;
    let square = imprints.iter().map(|i| (f64::from(i[at]) - mean).powi(2)).sum::<f64>() / 7.0;
    assert!((f64::from(ensemble.spread.mean[at]) - mean).abs() < 1e-8);
    assert!((f64::from(ensemble.spread.std[at]) - square.sqrt()).abs() < 1e-8 && square > 0.0);
    assert!(ensemble.channels.as_ref().unwrap()[at] > 0.0);
    let angles: Vec<f64> = results::seed_poses(state).iter().flatten().map(|p| p.angle_rad).collect();
    assert!(!angles.is_empty() && AngleFan::of(&angles).is_some());
    for label in ["Fan of poses", "Mean", "Seed spread", "Channel spread"] {
        assert!(rig.harness.query_by_label(label).is_some(), "{label}");
    }
    rig.shoot("seeds-1280");

    // A click on one shows it everywhere; the ones made meanwhile do not.
    let third = recipes[2].clone();
    click(&mut rig, &format!("Seed {}", third.config.seed));
    assert_eq!(results::chosen(rig.harness.state().state(), lab::RIGHT), Some(&third));
    rig.send(Command::Seeds(SeedsCommand::Count(12)));
    assert_eq!(there(&rig), 12);
    assert_eq!(results::chosen(rig.harness.state().state(), lab::RIGHT), Some(&third));

    // Run means this pair: another one gets none until told so, and the switch tells it for all.
    assert!(!results::seeds_running(rig.harness.state().state()), "all are there");
    rig.send(LibraryCommand::Step(1));
    assert_eq!(there(&rig), 0);
    rig.send(Command::Seeds(SeedsCommand::Count(1)));
    assert_eq!(rig.harness.state().state().seeds.count, 2, "one is no ensemble");
    click(&mut rig, "Run the seeds");
    assert_eq!(there(&rig), 2);
    click(&mut rig, "Seeds for every pair");
    rig.send(LibraryCommand::Step(-1));
    rig.send(PredictCommand::GenerateNewSeed);
    assert_eq!(there(&rig), 2, "another seed is another run, and the switch is on");
    click(&mut rig, "Seeds for every pair");
    rig.send(PredictCommand::GenerateNewSeed);
    assert!(there(&rig) < 2, "off: nothing but what was generated");
    assert!(rig.harness.state().state().settings.generate.seed < 1_000_000, "short enough to be read out");
    for size in [[1920.0, 1080.0], [1000.0, 640.0]] {
        rig.harness.set_size(size.into());
        rig.harness.run();
        rig.shoot(&format!("seeds-{}", size[0]));
    }
}
