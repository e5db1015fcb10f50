//! Layers of a registration: reasons, residuals and distances.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImprintSource, LayersKey};
use super::super::results;
use super::super::results::{Computes, Demands};
use super::super::services::SharedServices;
use super::super::state::{Lookup, State};
use touch2touch_core::grid::Mask;
use touch2touch_core::rig::PerPad;
use touch2touch_pipeline::steps::layers::LayerResult;

impl Computes for LayersKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<LayerResult>> {
        let clouds = state.results.clouds.get(&self.0.cloud)?.clone();
        let run = state.results.runs.get(&self.run())?.clone();
        let masks: PerPad<Arc<Mask>> = self.0.cloud.parts.as_ref().map(|part| {
            let (imprint, version) = part?;
            results::mask_pixels(state, version.as_ref()?, imprint)
        });
        Some(Job::new(Lane::Compute, "Layers of the registration", move |_| {
            touch2touch_pipeline::steps::layers::layers(
                &clouds,
                &masks.as_ref().map(|mask| mask.map(|mask| &**mask)),
                &run,
            )
        }))
    }
}

/// The layers of an imprint.
pub fn layers(state: &State, source: ImprintSource) -> Lookup<'_, LayerResult> {
    let key = results::pose_key(state, source).map(|key| key.map(LayersKey));
    let run = key.clone().ok().flatten().and_then(|key| state.failure(key.run()));
    state.look_or(key, || None).or_failed(run).value()
}

/// The layers of an imprint, or the recorded registration that they need.
pub(crate) fn want_layers(wants: &mut Demands<'_>, source: ImprintSource) {
    let state = wants.state;
    let Some(run) = results::run_key(state, source).filter(|_| results::shows_layers(state, source)) else { return };
    let key = LayersKey(run.pose.clone());
    match state.results.runs.contains(&run) || state.results.layers.contains(&key) {
        true => wants.ask(key),
        false => wants.ask(run),
    }
}
