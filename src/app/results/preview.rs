//! Pictures of predictions on the way, and who looks at them.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use super::super::keys::{ImprintSource, PredictionKey, Preview, ShiftMode, TouchKey};
use super::super::pane::Demand;
use super::super::state::State;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::job::{PreviewPicture, Previews};

/// Receives pictures on the way.
pub(crate) type PreviewSink = Arc<dyn Fn(Preview) + Send + Sync>;

/// The pictures of predictions under way that would be looked at now. The runtime keeps this up to date while jobs run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PreviewRequest {
    /// After so many steps, and after the first; 0 = never.
    pub every: u32,
    /// The mapping to meters.
    pub shift: ShiftMode,
    /// The touches whose predicted imprint is on screen.
    pub touches: BTreeSet<TouchKey>,
}

impl PreviewRequest {
    /// True where a picture of `touch` is wanted after `step` steps.
    pub fn wants(&self, touch: TouchKey, step: u32) -> bool {
        self.every > 0 && (step == 1 || step.is_multiple_of(self.every)) && self.touches.contains(&touch)
    }
}

/// Who looks at the pictures of predictions on the way, whichever they are.
#[derive(Clone)]
pub struct Onlooker {
    /// The pictures that would be looked at now.
    pub request: Arc<Mutex<PreviewRequest>>,
    /// Receives it.
    pub sink: PreviewSink,
}

impl Onlooker {
    /// The onlooker of the predictions of one call, in its order.
    pub fn of(self, items: Vec<PredictionKey>) -> Arc<dyn Previews> {
        Arc::new(Watched { by: self, items })
    }
}

struct Watched {
    by: Onlooker,
    items: Vec<PredictionKey>,
}

impl Previews for Watched {
    fn wants(&self, item: usize, step: u32) -> Option<ShiftMode> {
        let request = self.by.request.lock().unwrap_or_else(PoisonError::into_inner);
        request.wants(self.items.get(item)?.touch, step).then_some(request.shift)
    }

    fn show(&self, item: usize, picture: PreviewPicture) {
        if let Some(recipe) = self.items.get(item).cloned() {
            (self.by.sink)(Preview { recipe, picture });
        }
    }
}

/// The prediction on its way to one finger of the selected pair, as it looks now.
pub fn preview(state: &State, finger: PadId) -> Option<&Arc<Preview>> {
    state.results.previews.get(&state.touch_key(finger)?).filter(|_| state.document.stroke.is_none())
}

/// The pictures of predictions under way that would be looked at: the predicted imprints on screen, unless a pen is on them.
pub fn preview_request(state: &State) -> PreviewRequest {
    let shown = state.needs(Demand::Imprint(ImprintSource::Predicted)) && state.document.stroke.is_none();
    let touches = match state.pair_key().filter(|_| shown) {
        Some(pair) => state.fingers().into_iter().map(|finger| pair.finger(finger)).collect(),
        None => Default::default(),
    };
    PreviewRequest { every: state.settings.generate.preview_every, shift: state.settings.shift, touches }
}
