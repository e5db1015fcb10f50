//! From a decoder's picture to what a color sensor would have seen.

use super::{PostprocessError, RawPrediction};
use crate::grid::RgbGrid;
use crate::resample::Resampling;

/// The steps to a color sensor's difference of touched and untouched image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorChain {
    /// Differences that -1 and 1 stand for, on the 0..255 scale.
    pub range: [f64; 2],
    /// `[width, height]` of the sensor's picture.
    pub size: [usize; 2],
    /// Resampling that brings the decoder's picture to that size.
    pub resampling: Resampling,
    /// Rotation to the sensor's raw orientation: 0 or 180 degrees.
    pub rotation_deg: u32,
}

impl ColorChain {
    /// The difference, signed, 0..255 scale.
    ///
    /// # Errors
    /// [`PostprocessError::NotColor`] unless there are three channels of one size.
    pub fn run(&self, raw: &RawPrediction) -> Result<RgbGrid, PostprocessError> {
        let [r, g, b] = &raw.channels[..] else { return Err(PostprocessError::NotColor(raw.channels.len())) };
        if r.size() != g.size() || r.size() != b.size() {
            return Err(PostprocessError::NotColor(raw.channels.len()));
        }
        let [lo, hi] = self.range;
        let value = |v: f32| ((f64::from(v) + 1.0) / 2.0 * (hi - lo) + lo) as f32;
        let picture = RgbGrid::from_fn(r.width(), r.height(), |x, y| [r, g, b].map(|plane| value(plane[(x, y)])));
        let [width, height] = self.size;
        let sized = self.resampling.resize_rgb(&picture, width, height);
        Ok(if self.rotation_deg == 180 { sized.rotated_180() } else { sized })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn minus_one_to_one_is_the_range_and_the_picture_is_turned() {
        let chain =
            ColorChain { range: [-100.0, 50.0], size: [2, 1], resampling: Resampling::Bilinear, rotation_deg: 180 };
        let plane = |left: f32, right: f32| Grid::from_vec(2, 1, vec![left, right]).unwrap();
        let raw = RawPrediction { channels: vec![plane(-1.0, 1.0), plane(0.0, 0.0), plane(1.0, 1.0)] };
        let picture = chain.run(&raw).unwrap();
        assert_eq!(picture.as_slice(), [[50.0, -25.0, 50.0], [-100.0, -25.0, 50.0]]);
        let two = RawPrediction { channels: raw.channels[..2].to_vec() };
        assert!(chain.run(&two).is_err());
    }
}
