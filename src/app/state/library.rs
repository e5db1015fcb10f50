//! The open data set, and the list of pairs as the browser shows it.

use std::ops::Range;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use strum::EnumIter;

use super::super::keys::{DatasetSeq, MaskRecipe, PairKey, PredictionKey};
pub use super::super::source::Place;
use super::super::source::Source;
use super::evaluate::TableState;
use super::labels::Document;
use touch2touch_core::dataset::{Index, PairEntry, PairId};
use touch2touch_core::rig::{Rig, SensorKind};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::labels::filter::Filter;
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind, by_id};

with_texts! {
    /// The order of the browser's list.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, EnumIter)]
    #[serde(rename_all = "snake_case")]
    pub enum Sort(name) {
        /// By position in the data set.
        #[default]
        Natural = "Natural",
        /// By name, as text.
        Name = "Name",
        /// By tool, then position.
        Tool = "Tool",
        /// Unfinished first, then position.
        Review = "Review state",
        /// By the chosen score, the worst first unless chosen otherwise; what was not scored last.
        Score = "Score",
    }
}

/// An open data set.
#[derive(Clone, Debug)]
pub struct OpenDataset {
    /// This opening.
    pub seq: DatasetSeq,
    /// The place.
    pub place: Place,
    /// The data.
    pub source: Arc<Source>,
    /// The tools, sorted, each once.
    pub tools: Vec<String>,
}

impl OpenDataset {
    /// All pairs.
    pub fn index(&self) -> &Index {
        &self.source.dataset.index
    }

    /// The key of `pair` in this opening.
    pub fn key(&self, pair: PairId) -> PairKey {
        PairKey { dataset: self.seq, pair }
    }
}

/// A folder that is followed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Follow {
    /// Touches that arrived.
    pub arrived: usize,
    /// Files among them that could not be read.
    pub broken: usize,
    /// The name of the newest.
    pub newest: Option<String>,
}

/// The open data set and its list.
#[derive(Clone, Debug, Default)]
pub struct Library {
    /// The open data set.
    pub open: Option<OpenDataset>,
    /// The place that is being opened.
    pub opening: Option<Place>,
    /// Why the last opening failed, until the next one.
    pub failure: Option<TaskError>,
    /// The number of the last opening.
    pub last_seq: DatasetSeq,
    /// The arrivals in the folder while it is followed; `None` while it is not.
    pub follow: Option<Follow>,
    /// Shows only pairs whose name, tool or note contains every word (any case). `tool:`, `is:` and `note:` narrow a word;
    /// `has:note` are pairs with one; `angle>5` is a condition on a score.
    pub filter: String,
    /// Times that the unit of a CAD model was named: what is said of the data set is looked up again then.
    pub(in crate::app) units_named: u64,
    /// Shows only this tool.
    pub tool: Option<String>,
    /// The order.
    pub sort: Sort,
    /// The pairs that pass the filter, in order.
    pub order: Vec<PairId>,
    /// The rows of `order` that the browser shows: thumbnails are made for these.
    pub rows: Range<usize>,
    /// The bundles found.
    pub bundles: Vec<BundleInfo>,
    /// The problems of bundles that were refused.
    pub bundle_problems: Vec<TaskError>,
}

impl Library {
    /// True where a data set is the one that is open: what is of an earlier opening comes too late.
    pub(in crate::app) fn is_open(&self, seq: DatasetSeq) -> bool {
        self.open.as_ref().is_some_and(|open| open.seq == seq)
    }

    /// The index of what is open; empty when nothing is.
    pub fn pairs(&self) -> &[PairEntry] {
        self.open.as_ref().map_or(&[], |open| &open.index().pairs)
    }

    /// The entry of `pair`.
    pub fn entry(&self, pair: PairId) -> Option<&PairEntry> {
        self.pairs().get(pair.0 as usize)
    }

    /// The row of `pair` in the list, if it passes the filter.
    pub(crate) fn row_of(&self, pair: PairId) -> Option<usize> {
        self.order.iter().position(|p| *p == pair)
    }

    /// The bundle with this identity.
    pub fn bundle(&self, id: &str) -> Option<&BundleInfo> {
        by_id(&self.bundles, id)
    }

