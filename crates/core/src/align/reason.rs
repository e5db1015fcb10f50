//! Why a pixel does or does not pull on the pose: one reason per pixel of an imprint.

use serde::{Deserialize, Serialize};

use super::{Fate, PointFit};
use crate::grid::{Grid, Mask};

/// Reason why one pixel of an imprint does or does not pull in a registration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::Display, strum::EnumCount)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// Near the surface: it pulls.
    #[strum(to_string = "inlier")]
    Inlier,
    /// On the silhouette: it fits and does not pull.
    #[strum(to_string = "fits inside")]
    Inside,
    /// Farther than the gate: its pull is negligible.
    #[strum(to_string = "beyond the gate")]
    BeyondGate,
    /// Outside the stored field of the tool.
    #[strum(to_string = "out of frame")]
    OutOfFrame,
    /// In the mask, but without a usable depth.
    #[strum(to_string = "no depth")]
    InvalidDepth,
    /// The mask leaves it out.
    #[strum(to_string = "outside mask")]
    OutsideMask,
}

impl From<Fate> for Reason {
    fn from(fate: Fate) -> Self {
        match fate {
            Fate::Inlier => Self::Inlier,
            Fate::Inside => Self::Inside,
            Fate::BeyondGate => Self::BeyondGate,
            Fate::OutOfField => Self::OutOfFrame,
            Fate::NotFinite => Self::InvalidDepth,
        }
    }
}

/// Number of pixels with each reason, in the order of [`Reason`].
pub type ReasonCounts = [usize; <Reason as strum::EnumCount>::COUNT];

/// The reason of every pixel of one finger.
///
/// `pixels` are the columns and rows of the points of this finger that were offered to the registration, `fits` what
/// it said about them, in the same order. A pixel of the mask that is not among them has no usable depth. A point
/// outside the mask's image (of another size) is left out.
///
/// Returns `None` if there are not as many fits as pixels: then they are of another run, or were not recorded.
pub fn reasons(mask: &Mask, pixels: &[[u16; 2]], fits: &[PointFit]) -> Option<Grid<Reason>> {
    if pixels.len() != fits.len() {
        return None;
    }
    let mut grid = mask.map(|&inside| if inside { Reason::InvalidDepth } else { Reason::OutsideMask });
    for (pixel, fit) in pixels.iter().zip(fits) {
        let (x, y) = (usize::from(pixel[0]), usize::from(pixel[1]));
        if x < grid.width() && y < grid.height() {
            grid[(x, y)] = fit.fate.into();
        }
    }
    Some(grid)
}

/// Pixels per reason.
pub fn counts<'a>(grids: impl IntoIterator<Item = &'a Grid<Reason>>) -> ReasonCounts {
    let mut counts = ReasonCounts::default();
    for reason in grids.into_iter().flat_map(Grid::as_slice) {
        counts[*reason as usize] += 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::{AlignConfig, align, testing};
    use crate::cloud::lift;
    use crate::field::DistanceField;
    use crate::fixture::camera;
    use crate::frames::PlanarPose;
    use crate::grid::DepthMap;
    use glam::DVec2;

    #[test]
    fn every_pixel_has_exactly_one_reason() {
        let (w, h) = (40, 30);
        let camera = camera(w, h);
        let mut imprint = DepthMap::filled(w, h, 0.0);
        imprint[(5, 4)] = f32::NAN;
        imprint[(35, 28)] = f32::NAN;
        let mask = Mask::from_fn(w, h, |x, y| (4..20).contains(&x) && (3..15).contains(&y));
        let lifted = lift(&imprint, &camera, Some(&mask)).unwrap();
        // The places do not matter here; far ones must be told apart from near ones.
        let near = testing::cross_contacts(lifted.points.len() - 2, PlanarPose::default(), 2e-4, 1);
        let points: Vec<DVec2> = near.into_iter().chain([DVec2::new(0.0, 0.5), DVec2::new(0.0044, 0.0164)]).collect();
        let field = DistanceField::from_mesh(&testing::cross()).unwrap();
        let report = align(&points, &field, &AlignConfig { record: true, ..AlignConfig::default() }).unwrap();
        let grid = reasons(&mask, &lifted.pixels, &report.fits[..lifted.pixels.len()]).unwrap();
        let n = counts([&grid]);
        assert_eq!(n.iter().sum::<usize>(), w * h);
        assert_eq!(n[Reason::OutsideMask as usize], w * h - 16 * 12);
        assert_eq!(n[Reason::InvalidDepth as usize], 1, "only the hole in the mask, not the one outside");
        assert_eq!(grid[(5, 4)], Reason::InvalidDepth);
        assert_eq!(n[Reason::OutOfFrame as usize], 1);
        assert!(n[Reason::BeyondGate as usize] >= 1);
        assert!(n[Reason::Inlier as usize] + n[Reason::Inside as usize] > 100);
    }

    #[test]
    fn fits_of_another_run_are_refused() {
        let mask = Mask::filled(3, 2, true);
        let fit = PointFit { residual_m: 0.0, weight: 1.0, fate: Fate::Inside };
        assert_eq!(reasons(&mask, &[[0, 0], [1, 0]], &[fit]), None);
        let grid = reasons(&mask, &[[1, 1], [9, 9]], &[fit, fit]).unwrap();
        assert_eq!(grid[(1, 1)], Reason::Inside);
        assert_eq!(counts([&grid, &grid])[Reason::InvalidDepth as usize], 10);
    }
}
