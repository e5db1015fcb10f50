//! A recipe is one value: it is said in words and read back the same, its identity is of what decides a result and nothing
//! else, and a random one gives the same numbers in the studio and by the verbs.

use std::path::Path;

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::TestRunner;
use serde_json::Value;
use strum::IntoEnumIterator as _;
use touch2touch::app::command::Pane;
use touch2touch::app::evaluate::EvaluateCommand;
use touch2touch::app::library::Place;
use touch2touch::app::settings::GenerateSettings;
use touch2touch::app::settings::prefer;
use touch2touch::app::state::Lookup;
use touch2touch::app::{export, results};
use touch2touch::headless::recipe_of;
use touch2touch_core::diffusion::{GenerateConfig, Sampler, Spacing};
use touch2touch_core::pose::{Gate, Registration};
use touch2touch_core::postprocess::{CorrectionPart, CorrectionParts, ShiftMode};
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::steps::bundles;
use touch2touch_pipeline::steps::mask::{MaskChoice, MaskSource};
use touch2touch_pipeline::steps::recipe::{Model, Recipe, Stage};

use crate::support::tiny;

use super::{Studio, json, lab_folder, number, optional, pictures_folder};

fn model(name: &str) -> Model {
    bundles::open("test", tiny(name).as_path()).unwrap().into()
}

fn config() -> impl Strategy<Value = GenerateConfig> {
    let sampler = prop_oneof![Just(Sampler::Ddim), Just(Sampler::Ddpm)];
    let spacing = prop_oneof![Just(Spacing::Lab), Just(Spacing::Trailing)];
    (1u32..1000, 0.0..=1.0f64, any::<u64>(), sampler, spacing)
        .prop_map(|(steps, eta, seed, sampler, spacing)| GenerateConfig { steps, eta, seed, sampler, spacing })
}

fn shift() -> impl Strategy<Value = ShiftMode> {
    let parts = proptest::sample::subsequence(CorrectionPart::iter().collect::<Vec<_>>(), 0..4);
    let parts = parts.prop_map(|parts| match CorrectionParts::from(parts) {
        CorrectionParts::ALL => ShiftMode::ExactInverse,
        parts => ShiftMode::Parts(parts),
    });
    prop_oneof![Just(ShiftMode::Raw), Just(ShiftMode::PaperShift), Just(ShiftMode::ExactInverse), parts]
}

fn mask() -> impl Strategy<Value = MaskChoice> {
    let source = proptest::sample::select(MaskSource::iter().collect::<Vec<_>>());
    let probability = proptest::option::of(0.0..=1.0f32);
    (source, -0.02..0.02f32, probability, 0.0..100.0f32, 0.0..0.01f32).prop_map(
        |(source, threshold_m, probability, top_percent, cad_distance_m)| MaskChoice {
            source,
            threshold_m,
            probability,
            top_percent,
            cad_distance_m,
        },
    )
}

fn registration() -> impl Strategy<Value = Registration> {
    prop_oneof![
        proptest::sample::select(Registration::iter().collect::<Vec<_>>()),
        (0.01..50.0f64).prop_map(|mm| Registration::DistanceField(Some(Gate::new(mm / 1e3).unwrap()))),
    ]
}

pub(super) fn recipe() -> impl Strategy<Value = Recipe> {
    let imprint = proptest::sample::select(ImprintSource::iter().collect::<Vec<_>>());
    let engine = proptest::sample::select(EngineChoice::all().collect::<Vec<_>>());
    let (generator, unet) = (model("generator"), model("mask"));
    (imprint, config(), shift(), mask(), any::<bool>(), registration(), engine).prop_map(
        move |(imprint, config, shift, mask, hand, registration, engine)| {
            let generator = Some((generator.clone(), config));
            let mask_model = Some(unet.clone());
            Recipe { imprint, generator, shift, mask, mask_model, hand, registration, engine }.until(Stage::Pose)
        },
    )
}

fn words(recipe: &Recipe) -> Vec<String> {
    let begin = ["touch2touch", "pose", "demo", "--imprint", recipe.imprint.key()].map(str::to_owned);
    begin.into_iter().chain(recipe.words(Stage::Pose).list()).collect()
}

