//! The paper's shift with statistics of a data set's own predictions and measurements.

use serde::{Deserialize, Serialize};

use super::{DepthChain, PostprocessError, RawPrediction, ShiftStats};
use crate::grid::DepthMap;
use crate::moments::Moments;

/// The start of a bundle's hash: enough to tell bundles apart and to be named in a message.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BundleTag([u8; 16]);

impl BundleTag {
    /// Of a bundle's hash or other name; what is longer than 16 bytes is cut.
    pub fn of(hash: &str) -> Self {
        let mut tag = [0; 16];
        for (to, from) in tag.iter_mut().zip(hash.bytes()) {
            *to = from;
        }
        Self(tag)
    }

    /// The text it was made from, cut.
    pub fn text(&self) -> String {
        let end = self.0.iter().position(|b| *b == 0).unwrap_or(self.0.len());
        String::from_utf8_lossy(&self.0[..end]).into_owned()
    }
}

impl std::fmt::Debug for BundleTag {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text())
    }
}

/// Statistics for a shift as part of a recipe: they compare and hash by their bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(from = "Stored", into = "Stored")]
pub struct RefitShift {
    bits: [u64; 4],
    bundle: BundleTag,
}

/// A [`RefitShift`] in a file.
#[derive(Serialize, Deserialize)]
struct Stored {
    bundle: String,
    stats: ShiftStats,
}

impl From<Stored> for RefitShift {
    fn from(stored: Stored) -> Self {
        Self::new(stored.stats, &stored.bundle)
    }
}

impl From<RefitShift> for Stored {
    fn from(refit: RefitShift) -> Self {
        Self { bundle: refit.bundle.text(), stats: refit.stats() }
    }
}

impl RefitShift {
    /// The statistics of a bundle's predictions.
    pub fn new(stats: ShiftStats, bundle_hash: &str) -> Self {
        let ShiftStats { pred_mean, pred_std, gt_mean, gt_std } = stats;
        // + 0.0 turns -0 into 0, which means the same.
        let bits = [pred_mean, pred_std, gt_mean, gt_std].map(|v| (v + 0.0).to_bits());
        Self { bits, bundle: BundleTag::of(bundle_hash) }
    }

    /// The statistics.
    pub fn stats(&self) -> ShiftStats {
        let [pred_mean, pred_std, gt_mean, gt_std] = self.bits.map(f64::from_bits);
        ShiftStats { pred_mean, pred_std, gt_mean, gt_std }
    }

    /// Whose predictions they are of.
    pub fn bundle(&self) -> BundleTag {
        self.bundle
    }

    /// # Errors
    /// A sentence that names both, if the statistics are of another bundle than `bundle_hash`.
    pub fn check(&self, bundle_hash: &str) -> Result<(), String> {
        let other = BundleTag::of(bundle_hash);
        if self.bundle == other {
            return Ok(());
        }
        Err(format!(
            "the shift statistics are of the bundle {:?}, the prediction is of the bundle {other:?}: statistics of one \
             model say nothing about another; compute them for this bundle, or choose another range mapping",
            self.bundle
        ))
    }
}

/// Statistics in the making: one pass over predictions and measurements.
#[derive(Clone, Debug, Default)]
pub struct ShiftFit {
    /// Raw predictions in meters (doubled mapping), at the decoder's size.
    pub predicted: Moments,
    /// Measured imprints, meters.
    pub measured: Moments,
    /// Touches added.
    pub touches: u64,
}

impl ShiftFit {
    /// Adds one touch. `chain` is that of [`super::ShiftMode::Raw`].
    ///
    /// # Errors
    /// If the picture does not fit the chain; nothing is added then.
    pub fn add(
        &mut self,
        chain: &DepthChain,
        raw: &RawPrediction,
        measured: &DepthMap,
    ) -> Result<(), PostprocessError> {
        let meters = chain.meters(raw)?;
        self.predicted.extend(meters.as_slice().iter().map(|&v| f64::from(v)));
        self.measured.extend(measured.as_slice().iter().map(|&v| f64::from(v)));
        self.touches += 1;
        Ok(())
    }

    /// The statistics; `None` without a pixel on one of the sides.
    pub fn stats(&self) -> Option<ShiftStats> {
        Some(ShiftStats {
            pred_mean: self.predicted.mean()?,
            pred_std: self.predicted.std()?,
            gt_mean: self.measured.mean()?,
            gt_std: self.measured.std()?,
        })
    }
}
