//! Registrations: their steps.

use strum::IntoEnumIterator as _;
use touch2touch::app::inspect::InspectCommand;
use touch2touch::app::results;
use touch2touch::app::state::Lookup;
use touch2touch_core::frames::PlanarPose;

use super::*;

/// Demo and lab folder: pictures have no pose.
fn with_poses(home: &Path) -> impl Iterator<Item = Both> {
    Both::places(home).take(2)
}

/// The reason that keeps a registration from an answer is the same in both.
fn same_reason<T>(shown: Lookup<'_, T>, said: Result<Value, String>, what: &str) {
    let said = match said {
        Err(said) => said,
        Ok(said) => said["cases"][0]["stop"].as_str().unwrap_or_default().to_owned(),
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
        both.show(&[Pane::Steps, Pane::Predicted]);
        let recipe = draws.posed();
        both.predict(&recipe, 17);
        for source in ImprintSource::iter() {
            both.studio.send(InspectCommand::Source(source).into());
            // From the registration's own starts, and from one of a person.
            let by_hand = PlanarPose { theta_rad: 10f64.to_radians(), y_m: -1.5e-3, z_m: 2e-3 };
            for start in [None, Some(by_hand)] {
                both.studio.send(InspectCommand::Start(start).into());
                let what = format!("{} {source:?} {start:?}, {recipe:?}", both.studio.state.pair_name());
                let said = both.said(Pane::Steps);
                let shown = results::inspection(&both.studio.state);
                let Lookup::Ready(found) = shown else {
                    same_reason(shown, said, &what);
                    continue;
                };
                let said = said.unwrap_or_else(|err| panic!("{what}: {err}"));
                count += same(&written(found.report()), &said["cases"][0]["report"], &what);
            }
        }
        counts.push(count);
    }
    compared(&counts, 1000);
}
