//! Results, each under the recipe that made it.
//!
//! **The table** at the end of this file has one row for each kind of result; what can be asked for ([`Request`]), what
//! comes back ([`Computed`]) and what is kept ([`Results`]) follow from it. A row names the recipe, a type of its own,
//! which says how the result is computed ([`Computes`]) in a file of this folder, beside the look-up that views call.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::demand::Demands;
use super::jobs::{Job, Lane};
use super::keys::{DatasetSeq, ImprintSource, PairKey, TouchKey};
use super::services::SharedServices;
use super::state::{Absent, Lookup, State};
use touch2touch_work::error::TaskError;

pub mod ambiguity;
pub mod basin;
pub mod cache;
pub mod cloud;
pub mod comparison;
pub mod deviation;
pub mod ensemble;
pub mod import_plan;
pub mod imprint;
pub mod influence;
pub mod inspection;
pub mod label_stats;
pub mod labels;
pub mod layers;
pub mod ledger;
pub mod mask;
pub mod mask_plan;
pub mod picture;
pub mod pose;
pub mod prediction;
pub mod prefetch;
pub mod preview;
pub mod proposal;
pub mod run;
pub mod sample;
pub mod scores;
pub mod shown;
pub mod thumbnail;
pub mod tool;
pub mod train_plan;
pub mod versus;

pub(crate) use cache::Cache;
pub use preview::Preview;

/// A recipe that says how its result is computed. Equal recipes have equal results: it is the key of the result.
pub trait Computes: Clone + Ord + Send + 'static {
    /// The result.
    type Value: Send + Sync + 'static;

    /// The job, with its inputs gathered; `None` if one is not there (any more).
    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<Self::Value>>;

    /// Bytes that a result holds.
    fn bytes(_value: &Self::Value) -> usize {
        0
    }

    /// What follows from a result besides its being kept in its cache.
    fn arrived(&self, _state: &mut State, _value: &Arc<Self::Value>) {}

    /// What follows from a failure; whether the log says it although a pane shows it in place of the result.
    fn failed(&self, _state: &mut State, _err: &TaskError) -> bool {
        false
    }
}

/// A recipe whose result is kept in a cache of its own.
pub(crate) trait Cached: Computes + Into<Request> {
    /// The cache.
    fn cache(results: &Results) -> &Cache<Self, Self::Value>;
}

impl State {
    /// The result of a recipe, or what stands in its place.
    pub(crate) fn look<K: Cached>(&self, key: K) -> Lookup<'_, Arc<K::Value>> {
        self.look_or(Ok(Some(key)), || None)
    }

    /// The result of a recipe that may be unknown still, or not be possible; meanwhile the one before.
    pub(crate) fn look_or<'a, K: Cached>(
        &'a self,
        key: Result<Option<K>, Absent>,
        before: impl FnOnce() -> Option<&'a Arc<K::Value>>,
    ) -> Lookup<'a, Arc<K::Value>> {
        let key = match key {
            Ok(key) => key,
            Err(absent) => return Lookup::Absent(absent),
        };
        if let Some(value) = key.as_ref().and_then(|key| K::cache(&self.results).get(key)) {
            return Lookup::Ready(value);
        }
        match (key.and_then(|key| self.failure(key)), before()) {
            (Some(err), _) => Lookup::Failed(err),
            (None, Some(before)) => Lookup::Stale(before),
            (None, None) => Lookup::Waiting,
        }
    }

    /// Why a result could not be computed, if that was tried.
    pub(crate) fn failure(&self, request: impl Into<Request>) -> Option<&TaskError> {
        self.tasks.failed.get(&request.into())
    }
}

/// The recipes of what was shown last of a pair and imprint: shown dimmed while the next is computed.
#[derive(Clone, Debug, Default)]
pub struct Latest {
    /// The cloud.
    pub cloud: Option<cloud::CloudKey>,
    /// Its pose.
    pub pose: Option<pose::PoseKey>,
    /// The recorded registration.
    pub inspection: Option<inspection::InspectionKey>,
    /// The basin map.
    pub basin: Option<basin::BasinKey>,
    /// What its angle hangs on.
    pub influence: Option<influence::InfluenceKey>,
}

