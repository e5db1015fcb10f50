//! Any two imprints of a touch against each other: what each side is, their figures, clouds and poses.

use std::borrow::Cow;
use std::sync::Arc;

use super::super::keys::ShiftMode;
use super::super::pane::Demand;
use super::super::settings::state::versus::{Versus, VersusMode};
use super::cloud::CloudKey;
use super::imprint::{EnsembleKey, Imprint, ImprintKey, MetersKey};
use super::mask::MaskKey;
use super::picture::PictureKey;
use super::pose::PoseKey;
use super::prediction::{PredictionKey, SeedKey};
use super::{Absent, Computes, Demands, ImprintSource, Job, Lane, Lookup, SharedServices, State, TouchKey};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;
use touch2touch_work::bundles::BundleKind;
use touch2touch_work::cloud::Clouds;
use touch2touch_work::compare::{Comparison, Depicted, between, tile_of};
use touch2touch_work::deviation::{CloudDifference, cloud_difference};
use touch2touch_work::error::TaskError;
use touch2touch_work::pose::PoseResult;
use touch2touch_work::prediction::Prediction;
use touch2touch_work::recipe::Recipe;
use touch2touch_work::subject::{MadeFrom, RecipeChange, Subject};

/// A prediction that is compared with something.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ComparedKey(pub PredictionKey);

impl Computes for ComparedKey {
    type Value = Prediction;

    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<Prediction>> {
        self.0.job(state, services)
    }

    /// It does not push away what is looked at, as little as a seed among several.
    fn arrived(&self, state: &mut State, made: &Arc<Prediction>) {
        SeedKey(self.0.clone()).arrived(state, made);
    }
}

/// One imprint against another of the same touch.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct VersusKey {
    /// One: the error map is its imprint minus the other's.
    pub a: ImprintKey,
    /// The other.
    pub b: ImprintKey,
}

impl VersusKey {
    /// A prediction against the measurement of its touch.
    pub fn measured(recipe: PredictionKey, shift: ShiftMode) -> Self {
        Self { b: ImprintKey::Measured(recipe.touch), a: ImprintKey::Predicted(recipe, shift) }
    }
}

/// An imprint with what is known of its picture, as an input of a job.
struct Part {
    imprint: Imprint,
    drawn: Option<(Arc<Prediction>, ShiftMode)>,
}

impl Part {
    fn of(key: &ImprintKey, state: &State) -> Option<Self> {
        let drawn = match key {
            ImprintKey::Predicted(recipe, shift) => Some((state.results.predictions.get(recipe)?.clone(), *shift)),
            _ => None,
        };
        Some(Self { imprint: key.find(state)?, drawn })
    }

    fn depicted<'a>(
        &'a self,
        sample: &Sample,
        pad: PadId,
        tile: Option<&'a DepthMap>,
    ) -> Result<Depicted<'a>, TaskError> {
        let imprint = self.imprint.get()?;
        let own = match &self.imprint {
            Imprint::Measured(..) => tile,
            Imprint::Picture(found) => Some(&found.tile),
            Imprint::Predicted(_) | Imprint::Mean(_) => {
                let drawn = self.drawn.as_ref().map(|(prediction, shift)| (&**prediction, *shift));
                return Depicted::predicted(imprint, drawn, sample, pad, tile);
            }
        };
        Ok(Depicted { imprint, tile: own.map(Cow::Borrowed) })
    }
}

impl Computes for VersusKey {
    type Value = Comparison;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Comparison>> {
        let touch = self.a.touch();
        let parts = [Part::of(&self.a, state)?, Part::of(&self.b, state)?];
        let sample = state.results.samples.get(&touch.pair)?.clone();
        let source = state.library.open.as_ref()?.source.clone();
        let what = match self.b {
            ImprintKey::Measured(_) => "Compare prediction and measurement",
            _ => "Compare A and B",
        };
        Some(Job::new(Lane::Compute, what, move |_| {
            let tile = match source.as_dataset() {
                Some(dataset) => tile_of(dataset, touch.pair.pair, &sample)?,
                None => None,
            };
            let [a, b] = parts.each_ref().map(|part| part.depicted(&sample, touch.finger, tile.as_ref()));
            between(&a?, &b?, &sample, touch.finger)
        }))
    }

