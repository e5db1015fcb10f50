//! The time machine and the basin map: what of a registration is looked at, and how views find it.

use std::sync::Arc;

use glam::DVec3;

use super::keys::{BasinKey, ImprintSource, PairKey, PoseBits, PoseEngine, Request, RunKey};
use super::pane::Need;
use super::state::{Absent, Lookup, State};
use super::workbench::Layer;
use crate::domain::align::basin::{Basin, Plane};
use crate::domain::align::{AlignReport, TraceStep};
use crate::domain::frames::PlanarPose;
use crate::domain::inspect::Counterparts;
use crate::domain::pose::ToolModel;
use crate::work::pose::PoseResult;

/// What of a registration is looked at. Not kept between runs of the program.
#[derive(Clone, Debug, PartialEq)]
pub struct Inspect {
    /// The imprint whose registration it is.
    pub source: ImprintSource,
    /// The start of the run, `grasp_from_object`; `None` = the registration's own starts.
    pub start: Option<PoseBits>,
    /// Which start of the report; `None` = the winner.
    pub run: Option<usize>,
    /// Which step of the run; `None` = its last.
    pub at: Option<usize>,
    /// Whether the steps go by by themselves.
    pub playing: bool,
    /// Steps kept for comparison.
    pub pins: [Option<Pin>; 2],
    /// Whether correspondences are drawn in the 3D view.
    pub lines: bool,
    /// The plane of the basin map.
    pub plane: Plane,
    /// What colors the basin map.
    pub color: BasinColor,
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
            plane: Plane::default(),
            color: BasinColor::default(),
        }
    }
}

/// What colors a basin map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumIter)]
pub enum BasinColor {
    /// Square root of the cost at the end.
    #[default]
    Cost,
    /// Angle between end and truth.
    Error,
    /// Which place the run ended at.
    Winner,
}

impl BasinColor {
    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cost => "Cost",
            Self::Error => "Angle error",
            Self::Winner => "End",
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
    pub engine: PoseEngine,
    /// The start it belongs to.
    pub run: usize,
    /// Its position in the run.
    pub at: usize,
    /// The pose, `grasp_from_object`.
    pub grasp_from_object: PlanarPose,
    /// Cost per point there, square meters.
    pub cost_m2: f64,
    /// Width of the kernel that the cost is of, meters; infinite without one.
    pub kernel_m: f64,
}

/// What a person does with the time machine and the basin map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InspectCommand {
    /// Looks at the other imprint.
    Source(ImprintSource),
    /// Loads the run from a start (`grasp_from_object`), or all of the registration's own.
    Start(Option<PlanarPose>),
    /// Shows another start's run, at its end.
    Run(usize),
    /// Shows a step of a run.
    Go {
        /// The start.
        run: usize,
        /// The step.
        at: usize,
    },
    /// Moves by so many steps; stops at the ends.
    By(i64),
    /// Shows the applied start.
    Begin,
    /// Shows the last step.
    End,
    /// Lets the steps go by, or stops them. At the end it begins again.
    Play(bool),
    /// Keeps the step shown for comparison: in the first free place, else instead of the older one.
    Pin,
    /// Lets a kept step go.
    Unpin(usize),
    /// Whether correspondences are drawn.
    Lines(bool),
    /// The plane of the basin map.
    Plane(Plane),
    /// What colors the basin map.
    Color(BasinColor),
    /// Gives up the basin map that is being computed.
    StopBasin,
}

/// A recorded registration with what its steps are looked at with.
#[derive(Clone, Debug)]
pub struct Inspection {
    /// The recorded registration.
    pub result: Arc<PoseResult>,
    /// The contact points that were offered, meters, grasp frame.
    pub points: Vec<DVec3>,
    /// What the points are compared with.
    pub counterparts: Counterparts,
    /// Per start the positions of its steps in the trace.
    runs: Vec<Vec<usize>>,
}

