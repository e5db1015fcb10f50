//! PyTorch's `.pt` files: a zip with a pickled dict and raw storages.
//!
//! Only the values that are asked for are read: of a tensor ([`PtDict::tensor`]), checked by its checksum, or of one row of it
//! ([`PtDict::row`]), which lies where offset and strides say, however large the file is. [`write_dict`] is a small writer of
//! the same container that `torch.load(weights_only=True)` accepts.

mod pickle;
mod write;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use zip::read::{ArchiveOffset, Config};
use zip::{CompressionMethod, ZipArchive};

use self::pickle::{Item, Place, Refusal, contents};
pub use write::{PtItem, write_dict};

use super::error::{FileError, FileErrorKind};
use super::files::{self, clip};

/// Most bytes of the pickle itself. A dict of the twelve tensors of a touch has two thousand.
const MAX_PICKLE: u64 = 1 << 20;
/// Most values of a tensor: a hundred times those of a touch.
const MAX_VALUES: usize = 1 << 24;
/// Most bytes of a storage that is unpacked; `torch.save` does not compress.
const MAX_UNPACKED: u64 = 64 << 20;
/// Most bytes of a storage that is read whole.
const MAX_STORAGE: u64 = 256 << 20;
/// A row may be spread over so many times its values: channels that lie last are none, a row that lies last is.
const MOST_SPREAD: usize = 4;

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

impl Values {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
            Self::U8(v) => v.len(),
            Self::I64(v) => v.len(),
        }
    }

    /// The values one after the other, the lowest byte first.
    pub(super) fn bytes(&self) -> Vec<u8> {
        match self {
            Self::F32(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::F64(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
            Self::U8(v) => v.clone(),
            Self::I64(v) => v.iter().flat_map(|x| x.to_le_bytes()).collect(),
        }
    }
}

/// Type of the values of a storage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DType {
    F32,
    F64,
    F16,
    BF16,
    /// Truth values among them.
    U8,
    I8,
    I16,
    I32,
    I64,
}

impl DType {
    fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::F16 | Self::BF16 | Self::I16 => 2,
            Self::F32 | Self::I32 => 4,
            Self::F64 | Self::I64 => 8,
        }
    }
}

/// An opened `.pt` file: its keys and shapes. Values are read key by key.
#[derive(Debug)]
pub struct PtDict {
    file: PathBuf,
    archive: RefCell<ZipArchive<BufReader<File>>>,
    root: String,
    items: BTreeMap<String, Item>,
}

/// Opens `path` and reads the names and shapes of its tensors, not their values.
///
/// # Errors
/// [`FileError`] if the file cannot be read, is cut off, or does not hold a dict in the format of PyTorch 1.6 and newer.
pub fn read_dict(path: &Path) -> Result<PtDict, FileError> {
    let io = |err| FileError::io(path, "cannot open the file", err);
    let not_a_dict = |reason: &str| {
        let what = format!("not a PyTorch file with a dict of tensors: {reason}");
        FileError::new(path, what, "save a dict of tensors with torch.save")
    };
    let damaged =
        |reason: String| FileError::new(path, format!("damaged or truncated file: {}", clip(&reason)), COPY_AGAIN);
    let mut opened = match files::open(path) {
        Err(err) if err.kind() == std::io::ErrorKind::IsADirectory => return Err(not_a_dict("it is a folder")),
        other => other.map_err(io)?,
    };
    if opened.metadata().map_err(io)?.len() == 0 {
        return Err(damaged("the file is empty".into()));
    }
    let mut head = [0; 2];
    if opened.read_exact(&mut head).is_err() || &head != b"PK" {
        return Err(not_a_dict("not a zip archive as PyTorch 1.6 and newer write"));
    }
    // From its beginning: else all of a large file is searched for what stands in front of it.
    let config = Config { archive_offset: ArchiveOffset::Known(0) };
    let archive = ZipArchive::with_config(config, BufReader::new(opened));
    let mut archive = archive.map_err(|err| damaged(err.to_string()))?;
    let name = archive.file_names().flatten().find(|name| name.ends_with("data.pkl")).map(|name| name.into_owned());
    let name = name.ok_or_else(|| not_a_dict("it has no data.pkl"))?;
    let entry = archive.by_name(&name).map_err(|err| damaged(err.to_string()))?;
    let mut pickle = Vec::new();
    entry.take(MAX_PICKLE + 1).read_to_end(&mut pickle).map_err(|err| damaged(err.to_string()))?;
    if pickle.len() as u64 > MAX_PICKLE {
        return Err(too_large(path, &format!("its list of contents is longer than {MAX_PICKLE} bytes")));
    }
    let items = contents(&pickle).map_err(|refusal| match refusal {
        Refusal::NoDict => not_a_dict("its list of contents is not a dict as torch.save writes it"),
        Refusal::TooLarge(reason) => too_large(path, &reason),
    })?;
    let root = name.trim_end_matches("data.pkl").to_owned();
    Ok(PtDict { file: path.to_owned(), archive: RefCell::new(archive), root, items })
}

