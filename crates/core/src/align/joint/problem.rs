//! The search for the pose under which templates and silhouette fit the membranes and the mask.

use std::f64::consts::TAU;
use std::rc::Rc;
use std::sync::Arc;

use glam::DVec2;

use super::cost::{Joint, MaskPart, Noted, Patch, Relief, noise_m};
use super::image::Image;
use super::smooth::{BANDS, DECIDING, FINEST};
use super::template::{BandField, Grasp, Template, template};
use super::turned::{Frame, Turned, turned};
use super::{Basis, EXPLAINED, Found, JointConfig, JointFit, PREDICTED_EXPLAINED};
use crate::align::batch::{Cloud, State};
use crate::align::observability::of_cloud;
use crate::align::planar::fits;
use crate::align::search::{Progress, Search, minimize};
use crate::align::{
    ANGLE_SCALE_M, AlignError, AlignReport, Ask, MIN_POINTS, Prior, Run, Rung, Scene, TraceStep, clean,
};
use crate::frames::PlanarPose;
use crate::mesh::sampling::spread;
use crate::rig::CameraTolerance;
use crate::symmetry::Symmetry;
use crate::tent::FreeShape;
use crate::tool::ToolModel;

/// Smallest area of the membranes that is compared, square meters.
const MIN_AREA_M2: f64 = 1e-4;
/// Places of the membranes that are compared in each band, coarse to fine, and for the answer.
pub(super) const POINTS: [usize; LAST + 1] = [100, 150, 400, 3000];
/// Position in [`POINTS`] of what decides the answer.
pub(super) const LAST: usize = 3;
/// Widths of the Geman-McClure kernel likewise, meters.
pub(super) const KERNELS_M: [f64; LAST + 1] = [4e-3, 1e-3, 0.5e-3, 0.5e-3];
/// Points of the mask while starts are told apart, and for the answer.
const MASK_POINTS: [usize; 2] = [64, 400];
/// Widths of the mask's kernel, meters, likewise.
const MASK_KERNELS_M: [f64; 2] = [2e-3, 1e-3];
/// Weight of the mask's mean cost beside the membrane's while starts are told apart.
pub(super) const SCOUTS_WEIGHT: f64 = 0.1;
/// The same for the answer, where the membrane has the noise of [`NOISE_M`]. It grows with the fourth power of the noise: what the
/// membrane tells falls with the square of the noise, and model errors make its residuals alike.
const WEIGHT: f64 = 0.02;
const NOISE_M: f64 = 0.075e-3;
/// Least and greatest weight for the answer.
const WEIGHTS: [f64; 2] = [0.02, 0.3];
/// Least weight beside predicted images: their errors are no noise, so that nothing is seen of them in the images.
const PREDICTED_WEIGHT: f64 = 0.3;
/// Mean cost of the mask at the membrane's pose from which on it counts less, by its inverse.
const AGREES: f64 = 0.1;
/// Costs this close, as a share, do not tell two ends apart.
const CLOSE: f64 = 0.15;
/// Share of the membrane's relief that an answer from the prior must explain, or scouts start all around. Little, because an
/// answer on which the first scouts agree is hardly ever another pose's.
const STANDS: f64 = 0.2;
/// Share of its cost that another pose must be ahead of it, and where grasps are known to be from the lab's grid.
const AHEAD: [f64; 2] = [0.03, 0.12];
/// Most steps in each band.
const STEPS: usize = 20;
/// Kernels of the mask's own scouts, meters, wide to narrow.
const MASK_SCOUTS_M: [f64; 2] = [8e-3, 2e-3];
/// Angles of further starts as shares of the prior's, by rung.
const MORE: [[f64; 2]; 2] = [[0.45, -0.45], [0.9, -0.9]];
/// Steps that move no point by more than about this, meters, end the descents.
pub(super) const STEPS_M: [f64; 4] = [1e-4, 5e-5, 5e-5, 1e-5];

/// Share by which scouts may be dearer than the cheapest after each band.
pub(super) const WORTH: [f64; LAST] = [0.6, 0.4, 0.25];
/// Ends of scouts from all around that are refined.
const ENDS: usize = 4;
/// Places of the membranes that they compare in the coarsest band: more than those from the prior, which start nearer.
const PLACES_AROUND: usize = 200;
/// Most templates that an end of theirs goes through: where it ends another one may be nearer.
const SETTLED: usize = 2;
/// Most steps of scouts that start all around, and of the last descent.
const STEPS_AROUND: [usize; LAST + 1] = [6, 8, 12, 8];

