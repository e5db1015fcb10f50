//! A dial over simulated pairs: its poses are those of the results table, and a value that makes no sense shows.

use std::path::Path;
use std::sync::Arc;

use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::pose::{Registration, RegistrationChoice};
use touch2touch_core::sim;
use touch2touch_work::bundles::{self, BundleInfo};
use touch2touch_work::evaluate::{Setup, evaluate};
use touch2touch_work::infer::bundle::Origin;
use touch2touch_work::io::dataset::Dataset;
use touch2touch_work::io::simulated::{Layout, write_pair, write_tools};
use touch2touch_work::job::{Cancel, JobCx, Progress};
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::mask::{MaskChoice, MaskSource};
use touch2touch_work::models::Models;
use touch2touch_work::recipe::Recipe;
use touch2touch_work::sweep::{Dial, Outcome, Setting, Sweep, SweepSetup, sweep};

use crate::support::run;

fn write(root: &Path, grasps: u64) -> Dataset {
    let tools = &catalog::tools()[..2];
    for tool in tools {
        for number in 0..grasps {
            let sample = sim::simulate(tool, sim::random_grasp(number + 3), number, &sim::SimConfig::default());
            write_pair(root, Layout::Test, &tool.name, number, &sample).unwrap();
        }
    }
    let meshes: Vec<_> = tools.iter().map(|t| (t.name.as_str(), t.seen, t.mesh())).collect();
    write_tools(root, &meshes).unwrap();
    Dataset::open(root).unwrap()
}

fn bundle(name: &str) -> BundleInfo {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bundles").join(name);
    bundles::open("Test", folder.as_path()).unwrap()
}

fn values(dial: Dial, list: &str) -> Vec<Setting> {
    list.split(',').map(|text| dial.parse(text).unwrap()).collect()
}

fn setup(dataset: &Dataset, dial: Dial, list: &str) -> SweepSetup {
    let mask = MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() };
    SweepSetup {
        values: values(dial, list),
        pairs: (0..dataset.index.pairs.len() as u32).map(PairId).collect(),
        recipe: Recipe { mask, ..Recipe::default() },
    }
}

fn with_generator(setup: SweepSetup) -> SweepSetup {
    let generator = bundle("generator");
    let config = generator.generator.as_ref().unwrap().defaults;
    let recipe = Recipe { generator: Some((generator.into(), config)), ..setup.recipe };
    SweepSetup { recipe, ..setup }
}

fn turned(dataset: &Dataset, setup: &SweepSetup) -> Sweep {
    sweep(dataset, setup, &Models::new(None), &JobCx::unwatched()).unwrap()
}

fn errors(cases: &[Outcome]) -> Vec<Option<f64>> {
    cases.iter().map(|case| case.error_rad).collect()
}

