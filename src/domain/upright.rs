//! Which way up a GelSlim image is, seen in the colors of its lights.
//!
//! Pictures made for training are often turned by a quarter or mirrored, both images of a pair alike. The sensor's
//! three lights stay where they are in the sensor, so the colors tell. A light brightens the slopes that face it:
//! without its gray part, the difference image is a linear function of the gel's slope, and the known directions of
//! the lights give the slope back. The slope of a surface has no curl. Read in a wrong quarter turn or mirrored, the
//! same colors give a field that is nearly all curl. Reading an image upside down turns the surface inside out; a
//! touched gel is dented, with sharp convex rims, so the slope's divergence is skewed to one side.

use super::grid::{Grid, RgbGrid};
use super::resample;
use super::sim::GelSlimConfig;

/// The estimate is made at this size, pixels: ridges are some pixels wide, camera noise is averaged out.
const SIDE: usize = 128;
/// Width of the blur before slopes are taken, pixels of [`SIDE`].
const SIGMA: f64 = 1.5;
/// Pixels at the border that are not looked at.
const MARGIN: usize = 8;
/// Share of the slope that must be free of curl. Right readings of published images have 0.88 to 0.95.
const CONSISTENT: f64 = 0.7;
/// By how much the right reading must be more consistent than the best wrong one.
const CLEARER: f64 = 0.05;

/// One of the eight ways to lay down a square picture: quarter turns, then perhaps mirrored left to right.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Turn {
    /// Counter-clockwise quarter turns, 0 to 3.
    pub quarters: u8,
    /// Mirrored left to right after turning.
    pub mirrored: bool,
}

impl Turn {
    /// All eight, the upright one first.
    pub fn all() -> impl Iterator<Item = Self> {
        [false, true].into_iter().flat_map(|mirrored| (0..4).map(move |quarters| Self { quarters, mirrored }))
    }

    /// The image laid down this way.
    pub fn apply<T: Clone>(self, upright: &Grid<T>) -> Grid<T> {
        let turned = (0..self.quarters % 4).fold(upright.clone(), |image, _| quarter(&image));
        if self.mirrored { mirrored(&turned) } else { turned }
    }

    /// The upright image that was laid down this way.
    pub fn undo<T: Clone>(self, image: &Grid<T>) -> Grid<T> {
        let image = if self.mirrored { mirrored(image) } else { image.clone() };
        (0..(4 - self.quarters % 4) % 4).fold(image, |image, _| quarter(&image))
    }
}

impl std::fmt::Display for Turn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.quarters % 4, self.mirrored) {
            (0, false) => f.write_str("upright"),
            (0, true) => f.write_str("mirrored"),
            (n, false) => write!(f, "turned by {}°", 90 * u32::from(n)),
            (n, true) => write!(f, "turned by {}° and mirrored", 90 * u32::from(n)),
        }
    }
}

/// Counter-clockwise by a quarter.
fn quarter<T: Clone>(image: &Grid<T>) -> Grid<T> {
    let [width, height] = image.size();
    Grid::from_fn(height, width, |x, y| image[(width - 1 - y, x)].clone())
}

fn mirrored<T: Clone>(image: &Grid<T>) -> Grid<T> {
    Grid::from_fn(image.width(), image.height(), |x, y| image[(image.width() - 1 - x, y)].clone())
}

/// How a square difference image (signed, any scale) lies, by the directions of the nominal sensor's lights.
///
/// `None` where the colors do not tell: nothing touched, not square, values that are not numbers, other lights.
pub fn seen(difference: &RgbGrid) -> Option<Turn> {
    let [width, height] = difference.size();
    if width != height || width < 4 * MARGIN || difference.as_slice().iter().flatten().any(|v| !v.is_finite()) {
        return None;
    }
    let [p, q] = slopes(&resample::bilinear_rgb(difference, SIDE, SIDE));
    // Per kind of reading: half the energy of the divergence, of the curl, and the divergence's third moment.
    let mut kinds = [Sums::default(); 4];
    for y in MARGIN..SIDE - MARGIN {
        for x in MARGIN..SIDE - MARGIN {
            let along_x = |f: &Grid<f64>| (f[(x + 1, y)] - f[(x - 1, y)]) / 2.0;
            let along_y = |f: &Grid<f64>| (f[(x, y + 1)] - f[(x, y - 1)]) / 2.0;
            let (px, py, qx, qy) = (along_x(&p), along_y(&p), along_x(&q), along_y(&q));
            // Turning the lights by a quarter, or mirroring them, turns or mirrors the slope that is read.
            kinds[0].add(px + qy, qx - py);
            kinds[1].add(qx - py, px + qy);
            kinds[2].add(qy - px, qx + py);
            kinds[3].add(-(qx + py), qy - px);
        }
    }
    let share = |kind: usize| kinds[kind].consistency();
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&a, &b| share(b).total_cmp(&share(a)));
    let [best, second, ..] = order;
    let clear = share(best) >= CONSISTENT && share(best) - share(second) >= CLEARER;
    let upside_down = kinds[best].cubes < 0.0;
    clear.then(|| Turn { quarters: (best % 2) as u8 + if upside_down { 2 } else { 0 }, mirrored: best >= 2 })
}

