//! Several seeds of one touch: which, what is there of them, and what is missing.

use super::super::demand::Demands;
use super::super::keys::{CloudKey, ImprintKey, MaskKey, MetersKey, PoseKey, PredictionKey, Request};
use super::super::pane::Demand;
use super::super::results::prediction::SeedKey;
use super::{Absent, State};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::PadId;
use touch2touch_work::pose::PoseResult;

pub use touch2touch_work::subject::SEEDS as COUNT;

/// What a person chose about seeds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// How many.
    pub count: usize,
    /// Whether they are made for every pair that is shown with their pane.
    pub every: bool,
    /// What they were asked for: the recipe of the first of them. Another pair or another setting asks anew.
    pub asked: Option<PredictionKey>,
}

impl Default for Seeds {
    fn default() -> Self {
        Self { count: 8, every: false, asked: None }
    }
}

impl State {
    /// The recipes of the ensemble of one finger: those of the settings, with the seeds from theirs on.
    ///
    /// # Errors
    /// Why nothing can be generated.
    pub fn seed_recipes(&self, finger: PadId) -> Result<Vec<PredictionKey>, Absent> {
        self.can_generate()?;
        let touch = self.touch_key(finger).ok_or(Absent::NothingSelected)?;
        if self.sample().ready().is_some() && !self.can_start(finger) {
            return Err(Absent::NoInput);
        }
        let first = self.recipe(touch).ok_or(Absent::NoGenerator)?;
        if self.is_color(&first) {
            return Err(Absent::PredictsColor);
        }
        Ok(first.with_seeds(self.seeds.count))
    }

    /// The recipe that a run of seeds belongs to: that of the first finger, of the pair on screen.
    pub(in crate::app) fn seeds_of(&self) -> Option<PredictionKey> {
        self.rig().pads().find_map(|pad| self.recipe(self.touch_key(pad)?))
    }

    /// Whether the seeds that are missing are made, while their pane is on screen.
    pub(in crate::app) fn seeds_asked(&self) -> bool {
        self.seeds.every || (self.seeds.asked.is_some() && self.seeds.asked == self.seeds_of())
    }

    /// Whether seeds are being made for what is on screen: they were asked for, and some are missing.
    pub fn seeds_running(&self) -> bool {
        let missing = |finger: &PadId| {
            let made = |recipe: &PredictionKey| self.results.predictions.contains(recipe);
            self.seed_recipes(*finger).is_ok_and(|recipes| !recipes.iter().all(made))
        };
        self.seeds_asked() && self.seed_fingers().iter().any(missing)
    }

    /// The imprint of one seed in meters, if it is there.
    pub fn seed_imprint(&self, recipe: &PredictionKey) -> Option<&DepthMap> {
        self.results.imprints.get(&MetersKey(recipe.clone(), self.settings.shift)).map(|imprint| &**imprint)
    }

    /// The fingers whose seeds make a pose: both, or only the active one, as in generating.
    pub(crate) fn seed_fingers(&self) -> Vec<PadId> {
        match self.settings.generate.both_fingers {
            true => self.rig().pads().filter(|f| self.seed_recipes(*f).is_ok()).collect(),
            false => vec![self.selection.finger],
        }
    }

    /// The cloud of one seed with the automatic masks; `Err` holds what is missing for it.
    fn seed_cloud(&self, at: usize) -> Result<CloudKey, Vec<MaskKey>> {
        let imprint = |finger| {
            let recipe = self.seed_recipes(finger).ok()?.get(at)?.clone();
            Some(ImprintKey::Predicted(recipe, self.settings.shift))
        };
        self.automatic_cloud(self.seed_fingers().into_iter().filter_map(|finger| Some((finger, imprint(finger)?))))
    }

    fn seed_pose_key(&self, at: usize) -> Option<PoseKey> {
        let tool = self.tool_name().ok()?.into();
        Some(PoseKey { cloud: self.seed_cloud(at).ok()?, tool, registration: self.settings.registration })
    }

    /// The pose of each seed, where it is there.
    pub fn seed_poses(&self) -> Vec<Option<&PoseResult>> {
        let pose = |at| self.results.poses.get(&self.seed_pose_key(at)?).map(|pose| &**pose);
        (0..self.seeds.count).map(pose).collect()
    }

    /// Why the seeds have no poses, if they cannot have any.
    pub(crate) fn seed_pose_absent(&self) -> Option<Absent> {
        if let Err(absent) = self.tool_name() {
            return Some(absent);
        }
        let sample = self.sample().ready()?;
        let camera = |f: &PadId| sample.pad(*f).is_some_and(|t| t.camera().is_some());
        (!self.seed_fingers().iter().any(camera)).then_some(Absent::NoCamera)
    }

    /// Seeds that are still to come.
    pub(crate) fn seeds_to_come(&self) -> usize {
        self.tasks.demanded.iter().filter(|r| matches!(r, Request::Seed(_))).count()
    }
}

impl Demands<'_> {
    /// What the pane of the seeds shows and is not there, most urgent first.
    pub(in crate::app) fn seeds(&mut self) {
        let state = self.state;
        if !state.needs(Demand::Seeds) || state.sample().ready().is_none() {
            return;
        }
        let posed = state.seed_pose_absent().is_none();
        if posed {
            self.tool();
        }
        let mut fingers = state.seed_fingers();
        if !fingers.contains(&state.selection.finger) {
            fingers.push(state.selection.finger);
        }
        let mut fresh = Vec::new();
        for at in 0..state.seeds.count {
            for finger in &fingers {
                let Ok(recipes) = state.seed_recipes(*finger) else { continue };
                let Some(recipe) = recipes.get(at) else { continue };
                if state.results.predictions.contains(recipe) {
                    self.ask(MetersKey(recipe.clone(), state.settings.shift));
                } else if state.seeds_asked() {
                    fresh.push(SeedKey(recipe.clone()));
                }
            }
            match state.seed_cloud(at) {
                _ if !posed => {}
                Err(missing) => missing.into_iter().for_each(|mask| self.ask(mask)),
                Ok(cloud) if !state.results.clouds.contains(&cloud) => self.ask(cloud),
                Ok(_) => state.seed_pose_key(at).into_iter().for_each(|pose| self.ask(pose)),
            }
        }
        if let Some(key) = state.ensemble_key(state.selection.finger) {
            self.ask(key);
        }
        // What is there is evaluated before the next is made.
        for key in fresh {
            self.ask_unless(false, key);
        }
    }
}