/// A finger's image and its template.
struct Finger {
    image: Image,
    /// The template of a grasp in the middle.
    template: Arc<Template>,
}

/// The patches of the fingers in one band.
pub(super) type Patches = Vec<(Arc<BandField>, Rc<Patch>)>;

/// A question prepared for every band.
pub(super) struct Problem<'a> {
    pub(super) tool: &'a ToolModel,
    pub(super) config: JointConfig,
    ask: Ask<'a>,
    fingers: Vec<Finger>,
    /// Mean of the places of the membranes, about which everything turns, `(y, z)`, meters.
    centroid: DVec2,
    /// The mask's points for scouts and for the answer; `None` where they are too few.
    mask: Option<[Cloud; 2]>,
    not_finite: usize,
    free: FreeShape,
    /// True where a model predicted the images.
    pub(super) predicted: bool,
    /// Tolerance of the cameras' poses.
    pub(super) tolerance: CameraTolerance,
}

/// Outcome of a search: its starts and their runs.
pub(super) struct Answer {
    starts: Vec<PlanarPose>,
    runs: Vec<Progress>,
    winner: usize,
    pub(super) rung: Rung,
    pub(super) fit: JointFit,
    pub(super) lookups: usize,
    trace: Vec<TraceStep>,
    points: usize,
    /// True where scouts met in the best end, in the prior, and none nearly as good lies elsewhere.
    settled: bool,
}

/// Descents with what they cost and left behind.
pub(super) struct Descents<'p, 'a> {
    problem: &'p Problem<'a>,
    patches: [Patches; LAST + 1],
    pub(super) lookups: usize,
    trace: Vec<TraceStep>,
    /// Most steps in each band.
    pub(super) steps: [usize; LAST + 1],
}

/// Patches of one band with other templates.
fn under(patches: &Patches, templates: &[Arc<Template>], band: usize) -> Patches {
    templates.iter().zip(patches).map(|(template, (_, patch))| (template[band].clone(), patch.clone())).collect()
}

impl Descents<'_, '_> {
    /// The descent of a stage on images under templates.
    fn descend_on(&mut self, fingers: &Patches, run: usize, at: &mut Progress, stage: usize, weight: f64) {
        let last = usize::from(stage == LAST);
        let mask = self.problem.mask.as_ref().map(|clouds| MaskPart {
            field: &self.problem.tool.field,
            cloud: &clouds[last],
            kernel_m: MASK_KERNELS_M[last],
            weight,
        });
        let mut joint = Joint { fingers, kernel_m: KERNELS_M[stage], mask, lookups: 0 };
        let trace = self.problem.ask.record.then_some(&mut self.trace);
        let mut noted = Noted { cost: &mut joint, run, centroid: self.problem.centroid, trace };
        let sums = minimize(&mut noted, at, self.steps[stage], STEPS_M[stage]);
        (at.cost, at.inliers, at.inlier_squares) = (sums.cost, sums.inliers, sums.inlier_squares);
        self.lookups += joint.lookups;
    }

    /// A stage's images under the templates of a grasp.
    fn under(&self, grasp: Grasp, stage: usize) -> Patches {
        under(&self.patches[stage], &self.problem.templates(grasp), stage.min(DECIDING))
    }

    /// Goes down on one band, with the templates of its turn.
    pub(super) fn descend(&mut self, run: usize, at: &mut Progress, stage: usize, weight: f64) {
        let fingers = self.under(self.problem.grasp(at.state, false), stage);
        self.descend_on(&fingers, run, at, stage, weight);
    }

    /// The last descent, with the templates of its place, again until it ends where they are of.
    fn settle(&mut self, run: usize, at: &mut Progress, weight: f64) {
        for _ in 0..SETTLED {
            let grasp = self.problem.grasp(at.state, true);
            self.descend_on(&self.under(grasp, LAST), run, at, LAST, weight);
            if self.problem.grasp(at.state, true) == grasp {
                break;
            }
        }
    }

    /// The winner's last descent once more in the finest band. Its cost stays what it was compared by.
    fn polish(&mut self, run: usize, at: &mut Progress, weight: f64) {
        let problem = self.problem;
        if problem.finest() == FINEST {
            let cost = at.cost;
            self.descend_on(&problem.patches_at(FINEST, POINTS[LAST], at.state), run, at, LAST, weight);
            at.cost = cost;
        }
    }

