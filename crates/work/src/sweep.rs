//! A dial turned through some values over many pairs: what a threshold, a probability, a gate, a trim or a shift does to
//! every pose, so that it can be chosen for all of them: [`sweep`]. The verb `sweep` and the studio's Dial pane call it.
//!
//! What does not depend on the dial is computed once: nothing is predicted anew for another mask, and no contact point
//! is made anew for another gate. Each pose is that of the verb `pose` and of the results table with the same settings.

mod dial;
mod outcome;

use std::collections::BTreeMap;
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::bundles::BundleInfo;
use super::cloud::contact_points;
use super::error::{Remark, TaskError};
use super::imprint::{imprints_of, measured};
use super::job::JobCx;
use super::labels::{ImprintOf, ImprintSource, Labels, MaskPlace, PairLabels};
use super::mask::{MaskInputs, MaskRecipe, contact_mask};
use super::models::{Masking, Models};
use super::pose::pose;
use super::predict::{Generating, Predicted};
use super::prediction::Prediction;
use super::tool::load_tool;
use crate::infer::engine::EngineChoice;
use crate::infer::mask::contact_of;
use crate::io::caught::caught;
use crate::io::dataset::Dataset;
use touch2touch_core::align::Ask;
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::dataset::{PairId, Problem};
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::{DepthMap, Grid, Mask};
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;

pub use dial::{Dial, InForce, MOST_VALUES, Setting};
pub use outcome::{Failure, Outcome, Point, Series, Summary};

/// What it is called in errors.
const WHAT: &str = "Dial";
/// Pairs that are read and predicted together.
const BATCH: usize = 8;

/// Which dial is turned, to what, over which pairs, and what is in force besides.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepSetup {
    /// What the dial is turned to, in this order; all of one dial.
    pub values: Vec<Setting>,
    /// The pairs.
    pub pairs: Vec<PairId>,
    /// Mask, registration and shift as they are without the dial.
    pub in_force: InForce,
    /// The mask model, where there is one.
    pub mask_model: Option<BundleInfo>,
    /// The generator and its choices; `None` leaves the predictions out.
    pub generator: Option<(BundleInfo, GenerateConfig)>,
    /// Whether a mask drawn by hand is taken where there is one.
    pub hand: bool,
    /// The engine that runs the models.
    pub engine: EngineChoice,
}

/// What every value does to every pair.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sweep {
    /// The data set's title.
    pub dataset: String,
    /// The dial.
    pub dial: Dial,
    /// The unit of its values; empty for a share or a name.
    pub unit: &'static str,
    /// What the dial stands at without turning it; `None` where something else decides.
    pub at: Option<Setting>,
    /// Mask, registration and shift besides.
    pub in_force: InForce,
    /// The measured imprints and the predicted ones, as far as they are there.
    pub series: Vec<Series>,
    /// Pairs that have no pose whatever the dial says, and why.
    pub left_out: Vec<Remark>,
    /// What to know about the figures.
    pub notes: Vec<String>,
    /// Pairs that were taken.
    pub pairs: usize,
    /// Whether all pairs asked for were: false if stopped early.
    pub complete: bool,
    /// Time it took, seconds.
    pub seconds: f64,
}

/// A pair that is read.
struct Pair {
    id: PairId,
    name: String,
    tool: String,
    sample: Sample,
    labels: Option<PairLabels>,
}

impl Pair {
    fn failed(&self, why: String) -> Outcome {
        let truth = self.sample.grasp_from_object.is_some();
        Outcome { truth, ..Outcome::failed(self.id, self.name.clone(), why) }
    }
}

/// The imprints of a pair by one source under one shift, with the mask model's probabilities where they are needed.
struct Felt {
    /// What the imprints are, for masks that were drawn on them.
    of: ImprintOf,
    imprints: PerPad<DepthMap>,
    probabilities: PerPad<Result<(Grid<f32>, f32), String>>,
}

/// A source of a pair's imprints: one for all values, or one for each where the dial is the shift.
struct Side {
    source: ImprintSource,
    felt: Vec<Result<Felt, String>>,
}

/// The predictions of a pair, or why there are none.
type Made = Result<PerPad<Prediction>, String>;

