//! [`distance`]: how far drawn imprints are from measured ones.

use crate::tape::Tensor;

/// Weight of the mean square; the mean absolute difference has 1.
const SQUARES: f32 = 20.0;
/// Weight of the mean absolute gradients.
const EDGES: f32 = 0.5;
/// Side of the squares over which differences are averaged before gradients are taken.
const BOX: usize = 3;

/// 20 × mean square + mean absolute + half of the mean absolute gradients of the difference's 3-pixel means, each picture
/// of `[n, side, side]` by its weight.
pub fn distance(drawn: &Tensor, measured: &[f32], weights: &[f32]) -> Tensor {
    let [_, side, _] = drawn.dims();
    let pixels = side * side;
    let mut loss = 0.0;
    let mut slope = Vec::with_capacity(measured.len());
    let items = drawn.values().chunks_exact(pixels).zip(measured.chunks_exact(pixels)).zip(weights);
    for ((drawn, measured), &weight) in items {
        let difference: Vec<f32> = drawn.iter().zip(measured).map(|(d, m)| d - m).collect();
        let (of_pixels, mut along) = pixel_terms(&difference);
        let of_edges = edge_terms(&difference, side, &mut along);
        loss += f64::from(weight) * (of_pixels + of_edges);
        slope.extend(along.iter().map(|v| v * weight));
    }
    Tensor::made([drawn], &[1], vec![loss as f32], move |outer, [to_drawn], slopes| {
        slopes.add(to_drawn, || slope.iter().map(|v| v * outer[0]).collect());
    })
}

/// Loss of the pixels, and its slopes.
fn pixel_terms(difference: &[f32]) -> (f64, Vec<f32>) {
    let share = 1.0 / difference.len() as f32;
    let sum: f64 = difference.iter().map(|&d| f64::from(SQUARES * d * d + d.abs())).sum();
    (sum * f64::from(share), difference.iter().map(|&d| (2.0 * SQUARES * d + sign(d)) * share).collect())
}

/// Loss of the gradients; its slopes are added to those of the pixels.
fn edge_terms(difference: &[f32], side: usize, along: &mut [f32]) -> f64 {
    let small = side - BOX + 1;
    let smooth = boxes(difference, side);
    let share = EDGES / (small * (small - 1)) as f32;
    let mut of_smooth = vec![0.0; smooth.len()];
    let mut sum = 0.0;
    let mut edge = |one: usize, next: usize| {
        let step = smooth[next] - smooth[one];
        sum += f64::from(step.abs());
        of_smooth[next] += sign(step) * share;
        of_smooth[one] -= sign(step) * share;
    };
    for pixel in 0..smooth.len() {
        if pixel % small + 1 < small {
            edge(pixel, pixel + 1);
        }
        if pixel + small < smooth.len() {
            edge(pixel, pixel + small);
        }
    }
    for (pixel, slope) in of_smooth.iter().enumerate() {
        let (y, x) = (pixel / small, pixel % small);
        for row in y..y + BOX {
            let to = &mut along[row * side + x..][..BOX];
            to.iter_mut().for_each(|to| *to += slope / (BOX * BOX) as f32);
        }
    }
    sum * f64::from(share)
}

/// Means over all squares that lie within the image.
fn boxes(image: &[f32], side: usize) -> Vec<f32> {
    let small = side - BOX + 1;
    let mean = |pixel: usize| {
        let (y, x) = (pixel / small, pixel % small);
        let sum: f32 = (y..y + BOX).map(|row| image[row * side + x..][..BOX].iter().sum::<f32>()).sum();
        sum / (BOX * BOX) as f32
    };
    (0..small * small).map(mean).collect()
}

/// The slope of the absolute value; 0 at 0.
fn sign(value: f32) -> f32 {
    if value > 0.0 {
        1.0
    } else if value < 0.0 {
        -1.0
    } else {
        0.0
    }
}
