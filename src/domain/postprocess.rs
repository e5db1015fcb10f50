//! From a decoder's picture to depth in metres: every step is a value, and every step can be looked at.
//!
//! The released script maps its range twice: the decoder's [-1, 1] is first brought to [0, 1], and that is then treated
//! as [-1, 1] again, so that it saves `(depth + max) / 2`. The paper's "pixel shift" mostly undoes this. [`ShiftMode`]
//! names the three readings of a picture; [`DepthChain::run_with_ledger`] shows what each step did.
//!
//! Source: the lab's `tactile_style_transfer_estimator.py` lines 363-411 and `test.py` lines 148-256.

use serde::{Deserialize, Serialize};

use super::grid::{DepthMap, Grid};
use super::resample::Resampling;

/// Weights of red, green and blue in the lab's grey value (torchvision's `rgb_to_grayscale`; their sum is 0.9999).
const LUMA: [f64; 3] = [0.2989, 0.587, 0.114];

/// A spread below this share of the values' size is rounding, not information (see [`Shift::PaperMeanStd`]).
const RELATIVE_NO_SPREAD: f64 = 1e-6;

/// How three channels become one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reduction {
    /// Their mean, as the paper says.
    #[default]
    Mean,
    /// Their luma, as the released code does.
    Luma,
}

/// How the decoder's [-1, 1] becomes metres.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mapping {
    /// `(v + 1) / 2 · (max - min) + min`.
    Correct,
    /// The released script's: the same formula applied to `(v + 1) / 2`, which gives `(depth + max) / 2`.
    Doubled,
}

/// Means and deviations for the paper's shift, metres. `pred` is of values mapped with [`Mapping::Doubled`].
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

/// What happens to the metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shift {
    /// Nothing.
    None,
    /// `(d - pred_mean) / pred_std · gt_std + gt_mean`. Where `pred_std` is (relatively) zero only the mean is moved.
    PaperMeanStd(ShiftStats),
    /// `2·d - max`: undoes [`Mapping::Doubled`] exactly.
    ExactInverse,
}

/// The user's choice between the three readings of a picture.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, strum::EnumIter,
)]
#[serde(rename_all = "snake_case")]
pub enum ShiftMode {
    /// What the released script saves: `(depth + max) / 2`.
    Raw,
    /// [`ShiftMode::Raw`] with the paper's mean-and-deviation shift.
    PaperShift,
    /// [`ShiftMode::Raw`] with its mapping undone: the depth itself.
    #[default]
    ExactInverse,
}

impl ShiftMode {
    /// All modes, in the order shown.
    pub const ALL: [ShiftMode; 3] = [ShiftMode::Raw, ShiftMode::PaperShift, ShiftMode::ExactInverse];

    /// What the user reads.
    pub fn label(self) -> &'static str {
        match self {
            ShiftMode::Raw => "Raw (released script)",
            ShiftMode::PaperShift => "Paper shift",
            ShiftMode::ExactInverse => "Exact inverse",
        }
    }
}

/// A range of depth, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub struct DepthRange {
    /// What -1 means.
    pub min_m: f64,
    /// What 1 means.
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
    /// Whether the range is finite and not empty.
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
    /// Luma needs colours.
    #[error("luma needs 3 channels, the prediction has {0}; the model's manifest should say \"mean\"")]
    Channels(usize),
    /// No channels, or channels of different size.
    #[error("the prediction has no image, or channels of different size")]
    Malformed,
    /// A range that is empty or not a number.
    #[error("the depth range {min_m} to {max_m} m is empty")]
    Range {
        /// Lower end, metres.
        min_m: f64,
        /// Upper end, metres.
        max_m: f64,
    },
    /// A rotation other than by 0 or 180 degrees.
    #[error("a rotation by {0} degrees is not supported; only 0 and 180 are")]
    Rotation(u32),
}

/// The steps from a decoder's picture to a depth map in the raw orientation of the lab's files.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthChain {
    /// What -1 and 1 mean. Values outside are clamped, as the lab does.
    pub range: DepthRange,
    /// How they become metres.
    pub mapping: Mapping,
    /// How channels become one.
    pub reduction: Reduction,
    /// What happens to the metres.
    pub shift: Shift,
    /// `[width, height]` of the result, pixels.
    pub size: [usize; 2],
    /// How it is resized.
    pub resampling: Resampling,
    /// Rotation to the raw orientation: 0 or 180 degrees.
    pub rotation_deg: u32,
}

/// Numbers about the finite pixels of an image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stats {
    /// Smallest value; NaN if there is no finite pixel (so for the next three).
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Population deviation.
    pub std: f64,
    /// Finite pixels.
    pub count: usize,
}

impl Stats {
    /// Two passes in f64, so that a large mean does not swallow a small spread.
    pub fn of(image: &Grid<f32>) -> Self {
        let values = || image.as_slice().iter().filter(|v| v.is_finite()).map(|&v| f64::from(v));
        let count = values().count();
        if count == 0 {
            return Self { min: f64::NAN, max: f64::NAN, mean: f64::NAN, std: f64::NAN, count };
        }
        let mean = values().sum::<f64>() / count as f64;
        let variance = values().map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64;
        Self {
            min: values().fold(f64::INFINITY, f64::min),
            max: values().fold(f64::NEG_INFINITY, f64::max),
            mean,
            std: variance.sqrt(),
            count,
        }
    }
}

