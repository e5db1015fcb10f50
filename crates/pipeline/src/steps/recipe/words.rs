//! [`Recipe::words`]: a recipe as options of a command line.

use touch2touch_core::diffusion::Spacing;
use touch2touch_core::postprocess::{CorrectionPart, CorrectionParts, ShiftMode};

use super::{Recipe, Stage};
use crate::infer::engine::EngineChoice;
use crate::steps::mask::MaskSource;

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
            let spacing = match config.spacing {
                Spacing::Trailing => "trailing",
                Spacing::Lab => "lab",
            };
            words = words
                .option("--bundle", model.origin.path().display())
                .option("--steps", config.steps)
                .option("--seed", config.seed)
                .option("--sampler", sampler)
                .option("--spacing", spacing)
                .option("--eta", config.eta)
                .option_if("--guidance", Some(config.guidance).filter(|scale| *scale != 1.0));
        }
        if stage >= Stage::Imprint {
            words = words.then(shift_words(self.shift));
        }
        if stage >= Stage::Mask {
            words = words.then(self.mask_words());
        }
        if stage >= Stage::Pose {
            words = words.option("--engine", self.registration);
        }
        words.runtime(self.engine)
    }

    fn mask_words(&self) -> Words {
        let choice = self.mask;
        let words = Words::default().option("--mask", choice.source.key());
        let threshold = |words: Words| words.option("--threshold-mm", millimeters(choice.threshold_m));
        let words = match choice.source {
            MaskSource::Threshold => threshold(words),
            MaskSource::TopPercent => words.option("--top-percent", choice.top_percent),
            MaskSource::Cad => words.option("--cad-mm", millimeters(choice.cad_distance_m)),
            MaskSource::Unet => words.option_if("--probability", choice.probability),
            // Without a mask model it is the threshold.
            MaskSource::Auto => threshold(words).option_if("--probability", choice.probability),
            MaskSource::Truth => words,
        };
        let model = self.mask_model.as_ref().map(|model| model.origin.path().display().to_string());
        words.option_if("--mask-bundle", model).word_if(!self.hand, "--no-hand")
    }
}

/// The options of a way to meters.
pub(crate) fn shift_words(shift: ShiftMode) -> Words {
    let words = Words::default();
    match shift {
        ShiftMode::Raw => words.option("--shift", "raw"),
        ShiftMode::PaperShift => words.option("--shift", "paper"),
        ShiftMode::ExactInverse => words.option("--shift", "exact"),
        ShiftMode::Parts(parts) => words.option("--shift", "exact").option("--fit-parts", parts_text(parts)),
        // `stats --out statistics.json` writes it.
        ShiftMode::Refit(_) => words.option("--shift", "refit").option("--stats", "statistics.json"),
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

fn parts_text(parts: CorrectionParts) -> String {
    let names: Vec<&'static str> = Vec::<CorrectionPart>::from(parts).into_iter().map(Into::into).collect();
    match parts {
        CorrectionParts::ALL => "all".into(),
        CorrectionParts::NONE => "none".into(),
        _ => names.join(","),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stay_words() {
        assert_eq!(quoted("test_only/a-1"), "test_only/a-1");
        for (word, shell) in [("a b", "'a b'"), ("", "''"), ("it's", "'it'\\''s'"), ("$(x)", "'$(x)'"), ("ä", "'ä'")]
        {
            assert_eq!(quoted(word), shell);
        }
        let words = Words::default().word("v").option("--a", -3).option("--b", 2).option_if("--c", None::<u8>);
        assert_eq!(words.list(), ["v", "--a=-3", "--b", "2"]);
        assert_eq!(parts_text(vec![CorrectionPart::Offset, CorrectionPart::Gain].into()), "offset,gain");
        assert_eq!(millimeters(0.005), "5");
    }
}
