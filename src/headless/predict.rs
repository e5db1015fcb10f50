//! The options and models that `generate` and `pose` share. Models are loaded when first needed.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use strum::IntoEnumIterator as _;

use crate::domain::diffusion::{GUIDANCE, GenerateConfig, Preset, Sampler, Spacing};
use crate::domain::grid::{DepthMap, Mask, RgbGrid};
use crate::domain::postprocess::{RawPrediction, RefitShift, ShiftMode};
use crate::domain::sample::Sample;
use crate::domain::sensor::Finger;
use crate::infer::bundle::{Bundle, find_all};
use crate::infer::engine::{EngineChoice, resolve};
use crate::infer::generator::Generator;
use crate::infer::mask::MaskModel;
use crate::infer::recipe::{Recipe, input_digest};
use crate::infer::store::Store;
use crate::io::statistics::ShiftStatistics;

/// Which models, and how they are run.
#[derive(Debug, Clone, Args)]
pub(super) struct ModelArgs {
    /// The generator's bundle (default: the shipped one).
    #[arg(long)]
    bundle: Option<PathBuf>,
    /// The mask model's bundle (default: the shipped one).
    #[arg(long)]
    mask_bundle: Option<PathBuf>,
    /// How good: `fast` (one step), `default` (what the bundle recommends) or `sharp` (50 steps). The options below
    /// change single numbers of it.
    #[arg(long, value_parser = PossibleValuesParser::new(Preset::iter().map(Preset::key)).map(preset), default_value = "default")]
    preset: Preset,
    /// Sampling steps (default: the preset's).
    #[arg(long)]
    steps: Option<u32>,
    /// Seed of the noise (default: the bundle's).
    #[arg(long)]
    seed: Option<u64>,
    /// Share of fresh noise per step, 0 to 1, for DDIM (default: the preset's).
    #[arg(long)]
    eta: Option<f64>,
    /// Scale of classifier-free guidance, 1 for none; only for a bundle that was trained for it (default: the bundle's).
    #[arg(long, value_parser = guidance)]
    guidance: Option<f64>,
    /// The training steps visited: `trailing` starts at the noisiest, `lab` is the public release's (default: the
    /// preset's).
    #[arg(long, value_enum)]
    spacing: Option<SpacingArg>,
    /// The way from noise to an image (default: the preset's).
    #[arg(long, value_parser = PossibleValuesParser::new(Sampler::iter().map(Sampler::key)).map(sampler))]
    sampler: Option<Sampler>,
    /// How the decoder's output becomes metres.
    #[arg(long, value_enum, default_value_t = AnyShiftArg::Exact)]
    shift: AnyShiftArg,
    /// The statistics for `--shift refit`, made by `touch2touch stats` with the same bundle.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// The engine that runs the models.
    #[arg(long, value_enum, default_value_t = RuntimeArg::Auto)]
    runtime: RuntimeArg,
    /// Neither look for predictions that were made before (by the studio, too), nor keep those made now.
    #[arg(long)]
    no_cache: bool,
}

/// Of a key that the parser has already compared with the list.
fn preset(key: String) -> Preset {
    key.parse().unwrap_or_default()
}

