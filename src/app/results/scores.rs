//! The scores that are kept of the open data set.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImprintSource, ScoresKey};
use super::super::pane::Demand;
use super::super::recipe;
use super::super::results::{Computes, Demands};
use super::super::scores::ScoreTable;
use super::super::services::SharedServices;
use super::super::state::State;
use touch2touch_pipeline::scores::evaluate::{self, Setup};
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind};
use touch2touch_pipeline::steps::recipe::Recipe;

impl Computes for ScoresKey {
    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<ScoreTable>> {
        let (services, setup) = (services.clone(), setup_of_all(state)?);
        let source = state.library.open.as_ref()?.source.clone();
        Some(Job::new(Lane::Compute, "Look for scores", move |_| {
            let dataset = source.on_disk("Look for scores")?;
            let scores = evaluate::known(dataset, &setup, services.models())?;
            Ok(ScoreTable::new(source.index(), scores))
        }))
    }

    fn arrived(&self, state: &mut State, table: &Arc<ScoreTable>) {
        if scores_key(state).as_ref() == Some(self) {
            state.table.scores = table.clone();
            state.reorder();
        }
    }
}

/// The setup by which all pairs of the open data set are scored: that of the results table, without leaving grasps out.
pub(crate) fn setup_of_all(state: &State) -> Option<Setup> {
    Some(Setup { grasps_per_tool: None, ..evaluation_setup(state)? })
}

/// The recipe of the scores in force.
pub(crate) fn scores_key(state: &State) -> Option<ScoresKey> {
    key_of(state, &setup_of_all(state)?)
}

/// The recipe of what a setup scores.
pub(super) fn key_of(state: &State, setup: &Setup) -> Option<ScoresKey> {
    let open = state.library.open.as_ref().filter(|open| open.source.as_dataset().is_some())?;
    Some(ScoresKey {
        dataset: open.seq,
        pairs: open.index().pairs.len(),
        setup: serde_json::to_string(setup).ok()?,
        round: state.table.round,
    })
}

/// The scores that lists and pictures of all pairs show.
pub(crate) fn want_scores(wants: &mut Demands<'_>) {
    if wants.state.needs(Demand::Scores)
        && let Some(key) = scores_key(wants.state)
    {
        wants.ask(key);
    }
}

/// The generators for the sensors of the data, and whether each gets a row.
pub fn evaluated(state: &State) -> impl Iterator<Item = (&BundleInfo, bool)> {
    let rig = state.rig();
    state
        .library
        .bundles
        .iter()
        .filter(move |b| b.kind == BundleKind::Generator && b.fits(&rig))
        .map(|b| (b, !state.table.left_out.contains(&b.id)))
}

/// The setup of an evaluation started now; `None` without data or with nothing to score.
pub(crate) fn evaluation_setup(state: &State) -> Option<Setup> {
    state.library.open.as_ref()?;
    let bundles: Vec<_> = evaluated(state).filter(|(_, chosen)| *chosen).map(|(b, _)| b.origin.clone()).collect();
    (!bundles.is_empty()).then(|| Setup {
        bundles,
        classifier: recipe::bundle(state, BundleKind::Classifier).ok().map(|b| b.origin.clone()),
        recipe: Recipe { generator: None, ..recipe::in_force(state, ImprintSource::Measured) },
        grasps_per_tool: state.table.grasps_per_tool,
        ..Setup::default()
    })
}
