//! `Recipe`: everything that decides the result of a touch, as one value.

use std::path::PathBuf;
use std::str::FromStr;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use strum::IntoEnumIterator as _;
use touch2touch_core::diffusion::{Preset, Sampler, Spacing};
use touch2touch_core::postprocess::{CorrectionPart, CorrectionParts};
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::steps::bundles;
use touch2touch_pipeline::steps::mask::{MaskChoice, MaskSource};
use touch2touch_pipeline::steps::recipe::{GeneratorChoice, Model, Recipe as Whole, ShiftChoice, Stage, meters};

use crate::process::{failed, refused};

/// Everything that decides the result of a touch: the imprint, the models with their choices, the mask, the registration.
///
/// Choices that are not said are as the verbs have them. `imprint`: "measured" or "predicted". `bundle`, `mask_bundle`: folders of model
/// bundles (default: the shipped ones). `preset`: "fast", "default" or "sharp", of which `steps`, `seed`, `eta`, `sampler`,
/// `spacing` change single numbers. `shift`: the mapping to meters, "exact" with `fit_parts` (a list of "offset",
/// "field", "gain", "response"), "paper", "raw", or "refit" with `stats`, a file of `touch2touch stats`. `mask`: "auto", "unet",
/// "threshold", "top_percent", "cad" or "truth", with `threshold_mm`, `probability`, `top_percent`, `cad_mm`. `engine`: the
/// registration, such as "joint" or "distance_field:gate=1.5". `hand`: masks drawn by hand win.
/// `runtime`: "auto", "rten", "ort" or a provider of ONNX Runtime, such as "cuda" (`touch2touch runtime` lists them).
#[pyclass(module = "touch2touch", frozen)]
pub(crate) struct Recipe {
    pub(crate) whole: Whole,
    /// The choices that were named, by which it pickles.
    named: Py<PyDict>,
}

/// Choices that were named and are not read yet.
struct Left<'py>(Bound<'py, PyDict>);

impl Left<'_> {
    /// A choice, if it was named.
    ///
    /// # Errors
    /// If it is of another type.
    fn take<T: for<'a> FromPyObject<'a, 'a, Error: Into<PyErr>>>(&mut self, key: &str) -> PyResult<Option<T>> {
        let value = self.0.get_item(key)?;
        if value.is_some() {
            self.0.del_item(key)?;
        }
        value.filter(|value| !value.is_none()).map(|value| value.extract().map_err(Into::into)).transpose()
    }

    /// One of a few things by its name.
    ///
    /// # Errors
    /// If there is none of that name; those that there are are said.
    fn one_of<T>(&mut self, key: &str, all: impl IntoIterator<Item = (&'static str, T)>) -> PyResult<Option<T>> {
        self.take::<String>(key)?.map(|name| choice(key, &name, all)).transpose()
    }

    /// The value that a text stands for.
    ///
    /// # Errors
    /// Of the parser.
    fn parsed<T: FromStr<Err: std::fmt::Display>>(&mut self, key: &str) -> PyResult<Option<T>> {
        self.take::<String>(key)?.map(|text| text.parse().map_err(refused)).transpose()
    }

    fn shift(&mut self) -> PyResult<ShiftChoice> {
        let parts: Option<Vec<String>> = self.take("fit_parts")?;
        let part = |name: &String| choice("fit_parts", name, CorrectionPart::iter().map(|part| (part.into(), part)));
        let parts = parts.map(|names| names.iter().map(part).collect::<PyResult<Vec<_>>>()).transpose()?;
        let exact = ShiftChoice::Exact(parts.map_or(CorrectionParts::ALL, CorrectionParts::from));
        let mut all = vec![("exact", exact.clone()), ("paper", ShiftChoice::Paper), ("raw", ShiftChoice::Raw)];
        all.extend(self.take("stats")?.map(|file| ("refit", ShiftChoice::Refit(file))));
        Ok(self.one_of("shift", all)?.unwrap_or(exact))
    }

    fn mask(&mut self) -> PyResult<MaskChoice> {
        let usual = MaskChoice::default();
        let mask = MaskChoice {
            source: self.one_of("mask", MaskSource::iter().map(|source| (source.key(), source)))?.unwrap_or_default(),
            threshold_m: self.take("threshold_mm")?.map_or(usual.threshold_m, meters),
            probability: self.take("probability")?,
            top_percent: self.take("top_percent")?.unwrap_or(usual.top_percent),
            cad_distance_m: self.take("cad_mm")?.map_or(usual.cad_distance_m, meters),
        };
        match mask.probability {
            Some(p) if !(0.0..=1.0).contains(&p) => Err(refused("probability: a number of 0 to 1 is needed")),
            _ => Ok(mask),
        }
    }
}

