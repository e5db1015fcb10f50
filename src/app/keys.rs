//! Recipes: what a result was made from. Equal recipes have equal results, so every cache is keyed by one.

use std::sync::Arc;

pub use crate::domain::bits::Bits;
pub use crate::domain::diffusion::{Preset, Sampler, Spacing};
pub use crate::domain::postprocess::ShiftMode;
pub use crate::work::labels::{ImprintSource, Revision};
pub use crate::work::mask::MaskRecipe;

use crate::domain::align::basin::Plane;
use crate::domain::dataset::PairId;
use crate::domain::diffusion::GenerateConfig;
use crate::domain::frames::PlanarPose;
use crate::domain::rig::{PadId, PerPad};
use crate::infer::engine::EngineChoice;

/// Counts the data sets opened since the start: results of an earlier one never reach a later one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DatasetSeq(pub u32);

/// A pair of one opening of a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PairKey {
    /// The opening.
    pub dataset: DatasetSeq,
    /// The pair in its index.
    pub pair: PairId,
}

impl PairKey {
    /// One finger of this pair.
    pub fn finger(self, finger: PadId) -> TouchKey {
        TouchKey { pair: self, finger }
    }
}

/// One finger of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TouchKey {
    /// The pair.
    pub pair: PairKey,
    /// The finger.
    pub finger: PadId,
}

/// What a range mapping does, for its tooltip.
pub fn shift_tooltip(mode: ShiftMode) -> &'static str {
    match mode {
        ShiftMode::Raw => "As the lab's generator stores it: the range is mapped twice, so depths are too large",
        ShiftMode::PaperShift => "Mean and spread matched to the training statistics, as the paper's pixel shift does",
        ShiftMode::ExactInverse => "The doubled range mapping undone exactly: meters",
        ShiftMode::Refit(_) => "Mean and spread matched to statistics of this data set's own predictions",
    }
}

/// Everything that decides a prediction.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PredictionKey {
    /// The touch whose GelSlim image is the condition.
    pub touch: TouchKey,
    /// The bundle's identity (its digest): a changed bundle is another recipe.
    pub bundle: Arc<str>,
    /// Denoising steps asked for.
    pub steps: u32,
    /// Seed of the noise.
    pub seed: u64,
    /// The sampler.
    pub sampler: Sampler,
    /// DDIM's noise share, 0..1.
    pub eta: Bits,
    /// The training steps visited.
    pub spacing: Spacing,
    /// Scale of the guidance; 1 is none.
    pub guidance: Bits,
    /// The model runtime: two of them round differently.
    pub runtime: EngineChoice,
}

impl PredictionKey {
    /// The recipe of a touch with a bundle, a runtime and the choices of one generation.
    pub fn new(touch: TouchKey, bundle: Arc<str>, runtime: EngineChoice, config: &GenerateConfig) -> Self {
        Self {
            touch,
            bundle,
            steps: config.steps,
            seed: config.seed,
            sampler: config.sampler,
            eta: (config.eta as f32).into(),
            spacing: config.spacing,
            guidance: (config.guidance as f32).into(),
            runtime,
        }
    }

    /// The choices of one generation.
    pub fn config(&self) -> GenerateConfig {
        GenerateConfig {
            steps: self.steps,
            eta: f64::from(self.eta.get()),
            seed: self.seed,
            sampler: self.sampler,
            spacing: self.spacing,
            guidance: f64::from(self.guidance.get()),
        }
    }
}

/// One imprint in meters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ImprintKey {
    /// Measured: it is in the sample.
    Measured(TouchKey),
    /// Derived from a prediction.
    Predicted(PredictionKey, ShiftMode),
}

impl ImprintKey {
    /// The touch it belongs to.
    pub fn touch(&self) -> TouchKey {
        match self {
            Self::Measured(touch) => *touch,
            Self::Predicted(recipe, _) => recipe.touch,
        }
    }
}

/// An automatic mask of one imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaskKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// The recipe.
    pub recipe: MaskRecipe,
}

/// The mask in force, as part of a recipe.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MaskVersion {
    /// Automatic.
    Auto(MaskRecipe),
    /// Corrected by hand.
    Hand(Revision),
}

/// A cloud of both fingers: imprint and (where one can be had) mask of each finger.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CloudKey {
    /// Per finger.
    pub parts: PerPad<(ImprintKey, Option<MaskVersion>)>,
}

pub use crate::domain::pose::Engine as PoseEngine;

