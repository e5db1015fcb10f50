//! [`Results`]: what was computed, each under the key that decides it.
//!
//! **The table** has one row for each kind of result, with its key, its type and the bytes that one holds; what can be asked for ([`Request`]), what comes back ([`Computed`])
//! and what is kept ([`Results`]) follow from it, and so does in [`crate::app::results`] how it is computed.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::super::keys::Read;
use super::super::keys::{
    Distances, EstimateKey, ImprintSource, Keyed, PairKey, PredictionKey, Preview, RunKey, TouchKey,
};
use super::cache::Cache;
use super::inspect::Inspection;
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::postprocess::Flag;
use touch2touch_core::sample::Sample;
use touch2touch_core::which_tool::Candidate;
use touch2touch_pipeline::compare::deviation::Deviation;
use touch2touch_pipeline::compare::{Beside, Comparison};
use touch2touch_pipeline::doctor::Fact;
use touch2touch_pipeline::export::Plan;
use touch2touch_pipeline::export::import::Import;
use touch2touch_pipeline::learn::train::TrainPlan;
use touch2touch_pipeline::masks::propose::Proposal;
use touch2touch_pipeline::scores::evaluate::Evaluation;
use touch2touch_pipeline::steps::estimate::Estimate;
use touch2touch_pipeline::steps::layers::LayerResult;
use touch2touch_pipeline::steps::prediction::Prediction;
use touch2touch_pipeline::steps::tool::LoadedTool;

const MIB: usize = 1 << 20;

/// The table, given to the macro `$with`: name, key, and where results are kept the cache with its budget.
macro_rules! table {
    ($with:ident) => {
        $with! {
        /// The tensors of a pair: about 10 MB of a lab pair (two GelSlim images and their difference, per finger).
        Sample(PairKey => Sample, Sample::bytes) in samples, 112 * MIB;
        /// The labels stored for a pair: they go to the document.
        Labels(LabelsKey => Read);
        /// The lines about the data set.
        About(AboutKey => Vec<Fact>, |facts| facts.len() * 512) in abouts, MIB;
        /// The CAD model of a tool and what the registration derives from it.
        Tool(ToolKey => LoadedTool, tool_bytes) in tools, 128 * MIB;
        /// The last evaluation of the data set, which lies on the disk from before.
        Scored(ScoredKey => Option<Arc<Evaluation>>);
        /// The predictions of a touch that lie on the disk from before.
        Stored(StoredKey => Keyed);
        /// Raw predictions: of the pair on screen, of its other finger, of what is compared.
        Prediction(PredictionKey => Prediction, |made| made.raw.channels.iter().map(|c| c.len() * 4).sum()) in predictions, 256 * MIB;
        /// The mean of several predictions of one touch.
        Mean(MeanKey => DepthMap, |mean| mean.len() * 4) in means, 16 * MIB;
        /// A prediction of a color sensor: differences, 0..255 scale.
        Color(ColorKey => RgbGrid, |picture| picture.len() * 12) in colors, 32 * MIB;
        /// The prediction of another program that lies beside a pair as a picture.
        Picture(PictureKey => Beside, |found| 4 * (found.tile.len() + found.imprint.len())) in pictures, 16 * MIB;
        /// Any two imprints of a touch against each other.
        Comparison(ComparisonKey => Comparison, |found| found.error.len() * 4) in comparisons, 64 * MIB;
        /// Flags: implausible things about the way of a prediction to meters.
        Flags(FlagsKey => Vec<Flag>, |found| found.len() * 512) in flags, MIB;
        /// The plan of an export of masks: what it would write where.
        MaskPlan(MaskPlanKey => Plan, |plan| plan.total() * 128) in mask_plans, MIB;
        /// The plan of an import of masks: what it would change.
        ImportPlan(ImportPlanKey => Import, |plan| (plan.changed.len() + plan.unmatched.len() + plan.refused.len()) * 128) in import_plans, MIB;
        /// The distances of an imprint's points from the CAD model.
        Distances(DistancesKey => Distances, |found| found.grid.len() * 8) in distances, 32 * MIB;
        /// A mask that is proposed.
        Proposal(ProposalKey => Proposal, |found| found.mask.len()) in proposals, 16 * MIB;
        /// The plan of a training of the mask model: what it would learn from.
        TrainPlan(TrainPlanKey => TrainPlan, |plan| (plan.masks() + plan.held_out[0]) * 256) in train_plans, MIB;
        /// An estimate: imprints, masks, cloud and pose as far as a pane needs them.
        Estimate(EstimateKey => Estimate, Estimate::bytes) in estimates, 64 * MIB;
        /// A registration with everything recorded, ready to be looked through.
        Run(RunKey => Inspection, Inspection::bytes) in runs, 96 * MIB;
        /// Reasons, residuals and distances of a recorded registration from the registration's own starts.
        Layers(LayersKey => LayerResult, LayerResult::bytes) in layers, 16 * MIB;
        /// Signed distances between contact points and the registered model.
        Deviation(DeviationKey => Deviation, Deviation::bytes) in deviations, 63 * MIB;
        /// All tools of the data set, ranked for the touch of a pose.
        Ranking(RankingKey => Vec<Candidate>, |found| found.len() * size_of::<Candidate>()) in rankings, MIB;
        /// The preview of a 3D picture.
        Still(StillKey => Grid<[u8; 4]>, |picture| picture.len() * 4) in stills, 4 * MIB;
        /// A small picture of a pair's measured imprint (right finger, else left).
        Thumbnail(ThumbnailKey => DepthMap, |picture| picture.len() * 4) in thumbnails, 32 * MIB;
        }
    };
}

