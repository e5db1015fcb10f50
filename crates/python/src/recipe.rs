//! `Recipe`: everything that decides the result of a touch, as one value.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use strum::IntoEnumIterator as _;
use touch2touch_core::diffusion::Sampler;
use touch2touch_core::pose::RegistrationChoice;
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::Rig;
use touch2touch_work::bundles::{self, BundleKind};
use touch2touch_work::infer::engine::EngineChoice;
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::mask::{MaskChoice, MaskSource};
use touch2touch_work::recipe::{Model, Recipe as Whole, Stage, meters};

use crate::process::{failed, refused};

/// Everything that decides the result of a touch: the imprint, the models with their choices, the mask, the registration.
///
/// Choices that are not said are as the verbs have them. `imprint`: "measured" or "predicted". `bundle`, `mask_bundle`: folders of model
/// bundles (default: the shipped ones). `steps`, `seed`, `sampler`: of the generator (default: the bundle's). `shift`: the
/// mapping to meters, "exact", "paper" or "raw". `mask`: "auto", "unet", "threshold", "top_percent", "cad" or "truth", with
/// `threshold_mm`. `engine`: the registration, such as "joint" or "gicp:gate=1.5". `hand`: masks drawn by hand win.
/// `runtime`: "auto", "rten", "ort" or a provider of ONNX Runtime, such as "cuda" (`touch2touch runtime` lists them).
#[pyclass(module = "touch2touch", frozen)]
pub(crate) struct Recipe {
    pub(crate) whole: Whole,
    /// The choices that were named, by which it pickles.
    named: Py<PyDict>,
}

/// The choice of this name.
///
/// # Errors
/// If there is none; those that there are are said.
fn choice<T>(what: &str, name: &str, all: impl IntoIterator<Item = (&'static str, T)>) -> PyResult<T> {
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
    Ok(match name {
        "prediction" => Stage::Prediction,
        "imprint" => Stage::Imprint,
        "mask" => Stage::Mask,
        "cloud" => Stage::Cloud,
        "pose" => Stage::Pose,
        other => {
            return Err(refused(format!(
                "there is no stage {other:?}; there are prediction, imprint, mask, cloud, pose"
            )));
        }
    })
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
        let left = named.copy()?;
        let take = |key: &str| -> PyResult<Option<Bound<'_, PyAny>>> {
            let value = left.get_item(key)?.filter(|value| !value.is_none());
            if left.contains(key)? {
                left.del_item(key)?;
            }
            Ok(value)
        };
        let text = |key: &str, default: &str| -> PyResult<String> {
            Ok(take(key)?.map(|value| value.extract()).transpose()?.unwrap_or_else(|| default.to_owned()))
        };
        let imprint = [ImprintSource::Measured, ImprintSource::Predicted].map(|source| (source.key(), source));
        let imprint = choice("imprint", &text("imprint", "measured")?, imprint)?;
        let bundle: Option<PathBuf> = take("bundle")?.map(|v| v.extract()).transpose()?;
        let mask_bundle: Option<PathBuf> = take("mask_bundle")?.map(|v| v.extract()).transpose()?;
        let steps: Option<u32> = take("steps")?.map(|v| v.extract()).transpose()?;
        let seed: Option<u64> = take("seed")?.map(|v| v.extract()).transpose()?;
        let sampler = take("sampler")?.map(|v| v.extract::<String>()).transpose()?;
        let samplers = Sampler::iter().map(|sampler| (sampler.into(), sampler));
        let sampler = sampler.map(|name| choice("sampler", &name, samplers));
        let sampler = sampler.transpose()?;
        let shifts = [("exact", ShiftMode::ExactInverse), ("paper", ShiftMode::PaperShift), ("raw", ShiftMode::Raw)];
        let shift = choice("shift", &text("shift", "exact")?, shifts)?;
        let masks = MaskSource::iter().map(|source| (source.key(), source));
        let mask = choice("mask", &text("mask", MaskSource::default().key())?, masks)?;
        let threshold_mm: Option<f64> = take("threshold_mm")?.map(|v| v.extract()).transpose()?;
        let registration = text("engine", &RegistrationChoice::default().to_string())?;
        let registration: RegistrationChoice = registration.parse().map_err(refused)?;
        let hand: Option<bool> = take("hand")?.map(|v| v.extract()).transpose()?;
        let engine: EngineChoice = text("runtime", EngineChoice::default().key())?.parse().map_err(refused)?;
        if let Some(unknown) = left.keys().iter().next() {
            return Err(refused(format!("a recipe has no choice {unknown}; see help(touch2touch.Recipe)")));
        }
        let usual = MaskChoice::default();
        let mask = MaskChoice { source: mask, threshold_m: threshold_mm.map_or(usual.threshold_m, meters), ..usual };
        let whole = py.detach(|| {
            let (found, rig) = (bundles::find(&[]), Rig::lab());
            let generator = match imprint {
                ImprintSource::Measured => None,
                ImprintSource::Predicted => {
                    let bundle = found.take(BundleKind::Generator, bundle.as_deref(), &rig)?;
                    let config = bundle.generator.as_ref().map(|info| info.config(steps, seed, sampler));
                    config.map(|config| (bundle.into(), config))
                }
            };
            let mask_model = Model::of_masks(mask.source, &found, mask_bundle.as_deref(), &rig)?;
            let hand = hand.unwrap_or(true);
            Ok(Whole { imprint, generator, shift, mask, mask_model, hand, registration, engine })
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