/// A pose of a cloud.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PoseKey {
    /// The cloud whose contact points are registered.
    pub cloud: CloudKey,
    /// The tool.
    pub tool: Arc<str>,
    /// The registration.
    pub engine: PoseEngine,
}

/// A pose (`grasp_from_object`) that compares and hashes by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PoseBits([u64; 3]);

impl From<PlanarPose> for PoseBits {
    fn from(pose: PlanarPose) -> Self {
        Self([pose.theta_rad, pose.y_m, pose.z_m].map(f64::to_bits))
    }
}

impl PoseBits {
    /// The pose.
    pub fn get(self) -> PlanarPose {
        let [theta_rad, y_m, z_m] = self.0.map(f64::from_bits);
        PlanarPose { theta_rad, y_m, z_m }
    }
}

/// A registration with everything recorded: every step, and what became of every point.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RunKey {
    /// What is registered, and how.
    pub pose: PoseKey,
    /// Where it starts (`grasp_from_object`); `None` = where the engine starts by itself.
    pub start: Option<PoseBits>,
}

/// A basin map.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BasinKey {
    /// What is registered, and how.
    pub pose: PoseKey,
    /// Which starts are tried.
    pub plane: Plane,
}

/// Several predictions of one touch, as far as they are there.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EnsembleKey {
    /// At least one; they differ in their seeds.
    pub recipes: Vec<PredictionKey>,
    /// How they become meters.
    pub shift: ShiftMode,
}

/// A result that is computed because a visible pane shows it. Ordered, hashable: it is its own key.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Request {
    /// The tensors of a pair.
    Sample(PairKey),
    /// The labels stored for a pair.
    Labels(PairKey),
    /// The CAD model of a tool and what the registration derives from it.
    Tool(DatasetSeq, Arc<str>),
    /// The predictions of a touch that lie on the disk from before.
    Stored(TouchKey),
    /// The prediction that a pane needs because the one of the other finger was made.
    Prediction(PredictionKey),
    /// A prediction with one of several seeds.
    Seed(PredictionKey),
    /// Mean and spread of several predictions.
    Ensemble(EnsembleKey),
    /// A prediction in meters (of a raw prediction that exists).
    Imprint(PredictionKey, ShiftMode),
    /// A prediction against the measurement.
    Comparison(PredictionKey, ShiftMode),
    /// The depth chain of a prediction, stage by stage.
    Ledger(PredictionKey, ShiftMode),
    /// What a GelSlim image leaves open.
    Ambiguity(TouchKey),
    /// An automatic mask.
    Mask(MaskKey),
    /// A cloud.
    Cloud(CloudKey),
    /// A pose.
    Pose(PoseKey),
    /// A registration with everything recorded.
    Run(RunKey),
    /// Reasons, residuals and distances of a recorded registration from the engine's own starts.
    Layers(PoseKey),
    /// The steps of a recorded registration, made ready to be looked through.
    Inspection(RunKey),
    /// Where starts lead.
    Basin(BasinKey),
    /// A small picture of a pair's measured imprint.
    Thumbnail(PairKey),
}

impl Request {
    /// The opening of the data set that it is about.
    pub fn dataset(&self) -> Option<DatasetSeq> {
        match self {
            Self::Sample(pair) | Self::Labels(pair) | Self::Thumbnail(pair) => Some(pair.dataset),
            Self::Tool(dataset, _) => Some(*dataset),
            Self::Stored(touch) | Self::Ambiguity(touch) => Some(touch.pair.dataset),
            Self::Prediction(recipe)
            | Self::Seed(recipe)
            | Self::Imprint(recipe, _)
            | Self::Comparison(recipe, _)
            | Self::Ledger(recipe, _) => Some(recipe.touch.pair.dataset),
            Self::Ensemble(key) => key.recipes.first().map(|recipe| recipe.touch.pair.dataset),
            Self::Mask(key) => Some(key.imprint.touch().pair.dataset),
            Self::Cloud(key)
            | Self::Pose(PoseKey { cloud: key, .. })
            | Self::Layers(PoseKey { cloud: key, .. })
            | Self::Run(RunKey { pose: PoseKey { cloud: key, .. }, .. })
            | Self::Inspection(RunKey { pose: PoseKey { cloud: key, .. }, .. })
            | Self::Basin(BasinKey { pose: PoseKey { cloud: key, .. }, .. }) => {
                key.parts.iter().flatten().next().map(|(imprint, _)| imprint.touch().pair.dataset)
            }
        }
    }
}
