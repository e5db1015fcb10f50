//! [`ScoreTable`]: the scores of the pairs of a data set, as lists and pictures show them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use strum::IntoEnumIterator as _;

use touch2touch_core::dataset::{Index, PairId};
use touch2touch_core::evaluation::{GraspScore, Metric, Scores};

/// The scores of the pairs of a data set by each source.
#[derive(Debug, Default)]
pub struct ScoreTable {
    /// The measured imprints first, where they are scored; each has scores.
    pub sources: Vec<SourceScores>,
}

/// The scores of the pairs by one source.
#[derive(Debug)]
pub struct SourceScores {
    /// The name.
    pub name: Arc<str>,
    /// True where these are the measured imprints themselves.
    pub upper_bound: bool,
    /// Pairs that were scored.
    pub scored: usize,
    /// By pair.
    grasps: Vec<Option<GraspScore>>,
    /// The metrics that some pair has.
    metrics: BTreeSet<Metric>,
}

impl SourceScores {
    /// The name without what is said in parentheses.
    pub fn short(&self) -> &str {
        self.name.split(" (").next().unwrap_or(&self.name)
    }

    /// The metrics that some pair has.
    pub fn metrics(&self) -> impl Iterator<Item = Metric> {
        self.metrics.iter().copied()
    }

    /// True where some pair has a metric.
    pub fn has(&self, metric: Metric) -> bool {
        self.metrics.contains(&metric)
    }

    /// A metric of a pair; `None` where it was not scored.
    pub fn value(&self, pair: PairId, metric: Metric) -> Option<f64> {
        self.grasp(pair)?.metric(metric)
    }

    /// The scores of a pair; `None` where it was not scored.
    pub fn grasp(&self, pair: PairId) -> Option<&GraspScore> {
        self.grasps.get(pair.0 as usize)?.as_ref()
    }
}

impl ScoreTable {
    /// Of the pairs of an index, by name.
    pub fn new(index: &Index, scores: &[Scores]) -> Self {
        let places: BTreeMap<&str, usize> = index.pairs.iter().map(|entry| entry.name.as_str()).zip(0..).collect();
        let source = |scores: &Scores| {
            let mut grasps = vec![None; index.pairs.len()];
            for grasp in &scores.grasps {
                if let Some(place) = places.get(grasp.pair.as_str()) {
                    grasps[*place] = Some(grasp.clone());
                }
            }
            let metrics =
                Metric::iter().filter(|metric| grasps.iter().flatten().any(|grasp| grasp.metric(*metric).is_some()));
            let (name, upper_bound, metrics) = (scores.method.as_str().into(), scores.upper_bound, metrics.collect());
            let scored = grasps.iter().flatten().count();
            SourceScores { name, upper_bound, scored, grasps, metrics }
        };
        Self { sources: scores.iter().map(source).filter(|source| source.scored > 0).collect() }
    }

    /// The source of a name, or whose name has a word in it, whatever its case.
    pub fn source(&self, name: &str) -> Option<&SourceScores> {
        let part = |source: &&SourceScores| source.name.to_lowercase().contains(&name.to_lowercase());
        self.sources.iter().find(|source| *source.name == *name).or_else(|| self.sources.iter().find(part))
    }
}
