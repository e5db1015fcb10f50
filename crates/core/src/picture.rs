//! Pictures as people see them: depth through a color map, color pictures and differences as bytes. Panes and
//! files take these, so that the same pixel has the same color everywhere.

use rayon::prelude::*;

use super::colormap::{ColorMap, Range};
use super::grid::{DepthMap, Grid, RgbGrid};

/// A picture in sRGB bytes.
pub type Rgb8 = Grid<[u8; 3]>;

/// A depth map through a color map; NaN has a color of its own.
pub fn colored(depth: &DepthMap, map: ColorMap, range: Range) -> Rgb8 {
    let table = map.table();
    let nan = map.rgb8(f32::NAN);
    depth.map(|v| {
        let unit = range.unit(*v);
        if unit.is_nan() { nan } else { table[(unit * 255.0 + 0.5) as usize] }
    })
}

/// A color image on the 0..255 scale.
pub fn plain(image: &RgbGrid) -> Rgb8 {
    toned(image, 1.0, 0.0)
}

/// A signed difference around mid gray, with the contrast of [`difference_gain`].
pub fn difference(image: &RgbGrid) -> Rgb8 {
    toned(image, difference_gain(image), 128.0)
}

fn toned(image: &RgbGrid, gain: f32, center: f32) -> Rgb8 {
    image.map(|p| p.map(|v| (v * gain + center).round().clamp(0.0, 255.0) as u8))
}

/// The mean of each square of `side` x `side` pixels, of a picture of four bytes per pixel whose sizes are multiples of that.
pub fn mean_of_squares(rgba: &[u8], width: usize, side: usize) -> Vec<u8> {
    if side == 1 {
        return rgba.to_vec();
    }
    let (row, count) = (width * 4, (side * side) as u32);
    let row_of_means = |rows: &[u8]| {
        let squares = (0..row).step_by(4 * side).flat_map(|left| {
            let mut sum = [count / 2; 4];
            for pixel in (0..side).flat_map(|j| rows[j * row + left..][..4 * side].chunks_exact(4)) {
                sum.iter_mut().zip(pixel).for_each(|(sum, byte)| *sum += u32::from(*byte));
            }
            sum.map(|sum| (sum / count) as u8)
        });
        squares.collect::<Vec<u8>>()
    };
    rgba.par_chunks_exact(row * side).flat_map_iter(row_of_means).collect()
}

/// Pixels with their own colors, of bytes with colors that are multiplied by the opacity.
pub fn unmultiplied(rgba: &[u8]) -> Vec<[u8; 4]> {
    let pixel = |at: &[u8; 4]| match u32::from(at[3]) {
        255 => *at,
        alpha => {
            let own = |v: u8| (u32::from(v) * 255 / alpha.max(1)).min(255) as u8;
            [own(at[0]), own(at[1]), own(at[2]), at[3]]
        }
    };
    rgba.as_chunks().0.iter().map(pixel).collect()
}

/// The gain that spreads a difference over the gray levels: 1 at the usual contrast, more for faint touches, and for
/// values on a 0..1 scale. 1 for an empty or constant image.
pub(crate) fn difference_gain(image: &RgbGrid) -> f32 {
    let mut sizes: Vec<f32> =
        image.as_slice().iter().flat_map(|p| p.iter().map(|v| v.abs())).filter(|v| v.is_finite()).collect();
    if sizes.is_empty() {
        return 1.0;
    }
    let rank = (sizes.len() - 1) * 995 / 1000;
    let (_, p99, _) = sizes.select_nth_unstable_by(rank, f32::total_cmp);
    if *p99 > 1e-6 { 120.0 / *p99 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_become_their_mean_and_pixels_their_own_colors() {
        let rgba: Vec<u8> = (0..32).map(|i| if i < 16 { 10 } else { 13 }).collect();
        assert_eq!(mean_of_squares(&rgba, 4, 2), [12; 8], "rounded");
        assert_eq!(mean_of_squares(&rgba, 4, 1), rgba);
        assert_eq!(
            unmultiplied(&[64, 0, 128, 128, 7, 8, 9, 255, 0, 0, 0, 0]),
            [[127, 0, 255, 128], [7, 8, 9, 255], [0; 4]]
        );
    }

    #[test]
    fn a_difference_lies_around_gray() {
        let image = RgbGrid::from_fn(10, 10, |x, _| [0.0, x as f32 - 4.5, f32::NAN]);
        let picture = difference(&image);
        assert_eq!((picture[(0, 0)][0], picture[(0, 0)][1], picture[(9, 0)][1]), (128, 8, 248));
        assert_eq!(difference_gain(&RgbGrid::filled(0, 0, [0.0; 3])), 1.0);
        assert_eq!(plain(&RgbGrid::filled(1, 1, [300.0, -4.0, 12.4]))[(0, 0)], [255, 0, 12]);
    }
}
