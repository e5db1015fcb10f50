//! [`apply`]: the only writer of the state. Pure: no files, no threads, no clock.

use super::command::Command;
use super::effect::Effect;
use super::state::State;
use super::{
    adapt, answers, dial, evaluate, export, follow, inspect, labels, library, predict, seeds, settings, tasks, train,
    view, workbench,
};

/// Carries a command out. What has to happen outside the state comes back.
///
/// Every command is legal in every state: one that makes no sense now changes nothing, or leaves a notice in the log.
pub fn apply(state: &mut State, command: Command) -> Vec<Effect> {
    let mut effects = Vec::new();
    match command {
        Command::Library(command) => library::step(state, command, &mut effects),
        Command::Follow(command) => follow::step(state, command, &mut effects),
        Command::View(command) => view::step(state, command, &mut effects),
        Command::Predict(command) => predict::step(state, command, &mut effects),
        Command::Seeds(command) => seeds::step(state, command),
        Command::Labels(command) => labels::step(state, command, &mut effects),
        Command::Inspect(command) => inspect::step(state, command),
        Command::Workbench(command) => workbench::step(state, command, &mut effects),
        Command::Evaluate(command) => evaluate::step(state, command, &mut effects),
        Command::Export(command) => export::step(state, command, &mut effects),
        Command::Dial(command) => dial::step(state, command, &mut effects),
        Command::Adapt(command) => adapt::step(state, command, &mut effects),
        Command::Train(command) => train::step(state, command, &mut effects),
        Command::Settings(command) => {
            let before = state.settings.workspace;
            settings::step(state, command, &mut effects);
            view::follow_workspace(state, before, &mut effects);
        }
        Command::Tasks(command) => tasks::step(state, command, &mut effects),
        Command::Answer(answer) => answers::step(state, answer, &mut effects),
    }
    effects
}
