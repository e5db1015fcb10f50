//! Orientation of a GelSlim image: which way up it is, seen in the colors of its lights.
//!
//! Pictures made for training are often turned by a quarter or mirrored, both images of a pair alike. The sensor's
//! three lights stay where they are in the sensor, so the colors tell. A light brightens the slopes that face it:
//! without its gray part, the difference image is a linear function of the gel's slope, and the known directions of
//! the lights give the slope back. The slope of a surface has no curl. Read in a wrong quarter turn or mirrored, the
//! same colors give a field that is nearly all curl. Reading an image upside down turns the surface inside out; a
//! touched gel is dented, with sharp convex rims, so the slope's divergence is skewed to one side.

use super::blur::gaussian;
use super::grid::{Grid, RgbGrid};
use super::resample;
use super::rig::lab;
use super::turn::Turn;

/// The estimate is made at this size, pixels: ridges are some pixels wide, camera noise is averaged out.
const SIDE: usize = 128;
/// Width of the blur before slopes are taken, pixels of [`SIDE`].
const SIGMA_PX: f64 = 1.5;
/// Pixels at the border that are not looked at.
const MARGIN: usize = 8;
/// Share of the slope that must be free of curl. Right readings of published images have 0.88 to 0.95.
const CONSISTENT: f64 = 0.7;
/// Below these a reading is little more than a guess.
const GUESSED: f64 = 0.65;
const GUESSED_MARGIN: f64 = 0.02;
/// Share from which there is a touch to read; noise has one half in every reading.
const TOUCHED: f64 = 0.55;
/// By how much the right reading must be more consistent than the best wrong one.
const CLEARER: f64 = 0.05;

/// Turn in which a picture lies, and how sure that is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnReading {
    /// Turn.
    pub turn: Turn,
    /// Share of the slope that is free of curl in this reading, 0..1. Right readings of published images have .69 to .95.
    pub consistency: f64,
    /// By how much that is more than in the best of the readings that it was not.
    pub margin: f64,
}

impl TurnReading {
    /// True where it is little more than a guess: no published pair is read so.
    pub fn is_guess(self) -> bool {
        self.consistency < GUESSED || self.margin < GUESSED_MARGIN
    }

    /// True where both thresholds are passed at which no reading of a simulated touch is wrong.
    pub fn is_sure(self) -> bool {
        self.consistency >= CONSISTENT && self.margin >= CLEARER
    }
}

/// Best reading of the turn in which a square difference image (signed, any scale) lies, by the directions of the
/// nominal sensor's lights, sure or not. On 36 published pairs it is right for all, where the sure ones alone leave
/// some unread.
///
/// `None` where there is nothing to read: nothing touched, not square, values that are not numbers, no color.
pub fn best(difference: &RgbGrid) -> Option<TurnReading> {
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
    let upside_down = kinds[best].cubes < 0.0;
    let turn = Turn { quarters: (best % 2) as u8 + if upside_down { 2 } else { 0 }, mirrored: best >= 2 };
    let reading = TurnReading { turn, consistency: share(best), margin: share(best) - share(second) };
    (reading.consistency >= TOUCHED).then_some(reading)
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
    let lights: [[f64; 2]; 3] = std::array::from_fn(|c| {
        let angle_rad = lab::GELSLIM_LED_ANGLE_RAD[c];
        [angle_rad.cos(), angle_rad.sin()].map(|v| v * lab::GELSLIM_LED_GAIN[c])
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
        gaussian(&read, SIGMA_PX)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog;
    use crate::rig::lab;
    use crate::sim::{self, SimConfig};

    #[test]
    fn simulated_touches_tell_how_they_were_laid_down() {
        let tools = catalog::tools();
        let (mut right, mut wrong, mut silent) = (0, 0, 0);
        for (i, tool) in tools.iter().enumerate() {
            let touch = sim::simulate(tool, sim::random_grasp(i as u64), i as u64, &SimConfig::default());
            let difference = &touch.pad(lab::RIGHT).unwrap().color().unwrap().difference;
            let square = resample::bilinear_rgb(difference, SIDE, SIDE);
            for turn in Turn::all() {
                match best(&turn.apply(&square)).filter(|reading| reading.is_sure()).map(|reading| reading.turn) {
                    Some(read) if read == turn => right += 1,
                    Some(_) => wrong += 1,
                    None => silent += 1,
                }
            }
        }
        println!("{right} right, {wrong} wrong, {silent} not told");
        assert!(right >= 88 && wrong <= 4, "{right} right, {wrong} wrong, {silent} not told");
    }
}
