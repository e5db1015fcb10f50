//! The words of the rows of actions: the command that an [`Action`] is now.

use strum::IntoEnumIterator;

use super::action::{Action, actions};
use super::command::{
    CameraPreset, Command, DoctorCommand, EvaluateCommand, ExportCommand, FollowCommand, InspectCommand, LabelsCommand,
    LearnCommand, LibraryCommand, Pane, PredictCommand, SettingsCommand, TasksCommand, UiRequest, ViewCommand,
    WorkbenchCommand,
};
use super::keys::ImprintSource;
use super::learn::{self, Network};
use super::settings::prefer;
use super::state::export::Output;
use super::state::inspect::Inspected;
use super::state::labels::Review;
use super::state::library::Place;
use super::state::settings::MaskTool;
use super::state::tasks::TaskKind;
use super::state::view::Purpose;
use super::state::workbench::{Layer, SceneTool};
use super::state::{Absent, State};
use super::workbench::{self, in_hand};
use super::{export, results};
use touch2touch_core::label::{CleanKind, Paint};

/// Factor by which a key press changes the brush.
const BRUSH_STEP: f32 = 1.25;

macro_rules! commands {
    ($( $name:ident, $group:ident, $label:literal, $tooltip:literal, [$($shortcut:tt)*], $state:pat => $does:expr; )*) => {
        impl Action {
            /// The command that it is now; `None` = it cannot do anything now (grayed out).
            pub fn command(self, state: &State) -> Option<Command> {
                match self { $( Self::$name => {
                    let $state = state;
                    $does
                } )* }
            }
        }
    };
}
actions!(commands);

impl Absent {
    /// The action that brings it, if one does.
    pub fn action(self) -> Option<Action> {
        match self {
            Self::NothingOpen => Some(Action::OpenDemo),
            Self::NothingSelected => Some(Action::FirstPair),
            Self::NoPrediction => Some(Action::Generate),
            _ => None,
        }
    }
}

/// Colors by distance, or no longer.
fn distances(state: &State) -> Option<Command> {
    let on = state.workbench.layer == Layer::Distance;
    does(WorkbenchCommand::SetLayer(if on { Layer::None } else { Layer::Distance }))
}

fn does(command: impl Into<Command>) -> Option<Command> {
    Some(command.into())
}

fn when(possible: bool, command: impl Into<Command>) -> Option<Command> {
    possible.then(|| command.into())
}

fn ui(request: UiRequest) -> Option<Command> {
    does(ViewCommand::Ui(request))
}

/// The command, where a data set is open.
fn opened(state: &State, command: impl Into<Command>) -> Option<Command> {
    when(state.library.open.is_some(), command)
}

/// The command, where the list has pairs.
fn listed(state: &State, command: impl Into<Command>) -> Option<Command> {
    when(!state.library.order.is_empty(), command)
}

/// The command, where a pair is selected.
fn of_pair(state: &State, command: impl Into<Command>) -> Option<Command> {
    when(state.entry().is_some(), command)
}

/// The command, where the labels of the selected pair can be changed.
fn editable(state: &State, command: impl Into<Command>) -> Option<Command> {
    when(state.document.is_editable(state.pair_name()), command)
}

/// The next of a fixed set, going round; the same where it is none of them.
fn next_of<T: IntoEnumIterator + PartialEq + Clone>(current: &T) -> T {
    let at = T::iter().position(|one| one == *current);
    at.and_then(|at| T::iter().cycle().nth(at + 1)).unwrap_or_else(|| current.clone())
}

fn clean_up(state: &State, kind: CleanKind) -> Option<Command> {
    editable(state, LabelsCommand::CleanUp(state.settings.mask.clean_up(kind)))
}

/// Has the tools paint this, or contact again.
fn paint(paint: Paint) -> SettingsCommand {
    prefer(move |s| s.mask.paint = if s.mask.paint == paint { Paint::Contact } else { paint })
}

fn follow(state: &State) -> Option<Command> {
    let folder = state.library.open.as_ref().is_some_and(|open| open.source.dataset.root.is_some());
    when(folder, FollowCommand::Set(state.library.follow.is_none()))
}

/// Takes the last corner of the open polygon back, or else the last change of what is on screen.
fn undo(state: &State) -> Option<Command> {
    let done = state.history.next_undo(state.pair_name(), &results::mask_places(state)).is_some();
    when(done || state.document.stroke.is_some(), LabelsCommand::Undo)
}

