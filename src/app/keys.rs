//! Names of what is open and looked at, and the keys of results: plain values that say what a result is of and how it is
//! made.
//!
//! A key is a [`touch2touch_pipeline::steps::recipe::Recipe`] as far as it decides the result, with the touch. [`super::results`] says
//! how each result is computed.

use std::path::PathBuf;
use std::sync::Arc;

pub use touch2touch_core::bits::Bits;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
pub use touch2touch_core::diffusion::{Preset, Sampler, Spacing};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::Grid;
use touch2touch_core::label::CadPose;
pub use touch2touch_core::pose::Registration;
use touch2touch_core::postprocess::CorrectionParts;
pub use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_pipeline::export::ExportChoice;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::job::PreviewPicture;
use touch2touch_pipeline::labels::{ImprintOf, JournalHistory, PairLabels};
pub use touch2touch_pipeline::labels::{ImprintSource, Revision};
use touch2touch_pipeline::learn::train::TrainChoice;
pub use touch2touch_pipeline::steps::mask::MaskRecipe;
use touch2touch_pipeline::steps::prediction::Prediction;
use touch2touch_pipeline::steps::recipe::{Recipe, Stage};

/// Keys that are others under a name of their own.
macro_rules! named {
    ($( #[doc = $doc:literal] $name:ident($($of:ty),+); )*) => { $(
        #[doc = $doc]
        #[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name($(pub $of),+);
    )* };
}

named! {
    /// The small picture of a pair.
    ThumbnailKey(PairKey);
    /// The labels stored for a pair.
    LabelsKey(PairKey);
    /// The last evaluation of a data set, which lies on the disk from before.
    ScoredKey(DatasetSeq);
    /// The predictions of a touch that lie on the disk from before.
    StoredKey(TouchKey);
    /// The picture beside a touch.
    PictureKey(TouchKey);
    /// A prediction of a color sensor, as a picture.
    ColorKey(PredictionKey);
    /// Implausible things about the way of a prediction to meters.
    FlagsKey(PredictionKey, ShiftMode);
    /// The layers of a recorded registration from the registration's own starts.
    LayersKey(EstimateKey);
    /// The distances of the contact points from the model at a registered pose.
    DeviationKey(EstimateKey);
    /// The preview of a 3D picture, by the number of the asking.
    StillKey(EstimateKey, u64);
    /// The tools of the data set, ranked for the touch that a pose is of.
    RankingKey(EstimateKey);
}

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

/// The name on screen of a way from the decoder's numbers to depth; files and verbs keep their keys.
pub(crate) fn shift_name(mode: ShiftMode) -> &'static str {
    match mode {
        ShiftMode::Raw => "Uncorrected (raw)",
        ShiftMode::PaperShift => "As in the paper (paper shift)",
        ShiftMode::ExactInverse => "Calibrated (exact inverse)",
        ShiftMode::Parts(CorrectionParts::NONE) => "Calibrated, without the fit",
        ShiftMode::Parts(_) => "Calibrated, parts of the fit",
        ShiftMode::Refit(_) => "Matched to this data set (refit)",
    }
}

/// The tooltip of a depth scale.
pub(crate) fn shift_tooltip(mode: ShiftMode) -> &'static str {
    match mode {
        ShiftMode::Raw => {
            "As the released script saves it. Its range is mapped twice, so depths come out far too deep: (depth + max) / 2"
        }
        ShiftMode::PaperShift => "Mean and deviation matched to those of the training data, as in the paper",
        ShiftMode::ExactInverse => {
            "True depth: the doubled mapping is undone (2 * value - max), and a fitted model's fit is applied"
        }
        ShiftMode::Parts(_) => "True depth, with only some parts of the model's fit to your sensors",
        ShiftMode::Refit(_) => "Mean and deviation matched to the measurements of this data set",
    }
}

/// Everything that decides a prediction.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PredictionKey {
    /// The touch whose GelSlim image is the condition.
    pub touch: TouchKey,
    /// The bundle's identity (its digest): a changed bundle is another recipe.
    pub bundle: Arc<str>,
    /// The choices of the generation.
    pub config: GenerateConfig,
    /// The model runtime: two of them round differently.
    pub runtime: EngineChoice,
}