const MIB: usize = 1 << 20;

macro_rules! results {
    ($( #[doc = $doc:literal] $variant:ident($key:ty) $(in $cache:ident, $budget:expr)?; )*) => {
        /// A result that is computed because a visible pane shows it. Ordered, hashable: it is its own key.
        #[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Request { $( #[doc = $doc] $variant($key), )* }

        /// A computed result with its recipe.
        #[derive(Clone, Debug)]
        pub enum Computed { $( #[doc = $doc] $variant($key, Arc<<$key as Computes>::Value>), )* }

        /// All caches, and what follows from their contents.
        #[derive(Debug)]
        pub struct Results {
            $( $( #[doc = $doc] pub $cache: Cache<$key, <$key as Computes>::Value>, )? )*
            /// Results of which the log said what is odd about them.
            pub noted: BTreeSet<Request>,
            /// What is on its way to each touch.
            pub previews: BTreeMap<TouchKey, Arc<Preview>>,
            /// Touches whose predictions from before were looked for on the disk.
            pub looked_up: BTreeSet<TouchKey>,
            /// What is shown of them where the settings do not say it.
            pub shown: shown::Shown,
            /// All predictions made for each touch, oldest first.
            pub made: BTreeMap<TouchKey, Vec<prediction::PredictionKey>>,
            /// What was shown last of each pair and imprint.
            pub latest: BTreeMap<(PairKey, ImprintSource), Latest>,
        }

        impl Default for Results {
            fn default() -> Self {
                Self {
                    $( $( $cache: Cache::new($budget), )? )*
                    noted: BTreeSet::new(),
                    previews: BTreeMap::new(),
                    looked_up: BTreeSet::new(),
                    shown: shown::Shown::default(),
                    made: BTreeMap::new(),
                    latest: BTreeMap::new(),
                }
            }
        }

        impl Results {
            /// Bytes that the caches hold now.
            pub fn bytes(&self) -> usize {
                0 $( $( + self.$cache.bytes() )? )*
            }

            /// Bytes that the caches may hold together.
            pub const BUDGET: usize = 0 $( $( + $budget )? )*;
        }

        impl Request {
            /// Its job; `None` if an input is not there (any more).
            pub(super) fn job(&self, state: &State, services: &SharedServices) -> Option<Job<Computed>> {
                match self { $( Self::$variant(key) => {
                    let done = key.clone();
                    Some(key.job(state, services)?.map(move |value| Computed::$variant(done, Arc::new(value))))
                } )* }
            }

            /// What follows from its failure; whether the log says it.
            pub(super) fn failed(&self, state: &mut State, err: &TaskError) -> bool {
                match self { $( Self::$variant(key) => key.failed(state, err), )* }
            }
        }

        impl Computed {
            /// What was asked for.
            pub fn request(&self) -> Request {
                match self { $( Self::$variant(key, _) => Request::$variant(key.clone()), )* }
            }

            /// Keeps it under its recipe, with what follows from it.
            pub(super) fn keep(self, state: &mut State) {
                match self { $( Self::$variant(key, value) => {
                    $( state.results.$cache.insert(key.clone(), value.clone(), <$key>::bytes(&value)); )?
                    key.arrived(state, &value);
                } )* }
            }
        }

        $(
            impl From<$key> for Request {
                fn from(key: $key) -> Self {
                    Self::$variant(key)
                }
            }

            $( impl Cached for $key {
                fn cache(results: &Results) -> &Cache<Self, Self::Value> {
                    &results.$cache
                }
            } )?
        )*
    };
}

results! {
    /// The tensors of a pair: about 10 MB of a lab pair (two GelSlim images and their difference, per finger).
    Sample(PairKey) in samples, 192 * MIB;
    /// The labels stored for a pair: they go to the document.
    Labels(labels::LabelsKey);
    /// How far the labeling is, and what it took.
    LabelStats(label_stats::LabelStatsKey) in label_stats, 8 * MIB;
    /// The CAD model of a tool and what the registration derives from it.
    Tool(tool::ToolKey) in tools, 128 * MIB;
    /// The predictions of a touch that lie on the disk from before.
    Stored(prediction::StoredKey);
    /// Raw predictions. One is asked for because a pane needs it beside that of the other finger.
    Prediction(prediction::PredictionKey) in predictions, 256 * MIB;
    /// A prediction with one of several seeds: kept with the others.
    Seed(prediction::SeedKey);
    /// A prediction of the pair on screen that nobody asked for: kept with the others.
    Prefetch(prefetch::PrefetchKey);
    /// Several predictions of one touch.
    Ensemble(ensemble::EnsembleKey) in ensembles, 32 * MIB;
    /// A prediction in meters, as large as the bubble image.
    Imprint(imprint::MetersKey) in imprints, 64 * MIB;
    /// A prediction of a color sensor: differences, 0..255 scale.
    Color(imprint::ColorKey) in colors, 32 * MIB;
    /// The prediction of another program that lies beside a pair as a picture.
    Picture(picture::PictureKey) in pictures, 16 * MIB;
    /// A prediction that is compared with something: kept with the others.
    Compared(versus::ComparedKey);
    /// Any two imprints of a touch against each other.
    Versus(versus::VersusKey) in versus, 64 * MIB;
    /// How far the points of one cloud lie from another.
    Apart(versus::CloudDifferenceKey) in apart, 16 * MIB;
    /// The depth chain of a prediction, stage by stage.
    Ledger(ledger::LedgerKey) in ledgers, 24 * MIB;
    /// What a GelSlim image leaves open.
    Ambiguity(ambiguity::AmbiguityKey) in ambiguities, MIB;
    /// An automatic mask.
    Mask(mask::MaskKey) in masks, 32 * MIB;
    /// What an export of masks would write where.
    MaskPlan(mask_plan::MaskPlanKey) in mask_plans, MIB;
    /// What an import of masks would change.
    ImportPlan(import_plan::ImportPlanKey) in import_plans, MIB;
    /// The distances of an imprint's points from the CAD model.
    Distances(proposal::DistancesKey) in distances, 32 * MIB;
    /// A mask that is proposed.
    Proposal(proposal::ProposalKey) in proposals, 16 * MIB;
    /// What a training of the mask model would learn from.
    TrainPlan(train_plan::TrainPlanKey) in train_plans, MIB;
    /// A cloud.
    Cloud(cloud::CloudKey) in clouds, 128 * MIB;
    /// A pose.
    Pose(pose::PoseKey) in poses, 32 * MIB;
    /// A pose without its proof: shown until that is there.
    ProvisionalPose(pose::ProvisionalPoseKey) in provisional_poses, 4 * MIB;
    /// A registration with everything recorded.
    Run(run::RunKey) in runs, 32 * MIB;
    /// Reasons, residuals and distances of a recorded registration from the registration's own starts.
    Layers(layers::LayersKey) in layers, 16 * MIB;
    /// Signed distances between contact points and the registered model.
    Deviation(deviation::DeviationKey) in deviations, 64 * MIB;
    /// Which pixels a registered angle hangs on.
    Influence(influence::InfluenceKey) in influences, 16 * MIB;
    /// The steps of a recorded registration, made ready to be looked through.
    Inspection(inspection::InspectionKey) in inspections, 64 * MIB;
    /// Where starts lead.
    Basin(basin::BasinKey) in basins, 32 * MIB;
    /// The scores that are kept of all pairs.
    Scores(scores::ScoresKey) in scores, 64 * MIB;
    /// A small picture of a pair's measured imprint (right finger, else left).
    Thumbnail(thumbnail::ThumbnailKey) in thumbnails, 32 * MIB;
}
