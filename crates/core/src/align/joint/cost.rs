//! The cost of a pose: distance of the membrane from the template, and of the mask from the silhouette.

use std::rc::Rc;
use std::sync::Arc;

use glam::DVec2;

use super::template::BandField;
use crate::align::ANGLE_SCALE_M;
use crate::align::TraceStep;
use crate::align::batch::{Cloud, State};
use crate::align::lanes::{LANES, LaneSums, Lattice, Located, Sums};
use crate::align::search::{Cost, Progress};
use crate::field::DistanceField;
use crate::tent::STEP_M;

/// Least share of a point's curvature that counts where the kernel bends down.
const FLAT: f32 = 0.1;

/// Places of a membrane image with its band there; padded to whole steps.
#[derive(Clone)]
pub(super) struct Patch {
    /// Places about a common center, in nodes.
    pub(super) y: Vec<f32>,
    z: Vec<f32>,
    /// Meters.
    band: Vec<f32>,
    len: usize,
}

impl Patch {
    /// From places about a common center and the band there, both in meters.
    pub(super) fn new(places: impl ExactSizeIterator<Item = (DVec2, f32)>) -> Self {
        let len = places.len();
        let padded = len.next_multiple_of(LANES);
        let [mut y, mut z, mut band] = [(); 3].map(|()| Vec::with_capacity(padded));
        for (place, value) in places {
            let place = place * (1.0 / STEP_M);
            y.push(place.x as f32);
            z.push(place.y as f32);
            band.push(value);
        }
        for list in [&mut y, &mut z, &mut band] {
            list.resize(padded, 0.0);
        }
        Self { y, z, band, len }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Places about the common center, in nodes, with the band there, meters.
    pub(super) fn places(&self) -> impl Iterator<Item = (f32, f32, f32)> {
        (0..self.len).map(|i| (self.y[i], self.z[i], self.band[i]))
    }
}

/// Residuals of a step of lanes and how they change with the place: meters, and meters per node.
pub(super) struct Read {
    pub(super) ay: [f32; LANES],
    pub(super) az: [f32; LANES],
    pub(super) r: [f32; LANES],
    pub(super) gy: [f32; LANES],
    pub(super) gz: [f32; LANES],
    pub(super) template: [f32; LANES],
    /// Change of each slope along the other axis.
    pub(super) twist: [f32; LANES],
    /// Cells and positions within them.
    pub(super) at: Located,
}

impl BandField {
    /// Turn (cosine, sine) and place (nodes) of a state, from the nodes of a patch to those of the field.
    pub(super) fn motion(&self, state: State) -> [f32; 4] {
        let turn = DVec2::from_angle(state.phi) * (STEP_M / self.step_m);
        let place = (state.place - self.origin) / self.step_m;
        [turn.x as f32, turn.y as f32, place.x as f32, place.y as f32]
    }

    #[inline(always)]
    pub(super) fn read(&self, patch: &Patch, at: usize, [cos, sin, place_y, place_z]: [f32; 4]) -> Read {
        let span = at..at + LANES;
        let (y, z, band) = (&patch.y[span.clone()], &patch.z[span.clone()], &patch.band[span]);
        let zero = [0f32; LANES];
        let [mut ay, mut az, mut ty, mut tz] = [zero; 4];
        for l in 0..LANES {
            ay[l] = cos * y[l] - sin * z[l];
            az[l] = sin * y[l] + cos * z[l];
            ty[l] = ay[l] + place_y;
            tz[l] = az[l] + place_z;
        }
        let lattice = Lattice { columns: self.field.columns, rows: self.field.rows, values: &self.field.values };
        // Off the grid the border's value counts, which is next to nothing.
        let at = lattice.locate(&ty, &tz);
        let [a, b, c, d] = lattice.corners_of(&at);
        let mut read = Read { ay, az, r: zero, gy: zero, gz: zero, template: zero, twist: zero, at };
        for l in 0..LANES {
            let (ab, cd) = (b[l] - a[l], d[l] - c[l]);
            let (near, far) = (a[l] + ab * read.at.fy[l], c[l] + cd * read.at.fy[l]);
            read.template[l] = near + (far - near) * read.at.fz[l];
            read.r[l] = read.template[l] - band[l];
            read.twist[l] = cd - ab;
            read.gy[l] = ab + (cd - ab) * read.at.fz[l];
            read.gz[l] = far - near;
        }
        read
    }

