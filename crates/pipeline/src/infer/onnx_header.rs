//! Reads the interface of an ONNX file (its inputs and outputs) without an engine.
//!
//! An ONNX file is a protobuf message. Only the few fields needed are decoded, the weights are skipped, and any
//! malformed byte is an error. Field numbers are those of the public `onnx.proto`.

use std::collections::BTreeSet;

/// The interface of a graph.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Header {
    pub(crate) inputs: Vec<Port>,
    pub(crate) outputs: Vec<Port>,
    /// True where weights lie in another file.
    pub(crate) external_data: bool,
}

/// A named input or output.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Port {
    pub(crate) name: String,
    /// ONNX's element type: 1 = float32, 7 = int64, 0 = not a tensor.
    pub(crate) element: u64,
    /// `None` for a dynamic axis; the whole is `None` if the file states no shape.
    pub(crate) shape: Option<Vec<Option<u64>>>,
}

/// ONNX's number for float32.
pub(crate) const FLOAT32: u64 = 1;
/// ONNX's number for int64.
pub(crate) const INT64: u64 = 7;

/// Reason why decoding stopped.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not an ONNX file: {0}")]
pub(crate) struct HeaderError(&'static str);

/// Most inputs or outputs of a file: old files list their weights among the inputs, some thousand of them.
const MAX_PORTS: usize = 10_000;
/// Most axes of a tensor; no engine takes more than a few.
const MAX_AXES: usize = 64;

/// Decodes the interface of the ONNX file in `bytes`. Takes memory for the ports alone, however long the file is.
pub(crate) fn read(bytes: &[u8]) -> Result<Header, HeaderError> {
    let mut graph = None;
    for field in fields(bytes) {
        let field = field?;
        if field.number == 7 && graph.is_none() {
            graph = Some(field.value.message()?); // ModelProto.graph
        }
    }
    let graph = graph.ok_or(HeaderError("it holds no graph"))?;
    let mut header = Header::default();
    for field in fields(graph) {
        let field = field?;
        match field.number {
            11 | 12 => {
                let ports = if field.number == 11 { &mut header.inputs } else { &mut header.outputs };
                if ports.len() == MAX_PORTS {
                    return Err(HeaderError("it has too many inputs or outputs"));
                }
                ports.push(port(field.value.message()?)?);
            }
            _ => {}
        }
    }
    // Old files list their weights among the inputs.
    let names: BTreeSet<&str> = header.inputs.iter().map(|input| input.name.as_str()).collect();
    let mut weights = BTreeSet::new();
    for field in fields(graph) {
        let field = field?;
        if field.number != 5 {
            continue;
        }
        // TensorProto: 8 = name, 14 = data_location (1 = external).
        for part in fields(field.value.message()?) {
            let part = part?;
            match part.number {
                8 => {
                    let name = String::from_utf8_lossy(part.value.message()?);
                    weights.extend(names.get(&*name).map(|name| (*name).to_owned()));
                }
                14 => header.external_data |= matches!(part.value, Value::Number(1)),
                _ => {}
            }
        }
    }
    header.inputs.retain(|input| !weights.contains(&input.name));
    Ok(header)
}

/// ValueInfoProto: 1 = name, 2 = type { 1 = tensor_type { 1 = elem_type, 2 = shape { 1 = dim { 1 = value } } } }.
fn port(bytes: &[u8]) -> Result<Port, HeaderError> {
    let mut port = Port::default();
    for field in fields(bytes) {
        let field = field?;
        match field.number {
            1 => port.name = text(field.value)?,
            2 => {
                for kind in fields(field.value.message()?) {
                    let kind = kind?;
                    if kind.number != 1 {
                        continue;
                    }
                    for part in fields(kind.value.message()?) {
                        let part = part?;
                        match part.number {
                            1 => port.element = part.value.number()?,
                            2 => port.shape = Some(shape(part.value.message()?)?),
                            _ => {}
                        }
                    }
                }
            }
            _ => {}
        }
    }
    Ok(port)
}

fn shape(bytes: &[u8]) -> Result<Vec<Option<u64>>, HeaderError> {
    let mut dims = Vec::new();
    for dim in fields(bytes) {
        let dim = dim?;
        if dim.number != 1 {
            continue;
        }
        if dims.len() == MAX_AXES {
            return Err(HeaderError("a tensor has too many axes"));
        }
        let size = find(dim.value.message()?, 1)?.map(|size| size.number()).transpose()?;
        // Some exporters write 0 or -1 for a dynamic axis.
        dims.push(size.filter(|&n| n > 0 && n <= i64::MAX as u64));
    }
    Ok(dims)
}

fn text(value: Value<'_>) -> Result<String, HeaderError> {
    Ok(String::from_utf8_lossy(value.message()?).into_owned())
}

struct Field<'a> {
    number: u64,
    value: Value<'a>,
}

