//! [`propose_all`]: proposals accepted for many pairs at once.

use std::collections::BTreeMap;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::{ProposalSource, ProposeSetup, WHAT, accepted, propose};
use crate::error::{Remark, TaskError};
use crate::io::caught::caught;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::{Labels, MaskPlace, Operation};
use crate::steps::estimate::{Touch, estimate};
use crate::steps::models::Models;
use crate::steps::recipe::Stage;
use crate::steps::tool::load_tool;
use touch2touch_core::dataset::PairId;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::PadId;
use touch2touch_core::units::counted;

/// Proposals for which pairs, and what becomes of them.
#[derive(Clone, Debug, PartialEq)]
pub struct BatchSetup {
    /// Source of the proposals, with its numbers.
    pub propose: ProposeSetup,
    /// The pairs. Those marked "done", "flagged" or "skip" are left as they are: somebody has judged them.
    pub pairs: Vec<PairId>,
    /// True where masks painted by hand are replaced as well.
    pub over_drawn: bool,
    /// Who asked; else whom the system says.
    pub person: Option<String>,
}

/// Outcome of proposals for many pairs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Batch {
    /// Source of the proposals.
    pub source: ProposalSource,
    /// Pairs that have new masks, by name.
    pub changed: Vec<String>,
    /// New masks.
    pub masks: usize,
    /// Masks that were so already.
    pub same: usize,
    /// Pairs that somebody judged, which were left as they are.
    pub judged: usize,
    /// Masks that could not be proposed, and why; by pair and finger.
    pub left_out: Vec<Remark>,
    /// True where all pairs asked for were looked at; false if stopped early.
    pub complete: bool,
    /// Time it took, seconds.
    pub seconds: f64,
}

impl Batch {
    /// Summary in words.
    pub fn text(&self) -> String {
        let mut text = format!("{} proposed in {}", counted(self.masks, "mask"), counted(self.changed.len(), "pair"));
        for (count, what) in [(self.same, "were so already"), (self.left_out.len(), "could not be proposed")] {
            if count > 0 {
                text += &format!("; {count} {what}");
            }
        }
        if self.judged > 0 {
            text += &format!("; {} judged before stay as they are", counted(self.judged, "pair"));
        }
        if !self.complete {
            text += "; stopped early";
        }
        text
    }
}

/// Proposes masks for the pairs of `setup` and stores them: as if each had been accepted by hand, but that review states
/// stay, so that every one of them is still to be looked at. What a person painted stays unless `over_drawn`. Each pair's
/// change is a line of its journal, which undo takes back. Stops early when told to.
///
/// # Errors
/// If there are no pairs, labels cannot be stored, or it was told to stop before the first.
pub fn propose_all(dataset: &Dataset, setup: &BatchSetup, models: &Models, cx: &JobCx) -> Result<Batch, TaskError> {
    let start = Instant::now();
    if setup.pairs.is_empty() {
        return Err(TaskError::new(WHAT, "there are no pairs to propose masks for"));
    }
    let labels = Labels::of(dataset);
    labels.folder()?;
    if setup.propose.source == ProposalSource::CadTruth {
        crate::doubts::check_truth(dataset, WHAT)?;
    }
    let (mut tools, total) = (BTreeMap::new(), setup.pairs.len());
    let mut batch = Batch { source: setup.propose.source, complete: true, ..Batch::default() };
    for (done, &pair) in setup.pairs.iter().enumerate() {
        if cx.cancel.is_cancelled() {
            batch.complete = false;
            break;
        }
        let Some(entry) = dataset.index.get(pair) else { continue };
        cx.progress(done as u64, total as u64, &entry.name);
        let tool = entry.tool.as_ref().map(|name| {
            let tool = tools.entry(name.clone()).or_insert_with(|| load_tool(dataset, name).map(|loaded| loaded.model));
            tool.as_ref()
        });
        let no_tool = TaskError::new(WHAT, "no tool is named, so there is no CAD model");
        let tool = tool.unwrap_or(Err(&no_tool));
        let job = ProposalBatch { dataset, all: &labels, setup, models, cx };
        let one = caught(|| job.one(pair, &entry.name, tool, &mut batch));
        match one.unwrap_or_else(|message| Err(TaskError::panicked(WHAT, &message))) {
            Ok(()) => {}
            Err(err) if err.is_cancelled() => {
                batch.complete = false;
                break;
            }
            Err(err) => batch.left_out.push(Remark { name: entry.name.clone(), why: err.why }),
        }
    }
    if !batch.complete && batch.masks == 0 {
        cx.check(WHAT)?;
    }
    batch.seconds = start.elapsed().as_secs_f64();
    Ok(batch)
}

/// Settings of a batch that are the same for all pairs.
#[derive(Clone, Copy)]
struct ProposalBatch<'a> {
    dataset: &'a Dataset,
    all: &'a Labels,
    setup: &'a BatchSetup,
    models: &'a Models,
    cx: &'a JobCx,
}

impl ProposalBatch<'_> {
    fn one(
        self,
        pair: PairId,
        name: &str,
        tool: Result<&ToolModel, &TaskError>,
        batch: &mut Batch,
    ) -> Result<(), TaskError> {
        let Self { dataset, all, setup, models, cx } = self;
        let mut stored = all.load(name)?;
        if stored.review.is_judged() {
            batch.judged += 1;
            return Ok(());
        }
        let sample = dataset.load(pair).map_err(|err| TaskError::from_error(WHAT, &err))?;
        let (recipe, drawn_before) = (&setup.propose.recipe, stored.clone());
        let touch = Touch { dataset, pair, sample: &sample, tool, labels: &drawn_before };
        let estimate = estimate(touch, recipe, Stage::Imprint, models, &cx.quiet())?;
        let (imprints, of) = (&estimate.imprints, recipe.imprint_of());
        let pads: Vec<PadId> = imprints.entries().map(|(pad, _)| pad).collect();
        if pads.is_empty() {
            return Err(TaskError::new(WHAT, "there is no such imprint"));
        }
        let proposals = propose(touch, &estimate, &pads, &setup.propose, models)?;
        let (mut new, mut how) = (0, Vec::new());
        for (pad, proposal) in proposals {
            let proposal = match proposal {
                Ok(proposal) => proposal,
                Err(err) => {
                    let why = format!("{} finger: {}", dataset.rig.pad_key(pad), err.why);
                    batch.left_out.push(Remark { name: name.to_owned(), why });
                    continue;
                }
            };
            let place = MaskPlace { pad, of: of.clone() };
            let drawn = imprints[pad].as_ref().and_then(|imprint| stored.drawn(&place, imprint));
            let hand = accepted(drawn, &proposal, setup.over_drawn);
            if drawn.is_some_and(|drawn| drawn.is_same(&hand)) {
                batch.same += 1;
                continue;
            }
            stored.put(&place, Some(hand));
            how.push(proposal.provenance);
            new += 1;
        }
        if new > 0 {
            let how = serde_json::to_value(how).ok();
            all.save(
                name,
                &stored,
                &Operation { person: setup.person.clone(), how, ..Operation::named("proposal for many pairs") },
            )?;
            batch.masks += new;
            batch.changed.push(name.to_owned());
        }
        Ok(())
    }
}
