//! Each operator against a plain one in double precision, and its gradients against finite differences of that.

use std::rc::Rc;

use super::*;
use crate::fixture::random;
use crate::tape::{Tape, Tensor, backward};

/// An array in double precision.
#[derive(Clone)]
struct Array {
    shape: Vec<usize>,
    values: Vec<f64>,
}

impl Array {
    fn random(shape: &[usize], seed: u64) -> Self {
        let count = shape.iter().product();
        // Rounded to f32, so that both precisions begin from the same numbers.
        Self { shape: shape.to_vec(), values: random(seed).normals(count).into_iter().map(f64::from).collect() }
    }

    fn tensor(&self) -> Tensor {
        Tensor::new(&self.shape, self.values.iter().map(|&v| v as f32).collect::<Vec<_>>())
    }
}

/// An operator in double precision, value by value.
type Plain<'a> = &'a dyn Fn(&[Array]) -> Vec<f64>;

/// Inputs, and what the tested operator makes of them: its values, and the slopes of `sum(output * probe)`.
struct Case<'a> {
    inputs: Vec<Array>,
    plain: Plain<'a>,
    output: Vec<f32>,
    gradients: Vec<Vec<f32>>,
    probe: Vec<f32>,
}

fn run<'a>(inputs: Vec<Array>, plain: Plain<'a>, op: impl Fn(&[Tensor]) -> Tensor) -> Case<'a> {
    let tape = Rc::new(Tape::default());
    let leaves: Vec<Tensor> = inputs.iter().map(|input| input.tensor().tracked(&tape)).collect();
    let output = op(&leaves);
    let count = output.values().len();
    let probe = random(99).normals(count);
    let (column, zero) = (Tensor::new(&[count, 1], probe.clone()), Tensor::new(&[1], vec![0.0]));
    let loss = linear(&output.clone().reshaped(&[1, count]), &column, &zero, Weights::InOut);
    let mut slopes = backward(&loss);
    let gradients = leaves.iter().map(|leaf| slopes.take(leaf).unwrap()).collect();
    Case { inputs, plain, output: output.values().to_vec(), gradients, probe }
}

impl Case<'_> {
    fn check(&self, tolerance: f64) {
        let expected = (self.plain)(&self.inputs);
        assert_eq!(expected.len(), self.output.len());
        for (expected, computed) in expected.iter().zip(&self.output) {
            assert!(
                (expected - f64::from(*computed)).abs() < tolerance * (1.0 + expected.abs()),
                "{expected} {computed}"
            );
        }
        for (which, input) in self.inputs.iter().enumerate() {
            assert_eq!(input.values.len(), self.gradients[which].len());
            // Some places of each input.
            for place in (0..input.values.len()).step_by((input.values.len() / 23).max(1)) {
                let (expected, computed) = (self.slope(which, place), f64::from(self.gradients[which][place]));
                let close = (expected - computed).abs() < tolerance * (1.0 + expected.abs());
                assert!(close, "input {which}, place {place}: {expected} by differences, {computed} by the operator");
            }
        }
    }

    /// The slope of `sum(output * probe)` along a value, by differences in double precision.
    fn slope(&self, which: usize, place: usize) -> f64 {
        let loss = |step: f64| {
            let mut inputs = self.inputs.clone();
            inputs[which].values[place] += step;
            (self.plain)(&inputs).iter().zip(&self.probe).map(|(v, p)| v * f64::from(*p)).sum::<f64>()
        };
        (loss(1e-5) - loss(-1e-5)) / 2e-5
    }
}

