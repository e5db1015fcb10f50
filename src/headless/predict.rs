//! The options and models that `generate` and `pose` share. Models are loaded when first needed.

mod args;

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

use super::contact_mask::MaskArgs;
use touch2touch_core::contact::ContactMask;
use touch2touch_core::dataset::Problem;
use touch2touch_core::diffusion::{GenerateConfig, Spacing};
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::postprocess::{DepthChain, ShiftMode};
use touch2touch_core::rig::{PadId, PerPad, Rig, SensorId};
use touch2touch_core::sample::{PadTouch, Sample};
use touch2touch_work::bundles::{self, BundleInfo, BundleKind, FoundBundles};
use touch2touch_work::error::TaskError;
use touch2touch_work::imprint::{self, chain_of, imprints_of};
use touch2touch_work::infer::bundle::Ends;
use touch2touch_work::infer::engine::{EngineChoice, resolve};
use touch2touch_work::job::JobCx;
use touch2touch_work::labels::{ImprintOf, ImprintSource};
use touch2touch_work::mask::{Contact, MaskChoice, MaskInputs, MaskSource};
use touch2touch_work::models::{Masking, Models, Wanted};
use touch2touch_work::predict::Generating;
use touch2touch_work::prediction::Prediction;
use touch2touch_work::tuning::unfinished_folder;

use args::SpacingArg;
pub(super) use args::{MappingArgs, ModelArgs, RuntimeArg};

/// The models of one run of the program, as the arguments want them.
pub(super) struct Predictor {
    args: ModelArgs,
    models: Models,
    found: Option<FoundBundles>,
    generator: Option<BundleInfo>,
    mask_model: Option<BundleInfo>,
    /// How the generator's output becomes meters.
    shift: Option<ShiftMode>,
    /// The sensors of the data.
    rig: Arc<Rig>,
    /// Where the generator starts and ends in them.
    ends: Option<Ends>,
}

impl Predictor {
    /// Forgets everything that was loaded: a bug may have left it half changed.
    pub(super) fn recover(&mut self) {
        *self = Self::new(&self.args.clone(), &self.rig.clone());
    }

    /// For data of these sensors. Nothing is looked for yet.
    pub(super) fn new(args: &ModelArgs, rig: &Arc<Rig>) -> Self {
        let store = if args.no_cache { None } else { super::cache::store() };
        Self {
            args: args.clone(),
            models: Models::new(store),
            found: None,
            generator: None,
            mask_model: None,
            shift: None,
            rig: rig.clone(),
            ends: None,
        }
    }

    fn take(&mut self, kind: BundleKind, named: Option<PathBuf>) -> Result<BundleInfo, TaskError> {
        self.found.get_or_insert_with(|| bundles::find(&[])).take(kind, named.as_deref(), &self.rig)
    }

    /// The generator's bundle, looked for at the first call.
    pub(super) fn bundle(&mut self) -> anyhow::Result<&BundleInfo> {
        if self.generator.is_none() {
            let bundle = self.take(BundleKind::Generator, self.args.bundle.clone())?;
            self.ends = bundle.ends(&self.rig).transpose()?;
            self.shift = Some(self.args.mapping.mode(Some((&bundle.name, &bundle.id)))?);
            self.generator = Some(bundle);
        }
        Ok(self.generator.as_ref().expect("it was just found"))
    }