#[test]
fn the_poses_are_those_of_the_results_table_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = write(folder.path(), 2);
    let found = turned(&dataset, &with_generator(setup(&dataset, Dial::Threshold, "3,5,6.5")));
    assert_eq!((found.pairs, found.series.len(), found.complete), (4, 2, true));
    assert_eq!(found.at, Some(Dial::Threshold.parse("5").unwrap()));
    let mut compared = 0;
    for (at, point) in found.series[0].points.iter().enumerate() {
        let Recipe { mask, .. } = found.series[0].points[at].value.unwrap().put(&found.in_force).unwrap();
        let table = Setup {
            bundles: vec![Origin::from(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bundles/generator"))],
            recipe: Recipe { mask, ..Recipe::default() },
            resamples: 0,
            ..Setup::default()
        };
        let table = evaluate(&dataset, &table, &Models::new(None), &JobCx::unwatched()).unwrap();
        assert_eq!(point.in_force, at == 1);
        for (source, scores) in [ImprintSource::Measured, ImprintSource::Predicted].into_iter().zip(&table.scores) {
            let series = found.series.iter().find(|series| series.source == source).unwrap();
            for grasp in &scores.grasps {
                let case = series.points[at].cases.iter().find(|case| case.name == grasp.pair).unwrap();
                let told = grasp.angle_error_rad.filter(|error| error.is_finite());
                assert_eq!(case.error_rad, told, "{source:?} {}", grasp.pair);
                compared += 1;
            }
        }
    }
    assert_eq!(compared, 24);
    // What is in force is what the dial says there, whether it is turned there or not.
    for series in &found.series {
        assert_eq!(series.base.cases, series.points[1].cases);
        assert!(series.points[1].cases.iter().all(|case| case.angle_rad.is_none() || case.change_rad == Some(0.0)));
    }
}

#[test]
fn an_absurd_threshold_shows() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = write(folder.path(), 3);
    let setup = setup(&dataset, Dial::Threshold, "-5,9,50");
    let by_mask = Recipe { registration: Registration::DistanceField.into(), ..setup.recipe.clone() };
    let found = turned(&dataset, &SweepSetup { recipe: by_mask, ..setup });
    let series = &found.series[0];
    let [all, right, none] = [0, 1, 2].map(|at| &series.points[at].summary);
    let [worse, better] = [all, right].map(|summary| summary.angle.unwrap());
    assert!(better.success_5 > 80.0 && better.failed == 0, "{better:?}");
    // All of the membrane is no contact: the poses are worse, or there are none.
    assert!(worse.success_5 < better.success_5 - 20.0, "{worse:?} against {better:?}");
    assert!(all.median_points.unwrap() > 1.5 * right.median_points.unwrap());
    // Nothing is pushed in by 50 mm.
    assert_eq!((none.failed, none.angle.unwrap().success_5, none.angle.unwrap().median_deg), (6, 0.0, None));
    assert_eq!(
        (none.failures.len(), none.failures[0].why.as_str(), none.failures[0].count),
        (1, "no contact points", 6)
    );
    assert_eq!(series.best, Some(1));
}

#[test]
fn gate_and_trim_are_those_of_the_registration() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = write(folder.path(), 2);
    let with = |dial, list: &str, by: &str| {
        let setup = setup(&dataset, dial, list);
        let recipe = Recipe { registration: by.parse().unwrap(), ..setup.recipe };
        turned(&dataset, &SweepSetup { recipe, ..setup })
    };
    for by in [Registration::DistanceField, Registration::PlanarPointToPoint] {
        let own = RegistrationChoice::from(by).gate_m().unwrap() * 1e3;
        let found = with(Dial::Gate, &format!("0.4,{own}"), by.key());
        let series = &found.series[0];
        assert_eq!(errors(&series.points[1].cases), errors(&series.base.cases), "{by:?}: its own gate changes nothing");
        assert!(series.points[1].in_force && !series.points[0].in_force);
        assert_ne!(errors(&series.points[0].cases), errors(&series.base.cases), "{by:?}");
        // Points are made once: no gate moves one.
        assert!(series.points[0].cases.iter().zip(&series.base.cases).all(|(a, b)| a.points == b.points));
        // A gate that was chosen stands where it was chosen.
        let chosen = with(Dial::Gate, "0.4", &format!("{}:gate=0.4", by.key()));
        assert!(chosen.series[0].points[0].in_force);
        assert_eq!(errors(&chosen.series[0].base.cases), errors(&series.points[0].cases));
    }
    let trimmed = with(Dial::Trim, "0,0.5", "planar_point_to_point");
    assert_eq!((trimmed.at, trimmed.series[0].points.len()), (None, 2), "by itself it does not trim");
    assert_ne!(errors(&trimmed.series[0].points[0].cases), errors(&trimmed.series[0].points[1].cases));
}

