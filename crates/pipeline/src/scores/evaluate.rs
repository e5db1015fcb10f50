//! The paper's results table of a data set: generators, the measured imprints as the upper bound, and predictions that
//! lie by the data, all through one pipeline (imprint, contact mask, pose, classifier). The verb `evaluate` and the
//! studio's Evaluate pane both call [`evaluate`].

mod against;
mod apart;
mod doubt;
mod export;
mod kept;
mod load;
mod methods;
mod tool;

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use serde::Serialize;

use crate::doubts;
use crate::error::TaskError;
use crate::infer::bundle::Origin;
use crate::infer::engine::threads;
use crate::infer::features::Preparation;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::steps::models;
use crate::steps::recipe::Recipe;
use kept::KeptScores;
use methods::Models;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::Sampler;
use touch2touch_core::evaluation::{self, Difference, Group, Row, Scores};
use touch2touch_core::findings::{Finding, Findings};
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::Scale;

pub use export::{Report, csv, export, latex, markdown, rows};

/// Name of the task in errors.
const WHAT: &str = "Evaluate";
/// Name of the row of the measured imprints themselves.
pub const MEASURED: &str = "Measured (upper bound)";

/// Settings of an evaluation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setup {
    /// Generator bundles: a row each.
    pub bundles: Vec<Origin>,
    /// The tool classifier; without it neither accuracy nor Fréchet distance.
    pub classifier: Option<Origin>,
    /// Feature extractor of the Fréchet distance with the preparation of its pictures, instead of the classifier's features.
    pub features: Option<(Origin, Preparation)>,
    /// Recipe that every method has in common: all but the generator and the imprint, which are the method's.
    #[serde(flatten)]
    pub recipe: Recipe,
    /// Sampling steps instead of each bundle's own; not for bundles that draw in one step.
    pub steps: Option<u32>,
    /// Seed instead of each bundle's own; every image starts from the same one.
    pub seed: Option<u64>,
    /// Sampler instead of each bundle's own.
    pub sampler: Option<Sampler>,
    /// Only these pairs; `None` takes all.
    #[serde(skip)]
    pub pairs: Option<BTreeSet<PairId>>,
    /// At most so many grasps of each tool, spread evenly.
    pub grasps_per_tool: Option<usize>,
    /// The only finger whose images are compared, or all. Poses always come from all.
    pub finger: Option<PadId>,
    /// Images that go through a generator at once.
    pub batch: usize,
    /// Drawings for the intervals.
    pub resamples: usize,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            bundles: Vec::new(),
            classifier: None,
            features: None,
            recipe: Recipe::default(),
            steps: None,
            seed: None,
            sampler: None,
            pairs: None,
            grasps_per_tool: None,
            finger: None,
            batch: 8,
            resamples: 400,
        }
    }
}

/// Something that could not be scored.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Skipped {
    /// The pair or the tool.
    pub what: String,
    /// By which method; empty for all.
    pub method: String,
    /// Why.
    pub why: String,
}

/// The table with what is behind it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// The data set's title.
    pub dataset: String,
    /// The rows, the upper bound first.
    pub rows: Vec<Row>,
    /// The column groups.
    pub groups: Vec<Group>,
    /// Each further generator less the first, on the same grasps; and all of them less those of [`Evaluation::against`].
    pub differences: Vec<Difference>,
    /// Meaning of PSNR and SSIM.
    pub conventions: &'static str,
    /// Meaning of the columns, and reasons for what is missing.
    pub notes: Vec<String>,
    /// Oddities of the files, by kind.
    pub findings: Vec<Finding>,
    /// Grasps and tools that were left out, and why.
    pub skipped: Vec<Skipped>,
    /// Grasps in the table.
    pub scored: usize,
    /// Pairs of the data set.
    pub of: usize,
    /// True where everything asked for was scored; false if stopped early.
    pub complete: bool,
    /// Settings of the evaluation.
    pub setup: Setup,
    /// The engine of the models and its threads.
    pub runtime: String,
    /// Time it took, seconds.
    pub seconds: f64,
    /// Every method's figures of every grasp.
    #[serde(skip)]
    pub scores: Vec<Scores>,
}

