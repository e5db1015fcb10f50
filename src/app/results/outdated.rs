//! Predictions on screen that the settings in force would not make.

use super::super::state::State;
use super::super::{recipe, results};
use touch2touch_core::rig::PadId;

/// A prediction on screen that the settings in force would not make.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outdated {
    /// The words for its making: `model · 2 steps · seed 42`.
    pub made_with: String,
    /// Why it is shown all the same.
    pub why: Why,
}

/// Why a prediction is shown that the settings in force would not make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// A person picked it under these settings.
    Picked,
    /// The prediction that the settings ask for is on its way.
    OnItsWay,
    /// The prediction that the settings ask for was not made.
    NotMade,
}

impl Why {
    /// True where it is meant to be shown.
    pub(crate) fn is_meant(self) -> bool {
        self == Self::Picked
    }
}

/// The notice about the prediction shown for a finger where the settings in force would make another one.
pub fn outdated(state: &State, finger: PadId) -> Option<Outdated> {
    let touch = state.touch_key(finger)?;
    let shown = results::shown(state, touch)?;
    let named = recipe::prediction(state, touch);
    if named.as_ref() == Some(shown) {
        return None;
    }
    let generating = || named.as_ref().is_some_and(|named| state.tasks.generating(named).is_some());
    let why = if results::picked(state, touch).is_some() {
        Why::Picked
    } else if generating() || results::prefetch(state, finger).is_some() {
        Why::OnItsWay
    } else {
        Why::NotMade
    };
    Some(Outdated { made_with: state.library.made_with(shown), why })
}
