//! Raw predictions: those kept on the disk, those that a pane needs, and those of the pair on screen that cost little; and
//! pictures of them on the way.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::super::jobs::{Job, Worker};
use super::super::keys::{ImprintSource, Keyed, PredictionKey, Preview, ShiftMode, StoredKey, TouchKey};
use super::super::pane::Demand;
use super::super::recipe;
use super::super::results::{self, Computes, Demands};
use super::super::services::Services;
use super::super::source::Source;
use super::super::state::results::Key as _;
use super::super::state::{Absent, State};
use touch2touch_core::rig::{PadId, SensorId};
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::job::{JobCx, PreviewPicture, Previews};
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind};
use touch2touch_pipeline::steps::models::KeptPrediction;
use touch2touch_pipeline::steps::predict::Generating;
use touch2touch_pipeline::steps::prediction::Prediction;

/// A picture on the way after the first step and after every so many.
const PREVIEW_STEPS: u32 = 4;
/// The time between two looks whether a pair is still on screen, before its prediction begins.
const LOOK: Duration = Duration::from_millis(10);

impl Computes for PredictionKey {
    fn job(&self, state: &State, services: &Arc<Services>) -> Option<Job<Prediction>> {
        let (services, recipe) = (services.clone(), self.clone());
        let source = state.library.open.as_ref()?.source.clone();
        let bundle = state.library.bundle(&recipe.bundle)?.clone();
        let sample = state.results.samples.get(&recipe.touch.pair).cloned();
        // Who pages on does not want it. Once for a pair and settings: the other finger follows at once.
        let beside = |pad| state.results.predictions.contains(&self.on(pad));
        let patience = if state.rig().pads().any(beside) { Duration::ZERO } else { services.patience };
        let what = format!("Generate with {}", bundle.name);
        Some(Job::new(Worker::Models, what.clone(), move |cx| {
            let begin = Instant::now();
            while begin.elapsed() < patience {
                cx.check(&what)?;
                std::thread::sleep(LOOK);
            }
            cx.check(&what)?;
            let made = generate(&services, vec![recipe], &bundle, &source, sample, cx, None)?.pop();
            made.map(|(_, made)| Arc::unwrap_or_clone(made)).ok_or_else(|| TaskError::new(what, "no answer"))
        }))
    }

    /// What a person started is not made twice.
    fn is_there(&self, state: &State) -> bool {
        state.tasks.generating(self).is_some()
    }

    /// One that is only compared with something does not push away what is looked at.
    fn arrived(&self, state: &mut State, _: &Arc<Prediction>) {
        let named = recipe::prediction(state, self.touch).as_ref() == Some(self);
        let beside = |pad| results::shown(state, self.touch.pair.finger(pad)) == Some(&self.on(pad));
        let in_front = named || state.rig().pads().filter(|pad| *pad != self.touch.finger).any(beside);
        state.results.list_made(self, in_front);
    }
}

impl Computes for StoredKey {
    fn job(&self, state: &State, services: &Arc<Services>) -> Option<Job<Keyed>> {
        let (services, touch) = (services.clone(), self.0);
        let bundles = state.library.bundles.clone();
        let runtime = state.settings.runtime;
        let sample = state.results.samples.get(&touch.pair)?.clone();
        // Only sensors that some bundle starts from.
        let starts = bundles.iter().filter_map(|bundle| bundle.ends(&sample.rig)?.ok()).map(|ends| ends.input);
        let inputs: BTreeSet<SensorId> = starts.collect();
        Some(Job::new(Worker::Files, "Look for earlier predictions", move |_| {
            let pictures = inputs.iter().filter_map(|input| sample.pad(touch.finger)?.picture(*input));
            let kept = pictures.flat_map(|picture| services.models.kept(&bundles, runtime, &picture));
            let keyed = |kept: KeptPrediction| {
                let bundle = kept.prediction.bundle.clone();
                let key = PredictionKey { touch, bundle, config: kept.config, runtime: kept.engine };
                (key, Arc::new(kept.prediction))
            };
            Ok(kept.map(keyed).collect())
        }))
    }

    fn is_there(&self, state: &State) -> bool {
        state.results.looked_up.contains(&self.0)
    }

    /// Shows the one used last where the settings name none of them, unless something is shown already.
    fn arrived(&self, state: &mut State, found: &Arc<Keyed>) {
        state.results.looked_up.insert(self.0);
        let nothing = results::shown(state, self.0).is_none();
        for (key, made) in found.iter() {
            if !state.results.predictions.contains(key) {
                keep_prediction(state, key.clone(), made.clone(), nothing);
            }
        }
    }
}

