//! What the Evaluate workspace asks for, and its last answer.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::super::state::State;
use super::super::tasks::state::{Task, Ticket};
use crate::domain::evaluation::{Row, paper_rows};
use crate::work::bundles::{BundleInfo, BundleKind};
use crate::work::evaluate::{Evaluation, Setup};

/// Grasps of each tool that the studio offers; `None` is all of them.
pub const GRASPS: [Option<usize>; 5] = [Some(2), Some(4), Some(10), Some(20), None];

/// The table and how it is asked for.
#[derive(Clone, Debug)]
pub struct TableState {
    /// Generators that get no row, by bundle.
    pub left_out: BTreeSet<Arc<str>>,
    /// At most so many grasps of each tool.
    pub grasps_per_tool: Option<usize>,
    /// Whether published figures are shown as well.
    pub published: bool,
    /// The evaluation under way.
    pub running: Option<Ticket>,
    /// The last table of the open data set.
    pub result: Option<Arc<Evaluation>>,
}

impl Default for TableState {
    fn default() -> Self {
        Self { left_out: BTreeSet::new(), grasps_per_tool: Some(4), published: false, running: None, result: None }
    }
}

impl State {
    /// The generators for the sensors of the data, and whether each gets a row.
    pub fn evaluated(&self) -> impl Iterator<Item = (&BundleInfo, bool)> {
        let rig = self.rig();
        self.library
            .bundles
            .iter()
            .filter(move |b| b.kind == BundleKind::Generator && b.fits(&rig))
            .map(|b| (b, !self.table.left_out.contains(&b.id)))
    }

    /// What an evaluation started now would do; `None` without data or with nothing to score.
    pub fn evaluation_setup(&self) -> Option<Setup> {
        self.library.open.as_ref()?;
        let origin = |kind| self.bundle(kind).ok().map(|b| b.origin.clone());
        let bundles: Vec<_> = self.evaluated().filter(|(_, chosen)| *chosen).map(|(b, _)| b.origin.clone()).collect();
        (!bundles.is_empty()).then(|| Setup {
            bundles,
            mask_bundle: origin(BundleKind::Mask),
            classifier: origin(BundleKind::Classifier),
            mask: self.settings.mask.choice,
            engine: self.settings.pose_engine,
            shift: self.settings.shift,
            runtime: self.settings.runtime,
            grasps_per_tool: self.table.grasps_per_tool,
            ..Setup::default()
        })
    }

    /// The evaluation under way.
    pub fn evaluating(&self) -> Option<(Ticket, &Task)> {
        let ticket = self.table.running?;
        Some((ticket, self.tasks.running.get(&ticket)?))
    }

    /// The rows to show: those of the table, and the published ones if wanted.
    pub fn table_rows(&self) -> Vec<Row> {
        let Some(result) = &self.table.result else { return Vec::new() };
        let mut rows = result.rows.clone();
        if self.table.published {
            rows.extend(paper_rows());
        }
        rows
    }
}
