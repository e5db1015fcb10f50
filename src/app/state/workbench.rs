//! The workbench: what the 3D panes show besides cloud and model, and what a hand does in them.
//!
//! Everything here lasts as long as the window. What a person decides with it (an accepted pose) is the document's.

use strum::EnumIter;

use super::super::keys::{ImprintSource, PairKey, RunKey};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::ManualCost;
use touch2touch_core::rig::PadId;

with_texts! {
    /// The coloring of the contact points in 3D.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, EnumIter)]
    pub enum Layer(name, tooltip) {
        /// One color.
        #[default]
        None = "One color", "Contact points in one color";
        /// The distance of each from the model.
        Residuals = "Residual", "Contact points colored by their distance to the model, in millimeters";
        /// The fate of each in the registration.
        Reasons = "Pixels used", "Contact points colored by whether and why the registration used them";
        /// The signed distance of each from the model, negative inside, and the same on the model's surface.
        Distance = "Distance", "Contact points and CAD surface colored by their distance in mm: blue inside, red outside";
        /// Lines to the model.
        Correspondences = "Pull lines", "Lines from contact points to the model";
    }
}

/// The effect of a click in a 3D pane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, EnumIter)]
pub enum SceneTool {
    /// Reads a point.
    #[default]
    Look,
    /// Moves the tool.
    Pose,
    /// Draws on the masks of the points, with the mask tool in hand.
    Paint,
}

/// A point that was clicked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Picked {
    /// Of which imprint.
    pub source: ImprintSource,
    /// Of which finger.
    pub finger: PadId,
    /// The raw bubble pixel.
    pub pixel: [u16; 2],
}

/// A pose being set by hand.
#[derive(Clone, Debug, PartialEq)]
pub struct ManualTry {
    /// The pair.
    pub pair: PairKey,
    /// The imprint it is set for.
    pub source: ImprintSource,
    /// The pose, `grasp_from_object`.
    pub pose: PlanarPose,
    /// The pose where it began.
    pub began: PlanarPose,
    /// The cost; `None` while cloud or model are not there.
    pub cost: Option<ManualCost>,
    /// The cost where it began.
    pub began_cost: Option<ManualCost>,
    /// The registration from here that is being computed.
    pub icp: Option<RunKey>,
    /// The registration that put it where it is, if one did and nothing moved it since.
    pub from_icp: Option<RunKey>,
}

/// The workbench: what the 3D panes do and show besides.
#[derive(Clone, Debug, Default)]
pub struct Workbench {
    /// The coloring of the contact points.
    pub layer: Layer,
    /// Pair for which all tools are tried.
    pub tools_tried: Option<PairKey>,
    /// True where each 3D pane shows the clouds of both imprints.
    pub both_clouds: bool,
    /// The effect of a click.
    pub tool: SceneTool,
    /// The side that the pointer was over last: what the panes beside the 3D views are about.
    pub side: ImprintSource,
    /// The pose being set.
    pub hand: Option<ManualTry>,
    /// The point clicked last.
    pub picked: Option<Picked>,
}

impl Workbench {
    /// Forgets what was of the pair: another one is shown.
    pub(in crate::app) fn leave_pair(&mut self) {
        self.hand = None;
        self.picked = None;
    }

    /// The pose being set for one imprint.
    pub fn hand(&self, source: ImprintSource) -> Option<&ManualTry> {
        self.hand.as_ref().filter(|hand| hand.source == source)
    }
}
