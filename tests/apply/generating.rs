//! Which predictions are made, what is shown on the way, and what is found again.

use std::sync::{Arc, Mutex};

use touch2touch::app::command::{Answer, LibraryCommand, Pane, PredictCommand, ViewCommand};
use touch2touch::app::effect::TaskResult;
use touch2touch::app::jobs::Worker;
use touch2touch::app::keys::Preview;
use touch2touch::app::keys::{ImprintSource, PredictionKey, Preset, Sampler, Spacing};
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{GenerateSettings, ProposalSource};
use touch2touch::app::state::{Absent, Lookup};
use touch2touch::app::tasks::{TaskKind, Ticket};
use touch2touch::app::{predict, recipe, results};
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::{PadId, lab};
use touch2touch_pipeline::infer::bundle::{Origin, SensorPair};

use super::bench::{Bench, Folders, SIMULATED, models};
use super::panes;
use touch2touch::app::results::Onlooker;
use touch2touch_pipeline::job::{JobCx, PreviewPicture};
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind, GeneratorInfo};
use touch2touch_pipeline::steps::prediction::Prediction;

const RIGHT: PadId = lab::RIGHT;
const LEFT: PadId = lab::LEFT;

fn preview(recipe: &PredictionKey, step: u32) -> Arc<Preview> {
    let picture = PreviewPicture { step, of: recipe.config.steps, depth: DepthMap::filled(4, 3, 0.001) };
    Arc::new(Preview { recipe: recipe.clone(), picture })
}

#[test]
fn a_proposal_at_the_registered_pose_of_a_prediction_that_nobody_made_ends() {
    let mut bench = Bench::open();
    bench.send(panes(&[Pane::Masks, Pane::Predicted]));
    bench.send(prefer(|s| s.mask.proposal = ProposalSource::CadRegistered));
    bench.send(ViewCommand::SelectImprint(ImprintSource::Predicted));
    bench.run(ViewCommand::Propose(true));
    // Which imprint is worked on, and so which pose is needed, must not hang on what is predicted for that pose.
    assert!(results::proposes(&bench.state) && results::chosen(&bench.state, RIGHT).is_none());
    assert_eq!(results::worked_on(&bench.state, RIGHT), ImprintSource::Measured);
    assert!(results::imprint(&bench.state, ImprintSource::Predicted, RIGHT).ready().is_none());
}

#[test]
fn the_pair_that_stays_on_screen_is_predicted_by_itself_where_that_costs_little() {
    let mut bench = Bench::open();
    bench.send(panes(&[Pane::Predicted]));
    bench.run(LibraryCommand::Select(PairId(1)));
    assert_eq!(bench.generated(), 0, "switched off");
    let by_itself = |on: bool| prefer(move |s| s.generate.by_itself = on);
    bench.run(by_itself(true));
    assert_eq!(bench.generated(), 1);
    let key = results::chosen(&bench.state, RIGHT).expect("it is shown").clone();
    assert_eq!(bench.state.results.cost_of(&key), bench.state.results.predictions.get(&key).map(|made| made.seconds));
    // Of pairs that were left before their turn none is made.
    for pair in [2, 3, 4, 5] {
        bench.send(LibraryCommand::Select(PairId(pair)));
    }
    bench.settle();
    assert_eq!(bench.generated(), 2);
    assert!(results::chosen(&bench.state, RIGHT).is_some());
    // A pane that shows no prediction asks for none.
    bench.send(panes(&[Pane::Measured]));
    bench.run(LibraryCommand::Select(PairId(6)));
    assert_eq!(bench.generated(), 2);
    // On a machine that takes long for it nobody waits for what was not asked for.
    let slow = Prediction { seconds: 5.0, ..(**bench.state.results.predictions.get(&key).unwrap()).clone() };
    let keys: Vec<_> = bench.state.results.predictions.iter().map(|(key, _)| key.clone()).collect();
    let slow: Vec<_> = keys.into_iter().map(|key| (key, Arc::new(slow.clone()))).collect();
    bench.send(Answer::TaskResult(Ticket(u64::MAX), TaskResult::new(TaskKind::Generate, slow, predict::generated)));
    bench.run(panes(&[Pane::Predicted]));
    assert_eq!(bench.generated(), 2);
    assert!(matches!(
        results::imprint(&bench.state, ImprintSource::Predicted, RIGHT),
        Lookup::Absent(Absent::NoPrediction)
    ));
}

#[test]
fn a_finger_that_nobody_looks_at_is_not_generated() {
    let mut bench = Bench::open();
    bench.send(LibraryCommand::Select(SIMULATED));
    bench.run(panes(&[Pane::Predicted, Pane::Generate]));
    bench.run(PredictCommand::Generate);
    assert!(results::chosen(&bench.state, RIGHT).is_some() && results::chosen(&bench.state, LEFT).is_none());
    assert_eq!(bench.generated(), 1);
    // A pane that makes a pose of both wants the other one too, made like the first.
    bench.send(prefer(move |s| s.generate.seed = 5));
    bench.run(panes(&[Pane::Predicted, Pane::Scene]));
    let (right, left) =
        (results::chosen(&bench.state, RIGHT).unwrap().clone(), results::chosen(&bench.state, LEFT).unwrap().clone());
    assert_eq!(PredictionKey { touch: left.touch, ..right }, left);
    assert_eq!(bench.generated(), 2);
    assert!(results::cloud(&bench.state, ImprintSource::Predicted).ready().unwrap().finger(LEFT).is_some());
    // Both on screen are made together, in one call.
    bench.send(panes(&[Pane::Predicted]));
    bench.send(ViewCommand::ShowBothFingers(true));
    bench.run(PredictCommand::GenerateNewSeed);
    assert_eq!(bench.generated(), 4);
    // Switched off, only the active one is made.
    let one = GenerateSettings { both_fingers: false, ..bench.state.settings.generate.clone() };
    bench.send(prefer(move |s| s.generate = one.clone()));
    bench.run(PredictCommand::GenerateNewSeed);
    assert_eq!(bench.generated(), 5);
}

