//! Views ask for what they show: the recipes behind the selection, what is there of it, and what is missing.

mod chain;
mod generator;

use std::sync::Arc;

use super::command::Pane;
use super::inspect::INSPECT_PANES;
use super::keys::{
    CloudKey, ImprintKey, ImprintSource, MaskKey, MaskRecipe, MaskVersion, PairKey, PoseKey, PredictionKey, Request,
    TouchKey,
};
use super::settings::MaskSource;
use super::state::{Absent, Lookup, State};
use super::workbench::PoseOf;
use crate::domain::grid::{DepthMap, Mask};
use crate::domain::rig::{PadId, PerPad};
use crate::domain::sample::{ColorTouch, DepthTouch, PadTouch, Sample};
use crate::domain::units;
use crate::work::bundles::{BundleInfo, BundleKind};
use crate::work::cloud::Clouds;
use crate::work::compare::Comparison;
use crate::work::pose::PoseResult;
use crate::work::tool::NamedTool;

/// Neighbors loaded ahead on each side of the selection.
pub const PREFETCH: usize = 4;

/// The mask in force.
#[derive(Clone, Debug)]
pub struct MaskInForce<'a> {
    /// The pixels, as large as the imprint.
    pub mask: &'a Arc<Mask>,
    /// What decides whether it has to be drawn again.
    pub version: MaskVersion,
    /// Where it comes from, for the screen.
    pub label: String,
}

