//! The room of the dial: what a choice does to all pairs.

pub mod state;

pub use state::{DialPairs, DialState};

use std::sync::Arc;

use super::effect::Effect;
use super::settings::{self, MaskSettings, SettingsCommand};
use super::state::State;
use super::tasks::state::{Level, Ticket};
use touch2touch_work::recipe::Recipe;
use touch2touch_work::sweep::{Dial, Setting, Sweep};

/// What can happen to the dial.
#[derive(Clone, Copy, Debug)]
pub enum DialCommand {
    /// Which one is turned.
    Choose(Dial),
    /// From where to where, in the dial's unit, in how many values.
    Range([f64; 2], usize),
    /// Over which pairs.
    Over(DialPairs),
    /// Whether the predictions are posed as well, or only what was measured.
    Predictions(bool),
    /// Turns it.
    Start,
    /// Puts a value in force.
    Use(Setting),
}

pub(super) fn step(state: &mut State, command: DialCommand, effects: &mut Vec<Effect>) {
    match command {
        DialCommand::Choose(dial) => {
            let (first, last, count) = dial.usual();
            (state.dial.dial, state.dial.range, state.dial.count) = (dial, [first, last], count);
        }
        DialCommand::Range(range, count) => {
            if range.iter().all(|end| end.is_finite()) {
                (state.dial.range, state.dial.count) = (range, count);
            }
        }
        DialCommand::Over(pairs) => state.dial.pairs = pairs,
        DialCommand::Predictions(predictions) => state.dial.predictions = predictions,
        DialCommand::Start => {
            if state.turning().is_some() {
                return;
            }
            let (Ok(setup), Some(open)) = (state.sweep_setup(), &state.library.open) else { return };
            let source = open.source.clone();
            let name = state.dial.dial.name().to_lowercase();
            let ticket = state.tasks.start(format!("Turn the {name} over {}", source.title()), Vec::new());
            state.dial.running = Some(ticket);
            effects.push(Effect::Sweep { ticket, source, setup: Box::new(setup) });
        }
        DialCommand::Use(setting) => {
            let before = state.dial_recipe();
            let Ok(Recipe { mask, registration, shift, .. }) = setting.put(&before) else { return };
            let change = match setting {
                Setting::Threshold(_) | Setting::Probability(_) => {
                    SettingsCommand::SetMask(MaskSettings { choice: mask, ..state.settings.mask.clone() })
                }
                Setting::Rejection(_) => SettingsCommand::SetPoseEngine(registration),
                Setting::Shift(_) => SettingsCommand::SetShift(shift),
            };
            settings::step(state, change, effects);
            if state.dial_recipe() != before {
                state.log.info(format!("{} is {} now", setting.dial().name(), setting.label()));
            }
        }
    }
}

/// Shows what the dial does; one that another data set's opening stopped has nowhere to be shown.
pub(super) fn arrived(state: &mut State, ticket: Ticket, sweep: Arc<Sweep>) {
    if state.dial.running.take_if(|running| *running == ticket).is_none() {
        return;
    }
    if !sweep.complete {
        state.log.info("The dial was stopped: the plots hold the pairs that were done until then");
    }
    if let Some(first) = sweep.left_out.first() {
        let why = format!("the first: {}: {}", first.name, first.why);
        state.log.push(Level::Warning, format!("{} pairs were left out", sweep.left_out.len()), Some(why), None);
    }
    state.dial.result = Some(sweep);
}
