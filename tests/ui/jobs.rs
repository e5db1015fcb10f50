//! Jobs of a working day by clicks and keys, with the actions that they may take.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::PredictCommand;
use touch2touch::app::labels::Review;
use touch2touch::app::results;
use touch2touch::app::settings::{Workspace, prefer};
use touch2touch::app::state::State;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::compare::subject::Subject;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::labels::Labels;

use super::rig::Rig;

/// A person at work: each click and each key is one action.
struct Person {
    rig: Rig,
    actions: usize,
}

impl Person {
    fn at(mut rig: Rig) -> Self {
        rig.send(PredictCommand::Generate);
        Self { rig, actions: 0 }
    }

    fn state(&self) -> &State {
        self.rig.state()
    }

    fn done(&mut self) {
        self.actions += 1;
        self.rig.harness.step();
        self.rig.settle();
    }

    /// Clicks on what is called so; the last drawn of several, which lies on top.
    fn click(&mut self, label: &str) {
        let node = self.rig.harness.get_all_by_label(label).last().unwrap_or_else(|| panic!("no {label:?} on screen"));
        node.click();
        self.done();
    }
}

#[test]
fn two_models_are_compared_on_the_pair_on_screen() {
    let Some(rig) = Rig::with_bundle([1280.0, 800.0], "Tiny generator of the tests") else { return };
    let mut person = Person::at(rig);
    let models: Vec<String> = results::evaluated(person.state()).map(|(bundle, _)| bundle.name.clone()).collect();
    let shown = results::chosen(person.state(), lab::RIGHT).expect("a prediction").bundle.clone();
    let shown = person.state().library.bundle(&shown).unwrap().name.clone();
    let other = models.into_iter().find(|name| *name != shown).expect("a second generator");
    person.click("B: Measured");
    person.click(&other);
    let compared = person.state().settings.compared();
    assert_eq!(compared.a, Subject::shown());
    assert_eq!(compared.b.change().and_then(|change| change.bundle.clone()), Some(other));
    let found =
        results::subjects_compared(person.state(), &compared.a, &compared.b, lab::RIGHT).ready().expect("the figures");
    assert!(found.mae_m > 0.0);
    assert!(person.actions <= 3, "{} actions", person.actions);
}

#[test]
fn right_masks_take_one_action_each() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 2) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    for _ in 0..4 {
        rig.key(Modifiers::CTRL, Key::Enter);
    }
    let state = rig.state();
    assert_eq!(state.document.reviews.values().filter(|review| **review == Review::Done).count(), 4);
    let labels = Labels::of(&Dataset::open(&rig.data).unwrap());
    for pair in state.library.pairs() {
        let masks = labels.load(&pair.name).unwrap().masks;
        assert!(masks.len() == 2 && masks.values().all(|mask| mask.base().starts_with("Accepted")), "{}", pair.name);
    }
}