impl State {
    /// The tensors of the selected pair.
    pub fn sample(&self) -> Lookup<'_, Sample> {
        if self.library.open.is_none() {
            return Lookup::Absent(Absent::NothingOpen);
        }
        let Some(key) = self.pair_key() else {
            return Lookup::Absent(Absent::NothingSelected);
        };
        match self.results.samples.get(&key) {
            Some(sample) => Lookup::Ready(sample),
            None => self.missing(&Request::Sample(key)),
        }
    }

    /// What one finger felt.
    pub fn touch(&self, finger: PadId) -> Lookup<'_, PadTouch> {
        self.sample().and_then(Absent::NoFinger, |sample| sample.pad(finger))
    }

    /// What one GelSlim felt.
    pub fn gelslim(&self, finger: PadId) -> Lookup<'_, ColorTouch> {
        self.touch(finger).and_then(Absent::NoGelSlim, |touch| touch.color())
    }

    /// What one Soft Bubble felt.
    pub fn bubble(&self, finger: PadId) -> Lookup<'_, DepthTouch> {
        self.touch(finger).and_then(Absent::NoBubble, |touch| touch.depth())
    }

    /// The prediction shown for one finger, if one was made.
    pub fn chosen(&self, finger: PadId) -> Option<&PredictionKey> {
        self.results.chosen.get(&self.touch_key(finger)?)
    }

    /// The recipe of the imprint shown for one finger.
    ///
    /// # Errors
    /// Why there is none.
    pub fn imprint_key(&self, source: ImprintSource, finger: PadId) -> Result<ImprintKey, Absent> {
        let touch = self.touch_key(finger).ok_or(Absent::NothingSelected)?;
        match source {
            ImprintSource::Measured => Ok(ImprintKey::Measured(touch)),
            ImprintSource::Predicted => {
                let recipe = self.results.chosen.get(&touch).ok_or(Absent::NoPrediction)?;
                if self.is_color(recipe) {
                    return Err(Absent::PredictsColor);
                }
                Ok(ImprintKey::Predicted(recipe.clone(), self.settings.shift))
            }
        }
    }

    /// The imprint shown for one finger, meters, raw bubble orientation.
    pub fn imprint(&self, source: ImprintSource, finger: PadId) -> Lookup<'_, DepthMap> {
        match self.imprint_key(source, finger) {
            Err(absent) => Lookup::Absent(absent),
            Ok(ImprintKey::Measured(_)) => self.bubble(finger).and_then(Absent::NoBubble, |b| Some(&b.imprint)),
            Ok(ImprintKey::Predicted(recipe, shift)) => match self.results.imprints.get(&(recipe.clone(), shift)) {
                Some(imprint) => Lookup::Ready(imprint),
                None => self.missing(&Request::Imprint(recipe, shift)),
            },
        }
    }

    /// Prediction against measurement of one finger.
    pub fn comparison(&self, finger: PadId) -> Lookup<'_, Comparison> {
        let recipe = match self.chosen(finger) {
            Some(recipe) => recipe.clone(),
            None => return self.sample().and_then(Absent::NoPrediction, |_| None),
        };
        if self.is_color(&recipe) {
            return Lookup::Absent(Absent::PredictsColor);
        }
        if self.bubble(finger).ready().is_none() {
            return self.bubble(finger).without();
        }
        let key = (recipe, self.settings.shift);
        match self.results.comparisons.get(&key) {
            Some(comparison) => Lookup::Ready(comparison),
            None => self.missing(&Request::Comparison(key.0, key.1)),
        }
    }

    /// The bundle that the settings name, or the first of its kind.
    ///
    /// # Errors
    /// [`Absent::NoGenerator`], [`Absent::NoMaskModel`].
    pub fn bundle(&self, kind: BundleKind) -> Result<&BundleInfo, Absent> {
        let (name, absent) = match kind {
            BundleKind::Generator => (self.settings.generate.bundle.as_deref(), Absent::NoGenerator),
            BundleKind::Mask => (self.settings.mask.bundle.as_deref(), Absent::NoMaskModel),
            BundleKind::Classifier => (None, Absent::NoClassifier),
        };
        let rig = self.rig();
        let others = self.library.bundles.iter().any(|bundle| bundle.kind == kind && !bundle.fits(&rig));
        let absent = if others { Absent::OtherSensors } else { absent };
        self.library.bundle_named(kind, name, &rig).ok_or(absent)
    }

    /// The recipe of the automatic mask that the settings ask for.
    ///
    /// # Errors
    /// Why this source cannot give one for this finger.
    pub fn mask_recipe(&self, finger: PadId) -> Result<MaskRecipe, Absent> {
        let mask = &self.settings.mask;
        match mask.source {
            MaskSource::Threshold => Ok(MaskRecipe::Threshold(mask.threshold_m.into())),
            MaskSource::TopPercent => Ok(MaskRecipe::TopPercent(mask.top_percent.into())),
            MaskSource::Cad => {
                self.tool_name()?;
                let sample = self.sample().ready();
                if sample.is_some_and(|s| s.grasp_from_object.is_none()) {
                    return Err(Absent::NoTruth);
                }
                if self.touch(finger).ready().is_some_and(|t| t.camera().is_none()) {
                    return Err(Absent::NoCamera);
                }
                Ok(MaskRecipe::Cad(mask.cad_distance_m.into()))
            }
            // Without a model the threshold serves: the recipe, and with it the name on screen, says so.
            MaskSource::Unet => Ok(self
                .bundle(BundleKind::Mask)
                .map_or(MaskRecipe::Threshold(mask.threshold_m.into()), |bundle| MaskRecipe::Unet(bundle.id.clone()))),
            MaskSource::Truth => {
                if self.touch(finger).ready().is_some_and(|t| t.depth().is_none_or(|b| b.truth.is_none())) {
                    return Err(Absent::NotSimulated);
                }
                Ok(MaskRecipe::Truth)
            }
        }
    }

    /// The automatic mask of one finger's imprint.
    pub fn automatic_mask(&self, source: ImprintSource, finger: PadId) -> Lookup<'_, Arc<Mask>> {
        if self.imprint(source, finger).ready().is_none() {
            return self.imprint(source, finger).without();
        }
        let key = self
            .imprint_key(source, finger)
            .and_then(|imprint| Ok(MaskKey { imprint, recipe: self.mask_recipe(finger)? }));
        match key {
            Err(absent) => Lookup::Absent(absent),
            Ok(key) => match self.results.masks.get(&key) {
                Some(mask) => Lookup::Ready(mask),
                None => self.missing(&Request::Mask(key)),
            },
        }
    }

    /// The corrected mask of one finger, if it is there and as large as the imprint.
    fn hand_mask_for(&self, source: ImprintSource, finger: PadId) -> Option<&super::document::HandMask> {
        let hand = self.document.hand_mask(self.pair_name(), finger)?;
        let imprint = self.imprint(source, finger).ready()?;
        (hand.mask.size() == imprint.size()).then_some(hand)
    }

    /// The mask in force on one finger's imprint: the corrected one, else the automatic one.
    ///
    /// # Errors
    /// What is there instead.
    pub fn mask_in_force(
        &self,
        source: ImprintSource,
        finger: PadId,
    ) -> Result<MaskInForce<'_>, Lookup<'_, Arc<Mask>>> {
        if let Some(hand) = self.hand_mask_for(source, finger) {
            let label = if hand.base.is_empty() { "By hand".into() } else { format!("By hand, from {}", hand.base) };
            return Ok(MaskInForce { mask: &hand.mask, version: MaskVersion::Hand(hand.revision), label });
        }
        let lookup = self.automatic_mask(source, finger);
        match (lookup, self.mask_recipe(finger)) {
            (Lookup::Ready(mask), Ok(recipe)) => {
                let label = self.automatic_label(source, finger, &recipe);
                Ok(MaskInForce { mask, version: MaskVersion::Auto(recipe), label })
            }
            (Lookup::Ready(_), Err(absent)) => Err(Lookup::Absent(absent)),
            (other, _) => Err(other),
        }
    }

    /// What an automatic mask that is there is made of, in words.
    pub fn automatic_label(&self, source: ImprintSource, finger: PadId, recipe: &MaskRecipe) -> String {
        let label = self.mask_label(recipe);
        let key = self.imprint_key(source, finger).map(|imprint| MaskKey { imprint, recipe: recipe.clone() });
        let basis = key.ok().and_then(|key| self.results.mask_bases.get(&key));
        basis.map_or_else(|| label.clone(), |basis| basis.label(&label))
    }

    /// An automatic source in words, with its number.
    pub fn mask_label(&self, recipe: &MaskRecipe) -> String {
        match recipe {
            MaskRecipe::Threshold(m) => format!("Threshold {}", units::text_mm(f64::from(m.get()))),
            MaskRecipe::TopPercent(percent) => format!("Top {:.1} %", percent.get()),
            MaskRecipe::Cad(m) => format!("CAD within {}", units::text_mm(f64::from(m.get()))),
            MaskRecipe::Unet(id) => {
                format!("UNet {}", self.library.bundle(id).map_or("", |bundle| bundle.name.as_str()))
            }
            MaskRecipe::Truth => "Simulator truth".into(),
        }
    }

    /// The tool of the selected pair.
    ///
    /// # Errors
    /// [`Absent::NothingSelected`], [`Absent::NoTool`].
    pub fn tool_name(&self) -> Result<&str, Absent> {
        self.entry().ok_or(Absent::NothingSelected)?.tool.as_deref().ok_or(Absent::NoTool)
    }

    fn tool_request(&self) -> Result<Request, Absent> {
        let seq = self.library.open.as_ref().ok_or(Absent::NothingOpen)?.seq;
        Ok(Request::Tool(seq, self.tool_name()?.into()))
    }

    /// The tool of the selected pair, with its CAD model.
    pub fn tool(&self) -> Lookup<'_, NamedTool> {
        match self.tool_request() {
            Err(absent) => Lookup::Absent(absent),
            Ok(request) => match self.tool_name().ok().and_then(|name| self.results.tools.get(&name.to_owned())) {
                Some(tool) => Lookup::Ready(tool),
                None => self.missing(&request),
            },
        }
    }

    /// The recipe of the cloud of an imprint; `Ok(None)` while something it is made from is not there yet.
    ///
    /// # Errors
    /// Why there can be none.
    pub fn cloud_key(&self, source: ImprintSource) -> Result<Option<CloudKey>, Absent> {
        let sample = match self.sample() {
            Lookup::Ready(sample) => sample,
            Lookup::Absent(absent) => return Err(absent),
            _ => return Ok(None),
        };
        let mut parts = PerPad::default();
        let mut reason = Absent::NoBubble;
        for (finger, touch) in sample.pads.entries() {
            if touch.camera().is_none() {
                if touch.depth().is_some() || source == ImprintSource::Predicted {
                    reason = Absent::NoCamera;
                }
                continue;
            }
            let key = match self.imprint_key(source, finger) {
                Ok(key) => key,
                Err(absent) => {
                    reason = absent;
                    continue;
                }
            };
            match self.imprint(source, finger) {
                Lookup::Ready(_) => {}
                Lookup::Failed(_) | Lookup::Absent(_) => continue,
                Lookup::Stale(_) | Lookup::Waiting => return Ok(None),
            }
            let version = match self.mask_in_force(source, finger) {
                Ok(mask) => Some(mask.version),
                // Without a mask there are points, but none of contact.
                Err(Lookup::Failed(_) | Lookup::Absent(_)) => None,
                Err(_) => return Ok(None),
            };
            parts[finger] = Some((key, version));
        }
        if parts.is_empty() { Err(reason) } else { Ok(Some(CloudKey { parts })) }
    }

    /// The surface points of an imprint, both fingers.
    pub fn cloud(&self, source: ImprintSource) -> Lookup<'_, Clouds> {
        let latest = || self.latest(source).and_then(|(cloud, _)| self.results.clouds.get(cloud.as_ref()?));
        match self.cloud_key(source) {
            Err(absent) => Lookup::Absent(absent),
            Ok(key) => match key.as_ref().and_then(|key| self.results.clouds.get(key)) {
                Some(clouds) => Lookup::Ready(clouds),
                None => self.missing_but(key.map(Request::Cloud), latest().map(|a| &**a)),
            },
        }
    }

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
        let latest = || self.latest(source).and_then(|(_, pose)| self.results.poses.get(pose.as_ref()?));
        if let failed @ Lookup::Failed(_) = self.tool() {
            return failed.without();
        }
        match self.pose_key(source) {
            Err(absent) => Lookup::Absent(absent),
            Ok(key) => match key.as_ref().and_then(|key| self.results.poses.get(key)) {
                Some(pose) => Lookup::Ready(pose),
                None => self.missing_but(key.map(Request::Pose), latest().map(|a| &**a)),
            },
        }
    }

    fn latest(&self, source: ImprintSource) -> Option<&(Option<CloudKey>, Option<PoseKey>)> {
        self.results.latest.get(&(self.pair_key()?, source))
    }

    /// The small picture of a pair, if it was made.
    pub fn thumbnail(&self, pair: crate::domain::dataset::PairId) -> Option<&DepthMap> {
        let key = self.library.open.as_ref()?.key(pair);
        self.results.thumbnails.get(&key).map(|a| &**a)
    }

    /// What stands in place of a result that is not cached.
    pub(super) fn missing<T: ?Sized>(&self, request: &Request) -> Lookup<'_, T> {
        match self.tasks.failed.get(request) {
            Some(err) => Lookup::Failed(err),
            None => Lookup::Waiting,
        }
    }

    pub(super) fn missing_but<'a, T: ?Sized>(
        &'a self,
        request: Option<Request>,
        before: Option<&'a T>,
    ) -> Lookup<'a, T> {
        match (request.and_then(|request| self.tasks.failed.get(&request)), before) {
            (Some(err), _) => Lookup::Failed(err),
            (None, Some(before)) => Lookup::Stale(before),
            (None, None) => Lookup::Waiting,
        }
    }

    /// What the visible panes need, is not there, and can be computed from what is there; most urgent first.
    ///
    /// Pure: the same state wants the same. A result that is computed makes the next one possible.
    pub fn wanted(&self) -> Vec<Request> {
        let mut list = Wanted { state: self, list: Vec::new() };
        list.selection();
        for request in self.wanted_seeds() {
            list.ask(false, request);
        }
        list.thumbnails();
        list.neighbors();
        list.list
    }

    /// Whether the cloud of an imprint is needed for the 3D views and what lies beside them (with its pose), and
    /// whether it is needed at all.
    pub(super) fn shows_cloud(&self, source: ImprintSource) -> (bool, bool) {
        let (own, other) = match source {
            ImprintSource::Measured => (Pane::SceneMeasured, Pane::ScenePredicted),
            ImprintSource::Predicted => (Pane::ScenePredicted, Pane::SceneMeasured),
        };
        let layers = self.is_visible(&[Pane::Layers]) && self.workbench.side == source;
        let both = self.workbench.both_clouds && self.is_visible(&[other]);
        let scene = layers || both || self.is_visible(&[own, Pane::Metrics, Pane::Poses]);
        (scene, scene || (self.is_visible(&INSPECT_PANES) && self.inspect.source == source))
    }

    pub(super) fn is_visible(&self, panes: &[Pane]) -> bool {
        panes.iter().any(|pane| self.selection.panes.contains(pane))
    }
}

