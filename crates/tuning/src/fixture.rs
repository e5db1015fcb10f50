//! Fixtures that tests share: a tiny generator with random weights, and touches with a known placement.

use crate::augment::Augment;
use crate::config::Config;
use crate::image;
use crate::nets::Layout;
use crate::nets::generator::Sizes;
use crate::pair::Pair;
use crate::random::{Purpose, Random};
use crate::trainer::Descent;
use crate::tuner::{NoiseSchedule, Placement, Sampler, Start};

/// The generator that the program comes with.
pub(crate) const BUNDLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/models/generator_ldm");

pub(crate) fn random(seed: u64) -> Random {
    Random::new(seed, Purpose::Variation, 0, 0)
}

/// The smallest sizes that norms and heads allow.
pub(crate) fn sizes() -> Sizes {
    Sizes {
        side: 32,
        trunk: [8, 8, 40],
        condition: 8,
        levels: [8, 8, 40],
        time: [8, 8],
        decoder: [8, 8, 8, 8],
        mean: vec![1, 4, 1, 1],
        deviation: vec![1, 4, 1, 1],
    }
}

/// A graph of the generator that the program comes with.
pub(crate) fn shipped(name: &str) -> Vec<u8> {
    std::fs::read(format!("{BUNDLE}/{name}.onnx")).unwrap()
}

/// A protobuf field that holds bytes.
pub(crate) fn field(number: u64, bytes: &[u8]) -> Vec<u8> {
    [varint(number << 3 | 2), varint(bytes.len() as u64), bytes.to_vec()].concat()
}

fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number > 0x7f {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

/// A weight as an ONNX file holds it.
pub(crate) fn initializer(name: &str, shape: &[usize], values: &[f32]) -> Vec<u8> {
    let dims = shape.iter().flat_map(|&dim| [varint(1 << 3), varint(dim as u64)].concat());
    let raw: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    let single = [varint(2 << 3), varint(1)].concat();
    [dims.collect(), single, field(8, name.as_bytes()), field(9, &raw)].concat()
}

/// A file with nothing in it but weights.
pub(crate) fn file(layout: &Layout, seed: u64) -> Vec<u8> {
    let mut random = random(seed);
    let weights = layout.weights().iter().map(|(name, shape)| {
        let count: usize = shape.iter().product();
        let fan: usize = shape[1..].iter().product();
        let scale_of_norm =
            name.contains("norm") || name == "std" || name.contains("trunk.6") || name.contains("decoder.10");
        let value = |normal: f32| match name.as_str() {
            _ if scale_of_norm && !name.ends_with("bias") => 1.0 + 0.2 * normal,
            _ if shape.len() > 1 && !name.ends_with("bias") => normal / (fan as f32).sqrt().max(1.0),
            _ => 0.2 * normal,
        };
        let values: Vec<f32> = random.normals(count).into_iter().map(value).collect();
        field(5, &initializer(name, shape, &values))
    });
    field(7, &weights.collect::<Vec<_>>().concat())
}

/// A tiny bundle with random weights and two pads.
pub(crate) fn start() -> Start {
    let sizes = sizes();
    Start {
        encoder: file(&sizes.encoder_layout(), 1),
        denoiser: file(&sizes.denoiser_layout(), 2),
        decoder: file(&sizes.decoder_layout(), 3),
        schedule: NoiseSchedule { steps: 1000, beta_start: 0.0015, beta_end: 0.0155 },
        sampler: Sampler { steps: 2, eta: 1.0, seed: 42 },
        mean: [0.01, -0.02, 0.0],
        std: [0.5, 0.7, 0.6],
        range_m: [-0.02, 0.03],
        unit_m: [-0.006, 0.018],
        placement: identity(2, sizes.side),
    }
}

/// A run to its end, and its losses.
pub(crate) fn run<T: Descent>(mut tuner: T) -> (T, Vec<f32>) {
    let mut losses = Vec::new();
    while tuner.steps_done() < tuner.steps() {
        losses.push(tuner.step().unwrap().loss);
    }
    (tuner, losses)
}

/// Everything as the decoder draws it.
pub(crate) fn identity(pads: usize, side: usize) -> Placement {
    Placement { line: [1.0, 0.0], shift: vec![[0.0; 2]; pads], field: vec![vec![0.0; side * side]; pads] }
}

/// No variation at all.
pub(crate) fn unvaried() -> Augment {
    Augment { shift: 0.0, colors: 0.0, gain: 0.0, blur: 0.0, noise: 0.0, clipped: 0.0, ..Augment::default() }
}

/// A short plan without variations, whose rates suit a tiny network.
pub(crate) fn config() -> Config {
    Config {
        steps: 8,
        batch: 4,
        augment: unvaried(),
        threads: Some(2),
        anchor: 0.0,
        simulated: 0.0,
        ..Config::default()
    }
}

/// Pictures with bumps in random places; the imprint of each is a smooth function of the picture. The last third are
/// simulated pairs.
pub(crate) fn pairs(count: usize) -> Vec<Pair> {
    let side = sizes().side;
    let mut random = random(7);
    let make = |i: usize| {
        let picture: Vec<f32> = (0..3).flat_map(|_| image::blurred(&random.normals(side * side), side, 1.5)).collect();
        let imprint = image::blurred(&picture[..side * side], side, 2.0).iter().map(|v| 0.3 + 0.5 * v).collect();
        let frame = if 3 * i >= 2 * count { None } else { Some(i % 2) };
        Pair { picture, imprint, frame }
    };
    (0..count).map(make).collect()
}
