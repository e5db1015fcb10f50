//! The options and models that `generate` and `pose` share. Models are loaded when first needed.

use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use strum::IntoEnumIterator as _;

use crate::domain::diffusion::{GenerateConfig, Sampler};
use crate::domain::grid::{DepthMap, Mask};
use crate::domain::postprocess::ShiftMode;
use crate::domain::sample::Sample;
use crate::domain::sensor::Finger;
use crate::infer::bundle::{Bundle, default_roots, find};
use crate::infer::engine::EngineChoice;
use crate::infer::generator::Generator;
use crate::infer::mask::MaskModel;

/// Which models, and how they are run.
#[derive(Debug, Clone, Args)]
pub(super) struct ModelArgs {
    /// The generator's bundle (default: the shipped one).
    #[arg(long)]
    bundle: Option<PathBuf>,
    /// The mask model's bundle (default: the shipped one).
    #[arg(long)]
    mask_bundle: Option<PathBuf>,
    /// Sampling steps (default: the bundle's).
    #[arg(long)]
    steps: Option<u32>,
    /// Seed of the noise (default: the bundle's).
    #[arg(long)]
    seed: Option<u64>,
    /// Share of fresh noise per step, 0 to 1, for DDIM (default: the bundle's).
    #[arg(long)]
    eta: Option<f64>,
    /// The way from noise to an image (default: the bundle's).
    #[arg(long, value_parser = PossibleValuesParser::new(Sampler::iter().map(Sampler::key)).map(sampler))]
    sampler: Option<Sampler>,
    /// How the decoder's output becomes metres.
    #[arg(long, value_enum, default_value_t = ShiftArg::Exact)]
    shift: ShiftArg,
    /// The engine that runs the models.
    #[arg(long, value_enum, default_value_t = RuntimeArg::Auto)]
    runtime: RuntimeArg,
}

/// Of a key that the parser has already compared with the list.
pub(super) fn sampler(key: String) -> Sampler {
    key.parse().unwrap_or_default()
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum ShiftArg {
    /// What the lab's released script saves: its range is mapped twice.
    Raw,
    /// The paper's mean-and-deviation shift of that.
    Paper,
    /// The doubled mapping undone exactly.
    Exact,
}

impl ShiftArg {
    /// The reading of the decoder's output.
    pub(super) fn mode(self) -> ShiftMode {
        match self {
            ShiftArg::Raw => ShiftMode::Raw,
            ShiftArg::Paper => ShiftMode::PaperShift,
            ShiftArg::Exact => ShiftMode::ExactInverse,
        }
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum RuntimeArg {
    /// ONNX Runtime where its library is found, else the built-in engine.
    Auto,
    /// The built-in engine.
    Rten,
    /// ONNX Runtime.
    Ort,
}

impl RuntimeArg {
    /// The choice for the engines.
    pub(super) fn choice(self) -> EngineChoice {
        match self {
            RuntimeArg::Auto => EngineChoice::Auto,
            RuntimeArg::Rten => EngineChoice::Rten,
            RuntimeArg::Ort => EngineChoice::Ort,
        }
    }
}

/// The models of one run of the program.
pub(super) struct Predictor {
    args: ModelArgs,
    bundle_name: String,
    generator: Option<Generator>,
    mask_model: Option<MaskModel>,
}

impl Predictor {
    /// Nothing is loaded yet.
    pub(super) fn new(args: &ModelArgs) -> Self {
        Self { args: args.clone(), bundle_name: String::new(), generator: None, mask_model: None }
    }

    fn choice(&self) -> EngineChoice {
        self.args.runtime.choice()
    }

    /// The bundle in the named folder, else the first one found that fits.
    fn bundle(named: Option<&PathBuf>, kind: &str, fits: fn(&Bundle) -> bool) -> anyhow::Result<Bundle> {
        if let Some(dir) = named {
            return Ok(Bundle::open(dir)?);
        }
        let found = find(&default_roots());
        found.bundles.into_iter().find(fits).ok_or_else(|| {
            let refused: Vec<String> =
                found.problems.iter().map(|p| format!("\n- {}: {}", p.file.display(), p.what)).collect();
            anyhow::anyhow!("no {kind} bundle was found; name one with an option{}", refused.concat())
        })
    }

    /// The generator, loaded at the first call.
    pub(super) fn generator(&mut self) -> anyhow::Result<&mut Generator> {
        if self.generator.is_none() {
            let bundle = Self::bundle(self.args.bundle.as_ref(), "generator", |b| b.generator().is_some())?;
            self.bundle_name = bundle.name().to_owned();
            self.generator = Some(Generator::open(&bundle, self.choice())?);
        }
        Ok(self.generator.as_mut().expect("it was just loaded"))
    }

    /// The name of the generator's bundle; empty before it is loaded.
    pub(super) fn bundle_name(&self) -> &str {
        &self.bundle_name
    }

    /// The bundle's defaults with what the command line says instead.
    pub(super) fn config(&mut self) -> anyhow::Result<GenerateConfig> {
        let args = self.args.clone();
        let defaults = self.generator()?.spec().defaults;
        Ok(GenerateConfig {
            steps: args.steps.unwrap_or(defaults.steps),
            seed: args.seed.unwrap_or(defaults.seed),
            eta: args.eta.unwrap_or(defaults.eta),
            sampler: args.sampler.unwrap_or(defaults.sampler),
            ..defaults
        })
    }

    /// The reading of the decoder's output.
    pub(super) fn shift(&self) -> ShiftMode {
        self.args.shift.mode()
    }

    /// Predicted imprints (metres, raw orientation) of the fingers that have a GelSlim image.
    pub(super) fn imprints(&mut self, sample: &Sample) -> anyhow::Result<[Option<DepthMap>; 2]> {
        let config = self.config()?;
        let shift = self.shift();
        let generator = self.generator()?;
        let mut out = [None, None];
        for finger in Finger::BOTH {
            if let Some(gelslim) = sample.finger(finger).and_then(|t| t.gelslim.as_ref()) {
                let raw = generator.generate(&gelslim.difference, &config, &mut |_| ControlFlow::Continue(()))?;
                out[finger.index()] = Some(generator.depth(&raw, shift)?);
            }
        }
        Ok(out)
    }

    /// The mask model's contact mask of an imprint.
    pub(super) fn mask(&mut self, imprint: &DepthMap) -> anyhow::Result<Mask> {
        if self.mask_model.is_none() {
            let named = self.args.mask_bundle.as_ref();
            let bundle = Self::bundle(named, "mask model", |b| b.mask_unet().is_some())?;
            self.mask_model = Some(MaskModel::open(&bundle, self.choice())?);
        }
        Ok(self.mask_model.as_mut().expect("it was just loaded").predict(imprint)?)
    }
}
