//! [`Recipe`]: everything that decides the result of a touch, as one value.

mod choices;
mod words;

use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;

use serde::Serialize;

use crate::error::TaskError;
use crate::infer::engine::EngineChoice;
use crate::infer::recipe_id::Named;
use crate::labels::{ImprintOf, ImprintSource};
use crate::steps::bundles::{BundleInfo, BundleKind, FoundBundles};
use crate::steps::mask::{MaskChoice, MaskRecipe, MaskSource, no_mask_model};
use crate::steps::predict::Generating;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::pose::Registration;
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::Rig;

pub use crate::infer::recipe_id::RecipeId;
pub use choices::{GeneratorChoice, ShiftChoice};
pub use words::{Words, meters, millimeters, quoted};

/// The steps from a touch to a pose, in order; the result of each is made from the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Stage {
    /// Prediction of the generator.
    Prediction,
    /// The imprint in meters, measured or predicted.
    Imprint,
    /// The contact masks.
    Mask,
    /// The contact points.
    Cloud,
    /// The tool's pose in the hand.
    Pose,
}

/// Everything that decides the result of a touch.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Recipe {
    /// The imprint that mask, cloud and pose are made from.
    #[serde(skip_serializing_if = "is_measured")]
    pub imprint: ImprintSource,
    /// The generator with the choices of a generation; `None` where nothing is predicted.
    pub generator: Option<(Model, GenerateConfig)>,
    /// The mapping of predictions to meters.
    pub shift: ShiftMode,
    /// The source of the masks that nobody drew.
    pub mask: MaskChoice,
    /// The mask model, where there is one.
    pub mask_model: Option<Model>,
    /// A mask drawn by hand wins where there is one.
    #[serde(skip_serializing_if = "is_yes")]
    pub hand: bool,
    /// The registration; files have called it the engine from the beginning.
    #[serde(rename = "engine")]
    pub registration: Registration,
    /// The engine that runs the models.
    #[serde(rename = "runtime")]
    pub engine: EngineChoice,
}

fn is_measured(source: &ImprintSource) -> bool {
    *source == ImprintSource::Measured
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_yes(value: &bool) -> bool {
    *value
}

/// A model bundle, as files name it.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub struct ModelName {
    /// Name for people.
    pub name: String,
    /// Identity of the bundle.
    pub id: String,
}

/// A model bundle that can be opened; the same as another one of its identity, wherever that lies.
#[derive(Clone, Debug)]
pub struct Model(Arc<BundleInfo>);

impl Deref for Model {
    type Target = BundleInfo;

    fn deref(&self) -> &BundleInfo {
        &self.0
    }
}

impl Model {
    /// The model that masks of this source take, the named one or the first found; `None` where they take none. The automatic
    /// source does without one where none is named and none was found.
    ///
    /// # Errors
    /// Errors of [`FoundBundles::take`].
    pub fn of_masks(
        of: MaskSource,
        found: &FoundBundles,
        named: Option<&Path>,
        rig: &Rig,
    ) -> Result<Option<Self>, TaskError> {
        if !matches!(of, MaskSource::Auto | MaskSource::Unet) {
            return Ok(None);
        }
        match found.take(BundleKind::Mask, named, rig) {
            Err(_) if of == MaskSource::Auto && named.is_none() => Ok(None),
            model => Ok(Some(model?.into())),
        }
    }
}

impl PartialEq for Model {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

impl From<BundleInfo> for Model {
    fn from(bundle: BundleInfo) -> Self {
        Self(Arc::new(bundle))
    }
}

impl From<&Model> for ModelName {
    fn from(model: &Model) -> Self {
        Self { name: model.name.clone(), id: model.id.to_string() }
    }
}

impl Serialize for Model {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        ModelName::from(self).serialize(serializer)
    }
}

impl Default for Recipe {
    fn default() -> Self {
        Self {
            imprint: ImprintSource::Measured,
            generator: None,
            shift: ShiftMode::default(),
            mask: MaskChoice::default(),
            mask_model: None,
            hand: true,
            registration: Registration::default(),
            engine: EngineChoice::default(),
        }
    }
}

