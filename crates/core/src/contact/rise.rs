//! Rise of imprints: out of their rest, out of the plane that fits them best, and out of what lies around a mask.

use crate::grid::{DepthMap, Mask};

/// Side of the squares whose medians are compared, as a share of the imprint's width: 7 px of 175.
const SQUARES_ACROSS: usize = 25;
/// Share of the squares that lie lower than the imprint's rest, and of those that lie higher than its top.
const REST_SHARE: f64 = 0.25;
const TOP_SHARE: f64 = 0.02;
/// Reach of the surroundings of a mask, as a share of the imprint's width: 14 px of 175.
const AROUND_SHARE: f64 = 0.08;

/// A small square of an imprint: its center, pixels, and the median of what was measured in it, meters.
struct Square {
    x: f64,
    y: f64,
    depth: f32,
}

/// The medians over small squares, so that neither noise nor flying pixels count.
fn squares(imprint: &DepthMap) -> Vec<Square> {
    let side = imprint.width().div_ceil(SQUARES_ACROSS).max(1);
    let mut squares = Vec::new();
    let mut values: Vec<f32> = Vec::with_capacity(side * side);
    for y in (0..imprint.height()).step_by(side) {
        for x in (0..imprint.width()).step_by(side) {
            values.clear();
            let [right, below] = [imprint.width().min(x + side), imprint.height().min(y + side)];
            for row in y..below {
                values.extend(imprint.row(row)[x..right].iter().copied().filter(|d| d.is_finite()));
            }
            if let Some(depth) = at_share(&mut values, 0.5) {
                squares.push(Square { x: (x + right) as f64 / 2.0, y: (y + below) as f64 / 2.0, depth });
            }
        }
    }
    squares
}

/// The value that this share of the values stays below; `None` of nothing.
fn at_share(values: &mut [f32], share: f64) -> Option<f32> {
    let last = values.len().checked_sub(1)?;
    // Of an even number in the middle the upper one.
    let rank = last.min((share * values.len() as f64) as usize);
    Some(*values.select_nth_unstable_by(rank, f32::total_cmp).1)
}

fn between(mut depths: Vec<f32>) -> Option<[f32; 2]> {
    let last = depths.len().checked_sub(1)?;
    let mut quantile = |share: f64| *depths.select_nth_unstable_by((share * last as f64) as usize, f32::total_cmp).1;
    Some([quantile(REST_SHARE), quantile(1.0 - TOP_SHARE)])
}

/// Rest and top of an imprint, meters: the depth that a quarter of it stays below, and that of its deepest parts, both
/// of medians over small squares. `None` if nothing was measured.
pub fn rest_and_top(imprint: &DepthMap) -> Option<[f32; 2]> {
    between(squares(imprint).iter().map(|square| square.depth).collect())
}

/// A depth that changes by so much along x and y, meters per pixel.
#[derive(Clone, Copy, Default)]
struct Slope {
    x: f64,
    y: f64,
}

impl Slope {
    fn at(self, x: f64, y: f64) -> f32 {
        (self.x * x + self.y * y) as f32
    }

    /// Slope of the plane through some squares, by least squares; none where they do not determine one.
    fn of(squares: &[Square]) -> Self {
        let n = squares.len().max(1) as f64;
        let mean = |of: fn(&Square) -> f64| squares.iter().map(of).sum::<f64>() / n;
        let (mx, my, md) = (mean(|s| s.x), mean(|s| s.y), mean(|s| f64::from(s.depth)));
        let (mut xx, mut xy, mut yy, mut xd, mut yd) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for square in squares {
            let (x, y, d) = (square.x - mx, square.y - my, f64::from(square.depth) - md);
            xx += x * x;
            xy += x * y;
            yy += y * y;
            xd += x * d;
            yd += y * d;
        }
        let det = xx * yy - xy * xy;
        let slope = Self { x: (yy * xd - xy * yd) / det, y: (xx * yd - xy * xd) / det };
        if det > 1e-9 * xx * yy && slope.x.is_finite() && slope.y.is_finite() { slope } else { Self::default() }
    }
}

/// Rise of an imprint out of its rest once the plane that fits it best is taken out, meters: a bubble that is held
/// askew gives a ramp and touches nothing. 0 if nothing was measured.
pub fn rise(imprint: &DepthMap) -> f32 {
    let squares = squares(imprint);
    let slope = Slope::of(&squares);
    let level = squares.iter().map(|square| square.depth - slope.at(square.x, square.y)).collect();
    between(level).map_or(0.0, |[rest, top]| top - rest)
}

/// By how much what is in a mask is pushed in more than what lies around it, once the plane that fits the imprint best is
/// taken out, meters: the difference of the medians. `None` where nothing was measured in the mask or around it.
pub fn stands_out(imprint: &DepthMap, mask: &Mask) -> Option<f32> {
    if mask.size() != imprint.size() {
        return None;
    }
    let slope = Slope::of(&squares(imprint));
    let near = near(mask, (AROUND_SHARE * imprint.width() as f64).ceil() as usize);
    let (mut inside, mut around) = (Vec::new(), Vec::new());
    for y in 0..imprint.height() {
        for x in 0..imprint.width() {
            let depth = imprint[(x, y)] - slope.at(x as f64, y as f64);
            if depth.is_finite() && near[(x, y)] {
                if mask[(x, y)] { &mut inside } else { &mut around }.push(depth);
            }
        }
    }
    Some(at_share(&mut inside, 0.5)? - at_share(&mut around, 0.5)?)
}

/// Pixels within `reach` of a mask's, along rows and columns.
fn near(mask: &Mask, reach: usize) -> Mask {
    let [width, height] = mask.size();
    let spread = |len: usize, is_set: &dyn Fn(usize) -> bool| -> Vec<bool> {
        let mut reached = vec![false; len];
        for i in (0..len).filter(|&i| is_set(i)) {
            reached[i.saturating_sub(reach)..len.min(i + reach + 1)].fill(true);
        }
        reached
    };
    let rows: Vec<bool> = (0..height).flat_map(|y| spread(width, &|x| mask[(x, y)])).collect();
    let columns: Vec<Vec<bool>> = (0..width).map(|x| spread(height, &|y| rows[y * width + x])).collect();
    Mask::from_fn(width, height, |x, y| columns[x][y])
}