proptest! {
    #[test]
    fn what_is_said_is_read(recipe in recipe()) {
        let words = words(&recipe);
        let back = recipe_of(&words, &Rig::lab()).map(|back| back.until(Stage::Pose)).ok();
        prop_assert_eq!(back.as_ref(), Some(&recipe), "{:?}", words);
    }

    #[test]
    fn an_id_is_of_what_decides_a_stage(a in recipe(), b in recipe()) {
        for stage in Stage::iter() {
            let same = a.until(stage) == b.until(stage);
            prop_assert_eq!(a.id(stage) == b.id(stage), same, "{:?}", stage);
            prop_assert_eq!(a.until(stage).id(stage), a.id(stage));
        }
        // What comes later changes nothing.
        let later = Recipe { registration: b.registration, ..a.clone() };
        prop_assert_eq!(later.id(Stage::Cloud), a.id(Stage::Cloud));
        let later = Recipe { mask: b.mask, hand: b.hand, ..later };
        prop_assert_eq!(later.id(Stage::Imprint), a.id(Stage::Imprint));
    }
}

/// Puts a recipe in force in the studio.
pub(super) fn put(studio: &mut Studio, recipe: &Recipe) {
    let GenerateConfig { steps, eta, seed, sampler, spacing } = recipe.generator.as_ref().unwrap().1;
    let before = studio.state.settings.clone();
    let generate = GenerateSettings { preset: None, steps, eta, seed, sampler, spacing, ..before.generate };
    let (shift, mask, registration) = (recipe.shift, recipe.mask, recipe.registration);
    let change = prefer(move |s| {
        s.runtime = EngineChoice::Rten;
        s.generate = generate.clone();
        (s.shift, s.mask.choice, s.registration) = (shift, mask, registration);
    });
    studio.send(change.into());
}

/// What the studio shows of the selected pair, and what the verbs say of it with the words that the studio gives for it.
/// How many numbers there were.
fn same(studio: &Studio, home: &Path) -> usize {
    let (state, mut compared) = (&studio.state, 0);
    let said = |pane| {
        let words = export::equivalent_words(state, pane).unwrap();
        // What it writes goes where the test's files are.
        let out = home.join("predictions").display().to_string();
        let words = words[1..].iter().map(|word| if word == "predictions" { &out } else { word });
        json(&words.map(String::as_str).collect::<Vec<_>>(), home)
    };
    let (poses, name) = (said(Pane::Metrics), state.pair_name());
    let cases: &[Value] = poses["cases"].as_array().map_or(&[], Vec::as_slice);
    for source in ImprintSource::iter() {
        let case = cases.iter().find(|case| case["imprint"] == source.key());
        let angle = case.map_or(&Value::Null, |case| &case["angle_deg"]);
        let shown = results::pose(state, source).ready();
        assert_eq!(*angle, optional(shown.map(|pose| pose.angle_rad.to_degrees())), "{name} {source:?}: {case:?}");
        if let (Some(pose), Some(case)) = (shown, case) {
            let place = pose.object_from_grasp();
            assert_eq!([&case["y_m"], &case["z_m"]], [&number(place.y_m), &number(place.z_m)], "{name} {source:?}");
            assert_eq!(case["error_deg"], optional(pose.error_rad.map(f64::to_degrees)), "{name} {source:?}");
            compared += 4;
        }
    }
    let generated = said(Pane::Generate);
    for finger in state.rig().pads() {
        let Lookup::Ready(found) = results::comparison(state, finger) else { continue };
        let key = state.finger_name(finger).to_string();
        let rows = generated["pairs"].as_array().unwrap();
        let row = rows.iter().find(|row| row["finger"] == key.as_str()).unwrap();
        assert_eq!([&row["psnr_db"], &row["ssim"]], [&optional(found.psnr_db), &optional(found.ssim)], "{name} {key}");
        compared += 2;
    }
    compared
}