/// Makes predictions of fingers of one pair that differ in nothing else. A finger without a picture to start from is left out
/// where another has one. `sample` is the pair, if it is loaded; `onlooker` sees pictures on the way.
///
/// # Errors
/// If no finger has such a picture, the pair or the model cannot be loaded or run, or the job was told to stop.
pub(crate) fn generate(
    services: &Services,
    mut keys: Vec<PredictionKey>,
    bundle: &BundleInfo,
    source: &Source,
    sample: Option<Arc<Sample>>,
    cx: &JobCx,
    onlooker: Option<Onlooker>,
) -> Result<Keyed, TaskError> {
    let Some(PredictionKey { touch, config, runtime, .. }) = keys.first().cloned() else { return Ok(Vec::new()) };
    let generating = Generating { bundle, engine: runtime, config: &config };
    generating.input(&source.dataset.rig)?;
    let sample = match sample {
        Some(sample) => sample,
        None => Arc::new(source.load(touch.pair.pair)?),
    };
    keys.retain(|key| generating.picture(&sample, key.touch.finger).is_ok_and(|picture| picture.is_some()));
    if keys.is_empty() {
        return Err(generating.no_input(&sample.rig));
    }
    let cx = match onlooker {
        Some(onlooker) => cx.clone().with_previews(onlooker.of(keys.clone())),
        None => cx.clone(),
    };
    let pads: Vec<PadId> = keys.iter().map(|key| key.touch.finger).collect();
    let mut made = generating.pads(&services.models, &sample, &pads, &cx)?;
    let keyed = |key: PredictionKey| made[key.touch.finger].take().map(|made| (key, Arc::new(made)));
    Ok(keys.into_iter().filter_map(keyed).collect())
}

/// Asks for the predictions of a touch that were made before this start of the program.
pub(crate) fn want_stored(wants: &mut Demands<'_>, finger: PadId, touch: TouchKey) {
    if results::can_start(wants.state, finger) {
        wants.ask(StoredKey(touch));
    }
}

/// The prediction of a finger that nobody looked at when the other one's was made.
pub(crate) fn want_other_finger(wants: &mut Demands<'_>, finger: PadId) {
    let state = wants.state;
    let made = state.rig().pads().filter(|pad| *pad != finger).find_map(|pad| results::chosen(state, pad));
    let (Some(touch), Some(made)) = (state.touch_key(finger), made) else { return };
    let looked_up = state.results.looked_up.contains(&touch);
    let recipe = made.on(finger);
    if !state.settings.generate.both_fingers || !looked_up || state.results.predictions.contains(&recipe) {
        return;
    }
    if state.library.bundle(&recipe.bundle).is_some() && results::can_start(state, finger) {
        wants.ask(recipe);
    }
}

/// Keeps a prediction of the open data set; with `in_front` it is shown where the settings name none that is there.
pub(crate) fn keep_prediction(state: &mut State, recipe: PredictionKey, made: Arc<Prediction>, in_front: bool) {
    if state.library.open.as_ref().is_none_or(|open| open.seq != recipe.touch.pair.dataset) {
        return;
    }
    let results = &mut state.results;
    let bytes = PredictionKey::bytes(&made);
    results.predictions.insert(recipe.clone(), made, bytes);
    results.list_made(&recipe, in_front);
}

/// `Ok` where something can be generated for the selected pair.
///
/// # Errors
/// Why not.
pub fn can_generate(state: &State) -> Result<(), Absent> {
    state.pair_key().ok_or(if state.library.open.is_none() { Absent::NothingOpen } else { Absent::NothingSelected })?;
    recipe::bundle(state, BundleKind::Generator)?;
    // While the sample loads, the job loads it itself.
    let Some(sample) = results::sample(state).ready() else {
        return Ok(());
    };
    if sample.rig.pads().any(|finger| has_input(state, sample, finger)) { Ok(()) } else { Err(Absent::NoInput) }
}

/// True where a finger has a reading of the sensor that the generator starts from.
fn has_input(state: &State, sample: &Sample, finger: PadId) -> bool {
    let ends = recipe::bundle(state, BundleKind::Generator).ok().and_then(|bundle| bundle.ends(&sample.rig)?.ok());
    ends.is_some_and(|ends| sample.pad(finger).is_some_and(|touch| touch.reading(ends.input).is_some()))
}

