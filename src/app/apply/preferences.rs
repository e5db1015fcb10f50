//! Changing preferences. Each change is saved.

use super::super::command::Command;
use super::super::effect::Effect;
use super::super::keys::ImprintSource;
use super::super::settings::{ColorRange, GenerateSettings, MaskTool, Settings};
use super::super::state::State;
use super::save_settings;

/// Carries out a preference command; gives any other back.
pub(super) fn step(state: &mut State, command: Command, effects: &mut Vec<Effect>) -> Option<Command> {
    let before = state.settings.clone();
    let settings = &mut state.settings;
    match command {
        Command::SetTheme(theme) => settings.theme = theme,
        Command::SetUiZoom(zoom) => settings.ui_zoom = zoom,
        Command::SetRange(range) => {
            if range.is_valid() {
                settings.range = range;
            }
            follow_range(state);
        }
        Command::RangeFromShown => range_from_shown(state),
        Command::SetColorMap(map) => settings.color_map = map,
        Command::SetShift(shift) => settings.shift = shift,
        Command::SetGenerate(generate) => {
            // Whoever changes a number of a preset has left it.
            let before = &settings.generate;
            let left = generate.preset == before.preset && !generate.same_numbers(before);
            let preset = generate.preset.filter(|_| !left);
            settings.generate = GenerateSettings { preset, ..generate };
        }
        Command::SetMask(mask) => settings.mask = mask,
        Command::SetMaskTool(tool) => set_tool(settings, tool),
        Command::LastMaskTool => set_tool(settings, settings.mask.last_tool),
        Command::SetMaskSource(source) => settings.mask.choice.source = source,
        Command::SetBrushRadius(radius_px) => settings.mask.radius_px = radius_px,
        Command::SetMaskVisible(visible) => settings.mask_visible = visible,
        Command::SetMaskOutline(outline) => settings.mask_outline = outline,
        Command::SetMaskOpacity(opacity) => settings.mask_opacity = opacity,
        Command::SetFootprintVisible(visible) => settings.footprint_visible = visible,
        Command::SetPoseEngine(engine) => settings.pose_engine = engine,
        Command::SetRuntime(runtime) => settings.runtime = runtime,
        Command::SetCacheBudget(mib) => settings.cache_mib = mib,
        Command::SetCamerasLinked(linked) => settings.cameras_linked = linked,
        Command::SetWorkspace(workspace) => settings.workspace = workspace,
        Command::SetLayout(workspace, layout) => {
            settings.layouts.insert(workspace.name().to_owned(), layout);
        }
        Command::DismissHint => settings.hint_dismissed = true,
        Command::ResetSettings => {
            let recent = std::mem::take(&mut settings.recent);
            *settings = Settings { recent, hint_dismissed: true, ..Settings::default() };
        }
        other => return Some(other),
    }
    state.settings = std::mem::take(&mut state.settings).validated();
    if state.settings != before {
        save_settings(state, effects);
    }
    None
}

fn set_tool(settings: &mut Settings, tool: MaskTool) {
    if settings.mask.tool != tool {
        settings.mask.last_tool = settings.mask.tool;
        settings.mask.tool = tool;
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
            if let Some(imprint) = state.imprint(source, finger).ready() {
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
