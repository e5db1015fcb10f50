//! Color maps for depth (sequential) and error (diverging); CPU twin of `shaders/common/color.wgsl`.
//!
//! Colors are sRGB-encoded (what a PNG or a screen takes). A GPU test holds the two implementations together.

use serde::{Deserialize, Serialize};

/// sRGB color of a value that is not a number: a mid gray that neither map contains.
pub const NAN_COLOR: [f32; 3] = [0.42, 0.42, 0.42];

/// Color map: makes a color of a scalar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, strum::EnumIter)]
pub enum ColorMap {
    /// Dark blue to yellow, perceptually uniform, readable by the color-blind: depth and other amounts.
    #[default]
    Viridis,
    /// Blue, white, red, symmetric in lightness: signed errors around zero. Use it with [`Range::symmetric`].
    Diverging,
    /// Black to white.
    Gray,
}

/// Coefficients of viridis as a polynomial of degree 6, constant term first.
///
/// Source: fit by Matt Zucker (CC0) to matplotlib's viridis (CC0).
const VIRIDIS: [[f32; 3]; 7] = [
    [0.277_727_33, 0.005_407_344_5, 0.334_099_8],
    [0.105_093_04, 1.404_613_5, 1.384_590_1],
    [-0.330_861_83, 0.214_847_56, 0.095_095_16],
    [-4.634_230_6, -5.799_101, -19.332_441],
    [6.228_27, 14.179_934, 56.690_55],
    [4.776_385, -13.745_145, -65.353_03],
    [-5.435_456, 4.645_852_6, 26.312_435],
];

/// Stops of the diverging map from the negative end over zero to the positive end, equally spaced.
const DIVERGING: [[f32; 3]; 5] =
    [[0.02, 0.19, 0.38], [0.26, 0.58, 0.76], [0.97, 0.97, 0.97], [0.84, 0.38, 0.30], [0.40, 0.0, 0.12]];

impl ColorMap {
    /// `Viridis`, `Diverging`, `Gray`: for menus.
    pub fn name(self) -> &'static str {
        ["Viridis", "Diverging", "Gray"][self as usize]
    }

    /// The sRGB color, each part in 0..1, of a position `unit` in the range. Positions outside 0..1 take the end
    /// colors; NaN takes [`NAN_COLOR`].
    pub fn rgb(self, unit: f32) -> [f32; 3] {
        if unit.is_nan() {
            return NAN_COLOR;
        }
        let t = unit.clamp(0.0, 1.0);
        match self {
            Self::Viridis => {
                std::array::from_fn(|c| VIRIDIS.iter().rev().fold(0.0, |sum, k| sum * t + k[c]).clamp(0.0, 1.0))
            }
            Self::Diverging => {
                let s = t * 4.0;
                let i = (s as usize).min(3);
                let f = s - i as f32;
                std::array::from_fn(|c| DIVERGING[i][c] + (DIVERGING[i + 1][c] - DIVERGING[i][c]) * f)
            }
            Self::Gray => [t; 3],
        }
    }

    /// [`Self::rgb`] in bytes, rounded to nearest.
    pub fn rgb8(self, unit: f32) -> [u8; 3] {
        self.rgb(unit).map(|v| (v * 255.0 + 0.5) as u8)
    }

    /// The map sampled at 256 equally spaced positions, for images.
    pub fn table(self) -> [[u8; 3]; 256] {
        std::array::from_fn(|i| self.rgb8(i as f32 / 255.0))
    }
}

/// The values that the two ends of a color map stand for, in the unit of the data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Value at the lower end.
    pub lo: f32,
    /// Value at the upper end.
    pub hi: f32,
}

impl Range {
    /// From `-size` to `size`, so that the middle of a diverging map is zero.
    pub fn symmetric(size: f32) -> Self {
        Self { lo: -size.abs(), hi: size.abs() }
    }

    /// Smallest and largest finite value; `None` without a finite value.
    pub fn of<'a>(values: impl IntoIterator<Item = &'a f32>) -> Option<Self> {
        values.into_iter().filter(|v| v.is_finite()).fold(None, |range, &v| {
            Some(match range {
                None => Self { lo: v, hi: v },
                Some(Self { lo, hi }) => Self { lo: lo.min(v), hi: hi.max(v) },
            })
        })
    }

    /// Position of `value` in the range: 0 at `lo`, 1 at `hi`, clamped; NaN stays NaN. In an empty range
    /// (`hi <= lo`, or an end that is not finite) everything is in the middle.
    pub fn unit(self, value: f32) -> f32 {
        if value.is_nan() {
            return f32::NAN;
        }
        let span = self.hi - self.lo;
        if !(span > 0.0 && span.is_finite()) {
            return 0.5;
        }
        ((value - self.lo) / span).clamp(0.0, 1.0)
    }

    /// Round numbers in the range, at most `most` of them or one more; none in an empty range.
    pub fn ticks(self, most: usize) -> Vec<f32> {
        let span = self.hi - self.lo;
        if !(span > 0.0 && span.is_finite()) || most == 0 {
            return Vec::new();
        }
        let raw = span / most as f32;
        let base = 10f32.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * base).into_iter().find(|s| *s >= raw).unwrap_or(base * 10.0);
        let first = (self.lo / step).ceil() as i64;
        (0..=most as i64 + 1).map(|i| (first + i) as f32 * step).take_while(|v| *v <= self.hi + step * 1e-3).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viridis_passes_through_its_published_colors() {
        let published = [
            (0.0, [0x44, 0x01, 0x54]),
            (0.25, [0x3b, 0x52, 0x8b]),
            (0.5, [0x21, 0x91, 0x8c]),
            (1.0, [0xfd, 0xe7, 0x25]),
        ];
        for (t, want) in published {
            for (a, b) in ColorMap::Viridis.rgb8(t).iter().zip(want) {
                // The polynomial is a fit: its author gives no bound; 4 steps of 255 cannot be seen.
                assert!(a.abs_diff(b) <= 4, "{t}: {:?} for {want:?}", ColorMap::Viridis.rgb8(t));
            }
        }
    }
}
