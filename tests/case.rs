//! A case whose model does not ship: it brings the model, and where it does not, shows what it holds and says so.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use touch2touch::app::command::{Command, Pane, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::library::Place;
use touch2touch::app::results::Why;
use touch2touch::app::runtime::Runtime;
use touch2touch::app::services::live::LiveServices;
use touch2touch::app::state::State;
use touch2touch::app::{export, results};
use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::rig::lab;
use touch2touch_core::sim::{SimConfig, random_grasp, simulate};
use touch2touch_work::bundles::{self, BundleInfo};
use touch2touch_work::case::{CaseSetup, check, make, open};
use touch2touch_work::infer::engine::EngineChoice;
use touch2touch_work::io::case_file::{self, CaseContent};
use touch2touch_work::io::dataset::Dataset;
use touch2touch_work::io::simulated::{Layout, write_pair, write_tools};
use touch2touch_work::job::JobCx;
use touch2touch_work::labels::PairLabels;
use touch2touch_work::mask::{MaskChoice, MaskSource};
use touch2touch_work::models::Models;
use touch2touch_work::recipe::Recipe;

/// The generator that ships, under another name: a bundle of one's own.
fn own_generator(folder: &Path) -> BundleInfo {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models/generator_ldm");
    std::fs::create_dir_all(folder).unwrap();
    for entry in std::fs::read_dir(shipped).unwrap() {
        let file = entry.unwrap().path();
        let to = folder.join(file.file_name().unwrap());
        if file.ends_with("manifest.json") {
            let text = std::fs::read_to_string(&file).unwrap();
            let mut manifest: serde_json::Value = serde_json::from_str(&text).unwrap();
            manifest["name"] = "mine".into();
            // A name alone makes no other model.
            manifest["shift"]["pred_mean"] = 0.016.into();
            std::fs::write(to, serde_json::to_vec(&manifest).unwrap()).unwrap();
        } else {
            std::fs::copy(&file, to).unwrap();
        }
    }
    bundles::open("test", folder).unwrap()
}

/// A case of a simulated grasp, predicted by a generator of one's own; the generator is gone afterwards.
fn case(folder: &Path) -> PathBuf {
    let (data, model) = (folder.join("data"), folder.join("model"));
    let tool = &catalog::tools()[1];
    let sample = simulate(tool, random_grasp(3), 0, &SimConfig::default());
    write_pair(&data, Layout::Train, &tool.name, 0, &sample).unwrap();
    write_tools(&data, &[(tool.name.as_str(), true, tool.mesh())]).unwrap();
    let dataset = Dataset::open(&data).unwrap();
    let setup = CaseSetup {
        pair: PairId(0),
        recipe: Recipe {
            generator: Some((own_generator(&model).into(), GenerateConfig { steps: 1, ..GenerateConfig::default() })),
            mask: MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() },
            engine: EngineChoice::Rten,
            ..Recipe::default()
        },
        labels: PairLabels::default(),
        view: None,
    };
    let file = folder.join("mine.t2tcase");
    make(&dataset, &setup, &Models::new(None), &file, &JobCx::unwatched()).unwrap();
    std::fs::remove_dir_all(model).unwrap();
    std::fs::remove_dir_all(data).unwrap();
    file
}

/// The case without its models, as one whose model is too large to be taken along.
fn without_models(file: &Path) -> PathBuf {
    let CaseContent { manifest, files, mut beside } = case_file::read(file).unwrap();
    let is_model = |name: &String| name.starts_with(case_file::MODELS);
    assert!(beside.keys().any(is_model));
    beside.retain(|name, _| !is_model(name));
    let mut manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    manifest["beside"].as_object_mut().unwrap().retain(|name, _| !is_model(name));
    let lean = file.with_file_name("lean.t2tcase");
    let manifest = serde_json::to_vec(&manifest).unwrap();
    case_file::write(&lean, &CaseContent { manifest, files, beside }).unwrap();
    lean
}

/// The studio, without its window, on a case.
fn studio(file: &Path, config: &Path) -> State {
    let mut state = State::default();
    let services = LiveServices::with_config_folder(Some(config.to_owned()));
    let mut runtime = Runtime::inline(Arc::new(services));
    runtime.start(&mut state, Some(Place::Path(file.to_owned())));
    let panes = [Pane::Predicted, Pane::Measured, Pane::Scene].into();
    runtime.tick(&mut state, vec![Command::View(ViewCommand::ShowPanes(panes))]);
    runtime.settle(&mut state);
    state
}

#[test]
fn a_case_of_a_model_of_ones_own_is_the_same_where_that_model_is_not() {
    let [here, there] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let file = case(here.path());
    let opened = open(&file, there.path()).unwrap();
    let report = check(&opened, &opened.bundles(), &Models::new(None), &JobCx::unwatched()).unwrap();
    assert!(report.same, "{report:?}");
    let held = &opened.held.imprints[&(ImprintSource::Predicted, lab::RIGHT)];
    let bits = |imprint: &touch2touch_core::grid::DepthMap| imprint.map(|v| v.to_bits());

    // It brings its model: predicted again, with the same result.
    let state = studio(&file, there.path());
    let shown = results::chosen(&state, lab::RIGHT).expect("it is predicted");
    assert_eq!(
        (state.library.made_with(shown).as_str(), results::outdated(&state, lab::RIGHT)),
        ("mine · 1 step · seed 42", None)
    );
    assert!(export::case_lacks(&state).is_empty());
    assert_eq!(bits(results::imprint(&state, ImprintSource::Predicted, lab::RIGHT).ready().unwrap()), bits(held));

    // Without it the case's own imprint is shown, said to be, and nothing of the model that ships.
    let lean = without_models(&file);
    let state = studio(&lean, there.path());
    let outdated = results::outdated(&state, lab::RIGHT).expect("it cannot be made here");
    assert_eq!((outdated.made_with.as_str(), outdated.why), ("mine · 1 step · seed 42", Why::Held));
    assert_eq!(bits(results::imprint(&state, ImprintSource::Predicted, lab::RIGHT).ready().unwrap()), bits(held));
    assert!(results::pose(&state, ImprintSource::Predicted).ready().is_some(), "it is posed as it was");
    assert!(results::can_generate(&state).is_err(), "nothing else is generated in its place");
    assert!(
        matches!(&export::case_lacks(&state)[..], [one] if one.contains("generator mine is not")),
        "{:?}",
        export::case_lacks(&state)
    );
    let opened = open(&lean, there.path()).unwrap();
    let err = check(&opened, &opened.bundles(), &Models::new(None), &JobCx::unwatched()).unwrap_err();
    assert!(err.why.contains("mine"), "{err}");
}