/// True where the mask of the active finger was corrected.
fn is_corrected(state: &State) -> bool {
    let finger = state.selection.finger;
    results::drawn_mask(state, results::worked_on(state, finger), finger).is_some()
}

/// Gives up what is under way: what is in hand first, jobs last.
fn cancel(state: &State) -> Option<Command> {
    if state.document.stroke.is_some() {
        does(LabelsCommand::CancelStroke)
    } else if state.export.importing.is_some() {
        does(ExportCommand::AskImport(None))
    } else if state.export.still.is_some() {
        does(ExportCommand::AskStill(None))
    } else if state.export.asking_masks {
        does(ExportCommand::AskMasks(false))
    } else if results::proposes(state) {
        does(ViewCommand::Propose(false))
    } else if let Some(command) = escape(state) {
        does(command)
    } else if state.doctor.shown {
        does(DoctorCommand::Show(false))
    } else {
        when(!state.tasks.running.is_empty(), TasksCommand::CancelAll)
    }
}

/// Closes the open polygon, or else accepts the proposal that is shown, or else the pose in hand.
fn accept_shown(state: &State) -> Option<Command> {
    if state.document.has_open_polygon() {
        return does(LabelsCommand::Close);
    }
    if results::proposes(state) {
        return editable(state, LabelsCommand::AcceptProposal);
    }
    editable(state, WorkbenchCommand::AcceptHand).filter(|_| state.workbench.hand.is_some())
}

/// Takes what a network learned into use.
fn can_use(state: &State, network: Network) -> Option<Command> {
    when(learn::made(state, network).is_some() && !learn::in_use(state, network), LearnCommand::Use(network))
}

/// True where every pair can be predicted and scored now.
fn can_score_all(state: &State) -> bool {
    results::evaluation_setup(state).is_some()
        && export::can_draw(state)
        && state.tasks.of_kind(TaskKind::Evaluate).is_none()
}

/// Takes a tool of the 3D panes, or puts it away.
fn toggle(state: &State, tool: SceneTool) -> Option<Command> {
    let next = if state.workbench.tool == tool { SceneTool::Look } else { tool };
    when(state.entry().is_some(), WorkbenchCommand::SetTool(next))
}

/// The command of Escape in the 3D panes: it gives up the pose in hand, then the tool, then the point read.
fn escape(state: &State) -> Option<WorkbenchCommand> {
    let bench = &state.workbench;
    if bench.hand.is_some() {
        Some(WorkbenchCommand::RevertHand)
    } else if bench.tool != SceneTool::Look {
        Some(WorkbenchCommand::SetTool(SceneTool::Look))
    } else {
        bench.picked.map(|_| WorkbenchCommand::Pick(None))
    }
}

/// A command to the steps of a registration, where they are on screen and shows a step for which it can do something.
fn inspect(state: &State, useful: impl Fn(Inspected<'_>) -> bool, command: InspectCommand) -> Option<Command> {
    let shown = state.selection.panes.contains(&Pane::Steps).then(|| results::inspected(state))??;
    when(useful(shown), command)
}

/// Asks where the cloud, pose and mesh of an imprint go, where there is a cloud.
fn export(state: &State, source: ImprintSource) -> Option<Command> {
    when(export::pair_export(state, source).is_some(), ExportCommand::Place(Output::Pair(source)))
}

/// Accepts the pose shown, or withdraws it if it is the accepted one.
fn accept(state: &State, source: ImprintSource) -> Option<Command> {
    let shown = results::pose(state, source).ready()?.grasp_from_object;
    let accepted = results::accepted(state, source);
    let editable = state.document.is_editable(state.pair_name());
    when(editable, LabelsCommand::AcceptPose(source, accepted != Some(shown.into())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_open_grays_out_what_needs_data() {
        let state = State::default();
        for action in [Action::Generate, Action::NextPair, Action::Undo, Action::FillHoles, Action::Reload] {
            assert!(action.command(&state).is_none(), "{action:?}");
        }
        for action in [Action::OpenFolder, Action::OpenDemo, Action::Palette, Action::SwitchTheme, Action::Brush] {
            assert!(action.command(&state).is_some(), "{action:?}");
        }
    }
}
