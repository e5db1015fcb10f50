//! [`Recipe::words`]: a recipe as options of a command line.

use std::fmt::{self, Display};
use std::str::FromStr;

use strum::IntoEnumIterator as _;

use super::{Recipe, ShiftChoice, Stage};
use crate::infer::engine::EngineChoice;
use crate::steps::mask::{MaskChoice, MaskSource};
use touch2touch_core::postprocess::{CorrectionPart, CorrectionParts, ShiftMode};

/// The words of a command line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Words(Vec<String>);

impl Words {
    /// A further word.
    #[must_use]
    pub fn word(mut self, word: impl Into<String>) -> Self {
        self.0.push(word.into());
        self
    }

    /// A further word, if it is meant.
    #[must_use]
    pub fn word_if(self, given: bool, word: &str) -> Self {
        if given { self.word(word) } else { self }
    }

    /// An option with its value; joined, where the value could be taken for an option.
    #[must_use]
    pub fn option(self, name: &str, value: impl ToString) -> Self {
        let value = value.to_string();
        if value.starts_with('-') { self.word(format!("{name}={value}")) } else { self.word(name).word(value) }
    }

    /// An option with its value, if it has one.
    #[must_use]
    pub fn option_if<T: ToString>(self, name: &str, value: Option<T>) -> Self {
        match value {
            Some(value) => self.option(name, value),
            None => self,
        }
    }

    /// The engine that runs the models, unless it is the automatic choice.
    #[must_use]
    pub fn runtime(self, engine: EngineChoice) -> Self {
        self.option_if("--runtime", (engine != EngineChoice::Auto).then(|| engine.key()))
    }

    /// The words of another after its own.
    #[must_use]
    pub fn then(mut self, mut other: Self) -> Self {
        self.0.append(&mut other.0);
        self
    }

    /// The words themselves.
    pub fn list(self) -> Vec<String> {
        self.0
    }
}

/// A word as a shell takes it for one word.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./:=,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

impl Recipe {
    /// The options of a command that say what decides a stage, apart from `--imprint`, which not every verb has. The verb
    /// makes the same recipe of them; only statistics of a shift it takes from a file, which has to be written first.
    pub fn words(&self, stage: Stage) -> Words {
        let mut words = Words::default();
        if let Some((model, config)) = &self.generator {
            let sampler: &'static str = config.sampler.into();
            let spacing: &'static str = config.spacing.into();
            words = words
                .option("--bundle", model.origin.path().display())
                .option("--steps", config.steps)
                .option("--seed", config.seed)
                .option("--sampler", sampler)
                .option("--spacing", spacing)
                .option("--eta", config.eta);
        }
        if stage >= Stage::Imprint {
            words = words.then(shift_words(self.shift));
        }
        if stage >= Stage::Mask {
            let model = self.mask_model.as_ref().map(|model| model.origin.path().display().to_string());
            words =
                words.option("--mask", self.mask).option_if("--mask-bundle", model).word_if(!self.hand, "--no-hand");
        }
        if stage >= Stage::Pose {
            words = words.option("--engine", self.registration);
        }
        words.runtime(self.engine)
    }
}

/// The options of a way to meters.
pub(crate) fn shift_words(shift: ShiftMode) -> Words {
    let text = match shift {
        ShiftMode::Raw => "raw".to_owned(),
        ShiftMode::PaperShift => "paper".to_owned(),
        ShiftMode::ExactInverse => "exact".to_owned(),
        ShiftMode::Parts(CorrectionParts::NONE) => "exact:none".to_owned(),
        ShiftMode::Parts(parts) => {
            let names: Vec<&str> = Vec::<CorrectionPart>::from(parts).into_iter().map(Into::into).collect();
            format!("exact:{}", names.join(","))
        }
        // `stats --out statistics.json` writes it.
        ShiftMode::Refit(_) => "refit:statistics.json".to_owned(),
    };
    Words::default().option("--shift", text)
}

impl FromStr for ShiftChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text.split_once(':') {
            None if text == "raw" => Self::Raw,
            None if text == "paper" => Self::Paper,
            None if text == "exact" => Self::default(),
            Some(("exact", "none")) => Self::Exact(CorrectionParts::NONE),
            Some(("exact", parts)) => {
                let part = |name: &str| {
                    name.trim().parse::<CorrectionPart>().map_err(|_| {
                        let names: Vec<&str> = CorrectionPart::iter().map(Into::into).collect();
                        format!("unknown part of a fit \"{name}\"; choose from {}", names.join(", "))
                    })
                };
                Self::Exact(parts.split(',').map(part).collect::<Result<Vec<_>, _>>()?.into())
            }
            Some(("refit", file)) => Self::Refit(file.into()),
            _ if text == "refit" => {
                return Err("its statistics are needed: refit:FILE; make the file with `touch2touch stats`".into());
            }
            _ => return Err("it must be exact, exact:none, exact:PART,PART, paper, raw or refit:FILE".into()),
        })
    }
}

