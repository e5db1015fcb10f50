//! The models of an evaluation, and what each method makes of a few touches.

use std::collections::BTreeMap;

use super::load::LoadedPair;
use super::{Setup, WHAT};
use crate::error::TaskError;
use crate::infer::bundle::{Bundle, Origin};
use crate::infer::classifier::ToolClassifier;
use crate::infer::engine::{EngineChoice, resolve};
use crate::io::dataset::{Dataset, SourceKind, imprint_from_tile};
use crate::job::JobCx;
use crate::labels::ImprintSource;
use crate::steps::bundles::{self, BundleInfo, BundleKind};
use crate::steps::imprint;
use crate::steps::mask::MaskRecipe;
use crate::steps::models;
use crate::steps::predict::Generating;
use crate::steps::recipe::{Recipe, Stage};
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::evaluation::Scores;
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::{PadId, PerPad, Rig, SensorKind};
use touch2touch_core::sample::Sample;
use touch2touch_core::sample::Scale;
use touch2touch_core::turn::Turn;

/// Pictures that are looked at for stored predictions: a folder has them from the start, or not at all.
const LOOKED_AT: u32 = 16;

/// Method of one row of the table.
pub(super) enum Method {
    /// The measured imprints themselves: the upper bound of everything behind them.
    Measured,
    /// A bundle.
    Generator(Box<GeneratorMethod>),
    /// Predictions that lie by the pictures.
    Stored,
}

pub(super) struct GeneratorMethod {
    name: String,
    bundle: BundleInfo,
    /// Of its own: one generator is in memory at a time, and the methods take turns.
    models: models::Models,
    engine: EngineChoice,
    config: GenerateConfig,
}

/// Pictures that a method makes of one touch.
#[derive(Default)]
pub(super) struct Made {
    /// Imprints in meters, raw orientation, by finger.
    pub(super) imprints: PerPad<DepthMap>,
    /// Differences of a color sensor, 0..255 scale, by finger.
    pub(super) colors: PerPad<RgbGrid>,
    /// Predictions in meters as the picture of their sensor lies and as large as its file, where there are files.
    pub(super) pictures: PerPad<DepthMap>,
    /// A picture in the orientation and size of its file, where that is all there is.
    pub(super) tile: Option<Grid<f32>>,
}

/// Everything that runs.
pub(super) struct Models {
    pub(super) methods: Vec<Method>,
    /// Models among which the mask model is run.
    pub(super) masks: models::Models,
    /// Recipe that every method has in common; without a mask model where there are no masks.
    common: Recipe,
    /// The classifier's bundle; the model once it was needed.
    classifier_bundle: Option<Bundle>,
    pub(super) classifier: Option<ToolClassifier>,
    engine: String,
    /// Number of masks that were not made of the source that was asked, by row and reason.
    pub(super) made_otherwise: BTreeMap<(String, &'static str), usize>,
}

fn open(origin: &Origin) -> Result<Bundle, TaskError> {
    Bundle::open(origin).map_err(|err| TaskError::from_error(format!("{WHAT}: {origin}"), &err))
}

/// A bundle of a kind.
fn found(origin: &Origin, kind: BundleKind) -> Result<BundleInfo, TaskError> {
    bundles::open(&format!("{WHAT}: {origin}"), origin)?.of_kind(kind, WHAT)
}

impl Models {
    /// Finds everything that the setup names; [`Self::load`] loads it.
    pub(super) fn open(setup: &Setup, dataset: &Dataset, models: &models::Models) -> Result<Self, TaskError> {
        let mut methods = Vec::new();
        let pictures = dataset.kind == SourceKind::Pictures;
        let posed = !pictures || !dataset.index.tools().is_empty();
        if !pictures {
            methods.push(Method::Measured);
        }
        let fail = |err: &dyn std::error::Error| TaskError::from_error(WHAT, err);
        let engine = resolve(setup.recipe.engine).map_err(|err| fail(&err))?.label().to_owned();
        let mut names: Vec<String> = Vec::new();
        for origin in &setup.bundles {
            let bundle = found(origin, BundleKind::Generator)?;
            let info = bundle.generator.as_ref();
            let info = info.ok_or_else(|| TaskError::new(WHAT, format!("{origin} declares no generator")))?;
            info.sensors.ends(&bundle.name, &dataset.rig).map_err(|err| fail(&err))?;
            let (config, name) = (info.config(setup.steps, setup.seed, setup.sampler), bundle.name.clone());
            // Two runs of one trainer have the same name: their folders tell them apart.
            let name = if names.contains(&name) { format!("{name} ({})", origin.short_name()) } else { name };
            names.push(name.clone());
            let (models, engine) = (models.beside(), setup.recipe.engine);
            methods.push(Method::Generator(Box::new(GeneratorMethod { name, bundle, models, engine, config })));
        }
        let stored = |id: u32| matches!(dataset.vqvae_tile(PairId(id), Turn::default()), Ok(Some(_)));
        if pictures && (0..LOOKED_AT).any(stored) {
            methods.push(Method::Stored);
        }
        let mask_model = setup.recipe.mask_model.clone().filter(|_| posed);
        if let Some(model) = &mask_model {
            (**model).clone().of_kind(BundleKind::Mask, WHAT)?;
        }
        let classifier_bundle = setup.classifier.as_ref().filter(|_| !pictures).map(open).transpose()?;
        Ok(Self {
            methods,
            masks: models.beside(),
            common: Recipe { mask_model, ..setup.recipe.clone() },
            classifier_bundle,
            classifier: None,
            engine,
            made_otherwise: BTreeMap::new(),
        })
    }

