//! Results, each under the recipe that made it, within a budget of bytes.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;

use super::inspect::Inspection;
use super::keys::{
    BasinKey, CloudKey, EnsembleKey, ImprintSource, MaskKey, PairKey, PoseKey, Recipe, RunKey, ShiftMode, TouchKey,
};
use super::services::{Generated, NamedTool};
use crate::domain::align::basin::Basin;
use crate::domain::align::reason::{Reason, ReasonCounts};
use crate::domain::align::{AlignReport, Directions, PointFit, TraceStep};
use crate::domain::ambiguity::Ambiguity;
use crate::domain::ensemble::Spread;
use crate::domain::frames::PlanarPose;
use crate::domain::grid::{DepthMap, Grid, Mask, RgbGrid};
use crate::domain::metrics::Split;
use crate::domain::postprocess::{ChainReading, Ledger};
use crate::domain::rig::{PadId, PerPad};
use crate::domain::sample::{Sample, Scale};

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

/// What the generator made, before any shift.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// How it was made: the seed is in here.
    pub recipe: Recipe,
    /// The generator's own output, with the ways to metres.
    pub output: Generated,
    /// Time it took, seconds.
    pub seconds: f64,
}

/// A prediction as it looks on the way.
#[derive(Clone, Debug)]
pub struct Preview {
    /// What is being made.
    pub recipe: Recipe,
    /// Steps done.
    pub step: u32,
    /// Steps in all.
    pub of: u32,
    /// As the model sees it now, metres, as large as the bubble image.
    pub depth: DepthMap,
}

/// Several predictions of one touch against each other.
#[derive(Clone, Debug)]
pub struct Ensemble {
    /// Around their mean, metres.
    pub spread: Spread,
    /// Mean over them of the spread of the decoder's channels, metres; `None` for a decoder of one channel.
    pub channels: Option<DepthMap>,
}

impl Ensemble {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        4 * (2 * self.spread.mean.len() + self.channels.as_ref().map_or(0, Grid::len))
    }
}

/// A prediction against the measurement of the same touch.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Predicted minus measured, metres; NaN where either is.
    pub error: DepthMap,
    /// Peak signal-to-noise ratio as the lab computes it, decibels; `None` if it is not defined.
    pub psnr_db: Option<f64>,
    /// Structural similarity as the lab computes it; `None` if it is not defined.
    pub ssim: Option<f64>,
    /// Mean absolute error, metres; NaN without a pixel to compare.
    pub mae_m: f64,
    /// Whether PSNR and SSIM are of metres, or (assumed scale) of images stretched to 0..1 each.
    pub scale: Scale,
    /// The same figures inside and outside the GelSlim's footprint, errors in metres; `None` where nobody asked.
    pub split: Option<Split>,
}

/// The depth chain of a prediction.
#[derive(Clone, Debug)]
pub struct LedgerResult {
    /// Every stage, the result against the truth, and what is implausible.
    pub ledger: Ledger,
    /// The same picture in every way to metres.
    pub readings: Vec<ChainReading>,
}

/// The surface points of both fingers in the grasp frame.
#[derive(Clone, Debug, Default)]
pub struct Clouds {
    /// Per finger.
    pub fingers: PerPad<FingerCloud>,
}

/// The surface points of one finger, one per pixel with a measurement, row by row.
#[derive(Clone, Debug, Default)]
pub struct FingerCloud {
    /// Positions, metres, grasp frame.
    pub points: Vec<DVec3>,
    /// The raw bubble pixel `(x, y)` of each point.
    pub pixels: Vec<[u16; 2]>,
    /// Whether each point is a contact point.
    pub contact: Vec<bool>,
}

impl Clouds {
    /// The cloud of one finger.
    pub fn finger(&self, finger: PadId) -> Option<&FingerCloud> {
        self.fingers[finger].as_ref()
    }

    /// The contact points of both fingers, right first: what is registered.
    pub fn contact_points(&self) -> Vec<DVec3> {
        let fingers = self.fingers.iter().flatten();
        fingers
            .flat_map(|f| f.points.iter().zip(&f.contact).filter(|(_, contact)| **contact).map(|(p, _)| *p))
            .collect()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.fingers.iter().flatten().map(|f| f.points.len() * 32).sum()
    }
}

impl FingerCloud {
    /// The index of the point at a raw bubble pixel. Points are in row order, so this is a binary search.
    pub fn at_pixel(&self, x: usize, y: usize) -> Option<usize> {
        self.pixels.binary_search_by_key(&(y, x), |p| (p[1].into(), p[0].into())).ok()
    }
}

