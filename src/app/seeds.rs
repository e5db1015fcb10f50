//! Several seeds of one touch: which, what is there of them, and what is missing.

use super::keys::{CloudKey, EnsembleKey, ImprintKey, MaskKey, MaskVersion, PoseKey, PredictionKey, Request};
use super::pane::Need;
use super::state::{Absent, Lookup, State};
use crate::domain::ensemble::seeds;
use crate::domain::grid::DepthMap;
use crate::domain::rig::{PadId, PerPad};
use crate::work::ensemble::Ensemble;
use crate::work::pose::PoseResult;

/// Fewest and most seeds of an ensemble.
pub const COUNT: std::ops::RangeInclusive<usize> = 2..=16;

/// What a person chose about seeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// How many.
    pub count: usize,
    /// Whether those that are missing are made, while their pane is on screen.
    pub running: bool,
}

impl Default for Seeds {
    fn default() -> Self {
        Self { count: 8, running: false }
    }
}

/// What can be done with seeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SeedsCommand {
    /// How many; limited to [`COUNT`].
    Count(usize),
    /// Makes those that are missing, or stops.
    Run(bool),
}

impl Seeds {
    pub(super) fn step(&mut self, command: SeedsCommand) {
        match command {
            SeedsCommand::Count(count) => self.count = count.clamp(*COUNT.start(), *COUNT.end()),
            SeedsCommand::Run(running) => self.running = running,
        }
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
        let recipe = |seed| PredictionKey { seed, ..first.clone() };
        Ok(seeds(first.seed, self.seeds.count).into_iter().map(recipe).collect())
    }

    /// The imprint of one seed in meters, if it is there.
    pub fn seed_imprint(&self, recipe: &PredictionKey) -> Option<&DepthMap> {
        self.results.imprints.get(&(recipe.clone(), self.settings.shift)).map(|imprint| &**imprint)
    }

    /// The ensemble of what is there of one finger; `None` before the first seed.
    fn ensemble_key(&self, finger: PadId) -> Option<EnsembleKey> {
        let there = |r: &PredictionKey| self.results.predictions.contains(r) && self.seed_imprint(r).is_some();
        let recipes: Vec<PredictionKey> = self.seed_recipes(finger).ok()?.into_iter().filter(there).collect();
        (!recipes.is_empty()).then_some(EnsembleKey { recipes, shift: self.settings.shift })
    }

