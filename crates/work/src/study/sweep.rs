//! A dial turned through some values over many pairs: what a threshold, a probability, a gate, a trim or a shift does to
//! every pose, so that it can be chosen for all of them: [`sweep`]. The verb `sweep` and the studio's Dial pane call it.
//!
//! Results that do not depend on the dial are computed once: nothing is predicted anew for another mask, and no contact
//! point is made anew for another gate. Each pose is that of the verb `pose` and of the results table with the same
//! settings.

mod dial;
mod joined;
mod outcome;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;
use serde::{Serialize, Serializer};

use crate::error::{Remark, TaskError};
use crate::feel::{Felt, Touch};
use crate::imprint::measured;
use crate::io::caught::caught;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::{ImprintSource, Labels, PairLabels};
use crate::mask::MaskRecipe;
use crate::models::Models;
use crate::predict::Predicted;
use crate::prediction::Prediction;
use crate::recipe::{Model, Recipe, Stage};
use crate::tool::load_tool;
use touch2touch_core::align::Ask;
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::dataset::{PairId, Problem};
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;

pub use dial::{Dial, MOST_VALUES, Setting};
pub use outcome::{Outcome, Point, Series, Summary};

/// Name of the task in errors.
const WHAT: &str = "Dial";
/// Pairs that are read and predicted together.
const BATCH: usize = 8;

/// Settings of a sweep: the dial, its values, the pairs, and the recipe in force besides.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepSetup {
    /// Values that the dial is turned to, in this order; all of one dial.
    pub values: Vec<Setting>,
    /// The pairs.
    pub pairs: Vec<PairId>,
    /// The recipe as it is without the dial, of either imprint; without a generator the predictions are left out.
    pub recipe: Recipe,
}

/// Effect of every value on every pair. Models are `M`: names where it was read from a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(bound(serialize = "M: Clone + Serialize"))]
pub struct Sweep<M = Model> {
    /// The data set's title.
    pub dataset: String,
    /// The dial.
    pub dial: Dial,
    /// The unit of its values; empty for a share or a name.
    pub unit: &'static str,
    /// Setting of the dial without turning it; `None` where something else decides.
    pub at: Option<Setting>,
    /// The recipe besides.
    #[serde(serialize_with = "what_decides")]
    pub in_force: Recipe<M>,
    /// The measured imprints and the predicted ones, as far as they are there.
    pub series: Vec<Series>,
    /// Pairs that have no pose whatever the dial says, and why.
    pub left_out: Vec<Remark>,
    /// Remarks on the figures, in words.
    pub notes: Vec<String>,
    /// Pairs that were taken.
    pub pairs: usize,
    /// True where all pairs asked for were taken; false if stopped early.
    pub complete: bool,
    /// Time it took, seconds.
    pub seconds: f64,
}

/// A recipe of both imprints without what decides nothing.
fn what_decides<M: Clone + Serialize, S: Serializer>(recipe: &Recipe<M>, to: S) -> Result<S::Ok, S::Error> {
    let imprint = recipe.generator.as_ref().map_or(ImprintSource::Measured, |_| ImprintSource::Predicted);
    recipe.of(imprint).until(Stage::Pose).serialize(to)
}

/// End of the note on masks that were drawn by hand.
const NOT_MOVED: &str = "have a mask that was drawn by hand, which this dial does not move";
/// The note where nothing is predicted.
const NO_GENERATOR: &str = "no generator: the predictions are not in it";

/// The note on masks that were drawn by hand, of so many imprints.
fn hand_note(dial: Dial, imprints: usize) -> Option<String> {
    let masks = matches!(dial, Dial::Threshold | Dial::Probability);
    (imprints > 0 && masks).then(|| format!("{imprints} imprints {NOT_MOVED}"))
}

/// A pair that is read.
struct Pair {
    id: PairId,
    name: String,
    tool: String,
    sample: Sample,
    labels: PairLabels,
}

