//! Keys of what is of a whole data set, or of a pair before anything is made of it.

use std::path::PathBuf;
use std::sync::Arc;

use super::super::keys::{DatasetSeq, Revision};
use touch2touch_pipeline::export::ExportChoice;
use touch2touch_pipeline::labels::{JournalHistory, PairLabels};
use touch2touch_pipeline::learn::train::TrainChoice;

/// A tool of a data set.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ToolKey {
    /// The opening of the data set.
    pub dataset: DatasetSeq,
    /// The name.
    pub name: Arc<str>,
}

/// Labels as they were read.
#[derive(Clone, Debug, PartialEq)]
pub struct Read {
    pub(crate) labels: PairLabels,
    /// The gestures of earlier runs.
    pub(crate) told: JournalHistory,
}

/// The plan of an export, of what is drawn and marked now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaskPlanKey {
    /// The data set.
    pub dataset: DatasetSeq,
    /// The choices.
    pub choice: ExportChoice,
    /// The last change of the document.
    pub revision: Revision,
}

/// The plan of an import, over what is drawn and marked now.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImportPlanKey {
    /// The data set.
    pub dataset: DatasetSeq,
    /// The import that is asked about.
    pub form: ImportForm,
    /// The last change of the document.
    pub revision: Revision,
}

/// An import of masks that is asked about: what it would change is said before anything changes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImportForm {
    /// The folder or file.
    pub from: PathBuf,
    /// True where what was painted by hand is replaced as well.
    pub over_drawn: bool,
    /// The number of the asking: files may be others than at the one before.
    pub(in crate::app) asked: u64,
}

/// Everything that decides what is said of the data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct AboutKey {
    /// The data set.
    pub dataset: DatasetSeq,
    /// Pairs that it has by now.
    pub pairs: usize,
    /// The last change of the document.
    pub revision: Revision,
    /// The number of times that scores or units of tools changed.
    pub units_named: u64,
}

/// The plan of a training, on what is drawn and marked now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TrainPlanKey {
    /// The data set.
    pub dataset: DatasetSeq,
    /// The division into pairs to learn from and pairs that are left out.
    pub choice: TrainChoice,
    /// The last change of the document.
    pub revision: Revision,
}
