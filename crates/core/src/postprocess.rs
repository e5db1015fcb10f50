//! From a decoder's picture to depth in meters.
//!
//! The released script maps its range twice: the decoder's [-1, 1] is first brought to [0, 1], and that is then treated
//! as [-1, 1] again, so that it saves `(depth + max) / 2`. The paper's "pixel shift" mostly undoes this. [`ShiftMode`]
//! names the three readings of a picture; [`flags()`] says what is implausible about one.
//!
//! Source: the lab's `tactile_style_transfer_estimator.py` lines 363-411 and `test.py` lines 148-256.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

mod color;
mod correction;
mod flags;
mod refit;
mod stats;

pub use color::ColorChain;
pub use correction::{Correction, CorrectionPart, CorrectionParts, Response};
pub use flags::{Flag, FlagKind, Severity, flags};
pub use refit::{RefitShift, ShiftFit};
pub use stats::Stats;

use super::grid::{DepthMap, Grid};
use super::resample::{self, Resampling};

/// Weights of red, green and blue in the lab's gray value (torchvision's `rgb_to_grayscale`; their sum is 0.9999).
const LUMA: [f64; 3] = [0.2989, 0.587, 0.114];

/// A spread below this share of the values' size is rounding, not information (see [`Shift::PaperMeanStd`]).
const RELATIVE_NO_SPREAD: f64 = 1e-6;

/// Reduction of three channels to one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reduction {
    /// Their mean, as the paper says.
    #[default]
    Mean,
    /// Their luma, as the released code does.
    Luma,
}

/// Means and deviations for the paper's shift, meters. `pred` is of values in meters before the shift.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShiftStats {
    /// Mean of the predictions' raw values.
    pub pred_mean: f64,
    /// Deviation of the predictions' raw values.
    pub pred_std: f64,
    /// Mean of the measured imprints.
    pub gt_mean: f64,
    /// Deviation of the measured imprints.
    pub gt_std: f64,
}

/// Shift: what is done with the meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shift {
    /// Nothing.
    None,
    /// `(d - pred_mean) / pred_std · gt_std + gt_mean`. Where `pred_std` is (relatively) zero only the mean is moved.
    PaperMeanStd(ShiftStats),
    /// `2·d - max`: undoes the second mapping exactly.
    ExactInverse,
}

/// The user's choice between the three readings of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, strum::EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum ShiftMode {
    /// The released script's result: `(depth + max) / 2`.
    Raw,
    /// [`ShiftMode::Raw`] with the paper's mean-and-deviation shift.
    PaperShift,
    /// [`ShiftMode::Raw`] with its mapping undone: the depth itself.
    #[default]
    ExactInverse,
    /// [`ShiftMode::ExactInverse`] with only some parts of the bundle's fit to a rig; for a bundle without a fit the same
    /// as that.
    #[strum(disabled)]
    Parts(CorrectionParts),
    /// [`ShiftMode::Raw`] with the paper's shift by statistics of a data set's own predictions. The statistics are part
    /// of the choice, so that results made with different ones never stand for each other. Not among the modes that
    /// can be listed without a data set.
    #[strum(disabled)]
    Refit(RefitShift),
}

impl ShiftMode {
    /// Name on screen.
    pub fn label(self) -> &'static str {
        match self {
            ShiftMode::Raw => "Raw (released script)",
            ShiftMode::PaperShift => "Paper shift",
            ShiftMode::ExactInverse => "Exact inverse",
            ShiftMode::Parts(CorrectionParts::NONE) => "Exact inverse, without the fit",
            ShiftMode::Parts(_) => "Exact inverse, parts of the fit",
            ShiftMode::Refit(_) => "Refit on this data set",
        }
    }
}

/// A range of depth, meters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct DepthRange {
    /// Depth that -1 stands for.
    pub min_m: f64,
    /// Depth that 1 stands for.
    pub max_m: f64,
}

impl From<[f64; 2]> for DepthRange {
    fn from([min_m, max_m]: [f64; 2]) -> Self {
        Self { min_m, max_m }
    }
}

impl From<DepthRange> for [f64; 2] {
    fn from(range: DepthRange) -> Self {
        [range.min_m, range.max_m]
    }
}

impl DepthRange {
    /// True where the range is finite and not empty.
    pub fn is_valid(self) -> bool {
        self.min_m.is_finite() && self.max_m.is_finite() && self.min_m < self.max_m
    }
}

/// A decoder's picture before any mapping: one to four channels of about -1 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct RawPrediction {
    /// All of one size.
    pub channels: Vec<Grid<f32>>,
}