impl PtDict {
    /// The file it was read from.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The tensors' keys, sorted.
    pub fn keys(&self) -> Vec<String> {
        self.items.keys().filter(|key| self.has(key)).cloned().collect()
    }

    /// The keys, among these, whose values are stored as bfloat16, which has three digits.
    pub(crate) fn coarse<'a>(&self, keys: &[&'a str]) -> Vec<&'a str> {
        keys.iter().copied().filter(|key| self.place(key).is_some_and(|place| place.dtype == DType::BF16)).collect()
    }

    /// The shape of the tensor under `key`, if there is one.
    pub fn shape(&self, key: &str) -> Option<&[usize]> {
        self.place(key).map(|place| place.shape.as_slice())
    }

    /// True where the dict has a tensor under `key`.
    pub fn has(&self, key: &str) -> bool {
        self.place(key).is_some()
    }

    fn place(&self, key: &str) -> Option<&Place> {
        if let Some(Item::Tensor(place)) = self.items.get(key) { Some(place) } else { None }
    }

    /// Reads the tensor under `key`; a plain Python number counts as a 0-dimensional tensor.
    ///
    /// # Errors
    /// [`FileErrorKind::Missing`] where there is none, or another value (numpy's among them); else its values cannot be read.
    pub fn tensor(&self, key: &str) -> Result<Tensor, FileError> {
        self.shaped(key, &[])
    }

    /// [`PtDict::tensor`] of one of `shapes`, or of any where there are none.
    ///
    /// # Errors
    /// As [`PtDict::tensor`], and [`FileErrorKind::Content`] of another shape, which is found before the values are read.
    pub fn shaped(&self, key: &str, shapes: &[&[usize]]) -> Result<Tensor, FileError> {
        let accepts = |shape: &[usize]| shapes.is_empty() || shapes.contains(&shape);
        let expected = || shapes.iter().map(|s| format!("{s:?}")).collect::<Vec<_>>().join(" or ");
        // A plain number has a value but no shape of its own.
        let number = |number: Values| match accepts(&[]) {
            true => Ok(Tensor { shape: vec![], values: number }),
            false => {
                Err(self.no_tensor(key, &format!("a plain number where a tensor of shape {} belongs", expected())))
            }
        };
        let Place { storage, dtype, offset, shape, strides } = match self.items.get(key) {
            Some(Item::Tensor(place)) if accepts(&place.shape) => place,
            Some(Item::Tensor(place)) => return Err(self.wrong_shape(key, &place.shape, expected())),
            Some(Item::Float(x)) => return number(Values::F64(vec![*x])),
            Some(Item::Int(x)) => return number(Values::I64(vec![*x])),
            Some(Item::Bool(x)) => return number(Values::U8(vec![u8::from(*x)])),
            Some(Item::Other(found)) => return Err(self.no_tensor(key, &clip(found))),
            None => return Err(self.missing(key)),
        };
        let bad = |reason: String| self.bad(key, reason);
        // A view can repeat one value of the file for ever.
        let values = product(shape);
        if values > MAX_VALUES {
            return Err(bad(format!("its shape {shape:?} has more than {MAX_VALUES} values")));
        }
        let mut archive = self.archive.borrow_mut();
        let entry = archive.by_name(&self.storage(storage)).map_err(|err| bad(clip(&err.to_string())))?;
        let (size, stored) = (entry.size(), entry.compression() == CompressionMethod::Stored);
        let most = if stored { MAX_STORAGE } else { MAX_UNPACKED };
        if size > most {
            return Err(bad(format!("its values would be unpacked to {size} bytes; at most {most} are")));
        }
        let mut bytes = Vec::new();
        entry.take(most).read_to_end(&mut bytes).map_err(|err| bad(clip(&err.to_string())))?;
        let end = if values == 0 { 0 } else { offset.saturating_add(reach(shape, strides)) };
        let need = end.saturating_mul(dtype.size());
        if bytes.len() < need {
            return Err(bad(format!("it needs {need} bytes and has {}", bytes.len())));
        }
        let from = if values == 0 { bytes.len() } else { offset * dtype.size() };
        Ok(Tensor {
            shape: shape.clone(),
            values: decode(*dtype, &gathered(&bytes[from..], dtype.size(), shape, strides)),
        })
    }

    /// Row `at` of the tensor under `key`, which must have this many rows (or one row for all) of this shape.
    ///
    /// # Errors
    /// [`FileError`], before anything is allocated where a size is wrong.
    pub(crate) fn row(&self, key: &str, at: usize, of: usize, row: &[usize]) -> Result<Tensor, FileError> {
        let start = self.check(key, of, row)?;
        let Some(place) = self.place(key) else { return Err(self.missing(key)) };
        let at = if place.shape[0] == 1 { 0 } else { at.min(place.shape[0] - 1) };
        let size = place.dtype.size();
        let from = start + ((place.offset + at * place.strides[0]) * size) as u64;
        let mut bytes = vec![0; reach(row, &place.strides[1..]) * size];
        let file = files::open(&self.file);
        let read = file.and_then(|mut file| file.seek(SeekFrom::Start(from)).and_then(|_| file.read_exact(&mut bytes)));
        read.map_err(|err| self.bad(key, err.to_string()))?;
        let values = decode(place.dtype, &gathered(&bytes, size, row, &place.strides[1..]));
        Ok(Tensor { shape: row.to_vec(), values })
    }

    /// Checks what [`PtDict::row`] needs, of all rows. The place in the file where the tensor's storage begins.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn check(&self, key: &str, of: usize, row: &[usize]) -> Result<u64, FileError> {
        let Some(place) = self.place(key) else { return Err(self.missing(key)) };
        let bad = |reason: String| self.bad(key, reason);
        let shape = place.shape.as_slice();
        let rows = shape.first().copied().unwrap_or(0);
        if shape.get(1..) != Some(row) || (rows != of && rows != 1) || rows == 0 {
            return Err(self.wrong_shape(key, shape, format!("{:?}", [&[of], row].concat())));
        }
        let values = product(row);
        if values > MAX_VALUES || reach(row, &place.strides[1..]) > values.saturating_mul(MOST_SPREAD) {
            return Err(bad("a row of it is spread over the file; save it with .contiguous()".into()));
        }
        let all = place.offset.saturating_add(reach(shape, &place.strides));
        let need = all.saturating_mul(place.dtype.size()) as u64;
        let mut archive = self.archive.borrow_mut();
        let entry = archive.by_name(&self.storage(&place.storage)).map_err(|err| bad(clip(&err.to_string())))?;
        if entry.compression() != CompressionMethod::Stored {
            return Err(bad("it is compressed; save the file with torch.save, which does not".into()));
        }
        if entry.size() < need {
            return Err(bad(format!("it needs {need} bytes and has {}", entry.size())));
        }
        entry.data_start().ok_or_else(|| bad("the archive does not say where it lies".into()))
    }

    fn storage(&self, key: &str) -> String {
        format!("{}data/{key}", self.root)
    }

    fn bad(&self, key: &str, reason: String) -> FileError {
        FileError::new(&self.file, format!("key \"{key}\" cannot be read: {reason}"), COPY_AGAIN)
    }

    fn missing(&self, key: &str) -> FileError {
        let found: Vec<&str> = self.items.keys().map(String::as_str).collect();
        let what = format!("key \"{key}\" is missing; found {}", clip(&found.join(", ")));
        let hint = "check that the file belongs to this folder and to the released data set";
        FileError::new(&self.file, what, hint).of_kind(FileErrorKind::Missing)
    }

    fn no_tensor(&self, key: &str, found: &str) -> FileError {
        let hint = "convert the value with torch.as_tensor(...) before torch.save";
        FileError::new(&self.file, format!("key \"{key}\" holds {found}, expected a tensor"), hint)
            .of_kind(FileErrorKind::Missing)
    }

    /// Reads a single number: a tensor with one element of any rank, or a plain Python number.
    ///
    /// # Errors
    /// As [`PtDict::shaped`].
    pub fn scalar(&self, key: &str) -> Result<f64, FileError> {
        let tensor = match self.shape(key) {
            Some(shape) if shape.iter().any(|&n| n != 1) => {
                return Err(self.wrong_shape(key, shape, "a single number".into()));
            }
            _ => self.tensor(key)?,
        };
        let shape = tensor.shape.clone();
        tensor.into_f64().first().copied().ok_or_else(|| self.wrong_shape(key, &shape, "a single number".into()))
    }

    fn wrong_shape(&self, key: &str, found: &[usize], expected: String) -> FileError {
        let what = format!("key \"{key}\" has shape {found:?}, expected {expected}");
        FileError::new(&self.file, what, "check which version of the data set the file belongs to")
            .of_kind(FileErrorKind::Content)
    }
}

