//! Any two imprints against each other.

use proptest::option;
use proptest::prelude::*;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{CompareChoice, CompareMode};
use touch2touch_pipeline::compare::Comparison;
use touch2touch_pipeline::compare::subject::{RecipeChange, SHIFTS, Subject};

use super::*;

fn change() -> impl Strategy<Value = RecipeChange> {
    let shift = proptest::sample::select(SHIFTS.map(|(_, mode)| mode).to_vec());
    (option::of(1..=2u32), option::of(any::<u64>()), option::of(shift)).prop_map(|(steps, seed, shift)| RecipeChange {
        bundle: None,
        steps,
        seed,
        shift,
    })
}

fn subject() -> impl Strategy<Value = Subject> {
    prop_oneof![
        Just(Subject::Measured),
        Just(Subject::shown()),
        change().prop_map(Subject::Predicted),
        (change(), 2..=3usize).prop_map(|(change, seeds)| Subject::Mean(change, seeds)),
    ]
}

/// A comparison in the words of the verb.
fn figures(found: &Comparison) -> Value {
    serde_json::json!({ "psnr_db": found.psnr_db, "ssim": found.ssim })
}

#[test]
pub(in crate::agreement) fn any_two_imprints_differ_by_the_same_in_the_pane_and_by_the_verb() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(3);
    let (mut counts, mut poses) = (Vec::new(), 0);
    for mut both in Both::places(home.path()) {
        let mut count = 0;
        both.show(&[Pane::Compare, Pane::Predicted, Pane::Scene]);
        for at in 0..2 {
            let recipe = draws.posed();
            // Prediction against measurement is a column of figures, whose command the figures' test holds.
            let compared = loop {
                let drawn =
                    CompareChoice { a: draws.one(subject()), b: draws.one(subject()), mode: CompareMode::Difference };
                if !drawn.is_error() {
                    break drawn;
                }
            };
            let shown = compared.clone();
            both.studio.send(prefer(move |s| *s.compare_mut() = shown.clone()).into());
            both.predict(&recipe, 29 * at);
            let state = &both.studio.state;
            let what = format!("{}: {} and {}, {recipe:?}", state.pair_name(), compared.a, compared.b);
            let said = both.said(Pane::Compare).unwrap_or_else(|err| panic!("{what}: {err}"));
            for finger in said["fingers"].as_array().unwrap_or_else(|| panic!("{what}: {said}")) {
                let pad = state.rig().pads().find(|pad| finger["finger"] == *state.finger_name(*pad)).unwrap();
                let measured = |subject: &Subject| (*subject != Subject::Measured).then_some(Subject::Measured);
                for (key, one, other) in [
                    ("a", &compared.a, measured(&compared.a)),
                    ("b", &compared.b, measured(&compared.b)),
                    ("a_b", &compared.a, Some(compared.b.clone())),
                ] {
                    let shown = match other {
                        Some(other) => {
                            figures(results::subjects_compared(state, one, &other, pad).ready().expect(&what))
                        }
                        None => Value::Null,
                    };
                    count += same(&shown, &finger[key], &format!("{what}: {key}"));
                }
            }
            let [a, b] = [&compared.a, &compared.b].map(|subject| results::subject_pose(state, subject));
            assert_eq!(said["poses"].is_null(), a.is_none() || b.is_none(), "{what}: {}", said["poses"]);
            for (key, pose) in [("a", a), ("b", b)] {
                let Some(pose) = pose.filter(|_| !said["poses"].is_null()) else { continue };
                let shown = [Some(pose.angle_rad.to_degrees()), pose.error_rad.map(f64::to_degrees)];
                for (shown, part) in shown.iter().zip([format!("{key}_deg"), format!("{key}_error_deg")]) {
                    poses += same(&written(shown), &said["poses"][&part], &format!("{what}: {part}"));
                }
            }
        }
        counts.push(count);
    }
    compared(&counts, 4);
    assert!(poses >= 8, "{poses}");
}