    /// The first bundle of a kind for the sensors of `rig` whose name is `name`, else the first of that kind.
    pub(crate) fn bundle_named(&self, kind: BundleKind, name: Option<&str>, rig: &Rig) -> Option<&BundleInfo> {
        let mut of_kind = self.bundles.iter().filter(|b| b.kind == kind && b.fits(rig));
        // What was made for one's own data is used where it is chosen.
        let first = of_kind.clone().find(|bundle| !bundle.is_own()).or_else(|| of_kind.clone().next());
        match name {
            Some(name) => of_kind.find(|b| b.name == name).or(first),
            None => first,
        }
    }

    /// Recomputes `order` from filter, tool and sort.
    pub(in crate::app) fn reorder(&mut self, document: &Document, table: &TableState) {
        let filter = Filter::parse(&self.filter);
        let scored = |id: PairId| filter.conditions.iter().all(|condition| table.meets(id, condition));
        let review = |entry: &PairEntry| document.review(&entry.name);
        let passes = |entry: &PairEntry| {
            self.tool.as_ref().is_none_or(|tool| entry.tool.as_ref() == Some(tool))
                && filter.passes(entry, review(entry), document.note(&entry.name))
        };
        let pairs = self.pairs();
        let mut order: Vec<PairId> =
            (0u32..).map(PairId).zip(pairs).filter(|(id, e)| passes(e) && scored(*id)).map(|(id, _)| id).collect();
        let entry = |id: &PairId| &pairs[id.0 as usize];
        match self.sort {
            Sort::Natural | Sort::Score => {}
            Sort::Name => order.sort_by(|a, b| entry(a).name.cmp(&entry(b).name)),
            Sort::Tool => order.sort_by(|a, b| entry(a).tool.cmp(&entry(b).tool)),
            Sort::Review => order.sort_by_key(|id| review(entry(id))),
        }
        if let Some((source, figure)) = table.by().filter(|_| self.sort == Sort::Score) {
            let mut scored: Vec<(Option<f64>, PairId)> =
                order.iter().map(|id| (source.value(*id, figure), *id)).collect();
            let best_first = table.chosen.best_first;
            scored.sort_by(|(a, _), (b, _)| match (a, b) {
                (Some(a), Some(b)) if best_first => figure.worse(*b, *a),
                (Some(a), Some(b)) => figure.worse(*a, *b),
                _ => b.is_some().cmp(&a.is_some()),
            });
            order = scored.into_iter().map(|(_, id)| id).collect();
        }
        self.order = order;
    }

    /// True where what a generator predicts is a color picture.
    pub(crate) fn predicts_color(&self, bundle: &str) -> bool {
        let bundle = self.bundle(bundle).and_then(|bundle| bundle.generator.as_ref());
        bundle.is_some_and(|generator| generator.sensors.output.kind == SensorKind::Color)
    }

    /// The name of the model that made a prediction.
    pub(crate) fn model_name(&self, bundle: &str) -> &str {
        self.bundle(bundle).map_or("a model that is gone", |bundle| &*bundle.name)
    }

    /// The making of a prediction, in the words that stand beside it wherever it is shown: `model · 2 steps · seed 42`.
    pub fn made_with(&self, recipe: &PredictionKey) -> String {
        format!("{} · {}", self.model_name(&recipe.bundle), recipe.config.text())
    }

    /// The name of the mask model that a recipe takes; empty where it takes none.
    pub(crate) fn mask_model(&self, recipe: &MaskRecipe) -> &str {
        match recipe {
            MaskRecipe::Unet(id, _) => self.bundle(id).map_or("", |bundle| &bundle.name),
            _ => "",
        }
    }
}

/// A pair's name without its folder and without its tool, which is said beside it.
pub fn short_name(entry: &PairEntry) -> &str {
    let name = entry.name.rsplit('/').next().unwrap_or(&entry.name);
    let rest = entry.tool.as_deref().and_then(|tool| name.strip_prefix(tool)).map(|rest| rest.trim_start_matches('_'));
    rest.filter(|rest| !rest.is_empty()).unwrap_or(name)
}