/// Scores every grasp of `dataset` by every method of `setup`. Figures that are kept beside `models` are not computed
/// again, nor are predictions. Stops early when told to, with what was scored so far.
///
/// # Errors
/// If a bundle cannot be used, nothing could be scored, or it was told to stop before anything was. Pairs and
/// predictions that fail are left out and listed.
pub fn evaluate(
    dataset: &Dataset,
    setup: &Setup,
    models: &models::Models,
    cx: &JobCx,
) -> Result<Evaluation, TaskError> {
    cx.progress(0, 0, "loading the models");
    let sheets = models.sheets().clone();
    let models = Models::open(setup, dataset, models)?;
    let work = load::plan(dataset, setup);
    if work.iter().all(|tool| tool.ids.is_empty()) {
        return Err(TaskError::new(WHAT, "the data set has no pairs"));
    }
    let book = KeptScores::open(dataset, setup, &models, &sheets, &work, false);
    score(dataset, setup, models, (&work, &book), false, cx)
}

/// The table of the grasps whose figures are kept by every method that has any, without computing any; `None` where there
/// are none. A generator of which nothing is kept gets no row.
///
/// # Errors
/// If a bundle cannot be opened.
pub fn kept(dataset: &Dataset, setup: &Setup, models: &models::Models) -> Result<Option<Evaluation>, TaskError> {
    let opened = Models::open(setup, dataset, models)?;
    let mut work = load::plan(dataset, setup);
    let book = KeptScores::open(dataset, setup, &opened, models.sheets(), &work, true);
    let ids = || work.iter().flat_map(|tool| tool.ids.iter().copied());
    let first = opened.before_generators();
    let known = |at: &usize| ids().any(|id| book.has(first + at, id));
    let bundles: Vec<Origin> = (0..setup.bundles.len()).filter(known).map(|at| setup.bundles[at].clone()).collect();
    if bundles.len() < setup.bundles.len() && !bundles.is_empty() {
        return kept(dataset, &Setup { bundles, ..setup.clone() }, models);
    }
    if bundles.is_empty() || !ids().any(|id| book.is_whole(id)) {
        return Ok(None);
    }
    let planned = ids().count();
    work.iter_mut().for_each(|tool| tool.ids.retain(|id| book.is_whole(*id)));
    let table = score(dataset, setup, opened, (&work, &book), true, &JobCx::unwatched())?;
    Ok(Some(Evaluation { complete: table.scored == planned, ..table }))
}

