//! Editing contact masks: drawings, clean-ups, and patches that undo them.
//!
//! Everything is a function of masks; who may edit what, and where masks are stored, is decided elsewhere.

mod agreement;
mod clean_up;
mod drawing;
mod gate;
mod morphology;
mod region;
mod rle;

use glam::DVec2;

use super::grid::Mask;

pub use agreement::{Agreement, agreement};
pub use clean_up::{CleanKind, CleanUp};
pub use drawing::{DrawTool, Drawing, Ground};
pub use gate::Gate;
pub use morphology::{fill_holes, grow, islands, largest_island, remove_islands, shrink};
pub use rle::{RleError, decode_runs, encode_runs};

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

/// A patch that does not fit into the mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a patch up to pixel ({}, {}) does not fit a mask of {} x {}", rect.x + rect.width, rect.y + rect.height, size[0], size[1])]
pub struct PatchError {
    /// The patch's rectangle.
    pub rect: Rect,
    /// The mask's size.
    pub size: [usize; 2],
}

/// Replacement pixels for a rectangle of a mask. Swapping it in twice changes nothing, so one function serves
/// do, undo and redo.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    rect: Rect,
    bits: Vec<bool>,
}

impl Patch {
    /// The patch that turns `from` into `to`: the smallest rectangle in which they differ. `None` if they are equal
    /// or of different size.
    pub fn between(from: &Mask, to: &Mask) -> Option<Self> {
        if from.size() != to.size() {
            return None;
        }
        let mut rect: Option<Rect> = None;
        for y in 0..from.height() {
            let (a, b) = (from.row(y), to.row(y));
            let Some(left) = a.iter().zip(b).position(|(a, b)| a != b) else { continue };
            let right = a.iter().zip(b).rposition(|(a, b)| a != b).unwrap_or(left);
            let row = Rect { x: left, y, width: right - left + 1, height: 1 };
            rect = Some(rect.map_or(row, |r| r.union(row)));
        }
        let rect = rect?;
        let rows = rect.y..rect.y + rect.height;
        let bits = rows.flat_map(|y| to.row(y)[rect.x..rect.x + rect.width].iter().copied()).collect();
        Some(Self { rect, bits })
    }

    /// Exchanges the pixels held here with those in `mask`; afterwards this is the inverse patch.
    ///
    /// # Errors
    /// [`PatchError`] if it does not fit; nothing is changed then.
    pub fn swap(&mut self, mask: &mut Mask) -> Result<(), PatchError> {
        let rect = self.rect;
        if rect.x + rect.width > mask.width() || rect.y + rect.height > mask.height() {
            return Err(PatchError { rect, size: mask.size() });
        }
        let width = mask.width();
        for (row, bits) in self.bits.chunks_exact_mut(rect.width).enumerate() {
            let start = (rect.y + row) * width + rect.x;
            mask.as_mut_slice()[start..start + rect.width].swap_with_slice(bits);
        }
        Ok(())
    }

    /// The pixels it replaces.
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// Bytes held, for the budget of a history.
    pub fn bytes(&self) -> usize {
        self.bits.len()
    }
}

/// Sets every pixel whose center lies within `radius_px` of the segment from `a` to `b` (pixel coordinates,
/// `(0, 0)` = center of the first pixel), and the pixel under each end. `a == b` is a single stamp.
///
/// Returns the rectangle of pixels that changed, `None` if none did (outside, not finite, or set already).
pub fn paint(mask: &mut Mask, [a, b]: [DVec2; 2], radius_px: f64, value: bool) -> Option<Rect> {
    paint_where(mask, [a, b], radius_px, value, |_, _| true)
}

/// [`paint`] limited to the pixels that `allow(x, y)` names, e.g. those within a depth range.
pub fn paint_where(
    mask: &mut Mask,
    [a, b]: [DVec2; 2],
    radius_px: f64,
    value: bool,
    allow: impl Fn(usize, usize) -> bool,
) -> Option<Rect> {
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
            if hit && mask[(x, y)] != value && allow(x, y) {
                mask[(x, y)] = value;
                let pixel = Rect { x, y, width: 1, height: 1 };
                changed = Some(changed.map_or(pixel, |r| r.union(pixel)));
            }
        }
    }
    changed
}

/// Paints along every point of a stroke. Returns the rectangle that changed.
pub fn paint_stroke(mask: &mut Mask, points: &[DVec2], radius_px: f64, value: bool) -> Option<Rect> {
    let mut changed: Option<Rect> = None;
    let ends = points.windows(2).map(|w| [w[0], w[1]]).chain(points.first().map(|&p| [p, p]));
    for segment in ends {
        if let Some(rect) = paint(mask, segment, radius_px, value) {
            changed = Some(changed.map_or(rect, |r| r.union(rect)));
        }
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn empty() -> Mask {
        Mask::filled(40, 30, false)
    }

    fn count(mask: &Mask) -> usize {
        mask.as_slice().iter().filter(|&&v| v).count()
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
        paint_stroke(&mut mask, &points, 0.2, true);
        assert_eq!(islands(&mask).1.len(), 1, "a hairline is connected");
        paint_stroke(&mut mask, &points, 0.2, false);
        assert_eq!(count(&mask), 0);
    }

    #[test]
    fn outside_and_nonsense_change_nothing() {
        let mut mask = empty();
        let far = DVec2::new(1e300, -1e300);
        assert_eq!(paint(&mut mask, [far, far], 3.0, true), None);
        assert_eq!(paint(&mut mask, [DVec2::NAN, DVec2::ZERO], 3.0, true), None);
        assert_eq!(paint(&mut mask, [DVec2::ZERO; 2], f64::INFINITY, true), None);
        assert_eq!(paint_stroke(&mut mask, &[], 3.0, true), None);
        assert!(paint(&mut mask, [DVec2::new(-2.0, -2.0); 2], 4.0, true).is_some(), "a stamp may hang over the edge");
        assert!(paint(&mut mask, [DVec2::new(20.0, 15.0); 2], 1e6, true).is_some());
        assert_eq!(count(&mask), mask.len());
        let mut gated = empty();
        paint_where(&mut gated, [DVec2::new(20.0, 15.0); 2], 8.0, true, |x, _| x < 20);
        assert!(gated[(19, 15)] && !gated[(20, 15)]);
    }

    #[test]
    fn a_patch_that_does_not_fit_is_refused() {
        let mut after = empty();
        after[(39, 29)] = true;
        let mut patch = Patch::between(&empty(), &after).unwrap();
        let mut small = Mask::filled(10, 10, false);
        assert!(patch.swap(&mut small).unwrap_err().to_string().contains("10 x 10"));
        assert_eq!(Patch::between(&empty(), &empty()), None);
        assert_eq!(Patch::between(&empty(), &small), None);
    }

    proptest! {
        #[test]
        fn swapping_does_undoes_and_redoes(bits in proptest::collection::vec(any::<bool>(), 2 * 12 * 9)) {
            let (a, b) = bits.split_at(12 * 9);
            let before = Mask::from_vec(12, 9, a.to_vec()).unwrap();
            let after = Mask::from_vec(12, 9, b.to_vec()).unwrap();
            if let Some(mut patch) = Patch::between(&before, &after) {
                let original = patch.clone();
                let mut mask = before.clone();
                patch.swap(&mut mask).unwrap();
                prop_assert_eq!(&mask, &after);
                patch.swap(&mut mask).unwrap();
                prop_assert_eq!(&mask, &before);
                prop_assert_eq!(patch, original);
            } else {
                prop_assert_eq!(before, after);
            }
        }
    }
}