    /// Share of the membranes' relief that the tool explains at a state, and the noise that it leaves, meters.
    fn told(&self, state: State) -> (f64, f64) {
        let relief = Relief::of(&self.under(self.problem.grasp(state, true), LAST), state, KERNELS_M[LAST]);
        (relief.explained(), noise_m(relief.residuals_m))
    }

    fn points(&self) -> usize {
        self.patches[LAST].iter().map(|(_, patch)| patch.len()).sum()
    }

    /// Through the bands from one start, until it meets the end of a run before.
    fn scout(&mut self, runs: &[Progress], at: &mut Progress, from: usize) {
        for stage in from..LAST {
            if let Some(met) = runs.iter().find(|met| alike(&met.state, &at.state)) {
                *at = Progress { iterations: at.iterations, ..*met };
                return;
            }
            self.descend(runs.len(), at, stage, SCOUTS_WEIGHT);
        }
    }
}

/// True where two ends are the same place, as far as scouts can tell.
pub(super) fn alike(a: &State, b: &State) -> bool {
    const SAME_M: f64 = 6e-4;
    let turned = (a.phi - b.phi).abs();
    turned.min((TAU - turned).abs()) * ANGLE_SCALE_M < SAME_M && a.place.distance(b.place) < SAME_M
}

impl<'a> Problem<'a> {
    /// `None` if the membranes show too little of where they would meet, or the tool has nothing there.
    pub(super) fn new(
        scene: &Scene<'_>,
        tool: &'a ToolModel,
        config: JointConfig,
        ask: Ask<'a>,
    ) -> Result<Option<Self>, AlignError> {
        let finite = tool.mesh.vertices.iter().filter(|v| v.is_finite());
        let tops = finite.fold([0f64; 2], |[low, high], v| [low.max(-v.x), high.max(v.x)]);
        let images: Vec<Image> = scene.images().iter().filter_map(|image| Image::new(image, tops)).collect();
        let area: f64 = images.iter().map(Image::area_m2).sum();
        if area < MIN_AREA_M2 {
            return Ok(None);
        }
        // The membranes of a gripper are alike: one free shape, the mean of all images.
        let mean =
            |of: fn(&Image) -> DVec2| images.iter().map(|image| of(image) * image.area_m2()).sum::<DVec2>() / area;
        let free = FreeShape {
            height_m: mean(|image| DVec2::splat(image.free.height_m)).x,
            slope: mean(|image| image.free.slope),
            bend: mean(|image| image.free.bend),
            reaches: images.iter().all(|image| image.free.reaches),
            ..FreeShape::default()
        };
        let fingers: Vec<Finger> = images
            .into_iter()
            .filter_map(|image| Some(Finger { template: template(tool, image.side, free, Grasp::default())?, image }))
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
        let not_finite = scene.yz().iter().filter(|p| !p.is_finite()).count();
        let mask = cleaned.map(|cleaned| {
            MASK_POINTS.map(|count| {
                let points = &cleaned.points;
                Cloud::new(spread(points.len(), count).into_iter().map(|i| points[i] - centroid))
            })
        });
        let predicted = scene.images().iter().any(|image| image.predicted);
        Ok(Some(Self {
            tolerance: scene.tolerance(),
            tool,
            config,
            ask,
            fingers,
            centroid,
            mask,
            not_finite,
            predicted,
            free,
        }))
    }

    /// The point about which everything turns, `(y, z)`, meters.
    pub(super) fn centroid(&self) -> DVec2 {
        self.centroid
    }

    /// The answer without the mask, if there is one to leave out and that answer is better by `gain` of what the tool explains.
    pub(super) fn solve_without_mask(&mut self, answer: &Answer, gain: f64) -> Option<Answer> {
        let mask = self.mask.take()?;
        let alone = self.solve();
        self.mask = Some(mask);
        (alone.fit.explained > answer.fit.explained + gain).then_some(alone)
    }

    /// The images as a stage compares them.
    fn patches(&self, stage: usize) -> Patches {
        self.patches_of(stage.min(DECIDING), POINTS[stage])
    }

    /// About `points` places of the images in a band.
    pub(super) fn patches_of(&self, band: usize, points: usize) -> Patches {
        let nodes: usize = self.fingers.iter().map(|finger| finger.image.len()).sum();
        let patch = |finger: &Finger| {
            let count = (points * finger.image.len()).div_ceil(nodes.max(1));
            let places = finger.image.sample(BANDS[band], count);
            Patch::new(places.map(|(place, value)| (place - self.centroid, value)))
        };
        self.fingers.iter().map(|finger| (finger.template[band].clone(), Rc::new(patch(finger)))).collect()
    }

