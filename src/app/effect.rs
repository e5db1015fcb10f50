//! [`Effect`]: what `apply` wants done outside the state.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::export::state::{PairExport, Recipes};
use super::keys::{DatasetSeq, PredictionKey, Revision};
use super::labels::state::PairLabels;
use super::library::state::Place;
use super::services::DataSource;
use super::settings::state::Settings;
use super::tasks::state::Ticket;
use super::view::state::UiRequest;
use touch2touch_core::sample::Sample;
use touch2touch_work::adapt::{AdaptSetup, Adapted};
use touch2touch_work::bundles::BundleInfo;
use touch2touch_work::case::CaseSetup;
use touch2touch_work::error::TaskError;
use touch2touch_work::evaluate::{Evaluation, Setup};
use touch2touch_work::export::ExportChoice;
use touch2touch_work::figure::FigureSetup;
use touch2touch_work::import::ImportSetup;
use touch2touch_work::io::dataset::ToolUnit;
use touch2touch_work::labels::{Deed, Unsaved};
use touch2touch_work::propose::BatchSetup;
use touch2touch_work::sweep::SweepSetup;
use touch2touch_work::train::TrainSetup;

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
    /// What was done.
    pub deed: Deed,
    /// Who draws it a second time, apart from the pair's labels; `None` for these.
    pub repeat: Option<String>,
}

/// Labels that could not be written.
#[derive(Clone)]
pub struct NotSaved {
    /// The data set they are of.
    pub source: Arc<dyn DataSource>,
    /// What was to be written.
    pub save: LabelsToSave,
    /// Why not.
    pub err: TaskError,
}

impl std::fmt::Debug for NotSaved {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "NotSaved({}, {})", self.save.name, self.err)
    }
}

/// Work that leaves the state.
#[derive(Clone)]
pub enum Effect {
    /// Read a data set's index.
    Open {
        /// The job.
        ticket: Ticket,
        /// The number of this opening.
        seq: DatasetSeq,
        /// What to open.
        place: Place,
    },
    /// Follow the folder of a data set, or none any more.
    Follow(Option<(DatasetSeq, Arc<dyn DataSource>)>),
    /// Look for bundles.
    FindBundles(Vec<PathBuf>),
    /// Make predictions of one pair, all in one go.
    Generate {
        /// The job.
        ticket: Ticket,
        /// What to make.
        recipes: Vec<PredictionKey>,
        /// The bundle.
        bundle: BundleInfo,
        /// The data.
        source: Arc<dyn DataSource>,
        /// The pair, if it is loaded.
        sample: Option<Arc<Sample>>,
    },
    /// Make shift statistics of a data set.
    Refit {
        /// The job.
        ticket: Ticket,
        /// How its touches are predicted; the touch itself is replaced.
        recipe: PredictionKey,
        /// The bundle.
        bundle: BundleInfo,
        /// The data.
        source: Arc<dyn DataSource>,
    },
    /// Tell a job to stop.
    Cancel(Ticket),
    /// Write the labels of a pair; a newer request for the same pair replaces a waiting one.
    SaveLabels(Arc<dyn DataSource>, Box<LabelsToSave>),
    /// Write labels that could not be written where they belong to another folder.
    KeepLabels {
        /// The data.
        source: Arc<dyn DataSource>,
        /// What is to be written.
        unsaved: Vec<Unsaved>,
        /// Where to; `None` = where they wait for the next opening.
        folder: Option<PathBuf>,
        /// The requests that it is the answer to.
        revisions: Vec<(String, Revision)>,
    },
    /// Write the settings; a newer request replaces a waiting one.
    SaveSettings(Box<Settings>),
    /// Write masks for UNet training.
    ExportMasks {
        /// The job.
        ticket: Ticket,
        /// The data.
        source: Arc<dyn DataSource>,
        /// Labels changed since they were read, by pair name: newer than the files.
        labels: BTreeMap<String, PairLabels>,
        /// Which of them, and how they are divided.
        choice: ExportChoice,
        /// Where to.
        folder: PathBuf,
    },
    /// Take masks over that lie in a form of other programs.
    ImportMasks {
        /// The job.
        ticket: Ticket,
        /// The data.
        source: Arc<dyn DataSource>,
        /// Which, and how.
        setup: ImportSetup,
    },
    /// Have a tool's CAD file read in a unit.
    SetUnit {
        /// The job.
        ticket: Ticket,
        /// The opening.
        seq: DatasetSeq,
        /// The data.
        source: Arc<dyn DataSource>,
        /// The tool.
        tool: String,
        /// The unit.
        unit: ToolUnit,
        /// What the file beside it says now, as the person was told.
        replacing: Option<String>,
    },
    /// Score the open data set.
    Evaluate {
        /// The job.
        ticket: Ticket,
        /// The data.
        source: Arc<dyn DataSource>,
        /// By what, and how.
        setup: Box<Setup>,
    },
    /// Turn a dial over the open data set.
    Sweep {
        /// The job.
        ticket: Ticket,
        /// The data.
        source: Arc<dyn DataSource>,
        /// Which one, and how.
        setup: Box<SweepSetup>,
    },
    /// Propose masks for many pairs of the open data set.
    ProposeAll {
        /// The job.
        ticket: Ticket,
        /// The data.
        source: Arc<dyn DataSource>,
        /// Which, and how.
        setup: Box<BatchSetup>,
    },
    /// Fit a generator to pairs, where the program keeps models.
    Adapt {
        /// The job.
        ticket: Ticket,
        /// The data.
        source: Arc<dyn DataSource>,
        /// What to what.
        setup: Box<AdaptSetup>,
    },
    /// Write a fit that was refused.
    KeepFit {
        /// The job.
        ticket: Ticket,
        /// The fit.
        adapted: Arc<Adapted>,
    },
    /// Train a mask model, and keep the new one where the program keeps models.
    Train {
        /// The job.
        ticket: Ticket,
        /// The data.
        source: Arc<dyn DataSource>,
        /// What was said about pairs, as far as it may not be on the disk yet.
        labels: BTreeMap<String, PairLabels>,
        /// What on what.
        setup: Box<TrainSetup>,
    },
    /// Write a results table into a folder.
    ExportTable {
        /// The job.
        ticket: Ticket,
        /// The table.
        evaluation: Arc<Evaluation>,
        /// Whether with the published rows.
        published: bool,
        /// Where to.
        folder: PathBuf,
    },
    /// Draw a figure into a file.
    Figure {
        /// The job.
        ticket: Ticket,
        /// The data.
        source: Arc<dyn DataSource>,
        /// What to draw.
        setup: Box<FigureSetup>,
        /// The predictions in it.
        recipes: Recipes,
        /// Where to.
        file: PathBuf,
    },
    /// Write a pair for other programs.
    ExportPair {
        /// The job.
        ticket: Ticket,
        /// What of it.
        pair: Box<PairExport>,
        /// Where to.
        folder: PathBuf,
    },
    /// Write a case.
    SaveCase {
        /// The job.
        ticket: Ticket,
        /// The data.
        source: Arc<dyn DataSource>,
        /// What goes into it.
        setup: Box<CaseSetup>,
        /// Where to.
        file: PathBuf,
    },
    /// Show a file or folder in the system's own window.
    Reveal(PathBuf),
    /// Something only the window can do.
    Ui(UiRequest),
}

