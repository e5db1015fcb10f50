//! The refit shift: statistics of the open data set's own predictions.

use std::path::PathBuf;
use std::sync::Arc;

use super::super::effect::{Access, Effect, Errand};
use super::super::keys::{PredictionKey, ShiftMode};
use super::super::source::DataSource;
use super::super::state::State;
use super::super::state::tasks::TaskKind;
use super::super::{recipe, results, settings, tasks};
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::PadId;
use touch2touch_work::bundles::{BundleInfo, BundleKind};
use touch2touch_work::error::TaskError;
use touch2touch_work::io::statistics::ShiftStatistics;
use touch2touch_work::job::JobCx;
use touch2touch_work::models::GenerateInput;
use touch2touch_work::pairs;
use touch2touch_work::statistics::{PAIRS, StatisticsSetup, statistics};

/// The job on screen.
const TITLE: &str = "Shift statistics";

/// Starts a pass over the data set, unless one is under way.
pub(super) fn start(state: &mut State, effects: &mut Vec<Effect>) {
    if state.tasks.running.values().any(|task| task.kind == TaskKind::Refit && !task.cancelling) {
        return;
    }
    let ready = results::can_generate(state).and_then(|()| recipe::bundle(state, BundleKind::Generator).cloned());
    let bundle = match ready {
        Ok(bundle) => bundle,
        Err(absent) => return state.log.error(&TaskError::new(TITLE, absent.text().trim_end_matches('.'))),
    };
    let (Some(touch), Some(source)) =
        (state.touch_key(PadId::default()), state.library.open.as_ref().map(|open| open.source.clone()))
    else {
        return;
    };
    let Some(recipe) = recipe::prediction(state, touch) else { return };
    let title = format!("{TITLE} of {}", source.title());
    tasks::start(state, title, Refit { recipe, bundle, source }, effects);
}

/// Makes shift statistics of a data set.
pub struct Refit {
    /// How its touches are predicted; the touch itself is replaced.
    recipe: PredictionKey,
    bundle: BundleInfo,
    source: Arc<dyn DataSource>,
}

impl Errand for Refit {
    /// The statistics, and where they are kept.
    type End = (ShiftStatistics, Option<PathBuf>);
    const KIND: TaskKind = TaskKind::Refit;

    fn run(self, access: &Access, cx: &JobCx) -> Result<Self::End, TaskError> {
        let Self { recipe, bundle, source } = self;
        let pairs = pairs::spread(source.index().pairs.len(), Some(PAIRS));
        let rig = source.rig();
        let ends = bundle.ends(&rig).transpose().map_err(|err| TaskError::from_error(TITLE, &err))?;
        let setup = StatisticsSetup {
            pairs: pairs.map(|at| PairId(at as u32)).collect(),
            fingers: rig.pad_list(),
            input: ends.ok_or_else(|| TaskError::new(TITLE, "the bundle is not a generator"))?.input,
            config: recipe.config,
            dataset: source.title().to_owned(),
            bundle,
        };
        let predict = |wanted: GenerateInput<'_>, cx: &JobCx| {
            let made = access.services.predict(&setup.bundle, recipe.runtime, &setup.config, &[wanted], cx)?;
            made.into_iter().next().ok_or_else(|| TaskError::new(TITLE, "no answer"))
        };
        let (found, _) = statistics(&setup, |pair| source.load(pair).map(Arc::new), predict, cx)?;
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