    /// The templates of the fingers for a grasp.
    pub(super) fn templates(&self, grasp: Grasp) -> Vec<Arc<Template>> {
        let of = |finger: &Finger| {
            let made = || template(self.tool, finger.image.side, self.free, grasp);
            if grasp == Grasp::default() { None } else { made() }.unwrap_or_else(|| finger.template.clone())
        };
        self.fingers.iter().map(of).collect()
    }

    /// The coarsest bands of the fingers' templates turned all around.
    pub(super) fn turned(&self, frame: Frame) -> Vec<Arc<Turned>> {
        let of = |finger: &Finger| turned(self.tool, finger.image.side, self.free, frame);
        self.fingers.iter().filter_map(of).collect()
    }

    /// The finest band that images have in common with their templates: those of a membrane that hangs from the tool, and of a
    /// predicted one, err in lengths of 0.7 to 1.5 mm.
    pub(super) fn finest(&self) -> usize {
        if self.free.reaches && !self.predicted { FINEST } else { DECIDING }
    }

    fn grasp(&self, at: State, placed: bool) -> Grasp {
        Grasp::of(at.to_pose(self.centroid), placed)
    }

    pub(super) fn frame(&self) -> Frame {
        *self.tool.derived(|tool| Frame::of(&tool.mesh))
    }

    /// About `points` places of the images in a band, with the templates for a state.
    pub(super) fn patches_at(&self, band: usize, points: usize, at: State) -> Patches {
        under(&self.patches_of(band, points), &self.templates(self.grasp(at, true)), band)
    }

    fn allowed(&self, at: &Progress) -> bool {
        Prior::default().allows(at.state.to_pose(self.centroid))
    }

    pub(super) fn descents(&self) -> Descents<'_, 'a> {
        let patches = std::array::from_fn(|stage| self.patches(stage));
        Descents { problem: self, patches, lookups: 0, trace: Vec::new(), steps: [STEPS; LAST + 1] }
    }

    /// Two scouts from the middle of the prior, one by the bands and one by the mask; two more, and two more, while the best
    /// is alone, has a rival of nearly its cost elsewhere, or lies where no gripper holds a tool. Then the best two are
    /// refined.
    pub(super) fn solve(&self) -> Answer {
        let own = self.ask.starts.is_none();
        let mut starts = self.ask.starts.map_or_else(|| vec![PlanarPose::default()], <[_]>::to_vec);
        let mut descents = self.descents();
        let mut runs: Vec<Progress> = Vec::new();
        let mut rung = if own { Rung::Single } else { Rung::Fixed };
        let mut more = MORE.iter().filter(|_| own);
        let mut settled = false;
        let order = loop {
            for start in &starts[runs.len()..] {
                let mut at = Progress::new(State::from_pose(*start, self.centroid));
                descents.scout(&runs, &mut at, 0);
                runs.push(at);
            }
            if rung == Rung::Single
                && let Some(found) = self.mask_scout(&mut descents.lookups)
            {
                let mut at = Progress::new(found);
                descents.scout(&runs, &mut at, 1);
                runs.push(at);
                starts.push(found.to_pose(self.centroid));
            }
            let order = self.order(&runs);
            let best = &runs[order[0]];
            let (met, apart): (Vec<&Progress>, Vec<&Progress>) =
                runs.iter().partition(|at| alike(&at.state, &best.state));
            let rival = apart.iter().any(|at| at.cost < best.cost * (1.0 + CLOSE));
            if self.allowed(best) && met.len() > 1 && !rival {
                settled = true;
                break order;
            }
            let Some(shares) = more.next() else { break order };
            rung = Rung::Several;
            let theta_rad = Prior::default().theta_rad;
            starts.extend(shares.map(|share| PlanarPose { theta_rad: share * theta_rad, ..PlanarPose::default() }));
        };
        let best = runs[order[0]];
        let (explained, noise_m) = descents.told(best.state);
        let mask_weight = self.mask_weight(noise_m, best.state);
        let winner = self.refine(&mut runs, &order, &mut descents, mask_weight);
        let fit = self.fit(noise_m, mask_weight, explained);
        let points = descents.points();
        Answer { starts, runs, winner, rung, fit, lookups: descents.lookups, trace: descents.trace, points, settled }
    }

