//! From a request to a job: gathers the inputs from the state, so that the job needs the state no more.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::super::command::Computed;
use super::super::inspect::Inspection;
use super::super::keys::{CloudKey, ImprintKey, MaskRecipe, MaskVersion, PairKey, Request, RunKey, TouchKey};
use super::super::services::SharedServices;
use super::super::state::State;
use super::{Lane, generate};
use crate::domain::align::Ask;
use crate::domain::grid::{DepthMap, Mask};
use crate::domain::rig::{PerPad, SensorId};
use crate::domain::sample::Sample;
use crate::work::error::TaskError;
use crate::work::job::JobCx;
use crate::work::mask::MaskInputs;
use crate::work::{cloud, compare, ensemble, imprint, layers, ledger, mask, pose, tool};

/// The body of a job.
pub type Body<T> = Box<dyn FnOnce(&JobCx) -> Result<T, TaskError> + Send>;

/// A job that computes what a pane asked for.
pub struct RequestJob {
    /// Where it runs.
    pub lane: Lane,
    /// What it does, for errors.
    pub what: String,
    /// How.
    pub body: Body<Computed>,
}

/// An imprint wherever it lies.
enum Imprint {
    Measured(Arc<Sample>, TouchKey),
    Predicted(Arc<DepthMap>),
}

impl Imprint {
    fn get(&self) -> Option<&DepthMap> {
        match self {
            Self::Measured(sample, touch) => Some(&sample.pad(touch.finger)?.depth()?.imprint),
            Self::Predicted(depth) => Some(depth),
        }
    }
}

fn imprint_of(state: &State, key: &ImprintKey) -> Option<Imprint> {
    Some(match key {
        ImprintKey::Measured(touch) => Imprint::Measured(state.results.samples.get(&touch.pair)?.clone(), *touch),
        ImprintKey::Predicted(recipe, shift) => {
            Imprint::Predicted(state.results.imprints.get(&(recipe.clone(), *shift))?.clone())
        }
    })
}

fn pair_name(state: &State, key: PairKey) -> Option<String> {
    Some(state.library.entry(key.pair)?.name.clone())
}

