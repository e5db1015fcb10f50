//! What the Evaluate workspace asks for, and its last answer.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use strum::IntoEnumIterator as _;

use super::super::state::State;
use touch2touch_core::dataset::{Index, PairId};
use touch2touch_core::evaluation::{Condition, GraspScore, Metric, Row, Scores, paper_rows};
use touch2touch_work::bundles::{BundleInfo, BundleKind};
use touch2touch_work::evaluate::{Evaluation, Setup};
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::queue::{Queue, QueueBy};
use touch2touch_work::recipe::Recipe;

/// Grasps of each tool that the studio offers; `None` is all of them.
pub(crate) const GRASPS: [Option<usize>; 5] = [Some(2), Some(4), Some(10), Some(20), None];

/// The table and how it is asked for.
#[derive(Clone, Debug)]
pub struct TableState {
    /// Generators that get no row, by bundle.
    pub left_out: BTreeSet<Arc<str>>,
    /// At most so many grasps of each tool.
    pub grasps_per_tool: Option<usize>,
    /// Whether published metrics are shown as well.
    pub published: bool,
    /// The last table of the open data set.
    pub result: Option<Arc<Evaluation>>,
    /// The scores that are kept of the open data set.
    pub scores: Arc<ScoreTable>,
    /// How often scores were computed: what is kept is looked up again then.
    pub(in crate::app) round: u64,
    /// Grasps of the evaluation under way at which that is done next.
    pub(in crate::app) next_look: u64,
    /// The score that the list is ordered by, as it was chosen.
    pub chosen: ScoreChoice,
    /// What uncertainty is, where the list is ordered by that.
    pub uncertain_by: QueueBy,
}

impl Default for TableState {
    fn default() -> Self {
        Self {
            left_out: BTreeSet::new(),
            grasps_per_tool: Some(4),
            published: false,
            result: None,
            scores: Arc::default(),
            round: 0,
            next_look: 0,
            chosen: ScoreChoice::default(),
            uncertain_by: QueueBy::default(),
        }
    }
}

/// Which score the list is ordered, colored and filtered by.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ScoreChoice {
    /// The source, by name; `None` for the first generator.
    pub source: Option<Arc<str>>,
    /// The metric; `None` for the first that is there: the angle, if any is known.
    pub metric: Option<Metric>,
    /// Whether the best come first.
    pub best_first: bool,
}

/// The scores of the pairs of a data set by each source.
#[derive(Debug, Default)]
pub struct ScoreTable {
    /// The measured imprints first, where they are scored; each has scores.
    pub sources: Vec<SourceScores>,
    /// Which pairs are worth a look first.
    pub queue: Queue,
}

/// The scores of the pairs by one source.
#[derive(Debug)]
pub struct SourceScores {
    /// Its name.
    pub name: Arc<str>,
    /// Whether these are the measured imprints themselves.
    pub upper_bound: bool,
    /// Pairs that were scored.
    pub scored: usize,
    /// By pair.
    grasps: Vec<Option<GraspScore>>,
    /// The metrics that some pair has, each with the badness beyond which a value is among the worst tenth, and beyond
    /// which among the next two.
    metrics: BTreeMap<Metric, [f64; 2]>,
}

/// How a value stands among those of all pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Grade {
    /// Among the better seven tenths.
    Fine,
    /// Among the three worst tenths.
    Poor,
    /// Among the worst tenth.
    Worst,
}

impl SourceScores {
    /// The name without what is said in parentheses.
    pub fn short(&self) -> &str {
        self.name.split(" (").next().unwrap_or(&self.name)
    }

    /// The metrics that some pair has.
    pub fn metrics(&self) -> impl Iterator<Item = Metric> {
        self.metrics.keys().copied()
    }

    /// Whether some pair has a metric.
    pub fn has(&self, metric: Metric) -> bool {
        self.metrics.contains_key(&metric)
    }

    /// A metric of a pair; `None` where it was not scored.
    pub fn value(&self, pair: PairId, metric: Metric) -> Option<f64> {
        self.grasps.get(pair.0 as usize)?.as_ref()?.metric(metric)
    }

