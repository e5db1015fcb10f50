//! The options and models that `generate` and `pose` share. Models are loaded when first needed.

use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::domain::diffusion::GenerateConfig;
use crate::domain::grid::{DepthMap, Mask};
use crate::domain::postprocess::ShiftMode;
use crate::domain::sample::Sample;
use crate::domain::sensor::Finger;
use crate::infer::bundle::{Bundle, BundleKind, find_shipped};
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
    /// Share of fresh noise per step, 0 to 1 (default: the bundle's).
    #[arg(long)]
    eta: Option<f64>,
    /// How the decoder's output becomes metres.
    #[arg(long, value_enum, default_value_t = ShiftArg::Exact)]
    shift: ShiftArg,
    /// The engine that runs the models.
    #[arg(long, value_enum, default_value_t = RuntimeArg::Auto)]
    runtime: RuntimeArg,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ShiftArg {
    /// What the lab's released script saves: its range is mapped twice.
    Raw,
    /// The paper's mean-and-deviation shift of that.
    Paper,
    /// The doubled mapping undone exactly.
    Exact,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum RuntimeArg {
    /// ONNX Runtime where its library is found, else the built-in engine.
    Auto,
    /// The built-in engine.
    Rten,
    /// ONNX Runtime.
    Ort,
}

/// The models of one run of the program.
pub(super) struct Predictor {
    args: ModelArgs,
    generator: Option<Generator>,
    mask_model: Option<MaskModel>,
}

impl Predictor {
    /// Nothing is loaded yet.
    pub(super) fn new(args: &ModelArgs) -> Self {
        Self { args: args.clone(), generator: None, mask_model: None }
    }

    fn choice(&self) -> EngineChoice {
        match self.args.runtime {
            RuntimeArg::Auto => EngineChoice::Auto,
            RuntimeArg::Rten => EngineChoice::Rten,
            RuntimeArg::Ort => EngineChoice::Ort,
        }
    }

    fn bundle(&self, kind: BundleKind) -> anyhow::Result<Bundle> {
        let named = match kind {
            BundleKind::Generator => self.args.bundle.as_ref(),
            BundleKind::MaskUnet => self.args.mask_bundle.as_ref(),
        };
        match named {
            Some(dir) => Ok(Bundle::open(dir)?),
            None => Ok(find_shipped(kind)?),
        }
    }

    /// The generator, loaded at the first call.
    pub(super) fn generator(&mut self) -> anyhow::Result<&mut Generator> {
        if self.generator.is_none() {
            self.generator = Some(Generator::open(&self.bundle(BundleKind::Generator)?, self.choice())?);
        }
        Ok(self.generator.as_mut().expect("it was just loaded"))
    }

    /// The bundle's defaults with what the command line says instead.
    pub(super) fn config(&mut self) -> anyhow::Result<GenerateConfig> {
        let args = self.args.clone();
        let defaults = self.generator()?.spec().defaults;
        Ok(GenerateConfig {
            steps: args.steps.unwrap_or(defaults.steps),
            seed: args.seed.unwrap_or(defaults.seed),
            eta: args.eta.unwrap_or(defaults.eta),
            ..defaults
        })
    }

    /// The reading of the decoder's output.
    pub(super) fn shift(&self) -> ShiftMode {
        match self.args.shift {
            ShiftArg::Raw => ShiftMode::Raw,
            ShiftArg::Paper => ShiftMode::PaperShift,
            ShiftArg::Exact => ShiftMode::ExactInverse,
        }
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
            self.mask_model = Some(MaskModel::open(&self.bundle(BundleKind::MaskUnet)?, self.choice())?);
        }
        Ok(self.mask_model.as_mut().expect("it was just loaded").predict(imprint)?)
    }
}
