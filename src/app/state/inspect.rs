//! The steps of a registration: what was recorded ([`Inspection`]), and what of it is looked at.

use std::sync::Arc;

use glam::DVec3;

use super::super::keys::{ImprintSource, PoseBits, Registration};
use touch2touch_core::align::{AlignReport, TraceStep};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::inspect::Counterparts;
use touch2touch_core::pose::ToolModel;
use touch2touch_pipeline::steps::pose::PoseResult;

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

/// A recorded registration with what its steps are looked at with.
#[derive(Clone, Debug)]
pub struct Inspection {
    /// The recorded registration.
    pub result: PoseResult,
    /// The contact points that were offered, meters, grasp frame.
    pub points: Vec<DVec3>,
    /// The counterparts that the points are compared with.
    pub counterparts: Counterparts,
    /// Per start the positions of its steps in the trace.
    runs: Vec<Vec<usize>>,
}

impl Inspection {
    /// From a recorded registration, the contact points it was offered, and what they were compared with.
    pub fn new(result: PoseResult, points: Vec<DVec3>, tool: &ToolModel, registration: Registration) -> Self {
        let report = &result.report;
        let mut runs: Vec<Vec<usize>> = vec![Vec::new(); report.runs.len()];
        for (i, step) in report.trace.iter().enumerate() {
            if step.run >= runs.len() {
                runs.resize(step.run + 1, Vec::new());
            }
            runs[step.run].push(i);
        }
        Self { result, points, counterparts: Counterparts::new(tool, registration), runs }
    }

    /// The registration's report with its trace.
    pub fn report(&self) -> &AlignReport {
        &self.result.report
    }

    /// Starts there are.
    pub fn num_runs(&self) -> usize {
        self.runs.len()
    }

    /// Steps of a start, the applied start included.
    pub(crate) fn num_steps(&self, run: usize) -> usize {
        self.runs.get(run).map_or(0, Vec::len)
    }

    /// The steps of a start, in order.
    pub fn steps(&self, run: usize) -> impl Iterator<Item = &TraceStep> + '_ {
        self.runs.get(run).into_iter().flatten().filter_map(|&i| self.report().trace.get(i))
    }

    /// A step of a start; beyond the end its last.
    pub fn step(&self, run: usize, at: usize) -> Option<&TraceStep> {
        let steps = self.runs.get(run)?;
        self.report().trace.get(*steps.get(at.min(steps.len().checked_sub(1)?))?)
    }

    /// The pose that a start was asked to begin at, `grasp_from_object`.
    pub fn requested(&self, run: usize) -> Option<PlanarPose> {
        self.report().runs.get(run).map(|r| r.start)
    }

    /// The continuation after a step, in words: the reason to stop at the last one.
    pub fn what_next(&self, run: usize, at: usize) -> String {
        let (Some(here), last) = (self.step(run, at), self.num_steps(run).saturating_sub(1)) else {
            return "no steps were recorded".into();
        };
        if at >= last {
            return self.report().runs.get(run).map_or_else(|| self.report().stop.to_string(), |r| r.stop.to_string());
        }
        match self.step(run, at + 1) {
            Some(next) if next.kernel_m != here.kernel_m => {
                format!("narrows to points within {:.2} mm", next.kernel_m * 1e3)
            }
            Some(next) if next.points != here.points => format!("continues with {} points", next.points),
            _ => "still moving".into(),
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.points.len() * 24 + self.result.bytes() + (100 << 10)
    }
}
