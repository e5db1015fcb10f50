//! Layers of a registration: reasons, residuals and distances.

use std::sync::Arc;

use super::pose::PoseKey;
use super::run::RunKey;
use super::{Computes, Demands, ImprintSource, Job, Lane, Lookup, SharedServices, State};
use touch2touch_core::grid::Mask;
use touch2touch_core::rig::PerPad;
use touch2touch_work::layers::{LayerResult, layers};

/// The layers of a recorded registration from the registration's own starts.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LayersKey(pub PoseKey);

impl LayersKey {
    fn run(&self) -> RunKey {
        RunKey { pose: self.0.clone(), start: None }
    }
}

impl Computes for LayersKey {
    type Value = LayerResult;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<LayerResult>> {
        let clouds = state.results.clouds.get(&self.0.cloud)?.clone();
        let run = state.results.runs.get(&self.run())?.clone();
        let masks: PerPad<Arc<Mask>> = self.0.cloud.parts.as_ref().map(|part| {
            let (imprint, version) = part?;
            version.as_ref()?.find(state, imprint)
        });
        Some(Job::new(Lane::Compute, "Layers of the registration", move |_| {
            layers(&clouds, &masks.as_ref().map(|mask| mask.map(|mask| &**mask)), &run)
        }))
    }

    fn bytes(found: &LayerResult) -> usize {
        found.bytes()
    }
}

impl State {
    /// What the layers show of an imprint.
    pub fn layers(&self, source: ImprintSource) -> Lookup<'_, LayerResult> {
        let key = self.pose_key(source).map(|key| key.map(LayersKey));
        let run = key.clone().ok().flatten().and_then(|key| self.failure(key.run()));
        self.look_or(key, || None).or_failed(run).value()
    }
}

impl Demands<'_> {
    /// The layers of an imprint, or the recorded registration that they need.
    pub(crate) fn layers(&mut self, source: ImprintSource) {
        let state = self.state;
        let Some(run) = state.run_key(source).filter(|_| state.shows_layers(source)) else { return };
        let key = LayersKey(run.pose.clone());
        match state.results.runs.contains(&run) || state.results.layers.contains(&key) {
            true => self.ask(key),
            false => self.ask(run),
        }
    }
}
