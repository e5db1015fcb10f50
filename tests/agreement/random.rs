//! Random recipes over the demo, a lab folder and a folder of pictures: what the studio shows by one, and what the verb says
//! with the words that the studio gives for it, number by number.

pub(super) mod compared;
pub(super) mod files;
pub(super) mod labels;
pub(super) mod learned;
pub(super) mod posed;
pub(super) mod tables;
pub(super) mod watched;

use std::fmt::Debug;
use std::path::{Path, PathBuf};

use proptest::strategy::{Strategy, ValueTree as _};
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use serde::Serialize;
use serde_json::Value;
use touch2touch::app::command::{LibraryCommand, Pane, PredictCommand, ViewCommand};
use touch2touch::app::export;
use touch2touch::app::library::Place;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::pose::Registration;
use touch2touch_pipeline::io::npz;
use touch2touch_pipeline::io::pt::Values;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::steps::recipe::Recipe;

use super::recipes::{put, recipe};
use super::{Studio, lab_folder, pictures_folder};
use crate::support::run;

/// Draws at random, and the same in each run of the tests.
pub(super) struct Draws(TestRunner);

impl Draws {
    /// The draws of a test, by a number of its own.
    pub(super) fn new(test: u8) -> Self {
        let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[test; 32]);
        Self(TestRunner::new_with_rng(Config::default(), rng))
    }

    fn one<T: Debug>(&mut self, of: impl Strategy<Value = T>) -> T {
        of.new_tree(&mut self.0).unwrap().current()
    }

    fn of<T: Clone + Debug + 'static>(&mut self, list: &[T]) -> T {
        self.one(proptest::sample::select(list.to_vec()))
    }

    /// A recipe of predictions, which takes one or two steps.
    fn recipe(&mut self) -> Recipe {
        loop {
            let found = self.one(recipe());
            if let (ImprintSource::Predicted, Some((model, config))) = (found.imprint, found.generator.clone()) {
                let config = GenerateConfig { steps: 1 + config.steps % 2, ..config };
                return Recipe { generator: Some((model, config)), ..found };
            }
        }
    }

    /// The same with masks and a registration that give a pose soon.
    pub(super) fn posed(&mut self) -> Recipe {
        let recipe = self.recipe();
        let mut mask = recipe.mask;
        (mask.threshold_m, mask.top_percent) = (self.one(0.002..0.007f32), self.one(4.0..20.0f32));
        let slow = recipe.registration == Registration::LabIcp;
        let registration = if slow { Registration::default() } else { recipe.registration };
        Recipe { mask, registration, ..recipe }
    }
}

/// A place with the studio on it and the verbs beside it. What the one keeps the others do not find: each makes its own.
struct Both {
    studio: Studio,
    /// The place as a verb takes it.
    path: String,
    /// Folder in which the verbs keep and write.
    home: PathBuf,
}

impl Both {
    fn open(place: Place, home: &Path) -> Self {
        let path = match &place {
            Place::Demo => "demo".to_owned(),
            Place::Path(path) => path.to_str().unwrap().to_owned(),
        };
        let [studio, verbs] = ["studio", "verbs"].map(|name| home.join(name));
        std::fs::create_dir_all(&verbs).unwrap();
        std::fs::create_dir_all(&studio).unwrap();
        Self { studio: Studio::open(place, &studio), path, home: verbs }
    }

    /// The demo, a lab folder and a folder of pictures.
    fn places(home: &Path) -> impl Iterator<Item = Self> {
        let lab = Place::Path(lab_folder(home));
        let pictures = Place::Path(pictures_folder(home));
        let homes = ["demo", "labs", "photos"].map(|name| home.join(name));
        [Place::Demo, lab, pictures].into_iter().zip(homes).map(|(place, home)| Self::open(place, &home))
    }

    /// Shows these panes, and no other.
    fn show(&mut self, panes: &[Pane]) {
        self.studio.send(ViewCommand::ShowPanes(panes.iter().copied().collect()).into());
    }

    fn pairs(&self) -> u32 {
        self.studio.state.library.open.as_ref().unwrap().source.dataset.index.pairs.len() as u32
    }

    /// Puts a recipe in force and has a pair predicted with it.
    fn predict(&mut self, recipe: &Recipe, pair: u32) {
        put(&mut self.studio, recipe);
        self.studio.send(LibraryCommand::Select(PairId(pair % self.pairs())).into());
        self.studio.send(PredictCommand::Generate.into());
    }

