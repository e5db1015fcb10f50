//! [`Placement`]: line, shifts and fields; [`Placement::fitted`] finds them without touching a network.

use crate::image;

/// Placement behind the decoder: where each pad's sensor looks, and what it has of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Factor and offset of the decoder's picture, in units.
    pub line: [f32; 2],
    /// By pad: how far its imprint lies from the decoder's picture, rows and columns, pixels.
    pub shift: Vec<[f32; 2]>,
    /// By pad: what its imprints have beside the touch, `side` × `side`, in units.
    pub field: Vec<Vec<f32>>,
}

/// A prediction (in units, without line, shift and field) and the imprint measured of the same touch.
#[derive(Clone, Debug)]
pub(crate) struct Compared {
    pub(crate) pad: usize,
    pub(crate) predicted: Vec<f32>,
    pub(crate) measured: Vec<f32>,
}

/// Largest shift that is looked for, as a share of the side.
const REACH: f64 = 0.12;
/// Measured images are blurred by this much before shifts are looked for, pixels.
const BLUR: f64 = 1.0;
/// Detail below this many pixels belongs to the sensor from the first pair on.
const FINE: usize = 3;
/// Steps of the search, pixels, each from the best of the one before.
const STRIDES: [f64; 4] = [2.0, 1.0, 0.5, 0.25];

impl Placement {
    /// Everything as the decoder draws it.
    pub fn identity(pads: usize, side: usize) -> Self {
        Self { line: [1.0, 0.0], shift: vec![[0.0; 2]; pads], field: vec![vec![0.0; side * side]; pads] }
    }

    /// The shift of each pad by search, one line for all by least squares, and the mean of what is left by pad. Pads
    /// without pairs stay where they are.
    pub(crate) fn fitted(pads: usize, side: usize, compared: &[Compared]) -> Self {
        let mut placement = Self::identity(pads, side);
        let mut line = Line::default();
        for pad in 0..pads {
            let own: Vec<&Compared> = compared.iter().filter(|pair| pair.pad == pad).collect();
            let blurred: Vec<Vec<f32>> = own.iter().map(|pair| image::blurred(&pair.measured, side, BLUR)).collect();
            let shift = search(side, &own, &blurred);
            for (pair, measured) in own.iter().zip(&blurred) {
                line.add(&image::shifted(&pair.predicted, side, shift), measured);
            }
            placement.shift[pad] = shift.map(|pixels| pixels as f32);
        }
        if let Some([factor, offset]) = line.solve() {
            placement.line = [factor as f32, offset as f32];
        }
        for pad in 0..pads {
            placement.field[pad] = placement.mean_residual(pad, side, compared);
        }
        placement
    }

    /// Residual that the pad's imprints have in common beside the prediction, in units. Its fine part is taken whole;
    /// of the smooth part, which a few pairs may share by chance, n of n + 1.
    fn mean_residual(&self, pad: usize, side: usize, compared: &[Compared]) -> Vec<f32> {
        let mut mean = vec![0.0; side * side];
        let own: Vec<&Compared> = compared.iter().filter(|pair| pair.pad == pad).collect();
        for pair in &own {
            let moved = image::shifted(&pair.predicted, side, self.shift[pad].map(f64::from));
            for ((mean, moved), measured) in mean.iter_mut().zip(moved).zip(&pair.measured) {
                *mean += (measured - (moved * self.line[0] + self.line[1])) / own.len() as f32;
            }
        }
        let smooth = image::boxed(&mean, side, FINE);
        let lost = 1.0 / (own.len() as f32 + 1.0);
        mean.iter().zip(smooth).map(|(mean, smooth)| mean - smooth * lost).collect()
    }
}

/// The shift after which the predictions explain most of the measured images, up to a line.
fn search(side: usize, own: &[&Compared], measured: &[Vec<f32>]) -> [f64; 2] {
    if own.is_empty() {
        return [0.0; 2];
    }
    let error = |shift: [f64; 2]| {
        let mut line = Line::default();
        for (pair, measured) in own.iter().zip(measured) {
            line.add(&image::shifted(&pair.predicted, side, shift), measured);
        }
        line.unexplained()
    };
    let mut best = ([0.0; 2], error([0.0; 2]));
    for (round, stride) in STRIDES.into_iter().enumerate() {
        let center = best.0;
        let reach = if round == 0 { (REACH * side as f64 / stride).round() as i32 } else { 1 };
        for (down, right) in (-reach..=reach).flat_map(|down| (-reach..=reach).map(move |right| (down, right))) {
            let shift = [center[0] + f64::from(down) * stride, center[1] + f64::from(right) * stride];
            let unexplained = error(shift);
            if unexplained < best.1 {
                best = (shift, unexplained);
            }
        }
    }
    best.0
}