    /// Cost, slope and curvature in one pass.
    fn sums(&self, patch: &Patch, state: State, kernel_m: f64) -> Sums {
        let kernel = kernel_m as f32;
        let square = kernel * kernel;
        let bend_scale = 4.0 / square;
        let mut sums = LaneSums::default();
        let motion = self.motion(state);
        for at in (0..patch.y.len()).step_by(LANES) {
            let Read { ay, az, r, gy, gz, .. } = self.read(patch, at, motion);
            let mut counts = [1f32; LANES];
            if patch.len < at + LANES {
                counts[patch.len - at..].fill(0.0);
            }
            for l in 0..LANES {
                let r2 = r[l] * r[l];
                let ratio = square / (square + r2);
                let w = counts[l] * ratio * ratio;
                let near = if r2 <= square { counts[l] } else { 0.0 };
                sums.count(l, counts[l] * r2 * ratio, w, near, r2);
                let bend = 1.0 - bend_scale * r2 * ratio;
                let bent = if bend > FLAT { bend } else { FLAT };
                sums.pull(l, r[l], [gz[l] * ay[l] - gy[l] * az[l], gy[l], gz[l]], w, bent);
            }
        }
        sums.total([1.0 / ANGLE_SCALE_M, 1.0 / self.step_m, 1.0 / self.step_m])
    }

    /// Residuals at a state and the template there, meters.
    pub(super) fn residuals(&self, patch: &Patch, state: State, mut each: impl FnMut(f32, f32)) {
        let motion = self.motion(state);
        for at in (0..patch.y.len()).step_by(LANES) {
            let read = self.read(patch, at, motion);
            for l in 0..LANES.min(patch.len - at) {
                each(read.r[l], read.template[l]);
            }
        }
    }
}

/// The relief of membranes beside that of the template at a pose. Heights are capped by a kernel, so that a few pixels that
/// are far off decide nothing.
#[derive(Default)]
pub(super) struct Relief {
    /// Sum of the squares of what the template leaves of the membranes' heights.
    left: f64,
    /// Sums of the products of both heights: the membranes' with themselves, with the template's, and those with themselves.
    products: [f64; 3],
    /// Sizes of the residuals.
    pub(super) residuals_m: Vec<f32>,
}

impl Relief {
    /// The relief of patches at a state.
    pub(super) fn of(patches: &[(Arc<BandField>, Rc<Patch>)], state: State, kernel_m: f64) -> Self {
        let square = kernel_m.powi(2) as f32;
        let capped = |height: f32| height / (square + height * height).sqrt();
        let product = |a: f32, b: f32| f64::from(capped(a)) * f64::from(capped(b));
        let mut sums = Self::default();
        for (template, patch) in patches {
            template.residuals(patch, state, |r, template| {
                let image = template - r;
                sums.residuals_m.push(r.abs());
                sums.left += product(r, r);
                let products = [product(image, image), product(image, template), product(template, template)];
                sums.products.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
            });
        }
        sums
    }

    /// Share of the membranes' relief that the template explains, at most 1; 0 where there is none.
    pub(super) fn explained(&self) -> f64 {
        if self.products[0] > 0.0 { 1.0 - self.left / self.products[0] } else { 0.0 }
    }

    /// Correlation of the membranes' relief with the template's, -1 to 1; 0 where one of them has none.
    pub(super) fn likeness(&self) -> f64 {
        let [own, both, template] = self.products;
        if own > 0.0 && template > 0.0 { both / (own * template).sqrt() } else { 0.0 }
    }