impl Pair {
    fn outcome(&self, felt: &Felt) -> Outcome {
        let (points, found) = (felt.points().map_or(0, Vec::len), felt.pose());
        let answer = found.ok();
        Outcome {
            pair: self.id,
            name: self.name.clone(),
            truth: self.sample.grasp_from_object.is_some(),
            angle_rad: answer.map(|found| found.angle_rad),
            error_rad: answer.and_then(|found| found.error_rad),
            change_rad: None,
            rms_m: answer.map(|found| found.rms_m),
            points,
            hand: felt.contact().masks.iter().flatten().any(|found| found.basis == MaskBasis::Hand),
            failure: match found {
                Ok(_) => None,
                Err(_) if felt.points().is_ok() && points == 0 => Some("no contact points".into()),
                Err(err) => Some(err.why.clone()),
            },
        }
    }

    fn failed(&self, why: String) -> Outcome {
        let truth = self.sample.grasp_from_object.is_some();
        Outcome { truth, ..Outcome::failed(self.id, self.name.clone(), why) }
    }
}

/// A source of a pair's imprints: one for all values, or one for each where the dial is the shift.
struct Side {
    source: ImprintSource,
    felt: Vec<Result<Felt, String>>,
}

/// The predictions of a pair, or why there are none.
type Made = Result<PerPad<Prediction>, TaskError>;

/// Turns a dial over the pairs of `setup`. Predictions are taken from `models`, where they are kept too. Stops early when
/// told to, with the pairs that were done.
///
/// # Errors
/// If the values make no sense for what is in force, a model cannot be used, no pair has a pose that a dial could move,
/// or it was told to stop before the first was done.
pub fn sweep(dataset: &Dataset, setup: &SweepSetup, models: &Models, cx: &JobCx) -> Result<Sweep, TaskError> {
    sweep_part(dataset, setup, models, cx)?.moving()
}

/// Turns a dial over a part of the pairs, as [`sweep`] does over all: in a part there may be none that it could move.
///
/// # Errors
/// As [`sweep`], but for that.
pub fn sweep_part(dataset: &Dataset, setup: &SweepSetup, models: &Models, cx: &JobCx) -> Result<Sweep, TaskError> {
    let start = Instant::now();
    let job = SweepRun::new(dataset, setup, models, cx)?;
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
                let tool = tool.or_insert_with(|| load_tool(dataset, &pair.tool).map(|loaded| Arc::new(loaded.model)));
                let why =
                    |err: &TaskError| Remark { name: pair.name.clone(), why: format!("{}: {}", err.what, err.why) };
                let tool = tool.as_ref().map_err(why)?.clone();
                Ok((pair, tool))
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
            .map(|((pair, tool), sides)| {
                sides.into_iter().map(|side| (side.source, job.outcomes(pair, tool, &side))).collect()
            })
            .collect();
        if cx.cancel.is_cancelled() {
            break;
        }
        for ((pair, _), found) in pairs.iter().zip(found) {
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
    }
    let hand = rows.values().flatten().filter(|row| row.iter().any(|outcome| outcome.hand)).count();
    let line = |p: &Problem| format!("{}: {} ({})", p.file.display(), p.what, p.hint);
    let mut notes: Vec<String> = dataset.problems.iter().map(line).collect();
    notes.extend(hand_note(job.dial, hand));
    if setup.recipe.generator.is_none() {
        notes.push(NO_GENERATOR.into());
    }
    let series = rows.into_iter().map(|(source, rows)| Series::new(source, rows, &setup.values, job.at)).collect();
    Ok(Sweep {
        dataset: dataset.title.clone(),
        dial: job.dial,
        unit: job.dial.unit(),
        at: job.at,
        in_force: setup.recipe.clone(),
        series,
        pairs: posed,
        left_out,
        notes,
        complete: done == total,
        seconds: start.elapsed().as_secs_f64(),
    })
}

