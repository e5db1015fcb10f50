//! Agreement of two masks of the same imprint.

use crate::grid::Mask;

/// Agreement of two masks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Pixels in both over pixels in either; 1 where both are empty.
    pub iou: f64,
    /// Twice the pixels in both over the pixels of each together; 1 where both are empty.
    pub dice: f64,
}

/// Agreement of `a` and `b`; `None` if they are not of one size.
pub fn agreement(a: &Mask, b: &Mask) -> Option<Agreement> {
    if a.size() != b.size() {
        return None;
    }
    let [both, either] = counts(a, b);
    Some(Agreement { iou: share(both, either), dice: share(2 * both, either + both) })
}

/// As [`Agreement::iou`], without the rest: of masks of one size, at once.
pub fn iou(a: &Mask, b: &Mask) -> f64 {
    let [both, either] = counts(a, b);
    share(both, either)
}

/// The pixels in both masks, and those in either.
fn counts(a: &Mask, b: &Mask) -> [usize; 2] {
    a.as_slice()
        .iter()
        .zip(b.as_slice())
        .fold([0; 2], |[both, either], (&a, &b)| [both + usize::from(a && b), either + usize::from(a || b)])
}

fn share(n: usize, of: usize) -> f64 {
    if of == 0 { 1.0 } else { n as f64 / of as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(left: usize) -> Mask {
        Mask::from_fn(40, 30, |x, y| (left..left + 10).contains(&x) && (5..15).contains(&y))
    }

    #[test]
    fn what_is_moved_by_two_pixels_agrees_by_what_overlaps() {
        let agreed = agreement(&square(5), &square(7)).unwrap();
        assert!((agreed.iou - 80.0 / 120.0).abs() < 1e-12 && (agreed.dice - 160.0 / 200.0).abs() < 1e-12);
        assert_eq!(agreement(&square(7), &square(5)), Some(agreed));
        assert_eq!(iou(&square(5), &square(7)), agreed.iou);
    }
}
