//! Random recipes from Python: the package gives the numbers of the verbs, to the last bit.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use touch2touch_core::diffusion::Spacing;
use touch2touch_core::postprocess::{CorrectionPart, CorrectionParts, ShiftMode};
use touch2touch_pipeline::steps::recipe::{Recipe, Stage, millimeters};

use super::random::Draws;
use super::{json, lab_folder};
use crate::support;

/// Estimates pairs as told on standard input, and prints what the verb `pose` says of them.
const ESTIMATE: &str = r#"
import json, sys
import numpy as np
import touch2touch as t2t

rows = []
for path, name, choices in json.load(sys.stdin):
    result = t2t.estimate(t2t.open(path)[name], t2t.Recipe(**choices))
    pose = result.pose
    rows.append(pose and {
        "angle_deg": float(np.degrees(pose.angle)), "error_deg": pose.error and float(np.degrees(pose.error)),
        "angle_sd_deg": None if pose.sigma is None else float(np.degrees(pose.sigma[0])), "verdict": pose.verdict,
    })
json.dump(rows, sys.stdout)
"#;

/// A recipe as the keywords of `touch2touch.Recipe`.
fn keywords(recipe: &Recipe) -> Value {
    let (model, config) = recipe.generator.as_ref().unwrap();
    let path = |model: &touch2touch_pipeline::steps::recipe::Model| model.origin.path().display().to_string();
    let number = |meters: f32| millimeters(meters).parse::<f64>().unwrap();
    let mask = recipe.mask;
    let mut all = json!({
        "imprint": recipe.imprint.key(), "bundle": path(model), "steps": config.steps, "seed": config.seed, "eta": config.eta,
        "sampler": config.sampler.key(), "mask": mask.source.key(),
        "threshold_mm": number(mask.threshold_m), "probability": mask.probability, "top_percent": mask.top_percent,
        "cad_mm": number(mask.cad_distance_m), "hand": recipe.hand, "engine": recipe.registration.to_string(),
        "runtime": "rten", "mask_bundle": recipe.mask_model.as_ref().map(path),
    });
    all["spacing"] = if config.spacing == Spacing::Lab { "lab" } else { "trailing" }.into();
    let (shift, parts) = match recipe.shift {
        ShiftMode::Raw => ("raw", CorrectionParts::ALL),
        ShiftMode::PaperShift => ("paper", CorrectionParts::ALL),
        ShiftMode::Parts(parts) => ("exact", parts),
        _ => ("exact", CorrectionParts::ALL),
    };
    all["shift"] = shift.into();
    let names = <CorrectionPart as strum::IntoEnumIterator>::iter().filter(|part| parts.has(*part)).map(<&str>::from);
    all["fit_parts"] = names.collect::<Vec<_>>().into();
    all
}

/// Rows of the package, in order.
fn estimate(python: &Path, asked: &[(String, String, Value)]) -> Vec<Value> {
    let mut child =
        Command::new(python).args(["-c", ESTIMATE]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(&serde_json::to_vec(asked).unwrap()).unwrap();
    let done = child.wait_with_output().unwrap();
    assert!(done.status.success());
    serde_json::from_slice(&done.stdout).unwrap()
}

#[test]
pub(super) fn a_random_recipe_gives_the_same_poses_from_python_and_by_the_verb() {
    let Some(python) = support::python() else { return };
    let home = tempfile::tempdir().unwrap();
    let lab = lab_folder(home.path()).display().to_string();
    let mut draws = Draws::new(29);
    let (mut asked, mut said) = (Vec::new(), Vec::new());
    for at in 0..4 {
        let path = if at % 2 == 0 { "demo" } else { &lab };
        let recipe = draws.posed();
        let recipe = Recipe { engine: touch2touch_pipeline::infer::engine::EngineChoice::Rten, ..recipe };
        let words = recipe.words(Stage::Pose).list();
        let begin = ["pose", path, "--imprint", "predicted", "--limit", "2", "--no-cache"];
        let words: Vec<&str> = begin.into_iter().chain(words.iter().map(String::as_str)).collect();
        for case in json(&words, home.path())["cases"].as_array().unwrap() {
            asked.push((path.to_owned(), case["name"].as_str().unwrap().to_owned(), keywords(&recipe)));
            said.push(case.clone());
        }
    }
    let mut poses = 0;
    for ((row, case), asked) in estimate(&python, &asked).iter().zip(&said).zip(&asked) {
        assert_eq!(row.is_null(), case["angle_deg"].is_null(), "{asked:?}: {case}");
        if row.is_null() {
            continue;
        }
        for number in ["angle_deg", "error_deg", "angle_sd_deg"] {
            assert_eq!(row[number], case[number], "{number}, {asked:?}");
        }
        assert_eq!(row["verdict"], case["verdict"]["grade"], "{asked:?}");
        poses += 1;
    }
    assert!(poses >= 3, "{poses} poses of {}", said.len());
}

/// Rows of all pairs of a data set, as JSON.
const ROWS: &str = r#"
import json, sys
import touch2touch as t2t
import touch2touch.ray

path, bundle = sys.argv[1:]
recipe = t2t.Recipe("predicted", bundle=bundle, mask="threshold", runtime="rten", steps=1)
rows = [touch2touch.ray.row(pair, recipe, "") for pair in t2t.open(path)]
print(json.dumps([{key: None if value != value else value for key, value in row.items()} for row in rows]))
"#;

#[test]
fn rows_from_python_have_the_figures_of_the_verbs() {
    let Some(python) = support::python() else { return };
    let home = tempfile::tempdir().unwrap();
    let lab = lab_folder(home.path());
    let bundle = support::tiny("generator");
    let done = Command::new(python).args(["-c", ROWS]).arg(&lab).arg(&bundle).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let rows: Vec<Value> = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(rows.len(), 3);
    let bundle = bundle.display().to_string();
    let model = ["--bundle", bundle.as_str(), "--runtime", "rten", "--steps", "1", "--no-cache"];
    let lab = lab.to_str().unwrap();
    let pose = ["pose", lab, "--imprint", "predicted", "--mask", "threshold"];
    let poses = json(&[&pose[..], &model].concat(), home.path());
    let out = home.path().join("out").display().to_string();
    let generated = json(&[&["generate", lab, "--finger", "both", "--out", &out][..], &model].concat(), home.path());
    let of = |answer: &Value, list: &str, name: &str| -> Vec<Value> {
        answer[list].as_array().unwrap().iter().filter(|row| row["name"] == name).cloned().collect()
    };
    for row in rows {
        let name = row["pair"].as_str().unwrap();
        let degrees = row["error_rad"].as_f64().map(f64::to_degrees);
        assert_eq!(of(&poses, "cases", name)[0]["error_deg"].as_f64(), degrees, "{name}");
        for image in of(&generated, "pairs", name) {
            let key = format!("psnr_{}_db", image["finger"].as_str().unwrap());
            let apart = row[&key].as_f64().unwrap() - image["psnr_db"].as_f64().unwrap();
            assert!(apart.abs() < 1e-9, "{name}: {key} {apart}");
        }
    }
}
