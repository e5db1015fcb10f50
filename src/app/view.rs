//! The room of what is on screen.

pub use super::state::view::{CameraPreset, Hover, Purpose, UiRequest};

use std::collections::BTreeSet;

use glam::DVec3;

use super::effect::Effect;
use super::keys::ImprintSource;
use super::labels;
use super::pane::{Pane, Workspace};
use super::state::State;
use touch2touch_core::rig::PadId;

/// A command to what is on screen.
#[derive(Clone, Debug)]
pub enum ViewCommand {
    /// Makes a finger the active one.
    SelectFinger(PadId),
    /// Makes an imprint the one whose mask clean-ups work on.
    SelectImprint(ImprintSource),
    /// Shows a proposal over the mask, or no longer: nothing else changes.
    Propose(bool),
    /// Shows both fingers, or only the active one.
    ShowBothFingers(bool),
    /// The pixel under the pointer, shared by all images.
    HoverPixel(Option<Hover>),
    /// The point under the pointer in 3D, meters, grasp frame.
    HoverPoint(Option<DVec3>),
    /// The panes on screen.
    ShowPanes(BTreeSet<Pane>),
    /// Opens or closes the command palette.
    SetPalette(bool),
    /// Opens or closes the shortcut sheet.
    SetShortcutSheet(bool),
    /// Something only the window can do.
    Ui(UiRequest),
}

/// Shows both fingers where masks are drawn, one elsewhere, as another workspace than `before` comes to the front.
pub(super) fn follow_workspace(state: &mut State, before: Workspace, effects: &mut Vec<Effect>) {
    let now = state.settings.workspace;
    if now != before {
        step(state, ViewCommand::ShowBothFingers(now == Workspace::Label), effects);
    }
}

pub(super) fn step(state: &mut State, command: ViewCommand, effects: &mut Vec<Effect>) {
    let selection = &mut state.selection;
    match command {
        ViewCommand::SelectFinger(finger) => {
            if finger != selection.finger {
                // A stroke is drawn on the finger it began on; it must not end out of sight.
                labels::end_stroke(state, effects);
                state.selection.finger = finger;
            }
        }
        ViewCommand::SelectImprint(source) => {
            labels::end_stroke(state, effects);
            state.selection.imprint = source;
        }
        ViewCommand::Propose(shown) => {
            labels::end_stroke(state, effects);
            state.selection.proposing = shown;
        }
        ViewCommand::ShowBothFingers(both) => {
            labels::end_stroke(state, effects);
            state.selection.both_fingers = both;
        }
        ViewCommand::HoverPixel(hover) => {
            selection.hover = hover.filter(|hover| hover.at_px.iter().all(|v| v.is_finite()));
        }
        ViewCommand::HoverPoint(point) => selection.hover_point = point.filter(|p| p.is_finite()),
        ViewCommand::ShowPanes(panes) => selection.panes = panes,
        ViewCommand::SetPalette(open) => selection.palette = open,
        ViewCommand::SetShortcutSheet(open) => selection.shortcut_sheet = open,
        ViewCommand::Ui(request) => effects.push(Effect::Ui(request)),
    }
}