    fn bytes(found: &Comparison) -> usize {
        found.error.len() * 4
    }
}

/// How far the points of one cloud lie from another.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CloudDifferenceKey {
    /// The cloud whose points are measured.
    pub a: CloudKey,
    /// The other.
    pub b: CloudKey,
}

impl Computes for CloudDifferenceKey {
    type Value = CloudDifference;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<CloudDifference>> {
        let cloud = |key: &CloudKey| state.results.clouds.get(key).cloned();
        let (a, b) = (cloud(&self.a)?, cloud(&self.b)?);
        let mut imprints: PerPad<[Imprint; 2]> = PerPad::default();
        for (pad, (imprint, _)) in self.a.parts.entries() {
            if let Some((other, _)) = &self.b.parts[pad] {
                imprints[pad] = Some([imprint.find(state)?, other.find(state)?]);
            }
        }
        Some(Job::new(Lane::Compute, "Distances between clouds", move |_| {
            let imprints = imprints.as_ref().map(|both| {
                let [a, b] = both?;
                Some([a.get().ok()?, b.get().ok()?])
            });
            Ok(cloud_difference(&a, &b, &imprints))
        }))
    }

    fn bytes(found: &CloudDifference) -> usize {
        found.bytes()
    }
}

impl State {
    /// What is compared with what in the workspace in front.
    pub fn versus(&self) -> Versus {
        self.settings.versus.get(&self.settings.workspace).cloned().unwrap_or_default()
    }

    /// What a subject is made from by the settings.
    ///
    /// # Errors
    /// Why it cannot be made.
    fn made_from(&self, subject: &Subject) -> Result<MadeFrom, Absent> {
        subject.made_from(|named| {
            let Some(name) = named else {
                self.bundle(BundleKind::Generator)?;
                return Ok(self.in_force(ImprintSource::Predicted));
            };
            let found = self.library.bundle_named(BundleKind::Generator, Some(name), &self.rig());
            let bundle = found.filter(|bundle| bundle.name == name).ok_or(Absent::NoSuchGenerator)?;
            let generator = Some((bundle.clone().into(), self.settings.generate.config(bundle)));
            Ok(Recipe { generator, ..self.in_force(ImprintSource::Predicted) })
        })
    }

    /// The keys of the predictions that a subject of a touch is made of, and how they become meters; none of what is not made.
    fn made_for(&self, subject: &Subject, touch: TouchKey) -> Result<(Vec<PredictionKey>, ShiftMode), Absent> {
        let recipes = match self.made_from(subject)? {
            MadeFrom::Measurement | MadeFrom::Picture => Vec::new(),
            MadeFrom::Prediction(recipe) => vec![recipe],
            MadeFrom::Mean(recipes) => recipes,
        };
        let shift = recipes.first().map_or(self.settings.shift, |recipe| recipe.shift);
        let keys: Vec<PredictionKey> = recipes.iter().filter_map(|recipe| PredictionKey::of(touch, recipe)).collect();
        if keys.first().is_some_and(|key| self.is_color(key)) {
            return Err(Absent::PredictsColor);
        }
        Ok((keys, shift))
    }

    /// The imprint that a subject is of a finger.
    ///
    /// # Errors
    /// Why there is none.
    pub fn subject_key(&self, subject: &Subject, finger: PadId) -> Result<ImprintKey, Absent> {
        let touch = self.touch_key(finger).ok_or(Absent::NothingSelected)?;
        match subject {
            Subject::Measured => self.imprint_key(ImprintSource::Measured, finger),
            // The one that the other panes show, made by whatever settings.
            Subject::Predicted(wish) if *wish == RecipeChange::default() => {
                self.imprint_key(ImprintSource::Predicted, finger)
            }
            Subject::Predicted(_) => {
                let (mut recipes, shift) = self.made_for(subject, touch)?;
                let recipe = recipes.pop().ok_or(Absent::NoSuchGenerator)?;
                Ok(ImprintKey::Predicted(recipe, shift))
            }
            Subject::Mean(..) => {
                let (recipes, shift) = self.made_for(subject, touch)?;
                Ok(ImprintKey::Mean(EnsembleKey { touch, recipes, shift }))
            }
            Subject::Stored => Ok(ImprintKey::Picture(touch)),
        }
    }

