//! Resizing images the way the models were trained: PyTorch's `interpolate` with `align_corners=False` and no
//! antialiasing, which is what torchvision 0.12 `Resize` does on tensors.
//!
//! Shrinking without antialiasing skips pixels. That is deliberate here: a model must see what it was trained on.
//!
//! Source of the formulas: the documentation of `torch.nn.functional.interpolate`; checked against torch by
//! `tests/data/resample.json`.

use serde::{Deserialize, Serialize};

use super::grid::{Grid, RgbGrid};

/// The sharpness of [`Resampling::Bicubic`]; PyTorch and OpenCV use -0.75.
const BICUBIC_A: f64 = -0.75;

/// Method by which an image is resized.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, strum::Display)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Resampling {
    /// Two taps per axis, see [`bilinear`].
    Bilinear,
    /// Four taps per axis (cubic convolution, a = -0.75); the border pixel is repeated outside the image. May overshoot
    /// the range of the input. NaN and empty images as in [`bilinear`].
    Bicubic,
    /// The mean of the pixels under the target pixel, see [`area`].
    Area,
}

impl Resampling {
    /// Resizes a one-channel image to `width × height` pixels.
    pub fn resize(self, image: &Grid<f32>, width: usize, height: usize) -> Grid<f32> {
        resize(&image.map(|&v| [v]), width, height, self).map(|[v]| *v)
    }

    /// Resizes a color image to `width × height` pixels, channel by channel.
    pub fn resize_rgb(self, image: &RgbGrid, width: usize, height: usize) -> RgbGrid {
        resize(image, width, height, self)
    }
}

/// Resizes with two taps per axis; source coordinates are clamped to the image.
///
/// NaN pixels make every target pixel NaN that weighs them in. An empty source gives an image of NaN.
pub fn bilinear(image: &Grid<f32>, width: usize, height: usize) -> Grid<f32> {
    Resampling::Bilinear.resize(image, width, height)
}

/// The plain mean of the source pixels `floor(i·in/out) .. ceil((i+1)·in/out)`, as torch's `mode="area"`.
pub fn area(image: &Grid<f32>, width: usize, height: usize) -> Grid<f32> {
    Resampling::Area.resize(image, width, height)
}

/// The image moved by `[x, y]` pixels (to the right, down), with two taps per axis; the border is repeated where nothing
/// comes in. NaN pixels as in [`bilinear`]; an offset that is not a number moves nothing.
pub fn moved(image: &Grid<f32>, by: [f64; 2]) -> Grid<f32> {
    // Per axis and target pixel: two source pixels and the weight of the second.
    let taps = |by: f64, length: usize| -> Vec<(usize, usize, f64)> {
        let by = if !by.is_finite() {
            0.0
        } else if (by - by.round()).abs() < 1e-9 {
            by.round()
        } else {
            by
        };
        let last = length.saturating_sub(1);
        let tap = |i: usize| {
            let source = (i as f64 - by).clamp(0.0, last as f64);
            let first = source as usize;
            (first, (first + 1).min(last), source - first as f64)
        };
        (0..length).map(tap).collect()
    };
    let (columns, rows) = (taps(by[0], image.width()), taps(by[1], image.height()));
    // A pixel without weight is not looked at: NaN beside a whole move stays where it is.
    let mix = |a: f64, b: f64, t: f64| if t == 0.0 { a } else { a + (b - a) * t };
    Grid::from_fn(image.width(), image.height(), |x, y| {
        let ((x0, x1, tx), (y0, y1, ty)) = (columns[x], rows[y]);
        let row = |y: usize| mix(f64::from(image[(x0, y)]), f64::from(image[(x1, y)]), tx);
        mix(row(y0), if ty == 0.0 { 0.0 } else { row(y1) }, ty) as f32
    })
}

/// [`bilinear`] for color images.
pub fn bilinear_rgb(image: &RgbGrid, width: usize, height: usize) -> RgbGrid {
    resize(image, width, height, Resampling::Bilinear)
}

/// A mask at another size: the pixel whose area holds the target pixel's center. An empty source gives `false`.
pub fn nearest_mask(mask: &Grid<bool>, width: usize, height: usize) -> Grid<bool> {
    let [source_width, source_height] = mask.size();
    if mask.is_empty() {
        return Grid::filled(width, height, false);
    }
    // Center of the target pixel in source pixels, in whole numbers: (2i + 1)·in / (2·out).
    let pick = |i: usize, source: usize, target: usize| ((2 * i + 1) * source / (2 * target)).min(source - 1);
    Grid::from_fn(width, height, |x, y| mask[(pick(x, source_width, width), pick(y, source_height, height))])
}

/// The source pixels behind one target pixel along one axis. Weights of zero are left out, so that an invalid
/// pixel only spoils the pixels that use it.
fn taps(source: usize, target: usize, kind: Resampling) -> Vec<Vec<(usize, f64)>> {
    let scale = source as f64 / target as f64;
    let last = source - 1;
    (0..target)
        .map(|i| {
            let center = scale * (i as f64 + 0.5) - 0.5;
            let mut taps = match kind {
                Resampling::Bilinear => {
                    let x = center.max(0.0);
                    let first = (x.floor() as usize).min(last);
                    let t = (x - first as f64).min(1.0);
                    vec![(first, 1.0 - t), ((first + 1).min(last), t)]
                }
                Resampling::Bicubic => {
                    let first = center.floor();
                    let t = center - first;
                    let index = |k: i64| (first as i64 + k).clamp(0, last as i64) as usize;
                    cubic_weights(t).iter().zip(-1..).map(|(&w, k)| (index(k), w)).collect()
                }
                Resampling::Area => {
                    // Whole-number floor and ceiling: the quotient in floating point may miss a pixel.
                    let first = i * source / target;
                    let end = ((i + 1) * source).div_ceil(target);
                    let weight = 1.0 / (end - first) as f64;
                    (first..end).map(|k| (k, weight)).collect()
                }
            };
            taps.retain(|&(_, weight)| weight != 0.0);
            taps
        })
        .collect()
}

