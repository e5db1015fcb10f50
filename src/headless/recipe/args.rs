//! Models, and how they are run, as the command line says it.

use std::cell::OnceCell;
use std::path::PathBuf;
use std::rc::Rc;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use strum::IntoEnumIterator as _;

use super::super::args::keyed;
use touch2touch_core::diffusion::{GUIDANCE, Preset, Sampler};
use touch2touch_core::postprocess::{CorrectionPart, CorrectionParts, ShiftMode};
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
    /// Quality: `fast` (one step), `default` (what the bundle recommends) or `sharp` (50 steps). The options below
    /// change single numbers of it.
    #[arg(long, value_parser = keyed::<Preset>(), default_value = Preset::default().key())]
    pub(super) preset: Preset,
    /// Sampling steps (default: the preset's).
    #[arg(long)]
    pub(super) steps: Option<u32>,
    /// Seed of the noise (default: the bundle's).
    #[arg(long)]
    pub(super) seed: Option<u64>,
    /// Share of fresh noise per step, 0 to 1, for DDIM (default: the preset's).
    #[arg(long)]
    pub(super) eta: Option<f64>,
    /// Scale of classifier-free guidance, 1 for none; only for a bundle that was trained for it (default: the bundle's).
    #[arg(long, value_parser = guidance)]
    pub(super) guidance: Option<f64>,
    /// The training steps visited: `trailing` starts at the noisiest, `lab` is the public release's (default: the
    /// preset's).
    #[arg(long, value_enum)]
    pub(super) spacing: Option<SpacingArg>,
    /// The way from noise to an image (default: the preset's).
    #[arg(long, value_parser = keyed::<Sampler>())]
    pub(super) sampler: Option<Sampler>,
    #[command(flatten)]
    pub(super) mapping: MappingArgs,
    #[command(flatten)]
    pub(super) runtime: RuntimeArg,
    /// Neither look for predictions that were made before (by the studio, too), nor keep those made now.
    #[arg(long)]
    pub(super) no_cache: bool,
    /// The bundles that are there, looked for when first needed.
    #[arg(skip)]
    pub(super) found: Rc<OnceCell<FoundBundles>>,
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
        let mapping = MappingArgs { shift: ShiftArg::Exact, fit_parts: CorrectionParts::ALL, stats: None };
        Self { mapping, ..self.clone() }
    }
}

fn fit_parts(text: &str) -> Result<CorrectionParts, String> {
    match text {
        "all" => Ok(CorrectionParts::ALL),
        "none" => Ok(CorrectionParts::NONE),
        list => {
            let part = |name: &str| {
                name.trim().parse::<CorrectionPart>().map_err(|_| {
                    let names: Vec<&str> = CorrectionPart::iter().map(Into::into).collect();
                    format!("\"{name}\" is no part of a fit; there are {}", names.join(", "))
                })
            };
            Ok(list.split(',').map(part).collect::<Result<Vec<_>, _>>()?.into())
        }
    }
}

pub(super) fn guidance(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|scale| GUIDANCE.contains(scale));
    value.ok_or_else(|| format!("choose {} to {}; 1 is none", GUIDANCE.start(), GUIDANCE.end()))
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum SpacingArg {
    /// From the noisiest training step on.
    Trailing,
    /// The public latent-diffusion release's.
    Lab,
}

/// Mapping of the decoder's output to meters, as the command line says it.
#[derive(Debug, Clone, Args)]
pub(in crate::headless) struct MappingArgs {
    /// Mapping of the decoder's output to meters.
    #[arg(long, value_enum, default_value_t = ShiftArg::Exact)]
    shift: ShiftArg,
    /// Parts of the fit of a bundle to a rig that are applied with `--shift exact`: `all`, `none`, or some of offset,
    /// field, gain, response, separated by commas.
    #[arg(long, value_name = "PARTS", default_value = "all", value_parser = fit_parts)]
    fit_parts: CorrectionParts,
    /// The statistics for `--shift refit`, made by `touch2touch stats` with the same bundle.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ShiftArg {
    /// Depth as the lab's released script saves it: its range is mapped twice.
    Raw,
    /// The paper's mean-and-deviation shift of that.
    Paper,
    /// The doubled mapping undone exactly.
    Exact,
    /// The paper's shift by the statistics of a data set (see --stats).
    Refit,
}

impl MappingArgs {
    /// The shift that is asked for.
    pub(super) fn choice(&self) -> anyhow::Result<ShiftChoice> {
        if self.shift != ShiftArg::Refit && self.stats.is_some() {
            anyhow::bail!("--stats is for --shift refit; add that, or leave the statistics out");
        }
        Ok(match (self.shift, &self.stats) {
            (ShiftArg::Raw, _) => ShiftChoice::Raw,
            (ShiftArg::Paper, _) => ShiftChoice::Paper,
            (ShiftArg::Exact, _) => ShiftChoice::Exact(self.fit_parts),
            (ShiftArg::Refit, Some(file)) => ShiftChoice::Refit(file.clone()),
            (ShiftArg::Refit, None) => {
                anyhow::bail!("--shift refit needs --stats FILE; make the file with `touch2touch stats`")
            }
        })
    }

    /// The shift; `bundle` is the generator's name and identity, or `None` where there are several.
    pub(in crate::headless) fn mode(&self, bundle: Option<(&str, &str)>) -> anyhow::Result<ShiftMode> {
        Ok(self.choice()?.mode(bundle)?)
    }
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
