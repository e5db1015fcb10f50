//! The command that does in a shell what a pane shows: [`State::equivalent`].

use super::super::adapt::state::AdaptPairs;
use super::super::dial::DialPairs;
use super::super::keys::{ImprintSource, ShiftMode, Spacing};
use super::super::library::state::Place;
use super::super::pane::{Kind, Pane};
use super::super::settings::state::ColorMap;
use super::super::state::State;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::postprocess::{CorrectionPart, CorrectionParts};
use touch2touch_work::bundles::{BundleInfo, BundleKind};
use touch2touch_work::infer::engine::EngineChoice;
use touch2touch_work::mask::MaskSource;
use touch2touch_work::subject::{Subject, Wish};
use touch2touch_work::sweep::Setting;

/// The words of a command line.
struct Words(Vec<String>);

impl Words {
    fn new(verb: &str) -> Self {
        Self(vec!["touch2touch".into(), verb.into()])
    }

    fn word(mut self, word: impl Into<String>) -> Self {
        self.0.push(word.into());
        self
    }

    /// An option with its value; joined, where the value could be taken for an option.
    fn option(self, name: &str, value: impl ToString) -> Self {
        let value = value.to_string();
        if value.starts_with('-') { self.word(format!("{name}={value}")) } else { self.word(name).word(value) }
    }

    fn option_if(self, given: bool, name: &str, value: impl ToString) -> Self {
        if given { self.option(name, value) } else { self }
    }
}

/// A word as a shell takes it for one word.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./:=,@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

