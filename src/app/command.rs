//! [`Command`]: everything that can happen to the state, as data.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use super::document::{PairLabels, Review};
use super::evaluation::EvaluateCommand;
use super::inspect::{InspectCommand, Inspection};
use super::jobs::generate::Keyed;
use super::keys::{DatasetSeq, ImprintSource, PoseEngine, PredictionKey, Request, Revision, ShiftMode};
use super::library::{Place, Sort};
pub use super::pane::Pane;
use super::results::Preview;
use super::seeds::SeedsCommand;
use super::services::{DataSource, Followed};
use super::settings::{
    ColorMap, ColorRange, GenerateSettings, MaskSettings, MaskSource, MaskTool, Settings, Theme, Workspace,
};
use super::tasks::Ticket;
use super::workbench::WorkbenchCommand;
use crate::domain::align::basin::Basin;
use crate::domain::ambiguity::Ambiguity;
use crate::domain::contact::ContactMask;
use crate::domain::dataset::PairId;
use crate::domain::grid::{DepthMap, RgbGrid};
use crate::domain::rig::PadId;
use crate::domain::sample::Sample;
use crate::infer::engine::EngineChoice;
use crate::io::statistics::ShiftStatistics;
use crate::work::bundles::BundleInfo;
use crate::work::cloud::Clouds;
use crate::work::compare::Comparison;
use crate::work::ensemble::Ensemble;
use crate::work::error::TaskError;
use crate::work::job::Progress;
use crate::work::layers::LayerResult;
use crate::work::ledger::LedgerResult;
use crate::work::pose::PoseResult;
use crate::work::tool::NamedTool;

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

/// What only the window can do, once. Handed out by [`super::runtime::Runtime::tick`].
#[derive(Clone, Debug, PartialEq)]
pub enum UiRequest {
    /// Show the native dialog for a folder, or a path box; answer with [`Command::Open`].
    PickFolder,
    /// Show the native dialog for a file, or a path box; answer with [`Command::Open`].
    PickFile,
    /// Ask for the folder to write the results table to; answer with [`EvaluateCommand::Export`].
    PickTableFolder,
    /// Ask for the folder to export masks to; answer with [`Command::ExportMasks`].
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

/// Everything that can happen to the state.
///
/// Views and actions send the first groups; jobs answer with the last.
#[derive(Clone, Debug)]
pub enum Command {
    // The data set
    /// Opens a place; what is open stays until the new one is read.
    Open(Place),
    /// Opens the same place again.
    Reload,
    /// Follows the folder that is open, or stops: what arrives is shown and predicted.
    SetFollow(bool),
    /// Removes a place from the recent ones.
    ForgetRecent(Place),
    /// Narrows the list.
    SetFilter(String),
    /// Narrows the list to one tool.
    SetToolFilter(Option<String>),
    /// Sorts the list.
    SetSort(Sort),
    /// The rows of the list that are on screen.
    ShowRows(Range<usize>),

    // What is looked at
    /// Shows a pair.
    Select(PairId),
    /// Moves in the list; stops at its ends.
    Step(i64),
    /// Shows the first of the list.
    First,
    /// Shows the last of the list.
    Last,
    /// Shows the next of the list whose review is not finished, going round.
    NextUnfinished,
    /// Makes a finger the active one.
    SelectFinger(PadId),
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

    // Generation
    /// Generates for the selected pair with the settings.
    Generate,
    /// Draws a new seed, then generates.
    GenerateNewSeed,
    /// Computes shift statistics of the open data set with the generator and its settings, then uses them.
    Refit,
    /// Several seeds of the selected touch.
    Seeds(SeedsCommand),
    /// Shows another prediction of the same touch.
    Choose(PredictionKey),
    /// Tells a job to stop.
    Cancel(Ticket),
    /// Tells every job to stop.
    CancelAll,
    /// Tries again what could not be computed.
    Retry,

    // Masks
    /// Pointer down on an image, raw bubble pixels. `erase` swaps brush and eraser for this stroke.
    BeginStroke {
        /// The finger drawn on.
        finger: PadId,
        /// The imprint it is drawn on: its mask in force is where the correction starts.
        source: ImprintSource,
        /// Position.
        at_px: [f32; 2],
        /// Whether to remove instead of the tool's own effect.
        erase: bool,
    },
    /// Pointer moved, raw bubble pixels.
    StrokeTo([f32; 2]),
    /// Pointer up.
    EndStroke,
    /// Gives the stroke up.
    CancelStroke,
    /// Fills the holes of the mask in force.
    FillHoles,
    /// Keeps the largest island of the mask in force.
    LargestIsland,
    /// Makes the automatic mask the corrected one.
    AdoptAutomatic,
    /// Removes the corrected mask: the automatic source is in force again.
    ResetMask,
    /// Takes back the last change of what is on screen.
    Undo,
    /// Does it again.
    Redo,
    /// Sets the review state of the selected pair.
    SetReview(Review),
    /// Marks the selected pair as done and shows the next unfinished one.
    DoneAndNext,
    /// Accepts the pose shown for an imprint, or withdraws it.
    AcceptPose(ImprintSource, bool),
    /// Moves about in the time machine and the basin map.
    Inspect(InspectCommand),
    /// Writes all labels and settings now.
    Save,
    /// Writes the masks to a folder for UNet training.
    ExportMasks(PathBuf),

    /// Something of the results table.
    Evaluate(EvaluateCommand),
    /// Something of the workbench: layers, poses by hand, measuring.
    Workbench(WorkbenchCommand),

