//! What is on screen: panes, the active finger, the pointer.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::domain::dataset::PairId;
use crate::domain::rig::PadId;

/// What is looked at.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    /// The pair.
    pub pair: Option<PairId>,
    /// The active finger.
    pub finger: PadId,
    /// Whether both fingers are shown, or only the active one.
    pub both_fingers: bool,
    /// The pixel under the pointer: the cross-hair of all images.
    pub hover: Option<Hover>,
    /// The point under the pointer in 3D, meters, grasp frame.
    pub hover_point: Option<DVec3>,
    /// The panes on screen.
    pub panes: BTreeSet<Pane>,
    /// Whether the command palette is open.
    pub palette: bool,
    /// Whether the shortcut sheet is open.
    pub shortcut_sheet: bool,
}

/// A pane of the window. What is visible decides what is computed.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Pane {
    /// The list of pairs.
    Browser,
    /// The GelSlim image during the touch.
    GelRaw,
    /// The GelSlim image without contact.
    GelReference,
    /// Touched minus untouched.
    GelDifference,
    /// The measured imprint.
    Measured,
    /// The predicted imprint.
    Predicted,
    /// Predicted minus measured.
    Error,
    /// The measured cloud on the CAD model.
    SceneMeasured,
    /// The predicted cloud on the CAD model.
    ScenePredicted,
    /// The steps of a registration.
    TimeMachine,
    /// Where starts lead.
    BasinMap,
    /// The generator.
    Generate,
    /// Several seeds of one touch.
    Seeds,
    /// The mask tools.
    Masks,
    /// Residuals, reasons, distances and observability of a registration.
    Layers,
    /// Poses of truth, measurement and prediction, per finger and joint.
    Poses,
    /// The depth chain: from the decoder to meters, stage by stage.
    Ledger,
    /// The figures of the selected pair.
    Metrics,
    /// The figures of all pairs so far.
    Table,
    /// The paper's results table of the whole data set.
    Results,
    /// What happened.
    Log,
    /// Preferences.
    Settings,
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
    /// Along z.
    Top,
}

/// What only the window can do, once. Handed out by [`super::super::runtime::Runtime::tick`].
#[derive(Clone, Debug, PartialEq)]
pub enum UiRequest {
    /// Show the native dialog for a folder, or a path box; answer with `LibraryCommand::Open`.
    PickFolder,
    /// Show the native dialog for a file, or a path box; answer with `LibraryCommand::Open`.
    PickFile,
    /// Ask for the folder to write the results table to; answer with `EvaluateCommand::Export`.
    PickTableFolder,
    /// Ask for the folder to export masks to; answer with `LabelsCommand::ExportMasks`.
    PickExportFolder,
    /// Turn the 3D cameras.
    Camera(CameraPreset),
    /// Fit images and 3D views to their panes.
    Fit,
    /// Bring a pane of the workspace to the front.
    ShowPane(Pane),
    /// Save a picture of the window.
    Screenshot,
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
