//! What an [`Action`] does now, as a command.

use strum::IntoEnumIterator;

use super::action::Action;
use super::command::{
    AdaptCommand, CameraPreset, Command, DialCommand, EvaluateCommand, ExportCommand, FollowCommand, InspectCommand,
    LabelsCommand, LibraryCommand, Pane, PredictCommand, SeedsCommand, SettingsCommand, TasksCommand, TrainCommand,
    UiRequest, ViewCommand, WorkbenchCommand,
};
use super::export::state::Output;
use super::inspect::state::Inspected;
use super::keys::{ImprintSource, Registration, Request, ShiftMode};
use super::labels::state::Review;
use super::library::state::Place;
use super::settings::state::scene::{LayerLook, SceneLayer, SceneLook};
use super::settings::state::versus::{Versus, VersusMode};
use super::settings::state::{ColorRange, MaskSettings, MaskTool, Theme, Workspace};
use super::state::{Absent, State};
use super::tasks::state::TaskKind;
use super::workbench::state::{Layer, SceneTool, Section};
use touch2touch_core::hand::HandAxis;
use touch2touch_core::label::{CleanKind, Paint};

/// The next or previous of a fixed set, going round.
fn next_of<T: IntoEnumIterator + PartialEq>(current: &T) -> Option<T> {
    let position = T::iter().position(|t| t == *current)?;
    T::iter().cycle().nth(position + 1)
}

/// Factor by which a key press changes the brush.
const BRUSH_STEP: f32 = 1.25;
/// By how much a key press changes the opacity.
const OPACITY_STEP: f32 = 0.1;