    /// The words of *Copy command*, with what they write in the home of the verbs.
    fn words(&self, pane: Pane) -> Vec<String> {
        let words =
            export::equivalent_words(&self.studio.state, pane).unwrap_or_else(|| panic!("{pane:?}: no command"));
        let mut out = false;
        let placed = words.into_iter().skip(1).map(|word| {
            let placed = if std::mem::replace(&mut out, word == "--out") { self.at(&word) } else { word };
            if placed == "refit:statistics.json" { format!("refit:{}", self.at("statistics.json")) } else { placed }
        });
        placed.collect()
    }

    /// A file of the verbs.
    fn at(&self, name: &str) -> String {
        self.home.join(name).to_str().unwrap().to_owned()
    }

    /// Answer of a verb; `Err` is what it says instead.
    fn run(&self, words: &[String]) -> Result<Value, String> {
        let mut words: Vec<&str> = words.iter().map(String::as_str).collect();
        // Some commands say it themselves.
        if !words.contains(&"--json") {
            words.push("--json");
        }
        let output = run(&words, &self.home);
        let answer = serde_json::from_slice::<Value>(&output.stdout).ok();
        // A table of poses without a row says on standard error why.
        let answer = answer.filter(|answer| answer["cases"].as_array().is_none_or(|cases| !cases.is_empty()));
        answer.ok_or_else(|| String::from_utf8_lossy(&output.stderr).into_owned())
    }

    /// Answer of the command of a pane.
    fn said(&self, pane: Pane) -> Result<Value, String> {
        self.run(&self.words(pane))
    }

    /// A verb with the place, a pair and words of a recipe.
    fn of_pair(&self, verb: &[&str], words: impl IntoIterator<Item = String>) -> Result<Value, String> {
        let verb = verb.iter().map(ToString::to_string);
        let pair = [self.path.clone(), "--pair".to_owned(), self.studio.state.pair_name().to_owned()];
        self.run(&verb.chain(pair).chain(words).collect::<Vec<_>>())
    }
}

/// A value as it is after it was written and read: what equal means in a text.
fn written(value: &(impl Serialize + ?Sized)) -> Value {
    serde_json::from_str(&serde_json::to_string(value).unwrap()).unwrap()
}

/// A value without what no two runs share.
fn without(mut value: Value, keys: &[&str]) -> Value {
    let map = value.as_object_mut().unwrap();
    keys.iter().for_each(|key| drop(map.remove(*key)));
    value
}

/// Count of the numbers in a value.
fn numbers(value: &Value) -> usize {
    match value {
        Value::Number(_) => 1,
        Value::Array(parts) => parts.iter().map(numbers).sum(),
        Value::Object(parts) => parts.values().map(numbers).sum(),
        _ => 0,
    }
}

/// First place at which two values differ.
fn difference(shown: &Value, said: &Value, at: &str) -> Option<String> {
    match (shown, said) {
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().find_map(|(i, (a, b))| difference(a, b, &format!("{at}[{i}]")))
        }
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            a.iter().find_map(|(key, value)| difference(value, &b[key], &format!("{at}.{key}")))
        }
        (a, b) => (a != b).then(|| format!("{at}: {a:.300} is shown, {b:.300} is said")),
    }
}

/// Holds what is shown against what is said. How many numbers were the same.
fn same(shown: &Value, said: &Value, what: &str) -> usize {
    if let Some(difference) = difference(shown, said, "") {
        panic!("{what}: {difference}");
    }
    numbers(said)
}

/// Holds a picture in memory against a file of numbers. How many pixels were the same bit for bit.
fn same_pixels(shown: &DepthMap, file: &Path, what: &str) -> usize {
    let tensor = npz::read_npy(file).unwrap_or_else(|err| panic!("{what}: {err}"));
    let Values::F32(written) = &tensor.values else { panic!("{what}: not f32") };
    assert_eq!(tensor.shape, [shown.height(), shown.width()], "{what}");
    let differ = shown.as_slice().iter().zip(written.iter()).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
    assert_eq!(differ, 0, "{what}: pixels of {}", shown.len());
    shown.len()
}

/// Asserts that enough was compared in each place.
fn compared(counts: &[usize], least: usize) {
    assert!(!counts.is_empty() && counts.iter().all(|count| *count >= least), "{counts:?}");
}
