//! The membrane's image and the mask together: what the whole membrane says of the pose, and the mask where that is little.
//!
//! A mask is made by a threshold or a model and can be wrong where the tool is plain to see. The membrane's height needs
//! no mask: over a tool it is a tent (see `tent`), which a pose only moves. Its image and the tent are compared
//! in bands of lengths, because offsets and slow slopes (a camera that is off, the pressure) are not the tool, and pixel
//! noise is not either. The mask stays as a second, weak term.
//!
//! Where the free membrane does not reach the middle plane, or the tool is hardly felt, the mask alone answers, and the
//! report says so.

mod cost;
mod image;
mod smooth;
mod template;

use std::sync::Arc;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::batch::{Cloud, State};
use super::observability::of_cloud;
use super::planar::fits;
use super::search::{Progress, Search, minimize};
use super::{
    AlignConfig, AlignError, AlignReport, Ask, MIN_POINTS, Register, Run, Rung, Scene, TraceStep, clean,
};
use crate::frames::PlanarPose;
use crate::mesh::sampling::spread;
use crate::tool::ToolModel;
use cost::{Joint, MaskPart, Noted, Patch};
use image::Image;
use smooth::BANDS;
use template::{BandField, Template, template};

/// What the registration by membrane and mask may vary. The default is what the product uses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointConfig {
    /// Poses to start from, `grasp_from_object`: exactly these. Empty: its own.
    pub starts: Vec<PlanarPose>,
    /// The registration by the mask alone: the one that answers where the membrane says little.
    pub mask: AlignConfig,
    /// Places of the membranes that are compared in each band, coarse to fine.
    pub points: [usize; 4],
    /// Widths of the Geman-McClure kernel in each band, meters.
    pub kernels_m: [f64; 4],
    /// Points of the mask while starts are told apart, and for the answer.
    pub mask_points: [usize; 2],
    /// Widths of the mask's kernel, meters, likewise.
    pub mask_kernels_m: [f64; 2],
    /// Weight of the mask beside the membrane while starts are told apart.
    pub scout_weight: f64,
    /// Weight of the mask for the answer where the membrane has the noise of `noise_m`; it grows with the fourth power of
    /// the noise.
    pub weight: f64,
    /// Noise, meters.
    pub noise_m: f64,
    /// Least and greatest weight.
    pub weights: [f64; 2],
    /// Most steps in each band.
    pub max_iterations: usize,
    /// Costs this close, as a share, do not tell two ends apart.
    pub close: f64,
    /// Keep per-iteration states and per-point residuals.
    pub record: bool,
}

