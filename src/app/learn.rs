//! The room of networks that learn from the open pairs: the generator fitted to them, the mask model trained on masks.

pub use super::state::learn::{AdaptPairs, LearnForm, Network};
pub(crate) use super::state::learn::{MINUTES, MOST_HELD_OUT, STEPS, TUNING_STEPS};

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::{Access, Effect};
use super::keys::ImprintSource;
use super::pane::Pane;
use super::settings::{self, prefer};
use super::state::State;
use super::state::learn::FOLDS;
use super::state::tasks::{Level, TaskKind};
use super::state::view::UiRequest;
use super::tasks::{self, Start};
use super::{predict, recipe, results};
use touch2touch_core::dataset::PairId;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::DrawnMasks;
use touch2touch_pipeline::io::names;
use touch2touch_pipeline::job::{Curve, JobCx};
use touch2touch_pipeline::labels::{Labels, Review};
use touch2touch_pipeline::learn::adapt::{self, AdaptSetup, Adapted, HeldBack};
use touch2touch_pipeline::learn::train::{self, TrainSetup, Trained};
use touch2touch_pipeline::learn::tuning::Tuning;
use touch2touch_pipeline::steps::bundles::{self, BundleInfo, BundleKind};
use touch2touch_pipeline::steps::recipe::Recipe;

/// A command to what learns.
#[derive(Clone, Copy, Debug)]
pub enum LearnCommand {
    /// Shows the tab of a network.
    Show(Network),
    /// Changes what is asked for.
    SetForm(LearnForm),
    /// Fits the chosen generator, or trains the chosen mask model, and scores it on pairs that were left out.
    Start(Network),
    /// Keeps the fit that was refused, in the place of whatever is there.
    Keep,
    /// Takes what was made into use from now on.
    Use(Network),
}

pub(super) fn step(state: &mut State, command: LearnCommand, effects: &mut Vec<Effect>) {
    match command {
        LearnCommand::Show(network) => {
            state.learn.shown = network;
            effects.push(Effect::Ui(UiRequest::ShowPane(Pane::Adapt)));
        }
        LearnCommand::SetForm(form) => {
            state.learn.form = form.validated();
            // What is kept is of what was asked for then.
            state.learn.stopped = [None, None];
        }
        LearnCommand::Start(network) => {
            let Some(dataset) = state.library.open.as_ref().map(|open| open.source.dataset.clone()) else { return };
            let started = match network {
                Network::Generator => {
                    let Some(setup) = adapt_setup(state) else { return };
                    let title = format!("Fit to {}", dataset.title);
                    let run = move |access: &Access, cx: &JobCx| {
                        let (services, unfinished) = (&access.services, access.services.unfinished.clone());
                        // Among the models that the program looks for at its start.
                        let name = format!("fitted-to-{}", names::label(&dataset.title));
                        let out = services.models_folder.as_ref().map(|folder| folder.join(name));
                        let setup = AdaptSetup { out, unfinished, ..setup };
                        Learned::fit(adapt::adapt(&dataset, &setup, &services.models, cx)?)
                    };
                    tasks::start(state, start(title, network.what()), effects, run, learned)
                }
                Network::Masks => {
                    let Some(setup) = train_setup(state) else { return };
                    let changed = state.document.labels.clone();
                    let run = move |access: &Access, cx: &JobCx| {
                        let (services, unfinished) = (&access.services, access.services.unfinished.clone());
                        let models = services.models_folder.as_deref().ok_or_else(|| {
                            TaskError::new(network.what(), "this system names no folder for models")
                                .with_hint("Train with touch2touch masks train --out FOLDER.")
                        })?;
                        let setup = TrainSetup { out: train::new_folder(models, &dataset), unfinished, ..setup };
                        let masks = DrawnMasks { labels: &Labels::of(&dataset), changed: &changed };
                        let trained = train::train(&dataset, &masks, &setup, &services.models, cx)?;
                        let bundle = bundles::open("Open the trained bundle", trained.bundle.as_path())?;
                        Ok(Learned::Masks(Arc::new(trained), bundle))
                    };
                    tasks::start(state, start(network.what(), network.what()), effects, run, learned)
                }
            };
            if started.is_some() {
                state.learn.started = network;
                state.learn.stopped[network as usize] = None;
            }
        }
        LearnCommand::Keep => {
            let Some(adapted) = state.learn.refused().cloned() else { return };
            let run = move |_: &Access, _: &JobCx| Learned::fit(adapt::keep(&adapted)?);
            tasks::start(state, start("Keep the fit", "Keep the fit"), effects, run, learned);
        }
        LearnCommand::Use(network) => take_up(state, network, effects),
    }
}

