//! Compares a graph's inputs and outputs with what the manifest promises.

use super::manifest::{BundleSpec, ClassifierSpec, GeneratorSpec, MaskSpec, TimestepType};
use super::{Problems, Role};
use crate::infer::onnx_header::{self, FLOAT32, INT64, Port};

/// A tensor the manifest promises: its name, element types, and shape after the batch.
pub(in crate::infer) struct Promise {
    pub(in crate::infer) name: String,
    elements: &'static [u64],
    pub(in crate::infer) shape: Vec<usize>,
}

fn float(name: &str, shape: impl Into<Vec<usize>>) -> Promise {
    Promise { name: name.to_owned(), elements: &[FLOAT32], shape: shape.into() }
}

/// Adds everything in which the graph differs from the manifest, and notes the timestep's type in `spec`.
pub(super) fn check(role: Role, bytes: &[u8], spec: &mut BundleSpec, problems: &mut Problems) {
    let header = match onnx_header::read(bytes) {
        Ok(header) => header,
        Err(err) => {
            problems.add(err.to_string(), "export the graph again, or copy the bundle again");
            return;
        }
    };
    if header.external_data {
        problems.add("its weights lie in another file", "export the graph as one file");
    }
    let Some((inputs, outputs)) = promised(role, spec) else {
        return; // A file that is not part of this kind of bundle: the manifest's check says so.
    };
    for (ports, promises, what) in [(&header.inputs, &inputs, "input"), (&header.outputs, &outputs, "output")] {
        for promise in promises {
            match ports.iter().find(|port| port.name == promise.name) {
                Some(port) => compare(port, promise, what, problems),
                None => {
                    let names: Vec<&str> = ports.iter().map(|p| p.name.as_str()).collect();
                    problems.add(
                        format!("no {what} named `{}`, only {names:?}", promise.name),
                        "export the graph with the names of the manifest's documentation",
                    );
                }
            }
        }
    }
    for port in header.inputs.iter().filter(|port| inputs.iter().all(|promise| promise.name != port.name)) {
        problems.add(format!("an input `{}` that nothing is given to", port.name), "export the graph without it");
    }
    if let BundleSpec::Generator(generator) = spec
        && header.inputs.iter().any(|port| port.name == "timestep" && port.element == FLOAT32)
    {
        generator.timestep = TimestepType::Float32;
    }
}

/// The inputs and outputs of a graph; `None` if this kind of bundle has no such graph.
pub(in crate::infer) fn promised(role: Role, spec: &BundleSpec) -> Option<(Vec<Promise>, Vec<Promise>)> {
    match (role, spec) {
        (Role::MaskUnet, BundleSpec::MaskUnet(MaskSpec { input, output })) => {
            let [width, height] = input.size;
            Some((vec![float("imprint", [1, height, width])], vec![float("logits", [output.classes, height, width])]))
        }
        (Role::ToolClassifier, BundleSpec::ToolClassifier(ClassifierSpec { input, output })) => {
            let [width, height] = input.size;
            let outputs = std::iter::once(float("logits", [output.classes.len()]))
                .chain(output.features.map(|n| float("features", [n])))
                .collect();
            Some((vec![float("imprint", [1, height, width])], outputs))
        }
        (_, BundleSpec::Generator(spec)) => {
            let GeneratorSpec { input, condition, latent, output, .. } = &**spec;
            let [width, height] = input.size;
            let latent = || float("latent", latent.shape);
            match role {
                Role::ConditionEncoder => Some((
                    vec![float(&input.sensor.key, [input.channels(), height, width])],
                    vec![float("condition", condition.shape)],
                )),
                Role::Denoiser => {
                    let timestep = Promise { name: "timestep".to_owned(), elements: &[INT64, FLOAT32], shape: vec![] };
                    let inputs = vec![latent(), timestep, float("condition", condition.shape)];
                    Some((inputs, vec![Promise { name: "prediction".to_owned(), ..latent() }]))
                }
                Role::Decoder => {
                    let [width, height] = output.size;
                    Some((vec![latent()], vec![float("image", [output.channels, height, width])]))
                }
                Role::MaskUnet | Role::ToolClassifier => None,
            }
        }
        _ => None,
    }
}

fn compare(port: &Port, promise: &Promise, what: &str, problems: &mut Problems) {
    let name = &promise.name;
    if !promise.elements.contains(&port.element) {
        let expected = if promise.elements.contains(&INT64) { "int64 or float32" } else { "float32" };
        let found = port.element;
        problems.add(
            format!("{what} `{name}`: element type {found} instead of {expected}"),
            "export the graph in 32-bit floating point",
        );
    }
    // A graph may leave an output's shape open; it is then checked when it runs.
    let Some(shape) = &port.shape else { return };
    let text = |dims: &mut dyn Iterator<Item = Option<u64>>| {
        let dims: Vec<String> = dims.map(|d| d.map_or("N".into(), |d| d.to_string())).collect();
        format!("[{}]", dims.join(", "))
    };
    let expected: Vec<Option<u64>> =
        std::iter::once(None).chain(promise.shape.iter().map(|&d| Some(d as u64))).collect();
    let agrees = shape.len() == expected.len()
        && shape.iter().zip(&expected).skip(1).all(|(found, expected)| found.is_none() || found == expected);
    if !agrees {
        let (found, expected) = (text(&mut shape.iter().copied()), text(&mut expected.iter().copied()));
        problems.add(
            format!("{what} `{name}`: shape {found}, but the manifest says {expected}"),
            "correct the manifest, or use the graph that belongs to it",
        );
    }
    if let Some(Some(batch)) = shape.first() {
        problems.add(
            format!("{what} `{name}`: the batch is fixed to {batch}"),
            "export the graph with a dynamic first axis",
        );
    }
}