    /// Loads all models, so that one that cannot be used is known before the first touch.
    pub(super) fn load(&mut self) -> Result<(), TaskError> {
        for method in &self.methods {
            if let Method::Generator(method) = method {
                method.models.load(&method.bundle, method.engine)?;
            }
        }
        if let Some(model) = &self.common.until(Stage::Mask).mask_model {
            self.masks.load(model, self.common.engine)?;
        }
        if let Some(bundle) = &self.classifier_bundle {
            let opened = ToolClassifier::open(bundle, self.common.engine);
            self.classifier = Some(opened.map_err(|err| TaskError::from_error(WHAT, &err))?);
        }
        Ok(())
    }

    /// The methods without grasps.
    pub(super) fn empty_scores(&self) -> Vec<Scores> {
        let empty = |method: &Method| Scores {
            method: method.name().to_owned(),
            upper_bound: matches!(method, Method::Measured),
            grasps: Vec::new(),
            measured_features: Vec::new(),
        };
        self.methods.iter().map(empty).collect()
    }

    /// Recipe that every method has in common.
    pub(super) fn common(&self) -> &Recipe {
        &self.common
    }

    /// The engine's name.
    pub(super) fn engine(&self) -> &str {
        &self.engine
    }

    /// Masks that were not made of the source that was asked, in words.
    pub(super) fn masks_made_otherwise(&self) -> Vec<String> {
        let line = |((method, why), count): (&(String, &str), &usize)| format!("{method}: {count} masks {why}");
        self.made_otherwise.iter().map(line).collect()
    }

