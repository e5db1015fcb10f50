//! The room of the preferences. Each change is saved.

pub mod state;

pub use state::scene::{LayerLook, LayerSize, SceneLayer, SceneLook};
pub use state::versus::{Versus, VersusMode};
pub use state::{
    BRUSH_RADIUS_PX, CLEAN_MM, ColorMap, ColorRange, GenerateSettings, Last, MAX_CACHE_MIB, MAX_RECENT, MaskChoice,
    MaskSettings, MaskSource, MaskTool, ProposalSource, SETTINGS_VERSION, STEPS, Settings, Theme, Workspace,
};

use super::action::{Action, Shortcut};
use super::effect::Effect;
use super::keys::{ImprintSource, RegistrationChoice, ShiftMode};
use super::state::State;
use touch2touch_core::label::Paint;
use touch2touch_work::infer::engine::EngineChoice;

/// What can happen to the preferences.
#[derive(Clone, Debug)]
pub enum SettingsCommand {
    /// Light or dark.
    SetTheme(Theme),
    /// Scale of the window.
    SetUiZoom(f32),
    /// The color range.
    SetRange(ColorRange),
    /// Sets the color range once from what is shown.
    RangeFromShown,
    /// The color map.
    SetColorMap(ColorMap),
    /// How predictions become meters.
    SetShift(ShiftMode),
    /// The generator.
    SetGenerate(GenerateSettings),
    /// The mask tools.
    SetMask(MaskSettings),
    /// The tool in hand.
    SetMaskTool(MaskTool),
    /// What the tools make of pixels.
    SetPaint(Paint),
    /// The tool before.
    LastMaskTool,
    /// The automatic source.
    SetMaskSource(MaskSource),
    /// Brush radius, pixels.
    SetBrushRadius(f32),
    /// Whether the mask is drawn.
    SetMaskVisible(bool),
    /// Whether only its outline is.
    SetMaskOutline(bool),
    /// How strongly it covers, 0..1.
    SetMaskOpacity(f32),
    /// Whether the GelSlim's window is drawn.
    SetFootprintVisible(bool),
    /// Whether what the last change of a mask started from is drawn.
    SetGhosts(bool),
    /// The registration.
    SetPoseEngine(RegistrationChoice),
    /// The model runtime.
    SetRuntime(EngineChoice),
    /// Who labels; empty: whom the system says.
    SetPerson(String),
    /// How many of the pairs that one marked done come back, percent.
    SetRepeats(f32),
    /// What kept predictions may take on the disk, MiB.
    SetCacheBudget(u32),
    /// Whether the 3D views move together.
    SetCamerasLinked(bool),
    /// How the 3D views look.
    SetScene(SceneLook),
    /// What is compared with what, in the workspace in front.
    SetVersus(Versus),
    /// The workspace in front.
    SetWorkspace(Workspace),
    /// The arrangement of the panes of a workspace, in the window's format.
    SetLayout(Workspace, String),
    /// What is on screen as the window is closed.
    Remember(Last),
    /// Another shortcut of an action, in the place of its `place`th (0 is the main one, behind the last one more) or none
    /// there. It is taken from the action that has it.
    BindKey {
        /// Whose.
        action: Action,
        /// Which of its shortcuts.
        place: usize,
        /// What is pressed for it.
        shortcut: Option<Shortcut>,
    },
    /// The default shortcuts back, of one action or of all.
    ResetKeys(Option<Action>),
    /// The hint of the first start is not shown again.
    DismissHint,
    /// All preferences back to their defaults; recent places stay.
    ResetSettings,
}

pub(super) fn step(state: &mut State, command: SettingsCommand, effects: &mut Vec<Effect>) {
    let before = state.settings.clone();
    let settings = &mut state.settings;
    match command {
        SettingsCommand::SetTheme(theme) => settings.theme = theme,
        SettingsCommand::SetUiZoom(zoom) => settings.ui_zoom = zoom,
        SettingsCommand::SetRange(range) => {
            if range.is_valid() {
                settings.range = range;
            }
            follow_range(state);
        }
        SettingsCommand::RangeFromShown => range_from_shown(state),
        SettingsCommand::SetColorMap(map) => settings.color_map = map,
        SettingsCommand::SetShift(shift) => settings.shift = shift,
        SettingsCommand::SetGenerate(generate) => {
            // Whoever changes a number of a preset has left it.
            let before = &settings.generate;
            let left = generate.preset == before.preset && !generate.same_numbers(before);
            let preset = generate.preset.filter(|_| !left);
            settings.generate = GenerateSettings { preset, ..generate };
        }
        SettingsCommand::SetMask(mask) => settings.mask = mask,
        SettingsCommand::SetMaskTool(tool) => set_tool(settings, tool),
        SettingsCommand::SetPaint(paint) => settings.mask.paint = paint,
        SettingsCommand::LastMaskTool => set_tool(settings, settings.mask.last_tool),
        SettingsCommand::SetMaskSource(source) => settings.mask.choice.source = source,
        SettingsCommand::SetBrushRadius(radius_px) => settings.mask.radius_px = radius_px,
        SettingsCommand::SetMaskVisible(visible) => settings.mask_visible = visible,
        SettingsCommand::SetMaskOutline(outline) => settings.mask_outline = outline,
        SettingsCommand::SetMaskOpacity(opacity) => settings.mask_opacity = opacity,
        SettingsCommand::SetFootprintVisible(visible) => settings.footprint_visible = visible,
        SettingsCommand::SetGhosts(shown) => settings.ghosts = shown,
        SettingsCommand::SetPoseEngine(engine) => settings.pose_engine = engine,
        SettingsCommand::SetRuntime(runtime) => settings.runtime = runtime,
        SettingsCommand::SetPerson(person) => settings.person = person,
        SettingsCommand::SetRepeats(percent) => settings.repeats_percent = percent,
        SettingsCommand::SetCacheBudget(mib) => settings.cache_mib = mib,
        SettingsCommand::SetCamerasLinked(linked) => settings.cameras_linked = linked,
        SettingsCommand::SetScene(look) => settings.scene = look.validated(),
        SettingsCommand::SetVersus(versus) => {
            settings.versus.insert(settings.workspace, versus);
        }
        SettingsCommand::SetWorkspace(workspace) => settings.workspace = workspace,
        SettingsCommand::SetLayout(workspace, layout) => {
            settings.layouts.insert(workspace.name().to_owned(), layout);
        }
        SettingsCommand::Remember(last) => settings.last = last,
        SettingsCommand::BindKey { action, place, shortcut } => settings.keys.bind(action, place, shortcut),
        SettingsCommand::ResetKeys(action) => settings.keys.reset(action),
        SettingsCommand::DismissHint => settings.hint_dismissed = true,
        SettingsCommand::ResetSettings => {
            let recent = std::mem::take(&mut settings.recent);
            *settings = Settings { recent, hint_dismissed: true, ..Settings::default() };
            state.own = None;
        }
    }
    state.settings = std::mem::take(&mut state.settings).validated();
    if state.settings != before {
        save(state, effects);
    }
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

/// Has the settings written.
pub(super) fn save(state: &State, effects: &mut Vec<Effect>) {
    // What a case brought is gone with it.
    let kept = match &state.own {
        Some(own) => own.as_ref().clone().of_person(&state.settings),
        None => state.settings.clone(),
    };
    effects.push(Effect::SaveSettings(Box::new(kept)));
}