impl Recipe {
    /// The choices that an identity does not name. Part of the format: they stay when defaults change.
    fn unnamed() -> Self {
        Self {
            imprint: ImprintSource::Measured,
            generator: None,
            shift: ShiftMode::ExactInverse,
            mask: MaskChoice::UNNAMED,
            mask_model: None,
            hand: true,
            registration: Registration::DistanceField(None),
            engine: EngineChoice::Auto,
        }
    }

    /// Recipe from another imprint.
    #[must_use]
    pub fn of(&self, imprint: ImprintSource) -> Self {
        Self { imprint, ..self.clone() }
    }

    /// So many recipes that differ from it in their seeds alone, from its own on; none where nothing is predicted.
    pub(crate) fn with_seeds(&self, count: usize) -> Vec<Self> {
        let Some((_, own)) = &self.generator else { return Vec::new() };
        let with = |later: u64| {
            let mut with = self.clone();
            with.generator.iter_mut().for_each(|(_, config)| config.seed = own.seed.wrapping_add(later));
            with
        };
        (0..count as u64).map(with).collect()
    }

    /// Only what decides the result of a stage: what comes later, and what is not used, is as it goes without saying.
    #[must_use]
    pub fn until(&self, stage: Stage) -> Self {
        let predicted = self.imprint == ImprintSource::Predicted;
        let masked = stage >= Stage::Mask;
        let takes_model = matches!(self.mask.source, MaskSource::Auto | MaskSource::Unet);
        let unet = masked && takes_model && self.mask_model.is_some();
        let from = Self::unnamed();
        Self {
            imprint: self.imprint,
            generator: self.generator.clone().filter(|_| predicted),
            shift: if predicted && stage >= Stage::Imprint { self.shift } else { from.shift },
            mask: if masked { self.mask.of_its_source() } else { from.mask },
            mask_model: self.mask_model.clone().filter(|_| unet),
            hand: self.hand || !masked,
            registration: if stage >= Stage::Pose { self.registration } else { from.registration },
            engine: if predicted || unet { self.engine } else { from.engine },
        }
    }

    /// The identity of the result of a stage, of any touch.
    pub fn id(&self, stage: Stage) -> RecipeId {
        let of = self.until(stage);
        let from = Self::unnamed();
        let mut named = match &of.generator {
            Some((model, config)) => Named::prediction(&model.id, config, of.engine),
            None => Named::default(),
        };
        named.add("imprint", &of.imprint, &from.imprint);
        named.add("shift", &of.shift, &from.shift);
        named.add("mask", &of.mask, &from.mask);
        named.add("mask_model", &of.mask_model.as_ref().map(|model| &model.id), &None::<&str>);
        named.add("hand", &of.hand, &from.hand);
        named.add("registration", &of.registration.to_string(), &from.registration.to_string());
        named.add("engine", &of.engine, &from.engine);
        named.id()
    }

    /// The imprint that it is about, for masks and poses that people filed under it.
    pub fn imprint_of(&self) -> ImprintOf {
        match (self.imprint, &self.generator) {
            (ImprintSource::Predicted, Some((model, config))) => ImprintOf::predicted(&model.id, config, self.shift),
            (ImprintSource::Predicted, None) => ImprintOf::unknown(),
            (ImprintSource::Measured, _) => ImprintOf::Measured,
        }
    }

    /// The generator with its choices and the engine.
    ///
    /// # Errors
    /// If there is none.
    pub fn generating(&self) -> Result<Generating<'_>, TaskError> {
        let generator = self.generator.as_ref();
        let (model, config) = generator.ok_or_else(|| TaskError::new("Predict", "there is no generator"))?;
        Ok(Generating { bundle: model, engine: self.engine, config })
    }

    /// The making of the masks that nobody drew, on touches of this rig.
    ///
    /// # Errors
    /// If it takes a mask model and there is none.
    pub fn mask_recipe(&self, rig: &Rig) -> Result<MaskRecipe, TaskError> {
        let auto_on_gel = rig.is_gel() && self.mask.source == MaskSource::Auto;
        let model = self.mask_model.as_ref().filter(|_| !auto_on_gel).map(|model| &model.id);
        let recipe = self.mask.recipe(model).ok_or_else(no_mask_model)?;
        Ok(recipe.on(rig))
    }
}
