//! The form of the results table, and its last answer.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::super::keys::TableKey;
use super::super::scores::{ScoreTable, SourceScores};
use touch2touch_core::dataset::PairId;
use touch2touch_core::evaluation::{Condition, Metric, Row, paper_rows};
use touch2touch_pipeline::scores::evaluate::Evaluation;

/// Grasps of each tool that the studio offers; `None` is all of them.
pub(crate) const GRASPS: [Option<usize>; 5] = [Some(2), Some(4), Some(10), Some(20), None];

/// The table and how it is asked for.
#[derive(Clone, Debug, Default)]
pub struct TableState {
    /// Generators that get no row, by bundle.
    pub left_out: BTreeSet<Arc<str>>,
    /// At most so many grasps of each tool.
    pub grasps_per_tool: Option<usize>,
    /// True where published metrics are shown as well.
    pub published: bool,
    /// The last table of the open data set.
    pub result: Option<Arc<Evaluation>>,
    /// The recipe by which kept scores were looked up for it last.
    pub(in crate::app) looked_up: Option<TableKey>,
    /// The scores that are kept of the open data set.
    pub scores: Arc<ScoreTable>,
    /// The number of times that scores were computed: those kept are looked up again then.
    pub(in crate::app) round: u64,
    /// Grasps of the evaluation under way at which that is done next.
    pub(in crate::app) next_look: u64,
    /// The score that the list is ordered by, as it was chosen.
    pub chosen: ScoreChoice,
}

/// The score that the list is ordered, colored and filtered by.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ScoreChoice {
    /// The source, by name; `None` for the first generator.
    pub source: Option<Arc<str>>,
    /// The metric; `None` for the first that is there: the angle, if any is known.
    pub metric: Option<Metric>,
    /// True where the best come first.
    pub best_first: bool,
}

impl TableState {
    /// The source and the metric that the list is ordered by; `None` while nothing is scored.
    pub fn by(&self) -> Option<(&SourceScores, Metric)> {
        let sources = &self.scores.sources;
        let named = self.chosen.source.as_ref().and_then(|name| sources.iter().find(|source| source.name == *name));
        let source = named.or_else(|| sources.iter().find(|source| !source.upper_bound)).or(sources.first())?;
        let chosen = self.chosen.metric.filter(|metric| source.has(*metric));
        Some((source, chosen.or_else(|| source.metrics().next())?))
    }

    /// The value of a pair that the list is ordered by.
    pub fn value(&self, pair: PairId) -> Option<f64> {
        let (source, metric) = self.by()?;
        source.value(pair, metric)
    }

    /// True where a pair meets a condition; one that was not scored does not.
    pub(in crate::app) fn meets(&self, pair: PairId, condition: &Condition) -> bool {
        let source = match condition.source.as_str() {
            "" => self.by().map(|(source, _)| source),
            name => self.scores.source(name),
        };
        source.and_then(|source| source.value(pair, condition.metric)).is_some_and(|value| condition.passes(value))
    }

    /// The rows to show: those of the table, and the published ones if wanted.
    pub(crate) fn rows(&self) -> Vec<Row> {
        let Some(result) = &self.result else { return Vec::new() };
        let mut rows = result.rows.clone();
        if self.published {
            rows.extend(paper_rows());
        }
        rows
    }
}