/// Predicts, or makes automatic masks, with what was made, what is on screen at once.
fn take_up(state: &mut State, network: Network, effects: &mut Vec<Effect>) {
    let Some(name) = made(state, network).map(|bundle| bundle.name.clone()) else { return };
    let bundle = Some(name.clone());
    let change = prefer(move |s| match network {
        Network::Generator => s.generate.bundle.clone_from(&bundle),
        Network::Masks => s.mask.bundle.clone_from(&bundle),
    });
    settings::step(state, change, effects);
    match network {
        // What is on screen is of the model before.
        Network::Generator if results::can_generate(state).is_ok() => predict::same_seed(state, effects),
        Network::Generator => {}
        Network::Masks => state.log.info(format!("Automatic masks now come from {name}")),
    }
}

/// A network that learns, in these words.
fn start(title: impl Into<String>, what: &str) -> Start {
    Start { what: what.to_owned(), ..Start::new(TaskKind::Learn, title) }
}

/// Result of a training or a fit.
pub enum Learned {
    /// The fit, and its bundle where one was written.
    Generator(Arc<Adapted>, Option<BundleInfo>),
    /// The training and its bundle.
    Masks(Arc<Trained>, BundleInfo),
}

impl Learned {
    /// A fit, with its bundle.
    fn fit(adapted: Adapted) -> Result<Self, TaskError> {
        let open = |folder| bundles::open("Open the fitted bundle", folder);
        let bundle = adapted.bundle.as_deref().map(open).transpose()?;
        Ok(Self::Generator(Arc::new(adapted), bundle))
    }
}

/// Lists the bundle among the others. A trained mask model takes the place of the one in force, unless it is worse than that
/// on pairs that were left out.
pub fn learned(end: &Learned, state: &mut State, effects: &mut Vec<Effect>) {
    match end {
        Learned::Generator(adapted, bundle) => {
            if let Some(bundle) = bundle {
                state.log.info(format!("Fitted: {} ({})", bundle.name, bundle.origin));
                add(state, Network::Generator, bundle);
            }
            for reason in adapted.refused() {
                state.log.push(Level::Warning, "The fit was not kept", Some(reason.to_owned()), None);
            }
            state.learn.adapted = Some(adapted.clone());
            state.learn.stopped[Network::Generator as usize] = None;
        }
        Learned::Masks(trained, bundle) => {
            let scores = match (trained.before, trained.after) {
                (Some(before), Some(after)) => {
                    format!(", IoU {:.3} (was {:.3}) on other pairs", after.iou, before.iou)
                }
                _ => String::new(),
            };
            state.log.saved(format!("Trained: {}{scores}", bundle.name), trained.bundle.clone());
            add(state, Network::Masks, bundle);
            if trained.is_worse() {
                let hint = "Train longer or on more masks; \"Use the new model\" uses it anyway.";
                let text = "The trained mask model is worse on other pairs and is not used";
                state.log.push(Level::Warning, text, None, Some(hint.into()));
            } else {
                take_up(state, Network::Masks, effects);
            }
            state.learn.trained = Some(trained.clone());
        }
    }
}
/// Adds a bundle to the list; one that was made again takes the place of the one before.
fn add(state: &mut State, network: Network, bundle: &BundleInfo) {
    state.learn.bundles[network as usize] = Some(bundle.id.clone());
    state.library.bundles.retain(|known| known.origin != bundle.origin && known.id != bundle.id);
    state.library.bundles.push(bundle.clone());
}

