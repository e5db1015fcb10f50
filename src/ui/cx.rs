//! What every pane gets: the state to read, a list to put commands on, and what panes share.

use eframe::egui::{self, Response, Ui};

use super::dialogs::Dialogs;
use super::log::Notes;
use super::saved::Saved;
use super::scene_view::Device;
use super::theme::Palette;
use super::widget::texture::Textures;
use crate::app::action::Action;
use crate::app::command::Command;
use crate::app::keys::ImprintSource;
use crate::app::state::State;

/// What a pane may use while it is drawn.
pub(super) struct Cx<'a> {
    /// Everything the studio knows. Read only.
    pub state: &'a State,
    /// Executed before the next frame.
    pub out: &'a mut Vec<Command>,
    /// What panes share.
    pub shared: &'a mut Shared,
    /// The graphics device; `None` if the window has none that can draw 3D.
    pub device: Result<&'a Device, &'a str>,
    /// The colors of the theme.
    pub p: &'static Palette,
}

impl Cx<'_> {
    /// Puts a command on the list.
    pub(super) fn push(&mut self, command: impl Into<Command>) {
        self.out.push(command.into());
    }

    /// Puts an action on the list, if it can do anything now.
    pub(super) fn act(&mut self, action: Action) {
        if let Some(command) = action.command(self.state) {
            self.out.push(command);
        }
    }

    /// A button for an action: its tooltip has the shortcut, and it is grayed out when it can do nothing.
    pub(super) fn action_button(&mut self, ui: &mut Ui, action: Action, text: &str) -> Response {
        let command = action.command(self.state);
        let response = ui.add_enabled(command.is_some(), egui::Button::new(text)).accessible_name(action.name());
        let response = response.on_hover_text(action.help()).on_disabled_hover_text(action.help());
        if response.clicked()
            && let Some(command) = command
        {
            self.out.push(command);
        }
        response
    }
}

/// What the panes share that only the window knows.
pub(super) struct Shared {
    /// Pictures on the graphics card.
    pub textures: Textures,
    /// Dialogs.
    pub dialogs: Dialogs,
    /// The number under the pointer, for the status bar and the clipboard.
    pub readout: Option<String>,
    /// Whether a pane has the pixel under the pointer in this frame.
    pub hover_claimed: bool,
    /// When labels were last written.
    pub saved: Saved,
    /// When notes came on the screen.
    pub notes: Notes,
}

impl Shared {
    /// A fresh window's. `native_dialogs`: whether the system's dialogs are tried before the path box.
    pub(super) fn new(native_dialogs: bool) -> Self {
        Self {
            textures: Textures::default(),
            dialogs: Dialogs::new(native_dialogs),
            readout: None,
            hover_claimed: false,
            saved: Saved::default(),
            notes: Notes::default(),
        }
    }
}

/// The color of a side.
pub(super) fn side_color(p: &Palette, source: ImprintSource) -> egui::Color32 {
    match source {
        ImprintSource::Measured => p.truth,
        ImprintSource::Predicted => p.prediction,
    }
}