impl Default for JointConfig {
    fn default() -> Self {
        Self {
            starts: Vec::new(),
            mask: AlignConfig::default(),
            points: [100, 150, 400, 800],
            kernels_m: [4e-3, 1e-3, 0.5e-3, 0.5e-3],
            mask_points: [64, 400],
            mask_kernels_m: [2e-3, 1e-3],
            scout_weight: 0.1,
            weight: 0.02,
            noise_m: 0.075e-3,
            weights: [0.02, 0.3],
            max_iterations: 20,
            close: 0.15,
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
    /// The membrane alone: the mask is next to empty.
    #[strum(to_string = "membrane alone: the mask is next to empty")]
    Membrane,
    /// The mask alone, because there is no image of a membrane with its camera.
    #[strum(to_string = "mask alone: no depth image with a camera")]
    NoImage,
    /// The mask alone, because the free membranes do not meet.
    #[strum(to_string = "mask alone: the free membranes do not reach the middle plane")]
    NoZone,
    /// The mask alone, because hardly any of the membrane lies on the tool.
    #[strum(to_string = "mask alone: too little of the membrane lies on the tool")]
    LittleContact,
}

/// How the membrane was used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointFit {
    /// Who answered.
    pub basis: Basis,
    /// Noise of the membrane against its template in the finest band: 1.48 times the median residual, meters.
    pub noise_m: f64,
    /// Weight of the mask beside the membrane.
    pub mask_weight: f64,
    /// Area where membranes would meet without a tool, of all fingers, square meters.
    pub zone_m2: f64,
    /// Share of it that the tool lifts.
    pub lifted: f64,
    /// Angle (radians) and way (meters) from the mask's own answer, where it was asked.
    pub from_mask: Option<[f64; 2]>,
}

impl JointFit {
    fn of(basis: Basis) -> Self {
        Self { basis, noise_m: f64::NAN, mask_weight: 1.0, zone_m2: 0.0, lifted: 0.0, from_mask: None }
    }
}

impl Register for JointConfig {
    fn run(&self, scene: &Scene<'_>, tool: &ToolModel, ask: Ask<'_>) -> Result<AlignReport, AlignError> {
        let mut config = self.clone();
        config.record = ask.record;
        if let Some(starts) = ask.starts {
            if starts.is_empty() || starts.iter().any(|s| !s.is_finite()) {
                return Err(AlignError::Config { what: "starts" });
            }
            config.starts = starts.to_vec();
        }
        let by_mask = |fit: JointFit| -> Result<AlignReport, AlignError> {
            let report = self.mask.run(scene, tool, ask)?;
            Ok(AlignReport { joint: Some(fit), ..report })
        };
        if scene.images().is_empty() {
            return by_mask(JointFit::of(Basis::NoImage));
        }
        let Some(problem) = Problem::new(scene, tool, &config)? else {
            return by_mask(JointFit::of(Basis::NoZone));
        };
        let answer = problem.solve();
        Ok(problem.report(scene.yz(), answer))
    }
}

/// A finger's image and its template.
struct Finger {
    image: Image,
    template: Arc<Template>,
}

/// The patches of the fingers in one band.
type Patches<'p> = Vec<(&'p BandField, Patch)>;

/// A question prepared for every band.
struct Problem<'a> {
    tool: &'a ToolModel,
    config: &'a JointConfig,
    fingers: Vec<Finger>,
    /// Mean of the places of the membranes, about which everything turns, `(y, z)`, meters.
    centroid: DVec2,
    /// The mask's points for scouts and for the answer; `None` where they are too few.
    mask: Option<[Cloud; 2]>,
    not_finite: usize,
}

/// What was found.
struct Answer {
    starts: Vec<PlanarPose>,
    runs: Vec<Progress>,
    winner: usize,
    rung: Rung,
    fit: JointFit,
    lookups: usize,
    trace: Vec<TraceStep>,
    points: usize,
}

impl<'a> Problem<'a> {
    /// `None` if no finger has a zone.
    fn new(scene: &Scene<'_>, tool: &'a ToolModel, config: &'a JointConfig) -> Result<Option<Self>, AlignError> {
        let mut images: Vec<Image> = scene.images().iter().filter_map(Image::new).collect();
        images.retain(|image| image.len() > 0);
        let nodes: usize = images.iter().map(Image::len).sum();
        if nodes < MIN_NODES {
            return Ok(None);
        }
        // The membranes of a gripper are alike: one curvature, that of all images.
        let curvature =
            images.iter().map(|image| image.curvature * image.len() as f64).sum::<f64>() / nodes as f64;
        let fingers: Vec<Finger> = images
            .into_iter()
            .filter_map(|image| Some(Finger { template: template(tool, image.side, curvature)?, image }))
            .collect();
        let places: Vec<DVec2> =
            fingers.iter().flat_map(|finger| finger.image.sample(BANDS[0], 64).map(|(place, _)| place)).collect();
        if places.is_empty() {
            return Ok(None);
        }
        let centroid = places.iter().sum::<DVec2>() / places.len() as f64;
        let cleaned = match clean(scene.yz(), MIN_POINTS) {
            Ok(cleaned) => Some(cleaned),
            Err(AlignError::TooFewPoints { .. } | AlignError::Coincident { .. }) => None,
            Err(error) => return Err(error),
        };
        let not_finite = cleaned.as_ref().map_or(0, |cleaned| cleaned.not_finite);
        let mask = cleaned.map(|cleaned| {
            config.mask_points.map(|count| {
                let points = &cleaned.points;
                Cloud::new(spread(points.len(), count).into_iter().map(|i| points[i] - centroid))
            })
        });
        Ok(Some(Self { tool, config, fingers, centroid, mask, not_finite }))
    }

