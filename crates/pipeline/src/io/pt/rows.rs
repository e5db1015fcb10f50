//! One row of a large tensor, read from its own bytes: [`Rows`].
//!
//! `torch.save` stores tensors uncompressed, one after the other, so that a row lies where offset and strides say. The
//! crate that reads whole tensors does not tell them, and looks for the list of contents through the whole file, so that it is
//! read here by itself.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use pytorch_reader::DType;
use zip::read::{ArchiveOffset, Config};
use zip::{CompressionMethod, ZipArchive};

use super::budget::{self, MAX_PICKLE};
use super::{MAX_VALUES, PtError, Tensor, decode};
use crate::io::files::{self, clip};

/// A row may be spread over so many times its values: channels that lie last are none, a row that lies last is.
const MOST_SPREAD: usize = 4;

/// Place of a tensor's values in a storage, in values.
#[derive(Clone, Debug, PartialEq)]
struct Place {
    storage: String,
    dtype: DType,
    offset: usize,
    shape: Vec<usize>,
    strides: Vec<usize>,
}

/// An opened `.pt` file of which rows of tensors are read, however large it is.
pub(crate) struct Rows {
    file: PathBuf,
    archive: ZipArchive<BufReader<File>>,
    root: String,
    places: BTreeMap<String, Place>,
}

impl Rows {
    /// Opens a file and reads its list of contents.
    ///
    /// # Errors
    /// [`PtError`] if the file is none of the format that PyTorch has written since 1.6.
    pub(crate) fn open(path: &Path) -> Result<Self, PtError> {
        let file = || path.to_owned();
        let io = |source| PtError::Io { file: file(), what: "cannot read the file", source };
        let old = |reason: String| PtError::NotADict { file: file(), reason };
        let mut opened = files::open(path).map_err(io)?;
        let size = opened.metadata().map_err(io)?.len();
        let mut head = [0; 2];
        if size == 0 {
            return Err(PtError::Damaged { file: file(), reason: "the file is empty".into() });
        }
        if opened.read_exact(&mut head).is_err() || &head != b"PK" {
            return Err(old("no zip archive as PyTorch 1.6 and newer write".into()));
        }
        // From its beginning: else all of a large file is searched for what stands in front of it.
        let config = Config { archive_offset: ArchiveOffset::Known(0) };
        let damaged = |reason: String| PtError::Damaged { file: file(), reason: clip(&reason) };
        let archive = ZipArchive::with_config(config, BufReader::new(opened));
        let mut archive = archive.map_err(|err| damaged(err.to_string()))?;
        let name = archive.file_names().flatten().find(|name| name.ends_with("data.pkl")).map(|name| name.into_owned());
        let name = name.ok_or_else(|| old("it has no data.pkl".into()))?;
        let entry = archive.by_name(&name).map_err(|err| damaged(err.to_string()))?;
        let mut pickle = Vec::new();
        entry.take(MAX_PICKLE + 1).read_to_end(&mut pickle).map_err(|err| damaged(err.to_string()))?;
        let too_large = |reason| PtError::TooLarge { file: file(), reason };
        if pickle.len() as u64 > MAX_PICKLE {
            return Err(too_large(format!("its list of contents is longer than {MAX_PICKLE} bytes")));
        }
        budget::pickle(&pickle).map_err(too_large)?;
        let root = name.trim_end_matches("data.pkl").to_owned();
        let places = places(&pickle).ok_or_else(|| old("its list of contents is no dict of tensors".into()))?;
        Ok(Self { file: file(), archive, root, places })
    }

    /// The file.
    pub(crate) fn file(&self) -> &Path {
        &self.file
    }

    /// True where the dict has a tensor under `key`.
    pub(crate) fn has(&self, key: &str) -> bool {
        self.places.contains_key(key)
    }

    /// The shape of the tensor under `key`, if there is one.
    pub(crate) fn shape(&self, key: &str) -> Option<&[usize]> {
        self.places.get(key).map(|place| place.shape.as_slice())
    }

    /// All values of a tensor, as one row.
    ///
    /// # Errors
    /// As [`Rows::read`].
    pub(crate) fn all(&mut self, key: &str) -> Result<Tensor, PtError> {
        let shape = self.shape(key).unwrap_or_default().to_vec();
        let place = self.places.get_mut(key).filter(|place| place.strides.len() == shape.len());
        let Some(place) = place else { return Err(self.missing(key)) };
        let whole = place.clone();
        place.shape.insert(0, 1);
        place.strides.insert(0, 0);
        let read = self.read(key, 0, 1, &shape);
        self.places.insert(key.to_owned(), whole);
        read
    }

