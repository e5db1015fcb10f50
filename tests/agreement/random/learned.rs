//! Learning: a fit of the generator, and a mask model. Of fixed choices: either takes half a minute.

use touch2touch::app::command::LearnCommand;
use touch2touch::app::learn::{LearnForm, Network};
use touch2touch::app::settings::prefer;
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_pipeline::learn::train::TrainChoice;
use touch2touch_pipeline::steps::mask::{MaskChoice, MaskSource};

use super::*;
use crate::training::{bytes, corrected};

/// Times, places and what else no two runs share.
const OWN: [&str; 5] = ["seconds", "fit_seconds", "peak_mib", "bundle", "curves"];

#[test]
pub(in crate::agreement) fn a_fit_is_the_same_by_button_and_verb() {
    let home = tempfile::tempdir().unwrap();
    let mut both = Both::open(Place::Path(lab_folder(home.path())), home.path());
    both.show(&[Pane::Adapt]);
    let choice = MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() };
    let mut recipe = Draws::new(15).posed();
    (recipe.mask, recipe.shift) = (choice, ShiftMode::ExactInverse);
    // Of hardly more than noise there is no fit.
    let (model, config) = recipe.generator.take().unwrap();
    recipe.generator = Some((model, GenerateConfig { steps: 1, seed: config.seed, ..GenerateConfig::default() }));
    put(&mut both.studio, &recipe);
    let words = both.words(Pane::Adapt);
    both.studio.send(LearnCommand::Start(Network::Generator).into());
    let found = both.studio.state.learn.adapted.clone();
    let found = found.unwrap_or_else(|| panic!("{recipe:?}: {:?}", both.studio.state.log.entries));
    let said = both.run(&words).unwrap();
    let shown = without(written(&*found), &OWN);
    let count = same(&shown, &without(said.clone(), &[&OWN[..], &["from", "engine"]].concat()), &format!("{recipe:?}"));
    assert!(count >= 20, "{count}");
    // Kept where the button keeps what speaks against itself; the verb is told to.
    assert_eq!(found.bundle.is_some(), said["bundle"].is_string());
    if found.bundle.is_none() {
        both.studio.send(LearnCommand::Keep.into());
        both.run(&[words, vec!["--force".to_owned()]].concat()).unwrap();
    }
    let kept = both.studio.state.learn.adapted.as_ref().unwrap().bundle.clone().expect("it was kept");
    let [by_studio, by_verb] = [bytes(&kept), bytes(Path::new(&both.at("fitted")))];
    assert!(by_studio.len() >= 2 && by_studio == by_verb, "the bundles differ");
}

#[test]
pub(in crate::agreement) fn a_training_is_the_same_by_button_and_verb() {
    let home = tempfile::tempdir().unwrap();
    let folder = home.path().join("corrected");
    corrected(&folder, 2);
    let mut both = Both::open(Place::Path(folder), home.path());
    both.show(&[Pane::Adapt]);
    both.studio.send(LearnCommand::Show(Network::Masks).into());
    let choice = TrainChoice { held_out_percent: 40, seed: 7, ..TrainChoice::default() };
    both.studio
        .send(LearnCommand::SetForm(LearnForm { choice, by_steps: true, steps: 3, ..LearnForm::default() }).into());
    both.studio.send(prefer(|s| s.runtime = touch2touch_pipeline::infer::engine::EngineChoice::Rten).into());
    let out = ["--out".to_owned(), both.at("trained")];
    let words = [both.words(Pane::Adapt), out.to_vec()].concat();
    both.studio.send(LearnCommand::Start(Network::Masks).into());
    let found = both.studio.state.learn.trained.clone();
    let found = found.unwrap_or_else(|| panic!("{:?}", both.studio.state.log.entries));
    let said = both.run(&words).unwrap();
    let count = same(&without(written(&*found), &OWN), &without(said, &OWN), "training");
    assert!(count >= 20, "{count}");
    let [by_studio, by_verb] = [bytes(&found.bundle), bytes(Path::new(&both.at("trained")))];
    assert!(by_studio.len() >= 2 && by_studio == by_verb, "the bundles differ");
}
