//! The preferences of a person. Kept between runs; never part of undo.

pub mod compare;
pub mod scene;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use strum::EnumIter;

use super::super::action::Action;
use super::super::keys::{Preset, Registration, Sampler, ShiftMode, Spacing};
use super::super::pane::Workspace;
use super::library::{Place, Sort};
use compare::CompareChoice;
use scene::SceneLook;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::label::{CleanKind, CleanUp, DrawTool, Layers, Paint};
use touch2touch_core::postprocess::RefitShift;
use touch2touch_core::units::clamp_or;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::labels::system_person;
pub use touch2touch_pipeline::masks::propose::ProposalSource;
use touch2touch_pipeline::steps::bundles::BundleInfo;
pub use touch2touch_pipeline::steps::mask::{MaskChoice, MaskSource};
pub use touch2touch_pipeline::still::space::SpacePane;

/// The version of the settings file: a file of another version is set aside and defaults are used.
pub(crate) const SETTINGS_VERSION: u32 = 1;
/// The number of recent places that are kept.
pub(crate) const MAX_RECENT: usize = 12;
/// Brush radii that can be chosen, pixels.
pub(crate) const BRUSH_RADIUS_PX: std::ops::RangeInclusive<f32> = 0.5..=40.0;
/// Sizes of clean-ups, millimeters.
pub(crate) const CLEAN_MM: std::ops::RangeInclusive<f32> = 0.1..=20.0;
/// Denoising steps that can be chosen.
pub(crate) const STEPS: std::ops::RangeInclusive<u32> = 1..=1000;

/// Largest budget of kept predictions, MiB: a terabyte.
pub(crate) const MAX_CACHE_MIB: u32 = 1 << 20;

with_defaults! {
    /// All preferences.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct Settings {
        /// [`SETTINGS_VERSION`] of the program that wrote it.
        pub version: u32 = SETTINGS_VERSION,
        /// Colors of the window.
        pub theme: Theme = Theme::Dark,
        /// Scale of the whole window, 1 = the system's.
        pub ui_zoom: f32 = 1.0,
        /// The color range of imprints, shared by all panes.
        pub range: ColorRange = ColorRange::default(),
        /// The color map of imprints.
        pub color_map: ColorMap = ColorMap::Viridis,
        /// The mapping of predictions to meters.
        pub shift: ShiftMode = ShiftMode::default(),
        /// The last statistics made for a refit shift, to be chosen again.
        pub refit: Option<RefitShift> = None,
        /// The generator.
        pub generate: GenerateSettings = GenerateSettings::default(),
        /// The mask tools.
        pub mask: MaskSettings = MaskSettings::default(),
        /// The registration.
        #[serde(rename = "pose_engine")]
        pub registration: Registration = Registration::default(),
        /// The runtime that runs models.
        pub runtime: EngineChoice = EngineChoice::default(),
        /// The budget of the predictions kept on the disk, MiB; 0 keeps none.
        pub cache_mib: u32 = 512,
        /// Who labels; empty: whom the system says.
        pub person: String = String::new(),
        /// The look of the 3D views.
        pub scene: SceneLook = SceneLook::default(),
        /// The sides that have a 3D view, where a person chose them for a workspace.
        pub sides: std::collections::BTreeMap<Workspace, SpacePane> = std::collections::BTreeMap::new(),
        /// The GelSlim image that is shown.
        pub gel: GelView = GelView::default(),
        /// The comparison of each workspace.
        pub compare: std::collections::BTreeMap<Workspace, CompareChoice> = std::collections::BTreeMap::new(),
        /// True where the mask is drawn over imprints.
        pub mask_visible: bool = true,
        /// True where only the outline of the mask is drawn.
        pub mask_outline: bool = false,
        /// The opacity of the mask, 0..1.
        pub mask_opacity: f32 = 0.35,
        /// True where the GelSlim's window is drawn on bubble images.
        pub footprint_visible: bool = true,
        /// True where the hint of the first start was dismissed.
        pub hint_dismissed: bool = false,
        /// True where the panel about the data set opens with each folder of somebody's own.
        pub about_own_data: bool = true,
        /// The places that were opened before, newest first.
        pub recent: Vec<Place> = Vec::new(),
        /// The arrangement of the panes per workspace, in the window's own format (validated by it).
        pub layouts: std::collections::BTreeMap<String, String> = std::collections::BTreeMap::new(),
        /// The workspace in front.
        pub workspace: Workspace = Workspace::Inspect,
        /// Folders with further model bundles.
        pub bundle_folders: Vec<PathBuf> = Vec::new(),
        /// The screen when the window was closed.
        pub last: Last = Last::default(),
    }
}

