//! The room of the dial: what a choice does to all pairs.

pub use super::state::dial::DialPairs;
pub(crate) use super::state::dial::DialState;

use std::sync::Arc;

use super::effect::{Access, Effect, Errand};
use super::services::DataSource;
use super::settings::{self, prefer};
use super::state::State;
use super::state::tasks::{Level, TaskKind};
use super::tasks;
use touch2touch_work::error::TaskError;
use touch2touch_work::job::JobCx;
use touch2touch_work::recipe::Recipe;
use touch2touch_work::sweep::{self, Dial, Setting, Sweep, SweepSetup};

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
            let (Ok(setup), Some(open)) = (state.sweep_setup(), &state.library.open) else { return };
            let source = open.source.clone();
            let title = format!("Turn the {} over {}", state.dial.dial.name().to_lowercase(), source.title());
            tasks::start(state, title, Turn { source, setup }, effects);
        }
        DialCommand::Use(setting) => {
            let before = state.dial_recipe();
            let Ok(Recipe { mask, registration, shift, .. }) = setting.put(&before) else { return };
            let change = match setting {
                Setting::Threshold(_) | Setting::Probability(_) => prefer(move |s| s.mask.choice = mask),
                Setting::Rejection(_) => prefer(move |s| s.registration = registration),
                Setting::Shift(_) => prefer(move |s| s.shift = shift),
            };
            settings::step(state, change, effects);
            if state.dial_recipe() != before {
                state.log.info(format!("{} is {} now", setting.dial().name(), setting.label()));
            }
        }
    }
}

/// Turns the dial over pairs of a data set.
pub struct Turn {
    source: Arc<dyn DataSource>,
    setup: SweepSetup,
}

impl Errand for Turn {
    type End = Arc<Sweep>;
    const KIND: TaskKind = TaskKind::Dial;

    fn run(self, access: &Access, cx: &JobCx) -> Result<Self::End, TaskError> {
        let dataset = self.source.on_disk(Self::KIND.name())?;
        sweep::sweep(dataset, &self.setup, access.services.models(), cx).map(Arc::new)
    }

    fn ended(sweep: &Self::End, state: &mut State, _: &mut Vec<Effect>) {
        if !sweep.complete {
            state.log.info("The dial was stopped: the plots hold the pairs that were done until then");
        }
        if let Some(first) = sweep.left_out.first() {
            let why = format!("the first: {}: {}", first.name, first.why);
            state.log.push(Level::Warning, format!("{} pairs were left out", sweep.left_out.len()), Some(why), None);
        }
        state.dial.result = Some(sweep.clone());
    }
}
