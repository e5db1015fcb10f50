//! Context of every pane: the state to read, a list to put commands on, and what panes share.

use std::collections::BTreeMap;

use eframe::egui::{self, Response, RichText, Ui};

use super::dialogs::Dialogs;
use super::saved::Saved;
use super::scene_view::Device;
use super::theme::{Palette, SMALL};
use super::widget::image_canvas::ViewTransform;
use super::widget::texture::Textures;
use crate::app::action::Action;
use crate::app::command::Command;
use crate::app::keys::ImprintSource;
use crate::app::state::State;
use crate::app::state::tasks::RunningTask;
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::SensorKind;
use touch2touch_pipeline::still::space::ViewAngles;

/// Context of a pane while it is drawn.
pub(crate) struct Cx<'a> {
    /// Everything the studio knows. Read only.
    pub state: &'a State,
    /// Executed before the next frame.
    pub out: &'a mut Vec<Command>,
    /// Things that panes share.
    pub shared: &'a mut Shared,
    /// The graphics device; `None` if the window has none that can draw 3D.
    pub device: Result<&'a Device, &'a str>,
    /// The colors of the theme.
    pub p: &'static Palette,
}

impl Cx<'_> {
    /// Puts a command on the list.
    pub(crate) fn push(&mut self, command: impl Into<Command>) {
        self.out.push(command.into());
    }

    /// Puts an action on the list, if it can do anything now.
    pub(crate) fn act(&mut self, action: Action) {
        if let Some(command) = action.command(self.state) {
            self.out.push(command);
        }
    }

    /// A button for an action: its tooltip has the shortcut, and it is grayed out when it can do nothing.
    pub(crate) fn action_button(&mut self, ui: &mut Ui, action: Action, text: &str) -> Response {
        self.acting(ui, action, egui::Button::new(text), action.name())
    }

    /// A button for an action that turns something on or off.
    pub(crate) fn action_switch(&mut self, ui: &mut Ui, action: Action, text: &str, on: bool) -> Response {
        self.acting(ui, action, egui::Button::selectable(on, text), action.name())
    }

    /// A button of any look for an action, under a name for screen readers.
    pub(crate) fn acting(
        &mut self,
        ui: &mut Ui,
        action: Action,
        button: egui::Button<'_>,
        name: impl Into<String>,
    ) -> Response {
        let response = ui.add_enabled(action.command(self.state).is_some(), button).accessible_name(name);
        let help = action.help();
        let response = response.on_hover_text(&help).on_disabled_hover_text(help);
        if response.clicked() {
            self.act(action);
        }
        response
    }

    /// A row of a menu for an action, with its key behind the name; `on` marks what is in force.
    pub(crate) fn menu_row(&mut self, ui: &mut Ui, action: Action, on: bool) -> Response {
        let button = egui::Button::new(action.name()).shortcut_text(action.key_text()).selected(on);
        let response = ui.add_enabled(action.command(self.state).is_some(), button).accessible_name(action.name());
        let response = response.on_hover_text(action.tooltip());
        if response.clicked() {
            self.act(action);
        }
        response
    }

    /// The progress of a task in a pane, in the words of `text`; the bar below has the one that fills, and Cancel.
    pub(crate) fn under_way(&self, ui: &mut Ui, task: &RunningTask, text: &str) {
        let text = match (task.cancelling, text) {
            (true, _) => "stopping…",
            (false, "") => "starting…",
            (false, text) => text,
        };
        let label = egui::Label::new(RichText::new(text).size(SMALL).color(self.p.accent)).truncate();
        ui.add(label).on_hover_text("Progress and Cancel are in the bar below");
    }
}

with_defaults! {
    /// Part of the pictures that is seen, and the colors of errors: one for all panes.
    pub(crate) struct Views {
        /// Of GelSlim images.
        pub gel: ViewTransform = ViewTransform::default(),
        /// Of bubble images.
        pub bubble: ViewTransform = ViewTransform::default(),
        /// Half the range of the error's colors, millimeters.
        pub error_mm: f32 = 4.0,
    }
}

impl Views {
    /// Shows the images whole: all, or those of one kind of sensor.
    pub(crate) fn fit(&mut self, only: Option<SensorKind>) {
        if only != Some(SensorKind::Depth) {
            self.gel = ViewTransform::default();
        }
        if only != Some(SensorKind::Color) {
            self.bubble = ViewTransform::default();
        }
    }
}

/// Things that the panes share and only the window knows.
pub(crate) struct Shared {
    /// Part of the pictures that is seen.
    pub views: Views,
    /// Pictures on the graphics card.
    pub textures: Textures,
    /// Row of the tools tried for a side that the pointer is on: the 3D view has its outline.
    pub hovered_tool: Option<(ImprintSource, usize)>,
    /// Dialogs.
    pub dialogs: Dialogs,
    /// Directions in which the 3D views look, by side.
    pub angles: [ViewAngles; 2],
    /// The number under the pointer, for the status bar and the clipboard.
    pub readout: Option<String>,
    /// True where a pane has the pixel under the pointer in this frame.
    pub hover_claimed: bool,
    /// When labels were last written.
    pub saved: Saved,
    /// When notes of the log came on the screen, by number: seconds of the window's clock, and the pair that was shown.
    pub notes: BTreeMap<u64, (f64, Option<PairId>)>,
}

impl Shared {
    /// A fresh window's. `native_dialogs`: whether the system's dialogs are tried before the path box.
    pub(crate) fn new(native_dialogs: bool) -> Self {
        Self {
            views: Views::default(),
            textures: Textures::default(),
            hovered_tool: None,
            dialogs: Dialogs::new(native_dialogs),
            angles: [ViewAngles::default(); 2],
            readout: None,
            hover_claimed: false,
            saved: Saved::default(),
            notes: BTreeMap::new(),
        }
    }
}

/// The color of a side.
pub(crate) fn side_color(p: &Palette, source: ImprintSource) -> egui::Color32 {
    match source {
        ImprintSource::Measured => p.truth,
        ImprintSource::Predicted => p.prediction,
    }
}
