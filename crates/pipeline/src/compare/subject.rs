//! [`Subject`]: what can stand on either side of a comparison.

use serde::{Deserialize, Serialize};

use crate::steps::recipe::Recipe;
use touch2touch_core::postprocess::{CorrectionParts, ShiftMode};

/// Subject of a comparison, on either side of it: a rule that each pair resolves for itself.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Subject {
    /// Imprint that was measured.
    Measured,
    /// A prediction.
    Predicted(RecipeChange),
    /// The prediction of another program that lies beside the pair as a picture.
    Stored,
}

/// Changes to a recipe that name a prediction: what is `None` is as the settings say.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(default)]
pub struct RecipeChange {
    /// The generator, by its bundle's name.
    pub bundle: Option<String>,
    /// Denoising steps.
    pub steps: Option<u32>,
    /// Seed of the noise.
    pub seed: Option<u64>,
    /// Mapping to meters.
    pub shift: Option<Mapping>,
}

impl RecipeChange {
    /// Recipe that it makes of the one that the settings give; `given` gives that, with the generator that is named.
    ///
    /// # Errors
    /// The errors of `given`, such as that there is no such generator.
    pub fn of<E>(&self, given: impl FnOnce(Option<&str>) -> Result<Recipe, E>) -> Result<Recipe, E> {
        let mut recipe = given(self.bundle.as_deref())?;
        if let Some((_, config)) = &mut recipe.generator {
            config.steps = self.steps.unwrap_or(config.steps);
            config.seed = self.seed.unwrap_or(config.seed);
        }
        recipe.shift = self.shift.map_or(recipe.shift, Mapping::mode);
        Ok(recipe)
    }
}

/// A way to meters that needs no statistics of a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mapping {
    /// The exact inverse, with the fit of a fitted bundle.
    Exact,
    /// The exact inverse without the fit.
    Unfitted,
    /// The paper's shift.
    Paper,
    /// As the released script saves it.
    Raw,
}

impl Mapping {
    /// The mode it stands for.
    pub fn mode(self) -> ShiftMode {
        match self {
            Self::Exact => ShiftMode::ExactInverse,
            Self::Unfitted => ShiftMode::Parts(CorrectionParts::NONE),
            Self::Paper => ShiftMode::PaperShift,
            Self::Raw => ShiftMode::Raw,
        }
    }
}

impl Subject {
    /// The prediction that the settings make.
    pub fn shown() -> Self {
        Self::Predicted(RecipeChange::default())
    }

    /// Changes to the recipe, where something is predicted for it.
    pub fn change(&self) -> Option<&RecipeChange> {
        match self {
            Self::Predicted(change) => Some(change),
            Self::Measured | Self::Stored => None,
        }
    }

    /// Name for people.
    pub fn label(&self) -> String {
        let change = match self {
            Self::Measured => return "Measured".into(),
            Self::Stored => return "Stored picture".into(),
            Self::Predicted(change) => change.clone(),
        };
        let parts = [
            Some("Prediction".to_owned()),
            change.bundle,
            change.seed.map(|seed| format!("seed {seed}")),
            change.steps.map(|steps| format!("{steps} steps")),
            change.shift.map(|shift| shift.mode().label().to_lowercase()),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(" · ")
    }
}
