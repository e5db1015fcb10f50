//! What the Evaluate workspace asks for, and its last answer.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use strum::IntoEnumIterator as _;

use super::super::state::State;
use super::super::tasks::state::{Task, Ticket};
use crate::domain::evaluation::{Figure, GraspScore, Row, paper_rows};
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
    /// The place of each pair in [`TableState::scored`], by name.
    places: BTreeMap<String, usize>,
}

impl Default for TableState {
    fn default() -> Self {
        Self {
            left_out: BTreeSet::new(),
            grasps_per_tool: Some(4),
            published: false,
            running: None,
            result: None,
            places: BTreeMap::new(),
        }
    }
}

impl TableState {
    /// Takes a table over, or gives the last one up.
    pub(in crate::app) fn set_result(&mut self, result: Option<Arc<Evaluation>>) {
        self.result = result;
        let names = self.scored().iter().enumerate().map(|(at, grasp)| (grasp.pair.clone(), at));
        self.places = names.collect();
    }

    /// The figures of every grasp by the first generator of the table.
    pub fn scored(&self) -> &[GraspScore] {
        let first = self.result.as_ref().and_then(|found| found.scores.iter().find(|scores| !scores.upper_bound));
        first.map_or(&[], |scores| &scores.grasps)
    }

    /// A figure of a pair, by its name; `None` where it was not scored.
    pub fn figure(&self, pair: &str, figure: Figure) -> Option<f64> {
        self.scored().get(*self.places.get(pair)?)?.figure(figure)
    }

    /// The figure that pairs are called worst by where nobody chose one: the angle, if any is known.
    pub fn worst_by(&self) -> Option<Figure> {
        Figure::iter().find(|figure| self.scored().iter().any(|grasp| grasp.figure(*figure).is_some()))
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