/// What one step of the chain left behind.
#[derive(Clone, Debug, PartialEq)]
pub struct StageRecord {
    /// The step, for people.
    pub name: &'static str,
    /// The image after it. In metres from the mapping on.
    pub image: Grid<f32>,
    /// Its numbers.
    pub stats: Stats,
    /// Something the user should know, e.g. that a spread of zero was not divided by.
    pub note: Option<String>,
}

/// Is told of each stage: its name, the image after it, and a note.
type Recorder<'a> = dyn FnMut(&'static str, &Grid<f32>, Option<String>) + 'a;

impl DepthChain {
    /// The chain with the shift of `mode`.
    ///
    /// # Errors
    /// [`PostprocessError::NoStatistics`] for [`ShiftMode::PaperShift`] without `stats`.
    pub fn with_mode(mut self, mode: ShiftMode, stats: Option<ShiftStats>) -> Result<Self, PostprocessError> {
        self.mapping = Mapping::Doubled;
        self.shift = match mode {
            ShiftMode::Raw => Shift::None,
            ShiftMode::PaperShift => Shift::PaperMeanStd(stats.ok_or(PostprocessError::NoStatistics)?),
            ShiftMode::ExactInverse => Shift::ExactInverse,
        };
        Ok(self)
    }

    /// Runs the chain. NaN pixels stay NaN and spread by the resizing.
    ///
    /// # Errors
    /// See [`PostprocessError`].
    pub fn run(&self, raw: &RawPrediction) -> Result<DepthMap, PostprocessError> {
        self.walk(raw, &mut |_, _, _| {})
    }

    /// Runs the chain and keeps the image and its numbers after every step.
    ///
    /// # Errors
    /// See [`PostprocessError`].
    pub fn run_with_ledger(&self, raw: &RawPrediction) -> Result<(DepthMap, Vec<StageRecord>), PostprocessError> {
        let mut ledger = Vec::new();
        let depth = self.walk(raw, &mut |name, image, note| {
            ledger.push(StageRecord { name, image: image.clone(), stats: Stats::of(image), note });
        })?;
        Ok((depth, ledger))
    }

    fn walk(&self, raw: &RawPrediction, record: &mut Recorder<'_>) -> Result<DepthMap, PostprocessError> {
        let DepthRange { min_m, max_m } = self.range;
        if !self.range.is_valid() {
            return Err(PostprocessError::Range { min_m, max_m });
        }
        if !matches!(self.rotation_deg, 0 | 180) {
            return Err(PostprocessError::Rotation(self.rotation_deg));
        }
        let weights = self.weights(raw)?;
        record("Decoder", &combine(&raw.channels, &weights, f64::from), None);

        // The lab clamps and maps each channel before it makes them one.
        let metres = combine(&raw.channels, &weights, |v| {
            let unit = (f64::from(v).clamp(-1.0, 1.0) + 1.0) / 2.0;
            let unit = if self.mapping == Mapping::Doubled { (unit + 1.0) / 2.0 } else { unit };
            unit * (max_m - min_m) + min_m
        });
        let clamped = raw.channels.iter().flat_map(|c| c.as_slice()).filter(|v| v.abs() > 1.0).count();
        let note = (clamped > 0).then(|| format!("{clamped} values outside -1 to 1 were clamped"));
        record("Metres", &metres, note);

        let (shifted, note) = self.shift.apply(metres, max_m);
        record("Shift", &shifted, note);

        let [width, height] = self.size;
        let resized = self.resampling.resize(&shifted, width, height);
        let turned = if self.rotation_deg == 180 { resized.rotated_180() } else { resized };
        record("Raw orientation", &turned, None);
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

impl Shift {
    /// The shifted image and a note if the shift could not be applied as asked.
    fn apply(self, metres: Grid<f32>, max_m: f64) -> (Grid<f32>, Option<String>) {
        match self {
            Shift::None => (metres, None),
            Shift::ExactInverse => (metres.map(|&d| (2.0 * f64::from(d) - max_m) as f32), None),
            Shift::PaperMeanStd(s) => {
                let size = s.pred_mean.abs().max(max_m.abs());
                let no_spread = s.pred_std.is_nan() || s.pred_std <= RELATIVE_NO_SPREAD * size;
                let gain = if no_spread { 1.0 } else { s.gt_std / s.pred_std };
                let note = no_spread.then(|| {
                    format!(
                        "the predictions' deviation ({:e} m) is as good as zero: only the mean was shifted",
                        s.pred_std
                    )
                });
                (metres.map(|&d| ((f64::from(d) - s.pred_mean) * gain + s.gt_mean) as f32), note)
            }
        }
    }
}

#[cfg(test)]
mod tests;
