//! PyTorch's `.pt` files: a zip with a pickled dict and raw storages.
//!
//! Reading goes through the crate `pytorch-reader` and touches only the tensors that are asked for; what the file would
//! cost is checked before (the submodule `budget`). [`write_dict`] is a small writer of the same container that
//! `torch.load(weights_only=True)` accepts.

mod budget;
mod error;
mod rows;
mod write;

use std::io::{Read as _, Seek as _};
use std::path::{Path, PathBuf};

use pytorch_reader::{DType, PickleValue, PytorchError, PytorchReader};

pub use error::PtError;
pub(crate) use rows::Rows;
pub use write::{PtItem, write_dict};

use super::files::{self, clip};

/// The values of a tensor, row-major, in the element type of the file where a type for it exists here.
///
/// Half precision is widened to `F32`; every integer type except `u8` to `I64`; `bool` is `U8` with 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// 32-bit floats.
    F32(Vec<f32>),
    /// 64-bit floats.
    F64(Vec<f64>),
    /// Bytes.
    U8(Vec<u8>),
    /// Integers.
    I64(Vec<i64>),
}

/// A dense tensor in row-major order.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Extents, outermost first; empty for a single number.
    pub shape: Vec<usize>,
    /// As many values as the product of the extents.
    pub values: Values,
}

impl Tensor {
    /// 32-bit floats of the given shape.
    pub fn f32(shape: &[usize], values: Vec<f32>) -> Self {
        Self { shape: shape.to_vec(), values: Values::F32(values) }
    }

    /// 64-bit floats of the given shape.
    pub fn f64(shape: &[usize], values: Vec<f64>) -> Self {
        Self { shape: shape.to_vec(), values: Values::F64(values) }
    }

    /// Bytes of the given shape.
    pub fn u8(shape: &[usize], values: Vec<u8>) -> Self {
        Self { shape: shape.to_vec(), values: Values::U8(values) }
    }

    /// The values as 32-bit floats; 64-bit floats and integers are rounded.
    pub fn into_f32(self) -> Vec<f32> {
        match self.values {
            Values::F32(v) => v,
            Values::F64(v) => v.into_iter().map(|x| x as f32).collect(),
            Values::U8(v) => v.into_iter().map(f32::from).collect(),
            Values::I64(v) => v.into_iter().map(|x| x as f32).collect(),
        }
    }

    /// The values as 64-bit floats.
    pub fn into_f64(self) -> Vec<f64> {
        match self.values {
            Values::F32(v) => v.into_iter().map(f64::from).collect(),
            Values::F64(v) => v,
            Values::U8(v) => v.into_iter().map(f64::from).collect(),
            Values::I64(v) => v.into_iter().map(|x| x as f64).collect(),
        }
    }
}

/// An opened `.pt` file: its keys and shapes. Values are read key by key.
#[derive(Debug)]
pub struct PtDict {
    file: PathBuf,
    reader: PytorchReader,
}

/// Opens `path` and reads the names and shapes of its tensors, not their values.
///
/// # Errors
/// [`PtError`] if the file cannot be read, is cut off, or does not hold a dict.
pub fn read_dict(path: &Path) -> Result<PtDict, PtError> {
    let io = |source| PtError::Io { file: path.to_owned(), what: "cannot open the file", source };
    let not_a_dict = |reason: String| PtError::NotADict { file: path.to_owned(), reason };
    let damaged = |reason: String| PtError::Damaged { file: path.to_owned(), reason };
    let mut head = [0u8; 2];
    let mut file = match files::open(path) {
        Err(err) if err.kind() == std::io::ErrorKind::IsADirectory => return Err(not_a_dict("it is a folder".into())),
        other => other.map_err(io)?,
    };
    if file.metadata().map_err(io)?.len() == 0 {
        return Err(damaged("the file is empty".into()));
    }
    let is_zip = file.read_exact(&mut head).is_ok() && &head == b"PK";
    file.rewind().map_err(io)?;
    budget::check(file).map_err(|reason| PtError::TooLarge { file: path.to_owned(), reason })?;
    match PytorchReader::new(path) {
        Ok(reader) => Ok(PtDict { file: path.to_owned(), reader }),
        Err(PytorchError::Zip(err)) if is_zip => Err(damaged(clip(&err.to_string()))),
        Err(PytorchError::Io(err)) if is_zip => Err(damaged(clip(&err.to_string()))),
        Err(err) => {
            let reason = clip(&err.to_string());
            Err(not_a_dict(if is_zip { reason } else { format!("no zip archive; {reason}") }))
        }
    }
}

/// Most values of a tensor: a hundred times those of a touch.
const MAX_VALUES: usize = 1 << 24;

impl PtDict {
    /// The file it was read from.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The tensors' keys, sorted.
    pub fn keys(&self) -> Vec<String> {
        let mut keys = self.reader.keys();
        keys.sort();
        keys
    }

