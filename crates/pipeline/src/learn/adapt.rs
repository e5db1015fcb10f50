//! Fitting a generator to pairs of a real rig, with the score that it earns on pairs it was not fitted to: [`adapt`].

mod adapted;
mod gather;
mod judge;
mod pose;
mod score;
#[cfg(feature = "tune")]
mod tune;
mod write;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use crate::error::TaskError;
use crate::infer::bundle::Role;
use crate::infer::kept_key::input_digest;
use crate::io::dataset::Dataset;
use crate::io::memory::peak_mib;
use crate::job::{Curve, JobCx};
use crate::steps::bundles::BundleInfo;
use crate::steps::models::Models;
use crate::steps::recipe::Recipe;
use crate::steps::tool::Tools;
use touch2touch_core::dataset::PairId;
use touch2touch_core::fit::{FitError, FitSource, Fitted, PadFit, closed_form, doubts, folds, left_out};
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::markers::template;
use touch2touch_core::postprocess::Correction;
use touch2touch_core::rig::{PerPad, Rig};
use touch2touch_core::sample::Scale;
use touch2touch_core::units::counted;

pub use crate::error::Remark;
pub use crate::learn::tuning::Tuning;
pub(crate) use adapted::MOST_SHOWN;
pub(crate) use adapted::PadSummary;
pub use adapted::{Adapted, HeldBack};
use gather::{FitTouch, gather};
pub use score::Scored;
#[cfg(feature = "tune")]
use tune::tune;
pub(crate) use write::Unwritten;

const WHAT: &str = "Fit the model to pairs";
/// Fewer pairs leave ghosts of the training shapes in the predictions.
pub const ENOUGH_PAIRS: usize = 10;
/// Fewer steps of tuning are worth nothing: the rates rise for ten steps.
const ENOUGH_STEPS: u32 = 30;
/// A smaller gain is none.
const LEAST_GAIN_DB: f64 = 0.2;
/// Most touches that a closed form takes; more change nothing and fill the memory.
const MOST_TOUCHES: usize = 1500;
/// Hex digits of a picture's digest that are kept: enough to tell any two apart.
const DIGITS: usize = 16;

/// Request for a fit: the generator, the pairs, the trial, and the tuning.
#[derive(Clone, Debug)]
pub struct AdaptSetup {
    /// The generator, which stays as it is, with how it generates; and how contact and pose are found where the data have
    /// poses.
    pub recipe: Recipe,
    /// The pairs.
    pub pairs: Vec<PairId>,
    /// In how many parts the pairs are left out in turn; whole tools where three are known. 0 tries nothing.
    pub folds: usize,
    /// Tuning of the networks themselves after the closed form: once for each part that is left out, and once for all;
    /// `None` tunes nothing.
    pub tuning: Option<Tuning>,
    /// Folder in which a run of tuning that is stopped is kept, to go on from there when the same is asked for again.
    pub unfinished: Option<PathBuf>,
    /// The folder of the new bundle; `None` only tries.
    pub out: Option<PathBuf>,
    /// Write it whatever speaks against the fit.
    pub force: bool,
    /// Replace a fit to other data in that folder.
    pub replace: bool,
}

