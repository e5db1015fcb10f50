//! Likeness: how well imprints lie on the tool's outline at a pose, see [`likeness`].

use glam::{DVec2, DVec3};

use crate::align::{AlignConfig, Rung, align};
use crate::blur::gaussian;
use crate::cloud::{lift, lift_pixel};
use crate::contact::{rest_and_top, threshold, without_grain};
use crate::field::DistanceField;
use crate::frames::PlanarPose;
use crate::grid::{DepthMap, Grid, Mask};
use crate::sample::{PadTouch, Sample};
use crate::units::angle_error;

/// Every so many pixels in either direction are looked at.
const STEP_PX: usize = 3;
/// Width of what is taken off as slow, thinned pixels: 5 mm of the lab's Soft Bubble. Bars are narrower, the dome is wider.
const SLOW: f64 = 4.0;
/// Distances from the outline up to here count, meters: farther off the membrane does not know of the tool.
const NEAR_M: f64 = 0.003;
/// Pixels up to here from the outline are compared, meters.
const AROUND_M: f64 = 0.009;
/// Fewest pixels that are compared.
const FEWEST: usize = 50;
/// Contact by depth alone: what is pushed in by more than this share of the imprint's rise.
const CONTACT_SHARE: f32 = 0.7;

/// An imprint without holes, thinned, without what varies slowly, meters.
pub(super) fn relief(imprint: &DepthMap) -> Grid<f64> {
    let rest = rest_and_top(imprint).map_or(0.0, |[rest, _]| rest);
    let small = Grid::from_fn(imprint.width() / STEP_PX, imprint.height() / STEP_PX, |x, y| {
        let value = imprint[(STEP_PX * x + 1, STEP_PX * y + 1)];
        f64::from(if value.is_finite() { value } else { rest })
    });
    let slow = gaussian(&small, SLOW);
    Grid::from_fn(small.width(), small.height(), |x, y| small[(x, y)] - slow[(x, y)])
}

/// Correlation of what is pushed in with nearness to the tool's outline at a pose, around the tool, -1..1. It does not
/// depend on the imprints' size, but on where its pixels lie in space. 0 where nothing can be compared.
pub(super) fn likeness(sample: &Sample, field: &DistanceField, grasp_from_object: PlanarPose) -> f64 {
    let object_from_grasp = grasp_from_object.inverse();
    let (mut depths, mut outline) = (Vec::new(), Vec::new());
    for touch in sample.pads.iter().flatten() {
        let Some((depth, camera)) = touch.depth().zip(touch.camera()) else { continue };
        let relief = relief(&depth.imprint);
        let first = depths.len();
        for y in 0..relief.height() {
            for x in 0..relief.width() {
                let Some(point) = lift_pixel(&depth.imprint, camera, STEP_PX * x + 1, STEP_PX * y + 1) else {
                    continue;
                };
                let off = field.sample(object_from_grasp.transform_yz(DVec2::new(point.y, point.z))).distance;
                if off <= AROUND_M {
                    depths.push(relief[(x, y)]);
                    outline.push(-off.min(NEAR_M));
                }
            }
        }
        // Each finger has a level of its own.
        for values in [&mut depths[first..], &mut outline[first..]] {
            let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
            values.iter_mut().for_each(|v| *v -= mean);
        }
    }
    if depths.len() < FEWEST { 0.0 } else { correlation(&depths, &outline) }
}

/// Correlation of values whose mean is 0; 0 where one does not vary.
pub(super) fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = (dot(a, a) * dot(b, b)).sqrt();
    if size > 0.0 && size.is_finite() { dot(a, b) / size } else { 0.0 }
}

/// Contact points by depth alone, grasp frame, meters.
pub(super) fn contact_points(sample: &Sample) -> Option<Vec<DVec3>> {
    let mut points: Vec<DVec3> = Vec::new();
    for touch in sample.pads.iter().flatten() {
        let Some((depth, camera)) = touch.depth().zip(touch.camera()) else { continue };
        let Some([rest, top]) = rest_and_top(&depth.imprint) else { continue };
        let contact: Mask = threshold(&depth.imprint, rest + CONTACT_SHARE * (top - rest));
        points.extend(lift(&depth.imprint, camera, Some(&contact)).ok()?.points);
    }
    Some(points)
}

/// The sample with its imprints' grain taken away.
pub(super) fn grainless(sample: &Sample) -> Sample {
    let mut sample = sample.clone();
    for depth in sample.pads.iter_mut().flatten().filter_map(PadTouch::depth_mut) {
        depth.imprint = without_grain(&depth.imprint, 1);
    }
    sample
}

/// The registered pose of the tool, with contact by depth alone; `None` where there is none.
pub(super) fn registered(sample: &Sample, field: &DistanceField) -> Option<PlanarPose> {
    let points = contact_points(sample)?;
    let yz: Vec<DVec2> = points.iter().map(|p| DVec2::new(p.y, p.z)).collect();
    let config = AlignConfig::default();
    // Under a wrong reading nothing fits, and a grid would be searched in vain.
    let rungs = config.rungs.iter().copied().filter(|rung| *rung <= Rung::Several).collect();
    Some(align(&yz, field, &AlignConfig { rungs, ..config }).ok()?.grasp_from_object)
}

/// Error of the registered angle, radians; `None` where the true or the registered one is not known.
pub(super) fn angle_error_rad(sample: &Sample, field: &DistanceField) -> Option<f64> {
    let truth = sample.grasp_from_object?;
    Some(angle_error(registered(sample, field)?.theta_rad, truth.theta_rad))
}
