//! Regions of an image: enclosed by a line, between two corners, about as deep as a point.

use glam::DVec2;

use crate::grid::{DepthMap, Mask};

/// The pixels whose centers a closed line encloses (even-odd: where it crosses itself, every other part). Fewer than
/// three points enclose nothing.
pub(super) fn enclosed([width, height]: [usize; 2], points: &[DVec2]) -> Mask {
    let mut mask = Mask::filled(width, height, false);
    if points.len() < 3 || width == 0 {
        return mask;
    }
    let mut crossings: Vec<f64> = Vec::new();
    for y in 0..height {
        let row = y as f64;
        crossings.clear();
        for (i, a) in points.iter().enumerate() {
            let b = points[(i + 1) % points.len()];
            // Half open, so that a corner on a row is met once.
            if (a.y <= row) != (b.y <= row) {
                crossings.push(a.x + (row - a.y) / (b.y - a.y) * (b.x - a.x));
            }
        }
        crossings.sort_by(f64::total_cmp);
        for span in crossings.chunks_exact(2) {
            let (left, right) = (span[0].ceil().max(0.0), span[1].floor().min(width as f64 - 1.0));
            if left <= right {
                mask.as_mut_slice()[y * width..][left as usize..=right as usize].fill(true);
            }
        }
    }
    mask
}

/// True where a closed line encloses a point, as [`enclosed`] has it.
pub(super) fn encloses(points: &[DVec2], p: DVec2) -> bool {
    if points.len() < 3 {
        return false;
    }
    let mut inside = false;
    for (i, a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        if (a.y <= p.y) != (b.y <= p.y) && a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) < p.x {
            inside = !inside;
        }
    }
    inside
}

/// The pixels whose centers lie between two opposite corners.
pub(super) fn rectangle([width, height]: [usize; 2], a: DVec2, b: DVec2) -> Mask {
    let (lo, hi) = (a.min(b), a.max(b));
    Mask::from_fn(width, height, |x, y| {
        let p = DVec2::new(x as f64, y as f64);
        p.cmpge(lo).all() && p.cmple(hi).all()
    })
}

/// The pixels connected with the one at `seed` (over sides) whose depth differs from its depth by no more than
/// `tolerance_m`. Pixels without depth are never among them.
pub(super) fn about_as_deep(imprint: &DepthMap, seed: DVec2, tolerance_m: f64) -> Mask {
    let (width, height) = (imprint.width(), imprint.height());
    let mut mask = Mask::filled(width, height, false);
    let start_px = seed.round();
    let size = DVec2::new(width as f64, height as f64);
    if !(start_px.cmpge(DVec2::ZERO).all() && start_px.cmplt(size).all()) {
        return mask;
    }
    let start = (start_px.x as usize, start_px.y as usize);
    let depth = f64::from(imprint[start]);
    let fits = |x, y| (f64::from(imprint[(x, y)]) - depth).abs() <= tolerance_m;
    if !fits(start.0, start.1) {
        return mask;
    }
    mask[start] = true;
    let mut stack = vec![start];
    while let Some((x, y)) = stack.pop() {
        let beside = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
        for (nx, ny) in beside {
            if nx < width && ny < height && !mask[(nx, ny)] && fits(nx, ny) {
                mask[(nx, ny)] = true;
                stack.push((nx, ny));
            }
        }
    }
    mask
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_encloses_by_centers_and_crosses_itself_evenly() {
        let square = [[1.5, 1.5], [4.5, 1.5], [4.5, 3.5], [1.5, 3.5]].map(DVec2::from);
        let count = |points: &[DVec2]| enclosed([8, 6], points).as_slice().iter().filter(|v| **v).count();
        assert_eq!(count(&square), 3 * 2);
        let reversed: Vec<DVec2> = square.iter().rev().copied().collect();
        assert_eq!(enclosed([8, 6], &square), enclosed([8, 6], &reversed));
        // A bow tie: both halves, and not what lies above and below the crossing.
        let bow = [[0.0, 0.0], [7.0, 5.0], [7.0, 0.0], [0.0, 5.0]].map(DVec2::from);
        let bow = enclosed([8, 6], &bow);
        assert!(bow[(1, 2)] && bow[(6, 2)] && !bow[(3, 0)] && !bow[(4, 5)]);
        assert_eq!(count(&square[..2]), 0);
        assert!(encloses(&square, DVec2::new(4.4, 3.4)) && !encloses(&square, DVec2::new(4.6, 3.4)));
        assert!(!encloses(&square[..2], DVec2::new(2.0, 1.5)) && !encloses(&square, DVec2::NAN));
        assert_eq!(enclosed([0, 0], &square).len(), 0);
    }
}