/// Why a picture cannot become a depth map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PostprocessError {
    /// The model's bundle holds no statistics.
    #[error(
        "this model has no shift statistics, so the paper's shift cannot be applied; choose the raw value or the exact inverse"
    )]
    NoStatistics,
    /// Luma needs colors.
    #[error("luma needs 3 channels, the prediction has {0}; the model's manifest should say \"mean\"")]
    Channels(usize),
    /// No channels, or channels of different size.
    #[error("the prediction has no image, or channels of different size")]
    Malformed,
    /// A range that is empty or not a number.
    #[error("the depth range {0} to {1} m is empty")]
    Range(f64, f64),
    /// A color picture was asked for its depth.
    #[error("this model predicts a color picture: it has no depth, and so no contact, points or pose")]
    NotDepth,
    /// Not three channels of one size.
    #[error("a color picture needs 3 channels of one size, the prediction has {0}; correct the model's manifest")]
    NotColor(usize),
    /// A correction for pictures of another size.
    #[error("the fit is for pictures of another size than {0:?} pixels; fit the bundle again")]
    Correction([usize; 2]),
    /// A rotation other than by 0 or 180 degrees.
    #[error("a rotation by {0} degrees is not supported; only 0 and 180 are")]
    Rotation(u32),
}

/// The steps from a decoder's picture to a depth map in the raw orientation of the lab's files.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthChain {
    /// Depths that -1 and 1 stand for. Values outside are clamped, as the lab does.
    pub range: DepthRange,
    /// Reduction of the channels to one.
    pub reduction: Reduction,
    /// Shift of the meters.
    pub shift: Shift,
    /// Correction that a fit to the pad's pairs adds.
    pub correction: Option<Arc<Correction>>,
    /// `[width, height]` of the result, pixels.
    pub size: [usize; 2],
    /// Resampling to that size.
    pub resampling: Resampling,
    /// Rotation to the raw orientation: 0 or 180 degrees.
    pub rotation_deg: u32,
    /// Center of the color sensor's window where the model draws it, whichever pad it is on: shares of the result's
    /// width and height. `None` of a model that draws each pad's where it lies.
    pub window: Option<[f64; 2]>,
    /// Shift of the decoder's picture to the right and down, shares of its width and height; see
    /// [`DepthChain::placed`]. A correction with an offset of its own takes the place of this one.
    pub offset: [f64; 2],
}

/// A kind of image on the way.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// A channel of the decoder's picture, about -1 to 1.
    Channel,
    /// In meters.
    Meters,
    /// In meters, just after the shift.
    Shifted,
}

impl DepthChain {
    /// The chain with the shift of `mode`.
    ///
    /// # Errors
    /// [`PostprocessError::NoStatistics`] for [`ShiftMode::PaperShift`] without `stats`.
    pub fn with_mode(mut self, mode: ShiftMode, stats: Option<ShiftStats>) -> Result<Self, PostprocessError> {
        self.shift = match mode {
            ShiftMode::Raw => Shift::None,
            ShiftMode::PaperShift => Shift::PaperMeanStd(stats.ok_or(PostprocessError::NoStatistics)?),
            ShiftMode::ExactInverse | ShiftMode::Parts(_) => Shift::ExactInverse,
            ShiftMode::Refit(refit) => Shift::PaperMeanStd(refit.stats()),
        };
        Ok(self)
    }

    /// The chain of a pad that has the center of its color window at these shares of the picture ([`Rig::window_share`]):
    /// moved from where the model draws it. Unchanged where either side does not say.
    ///
    /// [`Rig::window_share`]: super::rig::Rig::window_share
    #[must_use]
    pub fn placed(mut self, window: Option<[f64; 2]>) -> Self {
        if let Some((to, from)) = window.zip(self.window) {
            let sign = if self.rotation_deg == 180 { -1.0 } else { 1.0 };
            self.offset = [0, 1].map(|i| sign * (to[i] - from[i]));
        }
        self
    }

    /// True where the picture is moved to the rig's window: a fit counts its own offset from where the model draws.
    fn moved(&self) -> bool {
        self.offset != [0.0; 2] && !self.correction.as_ref().is_some_and(|fit| fit.has(CorrectionPart::Offset))
    }

    /// Runs the chain. NaN pixels stay NaN and spread by the resizing.
    ///
    /// # Errors
    /// See [`PostprocessError`].
    pub fn run(&self, raw: &RawPrediction) -> Result<DepthMap, PostprocessError> {
        self.walk(raw, &mut |_, _| {})
    }