/// The screen when the window was closed: shown again when the same place is opened next.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Last {
    /// The open data set.
    pub place: Option<Place>,
    /// The name of the pair.
    pub pair: String,
    /// The number of the active finger.
    pub finger: usize,
    /// True where both fingers were shown.
    pub both_fingers: bool,
    /// The cameras of the 3D views, in the window's own format; empty = fitted.
    pub cameras: [String; 2],
    /// The pane that filled the window, in the window's own format; empty = none.
    pub maximized: String,
    /// The order of the list.
    pub sort: Sort,
    /// Place of the window, where the system says it.
    pub window: Option<WindowPlace>,
}

/// Place of the window on the desktop, points.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowPlace {
    /// Upper left corner, with the frame.
    pub position: [f32; 2],
    /// Size, without the frame.
    pub size: [f32; 2],
    /// True where it filled the screen; place and size are those from before then.
    pub maximized: bool,
}

impl WindowPlace {
    /// True for a window that a screen can have.
    fn is_usable(self) -> bool {
        self.size.iter().all(|side| (1.0..=65535.0).contains(side))
            && self.position.iter().all(|at| at.abs() <= 65535.0)
    }
}

impl Settings {
    /// The comparison in the workspace in front.
    pub fn compare_mut(&mut self) -> &mut CompareChoice {
        self.compare.entry(self.workspace).or_default()
    }

    /// Brings numbers from a file or a text box back into the ranges that can be drawn and computed with.
    #[must_use]
    pub fn validated(mut self) -> Self {
        let default = Self::default();
        self.version = SETTINGS_VERSION;
        self.ui_zoom = clamp_or(self.ui_zoom, 0.5, 4.0, default.ui_zoom);
        self.mask_opacity = clamp_or(self.mask_opacity, 0.0, 1.0, default.mask_opacity);
        if !self.range.is_valid() {
            self.range = default.range;
        }
        self.generate = self.generate.validated();
        self.mask = self.mask.validated();
        self.scene = self.scene.validated();
        self.cache_mib = self.cache_mib.min(MAX_CACHE_MIB);
        self.person = self.person.chars().filter(|c| !c.is_control()).take(80).collect();
        self.recent.truncate(MAX_RECENT);
        self.last.window = self.last.window.filter(|window| window.is_usable());
        self
    }

    /// Who labels: the name in the preferences, else whom the system says; empty where nobody knows.
    pub fn labeler(&self) -> String {
        let named = Some(self.person.trim()).filter(|name| !name.is_empty());
        named.map(str::to_owned).or_else(system_person).unwrap_or_default()
    }

    /// Who labels; `None` where nobody knows.
    pub(in crate::app) fn known_labeler(&self) -> Option<String> {
        Some(self.labeler()).filter(|name| !name.is_empty())
    }

    /// The sides that have a 3D view in the workspace in front: where masks are drawn and where scores are read there is
    /// room for one.
    pub fn scene_sides(&self) -> SpacePane {
        self.sides.get(&self.workspace).copied().unwrap_or(match self.workspace {
            Workspace::Label | Workspace::Evaluate => SpacePane::Measured,
            Workspace::Inspect | Workspace::Align | Workspace::Adapt => SpacePane::Both,
        })
    }

    /// The comparison in the workspace in front.
    pub fn compared(&self) -> CompareChoice {
        self.compare.get(&self.workspace).cloned().unwrap_or_default()
    }
}

/// Colors of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum Theme {
    /// Light on dark.
    #[default]
    Dark,
    /// Dark on light.
    Light,
}