    /// Row `at` of the tensor under `key`, which must have this many rows (or one row for all) of this shape.
    ///
    /// # Errors
    /// [`PtError`], before anything is allocated where a size is wrong.
    pub(crate) fn read(&mut self, key: &str, at: usize, of: usize, row: &[usize]) -> Result<Tensor, PtError> {
        let (start, spread) = self.span(key, of, row)?;
        let place = &self.places[key];
        let at = if place.shape[0] == 1 { 0 } else { at.min(place.shape[0] - 1) };
        let (dtype, size) = (place.dtype, place.dtype.size());
        let from = start + ((place.offset + at * place.strides[0]) * size) as u64;
        let mut bytes = vec![0; spread * size];
        let file = files::open(&self.file);
        let read = file.and_then(|mut file| file.seek(SeekFrom::Start(from)).and_then(|_| file.read_exact(&mut bytes)));
        read.map_err(|err| self.bad(key, err.to_string()))?;
        let values: usize = row.iter().product();
        if spread != values || !contiguous(row, &place.strides[1..]) {
            bytes = gathered(&bytes, size, row, &place.strides[1..]);
        }
        Ok(Tensor { shape: row.to_vec(), values: decode(dtype, &bytes) })
    }

    /// Checks what [`Rows::read`] needs, of all rows.
    ///
    /// # Errors
    /// As there.
    pub(crate) fn check(&mut self, key: &str, of: usize, row: &[usize]) -> Result<(), PtError> {
        self.span(key, of, row).map(drop)
    }

    /// The place in the file where the storage of a tensor begins, and how many values a row spans in it.
    fn span(&mut self, key: &str, of: usize, row: &[usize]) -> Result<(u64, usize), PtError> {
        let Some(place) = self.places.get(key) else { return Err(self.missing(key)) };
        let shape = place.shape.as_slice();
        let rows = shape.first().copied().unwrap_or(0);
        if shape.get(1..) != Some(row) || (rows != of && rows != 1) || rows == 0 {
            let expected = [&[of], row].concat();
            let (file, found) = (self.file.clone(), shape.to_vec());
            return Err(PtError::WrongShape { file, key: key.into(), found, expected: format!("{expected:?}") });
        }
        if place.strides.len() != shape.len() {
            return Err(self.bad(key, "it is stored in a way of its own; save it with .contiguous()".into()));
        }
        let reach = |shape: &[usize], strides: &[usize]| {
            let steps = shape.iter().zip(strides).map(|(n, stride)| n.saturating_sub(1).saturating_mul(*stride));
            steps.fold(1usize, usize::saturating_add)
        };
        let (spread, all) = (reach(row, &place.strides[1..]), reach(shape, &place.strides));
        let values = row.iter().fold(1usize, |product, n| product.saturating_mul(*n));
        if values > MAX_VALUES || spread > values.saturating_mul(MOST_SPREAD) {
            return Err(self.bad(key, "a row of it is spread over the file; save it with .contiguous()".into()));
        }
        let need = place.offset.saturating_add(all).saturating_mul(place.dtype.size()) as u64;
        let name = format!("{}data/{}", self.root, place.storage);
        let file = self.file.clone();
        let bad = |reason: String| PtError::BadStorage { file: file.clone(), key: key.into(), reason };
        let entry = self.archive.by_name(&name).map_err(|err| bad(clip(&err.to_string())))?;
        if entry.compression() != CompressionMethod::Stored {
            return Err(bad("it is compressed; save the file with torch.save, which does not".into()));
        }
        if entry.size() < need {
            return Err(bad(format!("it needs {need} bytes and has {}", entry.size())));
        }
        let start = entry.data_start().ok_or_else(|| bad("the archive does not say where it lies".into()))?;
        Ok((start, spread))
    }

    fn bad(&self, key: &str, reason: String) -> PtError {
        PtError::BadStorage { file: self.file.clone(), key: key.into(), reason }
    }

    fn missing(&self, key: &str) -> PtError {
        let found: Vec<&str> = self.places.keys().map(String::as_str).collect();
        PtError::MissingKey { file: self.file.clone(), key: key.into(), found: clip(&found.join(", ")) }
    }
}

fn contiguous(shape: &[usize], strides: &[usize]) -> bool {
    let mut step = 1;
    shape.iter().zip(strides).rev().all(|(n, stride)| {
        let fits = *n == 1 || *stride == step;
        step *= n;
        fits
    })
}

/// The values of a view in row-major order, each of `size` bytes.
fn gathered(bytes: &[u8], size: usize, shape: &[usize], strides: &[usize]) -> Vec<u8> {
    let mut places = vec![0usize];
    for (n, stride) in shape.iter().zip(strides) {
        places = places.iter().flat_map(|place| (0..*n).map(move |i| place + i * stride)).collect();
    }
    places.iter().flat_map(|place| &bytes[place * size..][..size]).copied().collect()
}

