//! Results, each under the recipe that made it, within a budget of bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::inspect::Inspection;
use super::keys::{
    BasinKey, CloudKey, EnsembleKey, ImprintSource, MaskKey, PairKey, PoseKey, PredictionKey, RunKey, ShiftMode,
    TouchKey,
};
use crate::domain::align::basin::Basin;
use crate::domain::ambiguity::Ambiguity;
use crate::domain::contact::MaskBasis;
use crate::domain::grid::{DepthMap, Mask, RgbGrid};
use crate::domain::sample::Sample;
use crate::work::cloud::Clouds;
use crate::work::compare::Comparison;
use crate::work::ensemble::Ensemble;
use crate::work::job::PreviewPicture;
use crate::work::layers::LayerResult;
use crate::work::ledger::LedgerResult;
use crate::work::pose::PoseResult;
use crate::work::prediction::Prediction;
use crate::work::tool::NamedTool;

/// Values by recipe; the least recently used go first when the budget is exceeded.
///
/// Reading marks a value as used through a shared reference, so views can do it.
#[derive(Debug)]
pub struct Cache<K, V> {
    entries: BTreeMap<K, Entry<V>>,
    bytes: usize,
    budget: usize,
    clock: AtomicU64,
}

#[derive(Debug)]
struct Entry<V> {
    value: Arc<V>,
    bytes: usize,
    used: AtomicU64,
}

impl<K: Ord + Clone, V> Cache<K, V> {
    /// An empty cache that holds at most `budget` bytes (one value larger than that is kept until the next).
    pub fn new(budget: usize) -> Self {
        Self { entries: BTreeMap::new(), bytes: 0, budget, clock: AtomicU64::new(0) }
    }

    /// The value of `key`, now the most recently used.
    pub fn get(&self, key: &K) -> Option<&Arc<V>> {
        let entry = self.entries.get(key)?;
        entry.used.store(self.tick(), Ordering::Relaxed);
        Some(&entry.value)
    }

    /// All values with their keys; none of them counts as used.
    pub fn iter(&self) -> impl Iterator<Item = (&K, &Arc<V>)> {
        self.entries.iter().map(|(key, entry)| (key, &entry.value))
    }

    /// Whether `key` has a value.
    pub fn contains(&self, key: &K) -> bool {
        self.entries.contains_key(key)
    }

    /// Stores a value that holds `bytes`, and drops old ones until the budget is kept.
    pub fn insert(&mut self, key: K, value: Arc<V>, bytes: usize) {
        let used = AtomicU64::new(self.tick());
        if let Some(old) = self.entries.insert(key, Entry { value, bytes, used }) {
            self.bytes -= old.bytes;
        }
        self.bytes += bytes;
        while self.bytes > self.budget && self.entries.len() > 1 {
            let oldest =
                self.entries.iter().min_by_key(|(_, e)| e.used.load(Ordering::Relaxed)).map(|(k, _)| k.clone());
            let Some(entry) = oldest.and_then(|key| self.entries.remove(&key)) else {
                break;
            };
            self.bytes -= entry.bytes;
        }
    }

    /// Drops what does not fulfil `keep`.
    pub fn retain(&mut self, mut keep: impl FnMut(&K) -> bool) {
        self.entries.retain(|key, entry| {
            let kept = keep(key);
            if !kept {
                self.bytes -= entry.bytes;
            }
            kept
        });
    }

    /// Drops everything.
    pub fn clear(&mut self) {
        self.entries.clear();
        self.bytes = 0;
    }

    /// Values held.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether nothing is held.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    fn tick(&self) -> u64 {
        self.clock.fetch_add(1, Ordering::Relaxed)
    }
}

/// A prediction as it looks on the way.
#[derive(Clone, Debug)]
pub struct Preview {
    /// What is being made.
    pub recipe: PredictionKey,
    /// How it looks.
    pub picture: PreviewPicture,
}

