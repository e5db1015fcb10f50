//! Poses of clouds.

use std::sync::Arc;

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImprintSource, PoseKey, ProvisionalPoseKey, ToolKey};
use super::super::results::{Computes, Demands};
use super::super::services::Services;
use super::super::state::results::Computed;
use super::super::state::{Absent, Lookup, State};
use super::super::{recipe, results};
use touch2touch_core::align::Ask;
use touch2touch_core::pose::Registration;
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::steps::estimate::Estimate;
use touch2touch_pipeline::steps::pose::PoseResult;
use touch2touch_pipeline::steps::tool::NamedTool;

/// The inputs of every job about a pose: what is registered.
pub(crate) struct Registered {
    pub(crate) estimate: Arc<Estimate>,
    pub(crate) tool: Arc<NamedTool>,
    pub(crate) sample: Arc<Sample>,
}

impl Registered {
    /// Registers it.
    ///
    /// # Errors
    /// As [`Estimate::pose_by`].
    pub(crate) fn pose(&self, by: Registration, ask: Ask<'_>) -> Result<PoseResult, TaskError> {
        self.estimate.pose_by(&self.sample, &self.tool.model, &*by.method(), ask)
    }
}

/// The job that registers a cloud.
fn registering(state: &State, key: &PoseKey, ask: Ask<'static>) -> Option<Job<PoseResult>> {
    let (registered, registration) = (registered(state, key)?, key.registration);
    Some(Job::new(Lane::Compute, "Pose", move |_| registered.pose(registration, ask)))
}

/// The inputs of a registration; `None` if they are not there.
pub(crate) fn registered(state: &State, key: &PoseKey) -> Option<Registered> {
    let (pair, _) = key.cloud.place()?;
    let tool = ToolKey { dataset: pair.dataset, name: key.tool.clone() };
    Some(Registered {
        estimate: state.results.clouds.get(&key.cloud)?.clone(),
        tool: state.results.tools.get(&tool)?.clone(),
        sample: state.results.samples.get(&pair)?.clone(),
    })
}

impl Computes for PoseKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<PoseResult>> {
        registering(state, self, Ask { evidence: true, ..Ask::default() })
    }

    fn arrived(&self, state: &mut State, _: &Arc<PoseResult>) {
        if let Some(at) = self.cloud.place().filter(|(_, side)| pose_key(state, *side) == Ok(Some(self.clone()))) {
            state.results.latest.entry(at).or_default().pose = Some(self.clone());
        }
    }
}

impl Computes for ProvisionalPoseKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<PoseResult>> {
        registering(state, &self.0, Ask { provisional: true, evidence: true, ..Ask::default() })
    }

    fn arrived(&self, state: &mut State, found: &Arc<PoseResult>) {
        if found.report.needs_no_proof() {
            super::keep(Computed::Pose(self.0.clone(), found.clone()), state);
        }
    }
}

/// The recipe of the pose of an imprint; `Ok(None)` while something it is made from is not there yet.
///
/// # Errors
/// Why there can be none.
pub fn pose_key(state: &State, source: ImprintSource) -> Result<Option<PoseKey>, Absent> {
    if unmasked(state, source).is_some() {
        return Err(Absent::NoContact);
    }
    let tool = results::tool_name(state);
    let Some(cloud) = results::cloud_key(state, source)? else {
        return Ok(None);
    };
    if cloud.parts.iter().flatten().all(|(_, mask)| mask.is_none()) {
        return Err(state.rig().pads().find_map(|f| results::mask_recipe(state, f).err()).unwrap_or(Absent::NoContact));
    }
    Ok(Some(PoseKey::of(cloud, tool?.into(), &recipe::in_force(state, source))))
}

/// Why a finger of an imprint has no mask, where none can be made: a pose of the others alone is not that of all.
fn unmasked(state: &State, source: ImprintSource) -> Option<&TaskError> {
    state.rig().pads().find_map(|finger| match results::mask_in_force(state, source, finger) {
        Err(Lookup::Failed(err)) => Some(err),
        _ => None,
    })
}

/// The pose of an imprint.
pub fn pose(state: &State, source: ImprintSource) -> Lookup<'_, PoseResult> {
    if let failed @ Lookup::Failed(_) = results::tool(state) {
        return failed.without();
    }
    if let Some(err) = unmasked(state, source) {
        return Lookup::Failed(err);
    }
    let before = || {
        let latest = || state.results.poses.get(results::latest(state, source)?.pose.as_ref()?);
        provisional_pose(state, source).or_else(latest)
    };
    state.look_or(pose_key(state, source), before).value()
}

/// The pose of an imprint without its proof, while that is being made.
pub fn provisional_pose(state: &State, source: ImprintSource) -> Option<&Arc<PoseResult>> {
    let key = pose_key(state, source).ok()??;
    if state.results.poses.contains(&key) {
        return None;
    }
    state.results.provisional_poses.get(&ProvisionalPoseKey(key))
}

/// The pose; where it may take a proof, one without first.
pub(crate) fn want_pose(wants: &mut Demands<'_>, source: ImprintSource) {
    let Ok(Some(key)) = pose_key(wants.state, source) else { return };
    let results = &wants.state.results;
    let provisional = ProvisionalPoseKey(key.clone());
    let tried = results.provisional_poses.contains(&provisional) || wants.state.failure(provisional.clone()).is_some();
    if key.registration.may_prove() && !tried && !results.poses.contains(&key) {
        wants.ask(provisional);
    } else {
        wants.ask(key);
    }
}