impl Action {
    /// What it does now; `None` = it cannot do anything now (grayed out).
    pub fn command(self, state: &State) -> Option<Command> {
        let open = state.library.open.is_some();
        let selected = state.entry().is_some();
        let listed = !state.library.order.is_empty();
        let editable = state.document.is_editable(state.pair_name());
        let settings = &state.settings;
        let ui = |request: UiRequest| does(ViewCommand::Ui(request));
        let clean_up = |kind| when(editable, LabelsCommand::CleanUp(settings.mask.clean_up(kind)));
        match self {
            Self::OpenFolder => ui(UiRequest::PickFolder),
            Self::OpenDemo => does(LibraryCommand::Open(Place::Demo)),
            Self::Reload => when(open, LibraryCommand::Reload),
            Self::Follow => {
                let folder = state.library.open.as_ref().is_some_and(|open| open.source.root().is_some());
                when(folder, FollowCommand::Set(state.library.follow.is_none()))
            }
            Self::Save => does(LabelsCommand::Save),
            Self::Figure => when(state.can_draw(), ExportCommand::Ask(!state.export.asking)),
            Self::SaveCase => when(state.can_draw(), ExportCommand::Place(Output::Case)),
            Self::OwnPreferences => when(state.own.is_some(), ExportCommand::OwnPreferences),
            Self::ExportMeasured => export(state, ImprintSource::Measured),
            Self::ExportPredicted => export(state, ImprintSource::Predicted),
            Self::ExportMasks => when(open, ExportCommand::AskMasks(true)),
            Self::ImportMasks => when(open, ViewCommand::Ui(UiRequest::PickMasks)),

            Self::PreviousPair => when(listed, LibraryCommand::Step(-1)),
            Self::NextPair => when(listed, LibraryCommand::Step(1)),
            Self::TenBack => when(listed, LibraryCommand::Step(-10)),
            Self::TenForward => when(listed, LibraryCommand::Step(10)),
            Self::FirstPair => when(listed, LibraryCommand::First),
            Self::LastPair => when(listed, LibraryCommand::Last),
            Self::NextUnfinished => when(listed, LibraryCommand::NextUnfinished),
            Self::NextWorst => when(listed && state.table.by().is_some(), LibraryCommand::NextWorst),
            Self::NextUncertain => {
                let known = state.table.scores.queue.known() > 0;
                when(listed && (known || can_rank(state)), LibraryCommand::NextUncertain)
            }
            Self::OtherFinger => does(ViewCommand::SelectFinger(state.other_finger())),
            Self::BothFingers => does(ViewCommand::ShowBothFingers(!state.selection.both_fingers)),
            Self::FindPair => {
                when(state.selection.panes.contains(&Pane::Browser), ViewCommand::Ui(UiRequest::FocusFilter))
            }

            Self::Generate => when(state.can_generate().is_ok(), PredictCommand::Generate),
            Self::GenerateNewSeed => when(state.can_generate().is_ok(), PredictCommand::GenerateNewSeed),
            Self::TurnDial => {
                when(state.running(TaskKind::Dial).is_none() && state.sweep_setup().is_ok(), DialCommand::Start)
            }
            Self::FitPairs => {
                let ready = state.can_adapt() && state.running(TaskKind::Fit).is_none();
                when(ready, AdaptCommand::Start)
            }
            Self::TrainMasks => ui(UiRequest::ShowPane(Pane::Train)),
            Self::StartTraining => {
                when(state.train_setup().is_some() && state.running(TaskKind::Train).is_none(), TrainCommand::Start)
            }
            Self::UseTrained => when(state.trained().is_some() && !state.uses_trained(), TrainCommand::Use),
            Self::UseFit => when(state.fitted().is_some() && !state.uses_fit(), AdaptCommand::Use),
            Self::EvaluateDataset => {
                let ready = state.evaluation_setup().is_some() && state.running(TaskKind::Evaluate).is_none();
                when(ready, EvaluateCommand::Start)
            }
            Self::PredictAll => {
                let ready = state.scores_key().is_some() && state.running(TaskKind::Evaluate).is_none();
                when(ready, EvaluateCommand::All)
            }
            Self::RankMasks => when(can_rank(state), EvaluateCommand::Rank),
            Self::ExportTable => when(state.table.result.is_some(), ViewCommand::Ui(UiRequest::PickTableFolder)),
            Self::RunSeeds => {
                let possible = state.can_generate().is_ok() && state.selection.panes.contains(&Pane::Seeds);
                when(possible, SeedsCommand::Run(!state.seeds_running()))
            }
            Self::LockSeed => {
                let mut generate = settings.generate.clone();
                generate.seed_locked = !generate.seed_locked;
                does(SettingsCommand::SetGenerate(generate))
            }
            Self::CancelJobs => {
                if state.document.stroke.is_some() {
                    does(LabelsCommand::CancelStroke)
                } else if state.proposes() {
                    does(ViewCommand::Propose(false))
                } else if let Some(command) = escape(state) {
                    does(command)
                } else if state.tasks.demanded.iter().any(|r| matches!(r, Request::Basin(_))) {
                    does(InspectCommand::StopBasin)
                } else if state.library.brush.is_some() && state.tasks.running.is_empty() {
                    does(LibraryCommand::Brush(None))
                } else if state.seeds_to_come() > 0 {
                    does(SeedsCommand::Run(false))
                } else {
                    when(!state.tasks.running.is_empty(), TasksCommand::CancelAll)
                }
            }
            Self::NextShift => {
                // The refit, where there is one, comes after the last of the others.
                let next = match (settings.shift, settings.refit) {
                    (ShiftMode::Refit(_), _) => Some(ShiftMode::Raw),
                    (ShiftMode::ExactInverse, Some(refit)) => Some(ShiftMode::Refit(refit)),
                    (shift, _) => next_of::<ShiftMode>(&shift),
                };
                next.and_then(|shift| does(SettingsCommand::SetShift(shift)))
            }
            Self::Refit => when(state.can_generate().is_ok(), PredictCommand::Refit),

            Self::Brush => does(SettingsCommand::SetMaskTool(MaskTool::Brush)),
            Self::Eraser => does(SettingsCommand::SetMaskTool(MaskTool::Eraser)),
            Self::Lasso => does(SettingsCommand::SetMaskTool(MaskTool::Lasso)),
            Self::Polygon => does(SettingsCommand::SetMaskTool(MaskTool::Polygon)),
            Self::RectangleTool => does(SettingsCommand::SetMaskTool(MaskTool::Rectangle)),
            Self::Wand => does(SettingsCommand::SetMaskTool(MaskTool::Wand)),
            Self::PanTool => does(SettingsCommand::SetMaskTool(MaskTool::Pan)),
            Self::PaintIn3d => toggle(state, SceneTool::Paint),
            Self::PaintLayers => {
                let layers = settings.mask.layers.other();
                does(SettingsCommand::SetMask(MaskSettings { layers, ..settings.mask.clone() }))
            }
            Self::PaintIgnore => {
                let on = settings.mask.paint == Paint::Ignore;
                does(SettingsCommand::SetPaint(if on { Paint::Contact } else { Paint::Ignore }))
            }
            Self::Propose => when(selected, ViewCommand::Propose(!state.selection.proposing)),
            Self::ProposeAll => when(state.can_propose_all(), LabelsCommand::ProposeAll),
            Self::NextProposal => {
                let next = next_of(&settings.mask.proposal).unwrap_or_default();
                does(SettingsCommand::SetMask(MaskSettings { proposal: next, ..settings.mask.clone() }))
            }
            Self::LetThrough => {
                let on = settings.mask.paint == Paint::LetThrough;
                let paint = if on { Paint::Contact } else { Paint::LetThrough };
                when(on || state.proposes(), SettingsCommand::SetPaint(paint))
            }
            Self::LastTool => does(SettingsCommand::LastMaskTool),
            Self::BrushSmaller => does(SettingsCommand::SetBrushRadius(settings.mask.radius_px / BRUSH_STEP)),
            Self::BrushLarger => does(SettingsCommand::SetBrushRadius(settings.mask.radius_px * BRUSH_STEP)),
            Self::FillHoles => clean_up(CleanKind::FillHoles),
            Self::LargestIsland => clean_up(CleanKind::LargestIsland),
            Self::DropSmall => clean_up(CleanKind::DropSmall),
            Self::OpenMask => clean_up(CleanKind::Open),
            Self::CloseMask => clean_up(CleanKind::Close),
            Self::SmoothMask => clean_up(CleanKind::Smooth),
            Self::GrowMask => clean_up(CleanKind::Grow),
            Self::ShrinkMask => clean_up(CleanKind::Shrink),
            Self::ClearBorder => clean_up(CleanKind::ClearBorder),
            Self::ClearMask => clean_up(CleanKind::Clear),
            Self::AdoptAutomatic => when(editable, LabelsCommand::AdoptAutomatic),
            Self::TakeOver => when(editable, LabelsCommand::TakeOver),
            Self::ResetMask => {
                let finger = state.selection.finger;
                let corrected = state.hand_mask(state.worked_on(finger), finger).is_some();
                when(editable && corrected, LabelsCommand::ResetMask)
            }
            Self::Undo => {
                when(state.history.next_undo(state.pair_name(), &state.mask_places()).is_some(), LabelsCommand::Undo)
            }
            Self::Redo => {
                when(state.history.next_redo(state.pair_name(), &state.mask_places()).is_some(), LabelsCommand::Redo)
            }
            Self::MaskVisible => does(SettingsCommand::SetMaskVisible(!settings.mask_visible)),
            Self::MaskOutline => does(SettingsCommand::SetMaskOutline(!settings.mask_outline)),
            Self::MaskFainter => does(SettingsCommand::SetMaskOpacity(settings.mask_opacity - OPACITY_STEP)),
            Self::MaskStronger => does(SettingsCommand::SetMaskOpacity(settings.mask_opacity + OPACITY_STEP)),
            Self::Influence => when(selected, ViewCommand::ShowInfluence(!state.selection.influence)),
            Self::Ghosts => does(SettingsCommand::SetGhosts(!settings.ghosts)),
            Self::Lens => does(ViewCommand::ShowLens(!state.selection.lens)),
            Self::DoneAndNext => when(editable, LibraryCommand::DoneAndNext),
            Self::Flag => when(editable, LabelsCommand::SetReview(Review::Flagged)),
            Self::Skip => when(editable, LabelsCommand::SetReview(Review::Skip)),
            Self::MarkTodo => when(editable, LabelsCommand::SetReview(Review::Todo)),

            Self::RunPose => when(selected, TasksCommand::Retry),
            Self::AcceptMeasuredPose => accept(state, ImprintSource::Measured),
            Self::AcceptPredictedPose => accept(state, ImprintSource::Predicted),
            Self::PoseTool => toggle(state, SceneTool::Pose),
            Self::MeasureDistance => toggle(state, SceneTool::Distance),
            Self::MeasureAngle => toggle(state, SceneTool::Angle),
            Self::SixDof => does(WorkbenchCommand::SetSixDof(!state.workbench.six_dof)),
            Self::NudgeLeft => nudge(state, HandAxis::Y, -1.0),
            Self::NudgeRight => nudge(state, HandAxis::Y, 1.0),
            Self::NudgeUp => nudge(state, HandAxis::Z, -1.0),
            Self::NudgeDown => nudge(state, HandAxis::Z, 1.0),
            Self::TurnLeft => nudge(state, HandAxis::Theta, -1.0),
            Self::TurnRight => nudge(state, HandAxis::Theta, 1.0),
            Self::IcpFromHere => when(in_hand(state), WorkbenchCommand::StartIcp),
            Self::Accept if state.proposes() => when(editable, LabelsCommand::AcceptProposal),
            Self::Accept => when(editable && state.workbench.hand.is_some(), WorkbenchCommand::AcceptHand),
            Self::RevertHand => when(state.workbench.hand.is_some(), WorkbenchCommand::RevertHand),
            Self::StepBack => inspect(state, |s| s.at > 0, InspectCommand::By(-1)),
            Self::StepForward => inspect(state, |s| !s.is_last(), InspectCommand::By(1)),
            Self::FirstStep => inspect(state, |s| s.at > 0, InspectCommand::Begin),
            Self::LastStep => inspect(state, |s| !s.is_last(), InspectCommand::End),
            Self::PlaySteps => {
                inspect(state, |s| s.inspection.num_steps(s.run) > 1, InspectCommand::Play(!state.inspect.playing))
            }
            Self::PinStep => inspect(state, |_| true, InspectCommand::Pin),
            Self::OwnStarts => when(state.inspect.start.is_some(), InspectCommand::Start(None)),
            Self::Correspondences => inspect(state, |_| true, InspectCommand::Lines(!state.inspect.lines)),
            Self::NextPoseEngine => next_of::<Registration>(&settings.pose_engine.by)
                .and_then(|next| does(SettingsCommand::SetPoseEngine(next.into()))),

            Self::LockRange => {
                does(SettingsCommand::SetRange(ColorRange { locked: !settings.range.locked, ..settings.range }))
            }
            Self::RangeOnce => when(selected, SettingsCommand::RangeFromShown),
            Self::ResetRange => does(SettingsCommand::SetRange(ColorRange::default())),
            Self::Fit => ui(UiRequest::Fit),
            Self::CameraLeft => ui(UiRequest::Camera(CameraPreset::Left)),
            Self::CameraRight => ui(UiRequest::Camera(CameraPreset::Right)),
            Self::CameraFront => ui(UiRequest::Camera(CameraPreset::Front)),
            Self::CameraTop => ui(UiRequest::Camera(CameraPreset::Top)),
            Self::NextLayer => {
                next_of::<Layer>(&state.workbench.layer).and_then(|l| does(WorkbenchCommand::SetLayer(l)))
            }
            Self::AnimateWeakest => does(WorkbenchCommand::SetAnimateWeakest(!state.workbench.animate_weakest)),
            Self::BothClouds => does(WorkbenchCommand::SetBothClouds(!state.workbench.both_clouds)),
            Self::CompareMode => {
                let versus = state.versus();
                next_of::<VersusMode>(&versus.mode)
                    .and_then(|mode| does(SettingsCommand::SetVersus(Versus { mode, ..versus })))
            }
            Self::SwapCompared => does(SettingsCommand::SetVersus(state.versus().swapped())),
            Self::Section => {
                let next = if state.workbench.section.is_some() { None } else { Some(Section::default()) };
                does(WorkbenchCommand::SetSection(next))
            }
            Self::WindowOnly => {
                let scene = &settings.scene;
                does(SettingsCommand::SetScene(SceneLook { only_window: !scene.only_window, ..scene.clone() }))
            }
            Self::MembraneSurface => {
                let scene = &settings.scene;
                let surface = scene.layer(SceneLayer::Surface);
                let points = scene.layer(SceneLayer::Membrane);
                let changed = scene.clone().with(SceneLayer::Surface, LayerLook { shown: !surface.shown, ..surface });
                let points = LayerLook { shown: surface.shown, ..points };
                does(SettingsCommand::SetScene(changed.with(SceneLayer::Membrane, points)))
            }
            Self::EyeDome => {
                let scene = &settings.scene;
                does(SettingsCommand::SetScene(SceneLook { eye_dome: !scene.eye_dome, ..scene.clone() }))
            }
            Self::Parallel => {
                let scene = &settings.scene;
                does(SettingsCommand::SetScene(SceneLook { orthographic: !scene.orthographic, ..scene.clone() }))
            }
            Self::CopyCamera => ui(UiRequest::CopyCamera),
            Self::LinkCameras => does(SettingsCommand::SetCamerasLinked(!settings.cameras_linked)),
            Self::Footprint => does(SettingsCommand::SetFootprintVisible(!settings.footprint_visible)),
            Self::SwitchTheme => {
                next_of::<Theme>(&settings.theme).and_then(|next| does(SettingsCommand::SetTheme(next)))
            }
            Self::DepthChain => ui(UiRequest::ShowPane(Pane::Ledger)),
            Self::InspectWorkspace => does(SettingsCommand::SetWorkspace(Workspace::Inspect)),
            Self::AlignWorkspace => does(SettingsCommand::SetWorkspace(Workspace::Align)),
            Self::LabelWorkspace => does(SettingsCommand::SetWorkspace(Workspace::Label)),
            Self::EvaluateWorkspace => does(SettingsCommand::SetWorkspace(Workspace::Evaluate)),
            Self::ResetWorkspace => ui(UiRequest::ResetWorkspace),
            Self::MaximizePane => ui(UiRequest::ToggleMaximized),
            Self::Fullscreen => ui(UiRequest::ToggleFullscreen),
            Self::Screenshot => ui(UiRequest::Screenshot),
            Self::SavePane => ui(UiRequest::PanePicture { copied: false }),
            Self::CopyPane => ui(UiRequest::PanePicture { copied: true }),
            Self::CopyHovered => when(state.selection.hover.is_some(), ViewCommand::Ui(UiRequest::CopyHovered)),

            Self::Palette => does(ViewCommand::SetPalette(!state.selection.palette)),
            Self::ShortcutSheet => does(ViewCommand::SetShortcutSheet(!state.selection.shortcut_sheet)),
            Self::ResetSettings => does(SettingsCommand::ResetSettings),
        }
    }
}

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

