//! Contact masks from depth (threshold, top percent) and from the CAD model at a known pose, and the mask
//! network's input image. Masks drawn by hand and by the network come from elsewhere.

mod rise;

use std::sync::Arc;

use glam::DAffine3;
use rayon::prelude::*;

use super::cloud::{self, CloudError};
use super::frames::PlanarPose;
use super::grid::{DepthMap, Grid, Mask};
use super::mesh::MeshDistance;
use super::rig::Rig;
use super::sample::DepthCamera;
use super::units::text_mm;

pub use rise::{rest_and_top, rise, stands_out};

/// Distance to the CAD model that the lab still calls contact, meters (`ICP_dataset_cal.py` lines 337-391).
pub const LAB_CAD_DISTANCE_M: f64 = 0.001;

/// Pixels pushed in by at least `min_m` meters. Values that are not finite are no contact.
pub fn threshold(imprint: &DepthMap, min_m: f32) -> Mask {
    imprint.map(|&d| d.is_finite() && d >= min_m)
}

/// The deepest `percent` (0 to 100) of the pixels that are pushed in by at least `min_m` meters.
///
/// Ties at the limit are all kept, so the share can be larger on an image of few values. Values that are not finite
/// are no contact; a `percent` that is not positive (or NaN) gives an empty mask.
pub fn top_percent(imprint: &DepthMap, percent: f64, min_m: f32) -> Mask {
    let mut deep: Vec<f32> = imprint.as_slice().iter().copied().filter(|d| d.is_finite() && *d >= min_m).collect();
    let keep = ((deep.len() as f64 * percent / 100.0).round() as usize).min(deep.len());
    if keep == 0 {
        return Mask::filled(imprint.width(), imprint.height(), false);
    }
    let (_, limit, _) = deep.select_nth_unstable_by(keep - 1, |a, b| b.total_cmp(a));
    let limit = *limit;
    threshold(imprint, limit)
}

/// Pixels whose point is at most `max_m` meters from the CAD model at the given pose, or inside it: the lab's way to
/// label contact, with [`LAB_CAD_DISTANCE_M`].
///
/// Pixels without a usable depth are no contact.
///
/// # Errors
/// [`CloudError`] if the sizes differ or the camera's numbers cannot be right.
pub fn cad_signed_distance(
    imprint: &DepthMap,
    camera: &DepthCamera,
    tool: &MeshDistance,
    object_from_grasp: PlanarPose,
    max_m: f64,
) -> Result<Mask, CloudError> {
    Ok(signed_distances(imprint, camera, tool, object_from_grasp.to_affine(), max_m)?.map(|d| *d <= max_m))
}

/// The signed distance of each pixel's point to the CAD model at the given pose, meters, negative inside: those at most
/// `limit_m` away, the others are infinitely far. NaN for pixels without a usable depth.
///
/// # Errors
/// As [`cad_signed_distance`], which is a threshold of it.
pub fn signed_distances(
    imprint: &DepthMap,
    camera: &DepthCamera,
    tool: &MeshDistance,
    object_from_grasp: DAffine3,
    limit_m: f64,
) -> Result<Grid<f64>, CloudError> {
    cloud::check(imprint, camera)?;
    let (width, height) = (imprint.width(), imprint.height());
    let pixel = |i: usize| {
        let point = cloud::lift_pixel(imprint, camera, i % width, i / width);
        point.map_or(f64::NAN, |p| tool.signed_within(object_from_grasp.transform_point3(p), limit_m))
    };
    let distances: Vec<f64> = (0..imprint.len()).into_par_iter().with_min_len(512).map(pixel).collect();
    Ok(Grid::from_vec(width, height, distances).unwrap_or_else(|_| Grid::filled(width, height, f64::NAN)))
}

