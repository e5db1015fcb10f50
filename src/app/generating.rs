//! What would be generated now, and what of it would be looked at on the way.

use std::sync::Arc;

use super::jobs::PreviewWish;
use super::keys::{ImprintSource, PredictionKey, TouchKey};
use super::pane::Need;
use super::results::Preview;
use super::state::State;
use crate::domain::rig::PadId;
use crate::work::bundles::BundleKind;

impl State {
    /// The recipe that the settings give a touch; `None` without a generator.
    pub fn recipe(&self, touch: TouchKey) -> Option<PredictionKey> {
        let bundle = self.bundle(BundleKind::Generator).ok()?;
        let config = self.settings.generate.config(bundle);
        Some(PredictionKey::new(touch, bundle.id.clone(), self.settings.runtime, &config))
    }

    /// The fingers whose prediction is looked at: those on screen, and both where a visible pane makes one cloud or
    /// pose of them (unless the settings say otherwise).
    pub fn fingers_to_generate(&self) -> Vec<PadId> {
        let (_, cloud) = self.shows_cloud(ImprintSource::Predicted);
        if cloud && self.settings.generate.both_fingers {
            return self.rig().pad_list();
        }
        let mut fingers = self.fingers();
        if !self.settings.generate.both_fingers {
            fingers.truncate(1);
        }
        fingers
    }

    /// The prediction on its way to one finger of the selected pair, as it looks now.
    pub fn preview(&self, finger: PadId) -> Option<&Arc<Preview>> {
        self.results.previews.get(&self.touch_key(finger)?).filter(|_| self.document.stroke.is_none())
    }

    /// What of a prediction under way would be looked at: the predicted imprints on screen, unless a pen is on them.
    pub fn preview_wish(&self) -> PreviewWish {
        let shown = self.needs(Need::Imprint(ImprintSource::Predicted)) && self.document.stroke.is_none();
        let touches = match self.pair_key().filter(|_| shown) {
            Some(pair) => self.fingers().into_iter().map(|finger| pair.finger(finger)).collect(),
            None => Default::default(),
        };
        PreviewWish { every: self.settings.generate.preview_every, shift: self.settings.shift, touches }
    }
}