/// Predicts the pairs, fits the closed form, tries it on what was left out, and writes the new bundle.
///
/// # Errors
/// If the job was told to stop, the bundle is no depth generator or does not fit the data, no pair can be used, or the
/// new bundle cannot be written.
pub fn adapt(dataset: &Dataset, setup: &AdaptSetup, models: &Models, cx: &JobCx) -> Result<Adapted, TaskError> {
    let begin = Instant::now();
    let fail = |err: FitError| TaskError::from_error(WHAT, &err);
    let bundle = setup.recipe.generating()?.bundle;
    if let Some(fit) = bundle.fit() {
        return Err(TaskError::new(WHAT, format!("{} was fitted already", bundle.name))
            .with_hint(format!("Fit the bundle that it was made from, {}, to all your pairs.", fit.from)));
    }
    let _claim = setup.out.as_deref().map(|out| write::claim(out, bundle)).transpose()?;
    let gather::Gathered { touches, mut left_out, grouped, mut notes } = gather(dataset, setup, models, cx)?;
    let source = source(dataset, bundle, &touches);
    let other = setup.out.as_deref().filter(|_| !setup.replace).and_then(|out| write::of_other_data(out, &source));
    if let (Some(other), Some(_)) = (&other, &setup.tuning) {
        // Before the long part.
        let hint = "Name a new folder, or replace it (--replace; in the studio, keep a fit without tuning first).";
        return Err(TaskError::new(WHAT, other).with_hint(hint));
    }
    cx.progress(0, 0, "fitting");
    let fitting = Instant::now();
    let cases: Vec<_> = touches.iter().map(FitTouch::case).collect();
    let pads = dataset.rig.pads().len();
    let mut corrections = closed_form(&cases, pads).map_err(fail)?;
    let fit_seconds = fitting.elapsed().as_secs_f64();
    cx.check(WHAT)?;
    let (mut parts, mut unseen) = (Vec::new(), vec![None; touches.len()]);
    if setup.folds > 0 {
        cx.progress(0, 0, "trying the fit on pairs that were left out");
        let tools: Vec<Option<&str>> = touches.iter().map(|t| t.tool.as_deref()).collect();
        let grasps: Vec<u32> = touches.iter().map(|t| t.id.0).collect();
        parts = folds(&tools, &grasps, setup.folds.max(2));
        unseen = self::left_out(&cases, pads, &parts).map_err(fail)?;
        cx.check(WHAT)?;
    }
    let mut tools = Tools::new(dataset);
    let mut scored = |pictures: &[Option<&Grid<f32>>]| -> Result<Option<Scored>, TaskError> {
        let mut scored = score::scored(&touches, pictures)?;
        if let Some(scored) = &mut scored {
            scored.angle = pose::angles(dataset, setup, models, &mut tools, &touches, pictures, cx)?;
        }
        Ok(scored)
    };
    let plain: Vec<Option<&Grid<f32>>> = touches.iter().map(|t| Some(&t.unfitted)).collect();
    let before =
        scored(&plain)?.ok_or_else(|| TaskError::new(WHAT, "no picture could be compared with its measurement"))?;
    let closed = scored(&references(&unseen))?;
    let doubtful = doubts(&cases, &unseen).into_iter().map(|doubt| remark(&touches, &doubt)).collect();
    let mut graphs = BTreeMap::new();
    let (mut after, mut steps, mut curves) = (None, 0, Vec::new());
    if let Some(tuning) = setup.tuning {
        let tuned = tune(setup, tuning, &touches, &corrections, &parts, &dataset.rig, cx)?;
        after = scored(&references(&tuned.left_out))?;
        (graphs, corrections, steps, curves) = (tuned.graphs, tuned.corrections, tuned.steps, tuned.curves);
        unseen = tuned.left_out;
    }
    let names: BTreeSet<&str> = touches.iter().map(|t| t.name.as_str()).collect();
    let warnings = warnings(setup, names.len(), &before, closed.as_ref(), grouped, steps);
    let held_back = touches.iter().zip(&unseen).filter_map(|(touch, after)| Some(shown(touch, after.as_ref()?)));
    let held_back = held_back.take(MOST_SHOWN).collect();
    let fitted = Fitted { source, pads: with_lattices(&touches, corrections) };
    let pads = summaries(&fitted, &touches, &dataset.rig);
    notes.extend(tools.into_notes());
    left_out.sort_by(|a, b| a.name.cmp(&b.name));
    let mut adapted = Adapted {
        pairs: names.len(),
        touches: touches.len(),
        left_out,
        doubtful,
        before,
        closed_form: closed,
        after,
        steps,
        curves,
        seconds: 0.0,
        fit_seconds,
        peak_mib: None,
        pads,
        warnings,
        notes: notes.into_list(),
        objections: Vec::new(),
        in_place_of: other,
        bundle: None,
        unwritten: None,
        held_back,
    };
    let (rig, doubts) = (&*dataset.rig, crate::doubts::notes(dataset));
    let evidence = judge::Evidence { rig, touches: &touches, fitted: &fitted, unseen: &unseen, doubts: &doubts };
    adapted.objections = judge::objections(&evidence, &adapted);
    if let Some(out) = setup.out.clone() {
        let unwritten = Unwritten { out, from: bundle.clone(), rig: dataset.rig.clone(), fitted, graphs };
        if adapted.in_place_of.is_none() && (setup.force || adapted.objections.is_empty()) {
            adapted.bundle = Some(unwritten.write()?);
        } else {
            adapted.unwritten = Some(Arc::new(unwritten));
        }
    }
    (adapted.seconds, adapted.peak_mib) = (begin.elapsed().as_secs_f64(), peak_mib());
    Ok(adapted)
}

/// Writes a fit that was refused after all, in the place of whatever is there.
///
/// # Errors
/// If there is none, or it cannot be written.
pub fn keep(adapted: &Adapted) -> Result<Adapted, TaskError> {
    let unwritten = adapted.unwritten.as_ref().ok_or_else(|| TaskError::new(WHAT, "there is no fit to be kept"))?;
    Ok(Adapted { bundle: Some(unwritten.write_late()?), unwritten: None, in_place_of: None, ..adapted.clone() })
}

fn references(pictures: &[Option<DepthMap>]) -> Vec<Option<&DepthMap>> {
    pictures.iter().map(Option::as_ref).collect()
}

fn shown(touch: &FitTouch, after: &DepthMap) -> HeldBack {
    HeldBack {
        pair: touch.id,
        name: touch.name.clone(),
        pad: touch.pad,
        measured: touch.measured.clone(),
        before: touch.imprint(&touch.unfitted),
        after: touch.imprint(after),
    }
}

