//! What every pane gets: the state to read, a list to put commands on, and what only the window knows.

use std::collections::BTreeSet;
use std::sync::Arc;

use eframe::egui::{self, Response, Ui};
use glam::DVec3;

use super::dialogs::Dialogs;
use super::palette::PaletteState;
use super::saved::Saved;
use super::scene::{Gizmo, LayerColors, StepLines};
use super::scene_view::{Device, SceneView};
use super::theme::Palette;
use super::widget::image_canvas::ViewTransform;
use super::widget::texture::{Memo, Textures};
use crate::app::action::Action;
use crate::app::command::{Command, Pane};
use crate::app::keys::{CloudKey, DatasetSeq, ImprintSource};
use crate::app::state::State;
use crate::domain::mesh::TriMesh;
use crate::domain::postprocess::Stats;
use crate::domain::rig::{PadId, PerPad};

/// What a pane may use while it is drawn.
pub(super) struct Cx<'a> {
    /// Everything the studio knows. Read only.
    pub state: &'a State,
    /// Executed before the next frame.
    pub out: &'a mut Vec<Command>,
    /// What only the window knows.
    pub local: &'a mut Local,
    /// The graphics device; `None` if the window has none that can draw 3D.
    pub device: Result<&'a Device, &'a str>,
    /// The colors of the theme.
    pub p: &'static Palette,
}

impl Cx<'_> {
    /// Puts a command on the list.
    pub(super) fn push(&mut self, command: Command) {
        self.out.push(command);
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

/// The stroke that the pointer is drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Painting {
    /// The pane.
    pub pane: Pane,
    /// The finger.
    pub finger: PadId,
}

/// Points as the renderer takes them, made once per cloud.
pub(super) struct SceneCloud {
    /// The cloud.
    pub key: CloudKey,
    /// Counts up with every new cloud.
    pub revision: u64,
    /// Per finger: the membrane and the contact.
    pub fingers: PerPad<[Arc<[DVec3]>; 2]>,
}

/// A CAD model as the renderer takes it.
pub(super) struct SceneMesh {
    /// The data set and the tool.
    pub key: (DatasetSeq, String),
    /// Counts up with every new model.
    pub revision: u64,
    /// The model.
    pub mesh: Arc<TriMesh>,
}

/// What only the window knows: view positions, text being typed, textures.
pub(super) struct Local {
    /// Pictures.
    pub textures: Textures,
    /// Outlines of masks.
    pub outlines: Memo<Vec<[[f32; 2]; 2]>>,
    /// Figures of images.
    pub stats: Memo<Stats>,
    /// What part of GelSlim images is seen.
    pub gel_view: ViewTransform,
    /// What part of bubble images is seen.
    pub bubble_view: ViewTransform,
    /// The 3D views by [`ImprintSource`].
    pub scenes: [SceneView; 2],
    /// Points on the device, by [`ImprintSource`].
    pub scene_clouds: [Option<SceneCloud>; 2],
    /// Colors of the contact points, by [`ImprintSource`].
    pub layer_colors: [Option<LayerColors>; 2],
    /// The handles of the pose tool.
    pub gizmo: Gizmo,
    /// The CAD model as the renderer takes them.
    pub mesh: Option<SceneMesh>,
    /// Correspondences of the step that the time machine shows.
    pub step_lines: Option<StepLines>,
    /// When the last step went by while playing, seconds.
    pub played_at: Option<f64>,
    /// Counts what was made for the renderer.
    pub revision: u64,
    /// Half the range of the error's colors, millimeters.
    pub error_mm: f32,
    /// The filter being typed.
    pub filter: String,
    /// Whether the filter wants the keyboard.
    pub focus_filter: bool,
    /// The row that the list was last scrolled to; `None` where the list is a new one.
    pub scrolled_to: Option<Option<usize>>,
    /// Whether a pane has the pixel under the pointer in this frame.
    pub hover_claimed: bool,
    /// Dialogs.
    pub dialogs: Dialogs,
    /// The command palette.
    pub palette: PaletteState,
    /// The pane that fills the window.
    pub maximized: Option<Pane>,
    /// The pane under the pointer.
    pub hovered_pane: Option<Pane>,
    /// The same in the frame before: keys come before the panes.
    pub hovered_before: Option<Pane>,
    /// The stroke being drawn.
    pub painting: Option<Painting>,
    /// The number under the pointer, for the status bar and the clipboard.
    pub readout: Option<String>,
    /// The read-out of the frame before.
    pub readout_before: Option<String>,
    /// The read-out that the status bar shows.
    pub readout_shown: Option<String>,
    /// Time of the last frame, milliseconds.
    pub frame_ms: f32,
    /// Hidden panes of the workspace.
    pub hidden: BTreeSet<Pane>,
    /// A pane to be shown or hidden.
    pub toggle_pane: Option<Pane>,
    /// Column of the table that is sorted by, and whether downwards.
    pub table_sort: (usize, bool),
    /// The panes of the last frame.
    pub visible: BTreeSet<Pane>,
    /// The panes of this frame, so far.
    pub visible_next: BTreeSet<Pane>,
    /// When labels were last written.
    pub saved: Saved,
}

impl Local {
    /// A fresh window's.
    pub(super) fn new(native_dialogs: bool) -> Self {
        Self {
            textures: Textures::default(),
            outlines: Memo::default(),
            stats: Memo::default(),
            gel_view: ViewTransform::default(),
            bubble_view: ViewTransform::default(),
            scenes: [SceneView::default(), SceneView::default()],
            scene_clouds: [None, None],
            layer_colors: [None, None],
            gizmo: Gizmo::default(),
            mesh: None,
            step_lines: None,
            played_at: None,
            revision: 0,
            error_mm: 4.0,
            filter: String::new(),
            focus_filter: false,
            scrolled_to: None,
            hover_claimed: false,
            dialogs: Dialogs::new(native_dialogs),
            palette: PaletteState::default(),
            maximized: None,
            hovered_pane: None,
            hovered_before: None,
            painting: None,
            readout: None,
            readout_before: None,
            readout_shown: None,
            frame_ms: 0.0,
            hidden: BTreeSet::new(),
            toggle_pane: None,
            table_sort: (4, false),
            visible: BTreeSet::new(),
            visible_next: BTreeSet::new(),
            saved: Saved::default(),
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
