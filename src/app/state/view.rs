//! The selection: panes on screen, the active finger, the pointer.

use std::collections::BTreeSet;

use glam::DVec3;

use super::super::keys::ImprintSource;
use super::super::pane::Pane;
use super::export::Output;
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::PadId;

/// The selection: everything that is looked at.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// The pair.
    pub pair: Option<PairId>,
    /// The active finger.
    pub finger: PadId,
    /// The imprint whose mask clean-ups work on.
    pub imprint: ImprintSource,
    /// True where a proposal is shown over the mask.
    pub proposing: bool,
    /// True where both fingers are shown; else only the active one.
    pub both_fingers: bool,
    /// The pixel under the pointer: the cross-hair of all images.
    pub hover: Option<Hover>,
    /// The point under the pointer in 3D, meters, grasp frame.
    pub hover_point: Option<DVec3>,
    /// The panes on screen.
    pub panes: BTreeSet<Pane>,
    /// True where the command palette is open.
    pub palette: bool,
    /// True where the shortcut sheet is open.
    pub shortcut_sheet: bool,
}

/// A pixel under the pointer, in raw bubble pixels of one finger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hover {
    /// The finger.
    pub finger: PadId,
    /// Column and row; (0, 0) is the center of the top-left pixel.
    pub at_px: [f32; 2],
}

/// A view direction of the 3D panes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraPreset {
    /// From the left finger.
    Left,
    /// From the right finger.
    Right,
    /// Along y.
    Front,
    /// Against y.
    Back,
    /// Along z, from the wrist.
    Top,
    /// Against z, from below.
    Bottom,
    /// From above a corner, as a view begins.
    Oblique,
}

/// A request that only the window can fulfil, once. Handed out by the runtime's `tick`.
#[derive(Clone, Debug, PartialEq)]
pub enum UiRequest {
    /// Show the native dialog for a folder, or a path box; answer with `LibraryCommand::Open`.
    PickFolder,
    /// Ask for the folder to write the results table to; answer with `EvaluateCommand::Export`.
    PickTableFolder,
    /// Ask where something is to be written; answer with `ExportCommand::Write`.
    PickOutput(Output),
    /// Ask for the folder of masks that are imported; answer with `ExportCommand::AskImport`.
    PickMasks,
    /// Ask for the folder to write labels to that could not be saved; answer with `UnsavedCommand::Elsewhere`.
    PickLabelsFolder,
    /// Close the window.
    Close,
    /// Turn the 3D cameras.
    Camera(CameraPreset),
    /// Fit images and 3D views to their panes.
    Fit,
    /// Bring a pane of the workspace to the front.
    ShowPane(Pane),
    /// Save a picture of the window.
    Screenshot,
    /// Save a picture of a pane, or copy it.
    PanePicture {
        /// The pane; `None` for the one under the pointer.
        pane: Option<Pane>,
        /// To the clipboard instead of a file.
        copied: bool,
    },
    /// Fill the screen, or stop it.
    ToggleFullscreen,
    /// Let one pane fill the window, or stop it.
    ToggleMaximized,
    /// Put the panes of the workspace back where they were.
    ResetWorkspace,
    /// Write the number under the pointer to the clipboard.
    CopyHovered,
    /// Move the keyboard focus to the filter box.
    FocusFilter,
}
