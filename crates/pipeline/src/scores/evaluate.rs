//! The paper's results table of a data set: generators, the measured imprints as the upper bound, and predictions that
//! lie by the data, all through one pipeline (imprint, contact mask, pose, classifier). The verb `evaluate` and the
//! studio's Evaluate pane both call [`evaluate`].

mod export;
mod kept;
mod load;
mod methods;
mod tool;

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::doubts;
use crate::error::TaskError;
use crate::infer::bundle::Origin;
use crate::infer::engine::threads;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::steps::models;
use crate::steps::recipe::Recipe;
use methods::Models;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::Sampler;
use touch2touch_core::evaluation::{self, Group, Row, Scores};
use touch2touch_core::findings::{Finding, Findings};
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::Scale;

pub use export::{Report, csv, export, rows};
pub use kept::Kept;

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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skipped {
    /// The pair or the tool.
    pub what: String,
    /// By which method; empty for all.
    pub method: String,
    /// Why.
    pub why: String,
}

/// The table with what is behind it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// The data set's title.
    pub dataset: String,
    /// The rows, the upper bound first.
    pub rows: Vec<Row>,
    /// The column groups.
    pub groups: Vec<Group>,
    /// Meaning of PSNR and SSIM.
    pub conventions: Cow<'static, str>,
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
    #[serde(skip_deserializing)]
    pub setup: Setup,
    /// The engine of the models and its threads.
    pub runtime: String,
    /// Time it took, seconds.
    pub seconds: f64,
    /// Every method's figures of every grasp.
    #[serde(skip)]
    pub scores: Vec<Scores>,
}

/// Scores every grasp of `dataset` by every method of `setup`. Predictions that are kept are not made again. Stops early when told to, with what was scored so far.
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
    let start = Instant::now();
    cx.progress(0, 0, "loading the models");
    let mut models = Models::open(setup, dataset, models)?;
    let work = load::plan(dataset, setup);
    let total: usize = work.iter().map(|tool| tool.ids.len()).sum();
    if total == 0 {
        return Err(TaskError::new(WHAT, "the data set has no pairs"));
    }
    models.load()?;
    let mut skipped = Vec::new();
    let mut scores = models.empty_scores();
    let mut findings = Findings::default();
    findings.extend(dataset.problems.iter().cloned());
    findings.extend(doubts::notes(dataset));
    let (mut done, mut scale) = (0, Scale::Measured);
    load::ahead(dataset, setup, &work, cx, |batch| {
        let name = batch.work.tool.as_deref().unwrap_or("pictures");
        let mut tool = tool::Tool::new(dataset, batch.work, &mut skipped);
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
        let entries = tool.finish(&mut scores, &mut skipped);
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
    let rows: Vec<Row> = scores.iter().map(|s| evaluation::row(s, &groups, setup.resamples)).collect();
    let mut notes: Vec<String> = evaluation::NOTES.iter().map(|&n| n.to_owned()).collect();
    notes.append(&mut models.missing(setup, &dataset.rig, scale));
    notes.append(&mut models.masks_made_otherwise());
    notes.extend(evaluation::few_features(&scores, &groups));
    Ok(Evaluation {
        dataset: dataset.title.clone(),
        rows,
        groups,
        conventions: evaluation::conventions(scale).into(),
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

/// The pairs of one tool.
#[derive(Clone, Debug, PartialEq)]
struct ToolWork {
    tool: Option<String>,
    ids: Vec<PairId>,
}
