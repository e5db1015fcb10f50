//! The small pictures of the list.

use super::super::pane::Demand;
use super::{Computes, Demands, Job, Lane, PairKey, SharedServices, State};
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::DepthMap;
use touch2touch_work::imprint;

/// The small picture of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ThumbnailKey(pub PairKey);

impl Computes for ThumbnailKey {
    type Value = DepthMap;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<DepthMap>> {
        let (source, pair) = (state.library.open.as_ref()?.source.clone(), self.0.pair);
        let loaded = state.results.samples.get(&self.0).cloned();
        let what = format!("Picture of {}", state.library.entry(pair)?.name);
        Some(Job::new(Lane::Files, what, move |_| match loaded {
            Some(sample) => Ok(imprint::thumbnail(&sample)),
            None => Ok(imprint::thumbnail(&source.load(pair)?)),
        }))
    }

    fn bytes(picture: &DepthMap) -> usize {
        picture.len() * 4
    }
}

impl State {
    /// The small picture of a pair, if it was made.
    pub fn thumbnail(&self, pair: PairId) -> Option<&DepthMap> {
        let key = ThumbnailKey(self.library.open.as_ref()?.key(pair));
        self.results.thumbnails.get(&key).map(|a| &**a)
    }
}

impl Demands<'_> {
    /// The pictures of the rows on screen.
    pub(crate) fn thumbnails(&mut self) {
        let state = self.state;
        let Some(open) = state.library.open.as_ref().filter(|_| state.needs(Demand::Thumbnails)) else {
            return;
        };
        let end = state.library.rows.end.min(state.library.order.len());
        let start = state.library.rows.start.min(end);
        for pair in &state.library.order[start..end] {
            self.ask(ThumbnailKey(open.key(*pair)));
        }
    }
}