impl State {
    /// The words of the command that does what a pane shows, with the settings in force; `None` for panes that only choose.
    /// `error_m` is half the range of the colors of errors, meters.
    pub fn equivalent_words(&self, pane: Pane, error_m: f32) -> Option<Vec<String>> {
        let open = self.library.open.as_ref()?;
        let path = match &open.place {
            Place::Demo => "demo".to_owned(),
            // Never taken for an option.
            Place::Path(path) if path.to_string_lossy().starts_with('-') => format!("./{}", path.display()),
            Place::Path(path) => path.display().to_string(),
        };
        let verb = |verb: &str| Words::new(verb).word(&path);
        let of_pair = |name: &str| Some(verb(name).option("--pair", self.entry()?.name.clone()));
        let finger = self.finger_name(self.selection.finger).into_owned();
        let side = pane.side().unwrap_or(self.inspect.source);
        let engine = &self.settings.pose_engine;
        let posed = |words: Words, side: ImprintSource| {
            let words = self.mask_words(words.option("--imprint", side.key()).option("--engine", engine));
            if side == ImprintSource::Predicted { self.model_words(words) } else { words }
        };
        let words = match (pane, pane.kind()) {
            (Pane::Browser | Pane::Log, _) => verb("doctor"),
            (_, Kind::Color | Kind::Imprint(_) | Kind::Error) => {
                let shown = pane.in_figure()?;
                let both = self.selection.both_fingers;
                let range = self.settings.range;
                let words = verb("figure")
                    .option("--pairs", self.entry()?.name.clone())
                    .option("--panes", shown.key())
                    .option("--finger", if both { "both" } else { &finger })
                    .option("--out", pane.picture_name(true))
                    .option("--range", format!("{}..{}", range.min_m * 1e3, range.max_m * 1e3))
                    .option_if(pane == Pane::Error, "--error-range-mm", error_m * 1e3);
                let words = if self.settings.color_map == ColorMap::Gray { words.word("--gray") } else { words };
                let words = if self.settings.footprint_visible { words } else { words.word("--no-window") };
                if shown.is_predicted() { self.model_words(words) } else { words }
            }
            (_, Kind::Scene(side)) => posed(of_pair("export")?.option("--out", "exported"), side),
            (Pane::TimeMachine | Pane::Layers, _) => posed(of_pair("pose")?, side).word("--trace").word("--json"),
            (Pane::BasinMap, _) => posed(of_pair("basin")?, side),
            (Pane::Metrics | Pane::Poses, _) => {
                let words = of_pair("pose")?.option("--imprint", "both").option("--engine", engine);
                self.model_words(self.mask_words(words))
            }
            (Pane::Generate, _) => {
                self.model_words(of_pair("generate")?.option("--finger", "both").option("--out", "predictions"))
            }
            (Pane::Seeds, _) => {
                let words = of_pair("generate")?.option("--finger", &finger).option("--out", "predictions");
                self.model_words(words.option("--seeds", self.seeds.count))
            }
            (Pane::Compare, _) => {
                let versus = self.versus();
                let words = of_pair("compare")?
                    .option("--a", self.placed(&versus.a))
                    .option("--b", self.placed(&versus.b))
                    .option("--engine", engine);
                self.model_words(self.mask_words(words))
            }
            (Pane::Ledger, _) => self.model_words(of_pair("ledger")?.option("--finger", &finger)),
            (Pane::Masks, _) => of_pair("label")?,
            (Pane::Results | Pane::Table | Pane::Scatter, _) => {
                let mut words = verb("evaluate");
                for (bundle, _) in self.evaluated().filter(|(_, chosen)| *chosen) {
                    words = words.option("--bundle", bundle.origin.path().display());
                }
                let grasps = self.table.grasps_per_tool;
                words = words.option_if(grasps.is_some(), "--grasps", grasps.unwrap_or(1));
                let words = if self.table.published { words.word("--paper") } else { words };
                let words = self.mask_words(words.option("--engine", engine));
                runtime_words(self.shift_words(words), self.settings.runtime)
            }
            (Pane::Dial, _) => {
                let dial = &self.dial;
                let values = dial.dial.spread(dial.range[0], dial.range[1], dial.count).ok()?;
                let values: Vec<String> = values.into_iter().map(Setting::key).collect();
                let words = verb("sweep").option("--dial", dial.dial.key()).option("--values", values.join(","));
                let words = match dial.pairs {
                    DialPairs::All => words,
                    DialPairs::Spread(count) => words.option("--pairs", count),
                    DialPairs::Listed => words.option("--only", self.names(self.dial_pairs())?),
                };
                let words = if dial.predictions { words } else { words.word("--measured-only") };
                let words = self.mask_words(words.option("--engine", engine));
                let words = match self.bundle(BundleKind::Generator) {
                    Ok(bundle) => generator_words(words, bundle, &self.settings.generate.config(bundle)),
                    Err(_) => words,
                };
                runtime_words(self.shift_words(words), self.settings.runtime)
            }
            (Pane::Adapt, _) => {
                let setup = self.adapt_setup()?;
                let words = verb("adapt").option("--out", "fitted");
                let words = words.option_if(self.adapt.tune, "--tune", self.adapt.steps);
                let words = match self.adapt.pairs {
                    AdaptPairs::All => words,
                    AdaptPairs::Done | AdaptPairs::Listed => words.option("--pairs", self.names(setup.pairs)?),
                };
                let words = self.mask_words(words.option("--engine", engine));
                let words = generator_words(words, &setup.bundle, &setup.config);
                runtime_words(words, setup.engine)
            }
            (Pane::Train, _) => {
                let form = self.train.form;
                let words = Words::new("masks").word("train").word(&path);
                let words = words.option_if(form.by_steps, "--steps", form.steps);
                let words = words.option_if(!form.by_steps, "--minutes", form.minutes);
                let words = words.option("--held-out", form.choice.held_out_percent);
                let words = words.option("--seed", form.choice.seed);
                let words = if form.choice.test_in_train { words.word("--test-in-train") } else { words };
                match (&self.settings.mask.bundle, self.bundle(BundleKind::Mask)) {
                    (Some(_), Ok(bundle)) => words.option("--start", bundle.origin.path().display()),
                    _ => words,
                }
            }
            _ => return None,
        };
        Some(words.0)
    }

    /// [`Self::equivalent_words`] as one line for a shell.
    pub fn equivalent(&self, pane: Pane, error_m: f32) -> Option<String> {
        let words: Vec<String> = self.equivalent_words(pane, error_m)?.iter().map(|word| quoted(word)).collect();
        Some(words.join(" "))
    }