with_texts! {
    /// A GelSlim image.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, EnumIter)]
    #[serde(rename_all = "snake_case")]
    pub enum GelView(name, tooltip) {
        /// Touched minus untouched, around mid gray.
        #[default]
        Difference = "difference", "Contact minus no contact, around mid gray: what the generator sees";
        /// During the touch.
        Raw = "raw", "The image in contact, rotated to line up with the bubble";
        /// Without contact.
        Reference = "reference", "The image without contact, rotated to line up with the bubble";
    }
}

with_defaults! {
    /// The range of imprint depths that the color map spans, shared by all panes.
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct ColorRange {
        /// Depth of the first color, meters.
        pub min_m: f32 = 0.0,
        /// Depth of the last color, meters.
        // A 10 mm press tents up to that depth.
        pub max_m: f32 = 0.018,
        /// True where the range stays when another sample is shown. Unlocked, each new selection sets it.
        pub locked: bool = true,
    }
}

impl ColorRange {
    /// True where colors can be looked up with it.
    pub(crate) fn is_valid(self) -> bool {
        self.min_m.is_finite() && self.max_m.is_finite() && self.min_m < self.max_m
    }
}

with_texts! {
    /// Color maps for depth.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, EnumIter)]
    #[serde(rename_all = "snake_case")]
    pub enum ColorMap(name) {
        /// Perceptually uniform, dark blue to yellow, readable by color-blind eyes.
        #[default]
        Viridis = "Viridis",
        /// Gray.
        Gray = "Gray",
    }
}

with_defaults! {
    /// The generator's settings.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct GenerateSettings {
        /// The bundle's name; `None` takes the first generator found.
        pub bundle: Option<String> = None,
        /// The choice of the steps; `None` takes the numbers below.
        // What the bundle recommends; the numbers below are where somebody who chooses himself starts.
        pub preset: Option<Preset> = Some(Preset::Default),
        /// Denoising steps.
        pub steps: u32 = 10,
        /// Seed of the noise.
        pub seed: u64 = 42,
        /// The sampler.
        pub sampler: Sampler = Sampler::Ddim,
        /// DDIM's noise share, 0..1.
        pub eta: f64 = 0.0,
        /// The training steps visited.
        pub spacing: Spacing = Spacing::Trailing,
        /// True where both fingers are generated (the pose needs both); else only the one selected.
        pub both_fingers: bool = true,
        /// True where the pair on screen is predicted without being asked, where that costs little.
        pub by_itself: bool = true,
    }
}

impl GenerateSettings {
    /// Numbers brought into range.
    #[must_use]
    pub fn validated(mut self) -> Self {
        self.steps = self.steps.clamp(*STEPS.start(), *STEPS.end());
        self.eta = clamp_or(self.eta, 0.0, 1.0, 0.0);
        self
    }

    /// The choices of one generation with a bundle.
    pub fn config(&self, bundle: &BundleInfo) -> GenerateConfig {
        let Self { steps, eta, seed, sampler, spacing, .. } = *self;
        match (self.preset, &bundle.generator) {
            (Some(preset), Some(g)) => GenerateConfig { seed, ..preset.config(g.defaults, g.training_steps) },
            _ => GenerateConfig { steps, eta, seed, sampler, spacing },
        }
    }

    /// The choices with the numbers that `preset` or the bundle stand for, so that they can be changed one by one.
    #[must_use]
    pub fn spelt_out(&self, bundle: Option<&BundleInfo>) -> Self {
        let Some(config) = bundle.map(|bundle| self.config(bundle)) else { return self.clone() };
        Self { steps: config.steps, eta: config.eta, sampler: config.sampler, spacing: config.spacing, ..self.clone() }
    }

    /// True where the numbers that a preset stands for are the same.
    pub(crate) fn same_numbers(&self, other: &Self) -> bool {
        let numbers = |s: &Self| (s.steps, s.sampler, s.spacing, s.eta.to_bits());
        numbers(self) == numbers(other)
    }
}