/// The choice of this name.
///
/// # Errors
/// If there is none; those that there are are said.
pub(crate) fn choice<T>(what: &str, name: &str, all: impl IntoIterator<Item = (&'static str, T)>) -> PyResult<T> {
    let mut names = Vec::new();
    for (known, value) in all {
        if known == name {
            return Ok(value);
        }
        names.push(known);
    }
    Err(refused(format!("{what}: there is no {name:?}; there are {}", names.join(", "))))
}

/// The stage of this name.
///
/// # Errors
/// If there is none.
pub(crate) fn stage(name: &str) -> PyResult<Stage> {
    choice("stage", name, Stage::iter().map(|stage| (stage.into(), stage)))
}

/// The recipe that was given, else the one that goes without saying for this imprint.
///
/// # Errors
/// If a bundle that was found cannot be used.
pub(crate) fn given_or(py: Python<'_>, given: Option<&Recipe>, imprint: &str) -> PyResult<Whole> {
    match given {
        Some(recipe) => Ok(recipe.whole.clone()),
        None => Ok(Recipe::new(py, imprint, None)?.whole),
    }
}

#[pymethods]
impl Recipe {
    #[new]
    #[pyo3(signature = (imprint="measured", **choices))]
    fn new(py: Python<'_>, imprint: &str, choices: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let named = PyDict::new(py);
        named.set_item("imprint", imprint)?;
        if let Some(choices) = choices {
            named.update(choices.as_mapping())?;
        }
        let mut left = Left(named.copy()?);
        let imprint = [ImprintSource::Measured, ImprintSource::Predicted].map(|source| (source.key(), source));
        let imprint = left.one_of("imprint", imprint)?.unwrap_or_default();
        let generator = GeneratorChoice {
            bundle: left.take("bundle")?,
            preset: left.one_of("preset", Preset::iter().map(|preset| (preset.key(), preset)))?.unwrap_or_default(),
            steps: left.take("steps")?,
            seed: left.take("seed")?,
            eta: left.take("eta")?,
            sampler: left.one_of("sampler", Sampler::iter().map(|sampler| (sampler.into(), sampler)))?,
            spacing: left.one_of("spacing", Spacing::iter().map(|spacing| (spacing.into(), spacing)))?,
            shift: left.shift()?,
        };
        let mask_bundle: Option<PathBuf> = left.take("mask_bundle")?;
        let mask = left.mask()?;
        let registration = left.parsed("engine")?.unwrap_or_default();
        let hand = left.take("hand")?.unwrap_or(true);
        let engine = left.parsed("runtime")?.unwrap_or_default();
        if let Some(unknown) = left.0.keys().iter().next() {
            return Err(refused(format!("a recipe has no choice {unknown}; see help(touch2touch.Recipe)")));
        }
        let whole = py.detach(|| {
            let (found, rig) = (bundles::find(&[]), Rig::lab());
            let usual = Whole { imprint, mask, hand, registration, engine, ..Whole::default() };
            let (generator, shift) = match imprint {
                ImprintSource::Measured => (None, usual.shift),
                ImprintSource::Predicted => {
                    let (generator, shift) = generator.of(&found, &rig)?;
                    (Some(generator), shift)
                }
            };
            let mask_model = Model::of_masks(mask.source, &found, mask_bundle.as_deref(), &rig)?;
            Ok(Whole { generator, shift, mask_model, ..usual })
        });
        Ok(Self { whole: whole.map_err(|err| failed(&err))?, named: named.unbind() })
    }

    /// Identity of the result of a stage by this recipe: what decides it, and nothing else. The same as in files.
    #[pyo3(signature = (stage="pose"))]
    fn id(&self, stage: &str) -> PyResult<String> {
        Ok(self.whole.id(crate::recipe::stage(stage)?).to_string())
    }

    /// The choices that were named.
    #[getter]
    fn choices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.named.bind(py).copy()
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, this) = (slf.py(), slf.get());
        (py.import("touch2touch")?.getattr("_recipe")?, (this.choices(py)?,)).into_pyobject(py)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.whole == other.whole
    }

    fn __hash__(&self) -> u64 {
        use std::hash::{Hash as _, Hasher as _};
        let mut hasher = std::hash::DefaultHasher::new();
        self.whole.id(Stage::Pose).hash(&mut hasher);
        hasher.finish()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let choices = self.named.bind(py).iter().map(|(key, value)| Ok(format!("{key}={}", value.repr()?)));
        Ok(format!("Recipe({})", choices.collect::<PyResult<Vec<_>>>()?.join(", ")))
    }
}