/// Scores the grasps of `work` whose figures are not kept; `as_kept` leaves those that are as they are.
fn score(
    dataset: &Dataset,
    setup: &Setup,
    mut models: Models,
    (work, book): (&[ToolWork], &KeptScores),
    as_kept: bool,
    cx: &JobCx,
) -> Result<Evaluation, TaskError> {
    let start = Instant::now();
    let total: usize = work.iter().map(|tool| tool.ids.len()).sum();
    let missing = |tool: &ToolWork| ToolWork {
        tool: tool.tool.clone(),
        ids: tool.ids.iter().copied().filter(|id| !book.is_whole(*id)).collect(),
    };
    let todo: Vec<ToolWork> = work.iter().map(missing).collect();
    let fresh: usize = todo.iter().map(|tool| tool.ids.len()).sum();
    if fresh > 0 {
        models.load()?;
    }
    let mut skipped = Vec::new();
    let mut scores = models.empty_scores();
    let mut findings = Findings::default();
    findings.extend(dataset.problems.iter().cloned());
    findings.extend(doubts::notes(dataset));
    let (mut done, mut scale) = (total - fresh, Scale::Measured);
    let mut whole = work.iter();
    load::ahead(dataset, setup, &todo, cx, |batch| {
        let name = batch.work.tool.as_deref().unwrap_or("pictures");
        let mut tool = tool::Tool::new(dataset, batch.work, book, &mut skipped);
        for cases in batch.cases {
            if cx.cancel.is_cancelled() {
                break;
            }
            let cases = match cases {
                Ok(cases) => cases,
                Err(mut bad) => {
                    skipped.append(&mut bad);
                    continue;
                }
            };
            let loaded = cases.good.len() + cases.bad.len();
            skipped.extend(cases.bad);
            tool.score(&cases.good, setup, &mut models, &mut skipped, cx, &mut |method| {
                cx.progress(done as u64, total as u64, format!("{name}, {method}"));
            });
            done += loaded;
            cx.progress(done as u64, total as u64, name);
        }
        let ids = whole.next().map_or(&[][..], |tool| &tool.ids);
        let mut again = |at: usize, ids: &[PairId]| tool::again(dataset, setup, &mut models.methods[at], ids, cx);
        let again: Option<tool::MakeAgain<'_>> = if as_kept { None } else { Some(&mut again) };
        let entries = tool.finish(ids, again, &mut scores, &mut skipped);
        // Of each grasp once, whatever the number of methods.
        let mut noted = BTreeSet::new();
        for (at, entry) in entries {
            if noted.insert(entry.score.pair.clone()) {
                findings.extend(entry.notes);
            }
            scale = entry.score.scale;
            for (why, count) in entry.otherwise {
                *models.made_otherwise.entry((scores[at].method.clone(), why)).or_insert(0) += count;
            }
        }
    });
    let groups = evaluation::groups_of(scores.iter().flat_map(|s| &s.grasps));
    if groups.is_empty() {
        cx.check(WHAT)?;
        let why = skipped.first().map_or("nothing could be scored".to_owned(), |s: &Skipped| {
            format!("nothing could be scored; the first failure: {}: {}", s.what, s.why)
        });
        return Err(TaskError::new(WHAT, why));
    }
    cx.progress(total as u64, total as u64, "intervals");
    scores.retain(|s| !s.grasps.is_empty());
    let mut rows: Vec<Row> = scores.iter().map(|s| evaluation::row(s, &groups, setup.resamples)).collect();
    if setup.features.is_some() {
        rows.iter_mut().for_each(Row::call_fid);
    }
    let mut notes: Vec<String> = evaluation::NOTES.iter().map(|&n| n.to_owned()).collect();
    notes.append(&mut models.missing(setup, &dataset.rig, scale));
    notes.append(&mut models.masks_made_otherwise());
    notes.extend(evaluation::few_features(&scores, &groups));
    let methods = 0..if as_kept { scores.len() } else { 0 };
    let other_range: usize = methods
        .map(|method| work.iter().map(|tool| tool::of_other_range(book, method, &tool.ids)).sum::<usize>())
        .sum();
    if other_range > 0 {
        notes.push(format!(
            "The SSIM of {other_range} grasps is in the range of another selection of pairs: evaluate again to have it in this one's"
        ));
    }
    Ok(Evaluation {
        dataset: dataset.title.clone(),
        rows,
        groups,
        differences: against::among(&scores, setup.resamples),
        conventions: evaluation::conventions(scale),
        notes,
        findings: findings.into_list(),
        skipped,
        scored: scores.iter().map(|s| s.grasps.len()).max().unwrap_or_default(),
        of: dataset.index.pairs.len(),
        complete: done == total && !cx.cancel.is_cancelled(),
        setup: setup.clone(),
        runtime: format!("{}, {} thread(s), {} images at a time", models.engine(), threads(), setup.batch.max(1)),
        seconds: start.elapsed().as_secs_f64(),
        scores,
    })
}

/// The figures that are kept of the grasps of `dataset` by the methods of `setup`, without computing any but how far kept
/// predictions with different seeds are apart. Their lab SSIM is in the range of the tool's predictions at the time.
///
/// # Errors
/// If a bundle cannot be opened.
pub fn known(dataset: &Dataset, setup: &Setup, models: &models::Models) -> Result<Vec<Scores>, TaskError> {
    let (all, sheets) = (models, models.sheets().clone());
    let models = Models::open(setup, dataset, models)?;
    let work = load::plan(dataset, setup);
    let book = KeptScores::open(dataset, setup, &models, &sheets, &work, true);
    let mut scores = models.empty_scores();
    for (at, scores) in scores.iter_mut().enumerate() {
        let mut entries: Vec<_> = work.iter().flat_map(|tool| book.of(at, &tool.ids)).collect();
        if scores.upper_bound {
            apart::put(&mut entries, dataset, setup, &models, all);
        }
        scores.grasps = entries.into_iter().map(|(_, entry)| entry.score).collect();
    }
    Ok(scores)
}

/// The pairs of one tool.
#[derive(Clone, Debug, PartialEq)]
struct ToolWork {
    tool: Option<String>,
    ids: Vec<PairId>,
}

/// The pairs by tool, in the order of the index.
fn by_tool(dataset: &Dataset) -> BTreeMap<Option<String>, Vec<PairId>> {
    let mut tools: BTreeMap<Option<String>, Vec<PairId>> = BTreeMap::new();
    for (id, entry) in (0u32..).zip(&dataset.index.pairs) {
        tools.entry(entry.tool.clone()).or_default().push(PairId(id));
    }
    tools
}
