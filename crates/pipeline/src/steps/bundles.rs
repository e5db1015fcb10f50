//! Model bundles as everything above knows them: [`BundleInfo`], found once, opened when a model is needed.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::TaskError;
use crate::infer::bundle::{self, Bundle, BundleSpec, Ends, Misfit, Origin, SensorPair};
use touch2touch_core::dataset::Problem;
use touch2touch_core::diffusion::{GenerateConfig, Sampler};
use touch2touch_core::fit::FitSource;
use touch2touch_core::rig::Rig;
use touch2touch_core::sample::Sample;

/// A model bundle that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct BundleInfo {
    /// Identity: the digest of what decides its results ([`Bundle::hash`]).
    pub id: Arc<str>,
    /// The name on screen.
    pub name: String,
    /// Kind of the bundle.
    pub kind: BundleKind,
    /// Origin: a folder, or the program.
    pub origin: Origin,
    /// Choices that a generator offers; `None` for another kind.
    pub generator: Option<GeneratorInfo>,
    /// True where the program trained it, on masks that people corrected.
    pub trained: bool,
}

/// The key of a bundle's provenance under which stands what the program trained it on.
pub(crate) const TRAINED: &str = "trained";

/// The choices that a generator's bundle leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct GeneratorInfo {
    /// Settings that the bundle recommends.
    pub defaults: GenerateConfig,
    /// The steps of its training: no more can be taken.
    pub training_steps: usize,
    /// The sensors between which it predicts.
    pub sensors: SensorPair,
    /// From what it was fitted to a rig, if it was.
    pub fit: Option<FitSource>,
}

impl GeneratorInfo {
    /// The recommended settings with those that are named instead. A bundle that draws in one step keeps its step.
    pub fn config(&self, steps: Option<u32>, seed: Option<u64>, sampler: Option<Sampler>) -> GenerateConfig {
        let own = self.defaults;
        GenerateConfig {
            steps: steps.filter(|_| own.steps > 1).unwrap_or(own.steps),
            seed: seed.unwrap_or(own.seed),
            sampler: sampler.unwrap_or(own.sampler),
            ..own
        }
    }
}

/// Kind of a bundle, by its task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BundleKind {
    /// Touch of one sensor to the touch that another would have felt.
    Generator,
    /// Imprint to contact mask.
    Mask,
    /// Imprint to tool.
    Classifier,
}

impl BundleKind {
    /// The name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Generator => "generator",
            Self::Mask => "mask model",
            Self::Classifier => "tool classifier",
        }
    }
}

impl BundleInfo {
    /// Description of an opened bundle.
    pub fn of(bundle: &Bundle) -> Self {
        Self {
            id: bundle.hash().into(),
            name: bundle.name().to_owned(),
            kind: match bundle.spec() {
                BundleSpec::Generator(_) => BundleKind::Generator,
                BundleSpec::MaskUnet(_) => BundleKind::Mask,
                BundleSpec::ToolClassifier(_) => BundleKind::Classifier,
            },
            origin: bundle.origin().clone(),
            generator: bundle.generator().map(|spec| GeneratorInfo {
                defaults: spec.defaults,
                training_steps: spec.schedule.training_steps(),
                sensors: spec.sensors(),
                fit: spec.fit.as_ref().map(|fit| fit.source.clone()),
            }),
            trained: bundle.provenance().get(TRAINED).is_some(),
        }
    }

    /// Sensors of `rig` at which the bundle starts and ends, if it is a generator; `None` for another kind of bundle.
    ///
    /// # Errors
    /// [`Misfit`].
    pub fn ends(&self, rig: &Rig) -> Option<Result<Ends, Misfit>> {
        Some(self.generator.as_ref()?.sensors.ends(&self.name, rig))
    }

    /// The bundle itself, if it is of a kind.
    ///
    /// # Errors
    /// If it is of another.
    pub fn of_kind(self, kind: BundleKind, what: &str) -> Result<Self, TaskError> {
        if self.kind == kind {
            return Ok(self);
        }
        let why = format!("the bundle is a {}, not a {} ({})", self.kind.name(), kind.name(), self.origin);
        Err(TaskError::new(what, why))
    }

