//! Answer of a fit: scores, the corrections of the pads, and touches to look at.

use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;

use super::score::Scored;
use super::write::Unwritten;
use crate::error::Remark;
use crate::job::Curve;
use touch2touch_core::dataset::PairId;
use touch2touch_core::findings::Finding;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::PadId;

/// A fit with what it is worth.
#[derive(Clone, Debug, Serialize)]
pub struct Adapted {
    /// Pairs it was made from.
    pub pairs: usize,
    /// Touches (fingers) of these.
    pub touches: usize,
    /// Pairs that could not be used.
    pub left_out: Vec<Remark>,
    /// Pairs that contradict the rest: they are in the fit, and worth a look.
    pub doubtful: Vec<Remark>,
    /// The unfitted model on all touches.
    pub before: Scored,
    /// The closed form on touches that it was not fitted to; `None` where none was left out.
    pub closed_form: Option<Scored>,
    /// The tuned networks, likewise; `None` where nothing was tuned.
    pub after: Option<Scored>,
    /// Steps of tuning.
    pub steps: u32,
    /// Curves of the tuning: the loss, and PSNR (as [`Scored::psnr_raw_db`]) on touches that were left out.
    pub curves: Vec<Curve>,
    /// Time of everything, seconds.
    pub seconds: f64,
    /// Time of the fit alone, seconds.
    pub fit_seconds: f64,
    /// The most memory that the program had so far, MiB, where the system tells.
    pub peak_mib: Option<u64>,
    /// Correction of each pad.
    pub pads: Vec<PadSummary>,
    /// Warnings, in words.
    pub warnings: Vec<String>,
    /// Oddities of the data set and of the files that were read.
    pub notes: Vec<Finding>,
    /// Objections to the fit: with any of them the bundle is only written where that is asked for.
    pub objections: Vec<String>,
    /// The fit to other data that the folder of the new bundle holds, which is only replaced where that is asked for.
    pub in_place_of: Option<String>,
    /// The new bundle.
    pub bundle: Option<PathBuf>,
    /// The fit where it was to be written and was not; [`keep`](super::keep) writes it.
    #[serde(skip)]
    pub unwritten: Option<Arc<Unwritten>>,
    /// Touches with what the model makes of them before and after, [`MOST_SHOWN`] at most.
    #[serde(skip)]
    pub held_back: Vec<HeldBack>,
}

impl Adapted {
    /// Why the fit was not written though it was to be, each reason once.
    pub fn refused(&self) -> Vec<&str> {
        let reasons = self.objections.iter().chain(&self.in_place_of).map(String::as_str);
        if self.unwritten.is_some() { reasons.collect() } else { Vec::new() }
    }
}

/// A touch that the fit was not made from. Pictures are in meters, in the raw orientation, as large as the measured one.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldBack {
    /// The pair.
    pub pair: PairId,
    /// Name of the pair.
    pub name: String,
    /// The pad.
    pub pad: PadId,
    /// Measured imprint.
    pub measured: DepthMap,
    /// Prediction of the unfitted model.
    pub before: DepthMap,
    /// Prediction of the model that was fitted (and tuned, where that was asked for) to the others.
    pub after: DepthMap,
}

/// More touches than these are not kept to be looked at.
pub(crate) const MOST_SHOWN: usize = 200;

/// Correction of a pad, in figures.
#[derive(Clone, Debug, Serialize)]
pub struct PadSummary {
    /// The pad's name.
    pub pad: String,
    /// Touches.
    pub touches: usize,
    /// `[right, down]` in pixels of the decoder's picture.
    pub offset_px: [f64; 2],
    /// Gain of the straight line.
    pub gain: f64,
    /// Offset of the straight line, meters.
    pub offset_m: f64,
}