impl<M> Sweep<M> {
    /// This sweep, if it has a pose that the dial could move.
    ///
    /// # Errors
    /// If there is none, with why the first pair has none.
    pub fn moving(self) -> Result<Self, TaskError> {
        if !self.series.is_empty() {
            return Ok(self);
        }
        let why = self.left_out.first().map_or("there are no pairs".to_owned(), |first| {
            format!("no pair has a pose that the dial could move; the first: {}: {}", first.name, first.why)
        });
        Err(TaskError::new(WHAT, why))
    }
}

/// Settings of a sweep that are the same for all pairs.
struct SweepRun<'a> {
    dataset: &'a Dataset,
    setup: &'a SweepSetup,
    models: &'a Models,
    cx: &'a JobCx,
    labels: Option<Labels>,
    dial: Dial,
    /// Setting of the dial without turning it.
    at: Option<Setting>,
    /// The recipe without the dial, then with each value.
    turns: Vec<Recipe>,
    /// True where one of them asks the mask model.
    sees: bool,
}

impl<'a> SweepRun<'a> {
    fn new(dataset: &'a Dataset, setup: &'a SweepSetup, models: &'a Models, cx: &'a JobCx) -> Result<Self, TaskError> {
        let fail = |why: String| TaskError::new(WHAT, why);
        let dial = setup.values.first().ok_or_else(|| fail("there are no values to turn it to".into()))?.dial();
        if setup.values.iter().any(|value| value.dial() != dial) {
            return Err(fail("the values are of more than one dial".into()));
        }
        if setup.values.len() > MOST_VALUES {
            return Err(fail(format!("{} values are too many: at most {MOST_VALUES}", setup.values.len())));
        }
        let model = setup.recipe.mask_model.as_ref();
        if dial == Dial::Probability && model.is_none() {
            return Err(fail("no mask model was found, whose probability could be dialed".into()));
        }
        if dial == Dial::Shift && setup.recipe.generator.is_none() {
            return Err(fail("a shift is of predictions, and there is no generator".into()));
        }
        let mut turns = vec![setup.recipe.clone()];
        for value in &setup.values {
            turns.push(value.put(&setup.recipe).map_err(fail)?);
        }
        let made_by = turns.iter().map(Recipe::mask_recipe).collect::<Result<Vec<_>, _>>()?;
        let own = match (dial, model) {
            (Dial::Probability, Some(model)) => Some(models.least_probability(model)?),
            _ => None,
        };
        let at = dial.of(&setup.recipe, &made_by[0], own);
        let sees = made_by.iter().any(|made_by| matches!(made_by, MaskRecipe::Unet(..)));
        let labels = setup.recipe.hand.then(|| Labels::of(dataset));
        Ok(Self { dataset, setup, models, cx, labels, dial, at, turns, sees })
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
        Ok(Pair { id, name: entry.name.clone(), tool, sample, labels: labels.unwrap_or_default() })
    }