impl Inspection {
    /// From a recorded registration, the contact points it was offered, and what they were compared with.
    pub fn new(result: Arc<PoseResult>, points: Vec<DVec3>, tool: &ToolModel, engine: PoseEngine) -> Self {
        let report = &result.report;
        let mut runs: Vec<Vec<usize>> = vec![Vec::new(); report.runs.len()];
        for (i, step) in report.trace.iter().enumerate() {
            if step.run >= runs.len() {
                runs.resize(step.run + 1, Vec::new());
            }
            runs[step.run].push(i);
        }
        Self { result, points, counterparts: Counterparts::new(tool, engine), runs }
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
    pub fn num_steps(&self, run: usize) -> usize {
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

    /// The pose it began at, `grasp_from_object`: not always the one asked for.
    pub fn applied(&self, run: usize) -> Option<PlanarPose> {
        self.steps(run).next().map(|s| s.grasp_from_object)
    }

    /// What happens after a step, in words: the reason to stop at the last one.
    pub fn what_next(&self, run: usize, at: usize) -> String {
        let (Some(here), last) = (self.step(run, at), self.num_steps(run).saturating_sub(1)) else {
            return "no step was recorded".into();
        };
        if at >= last {
            return self.report().runs.get(run).map_or_else(|| self.report().stop.to_string(), |r| r.stop.to_string());
        }
        match self.step(run, at + 1) {
            Some(next) if next.kernel_m != here.kernel_m => {
                format!("this kernel is done; the next is {:.2} mm wide", next.kernel_m * 1e3)
            }
            Some(next) if next.points != here.points => format!("goes on with {} points", next.points),
            _ => "still moving".into(),
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.points.len() * 24 + self.report().trace.len() * 8 + (100 << 10)
    }
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
    /// Whether it is the last step of its run.
    pub fn is_last(&self) -> bool {
        self.at + 1 >= self.inspection.num_steps(self.run)
    }
}

impl State {
    /// The recipe of the recorded run that is looked at; `Ok(None)` while something it is made from is missing.
    ///
    /// # Errors
    /// Why there can be none.
    pub fn inspection_key(&self) -> Result<Option<RunKey>, Absent> {
        let pose = self.pose_key(self.inspect.source)?;
        Ok(pose.map(|pose| RunKey { pose, start: self.inspect.start }))
    }

    /// The recorded run that is looked at.
    pub fn inspection(&self) -> Lookup<'_, Arc<Inspection>> {
        let before = || {
            let key = self.results.latest_inspections.get(&(self.pair_key()?, self.inspect.source))?;
            self.results.inspections.get(key)
        };
        if let failed @ Lookup::Failed(_) = self.tool() {
            return failed.without();
        }
        match self.inspection_key() {
            Err(absent) => Lookup::Absent(absent),
            Ok(key) => match key.as_ref().and_then(|key| self.results.inspections.get(key)) {
                Some(inspection) => Lookup::Ready(inspection),
                None => {
                    let run = key.clone().map(Request::Run).filter(|run| self.tasks.failed.contains_key(run));
                    self.missing_but(run.or_else(|| key.map(Request::Inspection)), before())
                }
            },
        }
    }

    /// The recipe of the basin map; `Ok(None)` while something it is made from is missing.
    ///
    /// # Errors
    /// Why there can be none.
    pub fn basin_key(&self) -> Result<Option<BasinKey>, Absent> {
        let pose = self.pose_key(self.inspect.source)?;
        Ok(pose.map(|pose| BasinKey { pose, plane: self.inspect.plane }))
    }

    /// The basin map.
    pub fn basin(&self) -> Lookup<'_, Basin> {
        let before = || {
            let key = self.results.latest_basins.get(&(self.pair_key()?, self.inspect.source))?;
            self.results.basins.get(key).map(|a| &**a).filter(|b| b.config.plane == self.inspect.plane)
        };
        if let failed @ Lookup::Failed(_) = self.tool() {
            return failed.without();
        }
        match self.basin_key() {
            Err(absent) => Lookup::Absent(absent),
            Ok(key) => match key.as_ref().and_then(|key| self.results.basins.get(key)) {
                Some(basin) => Lookup::Ready(basin),
                None => self.missing_but(key.map(Request::Basin), before()),
            },
        }
    }

    /// The step that is looked at, of the run shown (also of the one before, while the next is computed).
    pub fn inspected(&self) -> Option<Inspected<'_>> {
        let inspection = self.inspection().shown()?;
        let last_run = inspection.num_runs().checked_sub(1)?;
        let run = self.inspect.run.unwrap_or(inspection.report().winner).min(last_run);
        let last = inspection.num_steps(run).checked_sub(1)?;
        let at = self.inspect.at.unwrap_or(last).min(last);
        Some(Inspected { inspection, run, at, step: inspection.step(run, at)? })
    }

    /// Whether something on screen shows a step of an imprint's registration.
    pub fn shows_steps(&self, source: ImprintSource) -> bool {
        let lines = self.workbench.layer == Layer::Correspondences && self.needs(Need::Scene(source));
        self.inspect.source == source && (lines || self.needs(Need::Steps))
    }

    /// The step that the 3D view of a side shows instead of the registered pose.
    pub fn inspected_in(&self, source: ImprintSource) -> Option<Inspected<'_>> {
        if self.shows_steps(source) { self.inspected() } else { None }
    }

    /// The kept steps of the selected pair.
    pub fn pins(&self) -> [Option<Pin>; 2] {
        self.inspect.pins.map(|pin| pin.filter(|p| Some(p.pair) == self.pair_key()))
    }
}
