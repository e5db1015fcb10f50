//! Training a mask model on masks that people corrected, with the score that it earns on pairs it did not see:
//! [`plan`] says what it would learn from, [`train`] does it. The studio and `touch2touch masks train` both end here.

#[cfg(feature = "tune")]
mod gather;
mod trained;
#[cfg(feature = "tune")]
mod tune;
#[cfg(feature = "tune")]
mod write;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use strum::{EnumIter, EnumString, IntoStaticStr};

use crate::error::TaskError;
use crate::export::{DrawnMasks, LeftOut};
use crate::infer::engine::EngineChoice;
use crate::io::dataset::Dataset;
use crate::io::digest::sha256;
use crate::io::names;
use crate::job::JobCx;
use crate::labels::{ImprintOf, MaskPlace, Review};
#[cfg(feature = "tune")]
use crate::learn::mask_worth::{MaskWorth, mask_worth};
use crate::learn::tuning::Tuning;
#[cfg(feature = "tune")]
use crate::pairs::spread;
use crate::steps::bundles::BundleInfo;
use crate::steps::models::Models;
use touch2touch_core::dataset::{PairId, Split};
use touch2touch_core::pose::Registration;
use touch2touch_core::units::counted;

pub use crate::error::Remark;
pub use trained::{MaskScore, Trained};

/// Name of the task in errors.
const WHAT: &str = "Train the mask model";
/// Fewer masks leave much to chance.
pub(crate) const ENOUGH_MASKS: usize = 20;
/// Fewer than this of a tool are hardly that tool's shape.
const ENOUGH_OF_A_TOOL: usize = 3;
/// Most masks in memory; more are left out.
const MOST_MASKS: usize = 5000;
/// Pairs of tools that nobody named.
pub(crate) const NO_TOOL: &str = "no tool named";

/// Source of the masks that are learned from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, EnumIter, EnumString, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum MasksFrom {
    /// Masks that people drew or took over, of pairs marked *done*.
    #[default]
    Drawn,
    /// The CAD model at the true pose, for every pair that has both; what people drew of pairs marked *done* comes before it.
    Cad,
}

impl MasksFrom {
    /// The name on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Drawn => "corrected masks",
            Self::Cad => "CAD at the true pose",
        }
    }

    /// Description in a line.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Drawn => "Masks that people drew or took over, of pairs marked done",
            Self::Cad => {
                "What lies within a millimeter of the CAD model at the true pose, for every pair that has both; masks that \
                 people drew of pairs marked done come before it. No label is written"
            }
        }
    }
}

/// Division of the pairs into those that are learned from and those that are left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TrainChoice {
    /// Source of the masks.
    pub from: MasksFrom,
    /// Percent of the pairs that are left out of the training, for the score.
    pub held_out_percent: u8,
    /// Decides which those are, and the order and variation of the masks.
    pub seed: u64,
    /// True where pairs that the data set keeps for tests (`test_only`) are divided like the rest; else they are left
    /// out.
    pub test_in_train: bool,
}

impl Default for TrainChoice {
    fn default() -> Self {
        Self { from: MasksFrom::Drawn, held_out_percent: 20, seed: 0, test_in_train: false }
    }
}

/// Settings of a training: the model, the masks, and the time.
#[derive(Clone, Debug)]
pub struct TrainSetup {
    /// The mask model to begin from; it stays as it is.
    pub start: BundleInfo,
    /// Generators of whose predictions masks may be.
    pub generators: Vec<BundleInfo>,
    /// The engine that makes these predictions again.
    pub engine: EngineChoice,
    /// The registration that the worth is told by, where true poses are known.
    pub registration: Registration,
    /// The division.
    pub choice: TrainChoice,
    /// Length of the training.
    pub tuning: Tuning,
    /// Folder in which a run that is stopped is kept, to go on from there when the same is asked for again.
    pub unfinished: Option<PathBuf>,
    /// The folder of the new bundle, which must not hold anything.
    pub out: PathBuf,
}

/// A pair with the masks that are learned from.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(not(feature = "tune"), allow(dead_code, reason = "only training reads the masks"))]
struct Entry {
    id: PairId,
    name: String,
    tool: Option<String>,
    /// True where it is left out of the training.
    held_out: bool,
    /// True where its masks come from the CAD model.
    cad: bool,
    places: Vec<MaskPlace>,
}