    fn touch<'t>(&'t self, pair: &'t Pair, tool: &'t ToolModel) -> Touch<'t> {
        Touch { dataset: self.dataset, pair: pair.id, sample: &pair.sample, tool: Ok(tool), labels: &pair.labels }
    }

    /// The imprints of each pair. `None` once it was told to stop.
    ///
    /// # Errors
    /// If the generator cannot be used at all.
    fn sides(&self, pairs: &[(Pair, Arc<ToolModel>)]) -> Result<Option<Vec<Vec<Side>>>, TaskError> {
        let mut predictions = self.predictions(pairs)?;
        let mut all = Vec::new();
        for (at, (pair, tool)) in pairs.iter().enumerate() {
            if self.cx.cancel.is_cancelled() {
                return Ok(None);
            }
            let mut sides = Vec::new();
            // A shift is of predictions alone.
            if self.dial != Dial::Shift && !measured(&pair.sample).is_empty() {
                let source = ImprintSource::Measured;
                let felt = self.imprints(pair, tool, Felt::new(&self.turns[0].of(source)));
                sides.push(Side { source, felt: vec![felt] });
            }
            if let Some(made) = predictions.get_mut(at).and_then(Option::take) {
                let source = ImprintSource::Predicted;
                let turns = if self.dial == Dial::Shift { &self.turns[..] } else { &self.turns[..1] };
                let felt = |turn: &Recipe| {
                    let made = made.clone().map_err(|err| err.why)?;
                    self.imprints(pair, tool, Felt::of_predictions(&turn.of(source), made))
                };
                sides.push(Side { source, felt: turns.iter().map(felt).collect() });
            }
            all.push(sides);
        }
        Ok(Some(all))
    }

    /// The imprints, with the mask model's word on them if any value asks for it.
    fn imprints(&self, pair: &Pair, tool: &ToolModel, felt: Felt) -> Result<Felt, String> {
        let touch = self.touch(pair, tool);
        let felt = felt.reach(touch, Stage::Imprint, self.models, &self.cx.quiet());
        let mut felt = felt.map_err(|err| format!("{}: {}", err.what, err.why))?;
        if self.sees {
            felt.see(touch, self.models);
        }
        Ok(felt)
    }

    /// The predictions of each pair, or why there are none; `None` where there is nothing to start from.
    fn predictions(&self, pairs: &[(Pair, Arc<ToolModel>)]) -> Result<Vec<Option<Made>>, TaskError> {
        if self.setup.recipe.generator.is_none() {
            return Ok(Vec::new());
        }
        let samples: Vec<&Sample> = pairs.iter().map(|(pair, _)| &pair.sample).collect();
        let made = self.setup.recipe.generating()?.pairs(self.models, &samples, &self.cx.quiet())?;
        let one = |made: Predicted| {
            let mut pads = PerPad::default();
            for (at, made) in made.into_iter().enumerate() {
                pads[PadId::new(at)] = made.transpose()?;
            }
            Ok(pads)
        };
        let made = made.unwrap_or_default().into_iter();
        Ok(made.map(|made| (!made.is_empty()).then(|| one(made))).collect())
    }

    /// The pose of a pair without the dial, and with each value.
    fn outcomes(&self, pair: &Pair, tool: &ToolModel, side: &Side) -> Vec<Outcome> {
        let bug =
            |message: String| format!("an internal error, which is a bug: {message}; please report it with this pair");
        let (touch, mut all) = (self.touch(pair, tool), Vec::<Outcome>::with_capacity(self.turns.len()));
        // What a value does not move is made once.
        let mut before: Option<Felt> = None;
        for (at, turn) in self.turns.iter().enumerate() {
            if let Some(same) = self.turns[..at].iter().position(|earlier| earlier == turn) {
                all.push(all[same].clone());
                continue;
            }
            let outcome = || -> Result<Felt, String> {
                let imprints = side.felt.get(at).or(side.felt.first()).ok_or("there is no imprint")?;
                let imprints = imprints.as_ref().map_err(Clone::clone)?;
                let turn = turn.of(side.source);
                let known = before.as_ref().map(|before| before.again(&turn));
                let felt = known.filter(|known| known.has(Stage::Mask)).unwrap_or_else(|| imprints.again(&turn));
                let felt = felt.reach_asking(touch, Stage::Pose, Ask::default(), self.models, &self.cx.quiet());
                felt.map_err(|err| err.why)
            };
            let felt = caught(outcome).unwrap_or_else(|message| Err(bug(message)));
            all.push(felt.as_ref().map_or_else(|why| pair.failed(why.clone()), |felt| pair.outcome(felt)));
            before = felt.ok().or(before);
        }
        let base = all[0].angle_rad;
        all.iter_mut().for_each(|outcome| outcome.set_change(base));
        all
    }
}