impl PredictionKey {
    /// The key of a touch by a recipe; `None` where that has no generator.
    pub fn of(touch: TouchKey, recipe: &Recipe) -> Option<Self> {
        let (model, config) = recipe.generator.as_ref()?;
        Some(Self { touch, bundle: model.id.clone(), config: *config, runtime: recipe.engine })
    }

    /// The key of another finger of the pair.
    #[must_use]
    pub fn on(&self, finger: PadId) -> Self {
        Self { touch: self.touch.pair.finger(finger), ..self.clone() }
    }

    /// The key that differs in its seed alone.
    #[must_use]
    pub fn with_seed(&self, seed: u64) -> Self {
        Self { config: GenerateConfig { seed, ..self.config }, ..self.clone() }
    }
}

/// Predictions with their keys.
pub(crate) type Keyed = Vec<(PredictionKey, Arc<Prediction>)>;

/// A prediction as it looks on the way.
#[derive(Clone, Debug)]
pub struct Preview {
    /// The key of what is being made.
    pub recipe: PredictionKey,
    /// The picture.
    pub picture: PreviewPicture,
}

/// One imprint in meters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ImprintKey {
    /// Measured: it is in the sample.
    Measured(TouchKey),
    /// Derived from a prediction.
    Predicted(PredictionKey, ShiftMode),
    /// The mean of several predictions.
    Mean(MeanKey),
    /// The prediction of another program that lies beside the pair.
    Picture(TouchKey),
}

impl ImprintKey {
    /// The touch it belongs to.
    pub fn touch(&self) -> TouchKey {
        match self {
            Self::Measured(touch) | Self::Picture(touch) => *touch,
            Self::Predicted(recipe, _) => recipe.touch,
            Self::Mean(key) => key.touch,
        }
    }

    /// The name by which masks drawn on it are told; `None` where nobody can have drawn on it.
    pub fn of(&self) -> Option<ImprintOf> {
        match self {
            Self::Measured(_) => Some(ImprintOf::Measured),
            Self::Predicted(recipe, shift) => Some(ImprintOf::predicted(&recipe.bundle, &recipe.config, *shift)),
            Self::Mean(_) | Self::Picture(_) => None,
        }
    }

    /// The side that it is shown on where there are two.
    pub fn side(&self) -> ImprintSource {
        match self {
            Self::Measured(_) => ImprintSource::Measured,
            Self::Predicted(..) | Self::Mean(_) | Self::Picture(_) => ImprintSource::Predicted,
        }
    }
}

/// The mean of several predictions of one touch.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeanKey {
    /// The touch.
    pub touch: TouchKey,
    /// At least one; they differ in their seeds.
    pub recipes: Vec<PredictionKey>,
    /// The mapping to meters.
    pub shift: ShiftMode,
}

/// The mask of an imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MaskVersion {
    /// Automatic.
    Auto(MaskRecipe),
    /// Corrected by hand.
    Hand(Revision),
}

/// One imprint against another of the same touch.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ComparisonKey {
    /// One: the error map is its imprint minus the other's.
    pub a: ImprintKey,
    /// The other.
    pub b: ImprintKey,
}

impl ComparisonKey {
    /// A prediction against the measurement of its touch.
    pub fn measured(recipe: PredictionKey, shift: ShiftMode) -> Self {
        Self { b: ImprintKey::Measured(recipe.touch), a: ImprintKey::Predicted(recipe, shift) }
    }
}

/// The estimate of a pair up to a stage: the imprints of its fingers with their masks, and what is registered to which tool.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EstimateKey {
    /// Per finger the imprint, and from [`Stage::Mask`] on its mask where one can be made.
    pub parts: PerPad<(ImprintKey, Option<MaskVersion>)>,
    /// Of a pose, tool and registration.
    pub pose: Option<(Arc<str>, Registration)>,
    /// The stage.
    pub stage: Stage,
}

impl EstimateKey {
    /// The imprint of one finger.
    pub(crate) fn imprint(imprint: &ImprintKey) -> Self {
        Self::one(imprint, None, Stage::Imprint)
    }

    /// The mask of one finger's imprint.
    pub(crate) fn mask(imprint: &ImprintKey, mask: MaskVersion) -> Self {
        Self::one(imprint, Some(mask), Stage::Mask)
    }

    fn one(imprint: &ImprintKey, mask: Option<MaskVersion>, stage: Stage) -> Self {
        let mut parts = PerPad::default();
        parts[imprint.touch().finger] = Some((imprint.clone(), mask));
        Self { parts, pose: None, stage }
    }

