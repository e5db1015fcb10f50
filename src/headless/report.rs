//! Folders of outputs: what the files of each pair are called, and [`RunReport`], which says from the first output on
//! whether the run ended.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use touch2touch_pipeline::io::atomic;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::names::Outputs;

/// Paths of the pairs' files, without an ending, each pair's its own; the folder is made if it is not there. A run that
/// would write two pairs to one file ends here, before it wrote anything.
pub(super) fn output_stems(folder: &Path, dataset: &Dataset, ids: &[usize]) -> anyhow::Result<Vec<PathBuf>> {
    let mut outputs = Outputs::new(folder)?;
    Ok(ids.iter().map(|id| outputs.stem(&dataset.index.pairs[*id].name)).collect::<Result<_, _>>()?)
}

/// A report that was begun. Without [`RunReport::finish`] it stays one of an unfinished run.
pub(super) struct RunReport {
    file: PathBuf,
}

#[derive(Serialize)]
struct Finished<'a, T: Serialize> {
    finished: bool,
    #[serde(flatten)]
    report: &'a T,
}

impl RunReport {
    /// Replaces the last run's report by one that says that `meant` outputs are being made. Call it before the first
    /// output is written, and after everything that may refuse the run.
    pub(super) fn begin(folder: &Path, name: &str, meant: usize) -> anyhow::Result<Self> {
        let begun = Self { file: folder.join(name) };
        begun.write(&json!({
            "finished": false, "meant": meant,
            "note": "the run that writes this folder has not ended; files in it may be of an earlier run",
        }))?;
        Ok(begun)
    }

    /// Puts the whole report there, as that of a finished run.
    pub(super) fn finish(self, report: &impl Serialize) -> anyhow::Result<()> {
        self.write(&Finished { finished: true, report })
    }

    fn write(&self, value: &impl Serialize) -> anyhow::Result<()> {
        Ok(atomic::write_json(&self.file, "cannot write the report", value)?)
    }
}
