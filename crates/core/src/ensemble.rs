//! Several predictions of one touch: their mean, where they disagree, and how the poses that follow from them fan out.
//!
//! A spread is the deviation of the seeds around their mean, with `n - 1` in the denominator: the seeds are a sample of
//! what the generator could have answered. The spread of the decoder's channels is the same for the three copies of one
//! depth that a three-channel decoder gives; it is there with a single seed already.

use serde::Serialize;

use super::grid::{DepthMap, Grid};
use super::postprocess::{DepthChain, PostprocessError, RawPrediction, Reduction};
use super::units::angle_error;

/// Mean and spread of images of one size, per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Mean, meters; NaN where no image has a value.
    pub mean: DepthMap,
    /// Standard deviation, meters; NaN where fewer than two images have a value.
    pub std: DepthMap,
    /// Images.
    pub count: usize,
}

impl Spread {
    /// Of images of the same size; `None` without an image, or with sizes that differ.
    pub fn of(images: &[&DepthMap]) -> Option<Self> {
        let size = images.first()?.size();
        if images.iter().any(|image| image.size() != size) {
            return None;
        }
        let mean_and_std = |x: usize, y: usize| -> (f64, f64) {
            // Welford's update: one pass that does not lose a small spread in a large mean.
            let (mut n, mut mean, mut squares) = (0.0, 0.0, 0.0);
            for value in images.iter().map(|image| f64::from(image[(x, y)])).filter(|v| v.is_finite()) {
                n += 1.0;
                let off = value - mean;
                mean += off / n;
                squares += off * (value - mean);
            }
            let std = if n > 1.0 { (squares / (n - 1.0)).max(0.0).sqrt() } else { f64::NAN };
            (if n > 0.0 { mean } else { f64::NAN }, std)
        };
        let both = Grid::from_fn(size[0], size[1], mean_and_std);
        Some(Self { mean: both.map(|v| v.0 as f32), std: both.map(|v| v.1 as f32), count: images.len() })
    }

    /// The mean of the spread over the pixels that have one, meters; NaN if none has.
    pub fn mean_std(&self) -> f64 {
        let (mut sum, mut n) = (0.0, 0usize);
        for &v in self.std.as_slice().iter().filter(|v| v.is_finite()) {
            sum += f64::from(v);
            n += 1;
        }
        if n == 0 { f64::NAN } else { sum / n as f64 }
    }

    /// The largest spread, meters; NaN if no pixel has one.
    pub fn max_std(&self) -> f64 {
        self.std.as_slice().iter().filter(|v| v.is_finite()).fold(f64::NAN, |max, &v| f64::from(v).max(max))
    }
}

/// Spread of the channels of one prediction, per pixel, meters, through the same steps as the depth itself; `None` for
/// a decoder of one channel.
///
/// # Errors
/// [`PostprocessError`] if the steps do not fit the picture.
pub fn channel_spread(raw: &RawPrediction, chain: &DepthChain) -> Result<Option<DepthMap>, PostprocessError> {
    if raw.channels.len() < 2 {
        return Ok(None);
    }
    let chain = DepthChain { reduction: Reduction::Mean, ..chain.clone() };
    let depths = raw
        .channels
        .iter()
        .map(|channel| chain.run(&RawPrediction { channels: vec![channel.clone()] }))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Spread::of(&depths.iter().collect::<Vec<_>>()).map(|spread| spread.std))
}

/// Angles around their circular mean.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AngleFan {
    /// The angles, radians, in the order given.
    pub angles_rad: Vec<f64>,
    /// The direction of the sum of their unit vectors, radians, in (-pi, pi]; `None` where they cancel out.
    pub mean_rad: Option<f64>,
    /// Circular standard deviation, `sqrt(-2 ln R)` with R the length of the mean unit vector, radians.
    pub std_rad: f64,
    /// The angles farthest to either side of the mean, as differences from it (first negative), radians.
    pub extremes_rad: [f64; 2],
}

