//! The room of fitting a generator to one's own pairs.

pub mod state;

pub use state::{AdaptPairs, AdaptState, TUNING_STEPS};

use std::sync::Arc;

use super::effect::Effect;
use super::settings::{self, SettingsCommand, state::GenerateSettings};
use super::state::State;
use super::tasks::state::{Level, Ticket};
use touch2touch_work::adapt::Adapted;
use touch2touch_work::bundles::BundleInfo;

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
            if state.adapting().is_some() {
                return;
            }
            let (Some(setup), Some(open)) = (state.adapt_setup(), &state.library.open) else { return };
            let source = open.source.clone();
            let ticket = state.tasks.start(format!("Fit to {}", source.title()), Vec::new());
            state.adapt.running = Some(ticket);
            effects.push(Effect::Adapt { ticket, source, setup: Box::new(setup) });
        }
        AdaptCommand::Keep => {
            let Some(adapted) = state.refused_fit().filter(|_| state.adapting().is_none()).cloned() else { return };
            let ticket = state.tasks.start("Keep the fit".to_owned(), Vec::new());
            state.adapt.running = Some(ticket);
            effects.push(Effect::KeepFit { ticket, adapted });
        }
        AdaptCommand::Use => {
            let Some(name) = state.fitted().map(|bundle| bundle.name.clone()) else { return };
            let generate = GenerateSettings { bundle: Some(name), ..state.settings.generate.clone() };
            settings::step(state, SettingsCommand::SetGenerate(generate), effects);
        }
    }
}

/// Keeps a fit, and its bundle among the others; one that another data set's opening stopped has nowhere to be shown.
pub(super) fn arrived(state: &mut State, ticket: Ticket, adapted: Arc<Adapted>, bundle: Option<BundleInfo>) {
    if state.adapt.running.take_if(|running| *running == ticket).is_none() {
        return;
    }
    if let Some(bundle) = bundle {
        state.log.info(format!("Fitted: {} ({})", bundle.name, bundle.origin));
        state.adapt.bundle = Some(bundle.id.clone());
        // A fit that was made again takes the place of the one before.
        state.library.bundles.retain(|known| known.origin != bundle.origin);
        state.library.bundles.push(bundle);
    }
    for reason in adapted.refused() {
        state.log.push(Level::Warning, "The fit was not kept".to_owned(), Some(reason.to_owned()), None);
    }
    state.adapt.result = Some(adapted);
}