fn plain_conv(inputs: &[Array], stride: usize, padding: usize) -> Vec<f64> {
    let [x, w, b] = inputs else { unreachable!() };
    let [n, c, height, width] = x.shape[..] else { unreachable!() };
    let [filters, _, k, _] = w.shape[..] else { unreachable!() };
    let out = |size: usize| (size + 2 * padding - k) / stride + 1;
    let mut y = Vec::new();
    for (picture, filter) in (0..n).flat_map(|picture| (0..filters).map(move |filter| (picture, filter))) {
        for (row, column) in (0..out(height)).flat_map(|row| (0..out(width)).map(move |column| (row, column))) {
            let mut sum = b.values[filter];
            for (channel, ky) in (0..c).flat_map(|channel| (0..k).map(move |ky| (channel, ky))) {
                for kx in 0..k {
                    let (at_y, at_x) = (row * stride + ky, column * stride + kx);
                    if (padding..height + padding).contains(&at_y) && (padding..width + padding).contains(&at_x) {
                        let pixel = ((picture * c + channel) * height + at_y - padding) * width + at_x - padding;
                        sum += x.values[pixel] * w.values[((filter * c + channel) * k + ky) * k + kx];
                    }
                }
            }
            y.push(sum);
        }
    }
    y
}

#[test]
fn convolution_and_its_gradients() {
    // Kernel, stride, padding as in the networks, and one whose tiles end within a picture.
    for (size, kernel, stride, padding) in [(9, 3, 1, 1), (8, 3, 2, 1), (16, 8, 4, 2), (5, 1, 1, 0), (3, 3, 2, 1)] {
        let inputs = vec![
            Array::random(&[2, 3, size, size + 1], 1),
            Array::random(&[4, 3, kernel, kernel], 2),
            Array::random(&[4], 3),
        ];
        let plain = |inputs: &[Array]| plain_conv(inputs, stride, padding);
        run(inputs, &plain, |x| conv2d(&x[0], &x[1], &x[2], stride, padding)).check(2e-4);
    }
}

#[test]
fn convolution_of_many_tiles() {
    let inputs = vec![Array::random(&[3, 64, 24, 24], 1), Array::random(&[2, 64, 3, 3], 2), Array::random(&[2], 3)];
    let plain = |inputs: &[Array]| plain_conv(inputs, 1, 1);
    let case = run(inputs, &plain, |x| conv2d(&x[0], &x[1], &x[2], 1, 1));
    let expected = plain(&case.inputs);
    assert!(expected.iter().zip(&case.output).all(|(e, f)| (e - f64::from(*f)).abs() < 1e-3));
    for (which, place) in [(0, 0), (0, 40_000), (1, 700), (2, 1)] {
        let (expected, computed) = (case.slope(which, place), f64::from(case.gradients[which][place]));
        assert!((expected - computed).abs() < 1e-3 * (1.0 + expected.abs()), "{expected} {computed}");
    }
}

fn plain_norm(inputs: &[Array], silu: bool) -> Vec<f64> {
    let [x, scale, shift] = inputs else { unreachable!() };
    let [_, c, h, w] = x.shape[..] else { unreachable!() };
    let per_group = c / GROUPS;
    let mut y = Vec::new();
    for (i, block) in x.values.chunks_exact(per_group * h * w).enumerate() {
        let mean = block.iter().sum::<f64>() / block.len() as f64;
        let variance = block.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / block.len() as f64;
        for (k, v) in block.iter().enumerate() {
            let channel = i % GROUPS * per_group + k / (h * w);
            let u = (v - mean) / (variance + 1e-5).sqrt() * scale.values[channel] + shift.values[channel];
            y.push(if silu { u / (1.0 + (-u).exp()) } else { u });
        }
    }
    y
}

#[test]
fn group_norm_and_its_gradients() {
    for (then, size) in [(Activation::None, 5), (Activation::Silu, 5), (Activation::Silu, 1)] {
        let inputs = vec![Array::random(&[2, 16, size, size], 4), Array::random(&[16], 5), Array::random(&[16], 6)];
        let plain = |inputs: &[Array]| plain_norm(inputs, then == Activation::Silu);
        run(inputs, &plain, |x| group_norm(&x[0], &x[1], &x[2], then)).check(2e-4);
    }
}

