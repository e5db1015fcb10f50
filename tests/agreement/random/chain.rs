//! The depth chain of predictions.

use serde_json::json;
use touch2touch::app::results;
use touch2touch_core::ambiguity::ambiguity;
use touch2touch_work::ledger::LedgerResult;

use super::*;

/// A depth chain in the words of the verb.
fn chain(found: &LedgerResult) -> Value {
    let ledger = &found.ledger;
    let stages: Vec<Value> = ledger
        .stages
        .iter()
        .map(|record| {
            let mut stage = json!({
                "name": record.stage.name(), "how": record.how, "size": record.image.size(), "invalid": record.invalid,
                "unit": if record.stage.is_meters() { "m" } else { "1" },
                "stats": written(&record.stats), "histogram": written(&record.histogram),
            });
            if let Some(note) = &record.note {
                stage["note"] = note.as_str().into();
            }
            stage
        })
        .collect();
    let against = ledger.against.as_ref().map(|against| {
        let joint = &against.joint;
        let counts: Vec<_> = (0..joint.counts.height()).map(|y| joint.counts.row(y).to_vec()).collect();
        json!({
            "pixels": joint.pixels, "line": written(&joint.line), "correlation": written(&against.orientation),
            "joint": {"range_m": [joint.lo, joint.hi], "bins": joint.counts.width(), "counts": counts},
        })
    });
    json!({
        "stages": stages, "against_truth": against, "readings": written(&found.readings), "flags": written(&ledger.flags),
    })
}

#[test]
pub(in crate::agreement) fn a_random_recipe_has_the_same_depth_chain_in_the_pane_and_by_the_verb() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(1);
    let mut counts = Vec::new();
    for mut both in Both::places(home.path()) {
        let mut count = 0;
        both.show(&[Pane::Ledger, Pane::Predicted]);
        for at in 0..2 {
            let recipe = draws.recipe();
            both.predict(&recipe, 40 * at);
            for finger in both.studio.state.rig().pads() {
                both.studio.send(ViewCommand::SelectFinger(finger).into());
                let state = &both.studio.state;
                // An image folder has one finger.
                let Some(found) = results::ledger(state, finger).ready() else { continue };
                let said = both.said(Pane::Ledger).unwrap();
                for (part, shown) in chain(found).as_object().unwrap() {
                    count += same(shown, &said[part], &format!("{} {part}, {recipe:?}", state.pair_name()));
                }
                let touch = results::sample(state).ready().unwrap().pad(finger).unwrap();
                let left_open = touch.color().and_then(|color| ambiguity(&color.difference));
                count += same(&written(&left_open), &said["ambiguity"], "ambiguity");
                let (_, config) = recipe.generator.as_ref().unwrap();
                assert_eq!([&said["steps"], &said["seed"]], [&config.steps.into(), &Value::from(config.seed)]);
            }
        }
        counts.push(count);
    }
    compared(&counts, 200);
}
