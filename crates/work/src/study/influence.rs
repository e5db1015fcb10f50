//! Influence of each pixel on a registered angle: [`influence`].

use glam::DVec2;
use serde::Serialize;

use crate::cloud::Clouds;
use crate::error::TaskError;
use touch2touch_core::align::{self, AlignConfig, AlignReport, Basis, Contacts, Hold, Scene};
use touch2touch_core::grid::{Grid, Mask};
use touch2touch_core::label::grow;
use touch2touch_core::pose::{Registration, RegistrationChoice, ToolModel};
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::Sample;

const WHAT: &str = "Influence of the pixels";

/// Pixels this far beside the mask are looked at as well, millimeters: what adding them would do.
const MARGIN_MM: f64 = 4.0;
/// Radius of a place, millimeters.
const PLACE_MM: f64 = 1.0;
/// Number of places that are named.
const PLACES: usize = 10;

/// Influence of each pixel on the registered angle.
#[derive(Clone, Debug)]
pub struct Influence {
    /// By how much the angle (the one that the lab reports, radians) changes when the pixel changes sides: leaves the mask
    /// that it is in, or joins it from at most 4 mm beside. NaN elsewhere, and where nothing is measured.
    pub pixels: PerPad<Grid<f32>>,
    /// Places where labeling pays most, the first the most.
    pub places: Vec<Place>,
    /// Pixels to the millimeter of the imprints.
    pub px_per_mm: f64,
}

/// The pixels within 1 mm of one of them that lie on the same side of the mask's edge.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// The finger.
    #[serde(skip)]
    pub finger: PadId,
    /// The pixel in the middle: column and row.
    pub pixel: [u16; 2],
    /// Position of that pixel from the left and the upper edge of the imprint, millimeters.
    pub at_mm: [f64; 2],
    /// Position of that pixel in the grasp frame, meters.
    pub point_m: [f64; 3],
    /// True where the place's pixels are in the mask.
    pub in_mask: bool,
    /// Number of pixels.
    pub pixels: usize,
    /// Change of the angle when they change sides, degrees.
    pub angle_deg: f64,
}

impl Influence {
    /// An influence in the unit that is shown: degrees to the square millimeter of the imprint.
    pub fn deg_per_mm2(&self, radians: f32) -> f64 {
        f64::from(radians).to_degrees() * self.px_per_mm * self.px_per_mm
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        4 * self.pixels.iter().flatten().map(Grid::len).sum::<usize>()
    }
}

/// Influence of each pixel of a pair's imprints on the angle that was registered from their contact points: `report` is of
/// `contacts`, which are those of `clouds`.
///
/// # Errors
/// If the registration has no cost by pixels, or the points do not determine the angle.
pub fn influence(
    clouds: &Clouds,
    contacts: Contacts<'_>,
    sample: &Sample,
    tool: &ToolModel,
    registration: RegistrationChoice,
    report: &AlignReport,
) -> Result<Influence, TaskError> {
    let hold = Hold::of(&Scene::new(contacts), tool, report);
    let kernel_m = match (report.joint.map(|fit| fit.basis), &hold) {
        (Some(Basis::Membrane), _) => {
            return Err(TaskError::new(WHAT, "the membranes alone decided the pose: no pixel of the mask had a say"));
        }
        (_, Some(hold)) => hold.kernel_m,
        (Some(_), None) => AlignConfig::default().final_kernel_m(),
        (None, None) if registration.by.uses_field() => registration.gate_m().unwrap_or_default(),
        (None, None) => {
            let why = format!("{} has no cost that says what its pixels are worth", registration.label());
            let hint = format!("Choose {} or {}.", Registration::Joint.label(), Registration::DistanceField.label());
            return Err(TaskError::new(WHAT, why).with_hint(hint));
        }
    };
    let all = || clouds.fingers.iter().flatten();
    let yz: Vec<DVec2> = all().flat_map(|f| &f.points).map(|p| DVec2::new(p.y, p.z)).collect();
    let registered: Vec<bool> = all().flat_map(|f| &f.contact).copied().collect();
    let each = align::influence(&yz, &registered, &tool.field, report.grasp_from_object, kernel_m, hold.as_ref())
        .map_err(|err| TaskError::from_error(WHAT, &err))?;
    let px_per_mm = sample.rig.depth_px_per_mm();
    let (mut pixels, mut places, mut from) = (PerPad::default(), Vec::new(), 0);
    for (finger, cloud) in clouds.fingers.entries() {
        let own = &each[from..from + cloud.points.len()];
        from += cloud.points.len();
        // The camera sees as many pixels as the imprint has, of which points were made.
        let size = sample.pad(finger).and_then(|touch| Some(touch.camera()?.depth_reference.size()));
        let Some([width, height]) = size else { continue };
        let mut mask = Mask::filled(width, height, false);
        let mut values = Grid::filled(width, height, f32::NAN);
        let place = |at: &[u16; 2]| (usize::from(at[0]), usize::from(at[1]));
        for (at, contact) in cloud.pixels.iter().zip(&cloud.contact) {
            mask[place(at)] = *contact;
        }
        let near = grow(&mask, MARGIN_MM * px_per_mm);
        for (at, value) in cloud.pixels.iter().zip(own).filter(|(at, _)| near[place(at)]) {
            values[place(at)] = *value as f32;
        }
        for (pixel, point) in cloud.pixels.iter().zip(&cloud.points).filter(|(at, _)| values[place(at)].abs() > 0.0) {
            let (angle_rad, count) = around(place(pixel), &values, &mask, PLACE_MM * px_per_mm);
            places.push(Place {
                finger,
                pixel: *pixel,
                at_mm: pixel.map(|px| (f64::from(px) + 0.5) / px_per_mm),
                point_m: (*point).into(),
                in_mask: mask[place(pixel)],
                pixels: count,
                angle_deg: angle_rad.to_degrees(),
            });
        }
        pixels[finger] = Some(values);
    }
    Ok(Influence { pixels, places: most(places), px_per_mm })
}

