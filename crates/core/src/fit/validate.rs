//! Validation: the worth of a fit on pairs that it was not made from.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::{FitError, FitPair, closed_form};
use crate::grid::DepthMap;

/// Groups of cases that are left out together: whole tools where at least three are known, else every `count`-th grasp.
/// Cases of one grasp are never apart.
pub fn folds(tools: &[Option<&str>], grasps: &[u32], count: usize) -> Vec<usize> {
    let mut known: Vec<&str> = tools.iter().copied().flatten().collect();
    known.sort_unstable();
    known.dedup();
    if known.len() >= 3 && tools.iter().all(Option::is_some) {
        return tools.iter().map(|tool| known.iter().position(|k| Some(*k) == *tool).unwrap_or_default()).collect();
    }
    let mut place = BTreeMap::new();
    for grasp in grasps {
        let next = place.len();
        place.entry(grasp).or_insert(next);
    }
    grasps.iter().map(|grasp| place[grasp] % count.max(1)).collect()
}

/// For each case the picture that the fit of all other folds makes of it, meters; `None` where the others had no pair of
/// its pad.
///
/// # Errors
/// [`FitError`].
pub fn left_out(cases: &[FitPair<'_>], pads: usize, folds: &[usize]) -> Result<Vec<Option<DepthMap>>, FitError> {
    let count = folds.iter().max().map_or(0, |most| most + 1);
    let fits = (0..count)
        .into_par_iter()
        .map(|fold| {
            let others: Vec<FitPair<'_>> =
                cases.iter().zip(folds).filter(|(_, f)| **f != fold).map(|(case, _)| *case).collect();
            if others.is_empty() { Ok(vec![None; pads]) } else { closed_form(&others, pads) }
        })
        .collect::<Result<Vec<_>, FitError>>()?;
    let picture =
        |(case, &fold): (&FitPair<'_>, &usize)| Some(fits[fold].get(case.pad)?.as_ref()?.apply(case.prediction));
    Ok(cases.par_iter().zip(folds).map(picture).collect())
}