/// The imprint without the grain of its pixels: of each the median of what was measured within `radius_px` of it in
/// either direction. An edge stays where it is; a pixel that was dropped gets what lies around it, and NaN where
/// nothing was measured there.
pub fn without_grain(imprint: &DepthMap, radius_px: usize) -> DepthMap {
    let (width, height) = (imprint.width(), imprint.height());
    let row = |y: usize| {
        let mut values: Vec<f32> = Vec::new();
        let mut medians = Vec::with_capacity(width);
        for x in 0..width {
            values.clear();
            for row in y.saturating_sub(radius_px)..height.min(y + radius_px + 1) {
                let pixels = &imprint.row(row)[x.saturating_sub(radius_px)..width.min(x + radius_px + 1)];
                values.extend(pixels.iter().copied().filter(|d| d.is_finite()));
            }
            let middle = values.len() / 2;
            let median = (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1);
            medians.push(median.unwrap_or(f32::NAN));
        }
        medians
    };
    let rows: Vec<Vec<f32>> = (0..height).into_par_iter().map(row).collect();
    DepthMap::from_vec(width, height, rows.concat()).unwrap_or_else(|_| imprint.clone())
}

/// An imprint that rises less than this holds no contact: a bubble that is touched at all gives way by more.
pub(crate) const FLAT_M: f32 = 0.000_5;
/// The same of a gel, which has no air to give way.
const GEL_FLAT_M: f32 = 0.000_05;
/// Depth from which on a gel is taken to be in contact, meters, where nobody says another.
pub const GEL_CONTACT_M: f32 = 0.000_1;

/// Rise below which an imprint of this rig's depth sensor holds no contact, meters.
pub fn flat_m(rig: &Rig) -> f32 {
    if rig.is_gel() { GEL_FLAT_M } else { FLAT_M }
}
/// An imprint that rises by this holds contact somewhere, whatever a model says.
pub(crate) const CLEAR_M: f32 = 0.002;
/// Contact by depth alone: what is pushed in by more than this share of the imprint's rise.
const CONTACT_SHARE: f32 = 0.6;

/// Basis that a contact mask is made from in the end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MaskBasis {
    /// The source that was asked.
    #[default]
    Source,
    /// Nothing: the imprint is flat, so that there is no contact, whatever the source says.
    Flat,
    /// Depth of at least so many meters, because the source found no contact in an imprint that clearly has some.
    Depth(f32),
    /// A person: it was drawn.
    Hand,
}

/// A contact mask and what it is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactMask {
    /// The pixels in contact.
    pub mask: Arc<Mask>,
    /// Basis that it is made from.
    pub basis: MaskBasis,
    /// Share of the picture's pixels that the mask model says neither yes nor no of, 0..1; `None` for any other source.
    pub unsure: Option<f64>,
}