    /// True where it was fitted to a rig.
    pub fn is_fitted(&self) -> bool {
        self.fit().is_some()
    }

    /// True where it was made with the program from another one, for one's own data: then it is used where it is named
    /// or chosen.
    pub fn is_own(&self) -> bool {
        self.is_fitted() || self.trained
    }

    /// Source of the fit, where it was fitted.
    pub fn fit(&self) -> Option<&FitSource> {
        self.generator.as_ref()?.fit.as_ref()
    }

    /// Why a generator that was fitted is not for this sample, in words.
    pub fn misgiving(&self, sample: &Sample) -> Option<String> {
        self.fit()?.misgiving(sample)
    }

    /// True where it can be used with the sensors of `rig`. Contact and tools are found in imprints of membranes.
    pub fn fits(&self, rig: &Rig) -> bool {
        self.ends(rig).map_or_else(|| !rig.is_gel(), |ends| ends.is_ok())
    }

    /// Opens it again. It must still be the same: its identity is part of every recipe.
    ///
    /// # Errors
    /// If it cannot be opened, or was changed since it was found.
    pub fn open(&self, what: &str) -> Result<Bundle, TaskError> {
        let checked = Bundle::open(&self.origin).map_err(|err| TaskError::from_error(what, &err))?;
        if checked.hash() == &*self.id {
            return Ok(checked);
        }
        let why = format!("the bundle was changed since it was found ({})", self.origin);
        Err(TaskError::new(what, why).with_hint("Start the program again."))
    }
}

/// The bundles that are there, and what is wrong with those that were refused.
#[derive(Clone, Debug, Default)]
pub struct FoundBundles {
    /// Usable bundles, in the order in which they are taken.
    pub bundles: Vec<BundleInfo>,
    /// Faults of the others.
    pub problems: Vec<Problem>,
}

/// The bundle that a stored identity names.
pub fn by_id<'a>(bundles: &'a [BundleInfo], id: &str) -> Option<&'a BundleInfo> {
    bundles.iter().find(|bundle| *bundle.id == *id)
}

/// All bundles there are: those of the user, those in the program, and those in `folders`.
pub fn find(folders: &[PathBuf]) -> FoundBundles {
    let found = bundle::find_all(folders);
    FoundBundles { bundles: found.bundles.iter().map(BundleInfo::of).collect(), problems: found.problems }
}

/// The bundle in a folder or in the program.
///
/// # Errors
/// If it cannot be used.
pub fn open(what: &str, at: impl Into<Origin>) -> Result<BundleInfo, TaskError> {
    let opened = Bundle::open(at).map_err(|err| TaskError::from_error(what, &err))?;
    Ok(BundleInfo::of(&opened))
}

impl FoundBundles {
    /// The bundle in the named folder, else the first found of its kind that fits the sensors of `rig`.
    ///
    /// # Errors
    /// If the named one cannot be opened or is of another kind, or none was found; then with what was refused, and why.
    pub fn take(&self, kind: BundleKind, named: Option<&Path>, rig: &Rig) -> Result<BundleInfo, TaskError> {
        let what = format!("Look for a {}", kind.name());
        if let Some(folder) = named {
            return open(&what, folder)?.of_kind(kind, &what);
        }
        let fitting = || self.bundles.iter().filter(|bundle| bundle.kind == kind && bundle.fits(rig));
        // What was made for one's own data is used where it is named.
        let first = fitting().find(|bundle| !bundle.is_own()).or_else(|| fitting().next());
        first.cloned().ok_or_else(|| {
            let refused: Vec<String> =
                self.problems.iter().map(|p| format!("\n- {}: {}", p.file.display(), p.what)).collect();
            let why = format!("no {} bundle for {} was found{}", kind.name(), rig.name, refused.concat());
            TaskError::new(what, why).with_hint("Name one with an option, or put it into a folder of bundles.")
        })
    }
}
