//! Branch and bound on the joint cost: a proof that no pose of the prior fits membrane and mask much better.

use super::cost::{Joint, MaskPart};
use super::problem::{Answer, LAST, Patches, Problem, STEPS_M};
use crate::align::batch::State;
use crate::align::certify::{Bounded, NEGLIGIBLE, Region, Undecided, prove};
use crate::align::search::{Progress, minimize};
use crate::align::windows::Floor;
use crate::align::{Certificate, Rung};
use crate::field::DistanceField;

/// Joint cost that is to be proved least.
struct Places<'p> {
    fingers: Patches<'p>,
    kernel_m: f64,
    mask: Option<Mask<'p>>,
    max_iterations: usize,
    lookups: usize,
}

/// The mask beside the membrane.
struct Mask<'p> {
    points: Undecided<'p>,
    field: &'p DistanceField,
    kernel_m: f64,
    weight: f64,
}

impl Mask<'_> {
    fn part(&self) -> MaskPart<'_> {
        let Self { field, kernel_m, weight, ref points } = *self;
        MaskPart { field, cloud: points.whole(), kernel_m, weight }
    }
}

impl Places<'_> {
    fn points(&self) -> usize {
        self.fingers.iter().map(|(_, patch)| patch.len()).sum()
    }
}

impl Bounded for Places<'_> {
    fn bound(&mut self, region: &Region, level: usize, enough: f64) -> [f64; 2] {
        let points = self.points().max(1) as f64;
        let mut all = Floor::default();
        for (template, patch) in &self.fingers {
            self.lookups += patch.len();
            let left = (enough - all.least(region.extent.half)) * points;
            all.add(&template.floor(patch, region.middle, self.kernel_m, region.extent, left), 1.0 / points);
            if all.least(region.extent.half) >= enough {
                return [all.least(region.extent.half), all.here];
            }
        }
        if let Some(mask) = &mut self.mask {
            let scale = mask.part().scale();
            let left = (enough - all.least(region.extent.half)) / scale;
            all.add(&mask.points.floor(region, level, left), scale);
        }
        [all.least(region.extent.half), all.here]
    }

    fn narrow(&mut self, region: &Region, level: usize) {
        if let Some(mask) = &mut self.mask {
            mask.points.narrow(region, level);
        }
    }

    fn descend(&mut self, from: State) -> Progress {
        let mask = self.mask.as_ref().map(Mask::part);
        let mut joint = Joint { fingers: &self.fingers, kernel_m: self.kernel_m, mask, lookups: 0 };
        let mut found = Progress::new(from);
        found.cost = minimize(&mut joint, &mut found, self.max_iterations, STEPS_M[LAST]).cost;
        self.lookups += joint.lookups;
        found
    }

    fn radius(&self) -> f64 {
        let mask = self.mask.as_ref().map_or(0.0, |mask| mask.points.whole().radius());
        self.fingers.iter().map(|(_, patch)| patch.radius()).fold(mask, f64::max)
    }

    fn negligible(&self) -> f64 {
        NEGLIGIBLE
    }

    fn lookups(&self) -> usize {
        self.lookups + self.mask.as_ref().map_or(0, |mask| mask.points.lookups)
    }
}

impl Problem<'_> {
    /// Proves that no pose of the prior is better than an answer, or takes what is better. The cost is that of the answer
    /// with its weight of the mask, on fewer places; what is found is refined on all, and counts only if it is cheaper there.
    pub(super) fn prove(&self, answer: &mut Answer) {
        let config = self.config();
        let fingers = self.patches_of(self.answer_band(), config.proof_points);
        let mask = self.mask().map(|[_, cloud]| Mask {
            points: Undecided::new(&self.tool().field, cloud, config.mask_kernels_m[1]),
            field: &self.tool().field,
            kernel_m: config.mask_kernels_m[1],
            weight: answer.fit.mask_weight,
        });
        let mut cost = Places {
            fingers: fingers.into_iter().map(|(template, patch)| (template, patch.outermost_first())).collect(),
            kernel_m: config.kernels_m[LAST],
            mask,
            max_iterations: config.max_iterations,
            lookups: 0,
        };
        let best = cost.descend(answer.end());
        let proved = prove(&mut cost, self.centroid(), &config.mask, best);
        answer.lookups += cost.lookups();
        let square = config.kernels_m[LAST].powi(2);
        answer.certificate = Some(Certificate {
            certified: proved.certified,
            points: cost.points(),
            cost_m2: proved.best.cost * square,
            lower_bound_m2: proved.lower_bound * square,
            nodes: proved.nodes,
            lookups: proved.lookups,
        });
        answer.rung = Rung::Certified;
        if !proved.best.state.is_near(&answer.end()) {
            self.follow(answer, proved.best.state);
        }
    }
}

#[cfg(test)]
mod tests;