const COPY_AGAIN: &str = "copy or download the file again";

pub(super) fn too_large(path: &Path, reason: &str) -> FileError {
    let hint = "save the tensors of one touch only, uncompressed, with torch.save";
    FileError::new(path, format!("refused: {reason}"), hint)
}

/// The number of values of a shape.
fn product(shape: &[usize]) -> usize {
    shape.iter().fold(1, |product, &n| product.saturating_mul(n))
}

/// The number of values from the first to the last of a view.
fn reach(shape: &[usize], strides: &[usize]) -> usize {
    let steps = shape.iter().zip(strides).map(|(n, stride)| n.saturating_sub(1).saturating_mul(*stride));
    steps.fold(1, usize::saturating_add)
}

/// The values of a view in row-major order, each of `size` bytes.
pub(super) fn gathered(bytes: &[u8], size: usize, shape: &[usize], strides: &[usize]) -> Vec<u8> {
    let mut out = Vec::with_capacity(product(shape) * size);
    if shape.contains(&0) {
        return out;
    }
    // The innermost extents that lie together are copied at once.
    let (mut outer, mut together) = (shape.len(), 1);
    while outer > 0 && (shape[outer - 1] == 1 || strides[outer - 1] == together) {
        outer -= 1;
        together *= shape[outer];
    }
    let mut at = vec![0; outer];
    for _ in 0..product(&shape[..outer]) {
        let place: usize = at.iter().zip(strides).map(|(at, stride)| at * stride).sum();
        out.extend_from_slice(&bytes[place * size..][..together * size]);
        for (at, n) in at.iter_mut().zip(shape).rev() {
            *at += 1;
            if *at < *n {
                break;
            }
            *at = 0;
        }
    }
    out
}