    /// The cloud of imprints with their masks.
    pub(crate) fn cloud(parts: PerPad<(ImprintKey, Option<MaskVersion>)>) -> Self {
        Self { parts, pose: None, stage: Stage::Cloud }
    }

    /// The cloud that a pose is of.
    pub(crate) fn its_cloud(&self) -> Self {
        Self::cloud(self.parts.clone())
    }

    /// The pose of a cloud, of a tool by a registration.
    pub(crate) fn posed(self, tool: &str, registration: Registration) -> Self {
        Self { pose: Some((tool.into(), registration)), stage: Stage::Pose, ..self }
    }

    /// The keys of what is in it besides, as if that were all.
    pub(crate) fn within(&self) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for (imprint, mask) in self.parts.iter().flatten() {
            all.push(Self::imprint(imprint));
            all.extend(mask.clone().map(|mask| Self::mask(imprint, mask)));
        }
        all.extend((self.stage > Stage::Cloud).then(|| self.its_cloud()));
        all.retain(|key| key != self);
        all
    }

    /// The pair and imprint it belongs to.
    pub fn place(&self) -> Option<(PairKey, ImprintSource)> {
        let (imprint, _) = self.parts.iter().flatten().next()?;
        Some((imprint.touch().pair, imprint.side()))
    }
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
    /// The pose that the registration makes.
    pub pose: EstimateKey,
    /// The pose that it starts at (`grasp_from_object`); `None` = where the registration starts by itself.
    pub start: Option<PoseBits>,
}

impl LayersKey {
    /// The recorded registration that they are of.
    pub(crate) fn run(&self) -> RunKey {
        RunKey { pose: self.0.clone(), start: None }
    }
}

/// The place where the CAD model lies.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CadPlace {
    /// At the true pose.
    Truth,
    /// At a registered one.
    Registered(Box<EstimateKey>),
    /// The place where a hand holds it.
    Hand(PoseBits),
}

/// The distances of an imprint's points from the CAD model.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DistancesKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// The place where the model lies.
    pub at: CadPlace,
}

/// The distances, and where the model was.
#[derive(Clone, Debug)]
pub struct Distances {
    /// Meters, negative inside; see [`touch2touch_pipeline::masks::propose::cad_distances`].
    pub grid: Grid<f64>,
    /// The pose of the model.
    pub at: CadPose,
}

/// The inputs of a proposal.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ProposalInputs {
    /// An automatic mask.
    Automatic(MaskRecipe),
    /// The pixels within a distance of the CAD model.
    Cad(CadPlace, Bits),
    /// The strokes, by the revision of the mask.
    Grow(Revision),
}

/// A proposal for one imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ProposalKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// The inputs.
    pub of: ProposalInputs,
}

/// A tool of a data set.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ToolKey {
    /// The opening of the data set.
    pub dataset: DatasetSeq,
    /// The name.
    pub name: Arc<str>,
}

/// Labels as they were read.
#[derive(Clone, Debug, PartialEq)]
pub struct Read {
    pub(crate) labels: PairLabels,
    /// The gestures of earlier runs.
    pub(crate) past: JournalHistory,
}

/// The plan of what is done with what is drawn and marked now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PlanKey<T> {
    /// The data set.
    pub dataset: DatasetSeq,
    /// What is asked about.
    pub choice: T,
    /// The last change of the document.
    pub revision: Revision,
}

/// The plan of an export.
pub type MaskPlanKey = PlanKey<ExportChoice>;

/// The plan of an import.
pub type ImportPlanKey = PlanKey<ImportForm>;

/// The plan of a training: the choice divides the pairs into those to learn from and those that are left out.
pub type TrainPlanKey = PlanKey<TrainChoice>;

/// An import of masks that is asked about: what it would change is said before anything changes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImportForm {
    /// The folder or file.
    pub from: PathBuf,
    /// True where what was painted by hand is replaced as well.
    pub over_drawn: bool,
    /// The number of the asking: files may be others than at the one before.
    pub(in crate::app) asked: u64,
}

/// Everything that decides what is said of the data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AboutKey {
    /// The data set.
    pub dataset: DatasetSeq,
    /// Pairs that it has by now.
    pub pairs: usize,
    /// The last change of the document.
    pub revision: Revision,
    /// The number of times that scores or units of tools changed.
    pub units_named: u64,
}
