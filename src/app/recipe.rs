//! The recipe in force: what the settings say, with the models that are there. Keys are made of it.

use super::keys::{ImprintSource, MaskRecipe, PredictionKey, TouchKey};
use super::state::{Absent, State};
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind};
use touch2touch_pipeline::steps::recipe::{Model, Recipe};

/// The recipe of the automatic masks that the settings ask for, of whatever pair.
///
/// # Errors
/// Why the source that the settings ask for cannot give one.
pub(crate) fn automatic_mask(state: &State) -> Result<MaskRecipe, Absent> {
    in_force(state, ImprintSource::Measured).mask_recipe(&state.rig()).map_err(|_| Absent::NoMaskModel)
}

/// The recipe that the settings give a touch; `None` without a generator.
pub fn prediction(state: &State, touch: TouchKey) -> Option<PredictionKey> {
    PredictionKey::of(touch, &in_force(state, ImprintSource::Predicted))
}

/// The recipe that the settings give, of an imprint.
pub fn in_force(state: &State, imprint: ImprintSource) -> Recipe {
    let generator = bundle(state, BundleKind::Generator).ok();
    Recipe {
        imprint,
        generator: generator.map(|bundle| (bundle.clone().into(), state.settings.generate.config(bundle))),
        shift: state.settings.shift,
        mask: state.settings.mask.choice,
        mask_model: bundle(state, BundleKind::Mask).ok().cloned().map(Model::from),
        hand: true,
        registration: state.settings.registration,
        engine: state.settings.runtime,
    }
}

/// The recipe in force of predictions, by a generator of a name where one is named.
///
/// # Errors
/// Why there is no such generator.
pub(crate) fn of_generator(state: &State, named: Option<&str>) -> Result<Recipe, Absent> {
    let recipe = in_force(state, ImprintSource::Predicted);
    let Some(name) = named else {
        bundle(state, BundleKind::Generator)?;
        return Ok(recipe);
    };
    let known = state.library.bundle_named(BundleKind::Generator, Some(name), &state.rig());
    let bundle = known.filter(|bundle| bundle.name == name).ok_or(Absent::NoSuchGenerator)?;
    Ok(Recipe { generator: Some((bundle.clone().into(), state.settings.generate.config(bundle))), ..recipe })
}

/// The bundle that the settings name, or the first of its kind.
///
/// # Errors
/// [`Absent::NoGenerator`], [`Absent::NoMaskModel`].
pub fn bundle(state: &State, kind: BundleKind) -> Result<&BundleInfo, Absent> {
    let (name, absent) = match kind {
        BundleKind::Generator => (state.settings.generate.bundle.as_deref(), Absent::NoGenerator),
        BundleKind::Mask => (state.settings.mask.bundle.as_deref(), Absent::NoMaskModel),
        BundleKind::Classifier => (None, Absent::NoClassifier),
    };
    let rig = state.rig();
    let others = state.library.bundles.iter().any(|bundle| bundle.kind == kind && !bundle.fits(&rig));
    let absent = if others { Absent::OtherSensors } else { absent };
    state.library.bundle_named(kind, name, &rig).ok_or(absent)
}