    /// A subject with the folder of its bundle in place of the bundle's name.
    fn placed(&self, subject: &Subject) -> Subject {
        let placed = |wish: &Wish| {
            let bundle = wish.bundle.as_ref().map(|name| {
                let found = self.library.bundles.iter().find(|bundle| bundle.name == *name);
                found.map_or_else(|| name.clone(), |bundle| bundle.origin.path().display().to_string())
            });
            Wish { bundle, ..wish.clone() }
        };
        match subject {
            Subject::Predicted(wish) => Subject::Predicted(placed(wish)),
            Subject::Mean(wish, seeds) => Subject::Mean(placed(wish), *seeds),
            other => other.clone(),
        }
    }

    /// Where masks come from.
    fn mask_words(&self, words: Words) -> Words {
        let choice = self.settings.mask.choice;
        let words = words.option("--mask", choice.source.key());
        let words = match choice.source {
            MaskSource::Threshold => words.option("--threshold-mm", choice.threshold_m * 1e3),
            MaskSource::TopPercent => words.option("--top-percent", choice.top_percent),
            MaskSource::Cad => words.option("--cad-mm", choice.cad_distance_m * 1e3),
            MaskSource::Auto | MaskSource::Unet => {
                words.option_if(choice.probability.is_some(), "--probability", choice.probability.unwrap_or_default())
            }
            MaskSource::Truth => words,
        };
        match (&self.settings.mask.bundle, self.bundle(BundleKind::Mask)) {
            (Some(_), Ok(bundle)) => words.option("--mask-bundle", bundle.origin.path().display()),
            _ => words,
        }
    }

    /// How the prediction shown was made, or would be.
    fn model_words(&self, words: Words) -> Words {
        let finger = self.selection.finger;
        let recipe = self.chosen(finger).cloned().or_else(|| self.recipe(self.touch_key(finger)?));
        let Some((recipe, bundle)) = recipe.and_then(|r| Some((r.clone(), self.library.bundle(&r.bundle)?))) else {
            return words;
        };
        runtime_words(self.shift_words(generator_words(words, bundle, &recipe.config())), recipe.runtime)
    }

    /// The names of these pairs, as one word; `None` where there are none.
    fn names(&self, pairs: impl IntoIterator<Item = PairId>) -> Option<String> {
        let all = &self.library.open.as_ref()?.source.index().pairs;
        let names: Vec<&str> = pairs.into_iter().filter_map(|id| Some(all.get(id.0 as usize)?.name.as_str())).collect();
        (!names.is_empty()).then(|| names.join(","))
    }

    /// How a decoder's output becomes meters.
    fn shift_words(&self, words: Words) -> Words {
        match self.settings.shift {
            ShiftMode::Raw => words.option("--shift", "raw"),
            ShiftMode::PaperShift => words.option("--shift", "paper"),
            ShiftMode::ExactInverse => words.option("--shift", "exact"),
            ShiftMode::Parts(parts) => words.option("--shift", "exact").option("--fit-parts", parts_text(parts)),
            // `stats --out statistics.json` writes it.
            ShiftMode::Refit(_) => words.option("--shift", "refit").option("--stats", "statistics.json"),
        }
    }
}

/// A generator and the choices of a generation.
fn generator_words(words: Words, bundle: &BundleInfo, config: &GenerateConfig) -> Words {
    let sampler: &'static str = config.sampler.into();
    let spacing = match config.spacing {
        Spacing::Trailing => "trailing",
        Spacing::Lab => "lab",
    };
    words
        .option("--bundle", bundle.origin.path().display())
        .option("--steps", config.steps)
        .option("--seed", config.seed)
        .option("--sampler", sampler)
        .option("--spacing", spacing)
        .option("--eta", config.eta)
        .option_if(config.guidance != 1.0, "--guidance", config.guidance)
}

/// The engine that runs the models.
fn runtime_words(words: Words, engine: EngineChoice) -> Words {
    match engine {
        EngineChoice::Auto => words,
        EngineChoice::Rten => words.option("--runtime", "rten"),
        EngineChoice::Ort => words.option("--runtime", "ort"),
    }
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
        let words = Words::new("v").option("--a", -3).option("--b", 2).option_if(false, "--c", 1).0;
        assert_eq!(words, ["touch2touch", "v", "--a=-3", "--b", "2"]);
        assert_eq!(parts_text(vec![CorrectionPart::Offset, CorrectionPart::Gain].into()), "offset,gain");
    }
}
