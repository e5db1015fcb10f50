//! The room of fitting a generator to one's own pairs.

pub use super::state::adapt::AdaptPairs;
pub(crate) use super::state::adapt::AdaptState;
pub(crate) use super::state::adapt::TUNING_STEPS;

use std::sync::Arc;

use super::effect::{Access, Effect, Errand};
use super::services::DataSource;
use super::settings::{self, prefer};
use super::state::State;
use super::state::tasks::{Level, TaskKind};
use super::tasks;
use touch2touch_work::adapt::{self, AdaptSetup, Adapted};
use touch2touch_work::bundles::{self, BundleInfo};
use touch2touch_work::error::TaskError;
use touch2touch_work::io::names;
use touch2touch_work::job::JobCx;

/// What can happen to the fit.
#[derive(Clone, Copy, Debug)]
pub enum AdaptCommand {
    /// Which pairs are fitted.
    Choose(AdaptPairs),
    /// Whether the networks themselves are tuned as well.
    Tune(bool),
    /// With how many steps.
    Steps(u32),
    /// Fits the chosen generator to them, and scores it on pairs that were left out.
    Start,
    /// Keeps the fit that was refused, in the place of whatever is there.
    Keep,
    /// Predicts with the fitted model from now on.
    Use,
}

pub(super) fn step(state: &mut State, command: AdaptCommand, effects: &mut Vec<Effect>) {
    match command {
        AdaptCommand::Choose(pairs) => state.adapt.pairs = pairs,
        AdaptCommand::Tune(tune) => state.adapt.tune = tune,
        AdaptCommand::Steps(steps) => {
            state.adapt.steps = steps.clamp(*TUNING_STEPS.start(), *TUNING_STEPS.end());
        }
        AdaptCommand::Start => {
            let (Some(setup), Some(open)) = (state.adapt_setup(), &state.library.open) else { return };
            let source = open.source.clone();
            tasks::start(
                state,
                format!("Fit to {}", source.title()),
                Fit::New { source, setup: Box::new(setup) },
                effects,
            );
        }
        AdaptCommand::Keep => {
            let Some(adapted) = state.refused_fit().cloned() else { return };
            tasks::start(state, "Keep the fit", Fit::Refused(adapted), effects);
        }
        AdaptCommand::Use => {
            let Some(name) = state.fitted().map(|bundle| bundle.name.clone()) else { return };
            settings::step(state, prefer(move |s| s.generate.bundle = Some(name.clone())), effects);
        }
    }
}

/// Fits a generator to pairs.
pub enum Fit {
    /// Anew, where the program keeps models.
    New {
        /// The data.
        source: Arc<dyn DataSource>,
        /// What to what.
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
    }
}
