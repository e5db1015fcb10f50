//! Poses of clouds: of both fingers, and of each alone.

use std::sync::Arc;

use super::super::keys::RegistrationChoice;
use super::super::workbench::state::PoseOf;
use super::cloud::CloudKey;
use super::imprint::Imprint;
use super::tool::ToolKey;
use super::{Absent, Computed, Computes, ImprintSource, Job, Lane, Lookup, SharedServices, State, Wanted};
use touch2touch_core::align::{Ask, Contacts};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::PerPad;
use touch2touch_core::sample::Sample;
use touch2touch_work::cloud::{Clouds, images};
use touch2touch_work::error::TaskError;
use touch2touch_work::pose::{PoseResult, pose};
use touch2touch_work::tool::NamedTool;

/// A pose of a cloud.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PoseKey {
    /// The cloud whose contact points are registered.
    pub cloud: CloudKey,
    /// The tool.
    pub tool: Arc<str>,
    /// The registration.
    pub engine: RegistrationChoice,
}

/// What is registered: the inputs of every job about a pose.
pub(crate) struct Registered {
    pub(crate) clouds: Arc<Clouds>,
    pub(crate) tool: Arc<NamedTool>,
    /// The true pose, `grasp_from_object`, where it is known.
    pub(crate) truth: Option<PlanarPose>,
    sample: Arc<Sample>,
    /// Of the fingers that have a mask.
    imprints: PerPad<Imprint>,
}

impl Registered {
    /// Registers it.
    ///
    /// # Errors
    /// As [`pose`].
    pub(crate) fn pose(&self, engine: RegistrationChoice, ask: Ask<'_>) -> Result<PoseResult, TaskError> {
        let points = self.clouds.contact_points();
        let imprints = self.imprints.as_ref().map(|imprint| imprint?.get().ok());
        let images = images(&self.sample, &imprints);
        let contacts = Contacts { points: &points, images: &images };
        pose(contacts, &self.tool.model, &*engine.method(), ask, self.truth)
    }
}

impl PoseKey {
    /// The job that registers it.
    fn registering(&self, state: &State, ask: Ask<'static>) -> Option<Job<PoseResult>> {
        let (registered, engine) = (self.find(state)?, self.engine);
        Some(Job::new(Lane::Compute, "Pose", move |_| registered.pose(engine, ask)))
    }

    /// What is registered; `None` if it is not there.
    pub(crate) fn find(&self, state: &State) -> Option<Registered> {
        let (pair, _) = self.cloud.place()?;
        let tool = ToolKey { dataset: pair.dataset, name: self.tool.clone() };
        let felt = self.cloud.parts.entries().filter(|(_, (_, mask))| mask.is_some());
        let mut imprints = PerPad::default();
        for (finger, (imprint, _)) in felt {
            imprints[finger] = Some(imprint.find(state)?);
        }
        let sample = state.results.samples.get(&pair)?.clone();
        Some(Registered {
            clouds: state.results.clouds.get(&self.cloud)?.clone(),
            tool: state.results.tools.get(&tool)?.clone(),
            truth: sample.grasp_from_object,
            sample,
            imprints,
        })
    }
}

impl Computes for PoseKey {
    type Value = PoseResult;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<PoseResult>> {
        self.registering(state, Ask::default())
    }

    fn bytes(found: &PoseResult) -> usize {
        found.bytes()
    }

    fn arrived(&self, state: &mut State, _: &Arc<PoseResult>) {
        if let Some(at) = self.cloud.place().filter(|(_, side)| state.pose_key(*side) == Ok(Some(self.clone()))) {
            state.results.latest.entry(at).or_default().pose = Some(self.clone());
        }
    }
}

/// A pose without its proof, where the registration may ask for one: it is there at once, and the pose itself unless it
/// needs one.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ProvisionalPoseKey(pub PoseKey);

impl Computes for ProvisionalPoseKey {
    type Value = PoseResult;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<PoseResult>> {
        self.0.registering(state, Ask { provisional: true, ..Ask::default() })
    }