    /// How a value of a metric stands among those of all pairs.
    pub(crate) fn standing(&self, metric: Metric, value: f64) -> Grade {
        let bad = metric.badness(value);
        match self.metrics.get(&metric) {
            _ if value.is_nan() => Grade::Worst,
            Some([worst, _]) if bad > *worst => Grade::Worst,
            Some([_, poor]) if bad > *poor => Grade::Poor,
            _ => Grade::Fine,
        }
    }
}

impl ScoreTable {
    /// Of the pairs of an index, by name.
    pub fn new(index: &Index, scores: Vec<Scores>) -> Self {
        let queue = Queue::of(index, &scores);
        let places: BTreeMap<&str, usize> = index.pairs.iter().map(|entry| entry.name.as_str()).zip(0..).collect();
        let source = |scores: Scores| {
            let mut grasps = vec![None; index.pairs.len()];
            for mut grasp in scores.grasps {
                // Nobody looks at these, and they are most of it.
                grasp.images.iter_mut().for_each(|image| image.features = Vec::new());
                if let Some(place) = places.get(grasp.pair.as_str()) {
                    grasps[*place] = Some(grasp);
                }
            }
            let metrics = Metric::iter().filter_map(|metric| {
                let values = grasps.iter().flatten().filter_map(|grasp| grasp.metric(metric));
                let mut badness: Vec<f64> = values.map(|value| metric.badness(value)).collect();
                badness.sort_by(f64::total_cmp);
                let at = |tenths: usize| badness.get((badness.len() * tenths / 10).checked_sub(1)?).copied();
                (!badness.is_empty()).then(|| (metric, [9, 7].map(|tenths| at(tenths).unwrap_or(f64::INFINITY))))
            });
            let (name, upper_bound, metrics) = (scores.method.as_str().into(), scores.upper_bound, metrics.collect());
            let scored = grasps.iter().flatten().count();
            SourceScores { name, upper_bound, scored, grasps, metrics }
        };
        Self { sources: scores.into_iter().map(source).filter(|source| source.scored > 0).collect(), queue }
    }

    /// Bytes that it holds, about.
    pub(in crate::app) fn bytes(&self) -> usize {
        let queued: usize = self.queue.pairs.iter().map(|queued| 64 + 32 * queued.parts.len()).sum();
        queued + self.sources.iter().map(|source| source.grasps.len() * 768).sum::<usize>()
    }

    /// The source of a name, or whose name has a word in it, whatever its case.
    pub fn source(&self, name: &str) -> Option<&SourceScores> {
        let part = |source: &&SourceScores| source.name.to_lowercase().contains(&name.to_lowercase());
        self.sources.iter().find(|source| *source.name == *name).or_else(|| self.sources.iter().find(part))
    }
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

    /// Whether a pair meets a condition; one that was not scored does not.
    pub(in crate::app) fn meets(&self, pair: PairId, condition: &Condition) -> bool {
        let source = match condition.source.as_str() {
            "" => self.by().map(|(source, _)| source),
            name => self.scores.source(name),
        };
        source.and_then(|source| source.value(pair, condition.metric)).is_some_and(|value| condition.passes(value))
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
    pub(crate) fn evaluation_setup(&self) -> Option<Setup> {
        self.library.open.as_ref()?;
        let bundles: Vec<_> = self.evaluated().filter(|(_, chosen)| *chosen).map(|(b, _)| b.origin.clone()).collect();
        (!bundles.is_empty()).then(|| Setup {
            bundles,
            classifier: self.bundle(BundleKind::Classifier).ok().map(|b| b.origin.clone()),
            recipe: Recipe { generator: None, ..self.in_force(ImprintSource::Measured) },
            grasps_per_tool: self.table.grasps_per_tool,
            ..Setup::default()
        })
    }

    /// The rows to show: those of the table, and the published ones if wanted.
    pub(crate) fn table_rows(&self) -> Vec<Row> {
        let Some(result) = &self.table.result else { return Vec::new() };
        let mut rows = result.rows.clone();
        if self.table.published {
            rows.extend(paper_rows());
        }
        rows
    }
}
