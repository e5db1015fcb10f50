//! Square images as slices: [`shifted`], [`blurred`].

/// Tap: where a pixel of a moved line reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tap {
    /// The first of two neighbors.
    pub(crate) low: usize,
    /// The second one's weight.
    pub(crate) part: f32,
    /// 1 where the place moves with the shift, 0 where it is held at the border.
    pub(crate) inside: f32,
}

impl Tap {
    pub(crate) fn between(&self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.part
    }
}

/// The taps of a line (two pixels or more) that is moved; what comes from outside repeats the border.
pub(crate) fn taps(side: usize, shift: f64) -> Vec<Tap> {
    let last = (side - 1) as f64;
    let tap = |i: usize| {
        let wanted = i as f64 - shift;
        let held = wanted.clamp(0.0, last);
        let low = (held.floor() as usize).min(side - 2);
        let inside = if wanted == held { 1.0 } else { 0.0 };
        Tap { low, part: (held - low as f64) as f32, inside }
    };
    (0..side).map(tap).collect()
}

/// The rows of an image, read with the taps of its columns.
pub(crate) fn across(image: &[f32], columns: &[Tap]) -> Vec<f32> {
    let rows = image.chunks_exact(columns.len());
    rows.flat_map(|row| columns.iter().map(|tap| tap.between(row[tap.low], row[tap.low + 1]))).collect()
}

/// The image moved down and right by sub-pixel amounts, interpolated linearly, the border repeated.
pub(crate) fn shifted(image: &[f32], side: usize, [down, right]: [f64; 2]) -> Vec<f32> {
    let (rows, columns) = (taps(side, down), taps(side, right));
    let across = across(image, &columns);
    let mut moved = Vec::with_capacity(image.len());
    for tap in rows {
        let (upper, lower) = across[tap.low * side..][..2 * side].split_at(side);
        moved.extend(upper.iter().zip(lower).map(|(&upper, &lower)| tap.between(upper, lower)));
    }
    moved
}

/// Gaussian blur; the border is repeated.
pub(crate) fn blurred(image: &[f32], side: usize, sigma: f64) -> Vec<f32> {
    let radius = (3.0 * sigma).ceil() as isize;
    let weights: Vec<f64> = (-radius..=radius).map(|i| (-((i * i) as f64) / (2.0 * sigma * sigma)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let weights: Vec<f32> = weights.iter().map(|weight| (weight / sum) as f32).collect();
    let radius = weights.len() / 2;
    let mut line = vec![0.0; side + 2 * radius];
    let mut pass = |image: &[f32]| {
        // Each pass transposes: after two the image lies as before.
        let mut out = vec![0.0; image.len()];
        for (y, row) in image.chunks_exact(side).enumerate() {
            line[..radius].fill(row[0]);
            line[radius..radius + side].copy_from_slice(row);
            line[radius + side..].fill(row[side - 1]);
            for x in 0..side {
                out[x * side + y] = line[x..].iter().zip(&weights).map(|(value, weight)| value * weight).sum();
            }
        }
        out
    };
    let across = pass(image);
    pass(&across)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dot(side: usize, [y, x]: [usize; 2]) -> Vec<f32> {
        (0..side * side).map(|i| if i == y * side + x { 1.0 } else { 0.0 }).collect()
    }

    #[test]
    fn whole_shifts_move_and_parts_share() {
        assert_eq!(shifted(&dot(8, [3, 4]), 8, [2.0, -1.0]), dot(8, [5, 3]));
        let half = shifted(&dot(8, [3, 4]), 8, [0.0, 0.25]);
        assert_eq!((half[3 * 8 + 4], half[3 * 8 + 5]), (0.75, 0.25));
        assert_eq!(shifted(&[1.0; 64], 8, [3.3, -9.0]), [1.0; 64]);
    }

    #[test]
    fn blurs_keep_the_sum_and_spread_alike_in_both_directions() {
        let image = blurred(&dot(16, [7, 8]), 16, 1.2);
        assert!((image.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        assert!((image[6 * 16 + 8] - image[7 * 16 + 9]).abs() < 1e-7);
        assert!(image[6 * 16 + 8] > image[9 * 16 + 8]);
    }
}