impl AngleFan {
    /// A mean vector shorter than this has no direction.
    const NO_DIRECTION: f64 = 1e-9;

    /// Of finite angles, radians; others are left out. `None` if none is left.
    pub fn of(angles: &[f64]) -> Option<Self> {
        let angles_rad: Vec<f64> = angles.iter().copied().filter(|a| a.is_finite()).collect();
        if angles_rad.is_empty() {
            return None;
        }
        let n = angles_rad.len() as f64;
        let (sin, cos) = angles_rad.iter().fold((0.0, 0.0), |(s, c), a| (s + a.sin(), c + a.cos()));
        let length = (sin.hypot(cos) / n).min(1.0);
        if length < Self::NO_DIRECTION {
            return Some(Self { angles_rad, mean_rad: None, std_rad: f64::INFINITY, extremes_rad: [f64::NAN; 2] });
        }
        let mean = sin.atan2(cos);
        let off = |a: &f64| {
            let d = a - mean;
            d.sin().atan2(d.cos())
        };
        let extremes_rad = angles_rad.iter().map(off).fold([0.0, 0.0], |[lo, hi]: [f64; 2], d| [lo.min(d), hi.max(d)]);
        // Angles that are equal give a length of 1 up to rounding; the rounding must not look like a spread.
        let std_rad = if 1.0 - length < 1e-15 { 0.0 } else { (-2.0 * length.ln()).sqrt() };
        Some(Self { angles_rad, mean_rad: Some(mean), std_rad, extremes_rad })
    }

    /// Size of the mean's error against a true angle, radians.
    pub fn error_rad(&self, truth_rad: f64) -> Option<f64> {
        self.mean_rad.map(|mean| angle_error(mean, truth_rad))
    }
}

/// A dial on which a fan is drawn: the mean points up, and what is a few degrees wide fills it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dial {
    /// Mean angle, which points up, radians.
    pub mean_rad: f64,
    /// The ends of the dial, as differences from the mean, radians.
    pub reach_rad: f64,
}

impl Dial {
    /// The dial shows at least this much to either side of the mean, radians.
    const LEAST: f64 = 0.0349;
    /// Lean of its ends, radians.
    const LEAN: f64 = 1.05;

    /// For a fan and other angles beside it; `None` for a fan without a mean. An odd one does not press the others
    /// into one line: then it lies at the end.
    pub fn of(fan: &AngleFan, others: &[f64]) -> Option<Self> {
        let mean_rad = fan.mean_rad?;
        let most = fan.extremes_rad.iter().map(|e| e.abs()).fold(Self::LEAST, f64::max);
        let dial = Self { mean_rad, reach_rad: most };
        let reach = others.iter().filter(|a| a.is_finite()).map(|a| dial.off(*a).abs()).fold(most, f64::max);
        Some(Self { reach_rad: reach.min(4.0 * most) * 1.1, ..dial })
    }

    /// The difference of an angle from the mean, in (-pi, pi], radians.
    pub fn off(&self, angle: f64) -> f64 {
        let d = angle - self.mean_rad;
        d.sin().atan2(d.cos())
    }

    /// Lean of a difference from the mean to the right of "up", radians.
    pub fn lean(&self, off: f64) -> f64 {
        (off / self.reach_rad).clamp(-1.0, 1.0) * Self::LEAN
    }
}

