//! The recipe in force: what the settings say, with the models that are there. Keys are made of it.

use super::keys::{ImprintSource, MaskRecipe, PredictionKey, TouchKey};
use super::state::{Absent, State};
use touch2touch_work::bundles::{BundleInfo, BundleKind};
use touch2touch_work::recipe::{Model, Recipe};
use touch2touch_work::subject::RecipeChange;

/// The recipe of the automatic masks that the settings ask for, of whatever pair.
///
/// # Errors
/// Why the source that the settings ask for cannot give one.
pub(crate) fn automatic_mask(state: &State) -> Result<MaskRecipe, Absent> {
    in_force(state, ImprintSource::Measured).mask_recipe().map_err(|_| Absent::NoMaskModel)
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

/// The recipe in force of predictions, changed as a subject of a comparison wishes.
///
/// # Errors
/// Why there is no such generator.
pub(crate) fn changed(state: &State, wish: &RecipeChange) -> Result<Recipe, Absent> {
    let generator = match &wish.bundle {
        None => bundle(state, BundleKind::Generator)?,
        Some(name) => {
            let found = state.library.bundle_named(BundleKind::Generator, Some(name), &state.rig());
            found.filter(|bundle| bundle.name == *name).ok_or(Absent::NoSuchGenerator)?
        }
    };
    let mut config = state.settings.generate.config(generator);
    config.steps = wish.steps.unwrap_or(config.steps);
    config.seed = wish.seed.unwrap_or(config.seed);
    let recipe = in_force(state, ImprintSource::Predicted);
    let shift = wish.shift.map_or(recipe.shift, |mapping| mapping.mode());
    Ok(Recipe { generator: Some((generator.clone().into(), config)), shift, ..recipe })
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
    let lacking = state.library.lacking.as_ref().is_some_and(|(_, lacking)| Some(&**lacking) == name);
    let absent = if lacking && kind == BundleKind::Generator { Absent::NoSuchGenerator } else { absent };
    let others = state.library.bundles.iter().any(|bundle| bundle.kind == kind && !bundle.fits(&rig));
    let absent = if others && !lacking { Absent::OtherSensors } else { absent };
    state.library.bundle_named(kind, name, &rig).ok_or(absent)
}
