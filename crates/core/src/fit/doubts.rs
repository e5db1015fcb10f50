//! Pairs that contradict the rest.

use rayon::prelude::*;
use serde::Serialize;

use super::FitPair;
use crate::grid::DepthMap;
use crate::turn::Turn;

/// Deviations from the median at which a residual is out of line by itself; for a bell, one pair in 15,000.
const OUT_OF_LINE: f64 = 4.0;
/// Deviations from which another explanation is looked for.
const SUSPECT: f64 = 1.0;
/// Share of a pair's residual that another explanation must leave.
const EXPLAINS: f64 = 0.6;
/// Fewest pairs among which one can be out of line.
const FEWEST: usize = 6;

/// A pair whose measurement is far from what all others lead to expect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Doubt {
    /// Case, counted from 0.
    pub case: usize,
    /// Root mean square residual of the pair when it is left out, meters.
    pub residual_m: f64,
    /// The median of all.
    pub median_m: f64,
    /// Another pair whose prediction is much nearer to its measurement: the partners may be swapped.
    pub partner: Option<usize>,
    /// A turn of its measurement that is much nearer to its prediction, in words.
    pub turn: Option<String>,
}

/// The cases that are out of line, worst first. `left_out` are their predictions by fits without them.
pub fn doubts(cases: &[FitPair<'_>], left_out: &[Option<DepthMap>]) -> Vec<Doubt> {
    let residuals: Vec<Option<f64>> =
        cases.iter().zip(left_out).map(|(case, prediction)| rms(prediction.as_ref()?, case.target)).collect();
    let mut sorted: Vec<f64> = residuals.iter().copied().flatten().collect();
    if sorted.len() < FEWEST {
        return Vec::new();
    }
    sorted.sort_by(f64::total_cmp);
    let median_m = sorted[sorted.len() / 2];
    let mut apart: Vec<f64> = sorted.iter().map(|v| (v - median_m).abs()).collect();
    apart.sort_by(f64::total_cmp);
    // The median distance is 0.6745 deviations of a bell.
    let above = |deviations: f64| median_m + deviations * apart[apart.len() / 2] / 0.6745;
    let mut doubts: Vec<Doubt> = residuals
        .par_iter()
        .enumerate()
        .filter_map(|(case, residual)| {
            let residual_m = residual.filter(|r| *r > above(SUSPECT))?;
            let target = cases[case].target;
            let others = left_out.iter().enumerate().filter(|(other, _)| *other != case);
            let partner =
                nearest(others.filter_map(|(other, prediction)| Some((other, rms(prediction.as_ref()?, target)?))));
            let own = left_out[case].as_ref()?;
            let turn = nearest(Turn::all().skip(1).filter_map(|turn| Some((turn, rms(own, &turn.undo(target))?))));
            let explains = |v: f64| v < EXPLAINS * residual_m;
            let partner = partner.filter(|(_, v)| explains(*v)).map(|(other, _)| other);
            let turn = turn.filter(|(_, v)| explains(*v)).map(|(turn, _)| turn.to_string());
            let doubtful = residual_m > above(OUT_OF_LINE) || partner.is_some() || turn.is_some();
            doubtful.then_some(Doubt { case, residual_m, median_m, partner, turn })
        })
        .collect();
    doubts.sort_by(|a, b| b.residual_m.total_cmp(&a.residual_m));
    doubts
}

fn nearest<T>(all: impl Iterator<Item = (T, f64)>) -> Option<(T, f64)> {
    all.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Over the pixels that were measured; `None` for other sizes or without any.
fn rms(prediction: &DepthMap, target: &DepthMap) -> Option<f64> {
    if prediction.size() != target.size() {
        return None;
    }
    let squares = prediction.as_slice().iter().zip(target.as_slice()).map(|(a, b)| f64::from(a - b).powi(2));
    let (sum, n) = squares.filter(|v| v.is_finite()).fold((0.0, 0usize), |(sum, n), v| (sum + v, n + 1));
    (n > 0).then(|| (sum / n as f64).sqrt())
}