    /// The picture in meters before any shift, at the decoder's size: what statistics for a shift are taken of.
    ///
    /// # Errors
    /// See [`PostprocessError`].
    pub fn meters(&self, raw: &RawPrediction) -> Result<DepthMap, PostprocessError> {
        self.check()?;
        Ok(self.denormalized(raw, &self.weights(raw)?))
    }

    fn check(&self) -> Result<(), PostprocessError> {
        let DepthRange { min_m, max_m } = self.range;
        if !self.range.is_valid() {
            return Err(PostprocessError::Range(min_m, max_m));
        }
        if !matches!(self.rotation_deg, 0 | 180) {
            return Err(PostprocessError::Rotation(self.rotation_deg));
        }
        Ok(())
    }

    /// The lab clamps and maps each channel before it makes them one.
    fn denormalized(&self, raw: &RawPrediction, weights: &[f64]) -> Grid<f32> {
        let DepthRange { min_m, max_m } = self.range;
        combine(&raw.channels, weights, |v| {
            let unit = (f64::from(v).clamp(-1.0, 1.0) + 1.0) / 2.0;
            // Mapped twice, as the released script does.
            (unit + 1.0) / 2.0 * (max_m - min_m) + min_m
        })
    }

    /// Runs the chain; `look` sees the images on the way.
    fn walk(&self, raw: &RawPrediction, look: &mut dyn FnMut(Stage, &Grid<f32>)) -> Result<DepthMap, PostprocessError> {
        self.check()?;
        let weights = self.weights(raw)?;
        raw.channels.iter().for_each(|channel| look(Stage::Channel, channel));
        let meters = self.denormalized(raw, &weights);
        look(Stage::Meters, &meters);
        let mut depth = self.shift.apply(meters, self.range.max_m);
        look(Stage::Shifted, &depth);
        if self.moved() {
            let [width, height] = depth.size();
            depth = resample::moved(&depth, [self.offset[0] * width as f64, self.offset[1] * height as f64]);
            look(Stage::Meters, &depth);
        }
        if let Some(correction) = &self.correction {
            if !correction.fits(depth.size()) {
                return Err(PostprocessError::Correction(depth.size()));
            }
            depth = correction.apply(&depth);
            look(Stage::Meters, &depth);
        }
        let resized = self.resampling.resize(&depth, self.size[0], self.size[1]);
        let turned = if self.rotation_deg == 180 { resized.rotated_180() } else { resized };
        look(Stage::Meters, &turned);
        Ok(turned)
    }

    fn weights(&self, raw: &RawPrediction) -> Result<Vec<f64>, PostprocessError> {
        let first = raw.channels.first().ok_or(PostprocessError::Malformed)?;
        if first.is_empty() || raw.channels.iter().any(|c| c.size() != first.size()) {
            return Err(PostprocessError::Malformed);
        }
        match (raw.channels.len(), self.reduction) {
            (1, _) => Ok(vec![1.0]),
            (n, Reduction::Mean) => Ok(vec![1.0 / n as f64; n]),
            (3, Reduction::Luma) => Ok(LUMA.to_vec()),
            (n, Reduction::Luma) => Err(PostprocessError::Channels(n)),
        }
    }
}

fn combine(channels: &[Grid<f32>], weights: &[f64], map: impl Fn(f32) -> f64) -> Grid<f32> {
    Grid::from_fn(channels[0].width(), channels[0].height(), |x, y| {
        channels.iter().zip(weights).map(|(c, w)| w * map(c[(x, y)])).sum::<f64>() as f32
    })
}

impl ShiftStats {
    /// True where the predictions' deviation is as good as zero beside their mean and the range that ends at `max_m`.
    pub fn has_no_spread(&self, max_m: f64) -> bool {
        let size = self.pred_mean.abs().max(max_m.abs());
        self.pred_std.is_nan() || self.pred_std <= RELATIVE_NO_SPREAD * size
    }

    /// Gain and offset (meters) of the shift: `gain · d + offset`.
    pub fn affine(&self, max_m: f64) -> [f64; 2] {
        let gain = if self.has_no_spread(max_m) { 1.0 } else { self.gt_std / self.pred_std };
        [gain, self.gt_mean - gain * self.pred_mean]
    }
}

impl Shift {
    /// The shifted image.
    fn apply(self, meters: Grid<f32>, max_m: f64) -> Grid<f32> {
        match self {
            Shift::None => meters,
            Shift::ExactInverse => meters.map(|&d| (2.0 * f64::from(d) - max_m) as f32),
            Shift::PaperMeanStd(s) => {
                let [gain, _] = s.affine(max_m);
                meters.map(|&d| ((f64::from(d) - s.pred_mean) * gain + s.gt_mean) as f32)
            }
        }
    }
}

#[cfg(test)]
mod tests;
