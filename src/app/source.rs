//! [`DataSource`]: an open data set, as the model needs it; tests put their own behind it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use touch2touch_core::dataset::{Index, PairId, Problem};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::Rig;
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::{ExportChoice, Plan};
use touch2touch_pipeline::follow::Following;
use touch2touch_pipeline::io::dataset::{Dataset, ToolUnit};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{JournalHistory, Operation, PairLabels, Unsaved};
use touch2touch_pipeline::steps::tool::{UnitSet, set_unit};

/// An open data set: its index is in memory, samples and labels are read on demand, from any thread.
pub trait DataSource: Send + Sync {
    /// The name on screen.
    fn title(&self) -> &str;
    /// The folder; `None` for the demo.
    fn root(&self) -> Option<&Path>;
    /// The data set as the command line sees it, for work on all of its pairs; `None` where there is no such thing.
    fn as_dataset(&self) -> Option<&Dataset> {
        None
    }
    /// The data set as the command line sees it, for the job `what`.
    ///
    /// # Errors
    /// If there is no such thing.
    fn on_disk(&self, what: &str) -> Result<&Dataset, TaskError> {
        let why = "this kind of source cannot be read outside the studio";
        self.as_dataset().ok_or_else(|| TaskError::new(what, why))
    }
    /// The sensors that its touches were felt with.
    fn rig(&self) -> Arc<Rig> {
        Rig::lab()
    }
    /// All pairs.
    fn index(&self) -> &Index;
    /// The problems of its other files.
    fn problems(&self) -> &[Problem];

    /// Reads one pair.
    ///
    /// # Errors
    /// With the file and the reason if it cannot be read.
    fn load(&self, pair: PairId) -> Result<Sample, TaskError>;

    /// The CAD model of a tool, meters, object frame.
    ///
    /// # Errors
    /// If there is none, or it cannot be read.
    fn tool_mesh(&self, tool: &str) -> Result<TriMesh, TaskError>;

    /// Has a tool's CAD file read in a unit from now on; `replacing` is what the file beside it says now.
    ///
    /// # Errors
    /// As [`set_unit`].
    fn set_tool_unit(&self, tool: &str, unit: ToolUnit, replacing: Option<&str>) -> Result<UnitSet, TaskError> {
        match self.as_dataset() {
            Some(dataset) => set_unit(dataset, tool, unit, replacing),
            None => Err(TaskError::new(format!("Read {tool} in {}", unit.name()), "this data set has no files")),
        }
    }

    /// Follows its folder for touches that appear; `None` for a source without a folder.
    fn follow(&self) -> Option<Following> {
        None
    }

    /// Itself with a data set that grew while it was followed: known pairs keep their ids, and what was labeled stays known.
    fn grown(&self, _dataset: &Arc<Dataset>) -> Option<Arc<dyn DataSource>> {
        None
    }

    /// Reads the labels stored for a pair; empty if there are none.
    ///
    /// # Errors
    /// If there are some and they cannot be read: then they must not be written either.
    fn load_labels(&self, name: &str) -> Result<PairLabels, TaskError>;

    /// The changes that were made of them before, and those that were taken back.
    fn past(&self, _name: &str, _labels: &PairLabels) -> JournalHistory {
        JournalHistory::default()
    }

    /// Writes the labels of a pair, so that a kill at any moment leaves the old or the new ones, and says what was done. The
    /// labels as they are then, where somebody else changed them as well.
    ///
    /// # Errors
    /// If they cannot be written.
    fn save_labels(&self, name: &str, labels: &PairLabels, deed: &Operation) -> Result<Option<PairLabels>, TaskError>;

    /// Writes labels that could not be written where they belong into a folder; `None` = where they wait for the next opening.
    /// Returns the place where they are then.
    ///
    /// # Errors
    /// If they cannot be written there either.
    fn keep_labels(&self, _unsaved: &[Unsaved], _folder: Option<&Path>) -> Result<PathBuf, TaskError> {
        Err(TaskError::new("Keep the labels elsewhere", "this source keeps none"))
    }

    /// The plan of an export of masks. `changed` is newer than what is stored.
    ///
    /// # Errors
    /// If the masks cannot be divided.
    fn plan_masks(&self, changed: &BTreeMap<String, PairLabels>, choice: ExportChoice) -> Result<Plan, TaskError>;

    /// Writes masks for UNet training; returns a line for the log. `changed` is newer than what is stored.
    ///
    /// # Errors
    /// If not all could be written and read back.
    fn export_masks(
        &self,
        changed: &BTreeMap<String, PairLabels>,
        choice: ExportChoice,
        folder: &Path,
        cx: &JobCx,
    ) -> Result<String, TaskError>;
}

/// A touch that arrived in a followed folder.
#[derive(Clone)]
pub struct Followed {
    /// The data set with all pairs so far: those known before keep their ids.
    pub source: Arc<dyn DataSource>,
    /// The touch.
    pub pair: PairId,
    /// True where it was there before, and only its bubble came later.
    pub completed: bool,
    /// The tensors, or why they cannot be read.
    pub sample: Result<Arc<Sample>, TaskError>,
}

impl std::fmt::Debug for Followed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Followed({:?}, whole: {})", self.pair, self.sample.is_ok())
    }
}
