//! [`Onnx`]: the weights of an ONNX file, found under their layers' names and overwritten in place.
//!
//! An ONNX file is a protobuf message. Only initializers (the weights) and nodes are decoded. An exporter keeps a layer's
//! name where it can and calls the rest `onnx::…`; those get the name of the layer whose node uses them. Files with
//! weights in half precision hold them as `…_f16`, followed by a `Cast`.
//!
//! Tuned weights are written over the old ones, in the precision of the file: no byte else changes, not even the length.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use half::f16;

/// A graph's file with the places of its weights.
#[derive(Clone, Debug)]
pub struct Onnx {
    bytes: Vec<u8>,
    weights: Vec<Weight>,
}

/// A weight: its layer's name, its shape, and where it lies.
#[derive(Clone, Debug)]
pub struct Weight {
    name: String,
    shape: Vec<usize>,
    precision: Precision,
    place: Range<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Precision {
    Half,
    Single,
}

impl Precision {
    fn bytes(self) -> usize {
        match self {
            Precision::Half => 2,
            Precision::Single => 4,
        }
    }
}

impl Weight {
    /// The layer's name and `weight` or `bias`, as in `trunk.1.conv1.weight`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// As stored: a product's is `[in, out]`, that of a `Gemm` node `[out, in]`.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }
}

/// A weight as the file has it.
#[derive(Default)]
struct Initializer {
    name: String,
    dims: Vec<usize>,
    element: u64,
    raw: Option<Range<usize>>,
}

#[derive(Default)]
struct Node {
    inputs: Vec<String>,
    outputs: Vec<String>,
    name: String,
    op: String,
}

type Decoded<T> = Result<T, String>;

impl Onnx {
    /// Decodes a file; each floating-point initializer becomes a weight.
    ///
    /// # Errors
    /// Fault of the file, in words for a reader.
    pub fn parse(bytes: Vec<u8>) -> Result<Self, String> {
        let mut initializers = Vec::new();
        let mut nodes = Vec::new();
        // ModelProto: 7 = graph. GraphProto: 1 = node, 5 = initializer.
        for (number, graph) in fields(&bytes, 0..bytes.len())? {
            let (7, Value::Message(graph)) = (number, graph) else { continue };
            for (number, value) in fields(&bytes, graph)? {
                match (number, value) {
                    (1, Value::Message(range)) => nodes.push(node(&bytes, range)?),
                    (5, Value::Message(range)) => initializers.push(initializer(&bytes, range)?),
                    _ => {}
                }
            }
        }
        let names = layer_names(&initializers, &nodes);
        let weights: Vec<Weight> = initializers
            .into_iter()
            .filter_map(|initializer| weight(initializer, &names).transpose())
            .collect::<Decoded<_>>()?;
        let mut seen = BTreeSet::new();
        match weights.iter().find(|weight| !seen.insert(weight.name.clone())) {
            Some(twice) => Err(format!("two weights are called \"{}\"", twice.name)),
            None => Ok(Self { bytes, weights }),
        }
    }

    /// The weights in the order of the file.
    pub fn weights(&self) -> &[Weight] {
        &self.weights
    }

    /// The values of a weight of this file.
    pub fn values(&self, weight: &Weight) -> Vec<f32> {
        let raw = &self.bytes[weight.place.clone()];
        match weight.precision {
            Precision::Half => raw.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32()).collect(),
            Precision::Single => raw.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect(),
        }
    }

    /// The file with other values for its weights; `values` is asked for each weight by its name and must have as many
    /// values as the weight.
    pub fn with(&self, values: impl Fn(&str) -> Vec<f32>) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        for weight in &self.weights {
            let (to, from) = (&mut bytes[weight.place.clone()], values(&weight.name));
            assert_eq!(to.len(), from.len() * weight.precision.bytes(), "{}: as many values as before", weight.name);
            match weight.precision {
                Precision::Half => {
                    for (to, value) in to.chunks_exact_mut(2).zip(from) {
                        to.copy_from_slice(&f16::from_f32(value).to_le_bytes());
                    }
                }
                Precision::Single => {
                    for (to, value) in to.chunks_exact_mut(4).zip(from) {
                        to.copy_from_slice(&value.to_le_bytes());
                    }
                }
            }
        }
        bytes
    }
}

/// The weight that an initializer is; `None` for whole numbers (shapes, indices).
fn weight(initializer: Initializer, names: &BTreeMap<String, String>) -> Decoded<Option<Weight>> {
    let precision = match initializer.element {
        1 => Precision::Single,
        10 => Precision::Half,
        _ => return Ok(None),
    };
    let Initializer { name, dims, raw, .. } = initializer;
    let name = names.get(&name).cloned().unwrap_or(name);
    let place = raw.ok_or_else(|| format!("the weight \"{name}\" does not lie in the file as raw data"))?;
    let values = dims.iter().try_fold(1usize, |product, &dim| product.checked_mul(dim));
    if values.and_then(|n| n.checked_mul(precision.bytes())) != Some(place.len()) {
        return Err(format!("the weight \"{name}\" of shape {dims:?} has {} bytes", place.len()));
    }
    Ok(Some(Weight { name, shape: dims, precision, place }))
}