pub(in crate::app) use table;

/// The key of a result. Equal keys have equal results.
pub trait Key: Clone + Ord + Send + 'static {
    /// The result.
    type Value: Send + Sync + 'static;

    /// Bytes that a result holds.
    fn bytes(_value: &Self::Value) -> usize {
        0
    }
}

/// A key whose result is kept in a cache of its own.
pub(crate) trait Cached: Key + Into<Request> {
    /// The cache.
    fn cache(results: &Results) -> &Cache<Self, Self::Value>;
}

/// The recipes of what was shown last of a pair and imprint: shown dimmed while the next is computed.
#[derive(Clone, Debug, Default)]
pub struct Latest {
    /// The cloud.
    pub cloud: Option<EstimateKey>,
    /// The pose.
    pub pose: Option<EstimateKey>,
    /// The recorded registration.
    pub inspection: Option<RunKey>,
}

macro_rules! results {
    ($(
        #[doc = $doc:literal]
        $variant:ident($key:ident => $value:ty $(, $bytes:expr)?) $(in $cache:ident, $budget:expr)?;
    )*) => {
        /// A result that is computed because a visible pane shows it. Ordered, hashable: it is its own key.
        #[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Request { $( #[doc = $doc] $variant($crate::app::keys::$key), )* }

        /// A computed result with its key.
        #[derive(Clone, Debug)]
        pub enum Computed { $( #[doc = $doc] $variant($crate::app::keys::$key, Arc<$value>), )* }

        /// All caches, and what follows from their contents.
        #[derive(Debug)]
        pub struct Results {
            $( $( #[doc = $doc] pub $cache: Cache<$crate::app::keys::$key, $value>, )? )*
            /// Results of which the log said what is odd about them.
            pub noted: BTreeSet<Request>,
            /// The previews of what is on its way to each touch.
            pub previews: BTreeMap<TouchKey, Arc<Preview>>,
            /// Touches whose predictions from before were looked for on the disk.
            pub looked_up: BTreeSet<TouchKey>,
            /// The predictions shown where the settings do not say it.
            pub shown: Shown,
            /// All predictions made for each touch, oldest first.
            pub made: BTreeMap<TouchKey, Vec<PredictionKey>>,
            /// The keys of what was shown last of each pair and imprint.
            pub latest: BTreeMap<(PairKey, ImprintSource), Latest>,
        }

        impl Default for Results {
            fn default() -> Self {
                Self {
                    $( $( $cache: Cache::new($budget), )? )*
                    noted: BTreeSet::new(),
                    previews: BTreeMap::new(),
                    looked_up: BTreeSet::new(),
                    shown: Shown::default(),
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

        impl Computed {
            /// The request that it answers.
            pub fn request(&self) -> Request {
                match self { $( Self::$variant(key, _) => Request::$variant(key.clone()), )* }
            }
        }

        $(
            impl From<$crate::app::keys::$key> for Request {
                fn from(key: $crate::app::keys::$key) -> Self {
                    Self::$variant(key)
                }
            }

            impl Key for $crate::app::keys::$key {
                type Value = $value;

                $( fn bytes(value: &$value) -> usize {
                    let bytes: fn(&$value) -> usize = $bytes;
                    bytes(value)
                } )?
            }

            $( impl Cached for $crate::app::keys::$key {
                fn cache(results: &Results) -> &Cache<Self, Self::Value> {
                    &results.$cache
                }
            } )?
        )*
    };
}

table!(results);

fn tool_bytes(tool: &LoadedTool) -> usize {
    let mesh = tool.model.mesh.vertices.len() * 24 + tool.model.mesh.triangles.len() * 12;
    // The registration's field and tree are of the mesh's order, at least a few MB.
    8 * mesh + (4 << 20)
}

impl Results {
    /// Lists a prediction that was kept; with `in_front` it is shown where the settings name none that is there.
    pub(in crate::app) fn list_made(&mut self, recipe: &PredictionKey, in_front: bool) {
        let made = self.made.entry(recipe.touch).or_default();
        made.retain(|other| other != recipe);
        made.push(recipe.clone());
        self.shown.made(recipe, in_front);
        // Old predictions may have left the cache to make room.
        let kept = &self.predictions;
        self.made.values_mut().for_each(|list| list.retain(|recipe| kept.contains(recipe)));
        self.shown.retain(kept);
    }

    /// The cost of a prediction made as this one would be on this machine, seconds: the median of those of the open data
    /// set; `None` if there are none.
    pub fn cost_of(&self, recipe: &PredictionKey) -> Option<f64> {
        let same = |made: &PredictionKey| {
            PredictionKey { touch: recipe.touch, ..made.with_seed(recipe.config.seed) } == *recipe
        };
        let made = self.predictions.iter().filter(|(key, _)| same(key));
        let mut seconds: Vec<f64> = made.map(|(_, prediction)| prediction.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        seconds.get(seconds.len() / 2).copied()
    }
}

/// The predictions that are shown where the settings do not name one that is there.
#[derive(Clone, Debug, Default)]
pub struct Shown {
    /// The one made last for each touch.
    last: BTreeMap<TouchKey, PredictionKey>,
    /// The one that a person picked among those made, with what the settings asked for at the time: another setting
    /// ends the pick, its return brings the pick back.
    picked: BTreeMap<TouchKey, (PredictionKey, Option<PredictionKey>)>,
}

impl Shown {
    /// Notes that a prediction was made; with `in_front` it is shown where the settings name none that is there.
    pub(super) fn made(&mut self, recipe: &PredictionKey, in_front: bool) {
        if in_front || !self.last.contains_key(&recipe.touch) {
            self.last.insert(recipe.touch, recipe.clone());
        }
    }

    /// Forgets what left the cache.
    pub(super) fn retain(&mut self, kept: &Cache<PredictionKey, Prediction>) {
        self.last.retain(|_, recipe| kept.contains(recipe));
        self.picked.retain(|_, (recipe, _)| kept.contains(recipe));
    }

    /// The prediction made last for a touch.
    pub(in crate::app) fn last(&self, touch: TouchKey) -> Option<&PredictionKey> {
        self.last.get(&touch)
    }

    /// The prediction that a person picked while the settings asked for `named`.
    pub(in crate::app) fn picked(&self, touch: TouchKey, named: Option<&PredictionKey>) -> Option<&PredictionKey> {
        let (recipe, under) = self.picked.get(&touch)?;
        (under.as_ref() == named).then_some(recipe)
    }

    /// Shows a prediction of those made while the settings ask for `named`.
    pub(in crate::app) fn pick(&mut self, recipe: PredictionKey, named: Option<PredictionKey>) {
        self.picked.insert(recipe.touch, (recipe, named));
    }

    /// Shows what the settings name, or what is made next.
    pub(in crate::app) fn unpick(&mut self, touch: TouchKey) {
        self.picked.remove(&touch);
    }
}
