//! The room of the preferences. Each change is saved.

pub use super::pane::Workspace;
pub use super::state::settings::compare::{CompareChoice, CompareMode};
pub use super::state::settings::scene::{SceneLayer, SceneLook};
pub(crate) use super::state::settings::{BRUSH_RADIUS_PX, CLEAN_MM, MAX_CACHE_MIB, STEPS};
pub use super::state::settings::{
    ColorMap, ColorRange, GelView, GenerateSettings, Last, MaskChoice, MaskSettings, MaskSource, MaskTool,
    ProposalSource, Settings, SpacePane, Theme, ToolRow, WindowPlace,
};

use std::fmt;
use std::sync::Arc;

use serde_json::Value;

use super::effect::Effect;
use super::keys::ImprintSource;
use super::results;
use super::state::State;

/// A command to the preferences.
#[derive(Clone, Debug)]
pub enum SettingsCommand {
    /// Takes over what a person changed ([`prefer`]).
    Change(Change),
    /// Sets the color range once from what is shown.
    RangeFromShown,
    /// The arrangement of the panes of a workspace, in the window's format.
    SetLayout(Workspace, String),
    /// The screen as the window is closed.
    Remember(Last),
    /// All preferences back to their defaults; recent places stay.
    ResetSettings,
}

/// A change to the preferences. A function rather than the new preferences whole, so that two in one frame both count.
#[derive(Clone)]
pub struct Change(Arc<dyn Fn(&mut Settings) + Send + Sync>);

impl fmt::Debug for Change {
    /// The fields as they are once defaults were changed.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut changed = Settings::default();
        (self.0)(&mut changed);
        let [changed, default] = [&changed, &Settings::default()].map(|settings| serde_json::to_value(settings).ok());
        let (Some(Value::Object(changed)), Some(Value::Object(default))) = (changed, default) else {
            return f.write_str("Change");
        };
        f.debug_map().entries(changed.iter().filter(|(name, value)| default.get(*name) != Some(value))).finish()
    }
}

/// The command that changes preferences; numbers out of range are brought back, an impossible color range is left out.
pub fn prefer(change: impl Fn(&mut Settings) + Send + Sync + 'static) -> SettingsCommand {
    SettingsCommand::Change(Change(Arc::new(change)))
}

pub(super) fn step(state: &mut State, command: SettingsCommand, effects: &mut Vec<Effect>) {
    let before = state.settings.clone();
    let settings = &mut state.settings;
    match command {
        SettingsCommand::Change(change) => {
            (change.0)(settings);
            follow(state, &before);
        }
        SettingsCommand::RangeFromShown => range_from_shown(state),
        SettingsCommand::SetLayout(workspace, layout) => {
            settings.layouts.insert(workspace.name().to_owned(), layout);
        }
        SettingsCommand::Remember(last) => settings.last = last,
        SettingsCommand::ResetSettings => {
            let recent = std::mem::take(&mut settings.recent);
            *settings = Settings { recent, hint_dismissed: true, ..Settings::default() };
        }
    }
    state.settings = std::mem::take(&mut state.settings).validated();
    if state.settings != before {
        save(state, effects);
    }
}

/// Brings about what follows from a change.
fn follow(state: &mut State, before: &Settings) {
    let settings = &mut state.settings;
    // Whoever changes a number of a preset has left it.
    let generate = &mut settings.generate;
    if generate.preset == before.generate.preset && !generate.same_numbers(&before.generate) {
        generate.preset = None;
    }
    if !settings.range.is_valid() {
        settings.range = before.range;
    }
    if settings.range != before.range {
        follow_range(state);
    }
}

/// With an unlocked range, each pair gets its own.
pub(super) fn follow_range(state: &mut State) {
    if !state.settings.range.locked {
        range_from_shown(state);
    }
}

/// Spans the range over the imprints on screen, without the outermost half percent on each side: single flying
/// pixels must not take the contrast from the rest.
fn range_from_shown(state: &mut State) {
    const CUT: usize = 200;
    let mut values: Vec<f32> = Vec::new();
    for finger in state.fingers() {
        for source in [ImprintSource::Measured, ImprintSource::Predicted] {
            if let Some(imprint) = results::imprint(state, source, finger).ready() {
                values.extend(imprint.as_slice().iter().filter(|v| v.is_finite()));
            }
        }
    }
    if values.is_empty() {
        return;
    }
    let cut = values.len() / CUT;
    let at = |values: &mut Vec<f32>, index: usize| *values.select_nth_unstable_by(index, f32::total_cmp).1;
    let last = values.len() - 1;
    let (min_m, max_m) = (at(&mut values, cut), at(&mut values, last - cut));
    let range = ColorRange { min_m, max_m, ..state.settings.range };
    if range.is_valid() {
        state.settings.range = range;
    }
}

/// Has the settings written.
pub(super) fn save(state: &State, effects: &mut Vec<Effect>) {
    effects.push(Effect::SaveSettings(Box::new(state.settings.clone())));
}
