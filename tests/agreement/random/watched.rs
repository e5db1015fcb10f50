//! A followed folder: what the studio shows of what arrives, and what `watch` writes of it.

use std::time::{Duration, Instant};

use touch2touch::app::command::FollowCommand;
use touch2touch_core::catalog;
use touch2touch_core::postprocess::Stats;
use touch2touch_core::sim::{SimConfig, random_grasp, simulate};
use touch2touch_pipeline::io::pt::Tensor;
use touch2touch_pipeline::io::simulated::{Layout, write_pair};
use touch2touch_pipeline::steps::mask::MaskSource;
use touch2touch_pipeline::steps::recipe::Stage;

use super::*;
use crate::support::{files_below, succeed};
use touch2touch::app::{recipe, results};

/// Holds the pair on screen against the files that the verb wrote of it.
fn same_touch(both: &Both, written_by: &Path, what: &str) -> usize {
    let state = &both.studio.state;
    let said: Value = serde_json::from_slice(&std::fs::read(written_by).unwrap()).unwrap();
    let what = format!("{}, {what}", state.pair_name());
    let arrays = npz::read(&written_by.with_extension("npz")).unwrap();
    let source = ImprintSource::Predicted;
    let mut count = 0;
    for finger in said["fingers"].as_array().unwrap() {
        let pad = state.rig().pads().find(|pad| finger["finger"] == *state.finger_name(*pad)).unwrap();
        let imprint = results::imprint(state, source, pad).ready().unwrap_or_else(|| panic!("{what}: no imprint"));
        let name = state.finger_name(pad);
        let Tensor { values: Values::F32(pixels), .. } = &arrays[&format!("imprint_{name}")] else { panic!("f32") };
        assert!(imprint.as_slice().iter().map(|v| v.to_bits()).eq(pixels.iter().map(|v| v.to_bits())), "{what}");
        let stats = Stats::of(imprint);
        let shown = [stats.min, stats.max, stats.mean];
        count +=
            same(&written(&shown), &serde_json::json!([finger["min_m"], finger["max_m"], finger["mean_m"]]), &what);
        let in_force = results::mask_in_force(state, source, pad).unwrap_or_else(|_| panic!("{what}: no mask"));
        let px = in_force.mask.as_slice().iter().filter(|&&on| on).count();
        assert_eq!(finger["contact_px"], px, "{what}");
        let compared = results::comparison(state, pad).ready();
        let figure =
            |get: fn(&touch2touch_pipeline::compare::Comparison) -> Option<f64>| written(&compared.and_then(get));
        let none = Value::Null;
        let of = |key: &str| finger.get(key).unwrap_or(&none).clone();
        count += same(&figure(|c| c.psnr_db), &of("psnr_db"), &what) + same(&figure(|c| c.ssim), &of("ssim"), &what);
        count += pixels.len() + 1;
    }
    let (pose, posed) = (results::pose(state, source).ready(), &said["pose"]);
    assert_eq!(pose.is_some(), posed.is_object(), "{what}: {posed}, {}", said["no_pose"]);
    if let Some(found) = pose {
        let place = found.object_from_grasp();
        let shown = serde_json::json!({
            "angle_deg": found.angle_rad.to_degrees(), "y_m": place.y_m, "z_m": place.z_m, "rms_m": found.rms_m,
            "points": found.num_points, "grasp_from_object": written(&found.grasp_from_object),
        });
        for (key, value) in shown.as_object().unwrap() {
            count += same(value, &posed[key], &format!("{what}: {key}"));
        }
        let none = Value::Null;
        let error = written(&found.error_rad.map(f64::to_degrees));
        count += same(&error, posed.get("error_deg").unwrap_or(&none), &what);
    }
    count
}

/// The results of the verb with the recipe in force, by the name of the touch that they say.
fn watched(both: &Both) -> Vec<(String, PathBuf)> {
    let out = both.at("watched");
    let begin = ["watch", &both.path, "--once", "--out", &out].map(str::to_owned);
    let words = recipe::in_force(&both.studio.state, ImprintSource::Predicted).words(Stage::Pose).list();
    let all: Vec<&str> = begin.iter().chain(&words).map(String::as_str).chain(["--json"]).collect();
    succeed(&all, &both.home);
    let written = files_below(Path::new(&out)).into_iter().filter(|file| file.to_string_lossy().ends_with(".t2t.json"));
    let named = written.map(|file| {
        let said: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
        (said["name"].as_str().unwrap().to_owned(), file)
    });
    named.collect()
}

#[test]
pub(in crate::agreement) fn what_lies_in_a_folder_is_watched_to_the_numbers_that_the_studio_shows() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(16);
    let mut counts = Vec::new();
    for mut both in Both::places(home.path()).skip(1) {
        both.show(&[Pane::Predicted, Pane::Masks, Pane::Compare, Pane::Metrics, Pane::Scene]);
        let recipe = loop {
            let recipe = draws.posed();
            // A new touch has no true pose.
            if !matches!(recipe.mask.source, MaskSource::Cad | MaskSource::Truth) {
                break recipe;
            }
        };
        put(&mut both.studio, &recipe);
        let found = watched(&both);
        assert_eq!(found.len() as u32, both.pairs(), "{found:?}");
        let mut count = 0;
        for (name, file) in found {
            let index = both.studio.state.library.open.as_ref().unwrap().source.dataset.index.pairs.clone();
            let at = index.iter().position(|pair| pair.name == name).unwrap_or_else(|| panic!("no {name}"));
            both.predict(&recipe, at as u32);
            count += same_touch(&both, &file, &format!("{recipe:?}"));
        }
        counts.push(count);
    }
    compared(&counts, 20_000);
}

#[test]
pub(in crate::agreement) fn what_arrives_is_followed_by_the_studio_to_the_numbers_that_watch_writes() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(17);
    let folder = lab_folder(home.path());
    let mut both = Both::open(Place::Path(folder.clone()), home.path());
    both.show(&[Pane::Predicted, Pane::Masks, Pane::Compare, Pane::Metrics, Pane::Scene]);
    let mut recipe = draws.posed();
    recipe.mask.source = MaskSource::TopPercent;
    put(&mut both.studio, &recipe);
    both.studio.send(FollowCommand::Set(true).into());
    let tool = catalog::tools().iter().find(|tool| tool.name == "pattern_36").unwrap();
    let sample = simulate(tool, random_grasp(40), 40, &SimConfig::default());
    write_pair(&folder, Layout::Test, &tool.name, 40, &sample).unwrap();
    let begin = Instant::now();
    while both.studio.state.library.follow.as_ref().is_none_or(|follow| follow.arrived == 0) {
        assert!(begin.elapsed() < Duration::from_secs(60), "nothing arrives: {:?}", both.studio.state.log.entries);
        std::thread::sleep(Duration::from_millis(10));
        let Studio { state, runtime } = &mut both.studio;
        runtime.tick(state, Vec::new());
    }
    // Until it is predicted and posed.
    both.studio.send(ViewCommand::ShowBothFingers(true).into());
    assert!(both.studio.state.pair_name().ends_with("data_40"), "{}", both.studio.state.pair_name());
    let found = watched(&both);
    let (_, file) = found.iter().find(|(name, _)| name == both.studio.state.pair_name()).expect("it was watched");
    compared(&[same_touch(&both, file, &format!("{recipe:?}"))], 20_000);
}
