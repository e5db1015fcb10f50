//! The contents of what is taken away: figures and pairs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::super::keys::{ImprintSource, Registration};
use super::super::results;
use super::super::state::State;
use super::super::state::export::StillAsked;
use super::super::state::workbench::Layer;
use super::command::recipe_shown;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::pair_files::{PairParts, write};
use touch2touch_pipeline::steps::estimate::Estimate;
use touch2touch_pipeline::steps::prediction::predicted_by;
use touch2touch_pipeline::steps::tool::NamedTool;
use touch2touch_pipeline::still::StillSetup;

/// The export of the selected pair for other programs, gathered for a job.
#[derive(Clone, Debug)]
pub struct PairExport {
    name: String,
    source: ImprintSource,
    prediction: Option<String>,
    rig: Arc<Rig>,
    estimate: Arc<Estimate>,
    registration: Registration,
    /// True where it has a pose.
    posed: bool,
    truth: Option<PlanarPose>,
    tool: Option<Arc<NamedTool>>,
}

impl PairExport {
    /// Writes the files that there can be: without a pose only the cloud.
    ///
    /// # Errors
    /// As [`write()`].
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, TaskError> {
        let parts = PairParts {
            name: &self.name,
            source: self.source,
            prediction: self.prediction.as_deref(),
            rig: &self.rig,
            clouds: self.estimate.surface(),
            mask: &self.estimate.contact().made_of(),
            registration: self.registration,
            pose: if self.posed { self.estimate.pose().ok() } else { None },
            truth: self.truth,
            tool: self.tool.as_ref().map(|tool| (tool.name.as_str(), &tool.model)),
        };
        write(&parts, folder)
    }
}

/// A picture of the selected pair in 3D, by the recipe of what is shown, in the colors of distances where these are on.
pub(crate) fn still_setup(state: &State, asked: StillAsked) -> Option<StillSetup> {
    let reach = state.settings.scene.distance_m;
    Some(StillSetup {
        pair: state.selection.pair?,
        pane: asked.pane,
        recipe: recipe_shown(state, *asked.pane.sides().last()?),
        labels: state.document.pair(state.pair_name()).cloned().unwrap_or_default(),
        ground: asked.ground,
        angles: asked.angles,
        width_px: asked.width_px,
        turntable: asked.turntable,
        distance_m: (state.workbench.layer == Layer::Distance).then_some(reach.into()),
    })
}

/// The export of the selected pair; `None` while its cloud is not there.
pub fn pair_export(state: &State, source: ImprintSource) -> Option<PairExport> {
    let cloud = results::cloud_key(state, source).ok()??;
    let posed = results::pose_key(state, source).ok().flatten();
    let posed = posed.filter(|key| results::pose_of(state, key).is_some());
    let recipe =
        state.rig().pads().find_map(|pad| results::chosen(state, pad)).filter(|_| source == ImprintSource::Predicted);
    let prediction =
        recipe.map(|made| predicted_by(state.library.model_name(&made.bundle), &made.config, state.settings.shift));
    Some(PairExport {
        name: state.pair_name().to_owned(),
        source,
        prediction,
        rig: state.rig(),
        posed: posed.is_some(),
        estimate: state.results.estimates.get(&posed.unwrap_or(cloud))?.clone(),
        registration: state.settings.registration,
        truth: results::sample(state).ready()?.grasp_from_object,
        tool: results::tool_key(state).ok().and_then(|key| state.results.tools.get(&key)).cloned(),
    })
}

/// True where the selected pair can be drawn in 3D.
pub(crate) fn can_draw(state: &State) -> bool {
    state.entry().is_some()
}