#[test]
fn large_values_stay_numbers() {
    let x = Tensor::new(&[1, 8, 2, 2], vec![1e4; 8 * 4]);
    let flat = |value: f32| Tensor::new(&[8], vec![value; 8]);
    for shift in [-1e6f32, -100.0, 100.0, 1e6] {
        let y = group_norm(&x, &flat(1.0), &flat(shift), Activation::Silu);
        assert!(y.values().iter().all(|y| (y - shift.max(0.0)).abs() < 1e-3 * shift.abs()), "{y:?}");
    }
}

#[test]
fn layer_norm_and_its_gradients() {
    let plain = |inputs: &[Array]| {
        let dim = inputs[1].values.len();
        let token = |token: &[f64]| {
            let mean = token.iter().sum::<f64>() / dim as f64;
            let variance = token.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / dim as f64;
            let normal = |v: f64| (v - mean) / (variance + 1e-5).sqrt();
            (0..dim).map(|i| normal(token[i]) * inputs[1].values[i] + inputs[2].values[i]).collect::<Vec<_>>()
        };
        inputs[0].values.chunks_exact(dim).flat_map(token).collect()
    };
    let inputs = vec![Array::random(&[2, 3, 20], 1), Array::random(&[20], 2), Array::random(&[20], 3)];
    run(inputs, &plain, |x| layer_norm(&x[0], &x[1], &x[2])).check(2e-4);
}

#[test]
fn products_and_their_gradients() {
    for lie in [Weights::InOut, Weights::OutIn] {
        for rows in [1, 6] {
            let plain = |inputs: &[Array]| {
                let value = |row: usize, out: usize| {
                    let weight = |i: usize| match lie {
                        Weights::InOut => inputs[1].values[i * 4 + out],
                        Weights::OutIn => inputs[1].values[out * 5 + i],
                    };
                    (0..5).map(|i| inputs[0].values[row * 5 + i] * weight(i)).sum::<f64>() + inputs[2].values[out]
                };
                (0..rows * 4).map(|i| value(i / 4, i % 4)).collect()
            };
            let inputs = vec![Array::random(&[1, rows, 5], 1), Array::random(&[20, 1], 2), Array::random(&[4], 3)];
            run(inputs, &plain, |x| linear(&x[0], &x[1], &x[2], lie)).check(1e-4);
        }
    }
}

#[test]
fn attention_and_its_gradients() {
    let (batch, tokens, sources, dim, heads) = (2, 3, 4, 6, 2);
    let plain = |inputs: &[Array]| {
        let (queries, both, per_head) = (&inputs[0].values, &inputs[1].values, dim / heads);
        let mut read = vec![0.0; queries.len()];
        for index in 0..batch * tokens * heads {
            let (item, token, head) = (index / heads / tokens, index / heads % tokens, index % heads);
            let query = (item * tokens + token) * dim + head * per_head;
            let source = |s: usize, which: usize| (item * sources + s) * 2 * dim + which * dim + head * per_head;
            let likeness = |s: usize| {
                let dot: f64 = (0..per_head).map(|i| queries[query + i] * both[source(s, 0) + i]).sum();
                (dot / (per_head as f64).sqrt()).exp()
            };
            let total: f64 = (0..sources).map(likeness).sum();
            for i in 0..per_head {
                read[query + i] = (0..sources).map(|s| likeness(s) / total * both[source(s, 1) + i]).sum();
            }
        }
        read
    };
    let inputs = vec![Array::random(&[batch, tokens, dim], 1), Array::random(&[batch, sources, 2 * dim], 2)];
    run(inputs, &plain, |x| attention(&x[0], &x[1], heads)).check(1e-4);
}

