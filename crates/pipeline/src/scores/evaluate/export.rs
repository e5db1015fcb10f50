//! The table in files.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::Evaluation;
use crate::error::TaskError;
use crate::io::atomic;
use touch2touch_core::evaluation::{self, Row, Scores, paper_rows};

/// The evaluation as one JSON object.
#[derive(Serialize)]
pub struct Report<'a> {
    /// The table with what is behind it.
    #[serde(flatten)]
    pub evaluation: &'a Evaluation,
    /// Figures published on real data.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub published: Vec<Row>,
    /// Every method's figures of every grasp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pairs: Option<&'a [Scores]>,
}

/// The rows of the evaluation, and the published ones if wanted.
pub fn rows(evaluation: &Evaluation, published: bool) -> Vec<Row> {
    let mut rows = evaluation.rows.clone();
    if published {
        rows.extend(paper_rows());
    }
    rows
}

impl Evaluation {
    /// The size of the table: whose pairs are in it, and how many of them.
    pub fn size(&self) -> String {
        let Self { scored, of, dataset, .. } = self;
        if scored == of {
            format!("All {of} pairs of {dataset}")
        } else {
            format!("{scored} of {of} pairs of {dataset}")
        }
    }
}

/// The table as CSV, the pairs of the data set beside the grasps of a row.
pub fn csv(evaluation: &Evaluation, published: bool) -> String {
    evaluation::csv(&rows(evaluation, published), evaluation.of)
}

/// Writes `evaluation.csv` and `.json` (with every grasp) into a folder, which is made if missing; returns it.
///
/// # Errors
/// If one cannot be written.
pub fn export(evaluation: &Evaluation, published: bool, folder: &Path) -> Result<PathBuf, TaskError> {
    let fail = |why: String| TaskError::new("Export the table", format!("{why} ({})", folder.display()));
    std::fs::create_dir_all(folder).map_err(|err| fail(err.to_string()))?;
    let report = Report {
        evaluation,
        published: if published { paper_rows() } else { Vec::new() },
        pairs: Some(&evaluation.scores),
    };
    let json = serde_json::to_vec_pretty(&report).map_err(|err| fail(err.to_string()))?;
    for (name, bytes) in [("evaluation.csv", csv(evaluation, published).into_bytes()), ("evaluation.json", json)] {
        atomic::write_bytes(&folder.join(name), &bytes).map_err(|err| fail(err.to_string()))?;
    }
    Ok(folder.to_owned())
}
