//! Jobs of the studio: where they run, how a request becomes one, and what of a prediction under way would be looked at.

pub mod generate;
pub mod prepare;

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use super::keys::{PredictionKey, ShiftMode, TouchKey};
use super::results::Preview;
use crate::work::job::{PreviewPicture, Previews};

/// Where a job runs. Each lane has its own threads, so that none waits for another kind of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter)]
pub enum Lane {
    /// Reading and writing files: one thread, in order.
    Files,
    /// Computing.
    Compute,
    /// Running models: one thread, which keeps them loaded.
    Models,
    /// What takes minutes and must not hold up anything else: one thread.
    Batch,
}

impl Lane {
    /// The name of its threads.
    pub fn name(self) -> &'static str {
        match self {
            Self::Files => "files",
            Self::Compute => "compute",
            Self::Models => "models",
            Self::Batch => "batch",
        }
    }
}

/// Receives pictures on the way.
pub type PreviewSink = Arc<dyn Fn(Preview) + Send + Sync>;

/// What of a prediction under way would be looked at now. The runtime keeps it up to date while jobs run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PreviewWish {
    /// After so many steps, and after the first; 0 = never.
    pub every: u32,
    /// How they become meters.
    pub shift: ShiftMode,
    /// The touches whose predicted imprint is on screen.
    pub touches: BTreeSet<TouchKey>,
}

impl PreviewWish {
    /// Whether a picture of `touch` is wanted after `step` steps.
    pub fn wants(&self, touch: TouchKey, step: u32) -> bool {
        self.every > 0 && (step == 1 || step.is_multiple_of(self.every)) && self.touches.contains(&touch)
    }
}

/// Who looks at the pictures of predictions on the way, whichever they are.
#[derive(Clone)]
pub struct Onlooker {
    /// What would be looked at now.
    pub wish: Arc<Mutex<PreviewWish>>,
    /// Receives it.
    pub sink: PreviewSink,
}

impl Onlooker {
    /// The same for the predictions of one call, in its order.
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
        let wish = self.by.wish.lock().unwrap_or_else(PoisonError::into_inner);
        wish.wants(self.items.get(item)?.touch, step).then_some(wish.shift)
    }

    fn show(&self, item: usize, picture: PreviewPicture) {
        if let Some(recipe) = self.items.get(item).cloned() {
            (self.by.sink)(Preview { recipe, picture });
        }
    }
}
