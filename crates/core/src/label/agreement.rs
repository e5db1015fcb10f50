//! Agreement of two masks of the same imprint.

use serde::Serialize;

use crate::grid::Mask;

/// Agreement of two masks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// Pixels in both over pixels in either; 1 where both are empty.
    pub iou: f64,
    /// Twice the pixels in both over the pixels of each together; 1 where both are empty.
    pub dice: f64,
    /// Mean distance from the edge of one to the edge of the other, both ways, millimeters; `None` where one is empty.
    pub edge_mm: Option<f64>,
    /// Pixels in the first alone, and in the second alone.
    pub alone_px: [usize; 2],
}

/// Agreement of `a` and `b`; `None` if they are not of one size.
pub fn agreement(a: &Mask, b: &Mask, px_per_mm: f64) -> Option<Agreement> {
    if a.size() != b.size() {
        return None;
    }
    let (both, alone) = counts(a, b);
    let either = both + alone[0] + alone[1];
    Some(Agreement {
        iou: share(both, either),
        dice: share(2 * both, either + both),
        edge_mm: edge_distance(&edge(a), &edge(b)).map(|px| px / px_per_mm),
        alone_px: alone,
    })
}

/// As [`Agreement::iou`], without the rest: of masks of one size, at once.
pub fn iou(a: &Mask, b: &Mask) -> f64 {
    let (both, alone) = counts(a, b);
    share(both, both + alone[0] + alone[1])
}

/// The pixels in both masks, and those in one alone.
fn counts(a: &Mask, b: &Mask) -> (usize, [usize; 2]) {
    let (mut both, mut alone) = (0, [0; 2]);
    for (a, b) in a.as_slice().iter().zip(b.as_slice()) {
        match (a, b) {
            (true, true) => both += 1,
            (true, false) => alone[0] += 1,
            (false, true) => alone[1] += 1,
            (false, false) => {}
        }
    }
    (both, alone)
}

fn share(n: usize, of: usize) -> f64 {
    if of == 0 { 1.0 } else { n as f64 / of as f64 }
}

/// The pixels of a mask that touch the outside, or the edge of the image.
fn edge(mask: &Mask) -> Vec<[f64; 2]> {
    let mut edge = Vec::new();
    for y in 0..mask.height() {
        for x in 0..mask.width() {
            let inside = |nx: usize, ny: usize| mask.get(nx, ny) == Some(&true);
            let enclosed =
                inside(x.wrapping_sub(1), y) && inside(x + 1, y) && inside(x, y.wrapping_sub(1)) && inside(x, y + 1);
            if mask[(x, y)] && !enclosed {
                edge.push([x as f64, y as f64]);
            }
        }
    }
    edge
}

/// Mean over both edges of the distance to the nearest pixel of the other, pixels.
fn edge_distance(a: &[[f64; 2]], b: &[[f64; 2]]) -> Option<f64> {
    if a.is_empty() || b.is_empty() {
        return None;
    }
    let nearest = |p: &[f64; 2], others: &[[f64; 2]]| {
        let square = |q: &[f64; 2]| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
        others.iter().map(square).fold(f64::INFINITY, f64::min).sqrt()
    };
    let sum = |from: &[[f64; 2]], to: &[[f64; 2]]| from.iter().map(|p| nearest(p, to)).sum::<f64>();
    Some((sum(a, b) + sum(b, a)) / (a.len() + b.len()) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(left: usize) -> Mask {
        Mask::from_fn(40, 30, |x, y| (left..left + 10).contains(&x) && (5..15).contains(&y))
    }

    #[test]
    fn what_is_moved_by_two_pixels_agrees_by_what_overlaps() {
        let agreed = agreement(&square(5), &square(7), 2.0).unwrap();
        assert_eq!(agreed.alone_px, [20, 20]);
        assert!((agreed.iou - 80.0 / 120.0).abs() < 1e-12 && (agreed.dice - 160.0 / 200.0).abs() < 1e-12);
        // Two sides lie 1 mm apart, of the two others all but two pixels of ten on each other.
        let edge = agreed.edge_mm.unwrap();
        assert!((0.2..0.6).contains(&edge), "{edge}");
        let back = agreement(&square(7), &square(5), 2.0).unwrap();
        assert_eq!((back.iou, back.dice), (agreed.iou, agreed.dice));
        assert!((back.edge_mm.unwrap() - edge).abs() < 1e-12);
    }

    #[test]
    fn the_same_agrees_and_nothing_agrees_with_nothing() {
        let same = agreement(&square(5), &square(5), 2.0).unwrap();
        assert_eq!((same.iou, same.dice, same.edge_mm, same.alone_px), (1.0, 1.0, Some(0.0), [0, 0]));
        let empty = Mask::filled(40, 30, false);
        let none = agreement(&empty, &empty, 2.0).unwrap();
        assert_eq!((none.iou, none.dice, none.edge_mm), (1.0, 1.0, None));
        let one = agreement(&square(5), &empty, 2.0).unwrap();
        assert_eq!((one.iou, one.dice, one.edge_mm), (0.0, 0.0, None));
        assert_eq!(agreement(&empty, &Mask::filled(3, 3, false), 2.0), None);
    }
}
