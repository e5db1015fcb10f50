//! Editing contact masks: drawings, clean-ups, and where the value of each pixel comes from.
//!
//! Everything is a function of masks; who may edit what, and where masks are stored, is decided elsewhere.

mod agreement;
mod clean_up;
mod drawing;
mod grow;
mod marks;
mod merge;
mod morphology;
mod packed;
mod paint;
mod provenance;
mod region;
mod rle;
mod sight;

use glam::DVec2;

use super::grid::Mask;

pub use agreement::{Agreement, agreement, iou};
pub use clean_up::{CleanKind, CleanUp};
pub use drawing::{DrawTool, Drawing, Ground};
pub use grow::grow_from;
pub use marks::Marks;
pub use merge::merge;
pub use morphology::{fill_holes, grow, largest_island, shrink};
pub use packed::{PackError, PackedMask};
pub use paint::Paint;
pub use provenance::{CadPose, Provenance};
pub use sight::{Layers, Sight, VisiblePixels};

/// A rectangle of pixels; `x`, `y` is its top-left one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Rect {
    /// The smallest rectangle that holds both.
    pub fn union(self, other: Self) -> Self {
        let (x, y) = (self.x.min(other.x), self.y.min(other.y));
        let right = (self.x + self.width).max(other.x + other.width);
        let bottom = (self.y + self.height).max(other.y + other.height);
        Self { x, y, width: right - x, height: bottom - y }
    }
}

/// The smallest rectangle in which two masks of one size differ; `None` if they are equal or of different size.
pub fn difference(a: &Mask, b: &Mask) -> Option<Rect> {
    if a.size() != b.size() {
        return None;
    }
    let mut rect: Option<Rect> = None;
    for y in 0..a.height() {
        let (a, b) = (a.row(y), b.row(y));
        if a == b {
            continue;
        }
        let Some(left) = a.iter().zip(b).position(|(a, b)| a != b) else { continue };
        let right = a.iter().zip(b).rposition(|(a, b)| a != b).unwrap_or(left);
        let row = Rect { x: left, y, width: right - left + 1, height: 1 };
        rect = Some(rect.map_or(row, |r| r.union(row)));
    }
    rect
}

/// Sets every pixel whose center lies within `radius_px` of the segment from `a` to `b` (pixel coordinates,
/// `(0, 0)` = center of the first pixel), and the pixel under each end. `a == b` is a single stamp.
///
/// Returns the rectangle of pixels that changed, `None` if none did (outside, not finite, or set already).
pub fn paint(mask: &mut Mask, [a, b]: [DVec2; 2], radius_px: f64, value: bool) -> Option<Rect> {
    if !(a.is_finite() && b.is_finite() && radius_px.is_finite()) || mask.is_empty() {
        return None;
    }
    let radius = radius_px.max(0.0);
    let reach = radius.max(0.5);
    let (lo, hi) = (a.min(b) - reach, a.max(b) + reach);
    let last = DVec2::new(mask.width() as f64 - 1.0, mask.height() as f64 - 1.0);
    if hi.x < 0.0 || hi.y < 0.0 || lo.x > last.x || lo.y > last.y {
        return None;
    }
    let columns = lo.x.max(0.0).floor() as usize..=hi.x.min(last.x).ceil() as usize;
    let rows = lo.y.max(0.0).floor() as usize..=hi.y.min(last.y).ceil() as usize;
    let along = b - a;
    let length2 = along.length_squared();
    let mut changed: Option<Rect> = None;
    for y in rows {
        for x in columns.clone() {
            let p = DVec2::new(x as f64, y as f64);
            let t = if length2 > 0.0 { ((p - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
            // A brush thinner than a pixel still marks the pixels it crosses.
            let offset = (p - (a + along * t)).abs();
            let hit = offset.length_squared() <= radius * radius || offset.max_element() <= 0.5;
            if hit && mask[(x, y)] != value {
                mask[(x, y)] = value;
                let pixel = Rect { x, y, width: 1, height: 1 };
                changed = Some(changed.map_or(pixel, |r| r.union(pixel)));
            }
        }
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::count;

    fn empty() -> Mask {
        Mask::filled(40, 30, false)
    }

    #[test]
    fn a_stamp_is_a_disc_at_sub_pixel_precision() {
        let mut mask = empty();
        let rect = paint(&mut mask, [DVec2::new(10.0, 10.0); 2], 5.0, true).unwrap();
        assert_eq!(count(&mask), 81, "lattice points with x² + y² <= 25");
        assert_eq!(rect, Rect { x: 5, y: 5, width: 11, height: 11 });
        let mut shifted = empty();
        paint(&mut shifted, [DVec2::new(10.5, 10.0); 2], 5.0, true);
        assert!(shifted[(15, 10)] && !shifted[(5, 10)]);
        assert_eq!(paint(&mut mask, [DVec2::new(10.0, 10.0); 2], 5.0, true), None, "nothing left to change");
    }

    #[test]
    fn a_fast_stroke_has_no_gaps_and_the_eraser_undoes_it() {
        let mut mask = empty();
        let points = [DVec2::new(2.0, 3.0), DVec2::new(35.0, 25.0), DVec2::new(36.0, 2.0)];
        for (value, left) in [(true, None), (false, Some(0))] {
            for way in points.windows(2) {
                paint(&mut mask, [way[0], way[1]], 0.2, value);
            }
            match left {
                None => assert!(largest_island(&mask) == mask, "a hairline is connected"),
                Some(left) => assert_eq!(count(&mask), left),
            }
        }
    }

    #[test]
    fn outside_and_nonsense_change_nothing() {
        let mut mask = empty();
        let far = DVec2::new(1e300, -1e300);
        assert_eq!(paint(&mut mask, [far, far], 3.0, true), None);
        assert_eq!(paint(&mut mask, [DVec2::NAN, DVec2::ZERO], 3.0, true), None);
        assert_eq!(paint(&mut mask, [DVec2::ZERO; 2], f64::INFINITY, true), None);
        assert!(paint(&mut mask, [DVec2::new(-2.0, -2.0); 2], 4.0, true).is_some(), "a stamp may hang over the edge");
        assert!(paint(&mut mask, [DVec2::new(20.0, 15.0); 2], 1e6, true).is_some());
        assert_eq!(count(&mask), mask.len());
    }
}