/// The seeds of an ensemble of `count`: the first, and those that follow it.
pub fn seeds(first: u64, count: usize) -> Vec<u64> {
    (0..count as u64).map(|i| first.wrapping_add(i)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::postprocess::{DepthRange, Mapping, Shift};
    use crate::resample::Resampling;

    #[test]
    fn mean_and_spread_per_pixel_and_nothing_of_nothing() {
        let image = |v: f32| Grid::from_vec(2, 1, vec![v, f32::NAN]).unwrap();
        let images = [image(0.001), image(0.002), image(0.006)];
        let spread = Spread::of(&images.iter().collect::<Vec<_>>()).unwrap();
        assert!((spread.mean[(0, 0)] - 0.003).abs() < 1e-9);
        // sqrt((4 + 1 + 9) / 2) mm
        assert!((f64::from(spread.std[(0, 0)]) - 7f64.sqrt() * 1e-3).abs() < 1e-9);
        assert!(spread.mean[(1, 0)].is_nan() && spread.std[(1, 0)].is_nan());
        assert!((spread.mean_std() - 7f64.sqrt() * 1e-3).abs() < 1e-9 && spread.max_std() > 0.0026);
        let one = Spread::of(&[&images[0]]).unwrap();
        assert!(one.std[(0, 0)].is_nan() && one.mean[(0, 0)] == 0.001 && one.mean_std().is_nan());
        assert!(one.max_std().is_nan());
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[&images[0], &Grid::filled(3, 1, 0.0)]), None);
        // A spread of a micrometer around a meter survives 32 bits in and out.
        let large = [Grid::filled(1, 1, 1.0f32), Grid::filled(1, 1, 1.000_001)];
        let spread = Spread::of(&large.iter().collect::<Vec<_>>()).unwrap();
        assert!((f64::from(spread.std[(0, 0)]) - 0.707e-6).abs() < 0.1e-6);
    }

    #[test]
    fn channels_disagree_in_meters_and_one_channel_cannot() {
        let chain = DepthChain {
            range: DepthRange { min_m: 0.0, max_m: 0.02 },
            mapping: Mapping::Correct,
            reduction: Reduction::Luma,
            shift: Shift::None,
            correction: None,
            size: [2, 2],
            resampling: Resampling::Bilinear,
            rotation_deg: 180,
            window: None,
            offset: [0.0; 2],
        };
        // 5, 10 and 15 mm.
        let raw = RawPrediction { channels: [-0.5, 0.0, 0.5].map(|v| Grid::filled(2, 2, v)).to_vec() };
        let spread = channel_spread(&raw, &chain).unwrap().unwrap();
        assert!(spread.as_slice().iter().all(|v| (v - 0.005).abs() < 1e-6), "{spread:?}");
        let one = RawPrediction { channels: vec![Grid::filled(2, 2, 0.0)] };
        assert_eq!(channel_spread(&one, &chain).unwrap(), None);
    }

    #[test]
    fn a_fan_across_the_turn_has_its_mean_there() {
        let fan = AngleFan::of(&[3.1, -3.1, f64::NAN]).unwrap();
        assert!((fan.mean_rad.unwrap().abs() - std::f64::consts::PI).abs() < 1e-9);
        assert!((fan.std_rad - 0.0416).abs() < 1e-3, "{fan:?}");
        assert!((fan.extremes_rad[0] + 0.0416).abs() < 1e-3 && (fan.extremes_rad[1] - 0.0416).abs() < 1e-3);
        assert!(fan.error_rad(3.1).unwrap() < 0.05);
        let equal = AngleFan::of(&[0.3; 5]).unwrap();
        assert!(equal.std_rad == 0.0 && (equal.mean_rad.unwrap() - 0.3).abs() < 1e-12);
        let opposite = AngleFan::of(&[0.0, std::f64::consts::PI]).unwrap();
        assert!(opposite.mean_rad.is_none() && opposite.error_rad(0.0).is_none());
        assert_eq!(AngleFan::of(&[f64::INFINITY]), None);
        let dial = Dial::of(&fan, &[3.0, 0.0]).unwrap();
        // What is half a turn off lies at the end.
        assert!(dial.reach_rad < 0.2 && dial.lean(dial.off(0.0)).abs() == Dial::LEAN, "{dial:?}");
        assert!(dial.lean(dial.off(3.1)) * dial.lean(dial.off(-3.1)) < 0.0);
        assert_eq!(Dial::of(&opposite, &[]), None);
    }
}
