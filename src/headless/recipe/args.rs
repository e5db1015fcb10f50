//! Models, and how they are run, as the command line says it.

use std::cell::OnceCell;
use std::path::PathBuf;
use std::rc::Rc;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::super::args::{RegistrationArgs, keyed};
use super::super::contact_mask::MaskArgs;
use touch2touch_core::diffusion::{Sampler, Spacing};
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::steps::bundles::{self, BundleKind, FoundBundles};
use touch2touch_pipeline::steps::recipe::ShiftChoice;

/// Models, and how they are run.
#[derive(Debug, Clone, Args)]
pub struct ModelArgs {
    /// The generator's bundle (default: the shipped one).
    #[arg(long)]
    pub(super) bundle: Option<PathBuf>,
    /// The mask model's bundle (default: the shipped one).
    #[arg(long)]
    pub(super) mask_bundle: Option<PathBuf>,
    /// Sampling steps (default: the bundle's, also for the options that follow).
    #[arg(long)]
    pub(super) steps: Option<u32>,
    /// Seed of the noise.
    #[arg(long)]
    pub(super) seed: Option<u64>,
    /// Fresh noise that DDIM adds per step, 0 to 1.
    #[arg(long)]
    pub(super) eta: Option<f64>,
    /// Spacing of the sampling steps: `trailing` starts at the noisiest one, `lab` is that of the public release.
    #[arg(long, value_parser = keyed::<Spacing>())]
    pub(super) spacing: Option<Spacing>,
    /// Sampler: the algorithm from noise to an image.
    #[arg(long, value_parser = keyed::<Sampler>())]
    pub(super) sampler: Option<Sampler>,
    #[command(flatten)]
    pub(super) mapping: MappingArgs,
    #[command(flatten)]
    pub(super) runtime: RuntimeArg,
    /// Predict everything anew and keep nothing: ignores earlier predictions, also those of the studio.
    #[arg(long)]
    pub(super) no_cache: bool,
    /// The bundles that are there, looked for when first needed.
    #[arg(skip)]
    pub(super) found: Rc<OnceCell<FoundBundles>>,
}

/// The options that decide a result up to the pose.
#[derive(Debug, Clone, Args)]
pub(in crate::headless) struct RecipeArgs {
    #[command(flatten)]
    pub(in crate::headless) mask: MaskArgs,
    #[command(flatten)]
    pub(in crate::headless) registration: RegistrationArgs,
    #[command(flatten)]
    pub(in crate::headless) model: ModelArgs,
}

impl ModelArgs {
    /// Arguments with another generator, named by its folder, or as it calls itself.
    pub(in crate::headless) fn with_generator(&self, name: &str) -> Self {
        let found = self.found.get_or_init(|| bundles::find(&[]));
        let named = found.bundles.iter().find(|b| b.kind == BundleKind::Generator && b.name == *name);
        let bundle = Some(named.map_or_else(|| PathBuf::from(name), |bundle| bundle.origin.path()));
        Self { bundle, ..self.clone() }
    }

    /// Arguments with the mapping that is there without options: for what names its own.
    pub(in crate::headless) fn without_mapping(&self) -> Self {
        Self { mapping: MappingArgs { shift: ShiftChoice::default() }, ..self.clone() }
    }
}

/// Mapping of the decoder's output to meters, as the command line says it.
#[derive(Debug, Clone, Args)]
pub(in crate::headless) struct MappingArgs {
    /// Mapping of the decoder's output to meters: `exact` (the doubled mapping undone, with the fit of a fitted bundle, or
    /// by `exact:PARTS` with none of it or some of offset, field, gain, response), `paper` (the paper's mean-and-deviation
    /// shift), `raw` (as the lab's released script saves it), or `refit:FILE` (the paper's shift by the statistics that
    /// `touch2touch stats` wrote with the same bundle).
    #[arg(long, value_name = "SHIFT", default_value = "exact")]
    pub(in crate::headless) shift: ShiftChoice,
}

/// The engine that runs the models, as the command line says it.
#[derive(Debug, Clone, Copy, Args)]
pub struct RuntimeArg {
    /// Engine that runs the models: ONNX Runtime where its library is found, on a GPU that it can use, else on the processor, else
    /// the built-in engine (`auto`); the built-in engine (`rten`); ONNX Runtime on the processor (`ort`); or on what a
    /// provider of it stands for (`touch2touch runtime` lists them).
    #[arg(long = "runtime", value_name = "RUNTIME", default_value = "auto", value_parser = choices())]
    choice: EngineChoice,
}

fn choices() -> impl TypedValueParser<Value = EngineChoice> {
    PossibleValuesParser::new(EngineChoice::all().map(EngineChoice::key)).try_map(|key| key.parse::<EngineChoice>())
}

impl RuntimeArg {
    /// The choice for the engines.
    pub fn choice(self) -> EngineChoice {
        self.choice
    }
}