fn does(command: impl Into<Command>) -> Option<Command> {
    Some(command.into())
}

fn when(possible: bool, command: impl Into<Command>) -> Option<Command> {
    possible.then(|| command.into())
}

/// Whether the measured imprints of all pairs can be scored now.
fn can_rank(state: &State) -> bool {
    state.scores_key().is_some() && state.running(TaskKind::Evaluate).is_none()
}

/// Whether the pose tool is in hand and there is a tool to be moved.
fn in_hand(state: &State) -> bool {
    state.workbench.tool == SceneTool::Pose && state.tool().ready().is_some()
}

/// Takes a tool of the 3D panes, or puts it away.
fn toggle(state: &State, tool: SceneTool) -> Option<Command> {
    let next = if state.workbench.tool == tool { SceneTool::Look } else { tool };
    when(state.entry().is_some(), WorkbenchCommand::SetTool(next))
}

fn nudge(state: &State, axis: HandAxis, steps: f64) -> Option<Command> {
    when(in_hand(state), WorkbenchCommand::Nudge(axis, steps * axis.step()))
}

/// What Escape gives up in the 3D panes: the pose in hand, then a measurement, then the point read.
fn escape(state: &State) -> Option<WorkbenchCommand> {
    let bench = &state.workbench;
    if bench.hand.is_some() {
        Some(WorkbenchCommand::RevertHand)
    } else if !bench.marks.is_empty() {
        Some(WorkbenchCommand::ClearMarks)
    } else if bench.tool != SceneTool::Look {
        Some(WorkbenchCommand::SetTool(SceneTool::Look))
    } else {
        bench.picked.map(|_| WorkbenchCommand::Pick(None))
    }
}

/// A command of the time machine, where it is on screen and shows a step for which it can do something.
fn inspect(state: &State, useful: impl Fn(Inspected<'_>) -> bool, command: InspectCommand) -> Option<Command> {
    let shown = state.selection.panes.contains(&Pane::TimeMachine).then(|| state.inspected())??;
    when(useful(shown), command)
}

/// Asks where the cloud, pose and mesh of an imprint go, where there is a cloud.
fn export(state: &State, source: ImprintSource) -> Option<Command> {
    when(state.pair_export(source).is_some(), ExportCommand::Place(Output::Pair(source)))
}

/// Accepts the pose shown, or withdraws it if it is the accepted one.
fn accept(state: &State, source: ImprintSource) -> Option<Command> {
    let shown = state.pose(source).ready()?.grasp_from_object;
    let accepted = state.accepted(source);
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