#[test]
fn arithmetic_and_its_gradients() {
    let two = || vec![Array::random(&[2, 3], 1), Array::random(&[2, 3], 2)];
    let each = |of: fn(f64, f64) -> f64| {
        move |x: &[Array]| x[0].values.iter().zip(&x[1].values).map(|(a, b)| of(*a, *b)).collect::<Vec<_>>()
    };
    run(two(), &each(|a, b| a + b), |x| add(&x[0], &x[1])).check(1e-5);
    run(two(), &each(|a, b| a * b), |x| mul(&x[0], &x[1])).check(1e-5);
    run(two(), &each(|a, b| 0.3 * a - 2.0 * b), |x| blend(&x[0], 0.3, &x[1], -2.0)).check(1e-5);
    let one = || vec![Array::random(&[2, 3], 1)];
    let of_one = |of: fn(f64) -> f64| move |x: &[Array]| x[0].values.iter().map(|v| of(*v)).collect::<Vec<_>>();
    run(one(), &of_one(|v| 3.0 * v + 1.0), |x| line(&x[0], 3.0, 1.0)).check(1e-5);
    run(one(), &of_one(|v| v / (1.0 + (-v).exp())), |x| silu(&x[0])).check(1e-5);
    let by_place = |x: &[Array]| (0..6).map(|i| x[0].values[i] * (i % 3) as f64 + 2.0).collect::<Vec<_>>();
    run(one(), &by_place, |x| rescaled(&x[0], vec![0.0, 1.0, 2.0].into(), &[2.0; 3])).check(1e-5);
    let row = |x: &[Array]| (0..6).map(|i| x[0].values[i] + x[1].values[i % 3]).collect::<Vec<_>>();
    run(vec![Array::random(&[2, 3], 1), Array::random(&[1, 3], 2)], &row, |x| add_each(&x[0], &x[1])).check(1e-5);
}

#[test]
fn arrangements_and_their_gradients() {
    let picked = |pick: fn(&[Array], usize) -> f64, count: usize| {
        move |x: &[Array]| (0..count).map(|i| pick(x, i)).collect::<Vec<_>>()
    };
    let beside_plain = picked(
        |x, i| if i % 10 < 4 { x[0].values[i / 10 * 4 + i % 10] } else { x[1].values[i / 10 * 6 + i % 10 - 4] },
        20,
    );
    let inputs = vec![Array::random(&[2, 2, 1, 2], 1), Array::random(&[2, 3, 1, 2], 2)];
    let case = run(inputs, &beside_plain, |x| beside(&x[0], &x[1]));
    case.check(1e-6);
    let x = || vec![Array::random(&[2, 4, 3], 3)];
    run(x(), &picked(|x, i| x[0].values[i / 6 * 12 + 3 + i % 6], 12), |x| channels(&x[0], 1..3)).check(1e-6);
    run(x(), &picked(|x, i| x[0].values[i / 12 * 12 + i % 4 * 3 + i % 12 / 4], 24), |x| swapped(&x[0])).check(1e-6);
    let small = || vec![Array::random(&[1, 2, 2, 3], 4)];
    run(small(), &picked(|x, i| x[0].values[i % 12], 36), |x| repeated(&x[0], 3)).check(1e-6);
    let twice = picked(|x, i| x[0].values[i / 24 * 6 + i % 24 / 12 * 3 + i % 6 / 2], 48);
    run(small(), &twice, |x| doubled(&x[0])).check(1e-6);
}

/// A picture read at a place between pixels, the border repeated.
fn read(image: &[f64], side: usize, y: f64, x: f64) -> f64 {
    let last = (side - 1) as f64;
    let (y, x) = (y.clamp(0.0, last), x.clamp(0.0, last));
    let (top, left) = (y.floor().min(last - 1.0), x.floor().min(last - 1.0));
    let pixel = |row: f64, column: f64| image[row as usize * side + column as usize];
    let row = |row: f64| pixel(row, left) + (pixel(row, left + 1.0) - pixel(row, left)) * (x - left);
    row(top) + (row(top + 1.0) - row(top)) * (y - top)
}

