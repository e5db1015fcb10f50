//! The room of fitting a generator to one's own pairs.

pub use super::state::adapt::AdaptPairs;
pub(crate) use super::state::adapt::{AdaptState, TUNING_STEPS};

use std::sync::Arc;

use super::effect::{Access, Effect, Errand};
use super::keys::ImprintSource;
use super::settings::{self, prefer};
use super::source::DataSource;
use super::state::State;
use super::state::adapt::FOLDS;
use super::state::tasks::{Level, TaskKind};
use super::{predict, recipe, results, tasks};
use touch2touch_core::dataset::PairId;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::names;
use touch2touch_pipeline::job::{Curve, JobCx};
use touch2touch_pipeline::labels::Review;
use touch2touch_pipeline::learn::adapt::{self, AdaptSetup, Adapted, HeldBack};
use touch2touch_pipeline::learn::tuning::Tuning;
use touch2touch_pipeline::steps::bundles::{self, BundleInfo, BundleKind};
use touch2touch_pipeline::steps::recipe::Recipe;

/// A command to the fit.
#[derive(Clone, Copy, Debug)]
pub enum AdaptCommand {
    /// The pairs that are fitted.
    Choose(AdaptPairs),
    /// True where the networks themselves are tuned as well.
    Tune(bool),
    /// With how many steps.
    Steps(u32),
    /// Fits the chosen generator to them, and scores it on pairs that were left out.
    Start,
    /// Keeps the fit that was refused, in the place of whatever is there.
    Keep,
    /// Predicts with the fitted model from now on, what is on screen at once.
    Use,
}

pub(super) fn step(state: &mut State, command: AdaptCommand, effects: &mut Vec<Effect>) {
    match command {
        AdaptCommand::Choose(pairs) => (state.adapt.pairs, state.adapt.stopped) = (pairs, None),
        AdaptCommand::Tune(tune) => (state.adapt.tune, state.adapt.stopped) = (tune, None),
        AdaptCommand::Steps(steps) => {
            state.adapt.stopped = None;
            state.adapt.steps = steps.clamp(*TUNING_STEPS.start(), *TUNING_STEPS.end());
        }
        AdaptCommand::Start => {
            let (Some(setup), Some(open)) = (setup(state), &state.library.open) else { return };
            let source = open.source.clone();
            state.adapt.stopped = None;
            tasks::start(
                state,
                format!("Fit to {}", source.title()),
                Fit::New { source, setup: Box::new(setup) },
                effects,
            );
        }
        AdaptCommand::Keep => {
            let Some(adapted) = state.adapt.refused().cloned() else { return };
            tasks::start(state, "Keep the fit", Fit::Refused(adapted), effects);
        }
        AdaptCommand::Use => {
            let Some(name) = fitted(state).map(|bundle| bundle.name.clone()) else { return };
            settings::step(state, prefer(move |s| s.generate.bundle = Some(name.clone())), effects);
            // What is on screen is of the model before.
            if results::can_generate(state).is_ok() {
                predict::same_seed(state, effects);
            }
        }
    }
}

/// Fits a generator to pairs.
pub enum Fit {
    /// Anew, where the program keeps models.
    New {
        /// The data.
        source: Arc<dyn DataSource>,
        /// The two scores, before and after.
        setup: Box<AdaptSetup>,
    },
    /// As it was done before and refused: only writes it.
    Refused(Arc<Adapted>),
}

impl Errand for Fit {
    /// The fit, and its bundle where one was written.
    type End = (Arc<Adapted>, Option<BundleInfo>);
    const KIND: TaskKind = TaskKind::Fit;

    fn what(&self) -> String {
        match self {
            Self::New { .. } => Self::KIND.name().to_owned(),
            Self::Refused(_) => "Keep the fit".to_owned(),
        }
    }

