//! What an engine of the app makes of given inputs: for comparison with the network a bundle was exported from.
//!
//! `cargo run --release --no-default-features --features onnx --example graph_outputs -- BUNDLE rten|ort IN.npz OUT.npz SEED`
//! runs every graph of `BUNDLE` for which `IN.npz` holds inputs, arrays named `ROLE.INPUT` (`denoiser.latent`, …), and
//! writes the outputs to `OUT.npz`, each under its role's name. Of a generator it also writes `noise`: the latent that
//! a generation from `SEED` begins with. Prints the seconds to load and to run each graph as one JSON object.

#![allow(clippy::print_stdout, reason = "a command-line tool answers on standard output")]

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use touch2touch_core::diffusion::{GaussianNoise, Tensor};
use touch2touch_work::infer::bundle::{Bundle, Role};
use touch2touch_work::infer::engine::{EngineChoice, Graph, Input, resolve};
use touch2touch_work::io::npz;
use touch2touch_work::io::pt::{Tensor as Array, Values};

/// An input of a graph, in the element types that graphs take.
enum Owned {
    Floats(Tensor),
    Whole(Vec<i64>),
}

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [bundle, engine, input, output, seed] = args.as_slice() else {
        bail!("usage: graph_outputs BUNDLE rten|ort IN.npz OUT.npz SEED");
    };
    let choice: EngineChoice = engine.parse().map_err(anyhow::Error::msg)?;
    let seed: u64 = seed.parse().context("SEED must be a whole number")?;
    let engine = resolve(choice)?;
    let bundle = Bundle::open(&PathBuf::from(bundle))?;
    let mut given: BTreeMap<String, Vec<(String, Owned)>> = BTreeMap::new();
    for (name, array) in npz::read(&PathBuf::from(input))? {
        let (role, port) = name.split_once('.').with_context(|| format!("array \"{name}\" is not named ROLE.INPUT"))?;
        given.entry(role.to_owned()).or_default().push((port.to_owned(), owned(&name, array)?));
    }

    let mut results: Vec<(&str, Array)> = Vec::new();
    let mut seconds = serde_json::Map::new();
    for role in [Role::ConditionEncoder, Role::Denoiser, Role::Decoder, Role::MaskUnet] {
        let (Some(path), Some(inputs)) = (bundle.file(role), given.remove(role.key())) else { continue };
        let inputs: Vec<(&str, Input<'_>)> = inputs
            .iter()
            .map(|(name, value)| match value {
                Owned::Floats(tensor) => (name.as_str(), Input::F32(tensor)),
                Owned::Whole(numbers) => (name.as_str(), Input::I64(numbers)),
            })
            .collect();
        let batch = inputs.iter().find_map(|(_, input)| if let Input::F32(t) = input { Some(t.batch()) } else { None });
        let (port, shape) = promised(&bundle, role)?;
        let shape: Vec<usize> = batch.into_iter().chain(shape).collect();
        let start = Instant::now();
        let mut graph = Graph::load(engine, role, path)?;
        let loaded = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let made = graph.run(&inputs, port, &shape)?;
        let ran = start.elapsed().as_secs_f64();
        seconds.insert(role.key().to_owned(), serde_json::json!({ "load_s": loaded, "run_s": ran }));
        results.push((role.key(), Array { shape, values: Values::F32(made.into_data()) }));
    }
    ensure!(given.is_empty(), "the bundle has no graph for {:?}", given.keys());
    if let Some(spec) = bundle.generator() {
        let shape = spec.latent.shape.to_vec();
        let mut noise = GaussianNoise::new(seed);
        let values = (0..shape.iter().product()).map(|_| noise.draw()).collect();
        results.push(("noise", Array { shape, values: Values::F64(values) }));
    }
    npz::write(&PathBuf::from(output), &results)?;
    println!("{}", serde_json::Value::Object(seconds));
    Ok(())
}

fn owned(name: &str, array: Array) -> Result<Owned> {
    Ok(match array.values {
        Values::F32(values) => Owned::Floats(
            Tensor::new(array.shape, values).with_context(|| format!("array \"{name}\" does not fill its shape"))?,
        ),
        Values::I64(values) => Owned::Whole(values),
        _ => bail!("array \"{name}\" is neither float32 nor int64"),
    })
}

/// The name and shape (without the batch) of a graph's output.
fn promised(bundle: &Bundle, role: Role) -> Result<(&'static str, Vec<usize>)> {
    if let Some(mask) = bundle.mask_unet() {
        return Ok(("logits", vec![mask.output.classes, mask.input.size[1], mask.input.size[0]]));
    }
    let Some(spec) = bundle.generator() else { bail!("only generators and mask UNets can be compared") };
    Ok(match role {
        Role::ConditionEncoder => ("condition", spec.condition.shape.to_vec()),
        Role::Denoiser => ("prediction", spec.latent.shape.to_vec()),
        _ => ("image", vec![spec.output.channels, spec.output.size[1], spec.output.size[0]]),
    })
}