#[test]
fn a_shift_moves_predictions_alone_and_a_probability_the_masks_of_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = write(folder.path(), 1);
    let found = turned(&dataset, &with_generator(setup(&dataset, Dial::Shift, "raw,exact")));
    assert_eq!((found.series.len(), found.series[0].source), (1, ImprintSource::Predicted));
    let points = |at: usize| found.series[0].points[at].cases.iter().map(|case| case.points).collect::<Vec<_>>();
    assert_ne!(points(0), points(1));
    assert!(found.series[0].points[1].in_force);

    let Some(model) = bundles::find(&[]).bundles.into_iter().find(|b| b.kind == bundles::BundleKind::Mask) else {
        panic!("the program ships a mask model");
    };
    let setup = setup(&dataset, Dial::Probability, "0.05,0.5,0.95");
    let mask = MaskChoice::default();
    let recipe = Recipe { mask, mask_model: Some(model.clone().into()), ..setup.recipe };
    let found = turned(&dataset, &SweepSetup { recipe, ..setup });
    let series = &found.series[0];
    // A larger probability leaves no more pixels.
    for pair in 0..2 {
        let points = series.points.iter().map(|point| point.cases[pair].points).collect::<Vec<_>>();
        assert!(points[0] > points[1] && points[1] > points[2] && points[2] > 0, "{points:?}");
    }
    // The bundle's own is one of them, and is what is in force.
    let at = series.points.iter().position(|point| point.in_force).expect("0.5 is the bundle's own");
    assert_eq!(errors(&series.points[at].cases), errors(&series.base.cases));
    assert_eq!(series.points[at].cases[0].points, series.base.cases[0].points);
}

#[test]
fn a_turn_that_is_stopped_says_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = write(folder.path(), 6);
    let setup = setup(&dataset, Dial::Threshold, "5");
    let cancel = Cancel::default();
    let flag = cancel.clone();
    // As soon as the first pairs are done.
    let sink = Arc::new(move |progress: Progress| {
        if progress.done > 0 {
            flag.cancel();
        }
    });
    let found = sweep(&dataset, &setup, &Models::new(None), &JobCx::new(cancel, sink)).unwrap();
    assert!(!found.complete && (1..12).contains(&found.pairs), "{} pairs", found.pairs);
    assert_eq!(found.series[0].points[0].cases.len(), found.pairs);
    let before = Cancel::default();
    before.cancel();
    let err = sweep(&dataset, &setup, &Models::new(None), &JobCx::new(before, Arc::new(|_| {}))).unwrap_err();
    assert!(err.is_cancelled());
}

#[test]
fn what_makes_no_sense_is_said_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let dataset = write(folder.path(), 1);
    let refused =
        |setup: SweepSetup| sweep(&dataset, &setup, &Models::new(None), &JobCx::unwatched()).unwrap_err().to_string();
    let usual = || setup(&dataset, Dial::Threshold, "5");
    for (setup, word) in [
        (SweepSetup { values: Vec::new(), ..usual() }, "there are no values"),
        (SweepSetup { pairs: Vec::new(), ..usual() }, "there are no pairs"),
        (
            SweepSetup { values: vec![usual().values[0], Dial::Gate.parse("1").unwrap()], ..usual() },
            "more than one dial",
        ),
        (SweepSetup { values: vec![usual().values[0]; 41], ..usual() }, "at most 40"),
        (setup(&dataset, Dial::Trim, "0.1"), "does not trim"),
        (setup(&dataset, Dial::Probability, "0.5"), "no mask model"),
        (setup(&dataset, Dial::Shift, "raw"), "no generator"),
        (SweepSetup { pairs: vec![PairId(99)], ..usual() }, "no such pair"),
    ] {
        let why = refused(setup);
        assert!(why.contains(word), "{why}");
    }
    let path = folder.path().to_str().unwrap();
    for (arguments, word) in [
        (&["--dial", "threshold", "--values", "5,deep"][..], "\"deep\" is not a number"),
        (&["--dial", "threshold", "--values", "NaN"], "between -100 and 100 mm"),
        (&["--dial", "threshold", "--values", ""], "is not a number"),
        (&["--dial", "trim", "--values", "0.1", "--measured-only"], "does not trim"),
        (&["--dial", "gate", "--values", "1", "--engine", "lab_icp", "--measured-only"], "has no gate"),
        (&["--dial", "volume", "--values", "1"], "possible values: threshold, probability"),
        (&["--dial", "gate", "--values", "1", "--pairs", "0"], "nothing to do"),
    ] {
        let output = run(&[&["sweep", path], arguments].concat(), folder.path());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(word), "{arguments:?}: {said}");
    }
}