/// Plan of a training that would start now.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrainPlan {
    /// Masks to learn from, by tool.
    pub tools: BTreeMap<String, usize>,
    /// Of them on predictions.
    pub predicted: usize,
    /// Pairs to learn from.
    pub pairs: usize,
    /// Masks and pairs that are left out for the score.
    pub held_out: [usize; 2],
    /// Of these pairs the ones that the data set keeps for tests.
    pub for_tests: usize,
    /// Pairs whose masks may come from a CAD model: their tool has one. Whether their true pose is known shows when they
    /// are read.
    pub by_cad: usize,
    /// Pairs that take no part.
    pub left_out: BTreeMap<LeftOut, usize>,
    /// Pairs whose labels cannot be read.
    pub unreadable: Vec<Remark>,
    entries: Vec<Entry>,
}

impl TrainPlan {
    /// Masks to learn from.
    pub fn masks(&self) -> usize {
        self.tools.values().sum()
    }

    /// Numbers that are learned from and that are not, a line each.
    pub fn lines(&self) -> Vec<String> {
        let predicted = match self.predicted {
            0 => String::new(),
            n => format!(", {n} of them on predictions"),
        };
        let mut lines = vec![format!(
            "to learn from: {} of {}{predicted}",
            counted(self.masks(), "mask"),
            counted(self.pairs, "pair")
        )];
        let tools: Vec<String> = self.tools.iter().map(|(tool, n)| format!("{tool} {n}")).collect();
        lines.extend((!tools.is_empty()).then(|| format!("by tool: {}", tools.join(", "))));
        let [masks, pairs] = self.held_out;
        let for_tests = match self.for_tests {
            0 => String::new(),
            n => format!(", {n} of them reserved for tests"),
        };
        lines.push(format!(
            "left out for the score: {} of {}{for_tests}",
            counted(masks, "mask"),
            counted(pairs, "pair")
        ));
        lines.extend(self.left_out.iter().map(|(why, n)| format!("not used: {} {}", counted(*n, "pair"), why.text())));
        lines.extend(self.unreadable.iter().map(|remark| format!("not used: {remark}")));
        lines
    }

    /// Warnings before it starts, in words.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let masks = self.masks();
        if masks > 0 && masks < ENOUGH_MASKS {
            warnings.push(format!(
                "{} are few: it takes {ENOUGH_MASKS} or more to improve on pairs the model did not see",
                counted(masks, "mask")
            ));
        }
        let few: Vec<&str> =
            self.tools.iter().filter(|(_, n)| **n < ENOUGH_OF_A_TOOL).map(|(tool, _)| tool.as_str()).collect();
        if masks >= ENOUGH_MASKS && !few.is_empty() {
            warnings.push(format!("fewer than {ENOUGH_OF_A_TOOL} masks of {}", few.join(", ")));
        }
        if masks > 0 && self.held_out[0] == 0 {
            warnings.push("nothing is left out, so there will be no score on other pairs".into());
        }
        if masks > MOST_MASKS {
            warnings.push(format!("only {MOST_MASKS} of the masks are used: more do not fit into memory"));
        }
        warnings
    }

    /// Why there is nothing to learn from, and what cures it; `None` where there is something.
    pub fn nothing(&self) -> Option<Nothing> {
        if self.masks() > 0 {
            return None;
        }
        let left_out = |why: LeftOut| self.left_out.get(&why).copied().unwrap_or(0);
        let pairs = |n: usize| counted(n, "pair");
        let (why, hint, cure) = if self.for_tests > 0 {
            let (all, is) = if self.for_tests == 1 { ("the only pair", "is") } else { ("all pairs", "are") };
            (
                format!(
                    "{all} with masks to train on {is} reserved for tests ({}, {})",
                    pairs(self.for_tests),
                    counted(self.held_out[0], "mask")
                ),
                "Tick \"train on pairs reserved for tests\" (--test-in-train); a share of them is still left out for the score.",
                Some(TrainCure::TestInTrain),
            )
        } else if left_out(LeftOut::NotDone) > 0 {
            let n = left_out(LeftOut::NotDone);
            (
                format!("masks of {} were corrected, and none of these is marked \"done\"", pairs(n)),
                "Mark those that are right as \"done\".",
                None,
            )
        } else if left_out(LeftOut::NotDrawn) > 0 {
            (
                format!("{} marked \"done\" have no mask of their own", pairs(left_out(LeftOut::NotDrawn))),
                "Mark them \"todo\" and \"done\" again: that accepts the automatic masks where they are right.",
                None,
            )
        } else {
            (
                "no mask was corrected or accepted".into(),
                "Look at pairs, correct what is wrong, and mark them \"done\".",
                None,
            )
        };
        let cure = cure.or((self.by_cad > 0).then_some(TrainCure::FromCad));
        let mut hint = hint.to_owned();
        if cure == Some(TrainCure::FromCad) {
            hint += &format!(
                " Or take masks from the CAD models at the true poses, where {} may have them.",
                pairs(self.by_cad)
            );
        }
        let others = self.left_out.iter().map(|(why, n)| format!("{} {}", pairs(*n), why.text())).collect();
        Some(Nothing { why, hint, cure, others })
    }

    /// That there is something to learn from.
    ///
    /// # Errors
    /// If there is not: what is there instead, and what to do.
    pub fn check(&self) -> Result<(), TaskError> {
        self.nothing().map_or(Ok(()), |nothing| {
            let why = [vec![nothing.why], nothing.others].concat().join("; ");
            Err(TaskError::new(WHAT, format!("there is no mask to learn from: {why}")).with_hint(nothing.hint))
        })
    }
}

