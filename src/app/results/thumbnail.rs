//! The small pictures of the list.

use super::super::jobs::{Job, Lane};
use super::super::keys::ThumbnailKey;
use super::super::pane::Demand;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::State;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::DepthMap;
use touch2touch_pipeline::steps::imprint;

impl Computes for ThumbnailKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<DepthMap>> {
        let (source, pair) = (state.library.open.as_ref()?.source.clone(), self.0.pair);
        let loaded = state.results.samples.get(&self.0).cloned();
        let what = format!("Picture of {}", state.library.entry(pair)?.name);
        Some(Job::new(Lane::Files, what, move |_| match loaded {
            Some(sample) => Ok(imprint::thumbnail(&sample)),
            None => Ok(imprint::thumbnail(&source.load(pair)?)),
        }))
    }
}

/// The small picture of a pair, if it was made.
pub fn thumbnail(state: &State, pair: PairId) -> Option<&DepthMap> {
    let key = ThumbnailKey(state.library.open.as_ref()?.key(pair));
    state.results.thumbnails.get(&key).map(|a| &**a)
}

/// The pictures of the rows on screen.
pub(crate) fn want_thumbnails(wants: &mut Demands<'_>) {
    let state = wants.state;
    let Some(open) = state.library.open.as_ref().filter(|_| state.needs(Demand::Thumbnails)) else {
        return;
    };
    let end = state.library.rows.end.min(state.library.order.len());
    let start = state.library.rows.start.min(end);
    for pair in &state.library.order[start..end] {
        wants.ask(ThumbnailKey(open.key(*pair)));
    }
}
