//! The steps of a registration: what of it is looked at, and how views find it.

use std::sync::Arc;

use super::super::keys::{ImprintSource, Inspection, PoseBits};
use touch2touch_core::align::TraceStep;

/// The part of a registration that is looked at. Not kept between runs of the program.
#[derive(Clone, Debug, Default, PartialEq)]
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