/// Splits `bytes` into arrays of `N`.
pub(super) fn each<const N: usize, T>(bytes: &[u8], f: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks().0.iter().map(|chunk| f(*chunk)).collect()
}

/// Turns bytes of a storage into values.
fn decode(dtype: DType, bytes: &[u8]) -> Values {
    match dtype {
        DType::F32 => Values::F32(each(bytes, f32::from_le_bytes)),
        DType::F64 => Values::F64(each(bytes, f64::from_le_bytes)),
        DType::F16 => Values::F32(each(bytes, |b| f32_from_f16(u16::from_le_bytes(b)))),
        DType::BF16 => Values::F32(each(bytes, |b| f32::from_bits(u32::from(u16::from_le_bytes(b)) << 16))),
        DType::U8 => Values::U8(bytes.to_vec()),
        DType::I8 => Values::I64(each(bytes, |b| i64::from(i8::from_le_bytes(b)))),
        DType::I16 => Values::I64(each(bytes, |b| i64::from(i16::from_le_bytes(b)))),
        DType::I32 => Values::I64(each(bytes, |b| i64::from(i32::from_le_bytes(b)))),
        DType::I64 => Values::I64(each(bytes, i64::from_le_bytes)),
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

    #[test]
    fn a_row_is_read_from_its_own_bytes() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.pt");
        let values: Vec<f32> = (0..5 * 2 * 3).map(|v| v as f32).collect();
        let items = [
            ("a", Tensor::f32(&[5, 2, 3], values.clone()).into()),
            ("one", Tensor::u8(&[1, 2], vec![7, 8]).into()),
            ("plain", Tensor::f64(&[5], vec![0.5; 5]).into()),
        ];
        write_dict(&path, &items).unwrap();
        let dict = read_dict(&path).unwrap();
        assert_eq!(dict.tensor("one").unwrap(), Tensor::u8(&[1, 2], vec![7, 8]));
        for at in 0..5 {
            let row = dict.row("a", at, 5, &[2, 3]).unwrap();
            assert_eq!(row, Tensor::f32(&[2, 3], values[6 * at..][..6].to_vec()));
            assert_eq!(dict.row("one", at, 5, &[2]).unwrap().values, Values::U8(vec![7, 8]));
            assert_eq!(dict.row("plain", at, 5, &[]).unwrap().values, Values::F64(vec![0.5]));
        }
        for (key, of, row, says) in [
            ("a", 4, &[2usize, 3][..], "has shape [5, 2, 3], expected [4, 2, 3]"),
            ("a", 5, &[3, 2], "expected [5, 3, 2]"),
            ("b", 5, &[2], "key \"b\" is missing; found a, one, plain"),
        ] {
            let why = dict.check(key, of, row).unwrap_err().to_string();
            assert!(why.contains(says) && why.contains("a.pt"), "{why}");
        }
        // A storage shorter than its shape says.
        let bytes = std::fs::read(&path).unwrap();
        let at = bytes.windows(5).position(|w| w == [b'J', 5, 0, 0, 0]).unwrap();
        let mut longer = bytes;
        longer[at + 1] = 200;
        drop(std::fs::write(&path, longer));
        assert!(read_dict(&path).is_err_and(|err| err.to_string().contains("checksum")));
    }

    #[test]
    fn views_are_gathered() {
        assert_eq!(gathered(&[0, 1, 2, 3, 4, 5], 1, &[3, 2], &[1, 3]), [0, 3, 1, 4, 2, 5]);
        assert_eq!(gathered(&[0, 1, 2, 3], 2, &[2], &[1]), [0, 1, 2, 3]);
        assert_eq!(gathered(&[7, 8], 1, &[2, 1, 2], &[0, 99, 1]), [7, 8, 7, 8]);
        assert_eq!((gathered(&[9], 1, &[], &[]), gathered(&[], 4, &[0, 3], &[3, 1])), (vec![9], vec![]));
        assert_eq!(reach(&[4, 3], &[0, 1]), 3);
    }
}