    fn fit(&self, noise_m: f64, mask_weight: f64, explained: f64) -> JointFit {
        JointFit {
            basis: if self.mask.is_some() { Basis::Both } else { Basis::Membrane },
            noise_m,
            mask_weight,
            area_m2: self.fingers.iter().map(|finger| finger.image.area_m2()).sum(),
            explained,
        }
    }

    /// True where grasps are known to be from the lab's grid and the first scouts agree on an answer that explains enough, so that
    /// nobody looks elsewhere. One of eleven others was wrong where nothing was known.
    pub(super) fn stands(&self, answer: &Answer) -> bool {
        let least = if self.predicted { PREDICTED_EXPLAINED } else { STANDS };
        self.ask.in_lab_grid
            && answer.settled
            && answer.rung == Rung::Single
            && answer.fit.basis == Basis::Both
            && answer.fit.explained >= least
    }

    /// Scouts all around; a pose that they find is the answer if it is cheaper by a margin than the one in the prior.
    pub(super) fn look_around(&self, points_yz: &[DVec2], at_hand: Found) -> Found {
        let mut descents = self.descents();
        descents.steps = STEPS_AROUND;
        descents.patches[0] = self.patches_of(0, PLACES_AROUND);
        let (mut starts, mut runs): (Vec<State>, Vec<Progress>) =
            self.anywhere(&mut descents, ENDS).into_iter().unzip();
        descents.trace.clear();
        let Some(likeliest) = runs.first().map(|best| best.state) else { return at_hand };
        let weight = self.mask_weight(descents.told(likeliest).1, likeliest);
        let known = at_hand.as_ref().ok().map(|report| State::from_pose(report.grasp_from_object, self.centroid));
        starts.extend(known);
        runs.extend(known.map(Progress::new));
        // Templates of its place are worth their making only for one that may be the best, and for the one at hand.
        for (run, at) in runs.iter_mut().enumerate() {
            descents.descend(run, at, LAST, weight);
        }
        let dearest = runs.iter().map(|at| at.cost).fold(f64::INFINITY, f64::min) * (1.0 + CLOSE);
        // The one at hand is the last.
        let others = runs.len() - usize::from(known.is_some());
        for (run, at) in runs.iter_mut().enumerate().filter(|(run, at)| at.cost <= dearest || *run == others) {
            descents.settle(run, at, weight);
        }
        // One in the prior stays unless another one is ahead.
        let first = runs.last().filter(|first| known.is_some() && self.allowed(first));
        let limit = first.map_or(f64::INFINITY, |first| first.cost * (1.0 - AHEAD[usize::from(self.ask.in_lab_grid)]));
        let ends = runs.iter().map(|at| (at.state.to_pose(self.centroid), at.cost));
        let ends = ends.filter(|(pose, _)| self.config.allows(*pose)).collect();
        let found = (0..runs.len()).filter(|run| self.config.allows(runs[*run].state.to_pose(self.centroid)));
        let winner = found.min_by(|a, b| runs[*a].cost.total_cmp(&runs[*b].cost)).filter(|run| runs[*run].cost < limit);
        let told = winner.map(|run| (run, descents.told(runs[run].state)));
        // Where the mask alone has an answer, and the more where it has none, a membrane must show some contact.
        let by_membrane = at_hand.as_ref().is_ok_and(AlignReport::has_membrane);
        let measured = match &at_hand {
            Ok(_) if by_membrane => f64::NEG_INFINITY,
            Ok(_) => 0.0,
            Err(_) => EXPLAINED,
        };
        let least = if self.predicted { PREDICTED_EXPLAINED } else { measured };
        let told = told.filter(|(_, (explained, _))| *explained > least);
        // Of equal answers the one that is turned least; where that is the answer in the prior, it stays as it was.
        let upright = told.map(|(winner, _)| {
            let pose = runs[winner].state.to_pose(self.centroid);
            State::from_pose(Symmetry::of(self.tool).nearest(pose, PlanarPose::default()), self.centroid)
        });
        let stays = by_membrane && upright.zip(known).is_some_and(|(upright, known)| alike(&upright, &known));
        let Some(((winner, (explained, noise_m)), upright)) = told.zip(upright).filter(|_| !stays) else {
            return at_hand.map(|report| AlignReport { ends, ..report });
        };
        runs[winner].state = State { phi: crate::units::wrap_angle(upright.phi), ..upright };
        descents.settle(winner, &mut runs[winner], weight);
        descents.polish(winner, &mut runs[winner], weight);
        let fit = self.fit(noise_m, weight, explained);
        let (starts, points) = (starts.iter().map(|at| at.to_pose(self.centroid)).collect(), descents.points());
        let (lookups, trace) = (descents.lookups, descents.trace);
        let answer = Answer { starts, runs, winner, rung: Rung::Around, fit, lookups, trace, points, settled: false };
        Ok(AlignReport { ends, ..self.report(points_yz, answer) })
    }

