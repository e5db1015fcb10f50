//! Branch and bound: a proof that no pose of the prior fits much better than the answer.
//!
//! The poses are cut into boxes. In a box, no point can move farther than the box is wide, so its distance to the
//! silhouette is at least what it is in the middle less that way, and the kernel of that is a lower bound of its
//! cost. A box whose bound is no lower than the answer's cost less the gap is done; the others are cut smaller.
//!
//! Source of the idea: Breuel, Implementation techniques for geometric branch-and-bound matching methods, 2003.

use glam::DVec2;

use super::batch::{Cloud, Extent, State};
use super::search::{Progress, Search};
use super::windows::Slopes;
use super::{AlignConfig, Certificate};

/// The box is this much larger than the prior (24 degrees, 6 mm for the default).
const WIDER: [f64; 2] = [24.0 / 22.5, 1.2];
/// Share of the cost by which an answer may miss the best and still count as proved.
const GAP: f64 = 0.02;
/// Cost per point, as a share of the squared kernel width, below which differences do not matter.
const NEGLIGIBLE: f64 = 1e-4;
/// Boxes of the angle to start from, half as wide as this, radians.
const SLAB_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Cuts in a row; boxes are then some nanometers wide.
const DEEPEST: usize = 48;

/// Poses about a middle one.
#[derive(Clone, Copy, Debug)]
struct Region {
    middle: State,
    extent: Extent,
    /// No pose in it costs less, per point.
    lower: f64,
}

impl Region {
    /// The halves along an axis: angle, y, z.
    fn halved(&self, axis: usize) -> [Self; 2] {
        [-0.5, 0.5].map(|side| {
            let mut part = *self;
            let mut half = part.extent.half;
            let step = side * half[axis];
            half[axis] *= 0.5;
            part.extent = Extent::new(half);
            match axis {
                0 => part.middle.phi += step,
                1 => part.middle.place.x += step,
                _ => part.middle.place.y += step,
            }
            part
        })
    }
}

/// Proof by branch and bound under way: its question, and how far the answer has come.
struct Proof<'a, 's> {
    cost: MaskCost<'a, 's>,
    config: &'a AlignConfig,
    centroid: DVec2,
    /// Largest size of y and z of a pose, meters, `grasp_from_object`.
    shift_m: f64,
    radius: f64,
    best: Progress,
    /// Least bound of the boxes that are done or given up.
    least: f64,
    nodes: usize,
}

/// Searches the prior, a little widened, for the best pose of `cloud`, from the answer `best`; returns the better one if there
/// is one. Of the settings, the prior and the budget count.
pub(super) fn certify(
    search: &mut Search<'_>,
    cloud: &Cloud,
    config: &AlignConfig,
    kernel: f64,
    best: Progress,
) -> (Certificate, Progress) {
    let centroid = search.centroid;
    let cost = MaskCost::new(search, cloud, kernel);
    let mut proof = Proof {
        config,
        centroid,
        shift_m: config.prior.shift_m * WIDER[1],
        radius: cost.whole().radius(),
        best,
        least: f64::INFINITY,
        nodes: 0,
        cost,
    };
    if !proof.allows(&proof.best) {
        proof.best.cost = f64::INFINITY;
    }
    let mut regions = proof.slabs(config.prior.theta_rad * WIDER[0]);
    for region in &mut regions {
        proof.look(region, 0);
    }
    proof.cut_all(regions, 0);
    let certificate = Certificate {
        certified: proof.least >= proof.enough(),
        points: cloud.len(),
        cost_m2: proof.best.cost,
        lower_bound_m2: proof.least.min(proof.best.cost),
        nodes: proof.nodes,
        lookups: proof.cost.lookups,
    };
    (certificate, proof.best)
}

/// The cost per point of contact points on the field, and what is undecided of them on each level of the cuts.
struct MaskCost<'a, 's> {
    search: &'a mut Search<'s>,
    kernel: f64,
    /// The whole cloud first.
    clouds: Vec<Cloud>,
    slopes: [Slopes; 3],
    lookups: usize,
}