    /// The picture of a touch that the generator starts from; `None` where the touch has no such reading.
    pub(super) fn condition<'a>(&mut self, touch: &'a PadTouch) -> anyhow::Result<Option<Cow<'a, RgbGrid>>> {
        self.bundle()?;
        Ok(self.ends.and_then(|ends| touch.picture(ends.input)))
    }

    /// The sensor that the generator starts from; call it after [`Self::bundle`].
    pub(super) fn input(&self) -> Option<SensorId> {
        self.ends.map(|ends| ends.input)
    }

    /// What to say where no touch has it.
    pub(super) fn no_condition(&self) -> anyhow::Error {
        let sensor = self.ends.and_then(|ends| self.rig.sensor(ends.input));
        anyhow::anyhow!("no {} image", sensor.map_or("GelSlim", |sensor| &sensor.name))
    }

    /// That the generator was fitted to other data than this sample.
    pub(super) fn misgiving(&mut self, sample: &Sample) -> anyhow::Result<Option<Problem>> {
        let bundle = self.bundle()?;
        Ok(bundle.misgiving(sample).map(|what| Problem {
            file: bundle.origin.path(),
            what,
            hint: "name another bundle, or switch the fit off with --fit-parts none".into(),
        }))
    }

    /// Where a run that is stopped is kept; nowhere with `--no-cache`.
    pub(super) fn unfinished(&self) -> Option<PathBuf> {
        if self.args.no_cache { None } else { unfinished_folder() }
    }

    /// The models themselves.
    pub(super) fn models(&self) -> &Models {
        &self.models
    }

    /// The engine that runs the models.
    pub(super) fn engine(&self) -> EngineChoice {
        self.args.runtime.choice()
    }

    /// The engine's name for people.
    pub(super) fn engine_label(&self) -> anyhow::Result<&'static str> {
        Ok(resolve(self.engine())?.label())
    }

    /// The bundle's defaults with what the command line says instead.
    pub(super) fn config(&mut self) -> anyhow::Result<GenerateConfig> {
        let args = self.args.clone();
        let bundle = self.bundle()?;
        let Some(info) = &bundle.generator else { anyhow::bail!("the bundle {} is no generator", bundle.name) };
        let preset = args.preset.config(info.defaults, info.training_steps);
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
        bundle.check_guidance(config.guidance)?;
        Ok(config)
    }

    /// Predictions of the pictures that the generator starts from, in their order. What was made before is not made
    /// again.
    pub(super) fn predict(&mut self, differences: &[&RgbGrid], cx: &JobCx) -> anyhow::Result<Vec<Prediction>> {
        let config = self.config()?;
        let wanted = |difference| Wanted { difference, seed: config.seed, size: [0, 0] };
        let wanted: Vec<Wanted<'_>> = differences.iter().copied().map(wanted).collect();
        self.predict_wanted(&wanted, cx)
    }

    /// One image with several seeds.
    pub(super) fn predict_seeds(&mut self, difference: &RgbGrid, seeds: &[u64]) -> anyhow::Result<Vec<Prediction>> {
        let wanted = |&seed: &u64| Wanted { difference, seed, size: [0, 0] };
        self.predict_wanted(&seeds.iter().map(wanted).collect::<Vec<_>>(), &JobCx::unwatched())
    }

    fn predict_wanted(&mut self, wanted: &[Wanted<'_>], cx: &JobCx) -> anyhow::Result<Vec<Prediction>> {
        let config = self.config()?;
        let bundle = self.bundle()?.clone();
        Ok(self.models.predict(&bundle, self.engine(), &config, wanted, cx)?)
    }

    /// The prediction of one picture, as [`Self::predict`].
    pub(super) fn predict_one(&mut self, difference: &RgbGrid) -> anyhow::Result<Prediction> {
        let made = self.predict(&[difference], &JobCx::unwatched())?.pop();
        made.ok_or_else(|| anyhow::anyhow!("the generator gave no prediction"))
    }

    /// Loads the models that a touch needs and runs them once; see [`Models::warm_up`].
    pub(super) fn warm_up(&mut self, choice: &MaskChoice) -> anyhow::Result<()> {
        let (config, bundle) = (self.config()?, self.bundle()?.clone());
        let made = self.models.warm_up(&bundle, self.engine(), &config)?;
        if let Some(model) = self.mask_model(choice)? {
            self.models.mask(&model, self.engine(), &imprint::imprint(&made, self.shift(), [0, 0])?, None)?;
        }
        Ok(())
    }

    /// The reading of the decoder's output; call it after [`Self::bundle`].
    pub(super) fn shift(&self) -> ShiftMode {
        // Without a generator nothing is read by it; what was asked for is still said.
        self.shift.unwrap_or_else(|| self.args.mapping.mode(None).unwrap_or_default())
    }

    /// The way to meters that a bundle offers for a reading, or why it offers none.
    pub(super) fn chain(&mut self, mode: ShiftMode) -> anyhow::Result<DepthChain> {
        let bundle = self.bundle()?.clone();
        let chains = self.models.chains(&bundle)?;
        Ok(chain_of(&chains, &bundle.id, mode)?)
    }

    /// The imprints of a pair (meters, raw orientation): measured, or predicted from what the generator starts from.
    pub(super) fn imprints(
        &mut self,
        sample: &Sample,
        source: ImprintSource,
        cx: &JobCx,
    ) -> anyhow::Result<PerPad<DepthMap>> {
        if source == ImprintSource::Measured {
            return Ok(imprint::measured(sample));
        }
        let made = self.predictions(sample, cx)?;
        self.in_meters(sample, &made)
    }

    /// What the imprints of [`Self::imprints`] are, for masks that were drawn on them.
    pub(super) fn of(&mut self, source: ImprintSource) -> anyhow::Result<ImprintOf> {
        if source == ImprintSource::Measured {
            return Ok(ImprintOf::Measured);
        }
        let (config, id) = (self.config()?, self.bundle()?.id.clone());
        Ok(ImprintOf::predicted(&id, &config, self.shift()))
    }

    /// The predictions of a pair's touches.
    pub(super) fn predictions(&mut self, sample: &Sample, cx: &JobCx) -> anyhow::Result<PerPad<Prediction>> {
        let (config, engine, bundle) = (self.config()?, self.engine(), self.bundle()?.clone());
        Ok(Generating { bundle: &bundle, engine, config: &config }.pair(&self.models, sample, cx)?)
    }

    /// Predictions of a pair's touches in meters, as large as its imprints.
    pub(super) fn in_meters(&self, sample: &Sample, made: &PerPad<Prediction>) -> anyhow::Result<PerPad<DepthMap>> {
        Ok(imprints_of(made, self.shift(), sample)?)
    }

    /// The mask model, looked for where the choice takes one; `None` where none is found and none was named.
    pub(super) fn mask_model(&mut self, choice: &MaskChoice) -> anyhow::Result<Option<BundleInfo>> {
        if self.mask_model.is_none() && matches!(choice.source, MaskSource::Auto | MaskSource::Unet) {
            let named = self.args.mask_bundle.clone();
            let may_lack = named.is_none() && choice.source == MaskSource::Auto;
            self.mask_model = match self.take(BundleKind::Mask, named) {
                Err(_) if may_lack => None,
                found => Some(found?),
            };
        }
        Ok(self.mask_model.clone())
    }

    /// Imprints with their contact masks.
    pub(super) fn contact(
        &mut self,
        args: &MaskArgs,
        imprints: PerPad<DepthMap>,
        inputs: MaskInputs<'_>,
    ) -> anyhow::Result<Contact> {
        let (choice, engine) = (args.choice(), self.engine());
        let model = self.mask_model(&choice)?;
        Ok(self.models.contact(Masking { choice, model: model.as_ref(), engine }, imprints, inputs)?)
    }

    /// The contact mask of one pad's imprint.
    pub(super) fn contact_mask(
        &mut self,
        args: &MaskArgs,
        imprint: &DepthMap,
        pad: PadId,
        inputs: MaskInputs<'_>,
    ) -> anyhow::Result<ContactMask> {
        let (choice, engine) = (args.choice(), self.engine());
        let model = self.mask_model(&choice)?;
        Ok(self.models.contact_mask(Masking { choice, model: model.as_ref(), engine }, imprint, pad, inputs)?)
    }
}
