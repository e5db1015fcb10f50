//! A recipe is one value: it is said in words and read back the same, its identity is of what decides a result and nothing
//! else, and a random one gives the same numbers in the studio and by the verbs.

use std::path::Path;

use proptest::prelude::*;
use strum::IntoEnumIterator as _;
use touch2touch::headless::recipe_of;
use touch2touch_core::diffusion::{GenerateConfig, Sampler, Spacing};
use touch2touch_core::pose::{Registration, RegistrationChoice, Rejection};
use touch2touch_core::postprocess::{CorrectionPart, CorrectionParts, ShiftMode};
use touch2touch_core::rig::Rig;
use touch2touch_work::bundles;
use touch2touch_work::infer::engine::EngineChoice;
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::mask::{MaskChoice, MaskSource};
use touch2touch_work::recipe::{Model, Recipe, Stage};

fn model(name: &str) -> Model {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bundles").join(name);
    bundles::open("test", folder.as_path()).unwrap().into()
}

fn config() -> impl Strategy<Value = GenerateConfig> {
    let sampler = prop_oneof![Just(Sampler::Ddim), Just(Sampler::Ddpm)];
    let spacing = prop_oneof![Just(Spacing::Lab), Just(Spacing::Trailing)];
    (1u32..1000, 0.0..=1.0f64, any::<u64>(), sampler, spacing).prop_map(|(steps, eta, seed, sampler, spacing)| {
        GenerateConfig { steps, eta, seed, sampler, spacing, guidance: 1.0 }
    })
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

fn registration() -> impl Strategy<Value = RegistrationChoice> {
    let rejection = prop_oneof![
        Just(Rejection::Own),
        (0.01..50.0f64).prop_map(|mm| Rejection::gate(mm / 1e3).unwrap()),
        (0.0..0.9f64).prop_map(|share| Rejection::trim(share).unwrap()),
    ];
    let by = proptest::sample::select(Registration::iter().collect::<Vec<_>>());
    (by, rejection).prop_map(|(by, rejection)| RegistrationChoice::new(by, rejection).unwrap_or(by.into()))
}

fn recipe() -> impl Strategy<Value = Recipe> {
    let imprint = proptest::sample::select(ImprintSource::iter().collect::<Vec<_>>());
    let engine = proptest::sample::select(vec![EngineChoice::Auto, EngineChoice::Rten, EngineChoice::Ort]);
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

/// Part of the format: kept results are found by it.
#[test]
fn ids_stay_what_they_are() {
    let recipe: Recipe = Recipe::default();
    let ids: Vec<String> = Stage::iter().map(|stage| recipe.id(stage).to_string()).collect();
    assert_eq!(ids, vec!["r1-44136fa355b3678a"; 5], "everything is at its default, so nothing is named");
    let hand = Recipe { hand: false, ..recipe };
    assert_eq!(hand.id(Stage::Imprint).to_string(), ids[0]);
    assert_ne!(hand.id(Stage::Mask).to_string(), ids[0]);
}
