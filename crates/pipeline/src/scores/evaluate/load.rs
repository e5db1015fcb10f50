//! Reading pairs while the ones before are scored.

use std::sync::mpsc::sync_channel;

use rayon::prelude::*;

use super::{Setup, Skipped, ToolWork};
use crate::io::dataset::{Dataset, SourceKind};
use crate::job::JobCx;
use crate::labels::{Labels, PairLabels};
use crate::pairs;
use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::Group;
use touch2touch_core::grid::Grid;
use touch2touch_core::sample::{Sample, Scale};

/// A loaded pair.
pub(super) struct LoadedPair {
    pub(super) id: PairId,
    pub(super) name: String,
    pub(super) group: Group,
    pub(super) sample: Sample,
    /// Labels that people gave the pair, where they are to be taken.
    pub(super) labels: Option<PairLabels>,
    /// The bubble picture as it is in its file, and the lab's prediction of it, where the source has pictures.
    pub(super) tile: Option<Grid<f32>>,
    pub(super) lab: Option<Grid<f32>>,
}

/// Some pairs of a tool that are scored together.
pub(super) struct LoadedPairs {
    pub(super) good: Vec<LoadedPair>,
    pub(super) bad: Vec<Skipped>,
}

/// The pairs of a tool, as they arrive.
pub(super) struct Batch<'a> {
    pub(super) work: &'a ToolWork,
    pub(super) cases: Box<dyn Iterator<Item = Result<LoadedPairs, Vec<Skipped>>> + 'a>,
}

/// Grasps to be scored, tool by tool.
pub(super) fn plan(dataset: &Dataset, setup: &Setup) -> Vec<ToolWork> {
    pairs::by_tool(dataset)
        .into_iter()
        .map(|(tool, mut ids)| {
            if let Some(only) = &setup.pairs {
                ids.retain(|id| only.contains(id));
            }
            let taken = pairs::spread(ids.len(), setup.grasps_per_tool);
            ToolWork { tool: tool.map(str::to_owned), ids: taken.map(|at| ids[at]).collect() }
        })
        .collect()
}

/// Calls `score` for each tool with its pairs; the next ones are read meanwhile, on all cores.
pub(super) fn ahead(dataset: &Dataset, setup: &Setup, work: &[ToolWork], cx: &JobCx, mut score: impl FnMut(Batch<'_>)) {
    // Both fingers of a grasp go through the generator together.
    let grasps = setup.batch.div_ceil(2).max(1);
    let labels = &setup.recipe.hand.then(|| Labels::of(dataset));
    std::thread::scope(|scope| {
        let (sender, receiver) = sync_channel(1);
        scope.spawn(move || {
            for ids in work.iter().flat_map(|tool| tool.ids.chunks(grasps)) {
                if cx.cancel.is_cancelled() {
                    return;
                }
                let loaded: Vec<Result<LoadedPair, Skipped>> =
                    ids.par_iter().map(|&id| load(dataset, labels, id)).collect();
                let mut cases = LoadedPairs { good: Vec::new(), bad: Vec::new() };
                for one in loaded {
                    match one {
                        Ok(case) => cases.good.push(case),
                        Err(bad) => cases.bad.push(bad),
                    }
                }
                // Nobody listens any more: the evaluation was stopped.
                if sender.send(cases).is_err() {
                    return;
                }
            }
        });
        for tool in work {
            let chunks = tool.ids.len().div_ceil(grasps);
            let lost = || {
                vec![Skipped {
                    what: tool.tool.clone().unwrap_or_default(),
                    method: String::new(),
                    why: "its pairs could not be read: the reading ended early".into(),
                }]
            };
            let cases = (0..chunks).map(|_| receiver.recv().map_err(|_| lost()));
            score(Batch { work: tool, cases: Box::new(cases) });
            if cx.cancel.is_cancelled() {
                break;
            }
        }
    });
}

/// Reads one pair, with what people said of it where their labels are to be taken.
fn load(dataset: &Dataset, labels: &Option<Labels>, id: PairId) -> Result<LoadedPair, Skipped> {
    let Some(entry) = dataset.index.get(id) else {
        return Err(Skipped { what: format!("pair {}", id.0), method: String::new(), why: "no such pair".into() });
    };
    let skip = |why: String| Skipped { what: entry.name.clone(), method: String::new(), why };
    let fail = |err: crate::io::error::FileError| skip(format!("{err} ({})", err.hint));
    let sample = dataset.load(id).map_err(fail)?;
    if sample.pads.iter().flatten().all(|t| t.color().is_none() || t.depth().is_none()) {
        return Err(skip("no finger has both a GelSlim image and a measured imprint".into()));
    }
    let labels = labels.as_ref().map(|labels| labels.load(&entry.name)).transpose();
    let labels = labels.map_err(|err| skip(err.to_string()))?;
    let pictures = sample.scale == Scale::Assumed;
    let (tile, lab, clipped) = if pictures {
        let clipped = dataset.gelslim_is_clipped(id).map_err(fail)?;
        let laid = sample.laid;
        (dataset.bubble_tile(id, laid).map_err(fail)?, dataset.vqvae_tile(id, laid).map_err(fail)?, clipped)
    } else {
        (None, None, None)
    };
    let group = Group::of(entry, dataset.kind == SourceKind::Demo, clipped);
    Ok(LoadedPair { id, name: entry.name.clone(), group, sample, labels, tile, lab })
}