with_defaults! {
    /// The mask tools' settings.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct MaskSettings {
        /// The tool in hand.
        pub tool: MaskTool = MaskTool::Brush,
        /// The paint of the tools; the eraser frees pixels.
        pub paint: Paint = Paint::Contact,
        /// Radius of brush and eraser, image pixels.
        pub radius_px: f32 = 4.0,
        /// By how much the depth may differ that the wand takes, meters.
        pub wand_m: f32 = 0.0005,
        /// The points that a drawing in 3D reaches.
        pub layers: Layers = Layers::default(),
        /// Size of the clean-ups that have one, millimeters.
        pub clean_mm: f32 = 1.0,
        /// The source of proposals.
        pub proposal: ProposalSource = ProposalSource::default(),
        /// True where accepting a proposal replaces what was painted by hand as well.
        pub over_drawn: bool = false,
        /// The choice of the masks that nobody drew.
        #[serde(flatten)]
        pub choice: MaskChoice = MaskChoice::default(),
        /// The mask bundle's name; `None` takes the first found.
        pub bundle: Option<String> = None,
    }
}

impl MaskSettings {
    /// The drawing tool in hand and what it makes of the pixels; `None` where it draws nothing.
    pub fn drawing(&self) -> Option<(DrawTool, Paint)> {
        let paint = if self.tool == MaskTool::Eraser { Paint::Free } else { self.paint };
        Some((self.tool.row(self).draws?, paint))
    }

    /// A clean-up of a kind with the size that is set.
    pub fn clean_up(&self, kind: CleanKind) -> CleanUp {
        CleanUp { kind, size_mm: self.clean_mm.into() }
    }

    /// Numbers brought into range.
    #[must_use]
    pub fn validated(mut self) -> Self {
        let default = Self::default();
        self.radius_px = clamp_or(self.radius_px, *BRUSH_RADIUS_PX.start(), *BRUSH_RADIUS_PX.end(), default.radius_px);
        self.wand_m = clamp_or(self.wand_m, 1e-5, 0.05, default.wand_m);
        self.clean_mm = clamp_or(self.clean_mm, *CLEAN_MM.start(), *CLEAN_MM.end(), default.clean_mm);
        let (choice, default) = (&mut self.choice, default.choice);
        choice.threshold_m = clamp_or(choice.threshold_m, -0.1, 0.1, default.threshold_m);
        choice.probability = choice.probability.filter(|p| (0.0..=1.0).contains(p));
        choice.top_percent = clamp_or(choice.top_percent, 0.0, 100.0, default.top_percent);
        choice.cad_distance_m = clamp_or(choice.cad_distance_m, 0.0, 0.05, default.cad_distance_m);
        self
    }
}

/// A tool: what the pointer does on a mask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum MaskTool {
    /// Adds.
    #[default]
    Brush,
    /// Removes.
    Eraser,
    /// Adds what a drawn line encloses.
    Lasso,
    /// Adds what lines between clicks enclose.
    Polygon,
    /// Adds a rectangle.
    Rectangle,
    /// Adds what is connected and about as deep.
    Wand,
    /// Moves the image.
    Pan,
}

/// A row of the table of tools.
pub struct ToolRow {
    /// The name on screen.
    pub name: &'static str,
    /// The action that takes the tool in hand.
    pub action: Action,
    /// The tool that it draws with; `None` = none.
    pub draws: Option<DrawTool>,
    /// The words for its use; empty for a tool with a number, which stands in their place.
    pub hint: &'static str,
}

impl MaskTool {
    /// The table: a tool with its numbers.
    pub fn row(self, mask: &MaskSettings) -> ToolRow {
        let row = |name, action, draws, hint| ToolRow { name, action, draws, hint };
        let brush = Some(DrawTool::Brush { radius_px: mask.radius_px });
        let wand = Some(DrawTool::Wand { tolerance_m: mask.wand_m });
        let corner = "Click the corners; Enter or the first corner closes it";
        match self {
            Self::Brush => row("Brush", Action::Brush, brush, ""),
            Self::Eraser => row("Eraser", Action::Eraser, brush, ""),
            Self::Lasso => row("Lasso", Action::Lasso, Some(DrawTool::Lasso), "Outline it in one stroke"),
            Self::Polygon => row("Polygon", Action::Polygon, Some(DrawTool::Polygon), corner),
            Self::Rectangle => {
                row("Rectangle", Action::RectangleTool, Some(DrawTool::Rectangle), "From corner to corner")
            }
            Self::Wand => row("Wand", Action::Wand, wand, ""),
            Self::Pan => row("Pan", Action::PanTool, None, "Drag to move the image"),
        }
    }
}
