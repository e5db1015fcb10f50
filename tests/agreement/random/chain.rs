//! Predictions, their seeds and their depth chain.

use serde_json::json;
use touch2touch::app::seeds::SeedsCommand;
use touch2touch::app::{recipe, results};
use touch2touch_core::ambiguity::ambiguity;
use touch2touch_core::ensemble::AngleFan;
use touch2touch_core::units::angle_error;
use touch2touch_work::io::names::Outputs;
use touch2touch_work::ledger::LedgerResult;
use touch2touch_work::recipe::Stage;

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

/// Figures of the fan of seeds, in the words of the verb.
fn fan(angles_rad: &[Option<f64>], truth_rad: Option<f64>) -> Value {
    let found = AngleFan::of(&angles_rad.iter().flatten().copied().collect::<Vec<_>>());
    let mean = found.as_ref().and_then(|fan| fan.mean_rad);
    let finite = |v: f64| v.is_finite().then_some(v.to_degrees());
    let mut said = json!({
        "angles_deg": angles_rad.iter().map(|a| a.map(f64::to_degrees)).collect::<Vec<_>>(),
        "mean_deg": mean.map(f64::to_degrees),
        "std_deg": found.as_ref().and_then(|fan| finite(fan.std_rad)),
        "extremes_deg": found.as_ref().map(|fan| fan.extremes_rad).filter(|e| e[0].is_finite()).map(|e| e.map(f64::to_degrees)),
    });
    if let (Some(mean), Some(truth)) = (mean, truth_rad) {
        said["mean_error_deg"] = angle_error(mean, truth).to_degrees().into();
    }
    said
}

#[test]
pub(in crate::agreement) fn the_seeds_of_a_random_recipe_have_one_mean_spread_and_fan_in_the_pane_and_by_the_verbs() {
    const COUNT: usize = 3;
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(2);
    let (mut counts, mut poses) = (Vec::new(), 0);
    for mut both in Both::places(home.path()) {
        let mut count = 0;
        both.show(&[Pane::Seeds, Pane::Predicted]);
        both.studio.send(SeedsCommand::Count(COUNT).into());
        let recipe = draws.posed();
        both.predict(&recipe, 31);
        both.studio.send(SeedsCommand::Run(true).into());
        for finger in both.studio.state.rig().pads() {
            both.studio.send(ViewCommand::SelectFinger(finger).into());
            let state = &both.studio.state;
            let Some(found) = results::ensemble(state, finger).ready() else { continue };
            let said = both.said(Pane::Seeds).unwrap();
            let of = said["pairs"].as_array().unwrap();
            let [row] = &of[..] else { panic!("{of:?}") };
            let figures = &row["ensemble"];
            assert_eq!(figures["seeds"].as_array().unwrap().len(), COUNT);
            let spread = [found.spread.mean_std(), found.spread.max_std()];
            count += same(&written(&spread[0]), &figures["spread_mean_m"], "mean spread");
            count += same(&written(&spread[1]), &figures["spread_max_m"], "largest spread");
            let stem = Outputs::new(Path::new(&both.at("predictions"))).unwrap().stem(state.pair_name()).unwrap();
            let stem = format!("{}_{}", stem.display(), state.finger_name(finger));
            let maps = [("mean", Some(&found.spread.mean)), ("spread", Some(&found.spread.std))];
            for (what, map) in maps.into_iter().chain([("channels", found.channels.as_ref())]) {
                let file = PathBuf::from(format!("{stem}_{what}.npy"));
                assert_eq!(map.is_some(), file.is_file(), "{what}");
                count += map.map_or(0, |map| same_pixels(map, &file, &format!("{what}, {recipe:?}")));
            }
            // The prediction itself is what is on screen.
            let imprint = results::imprint(state, ImprintSource::Predicted, finger).ready().unwrap();
            count += same_pixels(imprint, &PathBuf::from(format!("{stem}.npy")), "the first seed");
        }
        counts.push(count);
        let state = &both.studio.state;
        if results::tool_name(state).is_ok() {
            let angles: Vec<Option<f64>> =
                results::seed_poses(state).iter().map(|pose| pose.map(|pose| pose.angle_rad)).collect();
            let truth = results::sample(state).ready().unwrap().grasp_from_object.map(|pose| pose.inverse().theta_rad);
            let words = recipe::in_force(state, ImprintSource::Predicted).words(Stage::Pose).list();
            let more = ["--imprint", "predicted", "--seeds", "3"].map(str::to_owned);
            let said = match both.of_pair(&["pose"], more.into_iter().chain(words)) {
                Ok(said) => said,
                // A mask that the CAD model gives may be refused, by both.
                Err(why) if angles.iter().all(Option::is_none) => {
                    assert!(why.contains("Contact mask"), "{why}");
                    continue;
                }
                Err(why) => panic!("{why}, {recipe:?}"),
            };
            for (part, shown) in fan(&angles, truth).as_object().unwrap() {
                poses += same(shown, &said["cases"][0]["fan"][part], &format!("{part}, {recipe:?}"));
            }
        }
    }
    compared(&counts, 24_500);
    assert!(poses >= COUNT + 5, "{poses}");
}
