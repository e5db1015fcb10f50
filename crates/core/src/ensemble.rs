//! Several predictions of one touch: their mean, and where they disagree.
//!
//! A spread is the deviation of the seeds around their mean, with `n - 1` in the denominator: the seeds are a sample of
//! what the generator could have answered.

use super::grid::{DepthMap, Grid};

/// Mean and spread of images of one size, per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Mean, meters; NaN where no image has a value.
    pub mean: DepthMap,
    /// Standard deviation, meters; NaN where fewer than two images have a value.
    pub std: DepthMap,
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
        Some(Self { mean: both.map(|v| v.0 as f32), std: both.map(|v| v.1 as f32) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_spread_per_pixel_and_nothing_of_nothing() {
        let image = |v: f32| Grid::from_vec(2, 1, vec![v, f32::NAN]).unwrap();
        let images = [image(0.001), image(0.002), image(0.006)];
        let spread = Spread::of(&images.iter().collect::<Vec<_>>()).unwrap();
        assert!((spread.mean[(0, 0)] - 0.003).abs() < 1e-9);
        // sqrt((4 + 1 + 9) / 2) mm
        assert!((f64::from(spread.std[(0, 0)]) - 7f64.sqrt() * 1e-3).abs() < 1e-9);
        assert!(spread.mean[(1, 0)].is_nan() && spread.std[(1, 0)].is_nan());
        let one = Spread::of(&[&images[0]]).unwrap();
        assert!(one.std[(0, 0)].is_nan() && one.mean[(0, 0)] == 0.001);
        assert_eq!(Spread::of(&[]), None);
        assert_eq!(Spread::of(&[&images[0], &Grid::filled(3, 1, 0.0)]), None);
        // A spread of a micrometer around a meter survives 32 bits in and out.
        let large = [Grid::filled(1, 1, 1.0f32), Grid::filled(1, 1, 1.000_001)];
        let spread = Spread::of(&large.iter().collect::<Vec<_>>()).unwrap();
        assert!((f64::from(spread.std[(0, 0)]) - 0.707e-6).abs() < 0.1e-6);
    }
}
