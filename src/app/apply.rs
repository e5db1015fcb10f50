//! [`apply`]: the only writer of the state. Pure: no files, no threads, no clock.

use super::command::{Command, rooms};
use super::effect::Effect;
use super::state::State;
use super::{
    answers, doctor, evaluate, export, follow, inspect, labels, learn, library, predict, settings, tasks, view,
    workbench,
};
use touch2touch_pipeline::labels::progress::Progress;

/// Carries a command out. What has to happen outside the state comes back.
///
/// Every command is legal in every state: one that makes no sense now changes nothing, or leaves a notice in the log.
pub fn apply(state: &mut State, command: Command) -> Vec<Effect> {
    let (mut effects, before) = (Vec::new(), state.settings.workspace);
    let preferred = matches!(command, Command::Settings(_));
    macro_rules! dispatch {
        ($( #[doc = $doc:literal] $room:ident($command:ident) in $module:ident, )*) => {
            match command { $( Command::$room(command) => $module::step(state, command, &mut effects), )* }
        };
    }
    rooms!(dispatch);
    if preferred {
        view::follow_workspace(state, before, &mut effects);
    }
    if std::mem::take(&mut state.document.marked) {
        state.document.progress = Progress::of(state.library.pairs(), &state.document.reviews);
    }
    effects
}