/// All caches.
#[derive(Debug)]
pub struct Results {
    /// Loaded pairs.
    pub samples: Cache<PairKey, Sample>,
    /// Small pictures of the measured imprint (right finger, else left).
    pub thumbnails: Cache<PairKey, DepthMap>,
    /// Raw predictions.
    pub predictions: Cache<PredictionKey, Prediction>,
    /// Predictions in meters, as large as the bubble image.
    pub imprints: Cache<(PredictionKey, ShiftMode), DepthMap>,
    /// Predictions of a color sensor: differences, 0..255 scale.
    pub colors: Cache<PredictionKey, RgbGrid>,
    /// Several predictions of one touch.
    pub ensembles: Cache<EnsembleKey, Ensemble>,
    /// Predictions against measurements.
    pub comparisons: Cache<(PredictionKey, ShiftMode), Comparison>,
    /// Depth chains.
    pub ledgers: Cache<(PredictionKey, ShiftMode), LedgerResult>,
    /// What GelSlim images leave open.
    pub ambiguities: Cache<TouchKey, Option<Ambiguity>>,
    /// Automatic masks.
    pub masks: Cache<MaskKey, Mask>,
    /// Of the masks that are not made of what their recipe names, what they are made of.
    pub mask_bases: BTreeMap<MaskKey, MaskBasis>,
    /// Pairs whose notes of loading were said.
    pub noted: BTreeSet<PairKey>,
    /// Clouds.
    pub clouds: Cache<CloudKey, Clouds>,
    /// Poses.
    pub poses: Cache<PoseKey, PoseResult>,
    /// Recorded registrations.
    pub runs: Cache<RunKey, PoseResult>,
    /// Their layers.
    pub layers: Cache<PoseKey, LayerResult>,
    /// Their steps.
    pub inspections: Cache<RunKey, Inspection>,
    /// Basin maps.
    pub basins: Cache<BasinKey, Basin>,
    /// Tools.
    pub tools: Cache<String, NamedTool>,
    /// What is on its way to each touch.
    pub previews: BTreeMap<TouchKey, Arc<Preview>>,
    /// Touches whose predictions from before were looked for on the disk.
    pub looked_up: BTreeSet<TouchKey>,
    /// The prediction shown for each touch: the last one generated, or the one chosen.
    pub chosen: BTreeMap<TouchKey, PredictionKey>,
    /// All predictions made for each touch, oldest first.
    pub made: BTreeMap<TouchKey, Vec<PredictionKey>>,
    /// The last cloud and pose of a pair and imprint: shown dimmed while the next is computed.
    pub latest: BTreeMap<(PairKey, ImprintSource), (Option<CloudKey>, Option<PoseKey>)>,
    /// The last recorded registration, for the same purpose.
    pub latest_inspections: BTreeMap<(PairKey, ImprintSource), RunKey>,
    /// The last basin map, for the same purpose.
    pub latest_basins: BTreeMap<(PairKey, ImprintSource), BasinKey>,
}

const MIB: usize = 1 << 20;

impl Default for Results {
    fn default() -> Self {
        Self {
            // A lab pair holds about 10 MB (two GelSlim images and their difference, per finger): ~38 pairs.
            samples: Cache::new(384 * MIB),
            thumbnails: Cache::new(32 * MIB),
            predictions: Cache::new(256 * MIB),
            imprints: Cache::new(64 * MIB),
            colors: Cache::new(32 * MIB),
            ensembles: Cache::new(32 * MIB),
            comparisons: Cache::new(32 * MIB),
            ledgers: Cache::new(24 * MIB),
            ambiguities: Cache::new(MIB),
            masks: Cache::new(32 * MIB),
            mask_bases: BTreeMap::new(),
            noted: BTreeSet::new(),
            clouds: Cache::new(128 * MIB),
            poses: Cache::new(32 * MIB),
            runs: Cache::new(32 * MIB),
            layers: Cache::new(16 * MIB),
            inspections: Cache::new(64 * MIB),
            basins: Cache::new(32 * MIB),
            tools: Cache::new(128 * MIB),
            previews: BTreeMap::new(),
            looked_up: BTreeSet::new(),
            chosen: BTreeMap::new(),
            made: BTreeMap::new(),
            latest: BTreeMap::new(),
            latest_inspections: BTreeMap::new(),
            latest_basins: BTreeMap::new(),
        }
    }
}

impl Results {
    /// Drops everything: another data set is open.
    pub(super) fn clear(&mut self) {
        self.samples.clear();
        self.thumbnails.clear();
        self.predictions.clear();
        self.imprints.clear();
        self.colors.clear();
        self.ensembles.clear();
        self.comparisons.clear();
        self.ledgers.clear();
        self.ambiguities.clear();
        self.masks.clear();
        self.mask_bases.clear();
        self.noted.clear();
        self.clouds.clear();
        self.poses.clear();
        self.runs.clear();
        self.layers.clear();
        self.inspections.clear();
        self.basins.clear();
        self.tools.clear();
        self.previews.clear();
        self.looked_up.clear();
        self.chosen.clear();
        self.made.clear();
        self.latest.clear();
        self.latest_inspections.clear();
        self.latest_basins.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_recently_used_go_first() {
        let mut cache: Cache<u32, u32> = Cache::new(30);
        for k in 0..3 {
            cache.insert(k, Arc::new(k), 10);
        }
        assert!(cache.get(&0).is_some());
        cache.insert(3, Arc::new(3), 10);
        assert!(cache.contains(&0) && !cache.contains(&1) && cache.contains(&2) && cache.contains(&3));
        assert_eq!(cache.bytes(), 30);
        cache.insert(3, Arc::new(4), 5);
        assert_eq!(cache.bytes(), 25);
        cache.insert(9, Arc::new(9), 100);
        assert_eq!((cache.len(), cache.bytes()), (1, 100));
        cache.retain(|_| false);
        assert_eq!((cache.len(), cache.bytes()), (0, 0));
    }
}