/// Weights of the pixels at -1, 0, 1, 2 for a position `t` in [0, 1) after pixel 0.
fn cubic_weights(t: f64) -> [f64; 4] {
    let near = |x: f64| ((BICUBIC_A + 2.0) * x - (BICUBIC_A + 3.0)) * x * x + 1.0;
    let far = |x: f64| ((BICUBIC_A * x - 5.0 * BICUBIC_A) * x + 8.0 * BICUBIC_A) * x - 4.0 * BICUBIC_A;
    [far(t + 1.0), near(t), near(1.0 - t), far(2.0 - t)]
}

/// Weighted sums of pixels of `N` channels, in f64.
fn resize<const N: usize>(image: &Grid<[f32; N]>, width: usize, height: usize, kind: Resampling) -> Grid<[f32; N]> {
    if image.size() == [width, height] {
        return image.clone();
    }
    if image.is_empty() || width == 0 || height == 0 {
        return Grid::filled(width, height, [f32::NAN; N]);
    }
    let columns = taps(image.width(), width, kind);
    let rows = taps(image.height(), height, kind);
    let add = |sum: [f64; N], pixel: [f64; N], weight: f64| std::array::from_fn(|c| sum[c] + pixel[c] * weight);
    let mut narrow = Vec::with_capacity(width * image.height());
    for y in 0..image.height() {
        let row = image.row(y);
        let mixed = |taps: &Vec<(usize, f64)>| {
            taps.iter().fold([0.0; N], |sum, &(x, weight)| add(sum, row[x].map(f64::from), weight))
        };
        narrow.extend(columns.iter().map(mixed));
    }
    Grid::from_fn(width, height, |x, y| {
        let sum = rows[y].iter().fold([0.0; N], |sum, &(row, weight)| add(sum, narrow[row * width + x], weight));
        sum.map(|v| v as f32)
    })
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    #[test]
    fn whole_moves_copy_pixels_and_broken_ones_mix_them() {
        let image = Grid::from_fn(5, 4, |x, y| if (x, y) == (4, 3) { f32::NAN } else { (10 * y + x) as f32 });
        let whole = moved(&image, [2.0, -1.0]);
        for y in 0..4 {
            for x in 0..5usize {
                let from = image[(x.saturating_sub(2), (y + 1).min(3))];
                assert_eq!(whole[(x, y)].to_bits(), from.to_bits(), "{x} {y}");
            }
        }
        assert_eq!(moved(&image, [0.25, 0.0])[(2, 1)], 11.75);
        assert_eq!(moved(&image, [0.0, 0.5])[(2, 2)], 17.0);
        // Far out, only the border is left.
        assert_eq!(moved(&image, [100.0, 0.0])[(3, 2)], 20.0);
        assert_eq!(moved(&image, [f64::NAN, 0.0])[(3, 2)], 23.0);
        assert!(moved(&Grid::filled(0, 0, 0.0), [1.5, 1.0]).is_empty());
    }

    fn grid(value: &Value) -> Grid<f32> {
        let rows = value.as_array().unwrap();
        let width = rows[0].as_array().unwrap().len();
        let data = rows.iter().flat_map(|r| r.as_array().unwrap()).map(|v| v.as_f64().unwrap() as f32).collect();
        Grid::from_vec(width, rows.len(), data).unwrap()
    }

    #[test]
    fn agrees_with_torch() {
        let reference: Value = serde_json::from_str(include_str!("../tests/data/resample.json")).unwrap();
        let cases = reference["cases"].as_array().unwrap();
        assert!(cases.len() >= 12);
        for case in cases {
            let kind: Resampling = serde_json::from_value(case["mode"].clone()).unwrap();
            let expected = grid(&case["output"]);
            let resized = kind.resize(&grid(&case["input"]), expected.width(), expected.height());
            for (a, b) in resized.as_slice().iter().zip(expected.as_slice()) {
                // torch computes weights in f32: about 1e-6 of the values' size (here up to 200).
                assert!((a - b).abs() < 5e-4, "{kind:?} {:?}: {a} for {b}", expected.size());
            }
        }
    }

    #[test]
    fn invalid_and_empty_images_are_ordinary() {
        let mut image = Grid::filled(8, 8, 1.0f32);
        image[(0, 0)] = f32::NAN;
        let small = bilinear(&image, 4, 4);
        assert!(small[(0, 0)].is_nan() && small.as_slice().iter().filter(|v| v.is_nan()).count() == 1);
        assert!(
            Resampling::Bicubic
                .resize(&Grid::from_vec(0, 0, vec![]).unwrap(), 2, 2)
                .as_slice()
                .iter()
                .all(|v| v.is_nan())
        );
        assert!(bilinear(&image, 0, 3).is_empty());
        assert_eq!(bilinear(&Grid::filled(1, 1, 7.0), 3, 3), Grid::filled(3, 3, 7.0));
    }
}
