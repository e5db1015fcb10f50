//! The room of training a mask model on the masks that people corrected.

pub mod state;

pub use state::{MINUTES, STEPS, TrainForm, TrainState};

use std::sync::Arc;

use super::effect::Effect;
use super::settings::{self, SettingsCommand, state::MaskSettings};
use super::state::State;
use super::tasks::state::{Level, Ticket};
use touch2touch_work::bundles::BundleInfo;
use touch2touch_work::train::Trained;

/// What can happen to the training.
#[derive(Clone, Copy, Debug)]
pub enum TrainCommand {
    /// Changes what is asked for.
    SetForm(TrainForm),
    /// Trains the chosen mask model on the masks of pairs marked done.
    Start,
    /// Makes automatic masks with the trained model from now on.
    Use,
}

pub(super) fn step(state: &mut State, command: TrainCommand, effects: &mut Vec<Effect>) {
    match command {
        TrainCommand::SetForm(form) => state.train.form = form.validated(),
        TrainCommand::Start => {
            if state.training().is_some() {
                return;
            }
            let (Some(setup), Some(open)) = (state.train_setup(), &state.library.open) else { return };
            let source = open.source.clone();
            let ticket = state.tasks.start("Train the mask model".into(), Vec::new());
            state.train.running = Some(ticket);
            let labels = state.document.labels.clone();
            effects.push(Effect::Train { ticket, source, labels, setup: Box::new(setup) });
        }
        TrainCommand::Use => take_up(state, effects),
    }
}

/// Makes automatic masks with the trained model.
fn take_up(state: &mut State, effects: &mut Vec<Effect>) {
    let Some(name) = state.trained().map(|bundle| bundle.name.clone()) else { return };
    let mask = MaskSettings { bundle: Some(name.clone()), ..state.settings.mask.clone() };
    settings::step(state, SettingsCommand::SetMask(mask), effects);
    state.log.info(format!("Automatic masks are made by {name} from now on"));
}

/// Keeps a training and puts its bundle in the place of the mask model in force, unless it is worse than that on pairs that
/// were left out. One that another data set's opening stopped has nowhere to be shown.
pub(super) fn arrived(
    state: &mut State,
    ticket: Ticket,
    trained: Arc<Trained>,
    bundle: BundleInfo,
    effects: &mut Vec<Effect>,
) {
    if state.train.running.take_if(|running| *running == ticket).is_none() {
        return;
    }
    let scores = match (trained.before, trained.after) {
        (Some(before), Some(after)) => format!(", IoU {:.3} instead of {:.3} on other pairs", after.iou, before.iou),
        _ => String::new(),
    };
    state.log.saved(format!("Trained: {}{scores}", bundle.name), trained.bundle.clone());
    state.train.bundle = Some(bundle.id.clone());
    state.library.bundles.retain(|known| known.origin != bundle.origin && known.id != bundle.id);
    state.library.bundles.push(bundle);
    if trained.is_worse() {
        let hint = "Train it for longer or on more masks; \"Use the trained mask model\" takes it all the same.";
        let text = "The trained mask model is worse on other pairs, and was not taken into use";
        state.log.push(Level::Warning, text, None, Some(hint.into()));
    } else {
        take_up(state, effects);
    }
    state.train.result = Some(trained);
}
