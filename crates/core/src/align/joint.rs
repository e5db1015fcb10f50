//! The membrane's image and the mask together: what the whole membrane says of the pose, and the mask where that is little.
//!
//! A mask is made by a threshold or a model and can be wrong where the tool is plain to see. The membrane's height needs
//! no mask: over a tool it is a sheet (the solution of an obstacle problem, see `tent`), which a pose only moves. Its image
//! and the sheet are compared in bands of lengths, because offsets and slow slopes (a camera that is off, the pressure) are
//! not the tool, and pixel noise is not either. The mask stays as a second, weaker term: the weaker, the less noise the
//! membrane has and the less the mask agrees with it.
//!
//! Where the membrane says too little, the mask alone answers, and the report says so ([`Basis`]).

mod answers;
mod anywhere;
mod cost;
mod curvature;
mod evidence;
mod image;
mod problem;
mod smooth;
mod template;
#[cfg(test)]
mod tests;
mod turned;

use serde::{Deserialize, Serialize};

use super::register::check_overlap;
use super::{AlignConfig, AlignError, AlignReport, Ask, Prior, Range, Register, Rung, Scene};
use crate::frames::PlanarPose;
use crate::tool::ToolModel;
pub use answers::PoseAnswer;
pub use evidence::{Elsewhere, Evidence, MembraneEvidence};
use problem::{Answer, Problem};

/// Share of the membrane's relief below which the membrane alone is asked as well, and answers if it explains more.
const DOUBTFUL: f64 = 0.3;
/// Least share of the membrane's relief that the tool must explain without a mask that agrees; with one, any positive share will do.
const EXPLAINED: f64 = 0.05;
/// The same of a predicted one.
const PREDICTED_EXPLAINED: f64 = 0.5;

/// The registration by membrane and mask. The default is what the product uses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointConfig {
    /// Poses among which the tool is looked for where its pose in the prior does not stand.
    pub range: Range,
}

/// Who answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, strum::Display)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// Membrane and mask together.
    #[strum(to_string = "membrane and mask")]
    Both,
    /// The membrane alone: the mask is next to empty, or contradicts it.
    #[strum(to_string = "membrane alone: the mask is next to empty or contradicts it")]
    Membrane,
    /// The mask alone, because there is no image of a membrane with its camera.
    #[strum(to_string = "mask alone: no depth image with a camera")]
    NoImage,
    /// The mask alone, because the membranes come nowhere near each other, or hardly a pixel has a depth.
    #[strum(to_string = "mask alone: the membranes do not show where they would meet")]
    NoZone,
    /// The mask alone, because the prediction is no membrane that the tool could make: the generator learned another one, or
    /// another pressure.
    #[strum(to_string = "mask alone: no press of this tool gives the predicted membrane")]
    Unlike,
    /// The mask alone, because the tool hardly shows in the membrane.
    #[strum(to_string = "mask alone: too little of the membrane lies on the tool")]
    LittleContact,
}

impl Basis {
    /// True where the membranes had a say.
    pub fn has_membrane(self) -> bool {
        matches!(self, Self::Both | Self::Membrane)
    }
}

/// Use of the membrane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointFit {
    /// Who answered.
    pub basis: Basis,
    /// Noise of the membrane against its template: 1.48 times the median residual, meters. 0 where it was not used.
    pub noise_m: f64,
    /// Weight of the mask's mean cost beside the membrane's.
    pub mask_weight: f64,
    /// Area of the membranes that was compared, square meters.
    pub area_m2: f64,
    /// Share of the membrane's relief that the tool explains, at most 1.
    pub explained: f64,
}

impl JointFit {
    fn by_mask(basis: Basis) -> Self {
        Self { basis, noise_m: 0.0, mask_weight: 1.0, area_m2: 0.0, explained: 0.0 }
    }
}

impl JointConfig {
    /// True for a pose in the prior or in the range.
    fn allows(self, pose: PlanarPose) -> bool {
        Prior::default().allows(pose) || self.range.prior().allows(pose)
    }

    /// The answer in the prior, or why the mask alone answers.
    fn in_prior(problem: &mut Problem<'_>) -> Result<Answer, JointFit> {
        let mut answer = problem.solve();
        if problem.predicted && answer.fit.explained < PREDICTED_EXPLAINED {
            return Err(JointFit { basis: Basis::Unlike, mask_weight: 1.0, ..answer.fit });
        }
        if answer.fit.explained < DOUBTFUL {
            // A bad mask can lead all scouts away from what the membrane shows plainly.
            answer = problem.solve_without_mask(&answer, EXPLAINED).unwrap_or(answer);
        }
        let least = if answer.fit.basis == Basis::Both { 0.0 } else { EXPLAINED };
        if answer.fit.explained <= least {
            return Err(JointFit { basis: Basis::LittleContact, mask_weight: 1.0, ..answer.fit });
        }
        Ok(answer)
    }
}

/// A pose, or why there is none.
type Found = Result<AlignReport, AlignError>;

impl Register for JointConfig {
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError> {
        if ask.starts.is_some_and(|starts| starts.is_empty() || starts.iter().any(|s| !s.is_finite())) {
            return Err(AlignError::Config { what: "starts" });
        }
        let all = AlignConfig::default().rungs;
        let by_mask = |fit: JointFit, rungs: &[Rung]| -> Found {
            let report = AlignConfig { rungs: rungs.to_vec(), ..AlignConfig::default() }.run(scene, tool, ask)?;
            let within_prior = report.within_prior || self.allows(report.grasp_from_object);
            Ok(AlignReport { joint: Some(fit), range: self.range, within_prior, ..report })
        };
        if scene.images().is_empty() {
            return by_mask(JointFit::by_mask(Basis::NoImage), &all);
        }
        let Some(mut problem) = Problem::new(scene, tool, *self, ask)? else {
            return by_mask(JointFit::by_mask(Basis::NoZone), &all);
        };
        if let Some(starts) = ask.starts {
            // Asked is where these lead, not what else would answer.
            let mut finite = scene.yz().iter().copied().filter(|p| p.is_finite()).peekable();
            if finite.peek().is_some() {
                check_overlap(finite, &tool.field, starts)?;
            }
            return Ok(problem.report(scene.yz(), problem.solve()));
        }
        match Self::in_prior(&mut problem) {
            Ok(answer) => {
                let stands = self.range == Range::LAB || problem.stands(&answer);
                let found = Ok(problem.report(scene.yz(), answer));
                if stands { found } else { problem.look_around(scene.yz(), found) }
            }
            Err(fit) if self.range == Range::LAB => by_mask(fit, &all),
            Err(fit) => {
                // The mask's grid and proof take longer than a look around, which mostly leaves nothing to do for them.
                let found = problem.look_around(scene.yz(), by_mask(fit, &all[..2]));
                if found.as_ref().is_ok_and(AlignReport::has_membrane) { found } else { by_mask(fit, &all) }
            }
        }
    }
}
