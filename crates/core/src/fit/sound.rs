//! Objections to a fit, in words: figures that no sensor leads to, and predictions that do not know their own measurement.

use rayon::prelude::*;

use super::{FitPair, PadFit};
use crate::grid::{DepthMap, Grid};
use crate::metrics::AngleSummary;
use crate::postprocess::Correction;
use crate::resample;

/// Gains that sensors of one kind differ by; anything else is another unit or sign.
const GAINS: std::ops::RangeInclusive<f64> = 0.3..=3.0;
/// The mean error of the angle may grow by this share of itself, and by [`ANGLE_RAD`] more, by chance alone.
const ANGLE_SHARE: f64 = 0.25;
/// See [`ANGLE_SHARE`]; radians.
const ANGLE_RAD: f64 = 2.0 / 180.0 * std::f64::consts::PI;
/// By chance a grasp may lose its pose, and this share of all may.
const LOST_SHARE: f64 = 0.1;
/// Share of the other measurements that a prediction's own one must be nearer than, on average; 0.5 is chance.
const LEAST_NEARNESS: f64 = 0.65;
/// Fewer touches of a pad rank by chance.
const FEWEST: usize = 4;
/// More touches of a pad tell nothing more.
const MOST: usize = 80;
/// Columns and rows of the pictures that are compared: places of a contact, not the sensor's grain.
const SIDE: usize = 32;

/// A pad as a fit found it.
#[derive(Clone, Copy, Debug)]
pub struct FoundPad<'a> {
    /// The name for people.
    pub name: &'a str,
    /// Correction of the pad.
    pub correction: &'a Correction,
    /// Window that the rig says is drawn: its place as an offset like the correction's own, and how far from there a
    /// window still overlaps it: half of its width and height. Pixels; `None` where the rig does not say.
    pub window: Option<[[f64; 2]; 2]>,
}

/// Lengths in the pictures of a fit are below this, meters: no membrane is pushed in so far.
const MOST_M: f32 = 0.1;
/// Factors are below this, and a line's gain is above its inverse.
const MOST_TIMES: f32 = 100.0;
/// Answers per meter of a component are below this.
const MOST_ANSWER: f32 = 100.0;

/// Numbers that no fit has, whatever it was made from: those of a file that was changed or is damaged. A fit that is only
/// doubtful has none.
pub fn absurd(fit: &PadFit) -> Option<String> {
    let one = &fit.correction;
    let [width, height] = one.mean.size();
    let over =
        |most: f32, picture: &Grid<f32>| picture.as_slice().iter().find(|v| v.is_nan() || v.abs() > most).copied();
    let far = one.offset_px.iter().zip([width, height]).find(|(by, side)| by.abs() > *side as f64);
    if let Some((by, side)) = far {
        return Some(format!("an offset of {by:e} px, in pictures of {side} px"));
    }
    let [gain, offset_m] = one.line;
    let most = f64::from(MOST_TIMES);
    if !(1.0 / most..=most).contains(&gain) {
        return Some(format!("a line with the gain {gain:e}"));
    }
    if offset_m.abs() > f64::from(MOST_M) {
        return Some(format!("a line with the offset {offset_m:e} m"));
    }
    let pictures = [("mean", MOST_M, &one.mean), ("field", MOST_M, &one.field), ("gain", MOST_TIMES, &one.gain)];
    let response = one.response.iter().flat_map(|response| {
        let basis = response.basis.iter().map(|picture| ("basis", 1.01, picture));
        let answers = response.answers.iter().map(|picture| ("answers", MOST_ANSWER, picture));
        basis.chain(answers).chain([("center", MOST_M, &response.center)])
    });
    let lattice = fit.lattice.iter().map(|picture| ("lattice", f32::MAX, picture));
    let mut all = pictures.into_iter().chain(response).chain(lattice);
    all.find_map(|(name, most, picture)| Some(format!("{:e} in \"{name}\"", over(most, picture)?)))
}

/// Objections to the figures of a fit: its gains and offsets.
pub fn figures(cases: &[FitPair<'_>], pads: &[Option<FoundPad<'_>>]) -> Vec<String> {
    let mut out = Vec::new();
    for (number, pad) in pads.iter().enumerate() {
        let Some(pad) = pad else { continue };
        let own: Vec<&FitPair<'_>> = cases.iter().filter(|case| case.pad == number).collect();
        let (name, found) = (pad.name, slope(&own, pad.correction));
        let gain = found.unwrap_or(pad.correction.line[0]);
        let odd = !GAINS.contains(&gain) || !GAINS.contains(&pad.correction.line[0]);
        if odd && gain < 0.0 {
            out.push(format!(
                "{name}: less is measured where more is predicted (gain {gain:.3}). Wrong sign of the imprints, or fingers \
                 swapped?"
            ));
        } else if odd {
            let (least, most) = (GAINS.start(), GAINS.end());
            out.push(format!(
                "{name}: measured depth is {gain:.3} times the predicted one (expected {least} to {most}). Imprints in \
                 another unit, or not of these GelSlim images?"
            ));
        }
        let offset_px = pad.correction.offset_px;
        let size = pad.correction.mean.size();
        let off = match pad.window {
            Some([there, reach]) => (0..2).any(|i| (offset_px[i] - there[i]).abs() > reach[i]),
            None => (0..2).any(|i| offset_px[i].abs() > size[i] as f64 / 2.0),
        };
        if off {
            let [x, y] = offset_px;
            out.push(format!(
                "{name}: the fit would shift predictions {x:+.1} px right and {y:+.1} px down, off the window of the sensor. \
                 Imprints turned, mirrored, of the other finger, or not of these GelSlim images?"
            ));
        }
    }
    out
}