/// Turns a dial over the pairs of `setup`. Predictions are taken from `models`, where they are kept too. Stops early when
/// told to, with the pairs that were done.
///
/// # Errors
/// If the values make no sense for what is in force, a model cannot be used, no pair has a pose that a dial could move,
/// or it was told to stop before the first was done.
pub fn sweep(dataset: &Dataset, setup: &SweepSetup, models: &Models, cx: &JobCx) -> Result<Sweep, TaskError> {
    let start = Instant::now();
    let job = Job::new(dataset, setup, models, cx)?;
    let (mut left_out, mut tools) = (Vec::new(), BTreeMap::new());
    let mut rows: BTreeMap<ImprintSource, Vec<Vec<Outcome>>> = BTreeMap::new();
    let (mut done, mut posed, total) = (0, 0, setup.pairs.len());
    for ids in setup.pairs.chunks(BATCH) {
        if cx.cancel.is_cancelled() {
            break;
        }
        cx.progress(done as u64, total as u64, "reading and predicting");
        let read: Vec<_> = ids.par_iter().map(|id| job.read(*id)).collect();
        let mut pairs = Vec::new();
        for pair in read {
            let usable = pair.and_then(|pair| {
                let tool = tools.entry(pair.tool.clone());
                let tool = tool.or_insert_with(|| load_tool(dataset, &pair.tool).map(|(tool, _)| tool));
                let why =
                    |err: &TaskError| Remark { name: pair.name.clone(), why: format!("{}: {}", err.what, err.why) };
                tool.as_ref().map(drop).map_err(why).map(|()| pair)
            });
            match usable {
                Ok(pair) => pairs.push(pair),
                Err(remark) => left_out.push(remark),
            }
        }
        let Some(sides) = job.sides(&pairs)? else { break };
        cx.progress(done as u64, total as u64, "poses");
        let found: Vec<Vec<(ImprintSource, Vec<Outcome>)>> = pairs
            .par_iter()
            .zip(sides)
            .filter(|_| !cx.cancel.is_cancelled())
            .map(|(pair, sides)| {
                let Some(Ok(tool)) = tools.get(&pair.tool) else { return Vec::new() };
                sides.into_iter().map(|side| (side.source, job.outcomes(pair, tool, &side.felt))).collect()
            })
            .collect();
        if cx.cancel.is_cancelled() {
            break;
        }
        for (pair, found) in pairs.iter().zip(found) {
            if found.is_empty() {
                let why = "it has neither a measured imprint nor a picture to predict one from".to_owned();
                left_out.push(Remark { name: pair.name.clone(), why });
            }
            posed += usize::from(!found.is_empty());
            for (source, row) in found {
                rows.entry(source).or_default().push(row);
            }
        }
        done += ids.len();
        cx.progress(done as u64, total as u64, format!("{done} of {total} pairs"));
    }
    if rows.is_empty() {
        cx.check(WHAT)?;
        let why = left_out.first().map_or("no pair was asked for".to_owned(), |first| {
            format!("no pair has a pose that the dial could move; the first: {}: {}", first.name, first.why)
        });
        return Err(TaskError::new(WHAT, why));
    }
    let hand = rows.values().flatten().filter(|row| row.iter().any(|outcome| outcome.hand)).count();
    let line = |p: &Problem| format!("{}: {} ({})", p.file.display(), p.what, p.hint);
    let mut notes: Vec<String> = dataset.problems.iter().map(line).collect();
    if hand > 0 && setup.hand && matches!(job.dial, Dial::Threshold | Dial::Probability) {
        notes.push(format!("{hand} imprints have a mask that was drawn by hand, which this dial does not move"));
    }
    if setup.generator.is_none() {
        notes.push("no generator: the predictions are not in it".into());
    }
    let series = rows.into_iter().map(|(source, rows)| Series::new(source, rows, setup, job.at)).collect();
    Ok(Sweep {
        dataset: dataset.title.clone(),
        dial: job.dial,
        unit: job.dial.unit(),
        at: job.at,
        in_force: setup.in_force,
        series,
        pairs: posed,
        left_out,
        notes,
        complete: done == total,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// What is the same for all pairs.
struct Job<'a> {
    dataset: &'a Dataset,
    setup: &'a SweepSetup,
    models: &'a Models,
    cx: &'a JobCx,
    labels: Option<Labels>,
    dial: Dial,
    /// Where it stands.
    at: Option<Setting>,
    /// What is in force without the dial, then with each value.
    turns: Vec<InForce>,
    /// The mask recipe of each.
    recipes: Vec<MaskRecipe>,
}

impl<'a> Job<'a> {
    fn new(dataset: &'a Dataset, setup: &'a SweepSetup, models: &'a Models, cx: &'a JobCx) -> Result<Self, TaskError> {
        let fail = |why: String| TaskError::new(WHAT, why);
        let dial = setup.values.first().ok_or_else(|| fail("there are no values to turn it to".into()))?.dial();
        if setup.values.iter().any(|value| value.dial() != dial) {
            return Err(fail("the values are of more than one dial".into()));
        }
        if setup.values.len() > MOST_VALUES {
            return Err(fail(format!("{} values are too many: at most {MOST_VALUES}", setup.values.len())));
        }
        if setup.pairs.is_empty() {
            return Err(fail("there are no pairs".into()));
        }
        let model = setup.mask_model.as_ref();
        if dial == Dial::Probability && model.is_none() {
            return Err(fail("no mask model was found, whose probability could be dialed".into()));
        }
        if dial == Dial::Shift && setup.generator.is_none() {
            return Err(fail("a shift is of predictions, and there is no generator".into()));
        }
        let mut turns = vec![setup.in_force];
        for value in &setup.values {
            turns.push(value.put(setup.in_force).map_err(fail)?);
        }
        let recipe = |turn: &InForce| Masking { choice: turn.mask, model, engine: setup.engine }.recipe();
        let recipes = turns.iter().map(recipe).collect::<Result<Vec<_>, _>>()?;
        let own = match (dial, model) {
            (Dial::Probability, Some(model)) => Some(models.least_probability(model)?),
            _ => None,
        };
        let at = dial.of(&setup.in_force, &recipes[0], own);
        let labels = setup.hand.then(|| Labels::of(dataset));
        Ok(Self { dataset, setup, models, cx, labels, dial, at, turns, recipes })
    }

    fn read(&self, id: PairId) -> Result<Pair, Remark> {
        let entry = self.dataset.index.get(id);
        let entry = entry.ok_or_else(|| Remark { name: format!("pair {}", id.0), why: "no such pair".into() })?;
        let remark = |why: String| Remark { name: entry.name.clone(), why };
        let tool = entry.tool.clone();
        let tool = tool.ok_or_else(|| remark("no tool is named, so there is no CAD model to register".into()))?;
        let sample = self.dataset.load(id).map_err(|err| remark(format!("{err} ({})", err.hint())))?;
        if sample.pads.iter().flatten().all(|touch| touch.camera().is_none()) {
            return Err(remark("it has no depth camera, so there are no points to register".into()));
        }
        let labels = self.labels.as_ref().map(|labels| labels.load(&entry.name)).transpose();
        let labels = labels.map_err(|err| remark(err.to_string()))?;
        Ok(Pair { id, name: entry.name.clone(), tool, sample, labels })
    }

    /// The imprints of each pair. `None` once it was told to stop.
    ///
    /// # Errors
    /// If the generator cannot be used at all.
    fn sides(&self, pairs: &[Pair]) -> Result<Option<Vec<Vec<Side>>>, TaskError> {
        let mut predictions = self.predictions(pairs)?;
        let mut all = Vec::new();
        for (at, pair) in pairs.iter().enumerate() {
            if self.cx.cancel.is_cancelled() {
                return Ok(None);
            }
            let mut sides = Vec::new();
            let felt = measured(&pair.sample);
            // A shift is of predictions alone.
            if self.dial != Dial::Shift && felt.iter().flatten().next().is_some() {
                sides.push(Side {
                    source: ImprintSource::Measured,
                    felt: vec![Ok(self.felt(pair, ImprintOf::Measured, felt))],
                });
            }
            if let Some(made) = predictions.get_mut(at).and_then(Option::take) {
                let turns = if self.dial == Dial::Shift { &self.turns[..] } else { &self.turns[..1] };
                let felt = |turn: &InForce| {
                    let made = made.as_ref().map_err(Clone::clone)?;
                    let imprints = imprints_of(made, turn.shift, &pair.sample);
                    let imprints = imprints.map_err(|err| format!("{}: {}", err.what, err.why))?;
                    let of = self.setup.generator.as_ref();
                    let of = of.map(|(bundle, config)| ImprintOf::predicted(&bundle.id, config, turn.shift));
                    Ok(self.felt(pair, of.unwrap_or_default(), imprints))
                };
                sides.push(Side { source: ImprintSource::Predicted, felt: turns.iter().map(felt).collect() });
            }
            all.push(sides);
        }
        Ok(Some(all))
    }

    /// The predictions of each pair, or why there are none; `None` where there is nothing to start from.
    fn predictions(&self, pairs: &[Pair]) -> Result<Vec<Option<Made>>, TaskError> {
        let Some((bundle, config)) = &self.setup.generator else { return Ok(Vec::new()) };
        let generating = Generating { bundle, engine: self.setup.engine, config };
        let samples: Vec<&Sample> = pairs.iter().map(|pair| &pair.sample).collect();
        let made = generating.pairs(self.models, &samples, &self.cx.quiet())?;
        let one = |made: Predicted| {
            let mut pads = PerPad::default();
            for (at, made) in made.into_iter().enumerate() {
                pads[PadId::new(at)] = made.transpose().map_err(|err| err.why)?;
            }
            Ok(pads)
        };
        let made = made.unwrap_or_default().into_iter();
        Ok(made.map(|made| (!made.is_empty()).then(|| one(made))).collect())
    }

    /// Imprints with the mask model's word on those whose mask nobody drew, if any value asks for it.
    fn felt(&self, pair: &Pair, of: ImprintOf, imprints: PerPad<DepthMap>) -> Felt {
        let mut probabilities = PerPad::default();
        let asked = self.recipes.iter().any(|recipe| matches!(recipe, MaskRecipe::Unet(..)));
        if let Some(model) = self.setup.mask_model.as_ref().filter(|_| asked) {
            for (pad, imprint) in imprints.entries() {
                let place = MaskPlace { pad, of: of.clone() };
                if pair.labels.as_ref().is_none_or(|labels| labels.drawn(&place, imprint).is_none()) {
                    let found = caught(|| self.models.probability(model, self.setup.engine, imprint));
                    probabilities[pad] = Some(found.and_then(|found| found.map_err(|err| err.why)));
                }
            }
        }
        Felt { of, imprints, probabilities }
    }

    /// The pose of a pair without the dial, and with each value.
    fn outcomes(&self, pair: &Pair, tool: &ToolModel, felt: &[Result<Felt, String>]) -> Vec<Outcome> {
        let bug =
            |message: String| format!("an internal error, which is a bug: {message}; please report it with this pair");
        let points = |at: usize| {
            let felt = felt.get(at).or(felt.first()).ok_or("there is no imprint")?;
            let felt = felt.as_ref().map_err(Clone::clone)?;
            caught(|| self.points(pair, tool, felt, at)).unwrap_or_else(|message| Err(bug(message)))
        };
        // A gate does not move a contact point.
        let once = matches!(self.dial, Dial::Gate | Dial::Trim).then(|| points(0));
        let mut all: Vec<Outcome> = Vec::with_capacity(self.turns.len());
        for (at, turn) in self.turns.iter().enumerate() {
            let same = self.turns[..at].iter().position(|earlier| earlier == turn);
            let outcome = match same {
                Some(same) => all[same].clone(),
                None => {
                    let points = once.clone().unwrap_or_else(|| points(at));
                    let found = caught(|| self.outcome(pair, tool, turn, points));
                    found.unwrap_or_else(|message| pair.failed(bug(message)))
                }
            };
            all.push(outcome);
        }
        let base = all[0].angle_rad;
        all.iter_mut().for_each(|outcome| outcome.set_change(base));
        all
    }

    /// The contact points of a pair with one value, and whether a mask behind them was drawn by hand.
    fn points(&self, pair: &Pair, tool: &ToolModel, felt: &Felt, at: usize) -> Result<(Vec<DVec3>, bool), String> {
        let (recipe, choice) = (&self.recipes[at], self.turns[at].mask);
        let labels = pair.labels.as_ref();
        let inputs = MaskInputs { sample: &pair.sample, tool: Some(tool), labels, of: Some(&felt.of) };
        let (mut masks, mut hand): (PerPad<Mask>, bool) = (PerPad::default(), false);
        for (pad, imprint) in felt.imprints.entries() {
            let unet = |imprint: &DepthMap| match &felt.probabilities[pad] {
                Some(Ok((map, own))) => Ok(contact_of(map, imprint, choice.probability.unwrap_or(*own))),
                Some(Err(why)) => Err(TaskError::new(WHAT, why)),
                None => Err(TaskError::new(WHAT, "the mask model is needed")),
            };
            let finger = pair.sample.rig.pad_key(pad);
            let found = contact_mask(recipe, imprint, pad, inputs, unet)
                .map_err(|err| format!("{finger} finger: contact mask: {}", err.why))?;
            hand |= found.basis == MaskBasis::Hand;
            masks[pad] = Some(found.mask);
        }
        let points = contact_points(&pair.sample, &felt.imprints.as_ref(), &masks.as_ref());
        Ok((points.map_err(|err| err.why)?, hand))
    }

    fn outcome(
        &self,
        pair: &Pair,
        tool: &ToolModel,
        turn: &InForce,
        points: Result<(Vec<DVec3>, bool), String>,
    ) -> Outcome {
        let truth = pair.sample.grasp_from_object;
        let (points, hand) = match points {
            Ok(found) => found,
            Err(why) => return pair.failed(why),
        };
        let found = pose(&points, tool, &*turn.registration.method(), Ask::default(), truth);
        let answer = found.as_ref().ok();
        Outcome {
            pair: pair.id,
            name: pair.name.clone(),
            truth: truth.is_some(),
            angle_rad: answer.map(|found| found.angle_rad),
            error_rad: answer.and_then(|found| found.error_rad),
            change_rad: None,
            rms_m: answer.map(|found| found.rms_m),
            points: points.len(),
            hand,
            failure: match &found {
                Ok(_) => None,
                Err(_) if points.is_empty() => Some("no contact points".into()),
                Err(err) => Some(err.why.clone()),
            },
        }
    }
}
