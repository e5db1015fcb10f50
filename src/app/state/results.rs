//! [`Results`]: what was computed, each under the key that decides it.
//!
//! **The table** has one row for each kind of result; what can be asked for ([`Request`]), what comes back ([`Computed`])
//! and what is kept ([`Results`]) follow from it, and so does in [`crate::app::results`] how it is computed.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::super::keys::{
    CloudKey, ImprintSource, InspectionKey, Key, PairKey, PoseKey, PredictionKey, Preview, TouchKey,
};
use super::cache::Cache;
use super::shown::Shown;

const MIB: usize = 1 << 20;

/// The table, given to the macro `$with`: name, key, and where results are kept the cache with its budget.
macro_rules! table {
    ($with:ident) => {
        $with! {
        /// The tensors of a pair: about 10 MB of a lab pair (two GelSlim images and their difference, per finger).
        Sample(PairKey) in samples, 192 * MIB;
        /// The labels stored for a pair: they go to the document.
        Labels(LabelsKey);
        /// The lines about the data set.
        About(AboutKey) in abouts, MIB;
        /// The CAD model of a tool and what the registration derives from it.
        Tool(ToolKey) in tools, 128 * MIB;
        /// The predictions of a touch that lie on the disk from before.
        Stored(StoredKey);
        /// Raw predictions. One is asked for because a pane needs it beside that of the other finger.
        Prediction(PredictionKey) in predictions, 256 * MIB;
        /// A prediction of the pair on screen that nobody asked for: kept with the others.
        Prefetch(PrefetchKey);
        /// The mean of several predictions of one touch.
        Mean(MeanKey) in means, 16 * MIB;
        /// A prediction in meters, as large as the bubble image.
        Imprint(MetersKey) in imprints, 64 * MIB;
        /// A prediction of a color sensor: differences, 0..255 scale.
        Color(ColorKey) in colors, 32 * MIB;
        /// The prediction of another program that lies beside a pair as a picture.
        Picture(PictureKey) in pictures, 16 * MIB;
        /// A prediction that is compared with something: kept with the others.
        Compared(ComparedKey);
        /// Any two imprints of a touch against each other.
        Versus(VersusKey) in versus, 64 * MIB;
        /// The distances of the points of one cloud from another.
        Apart(CloudDifferenceKey) in apart, 16 * MIB;
        /// Flags: implausible things about the way of a prediction to meters.
        Flags(FlagsKey) in flags, MIB;
        /// The ambiguity of a GelSlim image: what it leaves open.
        Ambiguity(AmbiguityKey) in ambiguities, MIB;
        /// An automatic mask.
        Mask(MaskKey) in masks, 32 * MIB;
        /// The plan of an export of masks: what it would write where.
        MaskPlan(MaskPlanKey) in mask_plans, MIB;
        /// The plan of an import of masks: what it would change.
        ImportPlan(ImportPlanKey) in import_plans, MIB;
        /// The distances of an imprint's points from the CAD model.
        Distances(DistancesKey) in distances, 32 * MIB;
        /// A mask that is proposed.
        Proposal(ProposalKey) in proposals, 16 * MIB;
        /// The plan of a training of the mask model: what it would learn from.
        TrainPlan(TrainPlanKey) in train_plans, MIB;
        /// A cloud.
        Cloud(CloudKey) in clouds, 128 * MIB;
        /// A pose.
        Pose(PoseKey) in poses, 32 * MIB;
        /// A pose without its proof: shown until that is there.
        ProvisionalPose(ProvisionalPoseKey) in provisional_poses, 3 * MIB;
        /// A registration with everything recorded.
        Run(RunKey) in runs, 32 * MIB;
        /// Reasons, residuals and distances of a recorded registration from the registration's own starts.
        Layers(LayersKey) in layers, 16 * MIB;
        /// Signed distances between contact points and the registered model.
        Deviation(DeviationKey) in deviations, 63 * MIB;
        /// All tools of the data set, ranked for the touch of a pose.
        Ranking(RankingKey) in rankings, MIB;
        /// The steps of a recorded registration, made ready to be looked through.
        Inspection(InspectionKey) in inspections, 64 * MIB;
        /// A small picture of a pair's measured imprint (right finger, else left).
        Thumbnail(ThumbnailKey) in thumbnails, 32 * MIB;
        }
    };
}

pub(in crate::app) use table;

/// A key whose result is kept in a cache of its own.
pub(crate) trait Cached: Key + Into<Request> {
    /// The cache.
    fn cache(results: &Results) -> &Cache<Self, Self::Value>;
}

/// The recipes of what was shown last of a pair and imprint: shown dimmed while the next is computed.
#[derive(Clone, Debug, Default)]
pub struct Latest {
    /// The cloud.
    pub cloud: Option<CloudKey>,
    /// The pose.
    pub pose: Option<PoseKey>,
    /// The recorded registration.
    pub inspection: Option<InspectionKey>,
}

macro_rules! results {
    ($( #[doc = $doc:literal] $variant:ident($key:ident) $(in $cache:ident, $budget:expr)?; )*) => {
        /// A result that is computed because a visible pane shows it. Ordered, hashable: it is its own key.
        #[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Request { $( #[doc = $doc] $variant($crate::app::keys::$key), )* }

        /// A computed result with its key.
        #[derive(Clone, Debug)]
        pub enum Computed { $( #[doc = $doc] $variant($crate::app::keys::$key, Arc<<$crate::app::keys::$key as Key>::Value>), )* }

        /// All caches, and what follows from their contents.
        #[derive(Debug)]
        pub struct Results {
            $( $( #[doc = $doc] pub $cache: Cache<$crate::app::keys::$key, <$crate::app::keys::$key as Key>::Value>, )? )*
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

            $( impl Cached for $crate::app::keys::$key {
                fn cache(results: &Results) -> &Cache<Self, Self::Value> {
                    &results.$cache
                }
            } )?
        )*
    };
}

table!(results);

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