    /// The images in one band.
    fn patches(&self, band: usize) -> Patches<'_> {
        let nodes: usize = self.fingers.iter().map(|finger| finger.image.len()).sum();
        let share = |len: usize| (self.config.points[band] * len).div_ceil(nodes.max(1));
        let patch = |finger: &'_ Finger| {
            let places = finger.image.sample(BANDS[band], share(finger.image.len()));
            Patch::new(places.map(|(place, value)| (place - self.centroid, value)))
        };
        self.fingers.iter().map(|finger| (&finger.template[band], patch(finger))).collect()
    }

    fn joint<'p>(&'p self, band: usize, patches: &'p Patches<'p>, last: bool, weight: f64) -> Joint<'p> {
        let mask = self.mask.as_ref().map(|clouds| MaskPart {
            field: &self.tool.field,
            cloud: &clouds[usize::from(last)],
            kernel_m: self.config.mask_kernels_m[usize::from(last)],
            weight,
        });
        Joint { fingers: patches, kernel_m: self.config.kernels_m[band], mask, lookups: 0 }
    }

    fn solve(&self) -> Answer {
        let config = self.config;
        let mut starts = if config.starts.is_empty() { vec![PlanarPose::default()] } else { config.starts.clone() };
        let mut lookups = 0;
        let mut trace = Vec::new();
        let bands: [Patches<'_>; 4] = std::array::from_fn(|band| self.patches(band));
        let mut descend = |run: usize, at: &mut Progress, band: usize, last: bool, weight: f64, small: f64| {
            let mut joint = self.joint(band, &bands[band], last, weight);
            let trace = config.record.then_some(&mut trace);
            let mut noted = Noted { cost: &mut joint, run, centroid: self.centroid, trace };
            let sums = minimize(&mut noted, at, config.max_iterations, small);
            (at.cost, at.inliers, at.inlier_squares) = (sums.cost, sums.inliers, sums.inlier_squares);
            lookups += joint.lookups;
        };
        let mut runs: Vec<Progress> =
            starts.iter().map(|s| Progress::new(State::from_pose(*s, self.centroid))).collect();
        let scout_weight = config.scout_weight;
        for (run, at) in runs.iter_mut().enumerate() {
            descend(run, at, 0, false, scout_weight, 1e-4);
            descend(run, at, 1, false, scout_weight, 5e-5);
        }
        // The mask's own scout.
        if config.starts.is_empty() && let Some([scouts, _]) = &self.mask {
            let mut search = Search::new(&self.tool.field, self.centroid, config.max_iterations, false);
            let from = [State::from_pose(PlanarPose::default(), self.centroid)];
            let mut found = search.scout(&from, scouts, &[8e-3, 2e-3]);
            let mut at = found.remove(0);
            descend(runs.len(), &mut at, 1, false, scout_weight, 5e-5);
            runs.push(at);
            starts.push(PlanarPose::default());
        }
        for (run, at) in runs.iter_mut().enumerate() {
            descend(run, at, 2, false, scout_weight, 5e-5);
        }
        let allowed = |run: &Progress| config.mask.prior.allows(run.state.to_pose(self.centroid));
        let mut order: Vec<usize> = (0..runs.len()).collect();
        order.sort_by(|&a, &b| {
            allowed(&runs[b]).cmp(&allowed(&runs[a])).then_with(|| runs[a].cost.total_cmp(&runs[b].cost))
        });
        let best = order[0];
        let noise_m = self.noise(&bands[3], runs[best].state);
        let weight = (config.weight * (noise_m / config.noise_m).powi(4)).clamp(config.weights[0], config.weights[1]);
        let limit = runs[best].cost * (1.0 + config.close);
        let mut winner = best;
        let mut cheapest = f64::INFINITY;
        let mut ends: Vec<State> = Vec::new();
        order.retain(|&run| runs[run].cost <= limit);
        for run in order.into_iter().take(2) {
            if ends.iter().any(|end| end.is_near(&runs[run].state)) {
                continue;
            }
            ends.push(runs[run].state);
            let at = &mut runs[run];
            descend(run, at, 3, true, weight, 2e-5);
            if at.cost < cheapest {
                (winner, cheapest) = (run, at.cost);
            }
        }
        let nodes: usize = self.fingers.iter().map(|finger| finger.image.len()).sum();
        let fit = JointFit {
            basis: if self.mask.is_some() { Basis::Both } else { Basis::Membrane },
            noise_m,
            mask_weight: if self.mask.is_some() { weight } else { 0.0 },
            zone_m2: nodes as f64 * crate::tent::STEP_M.powi(2),
            lifted: 0.0,
            from_mask: None,
        };
        let points = bands[3].iter().map(|(_, patch)| patch.len()).sum();
        Answer { starts, runs, winner, rung: Rung::Single, fit, lookups, trace, points }
    }

    /// 1.48 times the median residual at a state, meters.
    fn noise(&self, patches: &Patches<'_>, state: State) -> f64 {
        let mut residuals = Vec::new();
        for (template, patch) in patches {
            template.residuals(patch, state, |r, _| residuals.push(r.abs()));
        }
        let middle = residuals.len() / 2;
        let (_, median, _) = residuals.select_nth_unstable_by(middle, f32::total_cmp);
        1.48 * f64::from(*median)
    }

    fn report(&self, points_yz: &[DVec2], answer: Answer) -> AlignReport {
        let config = self.config;
        let best = answer.runs[answer.winner];
        let pose = best.state.to_pose(self.centroid);
        let seen = self.mask.as_ref().map(|[_, cloud]| of_cloud(cloud, self.centroid, &self.tool.field, best.state));
        let square = config.kernels_m[3].powi(2);
        let runs: Vec<Run> = answer
            .runs
            .iter()
            .zip(&answer.starts)
            .map(|(run, start)| Run {
                requested: *start,
                start: *start,
                end: run.state.to_pose(self.centroid),
                cost_m2: run.cost * square,
                iterations: run.iterations,
                stop: run.stop,
            })
            .collect();
        AlignReport {
            grasp_from_object: pose,
            grasp_from_object_6dof: None,
            converged: best.stop.converged(),
            stop: best.stop,
            start: answer.starts[answer.winner],
            winner: answer.winner,
            rung: answer.rung,
            ladder: Vec::new(),
            certificate: None,
            iterations: runs.iter().map(|run| run.iterations).sum(),
            lookups: answer.lookups,
            offered: points_yz.len(),
            not_finite: self.not_finite,
            used: answer.points,
            inlier_share: best.inliers as f64 / answer.points.max(1) as f64,
            inlier_rms_m: (best.inlier_squares / (best.inliers as f64).max(1.0)).sqrt(),
            within_prior: config.mask.prior.allows(pose),
            observability: seen,
            joint: Some(answer.fit),
            directions: None,
            trace: answer.trace,
            fits: if config.record {
                fits(points_yz, &self.tool.field, pose, config.mask_kernels_m[1])
            } else {
                Vec::new()
            },
            runs,
        }
    }
}

/// Fewest nodes of all zones together: one square centimeter.
const MIN_NODES: usize = 400;
