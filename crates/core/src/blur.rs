//! Gaussian blur.

use super::grid::Grid;

/// The image blurred with a Gaussian of this deviation, pixels; the border repeats. With a deviation of zero or less the
/// image itself.
pub(crate) fn gaussian(image: &Grid<f64>, sigma_px: f64) -> Grid<f64> {
    if sigma_px.is_nan() || sigma_px <= 0.0 || image.is_empty() {
        return image.clone();
    }
    let radius = (3.0 * sigma_px).ceil() as usize;
    let tap = |i: usize| (-((i * i) as f64) / (2.0 * sigma_px * sigma_px)).exp();
    let half: Vec<f64> = (0..=radius).map(tap).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    let half: Vec<f64> = half.iter().map(|w| w / sum).collect();
    let [width, height] = image.size();
    let along_x = Grid::from_fn(width, height, |x, y| {
        let row = image.row(y);
        let pixel = |x: usize| row[x.min(width - 1)];
        (1..=radius).fold(half[0] * row[x], |sum, i| sum + half[i] * (pixel(x + i) + row[x.saturating_sub(i)]))
    });
    Grid::from_fn(width, height, |x, y| {
        let pixel = |y: usize| along_x[(x, y.min(height - 1))];
        (1..=radius).fold(half[0] * pixel(y), |sum, i| sum + half[i] * (pixel(y + i) + pixel(y.saturating_sub(i))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_becomes_a_bell_of_the_same_sum_and_the_asked_width() {
        let point = Grid::from_fn(41, 41, |x, y| f64::from(u8::from((x, y) == (20, 20))));
        let bell = gaussian(&point, 2.0);
        let sum: f64 = bell.as_slice().iter().sum();
        let spread: f64 = (0..41)
            .flat_map(|y| (0..41).map(move |x| (x, y)))
            .map(|(x, y)| (x as f64 - 20.0).powi(2) * bell[(x, y)])
            .sum();
        // The bell is cut at three deviations, which takes 3 % of its variance.
        assert!((sum - 1.0).abs() < 1e-12 && (spread / 4.0 - 1.0).abs() < 0.04, "{sum} {spread}");
        assert_eq!(gaussian(&point, 0.0), point);
        assert_eq!(gaussian(&Grid::filled(0, 0, 1.0), 1.0).len(), 0);
        let flat = gaussian(&Grid::filled(3, 2, 5.0), 9.0);
        assert!(flat.as_slice().iter().all(|v| (v - 5.0).abs() < 1e-12));
    }
}