    /// Mean and spreads of the seeds that are there; the ensemble before while the next is computed.
    pub fn ensemble(&self, finger: PadId) -> Lookup<'_, Ensemble> {
        let Some(key) = self.ensemble_key(finger) else { return Lookup::Absent(Absent::NoPrediction) };
        let before = || {
            let mut key = key.clone();
            while key.recipes.len() > 1 {
                key.recipes.pop();
                if let Some(found) = self.results.ensembles.get(&key) {
                    return Some(&**found);
                }
            }
            None
        };
        match self.results.ensembles.get(&key) {
            Some(ensemble) => Lookup::Ready(ensemble),
            None => self.missing_but(Some(Request::Ensemble(key.clone())), before()),
        }
    }

    /// The fingers whose seeds make a pose: both, or only the active one, as in generating.
    pub fn seed_fingers(&self) -> Vec<PadId> {
        match self.settings.generate.both_fingers {
            true => self.rig().pads().filter(|f| self.seed_recipes(*f).is_ok()).collect(),
            false => vec![self.selection.finger],
        }
    }

    /// The cloud of one seed with the automatic masks; `Err` holds what is missing for it.
    fn seed_cloud(&self, at: usize) -> Result<CloudKey, Vec<Request>> {
        let mut parts = PerPad::default();
        let mut missing = Vec::new();
        for finger in self.seed_fingers() {
            let camera = self.touch(finger).ready().is_some_and(|t| t.camera().is_some());
            let (Ok(recipes), Ok(mask), true) = (self.seed_recipes(finger), self.mask_recipe(finger), camera) else {
                continue;
            };
            let Some(recipe) = recipes.get(at) else { continue };
            if self.seed_imprint(recipe).is_none() {
                return Err(Vec::new());
            }
            let imprint = ImprintKey::Predicted(recipe.clone(), self.settings.shift);
            let key = MaskKey { imprint: imprint.clone(), recipe: mask.clone() };
            if !self.results.masks.contains(&key) {
                missing.push(Request::Mask(key));
            }
            parts[finger] = Some((imprint, Some(MaskVersion::Auto(mask))));
        }
        if missing.is_empty() && !parts.is_empty() { Ok(CloudKey { parts }) } else { Err(missing) }
    }

    fn seed_pose_key(&self, at: usize) -> Option<PoseKey> {
        let tool = self.tool_name().ok()?.into();
        Some(PoseKey { cloud: self.seed_cloud(at).ok()?, tool, engine: self.settings.pose_engine })
    }

    /// The pose of each seed, where it is there.
    pub fn seed_poses(&self) -> Vec<Option<&PoseResult>> {
        let pose = |at| self.results.poses.get(&self.seed_pose_key(at)?).map(|pose| &**pose);
        (0..self.seeds.count).map(pose).collect()
    }

    /// Why the seeds have no poses, if they cannot have any.
    pub fn seed_pose_absent(&self) -> Option<Absent> {
        if let Err(absent) = self.tool_name() {
            return Some(absent);
        }
        let sample = self.sample().ready()?;
        let camera = |f: &PadId| sample.pad(*f).is_some_and(|t| t.camera().is_some());
        (!self.seed_fingers().iter().any(camera)).then_some(Absent::NoCamera)
    }

    /// What the pane of the seeds shows and is not there, most urgent first.
    pub(super) fn wanted_seeds(&self) -> Vec<Request> {
        let mut list = Vec::new();
        if !self.needs(Need::Seeds) || self.sample().ready().is_none() {
            return list;
        }
        let posed = self.seed_pose_absent().is_none();
        if let (true, Ok(name), Some(open)) = (posed, self.tool_name(), &self.library.open)
            && !self.results.tools.contains(&name.to_owned())
        {
            list.push(Request::Tool(open.seq, name.into()));
        }
        let mut fingers = self.seed_fingers();
        if !fingers.contains(&self.selection.finger) {
            fingers.push(self.selection.finger);
        }
        let mut fresh = Vec::new();
        for at in 0..self.seeds.count {
            for finger in &fingers {
                let Ok(recipes) = self.seed_recipes(*finger) else { continue };
                let Some(recipe) = recipes.get(at) else { continue };
                if !self.results.predictions.contains(recipe) {
                    if self.seeds.running {
                        fresh.push(Request::Seed(recipe.clone()));
                    }
                } else if self.seed_imprint(recipe).is_none() {
                    list.push(Request::Imprint(recipe.clone(), self.settings.shift));
                }
            }
            match self.seed_cloud(at) {
                _ if !posed => {}
                Err(missing) => list.extend(missing),
                Ok(cloud) if !self.results.clouds.contains(&cloud) => list.push(Request::Cloud(cloud)),
                Ok(_) => {
                    let key = self.seed_pose_key(at).filter(|key| !self.results.poses.contains(key));
                    list.extend(key.map(Request::Pose));
                }
            }
        }
        if let Some(key) = self.ensemble_key(self.selection.finger)
            && !self.results.ensembles.contains(&key)
        {
            list.push(Request::Ensemble(key));
        }
        // What is there is evaluated before the next is made.
        list.extend(fresh);
        list
    }

    /// Seeds that are still to come.
    pub fn seeds_to_come(&self) -> usize {
        self.tasks.demanded.iter().filter(|r| matches!(r, Request::Seed(_))).count()
    }
}