    // Preferences
    /// Light or dark.
    SetTheme(Theme),
    /// Scale of the window.
    SetUiZoom(f32),
    /// The color range.
    SetRange(ColorRange),
    /// Sets the color range once from what is shown.
    RangeFromShown,
    /// The color map.
    SetColorMap(ColorMap),
    /// How predictions become meters.
    SetShift(ShiftMode),
    /// The generator.
    SetGenerate(GenerateSettings),
    /// The mask tools.
    SetMask(MaskSettings),
    /// The tool in hand.
    SetMaskTool(MaskTool),
    /// The tool before.
    LastMaskTool,
    /// The automatic source.
    SetMaskSource(MaskSource),
    /// Brush radius, pixels.
    SetBrushRadius(f32),
    /// Whether the mask is drawn.
    SetMaskVisible(bool),
    /// Whether only its outline is.
    SetMaskOutline(bool),
    /// How strongly it covers, 0..1.
    SetMaskOpacity(f32),
    /// Whether the GelSlim's window is drawn.
    SetFootprintVisible(bool),
    /// The registration.
    SetPoseEngine(PoseEngine),
    /// The model runtime.
    SetRuntime(EngineChoice),
    /// What kept predictions may take on the disk, MiB.
    SetCacheBudget(u32),
    /// Whether the 3D views move together.
    SetCamerasLinked(bool),
    /// The workspace in front.
    SetWorkspace(Workspace),
    /// The arrangement of the panes of a workspace, in the window's format.
    SetLayout(Workspace, String),
    /// The hint of the first start is not shown again.
    DismissHint,
    /// Log entries up to a number were seen.
    LogSeen(u64),
    /// Adds an error of the window's own.
    Report(TaskError),
    /// Adds a notice of the window's own.
    Notice(String),
    /// All preferences back to their defaults; recent places stay.
    ResetSettings,

    // Answers of the runtime
    /// A touch arrived in the followed folder.
    Followed(DatasetSeq, Followed),
    /// A data set was opened.
    Opened(Ticket, DatasetSeq, Place, Opened),
    /// Bundles were looked for.
    Bundles(Vec<BundleInfo>, Vec<TaskError>),
    /// The settings file was read.
    SettingsLoaded(Box<Settings>, Option<TaskError>),
    /// What the runtime was asked for because it is shown.
    Demanded(Vec<Request>),
    /// A result that a pane asked for.
    Computed(Request, Computed),
    /// Predictions are there.
    Generated(Ticket, Keyed),
    /// A prediction as it looks on the way.
    Previewed(Ticket, Arc<Preview>),
    /// Shift statistics are there.
    Refitted(Ticket, Box<ShiftStatistics>, Option<String>),
    /// A job is under way.
    Progressed(Ticket, Progress),
    /// A job without a result is done, with a line for the log.
    Finished(Ticket, Option<String>),
    /// A job ended without a result.
    TaskFailed(Ticket, TaskError),
    /// A result that a pane asked for could not be made.
    RequestFailed(Request, TaskError),
    /// The labels of a pair are on the disk, as they were when this writing was asked for.
    LabelsSaved(String, Revision),
    /// The settings are on the disk.
    SettingsSaved,
    /// A file could not be saved.
    SaveFailed(TaskError),
}

/// What opening a data set yields.
#[derive(Clone)]
pub struct Opened {
    /// The data.
    pub source: Arc<dyn DataSource>,
    /// Review states stored with it that are not "todo", by pair name.
    pub reviews: BTreeMap<String, Review>,
}

impl std::fmt::Debug for Opened {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Opened({}, {} reviews)", self.source.title(), self.reviews.len())
    }
}

/// A computed result; its kind is that of its [`Request`].
#[derive(Clone, Debug)]
pub enum Computed {
    /// Of [`Request::Sample`].
    Sample(Arc<Sample>),
    /// Of [`Request::Labels`].
    Labels(Box<PairLabels>),
    /// Of [`Request::Tool`].
    Tool(Arc<NamedTool>),
    /// Of [`Request::Stored`] and [`Request::Prediction`].
    Predictions(Keyed),
    /// Of [`Request::Imprint`] and [`Request::Thumbnail`].
    Depth(Arc<DepthMap>),
    /// Of [`Request::Imprint`] where a color sensor was predicted.
    Color(Arc<RgbGrid>),
    /// Of [`Request::Comparison`].
    Comparison(Arc<Comparison>),
    /// Of [`Request::Ledger`].
    Ledger(Arc<LedgerResult>),
    /// Of [`Request::Ambiguity`]; `None` for an image without a finite pixel.
    Ambiguity(Option<Ambiguity>),
    /// Of [`Request::Ensemble`].
    Ensemble(Arc<Ensemble>),
    /// Of [`Request::Mask`].
    Mask(Box<ContactMask>),
    /// Of [`Request::Cloud`].
    Cloud(Arc<Clouds>),
    /// Of [`Request::Pose`] and [`Request::Run`].
    Pose(Arc<PoseResult>),
    /// Of [`Request::Layers`].
    Layers(Arc<LayerResult>),
    /// Of [`Request::Inspection`].
    Inspection(Arc<Inspection>),
    /// Of [`Request::Basin`].
    Basin(Arc<Basin>),
}

/// A pair whose labels are to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelsToSave {
    /// The opening of the data set it is of.
    pub seq: DatasetSeq,
    /// Its name.
    pub name: String,
    /// The number of this request.
    pub revision: Revision,
    /// What to write.
    pub labels: PairLabels,
}