/// True where something can be generated for a finger of the selected pair, which is loaded.
pub(crate) fn can_start(state: &State, finger: PadId) -> bool {
    results::sample(state).ready().is_some_and(|sample| has_input(state, sample, finger))
}

/// The highest cost of a prediction that is made without being asked for, seconds.
pub(crate) const CHEAP_S: f64 = 1.0;
/// The prediction of a finger of the pair on screen that is made without being asked for, if one is.
pub(crate) fn prefetch(state: &State, finger: PadId) -> Option<PredictionKey> {
    let needs = [Demand::Imprint(ImprintSource::Predicted), Demand::Comparison];
    let (_, cloud) = results::shows_cloud(state, ImprintSource::Predicted);
    let shown = cloud || needs.into_iter().any(|need| state.needs(need));
    if !state.settings.generate.by_itself
        || !shown
        || state.tasks.any_generating().is_some()
        || !results::fingers_to_generate(state).contains(&finger)
    {
        return None;
    }
    let touch = state.touch_key(finger).filter(|touch| state.results.looked_up.contains(touch))?;
    let key = recipe::prediction(state, touch)?;
    // What a person picked under these settings is meant.
    let there = state.results.predictions.contains(&key) || results::picked(state, touch).is_some();
    if there || !results::can_start(state, finger) {
        return None;
    }
    let cheap = state.results.cost_of(&key).is_none_or(|seconds| seconds < CHEAP_S);
    (cheap && state.failure(key.clone()).is_none()).then_some(key)
}

/// The predictions of the pair on screen that cost little.
pub(crate) fn want_predictions_ahead(wants: &mut Demands<'_>) {
    let fingers = results::fingers_to_generate(wants.state);
    for key in fingers.into_iter().filter_map(|finger| prefetch(wants.state, finger)) {
        wants.ask(key);
    }
}

/// Receives pictures on the way.
pub(crate) type PreviewSink = Arc<dyn Fn(Preview) + Send + Sync>;

/// The pictures of predictions under way that would be looked at now. The runtime keeps this up to date while jobs run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PreviewRequest {
    /// After so many steps, and after the first; 0 = never.
    pub every: u32,
    /// The mapping to meters.
    pub shift: ShiftMode,
    /// The touches whose predicted imprint is on screen.
    pub touches: BTreeSet<TouchKey>,
}

impl PreviewRequest {
    /// True where a picture of `touch` is wanted after `step` steps.
    pub fn wants(&self, touch: TouchKey, step: u32) -> bool {
        self.every > 0 && (step == 1 || step.is_multiple_of(self.every)) && self.touches.contains(&touch)
    }
}

/// Who looks at the pictures of predictions on the way, whichever they are.
#[derive(Clone)]
pub struct Onlooker {
    /// The pictures that would be looked at now.
    pub request: Arc<Mutex<PreviewRequest>>,
    /// Receives it.
    pub sink: PreviewSink,
}

impl Onlooker {
    /// The onlooker of the predictions of one call, in its order.
    pub fn of(self, items: Vec<PredictionKey>) -> Arc<dyn Previews> {
        Arc::new(Watched { by: self, items })
    }
}

struct Watched {
    by: Onlooker,
    items: Vec<PredictionKey>,
}

impl Previews for Watched {
    fn wants(&self, item: usize, step: u32) -> Option<ShiftMode> {
        let request = self.by.request.lock().unwrap_or_else(PoisonError::into_inner);
        request.wants(self.items.get(item)?.touch, step).then_some(request.shift)
    }

    fn show(&self, item: usize, picture: PreviewPicture) {
        if let Some(recipe) = self.items.get(item).cloned() {
            (self.by.sink)(Preview { recipe, picture });
        }
    }
}

/// The prediction on its way to one finger of the selected pair, as it looks now.
pub fn preview(state: &State, finger: PadId) -> Option<&Arc<Preview>> {
    state.results.previews.get(&state.touch_key(finger)?).filter(|_| state.document.stroke.is_none())
}

/// The pictures of predictions under way that would be looked at: the predicted imprints on screen, unless a pen is on them.
pub fn preview_request(state: &State) -> PreviewRequest {
    let shown = state.needs(Demand::Imprint(ImprintSource::Predicted)) && state.document.stroke.is_none();
    let touches = match state.pair_key().filter(|_| shown) {
        Some(pair) => state.fingers().into_iter().map(|finger| pair.finger(finger)).collect(),
        None => Default::default(),
    };
    PreviewRequest { every: PREVIEW_STEPS, shift: state.settings.shift, touches }
}
