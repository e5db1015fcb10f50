//! The refit shift: statistics of the open data set's own predictions.

use std::path::PathBuf;
use std::sync::Arc;

use super::super::effect::{Access, Effect, Task};
use super::super::keys::{ImprintSource, ShiftMode};
use super::super::source::Source;
use super::super::state::State;
use super::super::state::tasks::TaskKind;
use super::super::{recipe, results, settings, tasks};
use touch2touch_core::dataset::PairId;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::statistics::ShiftStatistics;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::pairs;
use touch2touch_pipeline::scores::statistics::{PAIRS, StatisticsSetup, statistics};
use touch2touch_pipeline::steps::bundles::BundleKind;
use touch2touch_pipeline::steps::recipe::Recipe;

/// The job on screen.
const TITLE: &str = "Shift statistics";

/// Starts a pass over the data set, unless one is under way.
pub(super) fn start(state: &mut State, effects: &mut Vec<Effect>) {
    if state.tasks.running.values().any(|task| task.kind == TaskKind::Refit && !task.cancelling) {
        return;
    }
    let ready = results::can_generate(state).and_then(|()| recipe::bundle(state, BundleKind::Generator));
    if let Err(absent) = ready {
        return state.log.error(&TaskError::new(TITLE, absent.text().trim_end_matches('.')));
    }
    let Some(source) = state.library.open.as_ref().map(|open| open.source.clone()) else { return };
    let recipe = recipe::in_force(state, ImprintSource::Predicted);
    tasks::start(state, format!("{TITLE} of {}", source.dataset.title), Refit { recipe, source }, effects);
}

/// Makes shift statistics of a data set.
pub struct Refit {
    recipe: Recipe,
    source: Arc<Source>,
}

impl Task for Refit {
    /// The statistics, and where they are kept.
    type End = (ShiftStatistics, Option<PathBuf>);
    const KIND: TaskKind = TaskKind::Refit;

    fn run(self, access: &Access, cx: &JobCx) -> Result<Self::End, TaskError> {
        let Self { recipe, source } = self;
        let pairs = pairs::spread(source.dataset.index.pairs.len(), Some(PAIRS));
        let setup = StatisticsSetup {
            pairs: pairs.map(|at| PairId(at as u32)).collect(),
            fingers: source.dataset.rig.pad_list(),
            recipe,
            dataset: source.dataset.title.clone(),
        };
        let (found, _) = statistics(&setup, |pair| source.load(pair).map(Arc::new), &access.services.models, cx)?;
        let saved = access.services.save_statistics(&found)?;
        Ok((found, saved))
    }

    /// Uses them.
    fn ended((statistics, saved): &Self::End, state: &mut State, effects: &mut Vec<Effect>) {
        let p = &statistics.provenance;
        match statistics.shift_for(&p.bundle, &p.bundle_hash) {
            Ok(shift) => {
                let place = saved.as_ref().map_or(String::new(), |file| format!(", kept in {}", file.display()));
                state.log.info(format!(
                    "Shift statistics of {} touches of {} with {}{place}",
                    statistics.touches, p.dataset, p.bundle
                ));
                state.settings.refit = Some(shift);
                state.settings.shift = ShiftMode::Refit(shift);
                settings::save(state, effects);
            }
            Err(err) => state.log.error(&TaskError::from_error(TITLE, &err)),
        }
    }
}