/// Panes that show something of the selected pair.
const PAIR_PANES: [Pane; 17] = [
    Pane::GelRaw,
    Pane::GelReference,
    Pane::GelDifference,
    Pane::Measured,
    Pane::Predicted,
    Pane::Error,
    Pane::SceneMeasured,
    Pane::ScenePredicted,
    Pane::TimeMachine,
    Pane::BasinMap,
    Pane::Generate,
    Pane::Seeds,
    Pane::Masks,
    Pane::Layers,
    Pane::Poses,
    Pane::Ledger,
    Pane::Metrics,
];

/// Collects what is missing.
struct Wanted<'a> {
    state: &'a State,
    list: Vec<Request>,
}

impl Wanted<'_> {
    fn ask(&mut self, there: bool, request: Request) {
        if !there && !self.state.tasks.failed.contains_key(&request) && !self.list.contains(&request) {
            self.list.push(request);
        }
    }

    fn sample(&mut self, pair: PairKey) {
        self.ask(self.state.results.samples.contains(&pair), Request::Sample(pair));
    }

    fn selection(&mut self) {
        let state = self.state;
        let Some(pair) = state.pair_key() else { return };
        if !state.is_visible(&PAIR_PANES) {
            return;
        }
        self.sample(pair);
        let name = state.pair_name();
        self.ask(state.document.stored.contains_key(name), Request::Labels(pair));
        let (measured, predicted) = (ImprintSource::Measured, ImprintSource::Predicted);
        let (scene_measured, cloud_measured) = state.shows_cloud(measured);
        let (scene_predicted, cloud_predicted) = state.shows_cloud(predicted);

        let shown = state.fingers();
        for finger in state.rig().pads() {
            let on_screen = shown.contains(&finger);
            let image = state.is_visible(&[Pane::Predicted]) && on_screen;
            let compared = state.is_visible(&[Pane::Error, Pane::Metrics]) && on_screen;
            if image || compared || cloud_predicted {
                self.stored(finger, pair.finger(finger));
                self.imprint(finger, pair.finger(finger));
            }
            if cloud_predicted {
                self.other_finger(finger);
            }
            if compared {
                self.comparison(finger, pair.finger(finger));
            }
            if image || (on_screen && state.is_visible(&[Pane::Metrics])) {
                self.ambiguity(finger, pair.finger(finger));
            }
            let drawn = on_screen && (state.settings.mask_visible || state.is_visible(&[Pane::Masks]));
            if cloud_measured || (drawn && state.is_visible(&[Pane::Measured])) {
                self.mask(measured, finger);
            }
            if cloud_predicted || (drawn && state.is_visible(&[Pane::Predicted])) {
                self.mask(predicted, finger);
            }
        }
        // While the pen is down the cloud would be out of date before it is there.
        if state.document.stroke.is_none() {
            for (cloud, pose, source) in
                [(cloud_measured, scene_measured, measured), (cloud_predicted, scene_predicted, predicted)]
            {
                if cloud && self.cloud(source) && pose {
                    self.pose(source);
                    self.workbench(source);
                }
            }
            self.inspection();
        }
        if state.is_visible(&[Pane::Metrics, Pane::Ledger]) {
            self.ledger(pair.finger(state.selection.finger));
        }
    }

    /// What was made of a touch before this start of the program.
    fn stored(&mut self, finger: PadId, touch: TouchKey) {
        let state = self.state;
        if state.can_start(finger) {
            self.ask(state.results.looked_up.contains(&touch), Request::Stored(touch));
        }
    }

    /// The prediction of a finger that nobody looked at when the other one's was made.
    fn other_finger(&mut self, finger: PadId) {
        let state = self.state;
        let made = state.rig().pads().filter(|pad| *pad != finger).find_map(|pad| state.chosen(pad));
        let (Some(touch), Some(made)) = (state.touch_key(finger), made) else { return };
        let looked_up = state.results.looked_up.contains(&touch);
        if !state.settings.generate.both_fingers || !looked_up || state.chosen(finger).is_some() {
            return;
        }
        let recipe = PredictionKey { touch, ..made.clone() };
        let under_way = state.tasks.generating(&recipe).is_some();
        if state.library.bundle(&recipe.bundle).is_some() && state.can_start(finger) && !under_way {
            self.ask(state.results.predictions.contains(&recipe), Request::Prediction(recipe));
        }
    }

    fn imprint(&mut self, finger: PadId, touch: TouchKey) {
        let state = self.state;
        let Some(recipe) = state.results.chosen.get(&touch) else { return };
        // The sample says how large the bubble image is.
        if state.touch(finger).ready().is_none() || !state.results.predictions.contains(recipe) {
            return;
        }
        let key = (recipe.clone(), state.settings.shift);
        let there = state.results.imprints.contains(&key) || state.results.colors.contains(recipe);
        self.ask(there, Request::Imprint(key.0, key.1));
    }

    fn comparison(&mut self, finger: PadId, touch: TouchKey) {
        let state = self.state;
        let Some(recipe) = state.results.chosen.get(&touch) else { return };
        let there = |source| state.imprint(source, finger).ready().is_some();
        if there(ImprintSource::Measured) && there(ImprintSource::Predicted) {
            let key = (recipe.clone(), state.settings.shift);
            self.ask(state.results.comparisons.contains(&key), Request::Comparison(key.0, key.1));
        }
    }

    fn mask(&mut self, source: ImprintSource, finger: PadId) {
        let state = self.state;
        // Stored corrections first: they may make the automatic mask unnecessary.
        if !state.document.stored.contains_key(state.pair_name())
            || state.hand_mask_for(source, finger).is_some()
            || state.imprint(source, finger).ready().is_none()
        {
            return;
        }
        let (Ok(imprint), Ok(recipe)) = (state.imprint_key(source, finger), state.mask_recipe(finger)) else {
            return;
        };
        if matches!(recipe, MaskRecipe::Cad(_)) && state.tool().ready().is_none() {
            return self.tool();
        }
        let key = MaskKey { imprint, recipe };
        self.ask(state.results.masks.contains(&key), Request::Mask(key));
    }

    fn tool(&mut self) {
        if let Ok(request) = self.state.tool_request() {
            self.ask(self.state.tool().ready().is_some(), request);
        }
    }

    /// Asks for the cloud and the tool; whether both are there.
    fn cloud(&mut self, source: ImprintSource) -> bool {
        let state = self.state;
        self.tool();
        if !state.document.stored.contains_key(state.pair_name()) {
            return false;
        }
        let Ok(Some(key)) = state.cloud_key(source) else {
            return false;
        };
        let there = state.results.clouds.contains(&key);
        self.ask(there, Request::Cloud(key));
        there && state.tool().ready().is_some()
    }

    fn pose(&mut self, source: ImprintSource) {
        if let Ok(Some(key)) = self.state.pose_key(source) {
            self.ask(self.state.results.poses.contains(&key), Request::Pose(key));
        }
    }

    /// The recorded run, and the map of starts last: it takes the longest.
    fn inspection(&mut self) {
        let state = self.state;
        let Ok(Some(cloud)) = state.cloud_key(state.inspect.source) else {
            return;
        };
        if !state.results.clouds.contains(&cloud) || state.tool().ready().is_none() {
            return;
        }
        if state.shows_steps(state.inspect.source)
            && let Ok(Some(key)) = state.inspection_key()
        {
            match state.results.runs.contains(&key) {
                true => self.ask(state.results.inspections.contains(&key), Request::Inspection(key)),
                false => self.ask(state.results.inspections.contains(&key), Request::Run(key)),
            }
        }
        if state.is_visible(&[Pane::BasinMap])
            && let Ok(Some(key)) = state.basin_key()
        {
            self.ask(state.results.basins.contains(&key), Request::Basin(key));
        }
    }

    /// What the workbench shows of an imprint whose cloud is needed anyway.
    fn workbench(&mut self, source: ImprintSource) {
        let state = self.state;
        if state.tool().ready().is_none() || state.cloud(source).ready().is_none() {
            return;
        }
        if state.is_visible(&[Pane::Poses]) {
            for key in
                PoseOf::all(&state.rig()).into_iter().filter_map(|of| state.pose_key_of(source, of).ok().flatten())
            {
                if state.results.clouds.contains(&key.cloud) {
                    self.ask(state.results.poses.contains(&key), Request::Pose(key));
                } else {
                    self.ask(false, Request::Cloud(key.cloud));
                }
            }
        }
        if let Some(key) = state.workbench.hand(source).and_then(|hand| hand.icp.clone()) {
            self.ask(state.results.runs.contains(&key), Request::Run(key));
        }
        let Some(run) = state.run_key(source).filter(|_| state.shows_layers(source)) else { return };
        if state.results.layers.contains(&run.pose) {
            return;
        }
        if state.results.runs.contains(&run) {
            self.ask(false, Request::Layers(run.pose));
        } else {
            self.ask(false, Request::Run(run));
        }
    }

    fn thumbnails(&mut self) {
        let state = self.state;
        let Some(open) = state.library.open.as_ref().filter(|_| state.is_visible(&[Pane::Browser])) else {
            return;
        };
        let end = state.library.rows.end.min(state.library.order.len());
        let start = state.library.rows.start.min(end);
        for pair in &state.library.order[start..end] {
            let key = open.key(*pair);
            self.ask(state.results.thumbnails.contains(&key), Request::Thumbnail(key));
        }
    }

    fn neighbors(&mut self) {
        let state = self.state;
        let (Some(open), Some(selected)) = (state.library.open.as_ref(), state.selection.pair) else {
            return;
        };
        if !state.is_visible(&PAIR_PANES) {
            return;
        }
        let Some(row) = state.library.row_of(selected) else {
            return;
        };
        let order = &state.library.order;
        for distance in 1..=PREFETCH {
            for at in [row.checked_add(distance), row.checked_sub(distance)].into_iter().flatten() {
                if let Some(pair) = order.get(at) {
                    self.sample(open.key(*pair));
                }
            }
        }
    }
}