    /// Runs by preference: within the prior before outside, then the cheaper one.
    fn order(&self, runs: &[Progress]) -> Vec<usize> {
        let mut order: Vec<usize> = (0..runs.len()).collect();
        order.sort_by(|&a, &b| {
            let (a, b) = (&runs[a], &runs[b]);
            self.allowed(b).cmp(&self.allowed(a)).then_with(|| a.cost.total_cmp(&b.cost))
        });
        order
    }

    /// Pose to which the mask alone leads from the middle of the prior.
    fn mask_scout(&self, lookups: &mut usize) -> Option<State> {
        let [scouts, _] = self.mask.as_ref()?;
        let mut search = Search::new(&self.tool.field, self.centroid, STEPS, false);
        let from = [State::from_pose(PlanarPose::default(), self.centroid)];
        let found = search.scout(&from, scouts, &MASK_SCOUTS_M).pop();
        *lookups += search.lookups;
        Some(found?.state)
    }

    /// Refines the best two scouts that are apart and cost about the same; which is the best.
    fn refine(&self, runs: &mut [Progress], order: &[usize], descents: &mut Descents<'_, '_>, weight: f64) -> usize {
        let limit = runs[order[0]].cost * (1.0 + CLOSE);
        let mut refined: Vec<usize> = Vec::with_capacity(2);
        for &run in order {
            let at = runs[run];
            let worth = at.cost <= limit && self.allowed(&at) == self.allowed(&runs[order[0]]);
            if refined.is_empty() || worth && refined.len() < 2 && !alike(&runs[refined[0]].state, &at.state) {
                descents.settle(run, &mut runs[run], weight);
                refined.push(run);
            }
        }
        let winner = refined.into_iter().min_by(|&a, &b| runs[a].cost.total_cmp(&runs[b].cost)).unwrap_or(0);
        descents.polish(winner, &mut runs[winner], weight);
        winner
    }

    /// Weight of the mask in the answer.
    fn mask_weight(&self, noise_m: f64, state: State) -> f64 {
        let Some([_, cloud]) = &self.mask else { return 0.0 };
        let kernel = MASK_KERNELS_M[1];
        let cost = self.tool.field.sums(cloud, state, kernel).cost / (kernel * kernel * cloud.len().max(1) as f64);
        let by_noise = WEIGHT * (noise_m / NOISE_M).powi(4);
        let least = if self.predicted { PREDICTED_WEIGHT } else { WEIGHTS[0] };
        by_noise.max(least).min(WEIGHTS[1]) * (AGREES / cost.max(1e-9)).min(1.0)
    }

    pub(super) fn report(&self, points_yz: &[DVec2], answer: Answer) -> AlignReport {
        let best = answer.runs[answer.winner];
        let pose = best.state.to_pose(self.centroid);
        let pose = Prior::default().slid_in(pose, || self.uncertainty(pose));
        let mask = self.mask.as_ref().filter(|_| answer.fit.basis == Basis::Both);
        let seen = mask.map(|[_, cloud]| of_cloud(cloud, self.centroid, &self.tool.field, best.state));
        let square = KERNELS_M[LAST].powi(2);
        let run = |(run, start): (&Progress, &PlanarPose)| Run {
            requested: *start,
            start: *start,
            end: run.state.to_pose(self.centroid),
            cost_m2: run.cost * square,
            iterations: run.iterations,
            stop: run.stop,
        };
        let runs: Vec<Run> = answer.runs.iter().zip(&answer.starts).map(run).collect();
        let fits =
            if self.ask.record { fits(points_yz, &self.tool.field, pose, MASK_KERNELS_M[1]) } else { Vec::new() };
        let inliers = (best.inliers, best.inlier_squares);
        AlignReport {
            grasp_from_object: pose,
            lookups: answer.lookups,
            offered: points_yz.len(),
            not_finite: self.not_finite,
            within_prior: self.config.allows(pose),
            observability: seen,
            joint: Some(answer.fit),
            range: self.config.range,
            trace: answer.trace,
            fits,
            ..AlignReport::of(runs, answer.winner, answer.rung, answer.points, inliers)
        }
    }
}
