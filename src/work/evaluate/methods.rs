//! The models of an evaluation, and what each method makes of a few touches.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Instant;

use super::load::Case;
use super::{MaskBy, Setup, WHAT};
use crate::domain::dataset::PairId;
use crate::domain::diffusion::GenerateConfig;
use crate::domain::grid::{DepthMap, Grid, RgbGrid};
use crate::domain::postprocess::{Picture, RawPrediction, ShiftMode};
use crate::domain::resample::{bilinear, bilinear_rgb};
use crate::domain::rig::{PadId, PerPad, SensorId, SensorKind};
use crate::domain::sample::Scale;
use crate::domain::turn::Turn;
use crate::infer::bundle::{Bundle, Origin};
use crate::infer::classifier::ToolClassifier;
use crate::infer::generator::{GenerateError, Generator};
use crate::infer::mask::MaskModel;
use crate::io::dataset::{Dataset, SourceKind};
use crate::work::error::TaskError;
use crate::work::job::JobCx;

/// Pictures that are looked at for stored predictions: a folder has them from the start, or not at all.
const LOOKED_AT: u32 = 16;

/// What stands for one row of the table.
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
    generator: Generator,
    config: GenerateConfig,
    /// The sensor that it starts from.
    input: SensorId,
}

/// What a method makes of one touch.
pub(super) struct Made {
    /// Imprints in meters, raw orientation, by finger.
    pub(super) imprints: PerPad<DepthMap>,
    /// Differences of a color sensor, 0..255 scale, by finger.
    pub(super) colors: PerPad<RgbGrid>,
    /// A picture in the orientation and size of its file, where that is all there is.
    pub(super) tile: Option<Grid<f32>>,
    /// Time per image, seconds.
    pub(super) seconds: Option<f64>,
}

/// Everything that runs.
pub(super) struct Models {
    pub(super) methods: Vec<Method>,
    pub(super) mask: Option<MaskModel>,
    pub(super) classifier: Option<ToolClassifier>,
    engine: String,
    /// How many masks were not made of the source that was asked, by row and reason.
    pub(super) made_otherwise: BTreeMap<(String, &'static str), usize>,
}

fn open<T, E: std::error::Error>(
    origin: &Origin,
    load: impl FnOnce(&Bundle) -> Result<T, E>,
) -> Result<(T, String), TaskError> {
    let what = format!("{WHAT}: {origin}");
    let bundle = Bundle::open(origin).map_err(|err| TaskError::from_error(&what, &err))?;
    let model = load(&bundle).map_err(|err| TaskError::from_error(&what, &err))?;
    Ok((model, bundle.name().to_owned()))
}

impl Models {
    /// Loads everything that the setup names.
    pub(super) fn open(setup: &Setup, dataset: &Dataset) -> Result<Self, TaskError> {
        let mut methods = Vec::new();
        let pictures = dataset.kind == SourceKind::Pictures;
        if !pictures {
            methods.push(Method::Measured);
        }
        let mut engine = String::new();
        let mut names: Vec<String> = Vec::new();
        for origin in &setup.bundles {
            let (generator, name) = open(origin, |bundle| Generator::open(bundle, setup.runtime))?;
            let ends = generator.spec().sensors().ends(&name, &dataset.rig);
            let input = ends.map_err(|err| TaskError::from_error(WHAT, &err))?.input;
            let defaults = generator.spec().defaults;
            let config = GenerateConfig {
                steps: setup.steps.filter(|_| defaults.steps > 1).unwrap_or(defaults.steps),
                seed: setup.seed.unwrap_or(defaults.seed),
                sampler: setup.sampler.unwrap_or(defaults.sampler),
                ..defaults
            };
            engine = generator.engine().label().to_owned();
            // Two runs of one trainer have the same name: their folders tell them apart.
            let name = if names.contains(&name) { format!("{name} ({})", origin.short_name()) } else { name };
            names.push(name.clone());
            methods.push(Method::Generator(Box::new(GeneratorMethod { name, generator, config, input })));
        }
        let stored = |id: u32| matches!(dataset.vqvae_tile(PairId(id), Turn::default()), Ok(Some(_)));
        if pictures && (0..LOOKED_AT).any(stored) {
            methods.push(Method::Stored);
        }
        let mask = match (&setup.mask_bundle, setup.mask) {
            (Some(origin), MaskBy::Unet) if !pictures => {
                Some(open(origin, |bundle| MaskModel::open(bundle, setup.runtime))?.0)
            }
            _ => None,
        };
        let classifier = match &setup.classifier {
            Some(origin) if !pictures => Some(open(origin, |bundle| ToolClassifier::open(bundle, setup.runtime))?.0),
            _ => None,
        };
        if engine.is_empty() {
            engine = mask.as_ref().map_or("no model", |m| m.engine().label()).to_owned();
        }
        Ok(Self { methods, mask, classifier, engine, made_otherwise: BTreeMap::new() })
    }

    /// The engine's name.
    pub(super) fn engine(&self) -> &str {
        &self.engine
    }