    /// Mean of what is left, as a share of the kernel's square.
    pub(super) fn misfit(&self) -> f64 {
        self.left / self.residuals_m.len().max(1) as f64
    }
}

/// 1.48 times the median of sizes of residuals, meters: their deviation, if most are noise. 0 of none.
pub(super) fn noise_m(mut residuals_m: Vec<f32>) -> f64 {
    let middle = residuals_m.len() / 2;
    if residuals_m.is_empty() {
        0.0
    } else {
        1.48 * f64::from(*residuals_m.select_nth_unstable_by(middle, f32::total_cmp).1)
    }
}

/// The mask's part of the cost.
#[derive(Clone, Copy)]
pub(super) struct MaskPart<'a> {
    pub(super) field: &'a DistanceField,
    pub(super) cloud: &'a Cloud,
    pub(super) kernel_m: f64,
    /// Weight beside the membrane.
    pub(super) weight: f64,
}

impl MaskPart<'_> {
    /// Share of a point's cost in the joint one, per square meter.
    pub(super) fn scale(&self) -> f64 {
        self.weight / (self.kernel_m.powi(2) * self.cloud.len().max(1) as f64)
    }

    /// The part of the joint cost at a state.
    fn cost(&self, state: State) -> f64 {
        self.scale() * self.field.sums(self.cloud, state, self.kernel_m).cost
    }
}

/// The joint cost of one band: the mean of the membrane's Geman-McClure costs plus `weight` times the mask's, both as
/// shares of their squared kernel widths, so 0 to 1.
pub(super) struct Joint<'a> {
    /// The patch of each finger with its template.
    pub(super) fingers: &'a [(Arc<BandField>, Rc<Patch>)],
    pub(super) kernel_m: f64,
    pub(super) mask: Option<MaskPart<'a>>,
    /// Look-ups so far.
    pub(super) lookups: usize,
}

impl Joint<'_> {
    pub(super) fn points(&self) -> usize {
        self.fingers.iter().map(|(_, patch)| patch.len()).sum()
    }
}

/// Adds `scale` times some sums to others.
fn add(to: &mut Sums, sums: &Sums, scale: f64) {
    to.h.iter_mut().zip(sums.h).for_each(|(to, h)| *to += scale * h);
    to.g.iter_mut().zip(sums.g).for_each(|(to, g)| *to += scale * g);
    to.cost += scale * sums.cost;
    to.weight += scale * sums.weight;
}

impl Cost for Joint<'_> {
    fn sums(&mut self, state: State) -> Sums {
        let points = self.points();
        self.lookups += points;
        let mut all = Sums::default();
        let scale = 1.0 / (self.kernel_m.powi(2) * points.max(1) as f64);
        for (template, patch) in self.fingers {
            let sums = template.sums(patch, state, self.kernel_m);
            add(&mut all, &sums, scale);
            all.inliers += sums.inliers;
            all.inlier_squares += sums.inlier_squares;
        }
        if let Some(mask) = &self.mask {
            self.lookups += mask.cloud.asked();
            let sums = mask.field.sums(mask.cloud, state, mask.kernel_m);
            add(&mut all, &sums, mask.scale());
        }
        all
    }
}

/// A joint cost whose steps are written down.
pub(super) struct Noted<'j, 'a> {
    pub(super) cost: &'j mut Joint<'a>,
    pub(super) run: usize,
    pub(super) centroid: DVec2,
    pub(super) trace: Option<&'j mut Vec<TraceStep>>,
}

impl Cost for Noted<'_, '_> {
    fn sums(&mut self, state: State) -> Sums {
        self.cost.sums(state)
    }

    fn note(&mut self, at: &Progress, sums: &Sums) {
        let (points, kernel_m) = (self.cost.points(), self.cost.kernel_m);
        let Some(trace) = &mut self.trace else { return };
        trace.push(TraceStep {
            run: self.run,
            iteration: at.iterations,
            grasp_from_object: at.state.to_pose(self.centroid),
            cost_m2: sums.cost * kernel_m * kernel_m,
            mask_cost_m2: self.cost.mask.map(|mask| mask.cost(at.state) * kernel_m * kernel_m),
            inlier_share: sums.inliers as f64 / points.max(1) as f64,
            kernel_m,
            points,
        });
    }
}