impl<'a, 's> MaskCost<'a, 's> {
    fn new(search: &'a mut Search<'s>, cloud: &Cloud, kernel: f64) -> Self {
        let slopes = search.field.slopes();
        Self { search, kernel, clouds: vec![cloud.outermost_first()], slopes, lookups: 0 }
    }

    fn whole(&self) -> &Cloud {
        &self.clouds[0]
    }

    /// Lower bound of the cost in a region that was cut `level` times, and the cost in its middle. Where the bound reaches
    /// `enough`, both may stop there.
    fn bound(&mut self, region: &Region, level: usize, enough: f64) -> [f64; 2] {
        let count = self.whole().len() as f64;
        let way = region.extent.way(self.whole().radius());
        let slopes = self.slopes.iter().find(|s| way < s.reach);
        let cloud = &self.clouds[level];
        self.lookups += cloud.asked();
        let floor = self.search.field.bound(cloud, region.middle, self.kernel, region.extent, slopes, enough * count);
        [floor.least(region.extent.half), floor.here].map(|cost| cost / count)
    }

    /// Told before a region is cut: what is decided in all of it need not be asked in its parts.
    fn narrow(&mut self, region: &Region, level: usize) {
        if self.clouds.len() == level + 1 {
            self.clouds.push(Cloud::default());
        }
        let (upper, lower) = self.clouds.split_at_mut(level + 1);
        self.lookups += upper[level].asked();
        self.search.field.undecided(&upper[level], region.middle, region.extent, &mut lower[0]);
    }

    /// The end of a descent.
    fn descend(&mut self, from: State) -> Progress {
        let mut found = Progress::new(from);
        let before = self.search.lookups;
        self.search.descend_quietly(&mut found, &self.clouds[0], self.kernel);
        self.lookups += self.search.lookups - before;
        found
    }
}

impl Proof<'_, '_> {
    /// Regions that cover the poses with angles up to `theta_rad`.
    fn slabs(&self, theta_rad: f64) -> Vec<Region> {
        let count = (theta_rad / SLAB_RAD).ceil().max(1.0) as i32;
        let half_angle = theta_rad / f64::from(2 * count);
        (0..2 * count)
            .map(|i| {
                let phi = -theta_rad + f64::from(2 * i + 1) * half_angle;
                let turn = DVec2::from_angle(phi);
                let sweep =
                    2.0 * (0.5 * half_angle).sin() * (self.centroid.length() + self.shift_m * std::f64::consts::SQRT_2);
                let half = self.shift_m * (turn.x.abs() + turn.y.abs()) + sweep;
                let middle = State { phi, place: turn.rotate(self.centroid) };
                Region { middle, extent: Extent::new([half_angle, half, half]), lower: 0.0 }
            })
            .collect()
    }

    /// True where the region may hold a pose of the box: its place is that of the centroid, which turns with the angle.
    fn meets_the_box(&self, region: &Region) -> bool {
        let pose = region.middle.to_pose(self.centroid);
        let way = region.extent.way(region.middle.place.length() + region.extent.shift);
        pose.y_m.abs().max(pose.z_m.abs()) <= self.shift_m + way
    }

    /// True where a run ended at a pose that the prior allows; what is cheaper elsewhere proves nothing about it.
    fn allows(&self, run: &Progress) -> bool {
        self.config.prior.allows(run.state.to_pose(self.centroid))
    }

    /// Cost from which a region is done: it holds no pose that beats the best by more than the gap.
    fn enough(&self) -> f64 {
        self.best.cost * (1.0 - GAP) - NEGLIGIBLE * self.cost.kernel.powi(2)
    }

