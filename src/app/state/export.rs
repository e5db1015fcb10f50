//! The choices of a figure before it is drawn, and of what else is taken away.

use super::super::keys::{ImportForm, ImprintSource};
use super::super::pane::Pane;
use touch2touch_pipeline::export::ExportChoice;
use touch2touch_pipeline::images::figure::{FigureLook, FigurePane, FigureTheme};
use touch2touch_pipeline::images::space::{Ground, SpacePane, ViewAngles};

/// Pairs of the list that a figure may take.
pub(crate) const MOST_PAIRS: usize = 50;
/// Scales that are offered.
pub(crate) const SCALES: [u8; 4] = [1, 2, 4, 8];

/// The pairs of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureRows {
    /// The selected pair alone.
    Selected,
    /// The pairs ticked in the list, in its order.
    Ticked,
    /// So many pairs of the list, from the first.
    First(usize),
}

/// The choices of a person about the next figure. Not kept between runs of the program.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureForm {
    /// The pairs, a row each.
    pub rows: FigureRows,
    /// True where all fingers get a row; else only the active one.
    pub both_fingers: bool,
    /// The columns.
    pub panes: Vec<FigurePane>,
    /// Pixels of a PNG per pixel of an imprint.
    pub scale: u8,
    /// Ground and ink.
    pub theme: FigureTheme,
    /// Half the range of the colors of errors, meters.
    pub error_m: f32,
}

impl Default for FigureForm {
    fn default() -> Self {
        let look = FigureLook::default();
        Self {
            rows: FigureRows::First(4),
            both_fingers: false,
            panes: look.panes,
            scale: 2,
            theme: FigureTheme::Light,
            error_m: look.error_m,
        }
    }
}

impl FigureForm {
    /// Numbers brought into range.
    #[must_use]
    pub fn validated(mut self) -> Self {
        if let FigureRows::First(n) = &mut self.rows {
            *n = (*n).clamp(1, MOST_PAIRS);
        }
        self.scale = self.scale.clamp(SCALES[0], SCALES[3]);
        self.error_m = touch2touch_core::units::clamp_or(self.error_m, 5e-5, 0.1, FigureLook::default().error_m);
        self.panes.sort_unstable();
        self.panes.dedup();
        self
    }
}

/// The room's state.
#[derive(Clone, Debug, Default)]
pub struct ExportState {
    /// True where the form is open.
    pub asking: bool,
    /// The contents of the form.
    pub form: FigureForm,
    /// True where the form of an export of masks is open.
    pub asking_masks: bool,
    /// The contents of the form.
    pub masks: ExportChoice,
    /// The import of masks that is asked about.
    pub importing: Option<ImportForm>,
    /// The number of imports that were asked about.
    pub(in crate::app) imports: u64,
}

/// A picture of the selected pair in 3D, as a person asks for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillAsked {
    /// The imprints.
    pub pane: SpacePane,
    /// Width and height, pixels.
    pub width_px: u32,
    /// The ground.
    pub ground: Ground,
    /// Direction of the view.
    pub angles: ViewAngles,
    /// Frames of a turntable; `None` = one picture.
    pub turntable: Option<u32>,
}

/// Something to be written once the place is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output {
    /// The figure that the form describes.
    Figure,
    /// One pane as a picture.
    Picture {
        /// The pane.
        pane: Pane,
        /// Pixels per pixel of an imprint; `None` for an SVG.
        scale: Option<u8>,
        /// Half the range of the colors of errors, meters.
        error_m: f32,
    },
    /// The selected pair in 3D: a picture, or a turntable into a folder.
    Still(StillAsked),
    /// Cloud, pose and mesh of an imprint of the selected pair, into a folder.
    Pair(ImprintSource),
    /// Masks for training, as the form says, into a folder.
    Masks,
}

impl Output {
    /// The request, as the title of a dialog.
    pub fn title(self) -> &'static str {
        match self {
            Self::Still(StillAsked { turntable: None, .. }) => "Save the 3D picture (.png)",
            Self::Still(_) => "Save the frames of a turntable to a folder",
            Self::Figure => "Save the figure (.png or .svg)",
            Self::Masks => "Export masks to a folder",
            Self::Pair(_) => "Export cloud, pose and mesh to a folder",
            Self::Picture { scale: Some(_), .. } => "Save the picture (.png)",
            Self::Picture { scale: None, .. } => "Save the picture (.svg)",
        }
    }

    /// The name that a file is offered under; `None` where a folder is asked for.
    pub fn file_name(self) -> Option<String> {
        match self {
            Self::Figure => Some("figure.png".into()),
            Self::Still(StillAsked { turntable: Some(_), .. }) => None,
            Self::Still(asked) => Some(format!("3d-{}.png", asked.pane.name().to_lowercase())),
            Self::Picture { pane, scale, .. } => Some(pane.picture_name(scale.is_some())),
            Self::Pair(_) | Self::Masks => None,
        }
    }
}