    fn bytes(found: &PoseResult) -> usize {
        found.bytes()
    }

    fn arrived(&self, state: &mut State, found: &Arc<PoseResult>) {
        if found.report.needs_no_proof() {
            Computed::Pose(self.0.clone(), found.clone()).keep(state);
        }
    }
}

impl State {
    /// The recipe of the pose of an imprint; `Ok(None)` while something it is made from is not there yet.
    ///
    /// # Errors
    /// Why there can be none.
    pub fn pose_key(&self, source: ImprintSource) -> Result<Option<PoseKey>, Absent> {
        let tool = self.tool_name();
        let Some(cloud) = self.cloud_key(source)? else {
            return Ok(None);
        };
        if cloud.parts.iter().flatten().all(|(_, mask)| mask.is_none()) {
            return Err(self.rig().pads().find_map(|f| self.mask_recipe(f).err()).unwrap_or(Absent::NoContact));
        }
        Ok(Some(PoseKey { cloud, tool: tool?.into(), engine: self.settings.pose_engine }))
    }

    /// The pose of an imprint.
    pub fn pose(&self, source: ImprintSource) -> Lookup<'_, PoseResult> {
        if let failed @ Lookup::Failed(_) = self.tool() {
            return failed.without();
        }
        let before = || {
            let latest = || self.results.poses.get(self.latest(source)?.pose.as_ref()?);
            self.provisional_pose(source).or_else(latest)
        };
        self.look_or(self.pose_key(source), before).value()
    }

    /// The pose of an imprint without its proof, while that is being made.
    pub fn provisional_pose(&self, source: ImprintSource) -> Option<&Arc<PoseResult>> {
        let key = self.pose_key(source).ok()??;
        if self.results.poses.contains(&key) {
            return None;
        }
        self.results.provisional_poses.get(&ProvisionalPoseKey(key))
    }

    /// The recipe of the pose from one finger or both; `Ok(None)` while something is not there yet.
    ///
    /// # Errors
    /// Why there can be none.
    pub(crate) fn pose_key_of(&self, source: ImprintSource, of: PoseOf) -> Result<Option<PoseKey>, Absent> {
        let Some(mut key) = self.pose_key(source)? else { return Ok(None) };
        if let PoseOf::Finger(finger) = of {
            let part = key.cloud.parts[finger].take();
            if part.as_ref().is_none_or(|(_, mask)| mask.is_none()) {
                return Err(Absent::NoFinger);
            }
            key.cloud.parts = PerPad::default();
            key.cloud.parts[finger] = part;
        }
        Ok(Some(key))
    }

    /// The pose from one finger or both.
    pub fn pose_of(&self, source: ImprintSource, of: PoseOf) -> Lookup<'_, PoseResult> {
        let key = self.pose_key_of(source, of);
        let cloud = key.clone().ok().flatten().and_then(|key| self.failure(key.cloud));
        self.look_or(key, || None).or_failed(cloud).value()
    }
}

impl Wanted<'_> {
    /// The pose; where it may take a proof, one without first.
    pub(crate) fn pose(&mut self, source: ImprintSource) {
        let Ok(Some(key)) = self.state.pose_key(source) else { return };
        let results = &self.state.results;
        let provisional = ProvisionalPoseKey(key.clone());
        let tried =
            results.provisional_poses.contains(&provisional) || self.state.failure(provisional.clone()).is_some();
        if key.engine.by.may_prove() && !tried && !results.poses.contains(&key) {
            self.ask(provisional);
        } else {
            self.ask(key);
        }
    }

    /// The poses of single fingers in the table, and the clouds that they are made of: the joint one is asked for anyway.
    pub(crate) fn pose_table(&mut self, source: ImprintSource) {
        let state = self.state;
        for finger in state.rig().pads() {
            match state.pose_key_of(source, PoseOf::Finger(finger)) {
                Ok(Some(key)) if state.results.clouds.contains(&key.cloud) => self.ask(key),
                Ok(Some(key)) => self.ask(key.cloud),
                _ => {}
            }
        }
    }
}
