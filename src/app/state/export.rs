//! The choices of what is taken away.

use super::super::keys::{ImportForm, ImprintSource};
use touch2touch_pipeline::export::ExportChoice;
use touch2touch_pipeline::still::space::{Ground, SpacePane, ViewAngles};

/// The room's state.
#[derive(Clone, Debug, Default)]
pub struct ExportState {
    /// True where the form of an export of masks is open.
    pub asking_masks: bool,
    /// The contents of the form.
    pub masks: ExportChoice,
    /// The import of masks that is asked about.
    pub importing: Option<ImportForm>,
    /// The 3D picture that is asked about, with the number of the asking.
    pub still: Option<(StillAsked, u64)>,
    /// The number of times that something was asked about.
    pub(in crate::app) asked: u64,
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
            Self::Masks => "Export masks to a folder",
            Self::Pair(_) => "Export cloud, pose and mesh to a folder",
        }
    }

    /// The name that a file is offered under; `None` where a folder is asked for.
    pub fn file_name(self) -> Option<String> {
        match self {
            Self::Still(StillAsked { turntable: Some(_), .. }) => None,
            Self::Still(asked) => Some(format!("3d-{}.png", asked.pane.name().to_lowercase())),
            Self::Pair(_) | Self::Masks => None,
        }
    }
}