/// A registered pose.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseResult {
    /// The tool in the hand.
    pub grasp_from_object: PlanarPose,
    /// The angle that the lab reports: of `object_from_grasp`, radians.
    pub angle_rad: f64,
    /// The true angle in the same sense, where known.
    pub truth_rad: Option<f64>,
    /// Size of the angle's error, where the truth is known.
    pub error_rad: Option<f64>,
    /// Root mean square of the residuals, metres.
    pub rms_m: f64,
    /// Contact points registered.
    pub num_points: usize,
    /// Why it stopped, in words.
    pub stop: String,
    /// Whether it stopped because nothing moved any more.
    pub converged: bool,
    /// Time it took, milliseconds.
    pub ms: f64,
    /// Everything the registration says about itself; with trace and fits only in [`Results::runs`].
    pub report: AlignReport,
}

impl PoseResult {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.report.trace.len() * size_of::<TraceStep>()
            + self.report.fits.len() * size_of::<PointFit>()
    }
}

/// What the layers show of one registration.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerResult {
    /// The registered pose that they are of, `grasp_from_object`.
    pub grasp_from_object: PlanarPose,
    /// The reason of every pixel.
    pub reasons: PerPad<Grid<Reason>>,
    /// Residual (metres) and weight of every contact point, in the order of the cloud.
    pub fits: PerPad<Vec<PointFit>>,
    /// Pixels per reason.
    pub counts: PerPad<ReasonCounts>,
    /// Residuals of the contact points of both fingers by size: shares of [`LayerResult::range_m`].
    pub histogram: Vec<u32>,
    /// Contact points with a larger residual than the range.
    pub above: u32,
    /// Largest residual of the histogram and of the heat map, metres.
    pub range_m: f64,
    /// Width of the narrowest kernel, metres; `None` for an engine without one.
    pub kernel_m: Option<f64>,
    /// Distances in both directions; `None` without points on one side.
    pub directions: Option<Directions>,
}

impl LayerResult {
    /// Residual, weight and reason at a raw bubble pixel; the fit only where the pixel is a contact point.
    pub fn at(&self, finger: PadId, cloud: &FingerCloud, pixel: [u16; 2]) -> Option<(Reason, Option<PointFit>)> {
        let (x, y) = (usize::from(pixel[0]), usize::from(pixel[1]));
        let reason = *self.reasons[finger].as_ref()?.get(x, y)?;
        let fit = cloud.at_pixel(x, y).filter(|at| cloud.contact.get(*at) == Some(&true)).and_then(|at| {
            let before = cloud.contact[..at].iter().filter(|c| **c).count();
            self.fits[finger].as_ref()?.get(before).copied()
        });
        Some((reason, fit))
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let pixels: usize = self.reasons.iter().flatten().map(Grid::len).sum();
        pixels + self.fits.iter().flatten().map(|f| f.len() * size_of::<PointFit>()).sum::<usize>() + size_of::<Self>()
    }
}

/// All caches.
#[derive(Debug)]
pub struct Results {
    /// Loaded pairs.
    pub samples: Cache<PairKey, Sample>,
    /// Small pictures of the measured imprint (right finger, else left).
    pub thumbnails: Cache<PairKey, DepthMap>,
    /// Raw predictions.
    pub predictions: Cache<Recipe, Prediction>,
    /// Predictions in metres, as large as the bubble image.
    pub imprints: Cache<(Recipe, ShiftMode), DepthMap>,
    /// Predictions of a color sensor: differences, 0..255 scale.
    pub colors: Cache<Recipe, RgbGrid>,
    /// Several predictions of one touch.
    pub ensembles: Cache<EnsembleKey, Ensemble>,
    /// Predictions against measurements.
    pub comparisons: Cache<(Recipe, ShiftMode), Comparison>,
    /// Depth chains.
    pub ledgers: Cache<(Recipe, ShiftMode), LedgerResult>,
    /// What GelSlim images leave open.
    pub ambiguities: Cache<TouchKey, Option<Ambiguity>>,
    /// Automatic masks.
    pub masks: Cache<MaskKey, Mask>,
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
    pub chosen: BTreeMap<TouchKey, Recipe>,
    /// All predictions made for each touch, oldest first.
    pub made: BTreeMap<TouchKey, Vec<Recipe>>,
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

    #[test]
    fn points_are_found_by_pixel() {
        let cloud = FingerCloud {
            points: vec![DVec3::ZERO; 3],
            pixels: vec![[5, 0], [1, 2], [3, 2]],
            contact: vec![false, true, true],
        };
        assert_eq!(cloud.at_pixel(3, 2), Some(2));
        assert_eq!(cloud.at_pixel(2, 2), None);
        let clouds = Clouds { fingers: [None, Some(cloud)].into() };
        assert_eq!(clouds.contact_points().len(), 2);
    }
}
