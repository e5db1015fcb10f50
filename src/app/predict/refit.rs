//! The refit shift: statistics of the open data set's own predictions.

use super::super::effect::Effect;
use super::super::keys::ShiftMode;
use super::super::settings;
use super::super::state::State;
use touch2touch_core::rig::PadId;
use touch2touch_work::bundles::BundleKind;
use touch2touch_work::error::TaskError;
use touch2touch_work::io::statistics::ShiftStatistics;

/// Name of the job on screen.
const TITLE: &str = "Shift statistics";

/// Starts a pass over the data set, unless one is under way.
pub(super) fn start(state: &mut State, effects: &mut Vec<Effect>) {
    if state.tasks.running.values().any(|task| task.title.starts_with(TITLE) && !task.cancelling) {
        return;
    }
    let ready = state.can_generate().and_then(|()| state.bundle(BundleKind::Generator).cloned());
    let bundle = match ready {
        Ok(bundle) => bundle,
        Err(absent) => return state.log.error(&TaskError::new(TITLE, absent.text().trim_end_matches('.'))),
    };
    let (Some(touch), Some(source)) =
        (state.touch_key(PadId::default()), state.library.open.as_ref().map(|open| open.source.clone()))
    else {
        return;
    };
    let Some(recipe) = state.recipe(touch) else { return };
    let ticket = state.tasks.start(format!("{TITLE} of {}", source.title()), Vec::new());
    effects.push(Effect::Refit { ticket, recipe, bundle, source });
}

/// Uses statistics that arrived.
pub(in crate::app) fn arrived(
    state: &mut State,
    statistics: &ShiftStatistics,
    saved: Option<String>,
    effects: &mut Vec<Effect>,
) {
    let p = &statistics.provenance;
    match statistics.shift_for(&p.bundle, &p.bundle_hash) {
        Ok(shift) => {
            let place = saved.map_or(String::new(), |file| format!(", kept in {file}"));
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