/// A choice that gives a training something to learn from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrainCure {
    /// Pairs that the data set keeps for tests are divided like the rest.
    TestInTrain,
    /// Masks come from the CAD models at the true poses.
    FromCad,
}

impl TrainCure {
    /// The choice with it.
    #[must_use]
    pub fn applied(self, choice: TrainChoice) -> TrainChoice {
        match self {
            Self::TestInTrain => TrainChoice { test_in_train: true, ..choice },
            Self::FromCad => TrainChoice { from: MasksFrom::Cad, ..choice },
        }
    }

    /// The words on its button.
    pub fn name(self) -> &'static str {
        match self {
            Self::TestInTrain => "Train on pairs reserved for tests",
            Self::FromCad => "Take masks from CAD",
        }
    }
}

/// Absence of anything to learn from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Nothing {
    /// Reason, in words.
    pub why: String,
    /// The advice.
    pub hint: String,
    /// The choice that cures it.
    pub cure: Option<TrainCure>,
    /// Pairs that take no part, by reason.
    pub others: Vec<String>,
}

/// Plan of a training: the masks drawn by hand, on measured imprints and on predictions, of pairs marked *done*; or those
/// that CAD models make. Reads the labels of these pairs, no data.
///
/// Pairs that the data set keeps for tests are left out for the score, unless the choice says otherwise. Of the others
/// so many are as the choice says, by the pair's name and the seed, at least one where there are two.
///
/// # Errors
/// If there is no place for labels.
pub fn plan(dataset: &Dataset, masks: &DrawnMasks<'_>, choice: TrainChoice) -> Result<TrainPlan, TaskError> {
    masks.labels.folder()?;
    let (reviews, drawn) = (masks.reviews(), masks.all(&dataset.rig));
    let modeled: BTreeSet<String> = dataset.index.tools().into_iter().filter(|tool| has_model(dataset, tool)).collect();
    let mut plan = TrainPlan::default();
    for (at, entry) in dataset.index.pairs.iter().enumerate() {
        let is_drawn = || dataset.rig.pads().any(|pad| drawn.contains(&(entry.name.clone(), pad)));
        let review = reviews.get(&entry.name).copied().unwrap_or_default();
        let modeled = entry.tool.as_ref().is_some_and(|tool| modeled.contains(tool));
        plan.by_cad += usize::from(modeled && !matches!(review, Review::Skip | Review::Flagged));
        let cad = choice.from == MasksFrom::Cad && !(review == Review::Done && is_drawn());
        let why = match review {
            Review::Skip => Some(LeftOut::Skip),
            Review::Flagged => Some(LeftOut::Flagged),
            _ if cad => (!modeled).then_some(LeftOut::NoCad),
            Review::Done => None,
            Review::Todo | Review::InProgress if is_drawn() => Some(LeftOut::NotDone),
            Review::Todo | Review::InProgress => continue,
        };
        if let Some(why) = why {
            *plan.left_out.entry(why).or_default() += 1;
            continue;
        }
        let places: Vec<MaskPlace> = if cad {
            dataset.rig.pads().map(MaskPlace::measured).collect()
        } else {
            match masks.of_pair(&entry.name) {
                Ok(labels) => labels.masks.keys().cloned().collect(),
                Err(err) => {
                    plan.unreadable.push(Remark { name: entry.name.clone(), why: err.why });
                    continue;
                }
            }
        };
        if places.is_empty() {
            *plan.left_out.entry(LeftOut::NotDrawn).or_default() += 1;
            continue;
        }
        plan.entries.push(Entry {
            id: PairId(at as u32),
            name: entry.name.clone(),
            tool: entry.tool.clone(),
            held_out: entry.split == Split::Test && !choice.test_in_train,
            cad,
            places,
        });
    }
    plan.for_tests = plan.entries.iter().filter(|entry| entry.held_out).count();
    divide(&mut plan.entries, choice);
    for entry in &plan.entries {
        if entry.held_out {
            plan.held_out[0] += entry.places.len();
            plan.held_out[1] += 1;
            continue;
        }
        plan.pairs += 1;
        plan.predicted += entry.places.iter().filter(|place| place.of != ImprintOf::Measured).count();
        let tool = entry.tool.clone().unwrap_or_else(|| NO_TOOL.into());
        *plan.tools.entry(tool).or_default() += entry.places.len();
    }
    Ok(plan)
}