/// The sum over the pixels within a radius that are on the same side of the mask's edge, and how many they are.
fn around((x, y): (usize, usize), values: &Grid<f32>, mask: &Mask, radius_px: f64) -> (f64, usize) {
    let (reach, side) = (radius_px.floor().max(0.0) as usize, mask[(x, y)]);
    let (mut sum, mut count) = (0.0, 0);
    for near_y in y.saturating_sub(reach)..=(y + reach).min(mask.height() - 1) {
        for near_x in x.saturating_sub(reach)..=(x + reach).min(mask.width() - 1) {
            let (dx, dy) = (near_x.abs_diff(x) as f64, near_y.abs_diff(y) as f64);
            let value = values[(near_x, near_y)];
            if dx * dx + dy * dy <= radius_px * radius_px && mask[(near_x, near_y)] == side && value.is_finite() {
                sum += f64::from(value);
                count += 1;
            }
        }
    }
    (sum, count)
}

/// The places that matter most, none over another.
fn most(mut places: Vec<Place>) -> Vec<Place> {
    places.sort_by(|a, b| b.angle_deg.abs().total_cmp(&a.angle_deg.abs()));
    let mut kept: Vec<Place> = Vec::new();
    for place in places {
        let over = |other: &Place| {
            let [x, y] = [0, 1].map(|i| place.at_mm[i] - other.at_mm[i]);
            other.finger == place.finger && x.hypot(y) < 2.0 * PLACE_MM
        };
        if !kept.iter().any(over) {
            kept.push(place);
            if kept.len() == PLACES {
                break;
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::{clouds, images};
    use crate::labels::ImprintSource;
    use crate::pose::pose;
    use touch2touch_core::align::{Ask, JointConfig, Register};
    use touch2touch_core::frames::PlanarPose;
    use touch2touch_core::grid::DepthMap;
    use touch2touch_core::pose::{register, register_with};
    use touch2touch_core::{catalog, sim};

    /// A simulated grasp with masks of its true contact, `grown_px` too large.
    fn grasp(tool: usize, seed: u64, grown_px: f64) -> (Sample, ToolModel, PerPad<Mask>) {
        let (spec, config) = (&catalog::tools()[tool], sim::SimConfig::default());
        let sample = sim::simulate(spec, sim::random_grasp(seed), seed, &config);
        let mask = |pad| Some(grow(&sample.pad(pad)?.depth()?.truth.as_ref()?.contact, grown_px));
        let masks = sample.rig.pads().map(mask).collect();
        (sample, ToolModel::new(spec.mesh()).unwrap(), masks)
    }

    fn lifted(sample: &Sample, masks: &PerPad<Mask>) -> Clouds {
        let imprint = |pad| Some(&sample.pad(pad)?.depth()?.imprint);
        let part = |pad| Some((imprint(pad)?, masks[pad].as_ref()));
        let parts: PerPad<(&DepthMap, Option<&Mask>)> = sample.rig.pads().map(part).collect();
        clouds(sample, &parts).unwrap()
    }

    /// A registration from one start, as a squares' test runs it.
    type From<'a> = &'a dyn Fn(PlanarPose) -> Box<dyn Register>;

    /// Predicted and true changes of the angle, degrees, where squares of 5 mm leave the mask or what lies beside joins it.
    fn squares(tool: usize, seed: u64, from: From<'_>) -> Vec<(f64, f64)> {
        let (sample, model, masks) = grasp(tool, seed, 2.0);
        let imprints = sample.rig.pads().map(|pad| Some(&sample.pad(pad)?.depth()?.imprint)).collect();
        let images = images(&sample, &imprints, ImprintSource::Measured);
        let register = |masks: &PerPad<Mask>, start: PlanarPose| {
            let points = lifted(&sample, masks).contact_points();
            register_with(&*from(start), Contacts { points: &points, images: &images }, &model, Ask::default()).unwrap()
        };
        let truth = sample.grasp_from_object.unwrap();
        let (before, base) = (lifted(&sample, &masks), register(&masks, truth));
        let contacts = Contacts { points: &before.contact_points(), images: &images };
        let by = Registration::DistanceField.into();
        let found = influence(&before, contacts, &sample, &model, by, &base).unwrap();
        let base = base.grasp_from_object;
        assert!(found.places.is_sorted_by(|a, b| a.angle_deg.abs() >= b.angle_deg.abs()));
        assert!(found.places.iter().all(|place| place.pixels > 0 && place.point_m.iter().all(|v| v.is_finite())));
        assert_eq!(found.places.len(), PLACES);
        let (side, mut pairs) = ((5.0 * found.px_per_mm) as usize, Vec::new());
        for (pad, values) in found.pixels.entries() {
            for (corner_y, corner_x) in
                (0..values.height()).step_by(side).flat_map(|y| (0..values.width()).step_by(side).map(move |x| (y, x)))
            {
                for leaves in [true, false] {
                    let (mut changed, mut predicted) = (masks.clone(), 0.0);
                    let Some(mask) = changed.get_mut(pad) else { continue };
                    for y in corner_y..(corner_y + side).min(values.height()) {
                        for x in corner_x..(corner_x + side).min(values.width()) {
                            if mask[(x, y)] == leaves && values[(x, y)].is_finite() {
                                mask[(x, y)] = !leaves;
                                predicted += f64::from(values[(x, y)]);
                            }
                        }
                    }
                    if predicted != 0.0 {
                        // The lab's angle is that of the inverse.
                        let after = register(&changed, base).grasp_from_object;
                        let change = base.theta_rad - after.theta_rad;
                        pairs.push((predicted.to_degrees(), change.to_degrees()));
                    }
                }
            }
        }
        pairs
    }

    /// Correlation of predicted and true changes over squares of three grasps, and the mean size of the true ones, degrees.
    fn correlation(from: From<'_>) -> (f64, f64) {
        let grasps = [(0, 3), (3, 5), (5, 8)];
        let pairs: Vec<_> = grasps.into_iter().flat_map(|(tool, seed)| squares(tool, seed, from)).collect();
        assert!(pairs.len() > 300, "{}", pairs.len());
        let n = pairs.len() as f64;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / n;
        let (a, b) = (mean(&|p| p.0), mean(&|p| p.1));
        let both = mean(&|p| (p.0 - a) * (p.1 - b));
        let correlation = both / (mean(&|p| (p.0 - a).powi(2)) * mean(&|p| (p.1 - b).powi(2))).sqrt();
        (correlation, mean(&|p| p.1.abs()))
    }

    #[test]
    fn the_influence_of_squares_is_what_registering_anew_says() {
        let by_mask = |points, start| -> Box<dyn Register> {
            Box::new(AlignConfig { points, starts: vec![start], ..AlignConfig::default() })
        };
        let (all, by_mask_alone) = correlation(&|start| by_mask(usize::MAX, start));
        let (thinned, _) = correlation(&|start| by_mask(AlignConfig::default().points, start));
        assert!(all > 0.65, "{all}");
        // The product thins, and which points stay changes with the mask: that moves the angle as much as a square does.
        assert!(thinned > 0.2 && thinned < all, "{thinned}");
        let (joint, with_membranes) = correlation(&|start| {
            let whole = [64, usize::MAX];
            Box::new(JointConfig { starts: vec![start], mask_points: whole, ..JointConfig::default() })
        });
        assert!(joint > 0.6, "{joint}");
        assert!(with_membranes < 0.5 * by_mask_alone, "membranes hold: {with_membranes} {by_mask_alone}");
    }

    #[test]
    fn it_says_why_there_is_none() {
        let (sample, model, masks) = grasp(0, 3, 2.0);
        let clouds = lifted(&sample, &masks);
        let report = register(&clouds.contact_points(), &model, Registration::DistanceField, false).unwrap();
        let of = |by: Registration, clouds: &Clouds| {
            influence(clouds, Contacts::default(), &sample, &model, by.into(), &report).unwrap_err()
        };
        assert!(of(Registration::Gicp, &clouds).why.contains("GICP, 6 DoF"));
        assert!(of(Registration::Gicp, &clouds).hint.unwrap().contains("distance field"));
        let empty = lifted(&sample, &masks.map(|mask| mask.map(|mask| mask.map(|_| false))));
        assert!(of(Registration::DistanceField, &empty).why.contains("enlarge the contact mask"));
        assert!(
            pose(&empty.contact_points(), &model, &*RegistrationChoice::default().method(), Ask::default(), None)
                .is_err()
        );
    }
}