#[test]
fn placement_and_its_gradients() {
    let (side, pads) = (7, [Some(1), None, Some(0), Some(1)]);
    let plain = |inputs: &[Array]| {
        let [drawn, line, shifts, fields] = inputs else { unreachable!() };
        let pixel = |i: usize| {
            let (item, index) = (i / (side * side), i % (side * side));
            let image = &drawn.values[item * side * side..][..side * side];
            pads[item].map_or(image[index], |pad| {
                let [dy, dx] = [shifts.values[2 * pad], shifts.values[2 * pad + 1]];
                let (y, x) = ((index / side) as f64 - dy, (index % side) as f64 - dx);
                read(image, side, y, x) * line.values[0] + line.values[1] + fields.values[pad * side * side + index]
            })
        };
        (0..pads.len() * side * side).map(pixel).collect()
    };
    for shifts in [[0.25, -1.625], [2.375, 0.75]] {
        let shifts = Array { shape: vec![2, 2], values: shifts.into_iter().chain([-0.5, 1.125]).collect() };
        let inputs = vec![
            Array::random(&[4, side, side], 1),
            Array::random(&[1, 2], 2),
            shifts,
            Array::random(&[2, side * side], 3),
        ];
        run(inputs, &plain, |x| placed(&x[0], &x[1], &x[2], &x[3], &pads)).check(1e-4);
    }
}

#[test]
fn shifts_by_whole_pixels_have_a_slope() {
    let tape = Rc::new(Tape::default());
    for (shift, moves) in [(0.0, true), (2.0, true), (-3.0, true), (40.0, false)] {
        let shifts = Tensor::new(&[1, 2], vec![shift, shift]).tracked(&tape);
        let drawn = Tensor::new(&[1, 9, 9], random(1).normals(81));
        let (line, fields) = (Tensor::new(&[1, 2], vec![1.0, 0.0]), Tensor::new(&[1, 81], vec![0.0; 81]));
        let seen = placed(&drawn, &line, &shifts, &fields, &[Some(0)]);
        let slope = backward(&distance(&seen, &[0.1; 81], &[1.0])).take(&shifts).unwrap();
        assert!(slope.iter().all(|v| (*v != 0.0) == moves), "{shift}: {slope:?}");
    }
}

#[test]
fn the_distance_and_its_gradients() {
    let (side, weights) = (6, [0.25, 0.75]);
    let measured = random(8).normals(2 * side * side);
    let plain = |inputs: &[Array]| {
        let mut loss = 0.0;
        for (item, weight) in weights.iter().enumerate() {
            let d = |i: usize| inputs[0].values[item * side * side + i] - f64::from(measured[item * side * side + i]);
            let smooth = |y: usize, x: usize| (0..9).map(|k| d((y + k / 3) * side + x + k % 3)).sum::<f64>() / 9.0;
            let pixels = (0..side * side).map(|i| 20.0 * d(i).powi(2) + d(i).abs()).sum::<f64>() / (side * side) as f64;
            let small = side - 2;
            let down: f64 = (0..small - 1)
                .flat_map(|y| (0..small).map(move |x| (y, x)))
                .map(|(y, x)| (smooth(y + 1, x) - smooth(y, x)).abs())
                .sum();
            let right: f64 = (0..small)
                .flat_map(|y| (0..small - 1).map(move |x| (y, x)))
                .map(|(y, x)| (smooth(y, x + 1) - smooth(y, x)).abs())
                .sum();
            loss += f64::from(*weight) * (pixels + 0.5 * (down + right) / (small * (small - 1)) as f64);
        }
        vec![loss]
    };
    run(vec![Array::random(&[2, side, side], 7)], &plain, |x| distance(&x[0], &measured, &weights)).check(1e-4);
}