/// Warnings about the fit, in words.
fn warnings(
    setup: &AdaptSetup,
    pairs: usize,
    before: &Scored,
    closed: Option<&Scored>,
    grouped: bool,
    steps: u32,
) -> Vec<String> {
    let gain = closed.and_then(|closed| Some(closed.psnr_db? - before.psnr_db?));
    let mut warnings = Vec::new();
    if pairs < ENOUGH_PAIRS {
        warnings.push(format!(
            "{pairs} pairs are few: below {ENOUGH_PAIRS} the shapes of the training data show through; expect about 1.5 dB \
             less than with thirty"
        ));
    }
    if setup.folds == 0 {
        warnings.push("nothing was left out, so there is no score on other pairs".into());
    } else if closed.is_none() {
        let few = counted(pairs, "pair");
        warnings.push(format!("{few} are too few to leave any out, so there is no score on other pairs"));
    }
    if gain.is_some_and(|gain| gain < LEAST_GAIN_DB) {
        warnings.push(
            "on pairs that were left out the fit is no better than the shipped model: these sensors need no fit, or more \
             pairs"
                .into(),
        );
    }
    if grouped {
        warnings.push(
            "the images do not say which finger they are of: the fingers were told apart by their markers".into(),
        );
    }
    if (1..ENOUGH_STEPS).contains(&steps) {
        warnings.push(format!("{steps} tuning steps are few: below {ENOUGH_STEPS} tuning hardly improves on the fit"));
    }
    warnings
}

/// Tuned networks with what lies behind them.
struct Tuned {
    graphs: BTreeMap<Role, Vec<u8>>,
    corrections: Vec<Option<Correction>>,
    /// Prediction of each touch by networks that were tuned without it, meters, on the decoder's grid.
    left_out: Vec<Option<DepthMap>>,
    steps: u32,
    curves: Vec<Curve>,
}

#[cfg(not(feature = "tune"))]
fn tune(
    _: &AdaptSetup,
    _: Tuning,
    _: &[FitTouch],
    _: &[Option<Correction>],
    _: &[usize],
    _: &Rig,
    _: &JobCx,
) -> Result<Tuned, TaskError> {
    Err(TaskError::new(WHAT, "this program was built without tuning").with_hint("Fit in closed form."))
}

fn source(dataset: &Dataset, bundle: &BundleInfo, touches: &[FitTouch]) -> FitSource {
    let mut pairs: Vec<String> = touches.iter().map(|t| t.name.clone()).collect();
    pairs.dedup();
    let mut pictures: Vec<String> = touches.iter().map(|t| input_digest(&t.picture)[..DIGITS].to_owned()).collect();
    pictures.sort();
    pictures.dedup();
    FitSource {
        data: dataset.title.clone(),
        rig: dataset.rig.name.clone().into_owned(),
        scale: touches.first().map_or(Scale::Measured, |t| t.scale),
        pairs,
        pictures,
        from: bundle.name.clone(),
        from_sha256: bundle.id.to_string(),
    }
}

/// The corrections with what the lattice of each pad looks like, where pictures were fitted.
fn summaries(fitted: &Fitted, touches: &[FitTouch], rig: &Rig) -> Vec<PadSummary> {
    let summary = fitted.pads.entries().map(|(pad, fit)| PadSummary {
        pad: rig.pad_key(pad).into_owned(),
        touches: touches.iter().filter(|t| t.pad == pad).count(),
        offset_px: fit.correction.offset_px,
        gain: fit.correction.line[0],
        offset_m: fit.correction.line[1],
    });
    summary.collect()
}

fn with_lattices(touches: &[FitTouch], corrections: Vec<Option<Correction>>) -> PerPad<PadFit> {
    let with = |(pad, correction): (usize, Option<Correction>)| {
        let own = touches.iter().filter(|t| t.pad.index() == pad && t.scale == Scale::Assumed);
        let signatures: Vec<&Grid<f32>> = own.filter_map(|t| t.signature.as_ref()).collect();
        Some(PadFit { correction: correction?.into(), lattice: template(&signatures) })
    };
    corrections.into_iter().enumerate().map(with).collect()
}

fn remark(touches: &[FitTouch], doubt: &touch2touch_core::fit::Doubt) -> Remark {
    let mut why = format!(
        "the others expect something else: off by {:.2} mm where half of the pairs are off by less than {:.2} mm",
        doubt.residual_m * 1e3,
        doubt.median_m * 1e3
    );
    if let Some(partner) = doubt.partner {
        why += &format!("; its measurement is much nearer to the GelSlim image of {}", touches[partner].name);
    }
    if let Some(turn) = &doubt.turn {
        why += &format!("; {turn}, its measurement would be much nearer");
    }
    Remark { name: touches[doubt.case].name.clone(), why }
}
