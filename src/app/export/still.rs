//! A picture of the selected pair in 3D, and its preview while it is asked about.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::StillKey;
use super::super::results::{self, Computes, Demands};
use super::super::services::Services;
use super::super::state::State;
use super::super::state::export::StillAsked;
use super::super::state::workbench::Layer;
use super::command;
use crate::spatial;
use touch2touch_core::grid::Grid;
use touch2touch_pipeline::still::{StillSetup, picture};

/// Width and height of the preview, pixels.
const PREVIEW_PX: u32 = 384;

/// A picture of the selected pair in 3D, by the recipe of what is shown, in the colors of distances where these are on.
pub(crate) fn still_setup(state: &State, asked: StillAsked) -> Option<StillSetup> {
    let reach = state.settings.scene.distance_m;
    Some(StillSetup {
        pair: state.selection.pair?,
        pane: asked.pane,
        recipe: command::recipe_shown(state, *asked.pane.sides().last()?),
        labels: state.document.pair(state.pair_name()).cloned().unwrap_or_default(),
        ground: asked.ground,
        angles: asked.angles,
        width_px: asked.width_px,
        turntable: asked.turntable,
        distance_m: (state.workbench.layer == Layer::Distance).then_some(reach.into()),
    })
}

impl Computes for StillKey {
    fn job(&self, state: &State, services: &Arc<Services>) -> Option<Job<Grid<[u8; 4]>>> {
        let (asked, _) = state.export.still?;
        let setup = still_setup(state, StillAsked { width_px: PREVIEW_PX, turntable: None, ..asked })?;
        let (source, services) = (state.library.open.as_ref()?.source.clone(), services.clone());
        Some(Job::new(Worker::Models, "Preview of the 3D picture", move |cx| {
            picture(&source.dataset, &setup, &services.models, spatial::still, cx)
        }))
    }

    fn wanted(wants: &mut Demands<'_>) {
        if let Some(key) = still_key(wants.state) {
            wants.ask(key);
        }
    }
}

/// The key of the preview; `None` while no 3D picture is asked about, or there is nothing to draw yet.
pub(crate) fn still_key(state: &State) -> Option<StillKey> {
    let (asked, number) = state.export.still?;
    let side = *asked.pane.sides().last()?;
    let posed = results::pose_key(state, side).ok().flatten();
    Some(StillKey(posed.or_else(|| results::cloud_key(state, side).ok().flatten())?, number))
}
