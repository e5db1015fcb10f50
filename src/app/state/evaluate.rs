//! The form of the results table, and its last answer.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::super::keys::DatasetSeq;
use super::super::scores::{ScoreTable, SourceScores};
use touch2touch_core::dataset::{Index, PairId};
use touch2touch_core::evaluation::{Condition, Metric, Row, Scores, paper_rows};
use touch2touch_pipeline::scores::evaluate::Evaluation;
use touch2touch_pipeline::steps::recipe::Recipe;

/// The table and how it is asked for.
#[derive(Clone, Debug, Default)]
pub struct TableState {
    /// Generators that get no row, by bundle.
    pub left_out: BTreeSet<Arc<str>>,
    /// True where published metrics are shown as well.
    pub published: bool,
    /// The last table of the open data set.
    pub result: Option<Arc<Evaluation>>,
    /// The opening that an evaluation from before was looked for.
    pub(in crate::app) looked_up: Option<DatasetSeq>,
    /// The scores of the pairs of the open data set, as lists show them.
    pub scores: Arc<ScoreTable>,
    /// The scores that these are made of, with the recipe that they have in common.
    pub(in crate::app) scored: Option<(Recipe, Vec<Scores>)>,
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
    /// Takes the scores of an evaluation; earlier ones by the same recipe stay where it has none.
    pub(in crate::app) fn take(&mut self, evaluation: &Evaluation, index: &Index) {
        let recipe = evaluation.setup.recipe.clone();
        let mut all = evaluation.scores.clone();
        // Nobody looks at these, and they are most of it.
        for scores in &mut all {
            scores.measured_features = Vec::new();
            scores.grasps.iter_mut().flat_map(|g| &mut g.images).for_each(|image| image.features = Vec::new());
        }
        for before in self.scored.take().filter(|(by, _)| *by == recipe).into_iter().flat_map(|(_, scores)| scores) {
            match all.iter_mut().find(|scores| scores.method == before.method) {
                Some(now) => {
                    let known: BTreeSet<String> = now.grasps.iter().map(|grasp| grasp.pair.clone()).collect();
                    now.grasps.extend(before.grasps.into_iter().filter(|grasp| !known.contains(&grasp.pair)));
                }
                None => all.push(before),
            }
        }
        self.scores = Arc::new(ScoreTable::new(index, &all));
        self.scored = Some((recipe, all));
    }

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