    /// The imprint that a subject is of a finger, meters, raw bubble orientation.
    pub fn subject(&self, subject: &Subject, finger: PadId) -> Lookup<'_, DepthMap> {
        let key = match self.subject_key(subject, finger) {
            Ok(key) => key,
            Err(absent) => return Lookup::Absent(absent),
        };
        let unmade = match (&key, self.touch_key(finger)) {
            (ImprintKey::Predicted(..) | ImprintKey::Mean(_), Some(touch)) => {
                if self.sample().ready().is_some() && !self.can_start(finger) {
                    return Lookup::Absent(Absent::NoInput);
                }
                let made = self.made_for(subject, touch).map(|(recipes, _)| recipes).unwrap_or_default();
                made.into_iter().find_map(|recipe| self.failure(ComparedKey(recipe)))
            }
            _ => None,
        };
        self.imprint_of(key).or_failed(unmade)
    }

    /// One subject against another of a finger.
    pub fn subjects_compared(&self, a: &Subject, b: &Subject, finger: PadId) -> Lookup<'_, Comparison> {
        match (self.subject_key(a, finger), self.subject_key(b, finger)) {
            (Ok(a), Ok(b)) => self.look(VersusKey { a, b }).value(),
            (Err(absent), _) | (_, Err(absent)) => Lookup::Absent(absent),
        }
    }

    /// The cloud of a subject, the contact by the masks in force on the two sides that are always shown, else by
    /// automatic ones; `Err` holds the masks that are missing for it.
    fn subject_cloud(&self, subject: &Subject) -> Result<CloudKey, Vec<MaskKey>> {
        match side_of(subject) {
            Some(side) => self.cloud_key(side).ok().flatten().ok_or_else(Vec::new),
            None => {
                let fingers =
                    self.rig().pads().filter_map(|finger| Some((finger, self.subject_key(subject, finger).ok()?)));
                self.automatic_cloud(fingers)
            }
        }
    }

    /// The surface points of a subject, where they are there, with their recipe.
    pub(crate) fn subject_points(&self, subject: &Subject) -> Option<(CloudKey, &Arc<Clouds>)> {
        let key = self.subject_cloud(subject).ok()?;
        let found = self.results.clouds.get(&key)?;
        Some((key, found))
    }

    fn subject_pose_key(&self, subject: &Subject) -> Option<PoseKey> {
        if let Some(side) = side_of(subject) {
            return self.pose_key(side).ok()?;
        }
        let cloud = self.subject_cloud(subject).ok()?;
        Some(PoseKey { cloud, tool: self.tool_name().ok()?.into(), engine: self.settings.pose_engine })
    }

    /// The pose of a subject, where it is there.
    pub fn subject_pose(&self, subject: &Subject) -> Option<&PoseResult> {
        self.results.poses.get(&self.subject_pose_key(subject)?).map(|pose| &**pose)
    }

    /// How far the points of one subject lie from those of another, where that is there, with its recipe.
    pub fn subjects_apart(&self, a: &Subject, b: &Subject) -> Option<(CloudDifferenceKey, &CloudDifference)> {
        let key = CloudDifferenceKey { a: self.subject_cloud(a).ok()?, b: self.subject_cloud(b).ok()? };
        let found = self.results.apart.get(&key)?;
        Some((key, found))
    }
}

/// The side that shows a subject already.
fn side_of(subject: &Subject) -> Option<ImprintSource> {
    match subject {
        Subject::Measured => Some(ImprintSource::Measured),
        Subject::Predicted(wish) if *wish == RecipeChange::default() => Some(ImprintSource::Predicted),
        _ => None,
    }
}