impl Effect {
    /// Has labels wait for the next opening of their data set.
    pub(super) fn keep_waiting(source: Arc<dyn DataSource>, unsaved: Vec<Unsaved>) -> Self {
        Self::KeepLabels { source, unsaved, folder: None, revisions: Vec::new() }
    }
}

impl std::fmt::Debug for Effect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Open { place, .. } => write!(f, "Open({place})"),
            Self::Follow(of) => write!(f, "Follow({:?})", of.as_ref().map(|(seq, _)| seq)),
            Self::FindBundles(folders) => write!(f, "FindBundles({folders:?})"),
            Self::Generate { ticket, recipes, .. } => write!(f, "Generate({ticket:?}, {recipes:?})"),
            Self::Refit { ticket, recipe, .. } => write!(f, "Refit({ticket:?}, {recipe:?})"),
            Self::Cancel(ticket) => write!(f, "Cancel({ticket:?})"),
            Self::SaveLabels(_, save) => write!(f, "SaveLabels({})", save.name),
            Self::KeepLabels { unsaved, folder, .. } => write!(f, "KeepLabels({}, {folder:?})", unsaved.len()),
            Self::SaveSettings(_) => write!(f, "SaveSettings"),
            Self::ExportMasks { folder, .. } => write!(f, "ExportMasks({})", folder.display()),
            Self::ImportMasks { setup, .. } => write!(f, "ImportMasks({})", setup.from.display()),
            Self::SetUnit { tool, unit, .. } => write!(f, "SetUnit({tool}, {unit:?})"),
            Self::Evaluate { ticket, .. } => write!(f, "Evaluate({ticket:?})"),
            Self::Sweep { ticket, .. } => write!(f, "Sweep({ticket:?})"),
            Self::ProposeAll { ticket, .. } => write!(f, "ProposeAll({ticket:?})"),
            Self::Adapt { ticket, .. } => write!(f, "Adapt({ticket:?})"),
            Self::KeepFit { ticket, .. } => write!(f, "KeepFit({ticket:?})"),
            Self::Train { ticket, .. } => write!(f, "Train({ticket:?})"),
            Self::ExportTable { folder, .. } => write!(f, "ExportTable({})", folder.display()),
            Self::Figure { setup, file, .. } => write!(f, "Figure({:?}, {})", setup.pairs, file.display()),
            Self::ExportPair { folder, .. } => write!(f, "ExportPair({})", folder.display()),
            Self::SaveCase { file, .. } => write!(f, "SaveCase({})", file.display()),
            Self::Reveal(place) => write!(f, "Reveal({})", place.display()),
            Self::Ui(request) => write!(f, "Ui({request:?})"),
        }
    }
}
