use std::sync::Arc;

use rten::{Model, Value, ValueOrView, ValueView};

use super::*;
use crate::fixture::{self, BUNDLE, shipped};
use crate::tape::backward;

/// Output that rten computes with the shipped graph.
fn run(name: &str, inputs: &[(&str, &[usize], &[f32])], timestep: Option<i32>, output: &str) -> Vec<f32> {
    let model = Model::load(shipped(name)).unwrap();
    let mut all: Vec<(_, ValueOrView<'_>)> = inputs
        .iter()
        .map(|(name, shape, values)| {
            (model.node_id(name).unwrap(), ValueView::from_shape(shape, values).unwrap().into())
        })
        .collect();
    if let Some(t) = timestep {
        let count = inputs[0].1[0];
        all.push((model.node_id("timestep").unwrap(), Value::from_shape([count], vec![t; count]).unwrap().into()));
    }
    let result = model.run(all, &[model.node_id(output).unwrap()], None).unwrap().remove(0);
    result.into_tensor::<f32>().unwrap().into_data()
}

fn assert_close(actual: &[f32], expected: &[f32], tolerance: f32) {
    assert_eq!(actual.len(), expected.len());
    let worst = actual.iter().zip(expected).map(|(f, e)| (f - e).abs()).fold(0.0, f32::max);
    assert!(worst < tolerance, "{worst}");
}

fn shipped_generator() -> (Sizes, Params, Schedule) {
    let files = Files::parse(&shipped("condition_encoder"), &shipped("denoiser"), &shipped("decoder")).unwrap();
    let (sizes, params) = files.read().unwrap();
    (sizes, params, Schedule::scaled_linear(1000, 0.0015, 0.0155))
}

#[test]
fn the_networks_equal_the_shipped_graphs() {
    let (sizes, params, schedule) = shipped_generator();
    assert_eq!((sizes.side, sizes.cells(), sizes.condition), (128, 16, 64));
    let (leaves, n) = (params.leaves(|_| false), 2);
    let mut random = fixture::random(3);
    let picture: Vec<f32> = random.normals(n * sizes.picture());
    let condition = encode(&leaves, &sizes, &picture);
    let expected = run("condition_encoder", &[("gelslim", &[n, 3, 128, 128], &picture)], None, "condition");
    assert_close(condition.values(), &expected, 1e-5);

    let latents: Vec<f32> = random.normals(n * sizes.latent());
    let x = Tensor::new(&[n, 4, 16, 16], latents.clone());
    for t in [999, 499] {
        let prediction = denoise(&leaves, &sizes, &schedule, &x, t, &condition);
        let inputs: [(&str, &[usize], &[f32]); 2] =
            [("latent", &[n, 4, 16, 16], &latents), ("condition", &[n, 64, 16, 16], condition.values())];
        assert_close(prediction.values(), &run("denoiser", &inputs, Some(t as i32), "prediction"), 1e-5);
    }

    let expected = run("decoder", &[("latent", &[n, 4, 16, 16], &latents)], None, "image");
    assert_close(decode(&leaves, &x).values(), &expected, 1e-5);
}

/// A tiny generator's weights.
fn tiny() -> (Sizes, Params) {
    let start = fixture::start();
    Files::parse(&start.encoder, &start.denoiser, &start.decoder).unwrap().read().unwrap()
}

/// The gradient of a scalar of a network along a random direction in all weights, against differences. Single precision
/// leaves about three digits of a difference.
fn check_gradient(prefix: &str, scalar: impl Fn(&Leaves<'_>) -> Tensor) {
    let (_, params) = tiny();
    let leaves = params.leaves(|_| true);
    let gradients = leaves.gradient(backward(&scalar(&leaves)));
    let mut random = fixture::random(11);
    let direction: Vec<Vec<f32>> = params
        .entries()
        .iter()
        .map(|entry| {
            // What is not a layer's does not learn: no direction there.
            let fixed = ["mean", "std"].iter().any(|fixed| entry.name.strip_prefix(DECODER) == Some(fixed));
            let scale = if entry.name.starts_with(prefix) && !fixed { 0.1 } else { 0.0 };
            random.normals(entry.values.len()).into_iter().map(|v| scale * v).collect()
        })
        .collect();
    let along: f64 = gradients
        .iter()
        .zip(&direction)
        .filter_map(|(g, d)| Some(g.as_ref()?.iter().zip(d).map(|(g, d)| f64::from(g * d)).sum::<f64>()))
        .sum();
    let moved = |step: f32| {
        let mut params = params.clone();
        for (values, direction) in params.values_mut().zip(&direction) {
            let values = Arc::make_mut(values);
            values.iter_mut().zip(direction).for_each(|(value, d)| *value += step * d);
        }
        f64::from(scalar(&params.leaves(|_| false)).values()[0])
    };
    let step = 2e-3;
    // Two distances, extrapolated: the curvature of a network is not small.
    let central = |step: f32| (moved(step) - moved(-step)) / (2.0 * f64::from(step));
    let expected = (4.0 * central(step) - central(2.0 * step)) / 3.0;
    assert!((along - expected).abs() < 5e-3 * expected.abs().max(0.1), "{prefix}: {expected} by differences, {along}");
    for (entry, gradient) in params.entries().iter().zip(&gradients) {
        let used = gradient.as_ref().is_some_and(|g| g.iter().any(|v| *v != 0.0));
        let fixed = ["mean", "std"].iter().any(|fixed| entry.name.strip_prefix(DECODER) == Some(fixed));
        // The tiny denoiser mixes a single token, which reads itself whatever it asks for.
        let idle = fixed || entry.name.starts_with("denoiser/mix.attention.q");
        assert_eq!(used, entry.name.starts_with(prefix) && !idle, "{}", entry.name);
    }
}

/// A network's output as one number, by random weights.
fn probed(output: &Tensor, seed: u64) -> Tensor {
    let count = output.values().len();
    let scale = 1.0 / (count as f32).sqrt();
    let probe = fixture::random(seed).normals(count).into_iter().map(|v| v * scale).collect::<Vec<_>>();
    let (probe, zero) = (Tensor::new(&[count, 1], probe), Tensor::new(&[1], vec![0.0]));
    ops::linear(&output.clone().reshaped(&[1, count]), &probe, &zero, ops::Weights::InOut)
}

#[test]
fn the_gradient_of_each_network_is_that_of_differences() {
    let (sizes, _) = tiny();
    let schedule = Schedule::scaled_linear(1000, 0.0015, 0.0155);
    let (n, cells) = (2, sizes.cells());
    let noise = |seed, count| fixture::random(seed).normals(count);
    let latents = |seed| Tensor::new(&[n, 4, cells, cells], noise(seed, n * sizes.latent()));
    check_gradient(ENCODER, |leaves| probed(&encode(leaves, &sizes, &noise(1, n * sizes.picture())), 5));
    check_gradient(DENOISER, |leaves| {
        let condition = Tensor::new(&[n, 8, cells, cells], noise(3, n * 8 * cells * cells));
        probed(&denoise(leaves, &sizes, &schedule, &latents(2), 499, &condition), 6)
    });
    check_gradient(DECODER, |leaves| probed(&decode(leaves, &latents(4)), 7));
}

#[test]
fn another_architecture_is_refused_by_the_name_of_the_weight() {
    let sizes = fixture::sizes();
    let start = fixture::start();
    let read = |denoiser: &[u8]| Files::parse(&start.encoder, denoiser, &start.decoder).and_then(|files| files.read());
    assert!(read(&start.denoiser).is_ok());

    let with = |change: &dyn Fn(&mut Layout)| {
        let mut layout = Layout::default();
        for (name, shape) in sizes.denoiser_layout().weights() {
            layout.weight(name.clone(), shape);
        }
        change(&mut layout);
        read(&fixture::file(&layout, 2)).unwrap_err().to_string()
    };
    let extra = with(&|layout| layout.weight("m3.conv1.weight", &[8, 8, 3, 3]));
    assert!(extra.contains("denoiser") && extra.contains("m3.conv1.weight"), "{extra}");

    let without = |name: &str| {
        let mut layout = Layout::default();
        for (weight, shape) in sizes.denoiser_layout().weights().iter().filter(|(weight, _)| weight != name) {
            layout.weight(weight.clone(), shape);
        }
        read(&fixture::file(&layout, 2)).unwrap_err().to_string()
    };
    assert!(without("mix.attention.kv.weight").contains("\"mix.attention.kv.weight\" is missing"));
    assert!(without("enter.bias").contains("\"enter.bias\" is missing"));

    let wide = Sizes { condition: 16, ..fixture::sizes() };
    let refusal = read(&fixture::file(&wide.denoiser_layout(), 2)).unwrap_err().to_string();
    assert!(refusal.contains("enter.weight") && refusal.contains("[8, 20, 3, 3]"), "{refusal}");
    // The shipped mask network is no generator.
    let mask = std::fs::read(format!("{BUNDLE}/../mask_unet/mask_unet.onnx")).unwrap();
    assert!(read(&mask).unwrap_err().to_string().contains("denoiser"));
}