/// True where there is a CAD model of a tool, readable or not.
fn has_model(dataset: &Dataset, tool: &str) -> bool {
    dataset.tool_mesh_file(tool).is_some() || (dataset.root.is_none() && matches!(dataset.tool_mesh(tool), Ok(Some(_))))
}

/// Leaves pairs out: whole grasps, so that no finger of one tells of the other.
fn divide(entries: &mut [Entry], choice: TrainChoice) {
    let mut order: Vec<(String, usize)> = entries
        .iter()
        .enumerate()
        .filter(|(_, entry)| !entry.held_out)
        .map(|(at, entry)| (sha256(format!("{} {}", choice.seed, entry.name).as_bytes()), at))
        .collect();
    order.sort();
    let share = f64::from(choice.held_out_percent.min(100)) / 100.0;
    let most = order.len().saturating_sub(1);
    // Where the data set keeps pairs for tests there is a score without leaving out a single one more.
    let least = usize::from(share > 0.0 && order.len() == entries.len());
    let count = ((share * order.len() as f64).round() as usize).max(least).min(most);
    order.iter().take(count).for_each(|(_, at)| entries[*at].held_out = true);
}

/// The first folder in `models` for a model trained on a data set that is not there yet.
pub fn new_folder(models: &Path, dataset: &Dataset) -> PathBuf {
    let name = format!("masks-of-{}", names::label(&dataset.title));
    let numbered = (2..).map(|n| models.join(format!("{name}-{n}")));
    let mut all = std::iter::once(models.join(&name)).chain(numbered);
    all.find(|folder| !folder.exists()).unwrap_or_else(|| models.join(name))
}

/// Trains, scores before and after on what was left out, and writes the new bundle.
///
/// # Errors
/// If the job was told to stop (a run is then kept, and there is no bundle), there is nothing to learn from, the mask
/// model cannot be trained, or the new bundle cannot be written: its folder must not hold anything.
#[cfg(feature = "tune")]
pub fn train(
    dataset: &Dataset,
    masks: &DrawnMasks<'_>,
    setup: &TrainSetup,
    models: &Models,
    cx: &JobCx,
) -> Result<Trained, TaskError> {
    let begin = std::time::Instant::now();
    write::check_folder(&setup.out, &setup.start)?;
    let plan = plan(dataset, masks, setup.choice)?;
    plan.check()?;
    if setup.choice.from == MasksFrom::Cad {
        crate::doubts::check_truth(dataset, WHAT)?;
    }
    let gathered = gather::gather(dataset, masks, &plan, setup, models, cx)?;
    let mut trained = tune::tune(dataset, &plan, gathered, setup, begin, cx)?;
    trained.poses = poses(dataset, setup, &trained, models, cx)?;
    trained.seconds = begin.elapsed().as_secs_f64();
    Ok(trained)
}

/// Most grasps that are posed for the score: enough for a mean, and a matter of seconds.
#[cfg(feature = "tune")]
const MOST_POSED: usize = 60;

/// The worth of the model before and after, by the poses of grasps that were left out. None where none is known, or whoever
/// waits has waited enough: the bundle is there.
#[cfg(feature = "tune")]
fn poses(
    dataset: &Dataset,
    setup: &TrainSetup,
    trained: &Trained,
    models: &Models,
    cx: &JobCx,
) -> Result<Option<[MaskWorth; 2]>, TaskError> {
    let held: BTreeSet<PairId> = trained.held_out.iter().map(|one| one.id).collect();
    let held: Vec<PairId> = held.into_iter().collect();
    let pairs = spread(held.len(), Some(MOST_POSED)).map(|at| held[at]).collect();
    let after = crate::steps::bundles::open(WHAT, trained.bundle.as_path())?;
    let worth =
        |model: &BundleInfo| match mask_worth(dataset, &pairs, (model, setup.engine, setup.registration), models, cx) {
            Err(err) if err.is_cancelled() => Ok(None),
            worth => worth,
        };
    Ok(match worth(&setup.start)? {
        Some(before) => worth(&after)?.map(|after| [before, after]),
        None => None,
    })
}

/// Without tuning nothing is trained.
///
/// # Errors
/// Always.
#[cfg(not(feature = "tune"))]
pub fn train(_: &Dataset, _: &DrawnMasks<'_>, _: &TrainSetup, _: &Models, _: &JobCx) -> Result<Trained, TaskError> {
    Err(TaskError::new(WHAT, "this program was built without tuning").with_hint("Build it with the feature \"tune\"."))
}

#[cfg(test)]
mod tests;
