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
use super::{AlignConfig, AlignError, AlignReport, Ask, Range, Register, Scene};
use crate::frames::PlanarPose;
use crate::tool::ToolModel;
pub use answers::PoseAnswer;
pub use evidence::{Elsewhere, Evidence, MembraneEvidence};
use problem::{Problem, check};

/// Choices of the registration by membrane and mask. The default is what the product uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointConfig {
    /// Poses to start from, `grasp_from_object`: exactly these. Empty: its own.
    pub starts: Vec<PlanarPose>,
    /// Poses among which the tool is looked for where the prior of `mask` does not have it; not beyond that one unless wider.
    pub range: Range,
    /// The registration by the mask alone, which answers where the membrane says little; its prior is this one's.
    pub mask: AlignConfig,
    /// Places of the membranes that are compared in each band, coarse to fine, and for the answer (in the finest).
    pub points: [usize; 4],
    /// Widths of the Geman-McClure kernel likewise, meters.
    pub kernels_m: [f64; 4],
    /// Points of the mask while starts are told apart, and for the answer.
    pub mask_points: [usize; 2],
    /// Widths of the mask's kernel, meters, likewise.
    pub mask_kernels_m: [f64; 2],
    /// Weight of the mask beside the membrane.
    pub weight: MaskWeight,
    /// Most steps in each band.
    pub max_iterations: usize,
    /// Costs this close, as a share, do not tell two ends apart.
    pub close: f64,
    /// Share of the membrane's relief that an answer from the prior must explain, or scouts start all around: of a membrane that
    /// hangs from the tool, and of one that reaches the middle plane.
    pub stands: [f64; 2],
    /// Share of its cost that another pose must be ahead of it.
    pub ahead: f64,
    /// Share of the membrane's relief below which the membrane alone is asked as well, and answers if it explains more.
    pub doubtful: f64,
    /// Least share of the membrane's relief that the tool must explain, or the mask alone answers.
    pub explained: f64,
    /// The same of a predicted one.
    pub predicted_explained: f64,
    /// Keep per-iteration states and per-point residuals.
    pub record: bool,
}

/// Weight of the mask beside the membrane, as a factor of its mean cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaskWeight {
    /// While starts are told apart.
    pub scouts: f64,
    /// For the answer, where the membrane has the noise of `noise_m`. It grows with the fourth power of the noise: what the
    /// membrane tells falls with the square of the noise, and model errors make its residuals alike.
    pub answer: f64,
    /// Noise, meters.
    pub noise_m: f64,
    /// Least and greatest weight for the answer.
    pub range: [f64; 2],
    /// Least weight beside predicted images: their errors are no noise, so that nothing is seen of them in the images.
    pub predicted: f64,
    /// Mean cost of the mask at the membrane's pose from which on it counts less, by its inverse.
    pub agrees: f64,
}

impl Default for JointConfig {
    fn default() -> Self {
        Self {
            starts: Vec::new(),
            range: Range::default(),
            mask: AlignConfig::default(),
            points: [100, 150, 400, 1200],
            kernels_m: [4e-3, 1e-3, 0.5e-3, 0.5e-3],
            mask_points: [64, 400],
            mask_kernels_m: [2e-3, 1e-3],
            weight: MaskWeight {
                scouts: 0.1,
                answer: 0.02,
                noise_m: 0.075e-3,
                range: [0.02, 0.3],
                predicted: 0.3,
                agrees: 0.1,
            },
            max_iterations: 20,
            close: 0.15,
            stands: [0.33, 0.4],
            ahead: 0.03,
            doubtful: 0.3,
            explained: 0.05,
            predicted_explained: 0.5,
            record: false,
        }
    }
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
    #[strum(to_string = "mask alone: the predicted membrane is none that this tool makes at this pressure")]
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
    fn allows(&self, pose: PlanarPose) -> bool {
        self.mask.prior.allows(pose) || self.is_wider() && self.range.prior().allows(pose)
    }

    /// True where poses beyond the prior may be looked for.
    fn is_wider(&self) -> bool {
        self.range != Range::default()
    }
}

impl Register for JointConfig {
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError> {
        let mut config = self.clone();
        config.record = ask.record;
        if let Some(starts) = ask.starts {
            if starts.is_empty() {
                return Err(AlignError::Config { what: "starts" });
            }
            config.starts = starts.to_vec();
        }
        check(&config)?;
        let by_mask_from = |fit: JointFit, starts: Vec<PlanarPose>| -> Result<AlignReport, AlignError> {
            let report = AlignConfig { starts, ..self.mask.clone() }.run(scene, tool, ask)?;
            let within_prior = report.within_prior || config.allows(report.grasp_from_object);
            Ok(AlignReport { joint: Some(fit), range: config.range, within_prior, ..report })
        };
        let by_mask = |fit: JointFit| by_mask_from(fit, config.starts.clone());
        if scene.images().is_empty() {
            return by_mask(JointFit::by_mask(Basis::NoImage));
        }
        let Some(mut problem) = Problem::new(scene, tool, &config)? else {
            return by_mask(JointFit::by_mask(Basis::NoZone));
        };
        if ask.starts.is_some() {
            // Asked is where these lead, not what else would answer.
            let finite = scene.yz().iter().copied().filter(|p| p.is_finite());
            if finite.clone().next().is_some() {
                check_overlap(finite, &tool.field, &config.starts)?;
            }
            return Ok(problem.report(scene.yz(), problem.solve(false)));
        }
        let mut answer = problem.solve(config.is_wider());
        if problem.is_predicted() && answer.fit.explained < config.predicted_explained {
            let fit = JointFit { basis: Basis::Unlike, mask_weight: 1.0, ..answer.fit };
            return by_mask_from(fit, problem.start_around(&answer));
        }
        if answer.fit.explained < config.doubtful && !config.is_wider() {
            // A bad mask can lead all scouts away from what the membrane shows plainly.
            answer = problem.solve_without_mask(&answer, config.explained).unwrap_or(answer);
        }
        if answer.fit.explained < config.explained && !config.is_wider() {
            return by_mask(JointFit { basis: Basis::LittleContact, mask_weight: 1.0, ..answer.fit });
        }
        Ok(problem.report(scene.yz(), answer))
    }
}
