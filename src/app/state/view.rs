//! The selection: panes on screen, the active finger, the pointer.

use std::collections::BTreeSet;

use glam::DVec3;

use super::super::keys::ImprintSource;
use super::super::pane::Pane;
use super::export::Output;
use touch2touch_core::dataset::PairId;
pub use touch2touch_core::frames::CameraPreset;
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

/// Purpose of a dialog.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Purpose {
    /// A folder with pairs, to open.
    Folder,
    /// The folder that the results table is written to.
    Table,
    /// The folder of masks that are imported.
    Masks,
    /// The folder that labels are written to which could not be saved.
    Labels,
    /// A place that something is written to.
    Output(Output),
}

/// A request that only the window can fulfil, once. Handed out by the runtime's `tick`.
#[derive(Clone, Debug, PartialEq)]
pub enum UiRequest {
    /// Show the native dialog for a place, or a path box; the answer is the command of its purpose.
    Pick(Purpose),
    /// Close the window.
    Close,
    /// Turn the 3D cameras.
    Camera(CameraPreset),
    /// Fit images and 3D views to their panes.
    Fit,
    /// Bring a pane of the workspace to the front.
    ShowPane(Pane),
    /// Move the keyboard focus this many panes on.
    StepPane(isize),
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