    /// Notes on what is missing from the table, and why.
    pub(super) fn missing(&self, setup: &Setup, rig: &Rig, scale: Scale) -> Vec<String> {
        let images = match setup.finger {
            None => "images of both fingers".to_owned(),
            Some(pad) => format!("images of the {} finger only", rig.pad_key(pad)),
        };
        let mut notes = vec![format!("{images}; one angle per grasp, from the contact of both")];
        for method in &self.methods {
            if let Method::Generator(method) = method
                && method.bundle.generator.as_ref().is_some_and(|g| g.sensors.output.kind == SensorKind::Color)
            {
                notes.push(format!(
                    "{}: predicts a color picture; PSNR and SSIM are of the difference image on the 0..255 scale, peak \
                     and range 255; no angle or Fréchet distance, which need depth",
                    method.name
                ));
            }
        }
        if scale == Scale::Assumed {
            notes.push("pictures: no tool or Fréchet distance, and no angle where the tools are not named".into());
            return notes;
        }
        notes.push(match self.common.mask_recipe(rig).ok() {
            None => "no mask model: no angle".into(),
            Some(MaskRecipe::Unet(_, least)) => {
                let from = least.map_or(String::new(), |p| format!(" from probability {} on", p.get()));
                format!("contact masks of the mask model{from}, for measured and predicted imprints alike")
            }
            Some(MaskRecipe::Cad(_)) => {
                "contact masks of the CAD model at the true pose: the truth leaks into every angle".into()
            }
            Some(MaskRecipe::Truth) => {
                "contact masks of the simulator's truth: the truth leaks into every angle".into()
            }
            Some(MaskRecipe::Threshold(m)) => format!("contact masks: imprint deeper than {:.1} mm", m.get() * 1e3),
            Some(MaskRecipe::TopPercent(percent)) => {
                format!("contact masks: the deepest {:.1} % of each imprint", percent.get())
            }
        });
        if self.classifier_bundle.is_none() {
            notes.push("no tool classifier: no tool accuracy and no Fréchet distance".into());
        }
        notes
    }
}

impl Method {
    /// The name of the row.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Measured => super::MEASURED,
            Self::Generator(method) => &method.name,
            Self::Stored => "Stored predictions (lab's VQ-VAE)",
        }
    }

    /// The recipe of its poses. Nobody can have drawn on a stored prediction.
    pub(super) fn posed(&self, common: &Recipe) -> Recipe {
        let generator = match self {
            Self::Generator(method) => Some((method.bundle.clone().into(), method.config)),
            Self::Measured | Self::Stored => None,
        };
        Recipe {
            imprint: if generator.is_some() { ImprintSource::Predicted } else { ImprintSource::Measured },
            generator,
            hand: common.hand && !matches!(self, Self::Stored),
            ..common.clone()
        }
    }

    /// Pictures of each touch, or why there are none; `None` once it was told to stop.
    pub(super) fn make(
        &mut self,
        cases: &[&LoadedPair],
        shift: ShiftMode,
        cx: &JobCx,
    ) -> Option<Vec<Result<Made, String>>> {
        Some(match self {
            Self::Measured => cases.iter().map(|case| Ok(measured(case))).collect(),
            Self::Stored => cases.iter().map(|case| stored(case)).collect(),
            Self::Generator(method) => return method.make(cases, shift, cx),
        })
    }
}

fn measured(case: &LoadedPair) -> Made {
    Made { imprints: imprint::measured(&case.sample), ..Made::default() }
}

fn stored(case: &LoadedPair) -> Result<Made, String> {
    let tile = case.lab.clone().ok_or("no stored prediction (NAME_vqvae.png) lies by this picture")?;
    let mut imprints = PerPad::default();
    imprints[PadId::new(0)] = Some(imprint_from_tile(&tile, &case.sample.rig));
    Ok(Made { imprints, tile: Some(tile), ..Made::default() })
}

impl GeneratorMethod {
    fn make(&mut self, cases: &[&LoadedPair], shift: ShiftMode, cx: &JobCx) -> Option<Vec<Result<Made, String>>> {
        let generating = Generating { bundle: &self.bundle, engine: self.engine, config: &self.config };
        let samples: Vec<&Sample> = cases.iter().map(|case| &case.sample).collect();
        let predictions = match generating.pairs(&self.models, &samples, &cx.quiet()) {
            Ok(predictions) => predictions?,
            Err(err) => return Some(cases.iter().map(|_| Err(err.why.clone())).collect()),
        };
        let mut made: Vec<Result<Made, String>> = cases.iter().map(|_| Ok(Made::default())).collect();
        let each = predictions.into_iter().enumerate().flat_map(|(at, pads)| {
            let pads = pads.into_iter().enumerate();
            pads.filter_map(move |(pad, made)| Some((at, PadId::new(pad), made?)))
        });
        for (at, finger, prediction) in each {
            let sample = &cases[at].sample;
            let picture = prediction.and_then(|prediction| {
                let measured = sample.pad(finger).and_then(|t| t.color()).map_or([0, 0], |c| c.difference.size());
                if let Some(color) = imprint::color(&prediction, measured)? {
                    return Ok((None, Some(color), None));
                }
                let tile = cases[at].tile.as_ref().map(Grid::size);
                let picture = tile.map(|size| imprint::picture_of(&prediction, shift, sample, finger, size));
                let depth = imprint::imprint_of(&prediction, shift, sample, finger)?;
                Ok((Some(depth), None, picture.transpose()?))
            });
            match (picture, &mut made[at]) {
                (Ok((depth, color, picture)), Ok(made)) => {
                    (made.imprints[finger], made.colors[finger], made.pictures[finger]) = (depth, color, picture);
                }
                (Err(err), slot) => *slot = Err(err.why),
                (Ok(_), Err(_)) => {}
            }
        }
        Some(made)
    }
}