    /// The keys, among these, whose values are stored as bfloat16, which has three digits.
    pub(crate) fn coarse<'a>(&self, keys: &[&'a str]) -> Vec<&'a str> {
        let coarse = |key: &&str| self.reader.get(key).is_some_and(|tensor| tensor.dtype() == DType::BF16);
        keys.iter().copied().filter(coarse).collect()
    }

    /// The shape of the tensor under `key`, if there is one.
    pub fn shape(&self, key: &str) -> Option<&[usize]> {
        self.reader.get(key).map(pytorch_reader::Tensor::shape)
    }

    /// True where the dict has a tensor under `key`.
    pub fn has(&self, key: &str) -> bool {
        self.reader.get(key).is_some()
    }

    /// Reads the tensor under `key`; a plain Python number counts as a 0-dimensional tensor.
    ///
    /// # Errors
    /// [`PtError::MissingKey`], [`PtError::NotATensor`] (numpy values among them), [`PtError::BadStorage`].
    pub fn tensor(&self, key: &str) -> Result<Tensor, PtError> {
        let Some(tensor) = self.reader.get(key) else { return self.plain_number(key) };
        let bad = |reason: String| PtError::BadStorage { file: self.file.clone(), key: key.into(), reason };
        // A view can repeat one value of the file for ever.
        if tensor.shape().iter().fold(1usize, |product, &n| product.saturating_mul(n)) > MAX_VALUES {
            return Err(bad(format!("its shape {:?} has more than {MAX_VALUES} values", tensor.shape())));
        }
        let bytes = tensor.read().map_err(|err| bad(clip(&err.to_string())))?;
        Ok(Tensor { shape: tensor.shape().to_vec(), values: decode(tensor.dtype(), &bytes) })
    }

    /// Reads the tensor under `key`, which must have one of `shapes`, as 32-bit floats.
    ///
    /// # Errors
    /// As [`PtDict::tensor`], and [`PtError::WrongShape`], which is found before the values are read.
    pub fn f32s(&self, key: &str, shapes: &[&[usize]]) -> Result<Vec<f32>, PtError> {
        Ok(self.shaped(key, shapes)?.into_f32())
    }

    /// Reads the tensor under `key`, which must have one of `shapes`, as 64-bit floats.
    ///
    /// # Errors
    /// As [`PtDict::f32s`].
    pub(crate) fn f64s(&self, key: &str, shapes: &[&[usize]]) -> Result<Vec<f64>, PtError> {
        Ok(self.shaped(key, shapes)?.into_f64())
    }

    /// Reads a single number: a tensor with one element of any rank, or a plain Python number.
    ///
    /// # Errors
    /// As [`PtDict::f32s`].
    pub fn scalar(&self, key: &str) -> Result<f64, PtError> {
        let tensor = match self.shape(key) {
            Some(shape) if shape.iter().any(|&n| n != 1) => {
                return Err(self.wrong_shape(key, shape, "a single number".into()));
            }
            _ => self.tensor(key)?,
        };
        let shape = tensor.shape.clone();
        tensor.into_f64().first().copied().ok_or_else(|| self.wrong_shape(key, &shape, "a single number".into()))
    }

    /// The tensor under `key`, which must have one of `shapes`: found out before its values are read.
    fn shaped(&self, key: &str, shapes: &[&[usize]]) -> Result<Tensor, PtError> {
        let accepts = |shape: &[usize]| shapes.contains(&shape);
        let expected = || shapes.iter().map(|s| format!("{s:?}")).collect::<Vec<_>>().join(" or ");
        match self.shape(key) {
            Some(shape) if !accepts(shape) => Err(self.wrong_shape(key, shape, expected())),
            Some(_) => self.tensor(key),
            // A plain number has a value but no shape of its own.
            None => {
                let number = self.tensor(key)?;
                if accepts(&number.shape) {
                    return Ok(number);
                }
                let found = format!("a plain number where a tensor of shape {} belongs", expected());
                Err(PtError::NotATensor { file: self.file.clone(), key: key.into(), found })
            }
        }
    }

    fn wrong_shape(&self, key: &str, found: &[usize], expected: String) -> PtError {
        PtError::WrongShape { file: self.file.clone(), key: key.into(), found: found.to_vec(), expected }
    }

    /// Looks `key` up among the values that are not tensors: only reached where no tensor has that name.
    fn plain_number(&self, key: &str) -> Result<Tensor, PtError> {
        let missing =
            |found: String| PtError::MissingKey { file: self.file.clone(), key: key.into(), found: clip(&found) };
        let Ok(PickleValue::Dict(dict)) = PytorchReader::read_pickle_data(&self.file, None) else {
            return Err(missing(self.keys().join(", ")));
        };
        let found = match dict.get(key) {
            Some(PickleValue::Float(x)) => return Ok(Tensor::f64(&[], vec![*x])),
            Some(PickleValue::Int(x)) => return Ok(Tensor { shape: vec![], values: Values::I64(vec![*x]) }),
            Some(PickleValue::Bool(x)) => return Ok(Tensor::u8(&[], vec![u8::from(*x)])),
            Some(PickleValue::Unsupported(kind)) => format!("a value of type {}", clip(kind)),
            Some(PickleValue::None) => "None".into(),
            Some(PickleValue::String(_)) => "a text".into(),
            Some(PickleValue::List(_)) => "a list".into(),
            Some(PickleValue::Dict(_)) => "a dict".into(),
            Some(PickleValue::Bytes(_)) => "bytes".into(),
            None => {
                let mut keys: Vec<&str> = dict.keys().map(String::as_str).collect();
                keys.sort_unstable();
                return Err(missing(keys.join(", ")));
            }
        };
        Err(PtError::NotATensor { file: self.file.clone(), key: key.into(), found })
    }
}