/// The job of a request; `None` if an input is not there (any more).
pub fn prepare(state: &State, services: &SharedServices, request: &Request) -> Option<RequestJob> {
    let open = state.library.open.as_ref()?;
    if request.dataset().is_some_and(|seq| seq != open.seq) {
        return None;
    }
    let source = open.source.clone();
    let results = &state.results;
    let job = |lane: Lane, what: String, body: Body<Computed>| Some(RequestJob { lane, what, body });
    match request {
        Request::Sample(key) => {
            let pair = key.pair;
            job(
                Lane::Files,
                format!("Load {}", pair_name(state, *key)?),
                Box::new(move |_| Ok(Computed::Sample(Arc::new(source.load(pair)?)))),
            )
        }
        Request::Labels(key) => {
            let name = pair_name(state, *key)?;
            let what = format!("Labels of {name}");
            job(Lane::Files, what, Box::new(move |_| Ok(Computed::Labels(Box::new(source.load_labels(&name)?)))))
        }
        Request::Thumbnail(key) => {
            let pair = key.pair;
            let loaded = results.samples.get(key).cloned();
            job(
                Lane::Files,
                format!("Picture of {}", pair_name(state, *key)?),
                Box::new(move |_| {
                    let sample = match loaded {
                        Some(sample) => sample,
                        None => Arc::new(source.load(pair)?),
                    };
                    Ok(Computed::Depth(Arc::new(imprint::thumbnail(&sample))))
                }),
            )
        }
        Request::Tool(_, name) => {
            let name = name.clone();
            let what = format!("CAD model of {name}");
            job(
                Lane::Compute,
                what,
                Box::new(move |_| Ok(Computed::Tool(Arc::new(tool::named_tool(&name, source.tool_mesh(&name)?)?)))),
            )
        }
        Request::Stored(touch) => {
            let (services, touch) = (services.clone(), *touch);
            let bundles = state.library.bundles.clone();
            let runtime = state.settings.runtime;
            let sample = results.samples.get(&touch.pair)?.clone();
            // Only sensors that some bundle starts from.
            let starts = bundles.iter().filter_map(|bundle| bundle.ends(&sample.rig)?.ok()).map(|ends| ends.input);
            let inputs: BTreeSet<SensorId> = starts.collect();
            job(
                Lane::Files,
                "Look for earlier predictions".into(),
                Box::new(move |_| {
                    let pictures = inputs.iter().filter_map(|input| sample.pad(touch.finger)?.picture(*input));
                    let found = pictures.flat_map(|picture| services.stored(&bundles, runtime, touch, &picture));
                    let keyed = found.map(|(key, made)| (key, Arc::new(made)));
                    Ok(Computed::Predictions(keyed.collect()))
                }),
            )
        }
        Request::Prediction(recipe) | Request::Seed(recipe) => {
            let (services, recipe) = (services.clone(), recipe.clone());
            let bundle = state.library.bundle(&recipe.bundle)?.clone();
            let sample = results.samples.get(&recipe.touch.pair).cloned();
            job(
                Lane::Models,
                format!("Generate with {}", bundle.name),
                Box::new(move |cx| {
                    let made = generate::generate(&*services, vec![recipe], &bundle, &*source, sample, cx, None)?;
                    Ok(Computed::Predictions(made))
                }),
            )
        }
        Request::Ensemble(key) => {
            let predictions: Option<Vec<_>> =
                key.recipes.iter().map(|recipe| results.predictions.get(recipe).cloned()).collect();
            let imprints: Option<Vec<_>> =
                key.recipes.iter().map(|recipe| results.imprints.get(&(recipe.clone(), key.shift)).cloned()).collect();
            let (predictions, imprints, shift) = (predictions?, imprints?, key.shift);
            job(
                Lane::Compute,
                "Spread of the seeds".into(),
                Box::new(move |_| {
                    Ok(Computed::Ensemble(Arc::new(ensemble::ensemble(&predictions, &imprints, shift)?)))
                }),
            )
        }
        Request::Imprint(recipe, shift) => {
            let prediction = results.predictions.get(recipe)?.clone();
            let sample = results.samples.get(&recipe.touch.pair)?;
            let bubble = sample.pad(recipe.touch.finger).and_then(|t| t.depth());
            // Without a measurement the bundle's own size is kept.
            let size = bubble.map_or([0, 0], |b| b.imprint.size());
            let shift = *shift;
            if prediction.color.is_some() {
                return job(
                    Lane::Compute,
                    "Predicted color picture".into(),
                    Box::new(move |_| {
                        let picture = imprint::color(&prediction, [0, 0])?.ok_or_else(gone)?;
                        Ok(Computed::Color(Arc::new(picture)))
                    }),
                );
            }
            job(
                Lane::Compute,
                "Prediction in meters".into(),
                Box::new(move |_| Ok(Computed::Depth(Arc::new(imprint::imprint(&prediction, shift, size)?)))),
            )
        }
        Request::Comparison(recipe, shift) => {
            let predicted = results.imprints.get(&(recipe.clone(), *shift))?.clone();
            let sample = results.samples.get(&recipe.touch.pair)?.clone();
            let measured = Imprint::Measured(sample.clone(), recipe.touch);
            let finger = recipe.touch.finger;
            job(
                Lane::Compute,
                "Compare prediction and measurement".into(),
                Box::new(move |_| {
                    let measured = measured.get().ok_or_else(gone)?;
                    let seen = sample.rig.seen_mask(finger, measured.size());
                    let found = compare::compare_parts(&predicted, measured, sample.scale, seen.as_ref())?;
                    Ok(Computed::Comparison(Arc::new(found)))
                }),
            )
        }
        Request::Ledger(recipe, shift) => {
            let prediction = results.predictions.get(recipe)?.clone();
            let sample = results.samples.get(&recipe.touch.pair)?.clone();
            let (finger, shift) = (recipe.touch.finger, *shift);
            job(
                Lane::Compute,
                "Depth chain".into(),
                Box::new(move |_| {
                    let measured = sample.pad(finger).and_then(|t| t.depth()).map(|b| &b.imprint);
                    Ok(Computed::Ledger(Arc::new(ledger::of_prediction(&prediction, shift, false, measured)?)))
                }),
            )
        }
        Request::Ambiguity(touch) => {
            let sample = results.samples.get(&touch.pair)?.clone();
            let finger = touch.finger;
            job(
                Lane::Compute,
                "What the GelSlim image leaves open".into(),
                Box::new(move |_| {
                    let gelslim = sample.pad(finger).and_then(|t| t.color());
                    let difference = &gelslim.ok_or_else(gone)?.difference;
                    Ok(Computed::Ambiguity(crate::domain::ambiguity::ambiguity(difference)))
                }),
            )
        }
        Request::Mask(key) => {
            let imprint = imprint_of(state, &key.imprint)?;
            let touch = key.imprint.touch();
            let sample = results.samples.get(&touch.pair)?.clone();
            if let MaskRecipe::Unet(id) = &key.recipe {
                let (services, runtime) = (services.clone(), state.settings.runtime);
                let bundle = state.library.bundle(id)?.clone();
                return job(
                    Lane::Models,
                    "Contact mask by the mask model".into(),
                    Box::new(move |_| {
                        let imprint = imprint.get().ok_or_else(gone)?;
                        Ok(Computed::Mask(Box::new(services.mask_by_model(&bundle, runtime, imprint)?)))
                    }),
                );
            }
            let recipe = key.recipe.clone();
            let tool = state.library.entry(touch.pair.pair).and_then(|entry| entry.tool.clone());
            let tool = tool.and_then(|tool| results.tools.get(&tool).cloned());
            job(
                Lane::Compute,
                "Contact mask".into(),
                Box::new(move |_| {
                    let imprint = imprint.get().ok_or_else(gone)?;
                    let inputs = MaskInputs { sample: &sample, tool: tool.as_deref().map(|t| &t.model), labels: None };
                    let mask = mask::without_model(&recipe, imprint, touch.finger, inputs)?;
                    Ok(Computed::Mask(Box::new(mask)))
                }),
            )
        }
        Request::Cloud(key) => {
            let mut parts: PerPad<(Imprint, Option<Arc<Mask>>)> = PerPad::default();
            let mut pair = None;
            for (finger, (imprint_key, version)) in key.parts.entries() {
                pair = Some(imprint_key.touch().pair);
                let mask = match version {
                    None => None,
                    Some(version) => Some(mask_of(state, imprint_key, version)?),
                };
                parts[finger] = Some((imprint_of(state, imprint_key)?, mask));
            }
            let sample = results.samples.get(&pair?)?.clone();
            job(
                Lane::Compute,
                "Point cloud".into(),
                Box::new(move |_| {
                    let parts = parts.as_ref().map(|part| {
                        let (imprint, mask) = part?;
                        Some((imprint.get()?, mask.as_deref()))
                    });
                    Ok(Computed::Cloud(Arc::new(cloud::clouds(&sample, &parts)?)))
                }),
            )
        }
        Request::Pose(key) => {
            let clouds = results.clouds.get(&key.cloud)?.clone();
            let tool = results.tools.get(&key.tool.to_string())?.clone();
            let pair = key.cloud.parts.iter().flatten().next()?.0.touch().pair;
            let truth = results.samples.get(&pair)?.grasp_from_object;
            let engine = key.engine;
            job(
                Lane::Compute,
                "Pose".into(),
                Box::new(move |_| {
                    let (points, registration) = (clouds.contact_points(), engine.registration());
                    let found = pose::pose(&points, &tool.model, &*registration, Ask::default(), truth)?;
                    Ok(Computed::Pose(Arc::new(found)))
                }),
            )
        }
        Request::Run(RunKey { pose: key, start }) => {
            let clouds = results.clouds.get(&key.cloud)?.clone();
            let tool = results.tools.get(&key.tool.to_string())?.clone();
            let pair = key.cloud.parts.iter().flatten().next()?.0.touch().pair;
            let truth = results.samples.get(&pair)?.grasp_from_object;
            let (engine, start) = (key.engine, start.map(|bits| bits.get()));
            job(
                Lane::Compute,
                "Registration, recorded".into(),
                Box::new(move |_| {
                    let ask = Ask { starts: start.as_ref().map(std::slice::from_ref), record: true };
                    let (points, registration) = (clouds.contact_points(), engine.registration());
                    let run = pose::pose(&points, &tool.model, &*registration, ask, truth)?;
                    Ok(Computed::Pose(Arc::new(run)))
                }),
            )
        }
        Request::Layers(key) => {
            let clouds = results.clouds.get(&key.cloud)?.clone();
            let run = results.runs.get(&RunKey { pose: key.clone(), start: None })?.clone();
            let masks = masks_of(state, &key.cloud);
            job(
                Lane::Compute,
                "Layers of the registration".into(),
                Box::new(move |_| {
                    let masks = masks.as_ref().map(|mask| mask.map(|mask| &**mask));
                    Ok(Computed::Layers(Arc::new(layers::layers(&clouds, &masks, &run)?)))
                }),
            )
        }
        Request::Inspection(key) => {
            let clouds = results.clouds.get(&key.pose.cloud)?.clone();
            let tool = results.tools.get(&key.pose.tool.to_string())?.clone();
            let run = results.runs.get(key)?.clone();
            let engine = key.pose.engine;
            job(
                Lane::Compute,
                "Steps of the registration".into(),
                Box::new(move |_| {
                    let points = clouds.contact_points();
                    Ok(Computed::Inspection(Arc::new(Inspection::new(run, points, &tool.model, engine))))
                }),
            )
        }
        Request::Basin(key) => {
            let clouds = results.clouds.get(&key.pose.cloud)?.clone();
            let tool = results.tools.get(&key.pose.tool.to_string())?.clone();
            let (engine, plane) = (key.pose.engine, key.plane);
            job(
                Lane::Compute,
                "Basin map".into(),
                Box::new(move |cx| {
                    let points = clouds.contact_points();
                    Ok(Computed::Basin(Arc::new(pose::basin(&points, &tool.model, engine, plane, cx)?)))
                }),
            )
        }
    }
}

/// The masks of a cloud, by finger.
fn masks_of(state: &State, key: &CloudKey) -> PerPad<Arc<Mask>> {
    key.parts.as_ref().map(|part| {
        let (imprint, version) = part?;
        mask_of(state, imprint, version.as_ref()?)
    })
}

/// The pixels of the mask in a cloud's recipe.
fn mask_of(state: &State, imprint: &ImprintKey, version: &MaskVersion) -> Option<Arc<Mask>> {
    match version {
        MaskVersion::Auto(recipe) => {
            let key = super::super::keys::MaskKey { imprint: imprint.clone(), recipe: recipe.clone() };
            state.results.masks.get(&key).cloned()
        }
        MaskVersion::Hand(revision) => {
            let touch = imprint.touch();
            let hand = state.document.hand_mask(&pair_name(state, touch.pair)?, touch.finger)?;
            (hand.revision == *revision).then(|| hand.mask.clone())
        }
    }
}

/// An input of a job that was there when it was prepared: a defect if it ever shows.
fn gone() -> TaskError {
    TaskError::new("Compute", "the measured imprint is not there")
}