/// The pairs that a fit started now would take.
pub(crate) fn pairs(state: &State) -> Box<dyn Iterator<Item = PairId> + '_> {
    let Some(open) = &state.library.open else { return Box::new(std::iter::empty()) };
    let pairs = &open.source.dataset.index.pairs;
    let all = (0..pairs.len() as u32).map(PairId);
    match state.learn.form.pairs {
        AdaptPairs::All => Box::new(all),
        AdaptPairs::Done => {
            Box::new(all.filter(|id| state.document.review(&pairs[id.0 as usize].name) == Review::Done))
        }
        AdaptPairs::Listed => Box::new(state.library.order.iter().copied()),
    }
}

/// The generator that is fitted: the chosen one, or the one that it was fitted from.
pub(super) fn to_be_fitted(state: &State) -> Option<&BundleInfo> {
    let chosen = recipe::bundle(state, BundleKind::Generator).ok()?;
    match chosen.fit() {
        Some(fit) => state.library.bundle(&fit.from_sha256),
        None => Some(chosen),
    }
}

/// True where there is something that can learn, and something to learn from, and nothing learns.
pub(crate) fn can_start(state: &State, network: Network) -> bool {
    state.tasks.of_kind(TaskKind::Learn).is_none()
        && match network {
            Network::Generator => to_be_fitted(state).is_some() && pairs(state).next().is_some(),
            Network::Masks => train_setup(state).is_some(),
        }
}

/// The setup of a fit started now; `None` without data, pairs or a depth generator.
pub fn adapt_setup(state: &State) -> Option<AdaptSetup> {
    let bundle = to_be_fitted(state)?.clone();
    pairs(state).next()?;
    Some(AdaptSetup {
        recipe: Recipe {
            generator: Some((bundle.clone().into(), state.settings.generate.config(&bundle))),
            ..recipe::in_force(state, ImprintSource::Predicted)
        },
        pairs: pairs(state).collect(),
        folds: FOLDS,
        tuning: state.learn.form.tune.then_some(Tuning::Steps(state.learn.form.tuning_steps)),
        unfinished: None,
        out: None,
        force: false,
        replace: false,
    })
}

/// The setup of a training started now; `None` without data or a mask model. Where the new bundle lies is not the
/// state's to say.
fn train_setup(state: &State) -> Option<TrainSetup> {
    state.library.open.as_ref()?;
    let generators = state.library.bundles.iter().filter(|bundle| bundle.kind == BundleKind::Generator);
    Some(TrainSetup {
        start: recipe::bundle(state, BundleKind::Mask).ok()?.clone(),
        generators: generators.cloned().collect(),
        engine: state.settings.runtime,
        registration: state.settings.registration,
        choice: state.learn.form.choice,
        tuning: state.learn.form.tuning(),
        unfinished: None,
        out: PathBuf::new(),
    })
}

/// The curves of a run, or of the last one.
pub(crate) fn curves(state: &State, network: Network) -> &[Curve] {
    match (state.tasks.of_kind(TaskKind::Learn), network) {
        (Some((_, task)), _) if state.learn.started == network => &task.progress.curves,
        (_, Network::Generator) => state.learn.adapted.as_ref().map_or(&[], |adapted| &adapted.curves),
        (_, Network::Masks) => state.learn.trained.as_ref().map_or(&[], |trained| &trained.curves),
    }
}

/// The chosen touch as the model drew it before and after the fit; the first one where the chosen one is not among
/// those that were left out.
pub fn held_back(state: &State) -> Option<&HeldBack> {
    let all = &state.learn.adapted.as_ref()?.held_back;
    let of_pair = || all.iter().filter(|held| Some(held.pair) == state.selection.pair);
    of_pair().find(|held| held.pad == state.selection.finger).or_else(|| of_pair().next()).or_else(|| all.first())
}

/// The bundle that was made on the open data set.
pub fn made(state: &State, network: Network) -> Option<&BundleInfo> {
    state.library.bundle(state.learn.bundles[network as usize].as_deref()?)
}

/// True where that bundle is what is in use now.
pub fn in_use(state: &State, network: Network) -> bool {
    let now = recipe::bundle(state, network.kind()).ok().map(|bundle| &bundle.id);
    made(state, network).is_some_and(|made| Some(&made.id) == now)
}