/// Reads a dict of lists of texts, such as the lab's `tools.pt`; other values are left out.
///
/// # Errors
/// As [`read_dict`].
pub fn read_text_lists(path: &Path) -> Result<Vec<(String, Vec<String>)>, PtError> {
    drop(read_dict(path)?);
    let damaged = |reason: String| PtError::NotADict { file: path.to_owned(), reason };
    let value = PytorchReader::read_pickle_data(path, None).map_err(|err| damaged(clip(&err.to_string())))?;
    let PickleValue::Dict(dict) = value else { return Err(damaged("the file holds no dict".into())) };
    let mut lists: Vec<(String, Vec<String>)> = dict
        .into_iter()
        .filter_map(|(key, value)| match value {
            PickleValue::List(items) => {
                let texts = items.into_iter().map(|item| match item {
                    PickleValue::String(text) => Some(text),
                    _ => None,
                });
                Some((key, texts.collect::<Option<Vec<String>>>()?))
            }
            _ => None,
        })
        .collect();
    lists.sort();
    Ok(lists)
}

/// Splits `bytes` into arrays of `N`.
pub(super) fn each<const N: usize, T>(bytes: &[u8], f: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes
        .chunks_exact(N)
        .map(|chunk| {
            let mut array = [0; N];
            array.copy_from_slice(chunk);
            f(array)
        })
        .collect()
}

/// Turns native-endian bytes, as `pytorch-reader` hands them out, into values.
fn decode(dtype: DType, bytes: &[u8]) -> Values {
    match dtype {
        DType::F32 => Values::F32(each(bytes, f32::from_ne_bytes)),
        DType::F64 => Values::F64(each(bytes, f64::from_ne_bytes)),
        DType::F16 => Values::F32(each(bytes, |b| f32_from_f16(u16::from_ne_bytes(b)))),
        DType::BF16 => Values::F32(each(bytes, |b| f32::from_bits(u32::from(u16::from_ne_bytes(b)) << 16))),
        DType::U8 | DType::Bool => Values::U8(bytes.to_vec()),
        DType::I8 => Values::I64(each(bytes, |b| i64::from(i8::from_ne_bytes(b)))),
        DType::I16 => Values::I64(each(bytes, |b| i64::from(i16::from_ne_bytes(b)))),
        DType::I32 => Values::I64(each(bytes, |b| i64::from(i32::from_ne_bytes(b)))),
        DType::I64 => Values::I64(each(bytes, i64::from_ne_bytes)),
        DType::U16 => Values::I64(each(bytes, |b| i64::from(u16::from_ne_bytes(b)))),
        DType::U32 => Values::I64(each(bytes, |b| i64::from(u32::from_ne_bytes(b)))),
        // Above 2^63 the number does not fit; it saturates.
        DType::U64 => Values::I64(each(bytes, |b| i64::try_from(u64::from_ne_bytes(b)).unwrap_or(i64::MAX))),
    }
}

/// IEEE half precision widened without loss.
fn f32_from_f16(bits: u16) -> f32 {
    let sign = u32::from(bits >> 15) << 31;
    let exponent = u32::from(bits >> 10) & 0x1f;
    let mantissa = u32::from(bits) & 0x3ff;
    match exponent {
        // Zero and subnormals: mantissa * 2^-24 is exact in f32.
        0 => f32::from_bits(sign | (mantissa as f32 * 2f32.powi(-24)).to_bits()),
        31 => f32::from_bits(sign | 0x7f80_0000 | mantissa << 13),
        _ => f32::from_bits(sign | (exponent + 112) << 23 | mantissa << 13),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_precision_is_widened_exactly() {
        for (bits, value) in [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65504.0),
            (0x0001, 2f32.powi(-24)),
            (0x03ff, 1023.0 * 2f32.powi(-24)),
            (0x0400, 2f32.powi(-14)),
            (0x3555, 0.333_251_95),
            (0xfc00, f32::NEG_INFINITY),
        ] {
            assert_eq!(f32_from_f16(bits), value, "{bits:#x}");
        }
        assert!(f32_from_f16(0x7e00).is_nan());
    }
}
