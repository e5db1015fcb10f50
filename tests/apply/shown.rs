//! A prediction on screen is that of the settings in force, or says that it is not.

use std::sync::Arc;

use proptest::prelude::*;
use touch2touch::app::command::{Command, LibraryCommand, Pane, PredictCommand, ViewCommand};
use touch2touch::app::keys::{ImprintSource, Preset, Sampler};
use touch2touch::app::results::Why;
use touch2touch::app::settings::GenerateSettings;
use touch2touch::app::settings::prefer;
use touch2touch::app::state::State;
use touch2touch::app::{recipe, results};
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::{PadId, lab};
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::steps::bundles::{self, BundleInfo};

use super::bench::{Bench, Folders, GENERATOR, models};
use super::panes;
use crate::support::copy_folder;

const RIGHT: PadId = lab::RIGHT;

/// Something that a person does to settings and predictions.
#[derive(Clone, Debug)]
enum Move {
    Steps(u32),
    Seed(u64),
    Eta(f64),
    Model(u8),
    Preset(Preset),
    Runtime(EngineChoice),
    ByItself(bool),
    Select(u32),
    Both(bool),
    Generate,
    NewSeed,
    Pick(usize),
}

fn moves() -> impl Strategy<Value = Move> {
    prop_oneof![
        (1u32..4).prop_map(Move::Steps),
        (40u64..43).prop_map(Move::Seed),
        prop_oneof![Just(0.0f64), Just(0.1)].prop_map(Move::Eta),
        (0u8..2).prop_map(Move::Model),
        prop_oneof![Just(Preset::Default), Just(Preset::Fast)].prop_map(Move::Preset),
        prop_oneof![Just(EngineChoice::Auto), Just(EngineChoice::Rten)].prop_map(Move::Runtime),
        any::<bool>().prop_map(Move::ByItself),
        (0u32..4).prop_map(Move::Select),
        any::<bool>().prop_map(Move::Both),
        Just(Move::Generate),
        Just(Move::NewSeed),
        (0usize..4).prop_map(Move::Pick),
    ]
}

fn with(change: impl Fn(&mut GenerateSettings) + Send + Sync + 'static) -> Command {
    prefer(move |s| change(&mut s.generate)).into()
}

impl Move {
    fn command(&self, state: &State) -> Option<Command> {
        Some(match self.clone() {
            Self::Steps(n) => with(move |g| (g.preset, g.steps) = (None, n)),
            Self::Seed(n) => with(move |g| g.seed = n),
            Self::Eta(eta) => with(move |g| (g.preset, g.eta) = (None, eta)),
            Self::Model(n) => with(move |g| g.bundle = Some([GENERATOR, "fitted"][usize::from(n)].into())),
            Self::Preset(preset) => with(move |g| g.preset = Some(preset)),
            Self::Runtime(runtime) => prefer(move |s| s.runtime = runtime).into(),
            Self::ByItself(on) => with(move |g| g.by_itself = on),
            Self::Select(pair) => LibraryCommand::Select(PairId(pair)).into(),
            Self::Both(on) => ViewCommand::ShowBothFingers(on).into(),
            Self::Generate => PredictCommand::Generate.into(),
            Self::NewSeed => PredictCommand::GenerateNewSeed.into(),
            Self::Pick(at) => {
                let made = state.results.made.get(&state.touch_key(RIGHT)?)?;
                PredictCommand::Choose(made.get(at % made.len())?.clone()).into()
            }
        })
    }
}

/// What must hold of what is on screen, when nothing runs.
fn holds(state: &State, after: &str) {
    for finger in state.fingers() {
        let touch = state.touch_key(finger).expect("a pair is on screen");
        let named = recipe::prediction(state, touch).expect("there is a generator");
        let Some(shown) = results::chosen(state, finger) else {
            assert!(!state.settings.generate.by_itself, "nothing is shown after {after}");
            continue;
        };
        assert_eq!(shown.touch, touch, "of another pair after {after}");
        match results::outdated(state, finger) {
            None => assert_eq!(shown, &named, "it is not what the settings make, and nothing says so, after {after}"),
            Some(outdated) => {
                assert_ne!(shown, &named, "{outdated:?} after {after}");
                assert!(outdated == Why::Picked || !state.settings.generate.by_itself, "{outdated:?} after {after}");
                let model = &state.library.bundle(&shown.bundle).expect("it is there").name;
                let (steps, seed) = (format!(" {} step", shown.config.steps), format!("seed {}", shown.config.seed));
                let made_with = state.library.made_with(shown);
                for word in [model.as_str(), &steps, &seed] {
                    assert!(made_with.contains(word), "{word:?} is not in {made_with:?}");
                }
            }
        }
        // What is derived from it is of the same prediction.
        let imprint = results::imprint_key(state, ImprintSource::Predicted, finger).expect("it was made");
        assert!(format!("{imprint:?}").contains(&format!("{shown:?}")), "after {after}");
    }
}

