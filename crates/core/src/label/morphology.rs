//! Clean-ups of masks: holes, islands, growing and shrinking.

use crate::grid::{Grid, Mask};

/// Numbers the connected regions of pixels equal to `value`, over sides, and over corners if `corners`: region `i` has number
/// `i + 1`, all else 0. The second value holds their sizes in pixels.
fn components(mask: &Mask, value: bool, corners: bool) -> (Grid<u32>, Vec<usize>) {
    let (width, height) = (mask.width(), mask.height());
    let mut labels = Grid::filled(width, height, 0u32);
    let mut sizes = Vec::new();
    let mut stack = Vec::new();
    for start in 0..mask.len() {
        if mask.as_slice()[start] != value || labels.as_slice()[start] != 0 {
            continue;
        }
        let label = sizes.len() as u32 + 1;
        let mut size = 0;
        labels.as_mut_slice()[start] = label;
        stack.push(start);
        while let Some(pixel) = stack.pop() {
            size += 1;
            let (x, y) = (pixel % width, pixel / width);
            for ny in y.saturating_sub(1)..=(y + 1).min(height - 1) {
                for nx in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                    let next = ny * width + nx;
                    let reached = corners || nx == x || ny == y;
                    if reached && mask.as_slice()[next] == value && labels.as_slice()[next] == 0 {
                        labels.as_mut_slice()[next] = label;
                        stack.push(next);
                    }
                }
            }
        }
        sizes.push(size);
    }
    (labels, sizes)
}

/// Sets every background region that does not reach the edge of the image.
pub fn fill_holes(mask: &Mask) -> Mask {
    // The background is connected over sides only, so that a line touching at corners is closed.
    let (labels, sizes) = components(mask, false, false);
    let (width, height) = (mask.width(), mask.height());
    let mut open = vec![false; sizes.len() + 1];
    for y in 0..height {
        for x in 0..width {
            if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
                open[labels[(x, y)] as usize] = true;
            }
        }
    }
    Grid::from_fn(width, height, |x, y| mask[(x, y)] || !open[labels[(x, y)] as usize])
}

/// Keeps the island with the most pixels; of equal ones the first in reading order.
pub fn largest_island(mask: &Mask) -> Mask {
    // Pixels that touch at sides or corners are of one island.
    let (labels, sizes) = components(mask, true, true);
    let largest = sizes.iter().enumerate().max_by_key(|&(i, &n)| (n, std::cmp::Reverse(i))).map(|(i, _)| i as u32 + 1);
    labels.map(|&label| Some(label) == largest)
}

/// Adds the pixels within `radius_px` of the mask. A radius below 1, or NaN, changes nothing.
pub fn grow(mask: &Mask, radius_px: f64) -> Mask {
    near(mask, true, radius_px)
}

/// Removes the pixels within `radius_px` of the background. Outside the image nothing is assumed, so the mask is
/// not eaten away along the image's edge. A radius below 1, or NaN, changes nothing.
pub fn shrink(mask: &Mask, radius_px: f64) -> Mask {
    near(mask, false, radius_px).map(|&background| !background)
}

/// The pixels within `radius_px` of a pixel equal to `value`.
fn near(mask: &Mask, value: bool, radius_px: f64) -> Mask {
    let (width, height) = (mask.width(), mask.height());
    // Beyond the diagonal everything is reached.
    let radius = radius_px.max(0.0).min((width + height) as f64);
    let reach = radius.floor() as usize;
    let half_widths: Vec<usize> =
        (0..=reach).map(|dy| (radius * radius - (dy * dy) as f64).max(0.0).sqrt() as usize).collect();
    let mut out = mask.map(|&v| v == value);
    let is_edge = |x: usize, y: usize| {
        let same = |nx: usize, ny: usize| mask.get(nx, ny).is_none_or(|&v| v == value);
        !(same(x.wrapping_sub(1), y) && same(x + 1, y) && same(x, y.wrapping_sub(1)) && same(x, y + 1))
    };
    for y in 0..height {
        for x in 0..width {
            // Only pixels at the border of the region can reach anything new.
            if mask[(x, y)] != value || !is_edge(x, y) {
                continue;
            }
            for ny in y.saturating_sub(reach)..=(y + reach).min(height - 1) {
                let half = half_widths[ny.abs_diff(y)];
                let columns = x.saturating_sub(half)..=(x + half).min(width - 1);
                out.as_mut_slice()[ny * width..(ny + 1) * width][columns].fill(true);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(rows: &[&str]) -> Mask {
        Grid::from_fn(rows[0].len(), rows.len(), |x, y| rows[y].as_bytes()[x] == b'#')
    }

    fn text(mask: &Mask) -> Vec<String> {
        (0..mask.height()).map(|y| mask.row(y).iter().map(|&v| if v { '#' } else { '.' }).collect()).collect()
    }

    #[test]
    fn holes_are_filled_and_bays_are_not() {
        let holed = mask(&[".###.", "#...#", ".#.#.", "..#..", "##..#"]);
        assert_eq!(text(&fill_holes(&holed)), [".###.", "#####", ".###.", "..#..", "##..#"]);
        let bay = mask(&["###", "#.#", "#.#"]);
        assert_eq!(fill_holes(&bay), bay);
    }

    #[test]
    fn islands_touch_at_corners() {
        let m = mask(&["#..#", ".#..", "...#", "#..#"]);
        assert_eq!(components(&m, true, true).1, [2, 1, 2, 1]);
        assert_eq!(text(&largest_island(&m)), ["#...", ".#..", "....", "...."]);
        let none = Mask::filled(3, 2, false);
        assert_eq!(largest_island(&none), none);
        assert_eq!(fill_holes(&Mask::filled(0, 0, false)).len(), 0);
    }

    #[test]
    fn growing_is_a_disc_and_shrinking_undoes_it() {
        let mut point = Mask::filled(21, 17, false);
        point[(10, 8)] = true;
        let grown = grow(&point, 5.0);
        assert_eq!(grown.as_slice().iter().filter(|&&v| v).count(), 81);
        assert_eq!(shrink(&grown, 5.0), point);
        assert_eq!(grow(&point, 0.5), point);
        assert_eq!(grow(&point, f64::NAN), point);
        assert!(grow(&point, 1e9).as_slice().iter().all(|&v| v));
        let full = Mask::filled(5, 5, true);
        assert_eq!(shrink(&full, 2.0), full, "the edge of the image does not eat the mask");
    }
}
