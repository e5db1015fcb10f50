//! [`Subject`]: what can stand on either side of a comparison.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::steps::recipe::Recipe;
use touch2touch_core::postprocess::{CorrectionParts, ShiftMode};

/// Fewest and most seeds of a mean.
pub const SEEDS: std::ops::RangeInclusive<usize> = 2..=16;

/// Subject of a comparison, on either side of it: a rule that each pair resolves for itself.
///
/// As text: `measured`, `prediction`, `mean`, `stored`; a prediction and a mean are followed by what differs from the
/// settings, as in `prediction:bundle=fitted,seed=7,steps=50,shift=raw` or `mean:seeds=4`. A name with a comma stands in
/// quotes: `prediction:bundle="trained at home, twice"`.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Subject {
    /// Imprint that was measured.
    Measured,
    /// A prediction.
    Predicted(RecipeChange),
    /// The mean of predictions with so many seeds.
    Mean(RecipeChange, usize),
    /// The prediction of another program that lies beside the pair as a picture.
    Stored,
}

/// Changes to a recipe that name a prediction: what is `None` is as the settings (of the studio) or the options (of a
/// verb) say.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RecipeChange {
    /// The generator, by its bundle's name.
    pub bundle: Option<String>,
    /// Denoising steps.
    pub steps: Option<u32>,
    /// Seed of the noise.
    pub seed: Option<u64>,
    /// Mapping to meters.
    pub shift: Option<ShiftMode>,
}

/// Origin of a subject's imprint.
#[derive(Clone, Debug, PartialEq)]
pub enum MadeFrom {
    /// The measurement.
    Measurement,
    /// The picture of another program's prediction.
    Picture,
    /// A prediction by this recipe.
    Prediction(Recipe),
    /// The mean of the predictions by these recipes, which differ in their seeds alone.
    Mean(Vec<Recipe>),
}

impl RecipeChange {
    /// Recipe that it makes of the one that settings or options give; `given` gives that, with the generator that is
    /// named.
    ///
    /// # Errors
    /// The errors of `given`, such as that there is no such generator.
    fn of<E>(&self, given: impl FnOnce(Option<&str>) -> Result<Recipe, E>) -> Result<Recipe, E> {
        let mut recipe = given(self.bundle.as_deref())?;
        if let Some((_, config)) = &mut recipe.generator {
            config.steps = self.steps.unwrap_or(config.steps);
            config.seed = self.seed.unwrap_or(config.seed);
        }
        recipe.shift = self.shift.unwrap_or(recipe.shift);
        Ok(recipe)
    }
}

/// The ways to meters that need no statistics of a data set, by their names: the exact inverse with and without the fit of a
/// fitted bundle, the paper's shift, and as the released script saves it.
pub const SHIFTS: [(&str, ShiftMode); 4] = [
    ("exact", ShiftMode::ExactInverse),
    ("unfitted", ShiftMode::Parts(CorrectionParts::NONE)),
    ("paper", ShiftMode::PaperShift),
    ("raw", ShiftMode::Raw),
];

impl Subject {
    /// The prediction that the settings make.
    pub fn shown() -> Self {
        Self::Predicted(RecipeChange::default())
    }

    /// Changes to the recipe, where something is predicted for it.
    pub fn change(&self) -> Option<&RecipeChange> {
        match self {
            Self::Predicted(change) | Self::Mean(change, _) => Some(change),
            Self::Measured | Self::Stored => None,
        }
    }

    /// Origin of the subject's imprint; `given` gives the recipe of predictions by the settings or options, with the
    /// generator that is named, else theirs.
    ///
    /// # Errors
    /// The errors of `given`, such as that there is no such generator.
    pub fn made_from<E>(&self, given: impl FnOnce(Option<&str>) -> Result<Recipe, E>) -> Result<MadeFrom, E> {
        Ok(match self {
            Self::Measured => MadeFrom::Measurement,
            Self::Stored => MadeFrom::Picture,
            Self::Predicted(change) => MadeFrom::Prediction(change.of(given)?),
            Self::Mean(change, count) => MadeFrom::Mean(change.of(given)?.with_seeds(*count)),
        })
    }