/// Sums of a straight line by least squares.
#[derive(Clone, Copy, Debug, Default)]
struct Line {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Line {
    fn add(&mut self, xs: &[f32], ys: &[f32]) {
        for (&x, &y) in xs.iter().zip(ys) {
            let (x, y) = (f64::from(x), f64::from(y));
            self.count += 1.0;
            self.x += x;
            self.y += y;
            self.xx += x * x;
            self.xy += x * y;
            self.yy += y * y;
        }
    }

    /// Sums of squares around the means: of x, of both, of y.
    fn centered(&self) -> [f64; 3] {
        let Line { count, x, y, xx, xy, yy } = *self;
        [xx - x * x / count, xy - x * y / count, yy - y * y / count]
    }

    /// Factor and offset; `None` where all x are alike or the line falls.
    fn solve(&self) -> Option<[f64; 2]> {
        let [xx, xy, _] = self.centered();
        let factor = xy / xx;
        let clear = self.count > 0.0 && xx > 1e-9 * self.count && factor > 0.0;
        clear.then(|| [factor, (self.y - factor * self.x) / self.count])
    }

    /// Squared residual of y that the line leaves.
    fn unexplained(&self) -> f64 {
        let [xx, xy, yy] = self.centered();
        if xx > 0.0 && xy > 0.0 { yy - xy * xy / xx } else { yy }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Random};

    const SIDE: usize = 64;

    #[test]
    fn a_known_placement_is_found() {
        let (line, shifts) = ([0.8, 0.1], [[-4.75, -8.0], [2.25, 0.5]]);
        let mut random = Random::new(1, Purpose::Variation, 0, 0);
        let mut noise = |sigma: f64| image::blurred(&random.normals(SIDE * SIDE), SIDE, sigma);
        let fields: Vec<Vec<f32>> = [0, 1].map(|_| noise(1.0).iter().map(|v| 0.02 * v).collect()).to_vec();
        let compared: Vec<Compared> = (0..20)
            .map(|i| {
                let predicted = noise(3.0);
                // A real sensor's border is not a repeated one, but that is all one can draw here.
                let moved = image::shifted(&predicted, SIDE, shifts[i % 2]);
                let measured = moved.iter().zip(&fields[i % 2]).map(|(v, f)| line[0] * v + line[1] + f).collect();
                Compared { pad: i % 2, predicted, measured }
            })
            .collect();
        let placement = Placement::fitted(2, SIDE, &compared);
        for (shift, true_shift) in placement.shift.iter().zip(shifts) {
            assert!(shift.iter().zip(true_shift).all(|(f, t)| (f64::from(*f) - t).abs() <= 0.25), "{shift:?}");
        }
        // The measured images are blurred a little, which flattens them.
        assert!(
            (placement.line[0] - 0.8).abs() < 0.1 && (placement.line[1] - 0.1).abs() < 0.01,
            "{:?}",
            placement.line
        );
        let error = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f32>().sqrt();
        let nothing = vec![0.0; SIDE * SIDE];
        assert!(error(&placement.field[0], &fields[0]) < 0.5 * error(&nothing, &fields[0]));
    }

    #[test]
    fn pads_without_pairs_and_flat_predictions_stay() {
        let flat = Compared { pad: 1, predicted: vec![0.5; SIDE * SIDE], measured: vec![0.25; SIDE * SIDE] };
        let placement = Placement::fitted(2, SIDE, &[flat]);
        assert_eq!((placement.line, placement.shift.clone()), ([1.0, 0.0], vec![[0.0; 2]; 2]));
        assert_eq!(placement.field[0], vec![0.0; SIDE * SIDE]);
        assert!(placement.field[1].iter().all(|v| (v + 0.125).abs() < 1e-6));
    }
}