impl Demands<'_> {
    /// What the pane of the comparison shows and is not there.
    pub(in crate::app) fn versus(&mut self) {
        let state = self.state;
        if !state.needs(Demand::Versus) || state.sample().ready().is_none() {
            return;
        }
        let Versus { a, b, mode } = state.versus();
        let both = [a, b];
        let posed = state.seed_pose_absent().is_none();
        let shown = state.fingers();
        let needed: Vec<PadId> = state.rig().pads().filter(|finger| posed || shown.contains(finger)).collect();
        for subject in &both {
            for finger in &needed {
                self.subject(subject, *finger);
            }
        }
        for finger in shown {
            let with = |subject: &Subject| state.subject_key(subject, finger).ok().filter(|key| self.is_there(key));
            let [a, b] = [&both[0], &both[1]].map(with);
            let measured = with(&Subject::Measured);
            for (a, b) in [(&a, &b), (&a, &measured), (&b, &measured)] {
                if let (Some(a), Some(b)) = (a, b)
                    && (a != b || mode == VersusMode::Difference)
                {
                    self.ask(VersusKey { a: a.clone(), b: b.clone() });
                }
            }
        }
        // While the pen is down the cloud would be out of date before it is there.
        if !posed || state.document.stroke.is_some() {
            return;
        }
        for subject in &both {
            self.subject_place(subject);
        }
        let clouds = both.each_ref().map(|subject| state.subject_cloud(subject).ok());
        if let [Some(a), Some(b)] = clouds
            && mode == VersusMode::Apart
            && state.results.clouds.contains(&a)
            && state.results.clouds.contains(&b)
        {
            self.ask(CloudDifferenceKey { a, b });
        }
    }

    fn is_there(&self, key: &ImprintKey) -> bool {
        self.state.imprint_of(key.clone()).ready().is_some()
    }

    /// The imprint of a subject, and the predictions that it is made of.
    fn subject(&mut self, subject: &Subject, finger: PadId) {
        let state = self.state;
        let Some(touch) = state.touch_key(finger) else { return };
        match (side_of(subject), state.subject_key(subject, finger)) {
            (Some(ImprintSource::Measured), _) => {}
            (Some(ImprintSource::Predicted), _) => {
                self.stored(finger, touch);
                self.imprint(finger, touch);
                self.other_finger(finger);
            }
            (None, Ok(ImprintKey::Picture(touch))) => self.ask(PictureKey(touch)),
            (None, Ok(key)) if state.can_start(finger) => {
                let Ok((recipes, shift)) = state.made_for(subject, touch) else { return };
                let mut whole = true;
                for recipe in recipes {
                    if state.results.predictions.contains(&recipe) {
                        let meters = MetersKey(recipe, shift);
                        whole &= state.results.imprints.contains(&meters);
                        self.ask(meters);
                    } else {
                        whole = false;
                        self.ask_unless(state.tasks.generating(&recipe).is_some(), ComparedKey(recipe));
                    }
                }
                if let ImprintKey::Mean(key) = key
                    && whole
                {
                    self.ask(key);
                }
            }
            (None, _) => {}
        }
    }

    /// Masks, cloud and pose of a subject.
    fn subject_place(&mut self, subject: &Subject) {
        let state = self.state;
        if let Some(side) = side_of(subject) {
            for finger in state.rig().pads() {
                self.mask(side, finger);
            }
            if self.cloud(side) {
                self.pose(side);
            }
            return;
        }
        self.tool();
        match state.subject_cloud(subject) {
            Err(missing) => missing.into_iter().for_each(|mask| self.ask(mask)),
            Ok(cloud) if !state.results.clouds.contains(&cloud) => self.ask(cloud),
            Ok(_) if state.tool().ready().is_some() => {
                state.subject_pose_key(subject).into_iter().for_each(|pose| self.ask(pose));
            }
            Ok(_) => {}
        }
    }
}