#[test]
fn previews_are_wanted_where_somebody_looks_and_end_with_the_result() {
    let mut bench = Bench::open();
    bench.run(panes(&[Pane::Measured]));
    assert!(results::preview_request(&bench.state).touches.is_empty(), "no predicted imprint is on screen");
    bench.send(panes(&[Pane::Predicted]));
    let touch = bench.state.touch_key(RIGHT).unwrap();
    let request = Arc::new(Mutex::new(results::preview_request(&bench.state)));
    let shown: Arc<Mutex<Vec<u32>>> = Arc::default();
    let seen = shown.clone();
    let sink = Arc::new(move |p: Preview| seen.lock().unwrap().push(p.picture.step));
    let recipe = recipe::prediction(&bench.state, touch).unwrap();
    let onlooker = Onlooker { request: request.clone(), sink };
    let cx = JobCx::unwatched().with_previews(onlooker.of(vec![recipe.clone()]));
    let previews = cx.previews().unwrap();
    assert!(previews.wants(0, 1).is_some() && previews.wants(0, 2).is_none() && previews.wants(1, 1).is_none());
    previews.show(0, preview(&recipe, 1).picture.clone());
    bench.send(panes(&[Pane::Log]));
    *request.lock().unwrap() = results::preview_request(&bench.state);
    assert!(previews.wants(0, 4).is_none());
    assert_eq!(*shown.lock().unwrap(), [1]);
    assert!(JobCx::unwatched().previews().is_none());
}

#[test]
fn what_was_made_before_the_start_is_found_when_its_pair_is_looked_at() {
    let folders = Folders::new();
    let mut bench = Bench::keeping(folders.clone(), models());
    bench.run(panes(&[Pane::Predicted]));
    bench.run(PredictCommand::Generate);
    let first = results::chosen(&bench.state, RIGHT).unwrap().clone();
    bench.run(PredictCommand::GenerateNewSeed);
    assert_eq!(bench.state.results.made[&first.touch].len(), 2);

    let mut again = Bench::keeping(folders, models());
    assert!(again.state.results.looked_up.is_empty(), "no pane shows a prediction");
    again.run(panes(&[Pane::Predicted]));
    let touch = again.state.touch_key(RIGHT).unwrap();
    assert_eq!(again.state.results.made[&touch].len(), 2);
    // Shown is the one that the settings would make (seed 42), not simply the last.
    assert_eq!(results::chosen(&again.state, RIGHT).unwrap().config.seed, 42);
    assert!(results::imprint(&again.state, ImprintSource::Predicted, RIGHT).ready().is_some());
    assert!(again.state.results.predictions.iter().all(|(_, made)| made.kept));
    let looked = again.state.results.looked_up.len();
    again.run(LibraryCommand::Step(1));
    again.run(LibraryCommand::Step(-1));
    assert_eq!(again.state.results.looked_up.len(), looked + 1, "each touch is looked up once");
    assert!(again.runtime.waiting(Worker::Files) == 0);
}

#[test]
fn presets_follow_the_bundle_and_own_numbers_leave_them() {
    let mut bench = Bench::open();
    bench.run(panes(&[Pane::Predicted]));
    let touch = bench.state.touch_key(RIGHT).unwrap();
    assert_eq!(bench.state.settings.generate.preset, Some(Preset::Default));
    assert_eq!(recipe::prediction(&bench.state, touch).unwrap().config.steps, 6, "what the bundle recommends");
    let fast = GenerateSettings { preset: Some(Preset::Fast), ..bench.state.settings.generate.clone() };
    bench.send(prefer(move |s| s.generate = fast.clone()));
    assert!(recipe::prediction(&bench.state, touch).unwrap().config.steps <= 4);
    let own = GenerateSettings { steps: 33, ..bench.state.settings.generate.clone() };
    bench.send(prefer(move |s| s.generate = own.clone()));
    assert_eq!(bench.state.settings.generate.preset, None);
    assert_eq!(recipe::prediction(&bench.state, touch).unwrap().config.steps, 33);
}

#[test]
fn a_bundles_own_numbers_can_be_spelt_out() {
    let defaults = GenerateConfig { spacing: Spacing::Lab, ..GenerateConfig::default() };
    let bundle = BundleInfo {
        id: "x".into(),
        name: "x".into(),
        kind: BundleKind::Generator,
        origin: Origin::Folder("x".into()),
        generator: Some(GeneratorInfo {
            fit: None,
            defaults,
            training_steps: 1000,
            sensors: SensorPair::of(&lab::GELSLIM, &lab::BUBBLE),
        }),
        trained: false,
    };
    let own = GenerateSettings { preset: None, sampler: Sampler::Ddpm, ..GenerateSettings::default() };
    assert_eq!(own.config(&bundle).spacing, Spacing::Trailing);
    assert_eq!(GenerateSettings::default().spelt_out(Some(&bundle)).spacing, Spacing::Lab);
    let wild = GenerateSettings { eta: f64::NAN, ..own }.validated();
    assert_eq!(wild.eta, 0.0);
}
