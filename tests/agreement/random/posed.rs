//! Registrations: their steps, and what the angle hangs on.

use strum::IntoEnumIterator as _;
use touch2touch::app::inspect::InspectCommand;
use touch2touch::app::state::Lookup;
use touch2touch::app::{recipe, results};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::pose::Rejection;
use touch2touch_work::influence::Influence;
use touch2touch_work::recipe::Stage;

use super::*;

/// Demo and lab folder: pictures have no pose.
fn with_poses(home: &Path) -> impl Iterator<Item = Both> {
    Both::places(home).take(2)
}

/// The reason that keeps a registration from an answer is the same in both.
fn same_reason<T>(shown: Lookup<'_, T>, said: Result<Value, String>, what: &str) {
    let said = match said {
        Err(said) => said,
        Ok(said) => {
            let case = &said["cases"][0];
            ["stop", "no_influence"].map(|key| case[key].as_str().unwrap_or_default()).join(" ")
        }
    };
    match shown {
        Lookup::Failed(err) => assert!(said.contains(&err.why), "{what}: {} is shown, {said} is said", err.why),
        // A mask without a point.
        Lookup::Absent(_) => assert!(!said.is_empty(), "{what}"),
        _ => panic!("{what}: something is shown, {said} is said"),
    }
}

#[test]
pub(in crate::agreement) fn every_step_of_a_registration_is_the_same_in_the_time_machine_and_by_the_verb() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(4);
    let mut counts = Vec::new();
    for mut both in with_poses(home.path()) {
        let mut count = 0;
        both.show(&[Pane::TimeMachine, Pane::Predicted]);
        for at in 0..2 {
            let recipe = draws.posed();
            both.predict(&recipe, 17 * at);
            for source in ImprintSource::iter() {
                both.studio.send(InspectCommand::Source(source).into());
                // From the registration's own starts, and from one of a person.
                let by_hand = PlanarPose { theta_rad: 10f64.to_radians(), y_m: -1.5e-3, z_m: 2e-3 };
                for start in [None, Some(by_hand)] {
                    both.studio.send(InspectCommand::Start(start).into());
                    let what = format!("{} {source:?} {start:?}, {recipe:?}", both.studio.state.pair_name());
                    let said = both.said(Pane::TimeMachine);
                    let shown = results::inspection(&both.studio.state);
                    let Lookup::Ready(found) = shown else {
                        same_reason(shown, said, &what);
                        continue;
                    };
                    let said = said.unwrap_or_else(|err| panic!("{what}: {err}"));
                    count += same(&written(found.report()), &said["cases"][0]["report"], &what);
                }
            }
        }
        counts.push(count);
    }
    compared(&counts, 1000);
}

/// Holds what is drawn over the imprints against the file and the places of the verb. How many pixels were compared.
fn same_influence(both: &Both, found: &Influence, case: &Value, what: &str) -> usize {
    let state = &both.studio.state;
    let file = case["influence"]["file"].as_str().unwrap_or_else(|| panic!("{what}: {case:.300}"));
    let arrays = npz::read(Path::new(file)).unwrap();
    let mut count = 0;
    for (finger, values) in found.pixels.entries() {
        let Values::F32(written) = &arrays[&*state.finger_name(finger)].values else { panic!("{what}: not f32") };
        let shown = values.as_slice().iter().map(|v| (found.deg_per_mm2(*v) as f32).to_bits());
        assert!(shown.eq(written.iter().map(|v| v.to_bits())), "{what}: {finger:?}");
        count += values.as_slice().iter().filter(|v| v.is_finite()).count();
    }
    let places = case["influence"]["places"].as_array().unwrap();
    assert_eq!(places.len(), found.places.len(), "{what}");
    for (said, place) in places.iter().zip(&found.places) {
        let shown = written(place);
        let said: serde_json::Map<String, Value> = said
            .as_object()
            .unwrap()
            .iter()
            .filter(|(key, _)| *key != "finger")
            .map(|(k, v)| (k.clone(), v.clone()))
            .collect();
        count += same(&shown, &Value::Object(said), what);
    }
    count
}

#[test]
pub(in crate::agreement) fn what_a_random_angle_hangs_on_is_the_same_over_the_imprint_and_by_the_verb() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(6);
    let mut counts = Vec::new();
    for mut both in with_poses(home.path()) {
        let mut count = 0;
        both.show(&[Pane::Measured, Pane::Predicted, Pane::Scene]);
        both.studio.send(ViewCommand::ShowInfluence(true).into());
        for at in 0..2 {
            let gate = Rejection::gate(draws.one(0.5..2.0f64) / 1e3).unwrap();
            let registration = RegistrationChoice::new(Registration::DistanceField, gate).unwrap();
            let recipe = Recipe { registration, ..draws.posed() };
            both.predict(&recipe, 19 * at);
            for source in ImprintSource::iter() {
                let what = format!("{} {source:?}, {recipe:?}", both.studio.state.pair_name());
                let words = recipe::in_force(&both.studio.state, source).until(Stage::Pose).words(Stage::Pose).list();
                let more = ["--imprint", source.key(), "--influence", &both.at("influence")].map(str::to_owned);
                let said = both.of_pair(&["pose"], more.into_iter().chain(words));
                let shown = results::influence(&both.studio.state, source);
                let Lookup::Ready(found) = shown else {
                    same_reason(shown, said, &what);
                    continue;
                };
                let said = said.unwrap_or_else(|err| panic!("{what}: {err}"));
                count += same_influence(&both, found, &said["cases"][0], &what);
            }
        }
        counts.push(count);
    }
    compared(&counts, 1000);
}