/// The source, and those of its numbers that are not as they go without saying, such as `threshold:mm=4`.
impl Display for MaskChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let usual = Self::default();
        let mm = |length_m: f32, usual_m: f32| (length_m != usual_m).then(|| format!("mm={}", millimeters(length_m)));
        let [depth, distance] =
            [mm(self.threshold_m, usual.threshold_m), mm(self.cad_distance_m, usual.cad_distance_m)];
        let percent = (self.top_percent != usual.top_percent).then(|| format!("percent={}", self.top_percent));
        let probability = self.probability.map(|least| format!("probability={least}"));
        let numbers = match self.source {
            // Without a mask model it is the threshold.
            MaskSource::Auto => [depth, probability],
            MaskSource::Unet => [None, probability],
            MaskSource::Threshold => [depth, None],
            MaskSource::TopPercent => [percent, None],
            MaskSource::Cad => [distance, None],
            MaskSource::Truth => [None, None],
        };
        let numbers: Vec<String> = numbers.into_iter().flatten().collect();
        write!(f, "{}{}{}", self.source.key(), if numbers.is_empty() { "" } else { ":" }, numbers.join(","))
    }
}

impl FromStr for MaskChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, numbers) = text.split_once(':').unwrap_or((text, ""));
        let source = key.parse().map_err(|_| {
            let keys: Vec<&str> = MaskSource::iter().map(MaskSource::key).collect();
            format!("unknown mask source {key:?}; choose from {}", keys.join(", "))
        })?;
        let mut choice = Self { source, ..Self::default() };
        for part in numbers.split(',').filter(|part| !part.is_empty()) {
            let (name, value) = part.split_once('=').unwrap_or((part, ""));
            let number: Option<f64> = value.parse().ok().filter(|number: &f64| number.is_finite());
            let number = number.ok_or_else(|| format!("{part:?}: a number is needed, as in threshold:mm=4"))?;
            match (source, name) {
                (MaskSource::Auto | MaskSource::Threshold, "mm") => choice.threshold_m = meters(number),
                (MaskSource::Cad, "mm") => choice.cad_distance_m = meters(number),
                (MaskSource::TopPercent, "percent") => choice.top_percent = number as f32,
                (MaskSource::Auto | MaskSource::Unet, "probability") if (0.0..=1.0).contains(&number) => {
                    choice.probability = Some(number as f32);
                }
                (MaskSource::Auto | MaskSource::Unet, "probability") => {
                    return Err(format!("{part}: a probability of 0 to 1 is needed"));
                }
                _ => return Err(format!("{key} has no number {name:?}")),
            }
        }
        Ok(choice)
    }
}

/// A length in meters as the shortest number of millimeters that [`meters`] reads as the same.
pub fn millimeters(length_m: f32) -> String {
    let short = length_m * 1e3;
    if meters(short.to_string().parse().unwrap_or_default()) == length_m {
        short.to_string()
    } else {
        (f64::from(length_m) * 1e3).to_string()
    }
}

/// A length in meters of one in millimeters.
pub fn meters(length_mm: f64) -> f32 {
    (length_mm / 1e3) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_choice_is_refused_and_says_what_there_is() {
        assert_eq!("threshold".parse(), Ok(MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() }));
        for bad in ["unet:mm=3", "auto:probability=1.5", "threshold:mm=inf", "threshold:4", "dept", ""] {
            assert!(bad.parse::<MaskChoice>().is_err(), "{bad}");
        }
        assert_eq!("exact:none".parse(), Ok(ShiftChoice::Exact(CorrectionParts::NONE)));
        assert_eq!("refit:C:/a,b".parse(), Ok(ShiftChoice::Refit("C:/a,b".into())));
        assert!("refit".parse::<ShiftChoice>().unwrap_err().contains("touch2touch stats"));
        assert!("exact:size".parse::<ShiftChoice>().unwrap_err().contains("offset, field"));
        assert!("doubled".parse::<ShiftChoice>().unwrap_err().contains("exact:none"));
    }
}
