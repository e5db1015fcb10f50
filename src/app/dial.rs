//! The room of the dial: what a choice does to all pairs.

pub use super::state::dial::DialPairs;
pub(crate) use super::state::dial::DialState;

use std::sync::Arc;

use super::effect::{Access, Effect, Errand};
use super::keys::ImprintSource;
use super::settings::{self, prefer};
use super::source::DataSource;
use super::state::State;
use super::state::tasks::{Level, TaskKind};
use super::{recipe, tasks};
use touch2touch_core::dataset::PairId;
use touch2touch_work::error::TaskError;
use touch2touch_work::job::JobCx;
use touch2touch_work::pairs;
use touch2touch_work::recipe::Recipe;
use touch2touch_work::sweep::{self, Dial, Setting, Sweep, SweepSetup};

/// A command to the dial.
#[derive(Clone, Copy, Debug)]
pub enum DialCommand {
    /// The dial that is turned.
    Choose(Dial),
    /// From where to where, in the dial's unit, in how many values.
    Range([f64; 2], usize),
    /// Over which pairs.
    Over(DialPairs),
    /// True where the predictions are posed as well; else only what was measured.
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
            let (Ok(setup), Some(open)) = (setup(state), &state.library.open) else { return };
            let source = open.source.clone();
            let title = format!("Turn the {} over {}", state.dial.dial.name().to_lowercase(), source.title());
            tasks::start(state, title, Turn { source, setup }, effects);
        }
        DialCommand::Use(setting) => {
            let before = recipe(state);
            let Ok(Recipe { mask, registration, shift, .. }) = setting.put(&before) else { return };
            let change = match setting {
                Setting::Threshold(_) | Setting::Probability(_) => prefer(move |s| s.mask.choice = mask),
                Setting::Rejection(_) => prefer(move |s| s.registration = registration),
                Setting::Shift(_) => prefer(move |s| s.shift = shift),
            };
            settings::step(state, change, effects);
            if recipe(state) != before {
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

/// The recipe that the dial changes; without a generator where the predictions are left out.
pub(crate) fn recipe(state: &State) -> Recipe {
    let recipe = recipe::in_force(state, ImprintSource::Measured);
    Recipe { generator: recipe.generator.filter(|_| state.dial.predictions), ..recipe }
}

/// The pairs that a dial turned now would go over.
pub(crate) fn pairs(state: &State) -> Vec<PairId> {
    let len = state.library.open.as_ref().map_or(0, |open| open.source.index().pairs.len());
    match state.dial.pairs {
        DialPairs::Spread(count) => pairs::spread(len, Some(count)).map(|at| PairId(at as u32)).collect(),
        DialPairs::All => (0..len as u32).map(PairId).collect(),
        DialPairs::Listed => state.library.order.clone(),
    }
}

/// The sweep that a dial turned now would do.
///
/// # Errors
/// Why it cannot be turned, in words.
pub(crate) fn setup(state: &State) -> Result<SweepSetup, String> {
    let DialState { dial, range: [first, last], count, .. } = state.dial;
    if state.library.open.is_none() {
        return Err("No data set is open".into());
    }
    let (values, recipe) = (dial.spread(first, last, count)?, recipe(state));
    for value in &values {
        value.put(&recipe)?;
    }
    let pairs = pairs(state);
    if pairs.is_empty() {
        return Err("There are no pairs to turn it over".into());
    }
    if dial == Dial::Probability && recipe.mask_model.is_none() {
        return Err("There is no mask model".into());
    }
    if dial == Dial::Shift && recipe.generator.is_none() {
        return Err("A shift is of predictions, and they are left out".into());
    }
    Ok(SweepSetup { values, pairs, recipe })
}

/// True where a value of the last turn is what is in force now; `at`: whether it was when the dial was turned.
pub(crate) fn is_dialed(state: &State, value: Setting, at: bool) -> bool {
    let now = recipe(state);
    let then = state.dial.result.as_ref().map(|result| &result.in_force);
    value.put(&now).as_ref() == Ok(&now) || (at && then == Some(&now))
}

/// True where something other than the dial was changed since it was turned.
pub(crate) fn is_outdated(state: &State) -> bool {
    let Some(result) = &state.dial.result else { return false };
    let value = result.series.first().and_then(|series| series.points.first()?.value);
    value.is_some_and(|value| value.put(&recipe(state)) != value.put(&result.in_force))
}
