//! The options that say what decides a result, as a [`Recipe`].

mod args;

use std::path::{Path, PathBuf};

use super::contact_mask::MaskArgs;
use crate::app::services::Services;
use touch2touch_core::dataset::Problem;
use touch2touch_core::pose::Registration;
use touch2touch_core::rig::Rig;
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::infer::bundle::Bundle;
use touch2touch_pipeline::infer::engine::{EngineChoice, resolve};
use touch2touch_pipeline::infer::store::{Store, user_folder};
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::learn::tuning::unfinished_folder;
use touch2touch_pipeline::steps::bundles::{self, BundleInfo, FoundBundles};
use touch2touch_pipeline::steps::imprint;
use touch2touch_pipeline::steps::mask::MaskSource;
use touch2touch_pipeline::steps::models::Models;
use touch2touch_pipeline::steps::recipe::{GeneratorChoice, Model, Recipe};

pub(super) use args::{MappingArgs, RecipeArgs};
pub use args::{ModelArgs, RuntimeArg};

impl RecipeArgs {
    /// The recipe of a pose of these imprints, for the sensors of `rig`.
    pub(super) fn of(&self, imprint: ImprintSource, rig: &Rig) -> anyhow::Result<Recipe> {
        self.model.posed(imprint, rig, &self.mask, self.registration.one()?)
    }
}

impl ModelArgs {
    /// The models of one run of the program; none is loaded yet.
    pub fn models(&self) -> Models {
        Models::new(if self.no_cache { None } else { kept() })
    }

    /// The engine that runs the models.
    pub fn engine(&self) -> EngineChoice {
        self.runtime.choice()
    }

    /// The engine's name for people.
    pub(crate) fn engine_label(&self) -> anyhow::Result<&'static str> {
        Ok(resolve(self.engine())?.label())
    }

    /// The folder where a run that is stopped is kept; none with `--no-cache`.
    pub fn unfinished(&self) -> Option<PathBuf> {
        if self.no_cache { None } else { unfinished_folder() }
    }

    fn found(&self) -> &FoundBundles {
        self.found.get_or_init(|| bundles::find(&[]))
    }

    /// The recipe of imprints. A generator is looked for where they are predicted.
    pub fn recipe(&self, imprint: ImprintSource, rig: &Rig) -> anyhow::Result<Recipe> {
        let recipe = Recipe { imprint, engine: self.engine(), ..Recipe::default() };
        if imprint == ImprintSource::Measured {
            // Without a generator nothing is read by it; what was asked for is still said.
            return Ok(Recipe { shift: self.mapping.shift.mode(None).unwrap_or_default(), ..recipe });
        }
        let (generator, shift) = self.generator_choice().of(self.found(), rig)?;
        Ok(Recipe { generator: Some(generator), shift, ..recipe })
    }

    /// The generator as the command line says it.
    fn generator_choice(&self) -> GeneratorChoice {
        GeneratorChoice {
            bundle: self.bundle.clone(),
            steps: self.steps,
            seed: self.seed,
            eta: self.eta,
            sampler: self.sampler,
            spacing: self.spacing,
            shift: self.mapping.shift.clone(),
            ..GeneratorChoice::default()
        }
    }

    /// Recipe with masks and a registration. A mask model is looked for where one is taken.
    pub(super) fn posed(
        &self,
        imprint: ImprintSource,
        rig: &Rig,
        mask: &MaskArgs,
        registration: Registration,
    ) -> anyhow::Result<Recipe> {
        let mask_model = self.mask_model(mask.mask.source, rig)?;
        let recipe = self.recipe(imprint, rig)?;
        Ok(Recipe { mask: mask.mask, mask_model, hand: !mask.no_hand, registration, ..recipe })
    }

    /// The mask model that masks of this source take.
    pub fn mask_model(&self, of: MaskSource, rig: &Rig) -> Result<Option<Model>, TaskError> {
        Model::of_masks(of, self.found(), self.mask_bundle.as_deref(), rig)
    }
}

/// The user's kept predictions with the budget of the studio's preferences; `None` without a folder for them.
pub(super) fn kept() -> Option<Store> {
    let settings = Services::of_user().peek_settings().unwrap_or_default();
    Some(Store::new(user_folder()?, u64::from(settings.cache_mib) << 20))
}

/// The mask model that is named, else the first that was found.
pub(super) fn first_mask_model(named: Option<&Path>, found: &[Bundle]) -> Result<Option<Model>, TaskError> {
    Ok(match named {
        Some(folder) => Some(bundles::open("Open the mask model", folder)?.into()),
        None => found.iter().find(|bundle| bundle.mask_unet().is_some()).map(|bundle| BundleInfo::of(bundle).into()),
    })
}

/// That the generator of a recipe was fitted to other data than this sample.
pub(super) fn misgiving(recipe: &Recipe, sample: &Sample) -> Option<Problem> {
    let (bundle, _) = recipe.generator.as_ref()?;
    Some(Problem {
        what: bundle.misgiving(sample)?,
        file: bundle.origin.path(),
        hint: "name another bundle, or switch the fit off with --shift exact:none".into(),
    })
}

/// Loads the models that a touch needs and runs them once; see [`Models::warm_up`].
pub(super) fn warm_up(recipe: &Recipe, models: &Models) -> Result<(), TaskError> {
    let made = models.warm_up(recipe.generating()?)?;
    if let Some(model) = &recipe.mask_model {
        models.mask(model, recipe.engine, &imprint::imprint(&made, recipe.shift, [0, 0])?)?;
    }
    Ok(())
}