/// Moments of a vector field's derivatives.
#[derive(Clone, Copy, Default)]
struct Sums {
    divergence: f64,
    curl: f64,
    cubes: f64,
}

impl Sums {
    fn add(&mut self, divergence: f64, curl: f64) {
        self.divergence += divergence * divergence;
        self.curl += curl * curl;
        self.cubes += divergence * divergence * divergence;
    }

    fn consistency(self) -> f64 {
        let all = self.divergence + self.curl;
        if all > 0.0 { self.divergence / all } else { 0.0 }
    }
}

/// The gel's slope along x and y (up to a factor), from the colors without their gray part, blurred.
fn slopes(difference: &RgbGrid) -> [Grid<f64>; 2] {
    let config = GelSlimConfig::default();
    let lights: [[f64; 2]; 3] = std::array::from_fn(|c| {
        [config.led_angle_rad[c].cos(), config.led_angle_rad[c].sin()].map(|v| v * config.led_gain[c])
    });
    let mean: [f64; 2] = std::array::from_fn(|i| lights.iter().map(|l| l[i]).sum::<f64>() / 3.0);
    let lights = lights.map(|l| [l[0] - mean[0], l[1] - mean[1]]);
    // Least squares of three colors on two slopes.
    let dot = |i: usize, j: usize| lights.iter().map(|l| l[i] * l[j]).sum::<f64>();
    let (a, b, d) = (dot(0, 0), dot(0, 1), dot(1, 1));
    let det = a * d - b * b;
    let inverse = lights.map(|[u, v]| [(d * u - b * v) / det, (a * v - b * u) / det]);
    [0, 1].map(|i| {
        let read = difference.map(|pixel| {
            let gray = pixel.iter().map(|&v| f64::from(v)).sum::<f64>() / 3.0;
            pixel.iter().zip(&inverse).map(|(&v, w)| (f64::from(v) - gray) * w[i]).sum::<f64>()
        });
        blurred(&read)
    })
}

/// Gaussian blur; the border repeats.
fn blurred(image: &Grid<f64>) -> Grid<f64> {
    let radius = (3.0 * SIGMA).ceil() as isize;
    let weights: Vec<f64> = (-radius..=radius).map(|i| (-((i * i) as f64) / (2.0 * SIGMA * SIGMA)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let pass = |image: &Grid<f64>, dx: isize, dy: isize| {
        let last = [image.width() as isize - 1, image.height() as isize - 1];
        Grid::from_fn(image.width(), image.height(), |x, y| {
            let at = |i: isize| {
                image[(
                    (x as isize + i * dx).clamp(0, last[0]) as usize,
                    (y as isize + i * dy).clamp(0, last[1]) as usize,
                )]
            };
            (-radius..=radius).zip(&weights).map(|(i, w)| w * at(i)).sum::<f64>() / sum
        })
    };
    pass(&pass(image, 1, 0), 0, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::rig::lab;
    use crate::domain::sim::{self, SimConfig};

    #[test]
    fn undo_is_the_inverse_of_apply() {
        let image = Grid::from_fn(3, 5, |x, y| 10 * x + y);
        for turn in Turn::all() {
            assert_eq!(turn.undo(&turn.apply(&image)), image, "{turn}");
        }
        let turned = Turn { quarters: 1, mirrored: false }.apply(&image);
        assert_eq!((turned.size(), turned[(0, 0)]), ([5, 3], image[(2, 0)]));
    }

    #[test]
    fn simulated_touches_tell_how_they_were_laid_down() {
        let tools = sim::tools();
        let (mut right, mut wrong, mut silent) = (0, 0, 0);
        for (i, tool) in tools.iter().enumerate() {
            let touch = sim::simulate(tool, sim::random_grasp(i as u64), i as u64, &SimConfig::default());
            let difference = &touch.pad(lab::RIGHT).unwrap().color().unwrap().difference;
            let square = resample::bilinear_rgb(difference, SIDE, SIDE);
            for turn in Turn::all() {
                match seen(&turn.apply(&square)) {
                    Some(found) if found == turn => right += 1,
                    Some(_) => wrong += 1,
                    None => silent += 1,
                }
            }
        }
        println!("{right} right, {wrong} wrong, {silent} not told");
        assert!(right >= 88 && wrong <= 4, "{right} right, {wrong} wrong, {silent} not told");
    }

    #[test]
    fn where_the_colors_do_not_tell_nothing_is_said() {
        assert_eq!(seen(&Grid::filled(128, 128, [0.0; 3])), None);
        assert_eq!(seen(&Grid::filled(128, 128, [f32::NAN; 3])), None);
        assert_eq!(seen(&Grid::filled(427, 320, [3.0; 3])), None);
        assert_eq!(seen(&Grid::filled(0, 0, [3.0; 3])), None);
        let gray = Grid::from_fn(128, 128, |x, y| [((x * 31 + y * 17) % 97) as f32; 3]);
        assert_eq!(seen(&gray), None);
    }
}