fn guidance(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|scale| GUIDANCE.contains(scale));
    value.ok_or_else(|| format!("choose {} to {}; 1 is none", GUIDANCE.start(), GUIDANCE.end()))
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum SpacingArg {
    /// From the noisiest training step on.
    Trailing,
    /// The public latent-diffusion release's.
    Lab,
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

/// [`ShiftArg`] where statistics of a dataset can be named.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum AnyShiftArg {
    /// What the lab's released script saves: its range is mapped twice.
    Raw,
    /// The paper's mean-and-deviation shift of that.
    Paper,
    /// The doubled mapping undone exactly.
    Exact,
    /// The paper's shift by the statistics of a dataset (see --stats).
    Refit,
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

/// The bundle in the named folder, else the first one found that fits.
pub(super) fn find_bundle(named: Option<&PathBuf>, kind: &str, fits: fn(&Bundle) -> bool) -> anyhow::Result<Bundle> {
    if let Some(dir) = named {
        return Ok(Bundle::open(dir)?);
    }
    let found = find_all(&[]);
    if let Some(bundle) = found.bundles.into_iter().find(fits) {
        return Ok(bundle);
    }
    // A build that cannot run models says that, and not that it found none.
    resolve(EngineChoice::Auto)?;
    let refused: Vec<String> = found.problems.iter().map(|p| format!("\n- {}: {}", p.file.display(), p.what)).collect();
    anyhow::bail!("no {kind} bundle was found; name one with an option{}", refused.concat())
}

/// The models of one run of the program.
pub(super) struct Predictor {
    args: ModelArgs,
    bundle_name: String,
    bundle_hash: String,
    refit: Option<RefitShift>,
    generator: Option<Generator>,
    mask_model: Option<MaskModel>,
    store: Option<Store>,
}

/// A predicted picture, and whether it was made before.
pub(super) struct Made {
    pub(super) raw: RawPrediction,
    pub(super) kept: bool,
}

impl Predictor {
    /// Nothing is loaded yet.
    pub(super) fn new(args: &ModelArgs) -> Self {
        let store = if args.no_cache { None } else { super::cache::store() };
        Self {
            args: args.clone(),
            bundle_name: String::new(),
            bundle_hash: String::new(),
            refit: None,
            generator: None,
            mask_model: None,
            store,
        }
    }

    fn choice(&self) -> EngineChoice {
        self.args.runtime.choice()
    }

    /// The generator, loaded at the first call.
    pub(super) fn generator(&mut self) -> anyhow::Result<&mut Generator> {
        if self.generator.is_none() {
            let bundle = find_bundle(self.args.bundle.as_ref(), "generator", |b| b.generator().is_some())?;
            self.refit = self.read_refit(&bundle)?;
            self.bundle_name = bundle.name().to_owned();
            self.bundle_hash = bundle.hash().to_owned();
            self.generator = Some(Generator::open(&bundle, self.choice())?);
        }
        Ok(self.generator.as_mut().expect("it was just loaded"))
    }

    /// The statistics for the refit shift, which must be of this bundle.
    fn read_refit(&self, bundle: &Bundle) -> anyhow::Result<Option<RefitShift>> {
        match (&self.args.stats, self.args.shift) {
            (Some(file), AnyShiftArg::Refit) => {
                Ok(Some(ShiftStatistics::read(file)?.shift_for(bundle.name(), bundle.hash())?))
            }
            (None, AnyShiftArg::Refit) => {
                anyhow::bail!("--shift refit needs --stats FILE; make the file with `touch2touch stats`")
            }
            (Some(_), _) => anyhow::bail!("--stats is for --shift refit; add that, or leave the statistics out"),
            (None, _) => Ok(None),
        }
    }

    /// The hash of the generator's bundle; empty before it is loaded.
    pub(super) fn bundle_hash(&self) -> &str {
        &self.bundle_hash
    }

    /// The name of the generator's bundle; empty before it is loaded.
    pub(super) fn bundle_name(&self) -> &str {
        &self.bundle_name
    }

    /// The bundle's defaults with what the command line says instead.
    pub(super) fn config(&mut self) -> anyhow::Result<GenerateConfig> {
        let args = self.args.clone();
        let generator = self.generator()?;
        let spec = generator.spec();
        let preset = args.preset.config(spec.defaults, spec.schedule.training_steps());
        let spacing = args.spacing.map(|spacing| match spacing {
            SpacingArg::Trailing => Spacing::Trailing,
            SpacingArg::Lab => Spacing::Lab,
        });
        let config = GenerateConfig {
            steps: args.steps.unwrap_or(preset.steps),
            seed: args.seed.unwrap_or(preset.seed),
            eta: args.eta.unwrap_or(preset.eta),
            sampler: args.sampler.unwrap_or(preset.sampler),
            spacing: spacing.unwrap_or(preset.spacing),
            guidance: args.guidance.unwrap_or(preset.guidance),
        };
        // Said once, before the first pair, rather than for every pair.
        generator.check_guidance(&config)?;
        Ok(config)
    }

    /// Predictions of GelSlim difference images, all in one batch, in their order. What was made before is not made
    /// again.
    pub(super) fn predict(&mut self, differences: &[&RgbGrid]) -> anyhow::Result<Vec<Made>> {
        let config = self.config()?;
        let store = self.store.take();
        let made = self.predict_with(store.as_ref(), differences, &config);
        self.store = store;
        made
    }

    /// The prediction of one GelSlim difference image, as [`Self::predict`].
    pub(super) fn predict_one(&mut self, difference: &RgbGrid) -> anyhow::Result<RawPrediction> {
        let mut made = self.predict(&[difference])?;
        made.pop().map(|made| made.raw).ok_or_else(|| anyhow::anyhow!("the generator gave no prediction"))
    }

    fn predict_with(
        &mut self,
        store: Option<&Store>,
        differences: &[&RgbGrid],
        config: &GenerateConfig,
    ) -> anyhow::Result<Vec<Made>> {
        let generator = self.generator()?;
        let key = |difference: &RgbGrid| generator.recipe(input_digest(difference), config);
        let keys: Vec<Recipe> = differences.iter().map(|difference| key(difference)).collect();
        let mut found: Vec<Option<Made>> = keys
            .iter()
            .map(|key| store.and_then(|store| store.get(key)).map(|stored| Made { raw: stored.raw, kept: true }))
            .collect();
        let fresh: Vec<usize> = (0..keys.len()).filter(|at| found[*at].is_none()).collect();
        let images: Vec<&RgbGrid> = fresh.iter().map(|at| differences[*at]).collect();
        let start = Instant::now();
        let made = generator.generate_batch(&images, config, &mut |_| ControlFlow::Continue(()))?;
        let each = start.elapsed().as_secs_f64() / fresh.len().max(1) as f64;
        for (at, raw) in fresh.into_iter().zip(made) {
            if let Some(store) = store
                && let Err(err) = store.put(&keys[at], &raw, each)
            {
                log::warn!("a prediction could not be kept: {err}: {}", store.folder().display());
            }
            found[at] = Some(Made { raw, kept: false });
        }
        Ok(found.into_iter().flatten().collect())
    }

    /// The reading of the decoder's output; call it after [`Self::generator`].
    pub(super) fn shift(&self) -> ShiftMode {
        match self.args.shift {
            AnyShiftArg::Refit => ShiftMode::Refit(self.refit.expect("read with the bundle")),
            AnyShiftArg::Raw => ShiftMode::Raw,
            AnyShiftArg::Paper => ShiftMode::PaperShift,
            AnyShiftArg::Exact => ShiftMode::ExactInverse,
        }
    }

    /// Predicted imprints (metres, raw orientation) of the fingers that have a GelSlim image.
    pub(super) fn imprints(&mut self, sample: &Sample) -> anyhow::Result<[Option<DepthMap>; 2]> {
        let shift = self.shift();
        let gelslim = |finger| sample.finger(finger).and_then(|t| t.gelslim.as_ref());
        let fingers: Vec<Finger> = Finger::BOTH.into_iter().filter(|finger| gelslim(*finger).is_some()).collect();
        let differences: Vec<&RgbGrid> = fingers.iter().filter_map(|f| Some(&gelslim(*f)?.difference)).collect();
        let made = self.predict(&differences)?;
        let mut out = [None, None];
        for (finger, made) in fingers.into_iter().zip(made) {
            out[finger.index()] = Some(self.generator()?.depth(&made.raw, shift)?);
        }
        Ok(out)
    }

    /// Loads the mask model, if it is not there yet.
    pub(super) fn load_mask_model(&mut self) -> anyhow::Result<&mut MaskModel> {
        if self.mask_model.is_none() {
            let named = self.args.mask_bundle.as_ref();
            let bundle = find_bundle(named, "mask model", |b| b.mask_unet().is_some())?;
            self.mask_model = Some(MaskModel::open(&bundle, self.choice())?);
        }
        Ok(self.mask_model.as_mut().expect("it was just loaded"))
    }

    /// The mask model's contact mask of an imprint.
    pub(super) fn mask(&mut self, imprint: &DepthMap) -> anyhow::Result<Mask> {
        Ok(self.load_mask_model()?.predict(imprint)?)
    }
}