#[test]
pub(super) fn a_random_recipe_gives_the_same_numbers_in_the_studio_and_by_the_verbs() {
    let mut runner = TestRunner::deterministic();
    let mut draw = || {
        let mut recipe = recipe().new_tree(&mut runner).unwrap().current().of(ImprintSource::Predicted);
        let (model, config) =
            recipe.generator.take().unwrap_or_else(|| (model("generator"), GenerateConfig::default()));
        recipe.generator = Some((model, GenerateConfig { steps: 1 + config.steps % 2, ..config }));
        recipe
    };
    let home = tempfile::tempdir().unwrap();
    let lab = lab_folder(home.path());
    let pictures = pictures_folder(home.path());
    let mut compared = Vec::new();
    for (place, pairs) in [(Place::Demo, 96), (Place::Path(lab), 3), (Place::Path(pictures), 2)] {
        let mut studio = Studio::open(place, home.path());
        let mut count = 0;
        for at in 0..2 {
            put(&mut studio, &draw());
            studio.predict((at * 31) % pairs);
            count += same(&studio, home.path());
        }
        compared.push(count);
    }
    assert!(compared.iter().all(|count| *count >= 4), "{compared:?}");
}

/// A value without the times in it, which no two runs share.
fn timeless(mut value: Value) -> Value {
    match &mut value {
        Value::Object(map) => {
            map.remove("seconds");
            map.values_mut().for_each(|part| *part = timeless(part.take()));
        }
        Value::Array(parts) => parts.iter_mut().for_each(|part| *part = timeless(part.take())),
        _ => {}
    }
    value
}

#[test]
pub(super) fn a_random_recipe_gives_the_same_results_table_in_the_studio_and_by_the_verb() {
    let mut runner = TestRunner::deterministic();
    let [home, other] = [0; 2].map(|_| tempfile::tempdir().unwrap());
    let lab = lab_folder(home.path());
    let mut rows = 0;
    let mut studio = Studio::open(Place::Path(lab), home.path());
    studio.send(EvaluateCommand::Published(false).into());
    for _ in 0..2 {
        let mut recipe = recipe().new_tree(&mut runner).unwrap().current().of(ImprintSource::Predicted);
        recipe.generator.get_or_insert_with(|| (model("generator"), GenerateConfig::default()));
        put(&mut studio, &recipe);
        let words = export::equivalent_words(&studio.state, Pane::Results).unwrap();
        studio.send(EvaluateCommand::Start.into());
        let shown = studio.state.table.result.clone().expect("the table was made");
        let said = json(&words[1..].iter().map(String::as_str).collect::<Vec<_>>(), other.path());
        let shown: Value = serde_json::from_str(&serde_json::to_string(&*shown).unwrap()).unwrap();
        for part in ["rows", "groups", "skipped"] {
            assert!(!said[part].is_null(), "{part}");
            assert_eq!(timeless(shown[part].clone()), timeless(said[part].clone()), "{part}, {recipe:?}");
        }
        rows += said["rows"].as_array().unwrap().len();
    }
    assert!(rows >= 4, "{rows}");
}

/// Part of the format: kept results are found by it, also when defaults change.
#[test]
fn ids_stay_what_they_are() {
    let ids = |recipe: &Recipe| Stage::iter().map(|stage| recipe.id(stage).to_string()).collect::<Vec<_>>();
    let by_mask = Recipe { registration: Registration::DistanceField(None), ..Recipe::default() };
    assert_eq!(ids(&by_mask), vec!["r1-44136fa355b3678a"; 5], "nothing is named");
    let joint = Recipe { registration: Registration::default(), ..Recipe::default() };
    assert_eq!(ids(&joint)[..4], ids(&by_mask)[..4]);
    assert_eq!(ids(&joint)[4], "r1-b35d14d5984e1aad");
    let hand = Recipe { hand: false, ..by_mask.clone() };
    assert_eq!(hand.id(Stage::Imprint), by_mask.id(Stage::Imprint));
    assert_ne!(hand.id(Stage::Mask), by_mask.id(Stage::Mask));
    // A mask's number that goes without saying is not named: all that differs is the source.
    let mask = |threshold_m| MaskChoice {
        source: MaskSource::TopPercent,
        threshold_m,
        probability: None,
        top_percent: 15.0,
        cad_distance_m: 0.001,
    };
    let of = |mask| Recipe { mask, ..by_mask.clone() }.id(Stage::Mask);
    assert_eq!(of(mask(0.005)), of(mask(0.01)));
    assert_ne!(of(mask(0.005)), of(MaskChoice { top_percent: 10.0, ..mask(0.005) }));
}
