//! The time machine: what of a registration is looked at, and how views find it.

use std::sync::Arc;

use super::super::keys::{ImprintSource, Inspection, PairKey, PoseBits, Registration};
use touch2touch_core::align::TraceStep;
use touch2touch_core::frames::PlanarPose;

/// The part of a registration that is looked at. Not kept between runs of the program.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspect {
    /// The imprint whose registration it is.
    pub source: ImprintSource,
    /// The start of the run, `grasp_from_object`; `None` = the registration's own starts.
    pub start: Option<PoseBits>,
    /// The start of the report; `None` = the winner.
    pub run: Option<usize>,
    /// The step of the run; `None` = its last.
    pub at: Option<usize>,
    /// True where the steps go by by themselves.
    pub playing: bool,
    /// Steps kept for comparison.
    pub pins: [Option<Pin>; 2],
    /// True where correspondences are drawn in the 3D view.
    pub lines: bool,
}

impl Default for Inspect {
    fn default() -> Self {
        Self {
            source: ImprintSource::Measured,
            start: None,
            run: None,
            at: None,
            playing: false,
            pins: [None, None],
            lines: true,
        }
    }
}

/// A step kept for comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pin {
    /// The pair.
    pub pair: PairKey,
    /// The imprint.
    pub source: ImprintSource,
    /// The registration.
    pub registration: Registration,
    /// The start it belongs to.
    pub run: usize,
    /// The position in the run.
    pub at: usize,
    /// The pose, `grasp_from_object`.
    pub grasp_from_object: PlanarPose,
    /// Cost per point there, square meters.
    pub cost_m2: f64,
    /// Width of the kernel that the cost is of, meters; infinite without one.
    pub kernel_m: f64,
}

/// The step that is looked at.
#[derive(Clone, Copy, Debug)]
pub struct Inspected<'a> {
    /// The recorded registration.
    pub inspection: &'a Arc<Inspection>,
    /// The start.
    pub run: usize,
    /// Position of the step in its run.
    pub at: usize,
    /// The step.
    pub step: &'a TraceStep,
}

impl Inspected<'_> {
    /// True where it is the last step of its run.
    pub fn is_last(&self) -> bool {
        self.at + 1 >= self.inspection.num_steps(self.run)
    }
}

impl Inspect {
    /// The kept steps of a pair.
    pub fn pins_of(&self, pair: Option<PairKey>) -> [Option<Pin>; 2] {
        self.pins.map(|pin| pin.filter(|p| Some(p.pair) == pair))
    }
}