/// The names of layers by the names of their initializers.
fn layer_names(initializers: &[Initializer], nodes: &[Node]) -> BTreeMap<String, String> {
    // A value that is an initializer, or one after a cast.
    let mut source: BTreeMap<&str, &str> = initializers.iter().map(|i| (i.name.as_str(), i.name.as_str())).collect();
    for node in nodes.iter().filter(|node| node.op == "Cast") {
        if let (Some(input), Some(output)) = (node.inputs.first(), node.outputs.first())
            && let Some(&initializer) = source.get(input.as_str())
        {
            source.insert(output, initializer);
        }
    }
    let anonymous = |value: &str| value.starts_with("onnx::");
    let mut names: BTreeMap<String, String> = BTreeMap::new();
    for (value, initializer) in &source {
        if value != initializer && !anonymous(value) {
            names.insert((*initializer).to_owned(), (*value).to_owned());
        }
    }
    for node in nodes {
        for (place, value) in node.inputs.iter().enumerate().filter(|(_, value)| anonymous(value)) {
            let kind = match (node.op.as_str(), place) {
                ("MatMul" | "Mul", _) | ("Conv", 1) => "weight",
                ("Add", _) | ("Conv", 2) => "bias",
                _ => continue,
            };
            if let Some(&initializer) = source.get(value.as_str()) {
                names.insert(initializer.to_owned(), format!("{}.{kind}", layer(&node.name)));
            }
        }
    }
    names
}

/// The layer of a node: `/mix.0/mlp/mlp.2/MatMul` is `mix.0.mlp.2`, since the children of a sequence repeat its name.
fn layer(node: &str) -> String {
    let mut parts: Vec<&str> = node.trim_matches('/').split('/').collect();
    parts.pop();
    let repeated = |i: usize| {
        parts.get(i + 1).and_then(|next| next.strip_prefix(parts[i])).is_some_and(|rest| rest.starts_with('.'))
    };
    let kept: Vec<&str> = (0..parts.len()).filter(|&i| !repeated(i)).map(|i| parts[i]).collect();
    kept.join(".")
}

/// NodeProto: 1 = input, 2 = output, 3 = name, 4 = `op_type`.
fn node(bytes: &[u8], range: Range<usize>) -> Decoded<Node> {
    let mut node = Node::default();
    for (number, value) in fields(bytes, range)? {
        let Value::Message(range) = value else { continue };
        let text = || String::from_utf8_lossy(&bytes[range.clone()]).into_owned();
        match number {
            1 => node.inputs.push(text()),
            2 => node.outputs.push(text()),
            3 => node.name = text(),
            4 => node.op = text(),
            _ => {}
        }
    }
    Ok(node)
}

/// TensorProto: 1 = dims, 2 = `data_type`, 8 = name, 9 = `raw_data`.
fn initializer(bytes: &[u8], range: Range<usize>) -> Decoded<Initializer> {
    let mut initializer = Initializer::default();
    for (number, value) in fields(bytes, range)? {
        match (number, value) {
            (1, Value::Number(dim)) => initializer.dims.push(size(dim)?),
            (1, Value::Message(packed)) => {
                let mut position = packed.start;
                while position < packed.end {
                    initializer.dims.push(size(varint(bytes, &mut position, packed.end)?)?);
                }
            }
            (2, Value::Number(element)) => initializer.element = element,
            (8, Value::Message(range)) => initializer.name = String::from_utf8_lossy(&bytes[range]).into_owned(),
            (9, Value::Message(range)) => initializer.raw = Some(range),
            _ => {}
        }
    }
    Ok(initializer)
}

fn size(number: u64) -> Decoded<usize> {
    usize::try_from(number).map_err(|_| "a shape is too large".to_owned())
}

enum Value {
    Number(u64),
    Message(Range<usize>),
    Fixed,
}

/// The fields of the message that lies at a place: their numbers and values.
fn fields(bytes: &[u8], range: Range<usize>) -> Decoded<Vec<(u64, Value)>> {
    let Range { start: mut here, end } = range;
    let mut fields = Vec::new();
    while here < end {
        let key = varint(bytes, &mut here, end)?;
        let value = match key & 7 {
            0 => Value::Number(varint(bytes, &mut here, end)?),
            1 => skip(&mut here, 8, end).map(|_| Value::Fixed)?,
            2 => {
                let length = varint(bytes, &mut here, end)?;
                Value::Message(skip(&mut here, usize::try_from(length).unwrap_or(usize::MAX), end)?)
            }
            5 => skip(&mut here, 4, end).map(|_| Value::Fixed)?,
            _ => return Err("unknown wire type".to_owned()),
        };
        fields.push((key >> 3, value));
    }
    Ok(fields)
}

fn skip(here: &mut usize, length: usize, end: usize) -> Decoded<Range<usize>> {
    let start = *here;
    if length > end - start {
        return Err("it ends too early".to_owned());
    }
    *here += length;
    Ok(start..*here)
}

fn varint(bytes: &[u8], here: &mut usize, end: usize) -> Decoded<u64> {
    let mut value = 0u64;
    for shift in (0..64).step_by(7) {
        let byte = bytes[skip(here, 1, end)?][0];
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Ok(value);
        }
    }
    Err("a number is too long".to_owned())
}

#[cfg(test)]
mod tests;