    /// Name for people.
    pub fn label(&self) -> String {
        let base = match self {
            Self::Measured => return "Measured".into(),
            Self::Stored => return "Stored picture".into(),
            Self::Predicted(_) => "Prediction".to_owned(),
            Self::Mean(_, seeds) => format!("Mean of {seeds} seeds"),
        };
        let change = self.change().cloned().unwrap_or_default();
        let parts = [
            Some(base),
            change.bundle,
            change.seed.map(|seed| format!("seed {seed}")),
            change.steps.map(|steps| format!("{steps} steps")),
            change.shift.map(|shift| shift.label().to_lowercase()),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(" · ")
    }
}

impl std::fmt::Display for Subject {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (name, seeds) = match self {
            Self::Measured => return f.write_str("measured"),
            Self::Stored => return f.write_str("stored"),
            Self::Predicted(_) => ("prediction", None),
            Self::Mean(_, seeds) => ("mean", Some(format!("seeds={seeds}"))),
        };
        let change = self.change().cloned().unwrap_or_default();
        let shift = SHIFTS.iter().find(|(_, mode)| change.shift == Some(*mode));
        let parts = [
            seeds,
            change.bundle.map(|bundle| format!("bundle={}", quoted(bundle))),
            change.seed.map(|seed| format!("seed={seed}")),
            change.steps.map(|steps| format!("steps={steps}")),
            shift.map(|(name, _)| format!("shift={name}")),
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        let colon = if parts.is_empty() { "" } else { ":" };
        write!(f, "{name}{colon}{}", parts.join(","))
    }
}

impl FromStr for Subject {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, rest) = text.split_once(':').unwrap_or((text, ""));
        let (mut change, mut seeds) = (RecipeChange::default(), None);
        for part in parts(rest).map(str::trim).filter(|part| !part.is_empty()) {
            let (key, value) = part.split_once('=').ok_or_else(|| format!("\"{part}\" is not KEY=VALUE"))?;
            let wrong = || format!("{key} cannot be \"{value}\"");
            match key.trim() {
                "bundle" if value.starts_with('"') => {
                    change.bundle = Some(serde_json::from_str(value).map_err(|_| wrong())?);
                }
                "bundle" => change.bundle = Some(value.to_owned()),
                "seed" => change.seed = Some(value.parse().map_err(|_| wrong())?),
                "steps" => {
                    change.steps = Some(value.parse().ok().filter(|n| (1..=1000).contains(n)).ok_or_else(wrong)?)
                }
                "shift" => change.shift = Some(SHIFTS.iter().find(|(name, _)| *name == value).ok_or_else(wrong)?.1),
                "seeds" => seeds = Some(value.parse().ok().filter(|n| SEEDS.contains(n)).ok_or_else(wrong)?),
                _ => return Err(format!("unknown {key}; choose from bundle, seed, steps, shift, seeds")),
            }
        }
        let nothing_else = change == RecipeChange::default() && seeds.is_none();
        match name.trim() {
            "measured" if nothing_else => Ok(Self::Measured),
            "stored" if nothing_else => Ok(Self::Stored),
            "prediction" if seeds.is_none() => Ok(Self::Predicted(change)),
            "mean" => Ok(Self::Mean(change, seeds.unwrap_or(8))),
            "measured" | "stored" | "prediction" => Err(format!("{name} has no such choice: {rest}")),
            _ => Err(format!("unknown side \"{name}\"; choose from measured, prediction, mean, stored")),
        }
    }
}

/// The name as it is written: in quotes where it would not be read back without.
fn quoted(name: String) -> String {
    let plain = !name.is_empty() && name.trim() == name && !name.contains([',', '"']);
    if plain { name } else { serde_json::Value::String(name).to_string() }
}

/// The parts of a text between commas; a comma in quotes belongs to its part.
fn parts(text: &str) -> impl Iterator<Item = &str> {
    let (mut in_quotes, mut escaped) = (false, false);
    text.split(move |c| {
        let comma = c == ',' && !in_quotes;
        in_quotes ^= c == '"' && !escaped;
        escaped = c == '\\' && in_quotes && !escaped;
        comma
    })
}

impl TryFrom<String> for Subject {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Subject> for String {
    fn from(subject: Subject) -> Self {
        subject.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subject_is_made_from_what_is_given_with_its_changes() {
        let given = |named: Option<&str>| match named {
            Some(_) => Err("there is no such generator"),
            None => Ok(Recipe { shift: ShiftMode::PaperShift, ..Recipe::default() }),
        };
        let of = |text: &str| text.parse::<Subject>().unwrap().made_from(given);
        assert_eq!((of("measured"), of("stored")), (Ok(MadeFrom::Measurement), Ok(MadeFrom::Picture)));
        let Ok(MadeFrom::Prediction(shown)) = of("prediction") else { panic!("{:?}", of("prediction")) };
        assert_eq!(shown.shift, ShiftMode::PaperShift);
        let Ok(MadeFrom::Prediction(raw)) = of("prediction:shift=raw") else { panic!("a prediction") };
        assert_eq!(raw, Recipe { shift: ShiftMode::Raw, ..shown });
        assert_eq!(of("mean:bundle=other"), Err("there is no such generator"));
    }

    #[test]
    fn what_makes_no_sense_is_refused_in_words() {
        for (text, word) in [
            ("", "unknown side"),
            ("measured:seed=3", "no such choice"),
            ("prediction:seeds=3", "no such choice"),
            ("prediction:seed=-1", "cannot be"),
            ("prediction:steps=0", "cannot be"),
            ("prediction:shift=other", "cannot be"),
            ("prediction:seed", "KEY=VALUE"),
            ("prediction:colour=red", "choose from bundle"),
            ("mean:seeds=99", "cannot be"),
            ("prediction:bundle=\"a, b", "cannot be"),
        ] {
            let why = text.parse::<Subject>().unwrap_err();
            assert!(why.contains(word), "{text}: {why}");
        }
    }
}