/// Part of a pickle of a dict of tensors.
#[derive(Clone, Debug)]
enum Value {
    Text(Rc<str>),
    Int(usize),
    Tuple(Rc<[Value]>),
    Dict(Rc<[(Value, Value)]>),
    /// A class or function, by its name.
    Name(Rc<str>),
    Tensor(Rc<Place>),
    /// Whatever else; its parts do not matter.
    Other,
    Mark,
}

/// Places of the tensors of a dict by key; `None` where the pickle is none that `torch.save` writes. Its cost was checked.
fn places(pickle: &[u8]) -> Option<BTreeMap<String, Place>> {
    let mut machine = Machine { rest: pickle, stack: Vec::new(), memo: HashMap::new() };
    while machine.step()? {}
    let Some(Value::Dict(items)) = machine.stack.pop() else { return None };
    let each = items.iter().filter_map(|(key, value)| match (key, value) {
        (Value::Text(key), Value::Tensor(place)) => Some((key.to_string(), (**place).clone())),
        _ => None,
    });
    Some(each.collect())
}

struct Machine<'a> {
    rest: &'a [u8],
    stack: Vec<Value>,
    memo: HashMap<usize, Value>,
}

impl Machine<'_> {
    fn take(&mut self, count: usize) -> Option<&[u8]> {
        let (head, tail) = self.rest.split_at_checked(count)?;
        self.rest = tail;
        Some(head)
    }

    fn number(&mut self, bytes: usize) -> Option<usize> {
        Some(self.take(bytes)?.iter().rev().fold(0, |value, byte| value << 8 | usize::from(*byte)))
    }

    fn line(&mut self) -> Option<Value> {
        let end = self.rest.iter().position(|byte| *byte == b'\n')?;
        let line = self.take(end + 1)?;
        Some(Value::Name(String::from_utf8_lossy(&line[..end]).into()))
    }

    fn text(&mut self, length_bytes: usize) -> Option<Value> {
        let length = self.number(length_bytes)?;
        let text = String::from_utf8_lossy(self.take(length)?).into();
        Some(Value::Text(text))
    }

    /// Values pushed since the last mark.
    fn marked(&mut self) -> Option<Vec<Value>> {
        let at = self.stack.iter().rposition(|value| matches!(value, Value::Mark))?;
        let items = self.stack.split_off(at + 1);
        self.stack.pop();
        Some(items)
    }

    fn tuple(&mut self, count: usize) -> Option<Value> {
        let at = self.stack.len().checked_sub(count)?;
        Some(Value::Tuple(self.stack.split_off(at).into()))
    }

    /// Puts keys and values into the dict on top; into something else they do not matter.
    fn put(&mut self, items: &[Value]) -> Option<()> {
        if let Value::Dict(known) = self.stack.last()? {
            let more = items.chunks_exact(2).map(|pair| (pair[0].clone(), pair[1].clone()));
            let all: Vec<_> = known.iter().cloned().chain(more).collect();
            *self.stack.last_mut()? = Value::Dict(all.into());
        }
        Some(())
    }

    /// One opcode, by the letters of Python's `pickletools`; `false` at the end.
    fn step(&mut self) -> Option<bool> {
        let op = self.take(1)?[0];
        let value = match op {
            b'.' => return Some(false),
            0x80 => return self.take(1).map(|_| true),
            0x95 => return self.take(8).map(|_| true),
            b'(' => Value::Mark,
            b'}' => Value::Dict([].into()),
            b')' => Value::Tuple([].into()),
            b'N' | b']' | 0x88 | 0x89 => Value::Other,
            b'K' => Value::Int(self.number(1)?),
            b'M' => Value::Int(self.number(2)?),
            b'J' => Value::Int(self.number(4)?),
            0x8a => {
                let length = self.number(1)?;
                Value::Int(self.number(length).filter(|_| length <= 8)?)
            }
            b'G' => self.take(8).map(|_| Value::Other)?,
            b'X' => self.text(4)?,
            0x8c => self.text(1)?,
            b'c' => self.line().and_then(|_| self.line())?,
            0x93 => match self.tuple(2)? {
                Value::Tuple(of) => match &of[1] {
                    Value::Text(name) => Value::Name(name.clone()),
                    _ => return None,
                },
                _ => return None,
            },
            b't' => Value::Tuple(self.marked()?.into()),
            0x85 => self.tuple(1)?,
            0x86 => self.tuple(2)?,
            0x87 => self.tuple(3)?,
            // The storage stays the tuple that names it.
            b'Q' => return Some(true),
            b'R' => {
                let arguments = self.stack.pop()?;
                self.stack.pop()?;
                place(&arguments).map_or(Value::Other, |place| Value::Tensor(Rc::new(place)))
            }
            b'u' => {
                let items = self.marked()?;
                return self.put(&items).map(|()| true);
            }
            b's' => {
                let value = self.stack.pop()?;
                let key = self.stack.pop()?;
                return self.put(&[key, value]).map(|()| true);
            }
            b'e' => return self.marked().map(|_| true),
            b'a' | b'b' => return self.stack.pop().map(|_| true),
            b'q' | b'r' | 0x94 => {
                let slot = match op {
                    b'q' => self.number(1)?,
                    b'r' => self.number(4)?,
                    _ => self.memo.len(),
                };
                let top = self.stack.last()?.clone();
                self.memo.insert(slot, top);
                return Some(true);
            }
            b'h' | b'j' => {
                let slot = self.number(if op == b'h' { 1 } else { 4 })?;
                self.memo.get(&slot)?.clone()
            }
            _ => return None,
        };
        self.stack.push(value);
        Some(true)
    }
}