    /// Bounds a region, and follows its middle if that is better than the best so far.
    fn look(&mut self, region: &mut Region, level: usize) {
        self.nodes += 1;
        let enough = self.enough();
        let [lower, here] = self.cost.bound(region, level, enough);
        region.lower = region.lower.max(lower);
        if lower < enough && here < 0.999 * self.best.cost {
            let mut found = self.cost.descend(region.middle);
            if !self.allows(&found) {
                found = Progress { cost: here, ..Progress::new(region.middle) };
            }
            if found.cost < self.best.cost {
                self.best = found;
            }
        }
    }

    /// Works through regions, the most promising first.
    fn cut_all(&mut self, mut regions: Vec<Region>, level: usize) {
        regions.sort_by(|a, b| a.lower.total_cmp(&b.lower));
        for region in regions {
            if region.lower >= self.enough() || self.cost.lookups >= self.config.budget || level >= DEEPEST {
                self.least = self.least.min(region.lower);
            } else {
                self.cut(&region, level);
            }
        }
    }

    fn cut(&mut self, region: &Region, level: usize) {
        self.cost.narrow(region, level);
        // Halved are the widths that move the outermost point farthest.
        let half = region.extent.half;
        let ways = [half[0] * self.radius, half[1], half[2]];
        let most = ways.iter().copied().fold(0.0, f64::max);
        let halved = ways.map(|way| way > 0.6 * most);
        let mut parts = vec![*region];
        for axis in (0..3).filter(|&a| halved[a]) {
            parts = parts.iter().flat_map(|part| part.halved(axis)).collect();
        }
        parts.retain(|part| self.meets_the_box(part));
        for part in &mut parts {
            self.look(part, level + 1);
        }
        self.cut_all(parts, level + 1);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use proptest::prelude::*;

    use super::*;
    use crate::align::testing::{cross, cross_contacts, cuboid, filled};
    use crate::align::{AlignReport, Rung, align};
    use crate::field::DistanceField;
    use crate::frames::PlanarPose;
    use glam::DVec3;

    fn field() -> &'static DistanceField {
        static FIELD: OnceLock<DistanceField> = OnceLock::new();
        FIELD.get_or_init(|| DistanceField::from_mesh(&cross()).unwrap())
    }

    fn cloud(count: usize, seed: u64) -> Cloud {
        let points = cross_contacts(count, PlanarPose { theta_rad: 0.1, y_m: 1e-3, z_m: -2e-3 }, 4e-4, seed);
        let centroid = points.iter().sum::<DVec2>() / points.len() as f64;
        Cloud::new(points.into_iter().map(|p| p - centroid))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn no_pose_of_a_box_costs_less_than_its_bound(
            middle in proptest::array::uniform3(-1.0..1.0f64),
            half in proptest::array::uniform3(-4.0..0.0f64),
            inside in proptest::collection::vec(proptest::array::uniform3(-1.0..1.0f64), 8),
            seed in 0..20u64,
        ) {
            const KERNEL_M: f64 = 1e-3;
            let cloud = cloud(200, seed);
            let middle = State { phi: 0.5 * middle[0], place: DVec2::new(middle[1], middle[2]) * 8e-3 };
            // Boxes of all sizes: from 4 degrees by 4 mm down to a ten-thousandth of that.
            let half = [0.07 * 10f64.powf(half[0]), 4e-3 * 10f64.powf(half[1]), 4e-3 * 10f64.powf(half[2])];
            let extent = Extent::new(half);
            let slopes = field().slopes();
            let fitting = slopes.iter().find(|s| extent.way(cloud.radius()) < s.reach);
            let mut undecided = Cloud::default();
            field().undecided(&cloud, middle, extent, &mut undecided);
            prop_assert_eq!(undecided.len(), cloud.len());
            let plain = field().bound(&cloud, middle, KERNEL_M, extent, None, f64::INFINITY);
            let tangent = field().bound(&undecided, middle, KERNEL_M, extent, fitting, f64::INFINITY);
            let here = field().sums(&cloud, middle, KERNEL_M).cost;
            prop_assert!((plain.here - here).abs() <= 1e-5 * here + 1e-15, "{} is not {here}", plain.here);
            let [plain, tangent] = [plain, tangent].map(|floor| floor.least(extent.half));
            for at in inside {
                let state = State {
                    phi: middle.phi + at[0] * half[0],
                    place: middle.place + DVec2::new(at[1] * half[1], at[2] * half[2]),
                };
                let cost = field().sums(&cloud, state, KERNEL_M).cost;
                // A ten-thousandth for the sums in f32.
                let limit = cost * (1.0 + 1e-4) + 1e-12;
                prop_assert!(plain <= limit, "{plain} is above {cost} in {half:?}");
                prop_assert!(tangent <= limit, "with slopes {tangent} is above {cost} in {half:?}");
            }
        }
    }