#[test]
fn what_a_unet_needs_and_its_gradients() {
    let one = || vec![Array::random(&[1, 2, 4, 6], 5)];
    run(one(), &|x| x[0].values.iter().map(|v| v.max(0.0)).collect(), |x| relu(&x[0])).check(1e-6);
    let largest = |x: &[Array]| {
        let value = |i: usize, k: usize| x[0].values[(i / 3 * 2 + k / 2) * 6 + i % 3 * 2 + k % 2];
        (0..12).map(|i| (0..4).map(|k| value(i, k)).fold(f64::MIN, f64::max)).collect()
    };
    run(one(), &largest, |x| halved(&x[0])).check(1e-6);
    let margins = Margins::to_multiples(3, 5, 4);
    assert_eq!(margins, Margins { rows: [0, 1], columns: [1, 2] });
    let grown = |x: &[Array]| {
        let inside = |i: usize| i / 8 % 4 < 3 && (1..6).contains(&(i % 8));
        (0..64).map(|i| if inside(i) { x[0].values[(i / 32 * 3 + i / 8 % 4) * 5 + i % 8 - 1] } else { 0.0 }).collect()
    };
    let small = || vec![Array::random(&[1, 2, 3, 5], 5)];
    run(small(), &grown, |x| padded(&x[0], margins)).check(1e-6);
    run(small(), &|x| x[0].values.clone(), |x| cropped(&padded(&x[0], margins), margins)).check(1e-6);
    // Ties go to the first pixel, and its slope with them.
    let tape = Rc::new(Tape::default());
    let flat = Tensor::new(&[1, 1, 2, 2], vec![1.0; 4]).tracked(&tape);
    assert_eq!(backward(&halved(&flat)).take(&flat), Some(vec![1.0, 0.0, 0.0, 0.0]));
}

#[test]
fn the_loss_of_contact_and_its_gradients() {
    let (h, w, pixels, weights) = (3, 5, 15, [0.25, 0.5, 0.75]);
    let mut random = random(4);
    let mut bits = |share: f64| (0..3 * pixels).map(|_| f32::from(u8::from(random.happens(share)))).collect::<Vec<_>>();
    // The second picture has no contact; of the third no pixel counts.
    let (mut masks, mut counted) = (bits(0.4), bits(0.7));
    masks[pixels..2 * pixels].fill(0.0);
    counted[2 * pixels..].fill(0.0);
    let plain = |inputs: &[Array]| {
        let mut loss = 0.0;
        for (item, weight) in weights.iter().enumerate() {
            let logit = |class: usize, i: usize| inputs[0].values[(2 * item + class) * pixels + i];
            let counts: Vec<usize> = (0..pixels).filter(|i| counted[item * pixels + i] == 1.0).collect();
            let truth = |i: usize| f64::from(masks[item * pixels + i]);
            let p = |i: usize| logit(1, i).exp() / (logit(0, i).exp() + logit(1, i).exp());
            if counts.is_empty() {
                continue;
            }
            let right = |i: usize| if truth(i) == 1.0 { p(i) } else { 1.0 - p(i) };
            let cross = counts.iter().map(|&i| -right(i).ln()).sum::<f64>() / counts.len() as f64;
            let both: f64 = counts.iter().map(|&i| p(i) * truth(i)).sum();
            let sides: f64 = counts.iter().map(|&i| p(i) + truth(i)).sum();
            loss += weight * (cross + 1.0 - (2.0 * both + 1.0) / (sides + 1.0));
        }
        vec![loss]
    };
    let of_weights: Vec<f32> = weights.iter().map(|&v: &f64| v as f32).collect();
    let loss = |x: &[Tensor]| contact_loss(&x[0], &masks, &counted, &of_weights);
    run(vec![Array::random(&[3, 2, h, w], 7)], &plain, loss).check(1e-5);
    // Logits far beyond any exponent stay numbers.
    let tape = Rc::new(Tape::default());
    let far = Tensor::new(&[1, 2, 1, 2], vec![-3e4, 3e4, 3e4, -3e4]).tracked(&tape);
    let loss = contact_loss(&far, &[0.0, 1.0], &[1.0; 2], &[1.0]);
    assert!(loss.values()[0].is_finite());
    assert!(backward(&loss).take(&far).unwrap().iter().all(|v| v.is_finite()));
}