/// Meters measured per meter predicted, where the prediction belongs; negative where they go against each other, `None`
/// where predictions are flat.
fn slope(cases: &[&FitPair<'_>], correction: &Correction) -> Option<f64> {
    let [mut n, mut x, mut y, mut xx, mut xy] = [0.0; 5];
    for case in cases {
        let placed = correction.placed(case.prediction);
        for (&p, &t) in placed.as_slice().iter().zip(case.target.as_slice()).filter(|(_, t)| t.is_finite()) {
            let (p, t) = (f64::from(p), f64::from(t));
            (n, x, y, xx, xy) = (n + 1.0, x + p, y + t, xx + p * p, xy + p * t);
        }
    }
    let (spread, along) = (xx - x * x / n, xy - x * y / n);
    (spread > 1e-12 * xx).then(|| along / spread)
}

/// Objection to the fit by the angle's errors.
pub fn angle(before: &AngleSummary, after: &AngleSummary) -> Option<String> {
    let worse = |of: fn(&AngleSummary) -> Option<f64>| match [of(before), of(after)] {
        [Some(before), Some(after)] => after > before * (1.0 + ANGLE_SHARE) + ANGLE_RAD.to_degrees(),
        [before, after] => before.is_some() && after.is_none(),
    };
    let chance = (LOST_SHARE * after.count as f64).max(1.0);
    let held = [before, after].map(|angle| angle.success_10 / 100.0 * angle.count as f64);
    // One grasp of few that is lost either way moves the mean by as much as it likes.
    let worse = worse(|angle| angle.mean_deg) && (worse(|angle| angle.median_deg) || held[0] > held[1] + chance);
    let lost = after.failed as f64 > before.failed as f64 + chance;
    let [mean, mean_after] =
        [before, after].map(|angle| angle.mean_deg.map_or("none".to_owned(), |deg| format!("{deg:.1}°")));
    let (failed, failed_after, all) = (before.failed, after.failed, after.count);
    (worse || lost).then(|| {
        format!(
            "the in-hand angle gets worse: mean error {mean} -> {mean_after}, {failed} -> {failed_after} of {all} grasps \
             without a pose. Do these imprints belong to these poses?"
        )
    })
}

/// Objection that predictions do not know their own measurements: `left_out` are those by fits without the case. `None`
/// for few touches.
pub fn strangers(cases: &[FitPair<'_>], left_out: &[Option<DepthMap>]) -> Option<String> {
    let pads = cases.iter().map(|case| case.pad + 1).max().unwrap_or_default();
    let ranks: Vec<f64> = (0..pads).flat_map(|pad| nearness(cases, left_out, pad)).collect();
    let nearness = ranks.iter().sum::<f64>() / ranks.len() as f64;
    (nearness < LEAST_NEARNESS).then(|| {
        format!(
            "predictions do not match their own imprints: over {} touches, the own imprint is closer than {:.0} % of the \
             others (50 % is chance). GelSlim images of other grasps or fingers, or all grasps alike?",
            ranks.len(),
            100.0 * nearness
        )
    })
}

/// For each touch of a pad the share of the others whose deviation from the pad's mean is less like its own prediction's
/// than its own measurement's is, and the other way round.
fn nearness(cases: &[FitPair<'_>], left_out: &[Option<DepthMap>], pad: usize) -> Vec<f64> {
    let own: Vec<(&DepthMap, &DepthMap)> = cases
        .iter()
        .zip(left_out)
        .filter(|(c, _)| c.pad == pad)
        .filter_map(|(c, m)| Some((m.as_ref()?, c.target)))
        .collect();
    if own.len() < FEWEST {
        return Vec::new();
    }
    let stride = own.len().div_ceil(MOST);
    let own: Vec<_> = own.into_iter().step_by(stride).collect();
    let predictions = deviations(own.iter().map(|(prediction, _)| *prediction));
    let targets = deviations(own.iter().map(|(_, target)| *target));
    let n = own.len();
    let likeness: Vec<f64> = (0..n * n)
        .into_par_iter()
        .map(|pair| predictions[pair / n].iter().zip(&targets[pair % n]).map(|(a, b)| a * b).sum())
        .collect();
    let like = |i: usize, j: usize| likeness[i * n + j];
    let beaten = |i: usize, of: &dyn Fn(usize) -> f64| {
        let below = (0..n).filter(|j| *j != i).map(|j| match of(j).total_cmp(&like(i, i)) {
            std::cmp::Ordering::Less => 1.0,
            std::cmp::Ordering::Equal => 0.5,
            std::cmp::Ordering::Greater => 0.0,
        });
        below.sum::<f64>() / (n - 1) as f64
    };
    (0..n).map(|i| (beaten(i, &|j| like(i, j)) + beaten(i, &|j| like(j, i))) / 2.0).collect()
}

/// Small pictures of one length without their common mean; what was not measured departs from it by nothing.
fn deviations<'a>(images: impl Iterator<Item = &'a DepthMap>) -> Vec<Vec<f64>> {
    let small: Vec<Grid<f32>> = images
        .map(|image| {
            let [width, height] = image.size();
            resample::area(image, width.min(SIDE), height.min(SIDE))
        })
        .collect();
    let mut all: Vec<Vec<f64>> = small.iter().map(|g| g.as_slice().iter().map(|&v| f64::from(v)).collect()).collect();
    let length = all.first().map_or(0, Vec::len);
    for pixel in 0..length {
        let finite = || all.iter().map(|image| image[pixel]).filter(|v| v.is_finite());
        let mean = finite().sum::<f64>() / finite().count().max(1) as f64;
        for image in &mut all {
            image[pixel] = if image[pixel].is_finite() { image[pixel] - mean } else { 0.0 };
        }
    }
    for image in &mut all {
        let length = image.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length > 0.0 {
            image.iter_mut().for_each(|v| *v /= length);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{closed_form, left_out};

    const SIZE: usize = 48;

    fn bump(i: usize, scale: f32) -> DepthMap {
        let (cx, cy) = (12.0 + (i * 7 % 24) as f32, 12.0 + (i * 11 % 24) as f32);
        Grid::from_fn(SIZE, SIZE, |x, y| scale * (-((x as f32 - cx).powi(2) + (y as f32 - cy).powi(2)) / 40.0).exp())
    }

    /// The objections to a fit of bumps to `target` of each.
    fn objections(target: impl Fn(usize) -> DepthMap, window: Option<[[f64; 2]; 2]>) -> Vec<String> {
        let predictions: Vec<DepthMap> = (0..12).map(|i| bump(i, 0.004)).collect();
        let targets: Vec<DepthMap> = (0..12).map(target).collect();
        let cases: Vec<FitPair<'_>> = predictions
            .iter()
            .zip(&targets)
            .map(|(prediction, target)| FitPair { prediction, target, pad: 0 })
            .collect();
        let corrections = closed_form(&cases, 1).unwrap();
        let parts: Vec<usize> = (0..12).map(|i| i % 3).collect();
        let predictions = left_out(&cases, 1, &parts).unwrap();
        let pad = FoundPad { name: "thumb", correction: corrections[0].as_ref().unwrap(), window };
        let mut out = figures(&cases, &[Some(pad)]);
        out.extend(strangers(&cases, &predictions));
        out
    }

    #[test]
    fn a_fit_to_the_right_imprints_is_not_objected_to() {
        for scale in [0.5, 1.0, 2.0] {
            assert_eq!(objections(|i| bump(i, 0.004 * scale), None), Vec::<String>::new());
        }
    }

    #[test]
    fn another_unit_sign_place_or_touch_is() {
        let said = |objections: Vec<String>| objections.join("; ");
        assert!(said(objections(|i| bump(i, 4.0), None)).contains("another unit"));
        assert!(said(objections(|i| bump(i, -0.004), None)).contains("less is measured"));
        assert!(said(objections(|i| bump(i, 0.004), Some([[20.0, 0.0], [9.0, 9.0]]))).contains("off the window"));
        let others = said(objections(|i| bump((i + 5) % 12, 0.004), None));
        assert!(others.contains("do not match their own imprints"), "{others}");
        assert_eq!(strangers(&[], &[]), None, "nothing is said of nothing");
    }

    #[test]
    fn an_angle_that_grows_by_more_than_chance_is_an_objection() {
        let of =
            |degrees: &[f64]| AngleSummary::from_errors(&degrees.iter().map(|d| d.to_radians()).collect::<Vec<_>>());
        let fine = of(&[0.5, 1.0, 1.5]);
        assert_eq!(angle(&fine, &of(&[0.9, 1.4, 1.9])), None);
        assert_eq!(angle(&of(&[20.0; 3]), &of(&[23.0; 3])), None);
        let grown = angle(&fine, &of(&[11.0, 12.0, 11.2])).unwrap();
        assert!(grown.contains("1.0° -> 11.4°"), "{grown}");
        let gone = angle(&fine, &of(&[f64::NAN; 3])).unwrap();
        assert!(gone.contains("none") && gone.contains("0 -> 3 of 3"), "{gone}");
        assert!(angle(&fine, &of(&[0.5, f64::NAN, f64::NAN])).is_some());
    }
}