    /// The settings that go to the proof at once.
    fn certified() -> AlignConfig {
        AlignConfig { rungs: vec![Rung::Certified], ..AlignConfig::default() }
    }

    fn cost(report: &AlignReport) -> f64 {
        report.runs[report.winner].cost_m2
    }

    #[test]
    fn the_fast_answer_is_the_proved_one() {
        for (seed, degrees) in [(1, -21.0), (2, -9.0), (3, 4.0), (4, 17.5)] {
            let truth = PlanarPose { theta_rad: f64::to_radians(degrees), y_m: 4e-3, z_m: -3e-3 };
            let mut points = cross_contacts(900, truth, 4e-4, seed);
            points.extend((0..100).map(|i| DVec2::new(0.012, 0.012) + DVec2::from_angle(f64::from(i)) * 3e-3));
            let fast = align(&points, field(), &AlignConfig::default()).unwrap();
            let proved = align(&points, field(), &certified()).unwrap();
            let certificate = proved.certificate.unwrap();
            assert_eq!((fast.rung, proved.rung, fast.certificate), (Rung::Single, Rung::Certified, None));
            assert!(certificate.certified && certificate.gap() < 0.025, "{certificate:?}");
            assert!(certificate.nodes > 50 && certificate.lookups < 10_000_000, "{certificate:?}");
            assert!(cost(&fast) <= cost(&proved) * 1.02, "{} against {}", cost(&fast), cost(&proved));
            assert_eq!(proved, align(&points, field(), &certified()).unwrap(), "bit for bit");
        }
    }

    #[test]
    fn a_valley_is_proved_too_and_a_small_budget_is_admitted() {
        let rod = DistanceField::from_mesh(&cuboid(DVec3::ZERO, DVec3::new(0.003, 0.003, 0.06))).unwrap();
        let truth = PlanarPose { theta_rad: 0.2, y_m: 1e-3, z_m: 0.0 };
        let points = filled(&[DVec2::new(0.003, 0.02)], 0.0, 800, truth, 3e-4, 1);
        let proved = align(&points, &rod, &certified()).unwrap();
        assert!(proved.certificate.unwrap().certified && proved.is_degenerate());
        let config = AlignConfig { budget: 20_000, ..certified() };
        let report = align(&points, &rod, &config).unwrap();
        let certificate = report.certificate.unwrap();
        assert!(!certificate.certified && certificate.lookups < 40_000, "{certificate:?}");
        assert!(certificate.lower_bound_m2 <= proved.certificate.unwrap().cost_m2);
        assert_eq!(report.grasp_from_object, proved.grasp_from_object, "what the starts found stays the answer");
    }

    #[test]
    fn the_proof_finds_what_the_starts_miss() {
        // Descents that see no farther than 0.3 mm: only a start beside the truth arrives.
        let truth = PlanarPose { theta_rad: 0.16, y_m: -4e-3, z_m: 4e-3 };
        let points = cross_contacts(900, truth, 2e-4, 5);
        let config = AlignConfig { kernels_m: vec![4e-4], max_iterations: 4, ..certified() };
        let report = align(&points, field(), &config).unwrap();
        let found = report.grasp_from_object;
        let off = (found.theta_rad - truth.theta_rad).abs().to_degrees();
        assert!(off < 2.0, "{off} deg");
        assert!(report.certificate.unwrap().certified);
    }
}