enum Value<'a> {
    Number(u64),
    Bytes(&'a [u8]),
    Fixed,
}

impl<'a> Value<'a> {
    fn message(&self) -> Result<&'a [u8], HeaderError> {
        match self {
            Value::Bytes(bytes) => Ok(bytes),
            _ => Err(HeaderError("a message was expected where a number stands")),
        }
    }

    fn number(&self) -> Result<u64, HeaderError> {
        match self {
            Value::Number(n) => Ok(*n),
            _ => Err(HeaderError("a number was expected where a message stands")),
        }
    }
}

/// The fields of a protobuf message, one after the other, without copying; nothing follows an error.
fn fields(mut bytes: &[u8]) -> impl Iterator<Item = Result<Field<'_>, HeaderError>> {
    std::iter::from_fn(move || {
        let field = (!bytes.is_empty()).then(|| field(&mut bytes))?;
        if field.is_err() {
            bytes = &[];
        }
        Some(field)
    })
}

/// The first field with this number.
fn find(bytes: &[u8], number: u64) -> Result<Option<Value<'_>>, HeaderError> {
    for field in fields(bytes) {
        let field = field?;
        if field.number == number {
            return Ok(Some(field.value));
        }
    }
    Ok(None)
}

fn field<'a>(bytes: &mut &'a [u8]) -> Result<Field<'a>, HeaderError> {
    let key = varint(bytes)?;
    let value = match key & 7 {
        0 => Value::Number(varint(bytes)?),
        1 => take(bytes, 8).map(|_| Value::Fixed)?,
        2 => {
            let len = varint(bytes)?;
            Value::Bytes(take(bytes, usize::try_from(len).unwrap_or(usize::MAX))?)
        }
        5 => take(bytes, 4).map(|_| Value::Fixed)?,
        _ => return Err(HeaderError("unknown wire type")),
    };
    Ok(Field { number: key >> 3, value })
}

fn take<'a>(bytes: &mut &'a [u8], len: usize) -> Result<&'a [u8], HeaderError> {
    let (head, tail) = bytes.split_at_checked(len).ok_or(HeaderError("it ends too early"))?;
    *bytes = tail;
    Ok(head)
}

fn varint(bytes: &mut &[u8]) -> Result<u64, HeaderError> {
    let mut value = 0u64;
    for shift in (0..64).step_by(7) {
        let byte = take(bytes, 1)?[0];
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Ok(value);
        }
    }
    Err(HeaderError("a number is too long"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DENOISER: &[u8] = include_bytes!("../../../../tests/data/bundles/generator/denoiser.onnx");

    #[test]
    fn the_interface_of_a_graph_is_read() {
        let header = read(DENOISER).unwrap();
        let names: Vec<&str> = header.inputs.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["latent", "timestep", "condition"]);
        assert_eq!(header.inputs[0].shape, Some(vec![None, Some(4), Some(4), Some(4)]));
        assert_eq!((header.inputs[0].element, header.inputs[1].element), (FLOAT32, INT64));
        assert_eq!(header.outputs[0].name, "prediction");
        assert!(!header.external_data);
    }

    /// A message within another: the field's key, its length, its bytes.
    fn within(number: u8, message: &[u8]) -> Vec<u8> {
        let mut out = vec![number << 3 | 2];
        let mut len = message.len();
        while len > 0x7f {
            out.push(len as u8 | 0x80);
            len >>= 7;
        }
        out.push(len as u8);
        out.extend_from_slice(message);
        out
    }

    /// Files that are short on the disk and would be long in memory, or long to compare.
    #[test]
    fn ports_and_axes_are_counted_before_they_are_kept() {
        let ports = |count: usize| within(7, &within(11, &[]).repeat(count));
        assert_eq!(read(&ports(MAX_PORTS)).unwrap().inputs.len(), MAX_PORTS);
        assert!(read(&ports(MAX_PORTS + 1)).unwrap_err().to_string().contains("too many inputs"));
        let axes = |count: usize| {
            let shape = within(1, &[]).repeat(count);
            within(7, &within(12, &within(2, &within(1, &within(2, &shape)))))
        };
        assert_eq!(read(&axes(MAX_AXES)).unwrap().outputs[0].shape, Some(vec![None; MAX_AXES]));
        assert!(read(&axes(MAX_AXES + 1)).is_err());
        // A million weights cost no more than the inputs they are compared with.
        let mut graph = within(5, &within(8, b"w")).repeat(1_000_000);
        graph.extend([within(11, &within(1, b"w")), within(11, &within(1, b"x"))].concat());
        let inputs = read(&within(7, &graph)).unwrap().inputs;
        assert_eq!(inputs.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["x"]);
    }
}