/// A second generator beside the first: what it predicts is another recipe.
fn second(folders: &Folders) -> BundleInfo {
    let (from, to) = (&models()[0], folders.data.with_file_name("fitted"));
    copy_folder(&from.origin.path(), &to);
    let manifest = std::fs::read_to_string(to.join("manifest.json")).unwrap();
    let manifest = manifest.replace(GENERATOR, "fitted").replace("0.0126", "0.0127");
    std::fs::write(to.join("manifest.json"), manifest).unwrap();
    bundles::open("Test", to.as_path()).unwrap()
}

fn on(folders: Arc<Folders>) -> Bench {
    let models = models().into_iter().chain([second(&folders)]).collect();
    Bench::keeping(folders, models)
}

fn look(bench: &mut Bench) {
    bench.send(panes(&[Pane::Predicted, Pane::Compare, Pane::Generate]));
    bench.run(LibraryCommand::Select(PairId(1)));
}

fn bench() -> Bench {
    let mut bench = on(Folders::new());
    look(&mut bench);
    bench
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn after_any_settings_what_is_shown_is_theirs_or_says_that_it_is_not(list in prop::collection::vec(moves(), 1..14)) {
        let mut bench = bench();
        for (at, one) in list.iter().enumerate() {
            let Some(command) = one.command(&bench.state) else { continue };
            bench.run(command);
            holds(&bench.state, &format!("{:?}", &list[..=at]));
        }
    }
}

#[test]
fn another_model_is_predicted_with_at_once_on_this_pair_and_on_those_seen_before() {
    let mut bench = bench();
    bench.send(with(|g| g.by_itself = true));
    for pair in [2, 3, 1] {
        bench.run(LibraryCommand::Select(PairId(pair)));
    }
    let model = |bench: &Bench| {
        let shown = results::chosen(&bench.state, RIGHT).expect("a prediction");
        bench.state.library.bundle(&shown.bundle).unwrap().name.clone()
    };
    // Both fingers of each pair: Compare shows poses.
    assert_eq!((&*model(&bench), bench.generated()), (GENERATOR, 6));
    bench.send(Move::Model(1).command(&bench.state).unwrap());
    assert!(results::outdated(&bench.state, RIGHT) == Some(Why::OnItsWay));
    bench.settle();
    assert_eq!((&*model(&bench), results::outdated(&bench.state, RIGHT)), ("fitted", None));
    // The next pair was predicted with the first model before.
    bench.run(LibraryCommand::Step(1));
    assert_eq!((&*model(&bench), results::outdated(&bench.state, RIGHT)), ("fitted", None));
    // Back: both are there, and nothing is made again.
    let made = bench.generated();
    bench.run(Move::Model(0).command(&bench.state).unwrap());
    assert_eq!((&*model(&bench), bench.generated()), (GENERATOR, made));
}

#[test]
fn a_start_with_another_model_selected_does_not_open_on_the_picture_of_the_first() {
    let mut first = bench();
    first.run(PredictCommand::Generate);
    let mut again = on(first.folders.clone());
    again.send(Move::Model(1).command(&again.state).unwrap());
    look(&mut again);
    // Nothing is predicted by itself here: the picture from before is shown, and says whose it is.
    assert_eq!(results::outdated(&again.state, RIGHT), Some(Why::NotMade), "it is of another model");
    let shown = results::chosen(&again.state, RIGHT).unwrap();
    assert!(again.state.library.made_with(shown).starts_with(GENERATOR));
    again.run(with(|g| g.by_itself = true));
    assert_eq!(results::outdated(&again.state, RIGHT), None);
    let shown = &results::chosen(&again.state, RIGHT).unwrap().bundle;
    assert_eq!(again.state.library.bundle(shown).unwrap().name, "fitted");
}

#[test]
fn what_a_person_picks_stays_until_the_settings_change_and_comes_back_with_them() {
    let mut bench = bench();
    for seed in [42, 41] {
        bench.send(Move::Seed(seed).command(&bench.state).unwrap());
        bench.run(PredictCommand::Generate);
    }
    let touch = bench.state.touch_key(RIGHT).unwrap();
    let first = Arc::new(bench.state.results.made[&touch][0].clone());
    bench.send(PredictCommand::Choose((*first).clone()));
    assert_eq!(results::chosen(&bench.state, RIGHT), Some(&*first));
    assert!(results::outdated(&bench.state, RIGHT) == Some(Why::Picked));
    bench.send(Move::Steps(3).command(&bench.state).unwrap());
    assert!(results::outdated(&bench.state, RIGHT) == Some(Why::NotMade));
    bench.send(with(|g| g.preset = Some(Preset::Default)));
    assert_eq!(results::chosen(&bench.state, RIGHT), Some(&*first));
    // Generating asks for what the settings say.
    bench.send(PredictCommand::Generate);
    assert_eq!(
        (results::chosen(&bench.state, RIGHT).unwrap().config.seed, results::outdated(&bench.state, RIGHT)),
        (41, None)
    );
    assert_eq!(bench.state.settings.generate.sampler, Sampler::default());
}
