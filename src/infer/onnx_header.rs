//! Reads the interface of an ONNX file (its inputs and outputs) without an engine.
//!
//! An ONNX file is a protobuf message. Only the few fields needed are decoded, the weights are skipped, and any
//! malformed byte is an error. Field numbers are those of the public `onnx.proto`.

/// The interface of a graph.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Header {
    pub(crate) inputs: Vec<Port>,
    pub(crate) outputs: Vec<Port>,
    /// Whether weights lie in another file.
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

/// Where and why decoding stopped.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not an ONNX file: {0}")]
pub(crate) struct HeaderError(&'static str);

/// Decodes the interface of the ONNX file in `bytes`.
pub(crate) fn read(bytes: &[u8]) -> Result<Header, HeaderError> {
    let graph = fields(bytes)?
        .into_iter()
        .find_map(|f| (f.number == 7).then_some(f.value)) // ModelProto.graph
        .ok_or(HeaderError("it holds no graph"))?;
    let mut header = Header::default();
    let mut initializers = Vec::new();
    for field in fields(graph.message()?)? {
        match field.number {
            5 => {
                // TensorProto: 8 = name, 14 = data_location (1 = external).
                for part in fields(field.value.message()?)? {
                    match part.number {
                        8 => initializers.push(text(part.value)?),
                        14 => header.external_data |= matches!(part.value, Value::Number(1)),
                        _ => {}
                    }
                }
            }
            11 => header.inputs.push(port(field.value.message()?)?),
            12 => header.outputs.push(port(field.value.message()?)?),
            _ => {}
        }
    }
    // Old files list their weights among the inputs.
    header.inputs.retain(|input| !initializers.contains(&input.name));
    Ok(header)
}

/// ValueInfoProto: 1 = name, 2 = type { 1 = tensor_type { 1 = elem_type, 2 = shape { 1 = dim { 1 = value } } } }.
fn port(bytes: &[u8]) -> Result<Port, HeaderError> {
    let mut port = Port::default();
    for field in fields(bytes)? {
        match field.number {
            1 => port.name = text(field.value)?,
            2 => {
                for kind in fields(field.value.message()?)?.into_iter().filter(|f| f.number == 1) {
                    for part in fields(kind.value.message()?)? {
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
    let dims = fields(bytes)?.into_iter().filter(|f| f.number == 1);
    dims.map(|dim| {
        let size = fields(dim.value.message()?)?.into_iter().find(|f| f.number == 1);
        let size = size.map(|f| f.value.number()).transpose()?;
        // Some exporters write 0 or -1 for a dynamic axis.
        Ok(size.filter(|&n| n > 0 && n <= i64::MAX as u64))
    })
    .collect()
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

/// Splits a protobuf message into its fields, without copying.
fn fields(mut bytes: &[u8]) -> Result<Vec<Field<'_>>, HeaderError> {
    let mut found = Vec::new();
    while !bytes.is_empty() {
        let key = varint(&mut bytes)?;
        let value = match key & 7 {
            0 => Value::Number(varint(&mut bytes)?),
            1 => take(&mut bytes, 8).map(|_| Value::Fixed)?,
            2 => {
                let len = varint(&mut bytes)?;
                Value::Bytes(take(&mut bytes, usize::try_from(len).unwrap_or(usize::MAX))?)
            }
            5 => take(&mut bytes, 4).map(|_| Value::Fixed)?,
            _ => return Err(HeaderError("unknown wire type")),
        };
        found.push(Field { number: key >> 3, value });
    }
    Ok(found)
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

    const DENOISER: &[u8] = include_bytes!("../../tests/data/bundles/generator/denoiser.onnx");

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

    #[test]
    fn damaged_files_are_errors_and_never_panics() {
        assert!(read(b"").is_err());
        assert!(read(b"{\"format\": 1}").is_err());
        assert!(read(&[0xff; 64]).is_err());
        for cut in 0..DENOISER.len() {
            // A cut may still leave a readable beginning; it must only never panic.
            drop(read(&DENOISER[..cut]));
            let mut changed = DENOISER.to_vec();
            changed[cut] ^= 0x55;
            drop(read(&changed));
        }
    }
}