impl MaskBasis {
    /// The key in JSON, `source` being that of the source that was asked.
    pub fn key(self, source: &'static str) -> &'static str {
        match self {
            Self::Source => source,
            Self::Flat => "flat",
            Self::Depth(_) => "depth",
            Self::Hand => "hand",
        }
    }

    /// For a label, `source` being that of the source that was asked.
    pub fn label(self, source: &str) -> String {
        match self {
            Self::Source => source.to_owned(),
            Self::Hand => "By hand".to_owned(),
            Self::Flat => "No contact: the imprint is flat".to_owned(),
            Self::Depth(min_m) => format!("Depth {}: {source} found no contact", text_mm(f64::from(min_m))),
        }
    }

    /// In words, if it is not the source that was asked.
    pub fn note(self) -> Option<String> {
        match self {
            Self::Source | Self::Hand => None,
            Self::Flat => Some("the imprint is flat, so there is no contact".into()),
            Self::Depth(min_m) => Some(format!(
                "the mask model found no contact; all that is pushed in by at least {} was taken instead",
                text_mm(f64::from(min_m))
            )),
        }
    }
}

/// A mask with the last word on it: an imprint that rises less than `flat_m` has no contact, whatever the mask's source.
pub fn settled(imprint: &DepthMap, mask: Mask, flat_m: f32) -> ContactMask {
    if rise(imprint) >= flat_m {
        return ContactMask { mask: Arc::new(mask), basis: MaskBasis::Source, unsure: None };
    }
    let mask = Arc::new(Mask::filled(imprint.width(), imprint.height(), false));
    ContactMask { mask, basis: MaskBasis::Flat, unsure: None }
}

/// The mask of a model with the last word on it: as [`settled`], and where the model found nothing in an imprint that
/// is clearly not flat, depth relative to that imprint's own rest and top decides.
pub fn settled_model(imprint: &DepthMap, mask: Mask) -> ContactMask {
    match rest_and_top(imprint) {
        Some([rest, top]) if rise(imprint) >= CLEAR_M && !mask.as_slice().contains(&true) => {
            let min_m = rest + CONTACT_SHARE * (top - rest);
            let mask = Arc::new(threshold(imprint, min_m));
            ContactMask { mask, basis: MaskBasis::Depth(min_m), unsure: None }
        }
        _ => settled(imprint, mask, FLAT_M),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::testing::cuboid;
    use crate::fixture::count;
    use glam::DVec3;

    #[test]
    fn threshold_and_top_percent_ignore_what_is_not_finite() {
        let mut imprint = DepthMap::from_fn(10, 10, |x, y| (y * 10 + x) as f32 * 1e-4);
        imprint[(0, 9)] = f32::NAN;
        imprint[(1, 9)] = f32::INFINITY;
        assert_eq!(count(&threshold(&imprint, 0.005)), 48);
        let top = top_percent(&imprint, 25.0, 0.005);
        assert_eq!(count(&top), 12);
        assert!(top[(9, 9)] && !top[(0, 9)] && !top[(0, 5)]);
        assert_eq!(count(&top_percent(&imprint, 100.0, 0.005)), 48);
        assert_eq!(count(&top_percent(&imprint, 1e9, 0.005)), 48);
        assert_eq!(count(&top_percent(&imprint, 0.0, 0.0)), 0);
        assert_eq!(count(&top_percent(&imprint, f64::NAN, 0.0)), 0);
        assert_eq!(count(&top_percent(&imprint, -5.0, 0.0)), 0);
        assert_eq!(count(&top_percent(&DepthMap::filled(0, 0, 0.0), 40.0, 0.0)), 0);
    }

    /// A bump of `height` over a rest of `rest`, with noise of half a millimeter.
    fn bump(rest: f32, height: f32) -> DepthMap {
        let noise = |x: usize, y: usize| ((x * 37 + y * 91) % 11) as f32 / 10.0 * 1e-3 - 5e-4;
        DepthMap::from_fn(175, 140, |x, y| {
            let (dx, dy) = (x as f32 - 80.0, y as f32 - 60.0);
            rest + height * (-(dx * dx + dy * dy) / 400.0).exp() + noise(x, y)
        })
    }

    #[test]
    fn a_flat_imprint_has_no_contact_whatever_the_source_says() {
        let all = Mask::filled(175, 140, true);
        let mut dots = DepthMap::filled(175, 140, 0.0);
        // Flying pixels and holes are no contact either.
        (dots[(3, 3)], dots[(90, 70)], dots[(91, 70)]) = (0.05, 0.09, f32::NAN);
        let noise = bump(0.0, 0.0);
        // A ramp of 12 mm, as a bubble that is held askew gives.
        let ramp = DepthMap::from_fn(175, 140, |x, y| 0.012 * (x as f32 / 349.0 + y as f32 / 279.0) + noise[(x, y)]);
        for flat in [DepthMap::filled(175, 140, 0.0), DepthMap::filled(175, 140, 0.004), bump(0.001, 0.0), dots, ramp] {
            for contact in [settled(&flat, all.clone(), FLAT_M), settled_model(&flat, all.clone())] {
                assert_eq!((count(&contact.mask), contact.basis), (0, MaskBasis::Flat), "{}", rise(&flat));
            }
        }
        for none in [DepthMap::filled(175, 140, f32::NAN), DepthMap::filled(0, 0, 0.0)] {
            assert_eq!(settled(&none, Mask::filled(none.width(), none.height(), true), FLAT_M).basis, MaskBasis::Flat);
        }
        let deep = settled(&bump(0.0, 0.008), all.clone(), FLAT_M);
        assert_eq!((&*deep.mask, deep.basis), (&all, MaskBasis::Source));
    }

    #[test]
    fn grain_goes_and_edges_stay() {
        let clean = DepthMap::from_fn(40, 30, |x, _| if x < 20 { 0.001 } else { 0.009 });
        let mut grainy = clean.clone();
        for i in (0..grainy.len()).step_by(23) {
            grainy.as_mut_slice()[i] = [0.0, f32::NAN, 0.03][i % 3];
        }
        let cleaned = without_grain(&grainy, 2);
        let wrong = cleaned.as_slice().iter().zip(clean.as_slice()).filter(|(a, b)| a != b).count();
        assert_eq!(wrong, 0);
        assert!(without_grain(&DepthMap::filled(9, 9, f32::NAN), 2).as_slice().iter().all(|d| d.is_nan()));
        assert_eq!(without_grain(&clean, 0), clean);
        assert_eq!(without_grain(&DepthMap::filled(0, 0, 0.0), 3).len(), 0);
    }

    #[test]
    fn where_a_model_finds_nothing_depth_decides() {
        let none = Mask::filled(175, 140, false);
        for (rest, height) in [(0.0, 0.004), (-0.002, 0.005), (0.001, 0.012)] {
            let imprint = bump(rest, height);
            let contact = settled_model(&imprint, none.clone());
            let MaskBasis::Depth(min_m) = contact.basis else { panic!("{:?}", contact.basis) };
            assert_eq!(*contact.mask, threshold(&imprint, min_m));
            assert!(contact.mask[(80, 60)] && !contact.mask[(5, 130)], "{min_m}");
            assert!((100..3000).contains(&count(&contact.mask)), "{}", count(&contact.mask));
            assert!(
                contact.basis.note().is_some_and(|note| note.contains("mm")) && contact.basis.key("unet") == "depth"
            );
        }
        // What the model found stays; what is neither flat nor clearly deep stays without contact.
        let mut one = none.clone();
        one[(80, 60)] = true;
        assert_eq!(*settled_model(&bump(0.0, 0.006), one.clone()).mask, one);
        let faint = settled_model(&bump(0.0, 0.001_5), none);
        assert_eq!((count(&faint.mask), faint.basis), (0, MaskBasis::Source));
    }

    #[test]
    fn cad_contact_follows_the_pose() {
        // A 6 mm bar along z, 1 mm in front of a flat membrane that is everywhere 90 mm from the camera.
        let camera = crate::fixture::camera(175, 140);
        let imprint = DepthMap::filled(175, 140, 0.0);
        let center = cloud::lift_pixel(&imprint, &camera, 87, 66).unwrap();
        let bar =
            MeshDistance::new(&cuboid(DVec3::new(center.x, 0.0, center.z), DVec3::new(0.003, 0.003, 0.003))).unwrap();
        let still = PlanarPose::default();
        let mask = cad_signed_distance(&imprint, &camera, &bar, still, LAB_CAD_DISTANCE_M).unwrap();
        assert!(mask[(87, 66)] && !mask[(0, 0)]);
        // Moving the part by +10 mm along y moves the contact by 10 mm = 23 px along the rows of the image.
        let moved = PlanarPose { y_m: 0.01, ..still }.inverse();
        let shifted = cad_signed_distance(&imprint, &camera, &bar, moved, LAB_CAD_DISTANCE_M).unwrap();
        let row = |m: &Mask| {
            let rows: Vec<usize> = (0..140).filter(|&y| m.row(y).contains(&true)).collect();
            rows.iter().sum::<usize>() as f64 / rows.len() as f64
        };
        assert!((row(&shifted) - row(&mask) - 0.01 / 0.09 * 211.0).abs() < 1.0);
        let dropped = DepthMap::filled(175, 140, f32::NAN);
        assert_eq!(count(&cad_signed_distance(&dropped, &camera, &bar, still, 0.001).unwrap()), 0);
    }
}