    fn run(self, access: &Access, cx: &JobCx) -> Result<Self::End, TaskError> {
        let services = &access.services;
        let adapted = match self {
            Self::Refused(adapted) => adapt::keep(&adapted)?,
            Self::New { source, setup } => {
                let dataset = source.on_disk(Self::KIND.name())?;
                // Among the models that the program looks for at its start.
                let name = format!("fitted-to-{}", names::label(&dataset.title));
                let out = services.models_folder().map(|folder| folder.join(name));
                let unfinished = services.unfinished_folder().map(Into::into);
                adapt::adapt(dataset, &AdaptSetup { out, unfinished, ..*setup }, services.models(), cx)?
            }
        };
        let open = |folder| bundles::open("Open the fitted bundle", folder);
        let bundle = adapted.bundle.as_deref().map(open).transpose()?;
        Ok((Arc::new(adapted), bundle))
    }

    fn ended((adapted, bundle): &Self::End, state: &mut State, _: &mut Vec<Effect>) {
        if let Some(bundle) = bundle {
            state.log.info(format!("Fitted: {} ({})", bundle.name, bundle.origin));
            state.adapt.bundle = Some(bundle.id.clone());
            // A fit that was made again takes the place of the one before.
            state.library.bundles.retain(|known| known.origin != bundle.origin);
            state.library.bundles.push(bundle.clone());
        }
        for reason in adapted.refused() {
            state.log.push(Level::Warning, "The fit was not kept".to_owned(), Some(reason.to_owned()), None);
        }
        state.adapt.result = Some(adapted.clone());
        state.adapt.stopped = None;
    }
}

/// The pairs that a fit started now would take.
pub(crate) fn pairs(state: &State) -> Box<dyn Iterator<Item = PairId> + '_> {
    let Some(open) = &state.library.open else { return Box::new(std::iter::empty()) };
    let pairs = &open.source.index().pairs;
    let all = (0..pairs.len() as u32).map(PairId);
    match state.adapt.pairs {
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

/// True where there is something to fit, and pairs to fit it to.
pub(crate) fn can_adapt(state: &State) -> bool {
    to_be_fitted(state).is_some() && pairs(state).next().is_some()
}

/// The setup of a fit started now; `None` without data, pairs or a depth generator.
pub fn setup(state: &State) -> Option<AdaptSetup> {
    let bundle = to_be_fitted(state)?.clone();
    can_adapt(state).then(|| AdaptSetup {
        recipe: Recipe {
            generator: Some((bundle.clone().into(), state.settings.generate.config(&bundle))),
            ..recipe::in_force(state, ImprintSource::Predicted)
        },
        pairs: pairs(state).collect(),
        folds: FOLDS,
        tuning: state.adapt.tune.then_some(Tuning::Steps(state.adapt.steps)),
        unfinished: None,
        out: None,
        force: false,
        replace: false,
    })
}

/// The curves of the tuning, or of the last one.
pub(crate) fn tuning_curves(state: &State) -> &[Curve] {
    match (state.tasks.of_kind(TaskKind::Fit), &state.adapt.result) {
        (Some((_, task)), _) => &task.progress.curves,
        (None, Some(result)) => &result.curves,
        (None, None) => &[],
    }
}

/// The chosen touch as the model drew it before and after the fit; the first one where the chosen one is not among
/// those that were left out.
pub fn held_back(state: &State) -> Option<&HeldBack> {
    let all = &state.adapt.result.as_ref()?.held_back;
    let of_pair = || all.iter().filter(|held| Some(held.pair) == state.selection.pair);
    of_pair().find(|held| held.pad == state.selection.finger).or_else(|| of_pair().next()).or_else(|| all.first())
}

/// True where the last fit is what predicts now.
pub(crate) fn uses_fit(state: &State) -> bool {
    let now = recipe::bundle(state, BundleKind::Generator).ok().map(|bundle| &bundle.id);
    fitted(state).is_some_and(|fitted| Some(&fitted.id) == now)
}

/// The bundle that was fitted to the open data set.
pub fn fitted(state: &State) -> Option<&BundleInfo> {
    state.library.bundle(state.adapt.bundle.as_deref()?)
}