    /// Masks that were not made of the source that was asked, in words.
    pub(super) fn masks_made_otherwise(&self) -> Vec<String> {
        let line = |((method, why), count): (&(String, &'static str), &usize)| format!("{method}: {count} masks {why}");
        self.made_otherwise.iter().map(line).collect()
    }

    /// What is missing from the table, and why.
    pub(super) fn missing(&self, setup: &Setup, scale: Scale) -> Vec<String> {
        let mut notes = vec![if setup.both_fingers {
            "images of both fingers; one angle per grasp, from the contact of both".to_owned()
        } else {
            "images of the right finger only; one angle per grasp, from the contact of both".to_owned()
        }];
        for method in &self.methods {
            if let Method::Generator(method) = method
                && method.generator.spec().output.sensor.kind == SensorKind::Color
            {
                notes.push(format!(
                    "{}: predicts a color picture; PSNR and SSIM are of the difference image on the 0..255 scale, peak \
                     and range 255; no angle, tool or Fréchet distance, which need depth",
                    method.name
                ));
            }
        }
        if scale == Scale::Assumed {
            notes.push("pictures have no camera, pose or tool: no angle, tool or Fréchet distance".into());
            return notes;
        }
        notes.push(match setup.mask {
            MaskBy::Unet if self.mask.is_none() => "no mask model: no angle".into(),
            MaskBy::Unet => "contact masks of the mask model, for measured and predicted imprints alike".into(),
            MaskBy::Cad => "contact masks of the CAD model at the true pose: the truth leaks into every angle".into(),
            MaskBy::Truth => "contact masks of the simulator's truth: the truth leaks into every angle".into(),
            MaskBy::Threshold(m) => format!("contact masks: imprint deeper than {:.1} mm", m * 1e3),
        });
        if self.classifier.is_none() {
            notes.push("no tool classifier: no tool accuracy and no Fréchet distance".into());
        }
        notes
    }
}

impl Method {
    /// The name of the row.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Measured => "Measured (upper bound)",
            Self::Generator(method) => &method.name,
            Self::Stored => "Stored predictions (lab's VQ-VAE)",
        }
    }

    /// What it makes of each touch, or why not; `None` once it was told to stop.
    pub(super) fn make(&mut self, cases: &[Case], setup: &Setup, cx: &JobCx) -> Option<Vec<Result<Made, String>>> {
        Some(match self {
            Self::Measured => cases.iter().map(|case| Ok(measured(case))).collect(),
            Self::Stored => cases.iter().map(stored).collect(),
            Self::Generator(method) => return method.make(cases, setup.shift, cx),
        })
    }
}

fn measured(case: &Case) -> Made {
    let imprint = |f: PadId| Some(case.sample.pad(f)?.depth()?.imprint.clone());
    Made {
        imprints: case.sample.rig.pads().map(imprint).collect(),
        colors: PerPad::default(),
        tile: None,
        seconds: None,
    }
}

fn stored(case: &Case) -> Result<Made, String> {
    let tile = case.lab.clone().ok_or("no stored prediction (NAME_vqvae.png) lies by this picture")?;
    Ok(Made { imprints: PerPad::default(), colors: PerPad::default(), tile: Some(tile), seconds: None })
}

impl GeneratorMethod {
    fn make(&mut self, cases: &[Case], shift: ShiftMode, cx: &JobCx) -> Option<Vec<Result<Made, String>>> {
        let input = self.input;
        let touches: Vec<(usize, PadId, Cow<'_, RgbGrid>)> = cases
            .iter()
            .enumerate()
            .flat_map(|(at, case)| {
                case.sample.pads.entries().filter_map(move |(f, touch)| Some((at, f, touch.picture(input)?)))
            })
            .collect();
        let images: Vec<&RgbGrid> = touches.iter().map(|t| &*t.2).collect();
        let start = Instant::now();
        let raws = self.generate(&images, cx)?;
        let seconds = start.elapsed().as_secs_f64() / images.len().max(1) as f64;
        let mut made: Vec<Result<Made, String>> = cases
            .iter()
            .map(|_| {
                Ok(Made { imprints: PerPad::default(), colors: PerPad::default(), tile: None, seconds: Some(seconds) })
            })
            .collect();
        for ((at, finger, _), raw) in touches.into_iter().zip(raws) {
            let picture = raw.and_then(|raw| self.generator.picture(&raw, shift).map_err(|err| err.to_string()));
            let touch = cases[at].sample.pad(finger);
            match (picture, &mut made[at]) {
                (Ok(Picture::Depth(depth)), Ok(made)) => {
                    let bubble = touch.and_then(|t| t.depth());
                    made.imprints[finger] = Some(match bubble.map(|b| b.imprint.size()) {
                        Some([w, h]) if depth.size() != [w, h] && w * h > 0 => bilinear(&depth, w, h),
                        _ => depth,
                    });
                }
                (Ok(Picture::Color(color)), Ok(made)) => {
                    let measured = touch.and_then(|t| t.color()).map(|c| c.difference.size());
                    made.colors[finger] = Some(match measured {
                        Some([w, h]) if color.size() != [w, h] && w * h > 0 => bilinear_rgb(&color, w, h),
                        _ => color,
                    });
                }
                (Err(why), slot) => *slot = Err(why),
                (Ok(_), Err(_)) => {}
            }
        }
        Some(made)
    }

    /// The decoder's pictures. One that fails does not take the others of its batch with it. `None` once told to stop.
    fn generate(&mut self, images: &[&RgbGrid], cx: &JobCx) -> Option<Vec<Result<RawPrediction, String>>> {
        let mut go = |_| if cx.cancel.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        match self.generator.generate_batch(images, &self.config, &mut go) {
            Ok(raws) => return Some(raws.into_iter().map(Ok).collect()),
            Err(GenerateError::Cancelled) => return None,
            Err(_) => {}
        }
        let mut out = Vec::new();
        for image in images {
            match self.generator.generate(image, &self.config, &mut go) {
                Err(GenerateError::Cancelled) => return None,
                one => out.push(one.map_err(|err| err.to_string())),
            }
        }
        Some(out)
    }
}