/// The place that the arguments of `torch._utils._rebuild_tensor_v2` name: storage, offset, shape, strides.
fn place(arguments: &Value) -> Option<Place> {
    let Value::Tuple(arguments) = arguments else { return None };
    let [Value::Tuple(storage), Value::Int(offset), Value::Tuple(shape), Value::Tuple(strides), ..] = &arguments[..]
    else {
        return None;
    };
    let [_, Value::Name(class), Value::Text(key), ..] = &storage[..] else { return None };
    let dtype = match &**class {
        "FloatStorage" => DType::F32,
        "DoubleStorage" => DType::F64,
        "HalfStorage" => DType::F16,
        "BFloat16Storage" => DType::BF16,
        "ByteStorage" => DType::U8,
        "BoolStorage" => DType::Bool,
        "CharStorage" => DType::I8,
        "ShortStorage" => DType::I16,
        "IntStorage" => DType::I32,
        "LongStorage" => DType::I64,
        _ => return None,
    };
    let number = |value: &Value| if let Value::Int(number) = value { Some(*number) } else { None };
    let numbers = |values: &[Value]| values.iter().map(number).collect::<Option<Vec<usize>>>();
    let (shape, strides) = (numbers(shape)?, numbers(strides)?);
    Some(Place { storage: key.to_string(), dtype, offset: *offset, shape, strides })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::pt::{Values, write_dict};

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
        let mut rows = Rows::open(&path).unwrap();
        assert_eq!(rows.all("one").unwrap(), Tensor::u8(&[1, 2], vec![7, 8]));
        for at in 0..5 {
            let row = rows.read("a", at, 5, &[2, 3]).unwrap();
            assert_eq!(row, Tensor::f32(&[2, 3], values[6 * at..][..6].to_vec()));
            assert_eq!(rows.read("one", at, 5, &[2]).unwrap().values, Values::U8(vec![7, 8]));
            assert_eq!(rows.read("plain", at, 5, &[]).unwrap().values, Values::F64(vec![0.5]));
        }
        for (key, of, row, says) in [
            ("a", 4, &[2usize, 3][..], "has shape [5, 2, 3], expected [4, 2, 3]"),
            ("a", 5, &[3, 2], "expected [5, 3, 2]"),
            ("b", 5, &[2], "key \"b\" is missing; found a, one, plain"),
        ] {
            let why = rows.check(key, of, row).unwrap_err().to_string();
            assert!(why.contains(says) && why.contains("a.pt"), "{why}");
        }
        // A storage shorter than its shape says.
        let bytes = std::fs::read(&path).unwrap();
        let at = bytes.windows(5).position(|w| w == [b'J', 5, 0, 0, 0]).unwrap();
        let mut longer = bytes;
        longer[at + 1] = 200;
        drop(std::fs::write(&path, longer));
        assert!(Rows::open(&path).and_then(|mut rows| rows.check("a", 200, &[2, 3])).is_err());
    }

    #[test]
    fn views_are_gathered() {
        assert!(contiguous(&[2, 1, 3], &[3, 99, 1]) && !contiguous(&[3, 2], &[1, 3]));
        assert_eq!(gathered(&[0, 1, 2, 3, 4, 5], 1, &[3, 2], &[1, 3]), [0, 3, 1, 4, 2, 5]);
        assert_eq!(gathered(&[0, 1, 2, 3], 2, &[2], &[1]), [0, 1, 2, 3]);
        assert_eq!(places(b"\x80\x02}."), Some(BTreeMap::new()));
        for bytes in [&b""[..], b"N.", b"}h\x07.", b"t.", b"}(X\xff\xff\xff\xff"] {
            assert_eq!(places(bytes), None, "{bytes:?}");
        }
    }
}
