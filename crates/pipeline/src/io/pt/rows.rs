//! One row of a large tensor, read from its own bytes: [`PtDict::rows`].
//!
//! `torch.save` stores tensors uncompressed, one after the other, so that a row lies where offset and strides say. The
//! crate that reads whole tensors does not tell them, so the list of contents is read here once more.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read as _, Seek as _, SeekFrom};
use std::rc::Rc;

use zip::{CompressionMethod, ZipArchive};

use super::budget::MAX_PICKLE;
use super::{PtDict, PtError, Tensor, decode};
use crate::io::files::{self, clip};

/// Most values of a row: more than the pictures of a touch have.
const MOST_VALUES: usize = 1 << 24;
/// A row may be spread over so many times its values: channels that lie last are none, a row that lies last is.
const MOST_SPREAD: usize = 4;

/// Place of a tensor's values in a storage, in values.
#[derive(Clone, Debug, PartialEq)]
struct Place {
    storage: String,
    offset: usize,
    strides: Vec<usize>,
}

/// The rows of a file's tensors.
pub(crate) struct Rows<'a> {
    dict: &'a PtDict,
    archive: ZipArchive<BufReader<File>>,
    root: String,
    places: HashMap<String, Place>,
}

impl PtDict {
    /// Access to single rows of the tensors.
    ///
    /// # Errors
    /// [`PtError`] if the file is none of the format that PyTorch has written since 1.6.
    pub(crate) fn rows(&self) -> Result<Rows<'_>, PtError> {
        let file = &self.file;
        let io = |source| PtError::Io { file: file.clone(), what: "cannot read the file", source };
        let old = |reason: String| PtError::NotADict { file: file.clone(), reason };
        let opened = BufReader::new(files::open(file).map_err(io)?);
        let archive = ZipArchive::new(opened);
        let mut archive =
            archive.map_err(|err| old(format!("no zip archive as PyTorch 1.6 and newer write: {err}")))?;
        let name = archive.file_names().flatten().find(|name| name.ends_with("data.pkl")).map(|name| name.into_owned());
        let name = name.ok_or_else(|| old("it has no data.pkl".into()))?;
        let mut pickle = Vec::new();
        let entry = archive.by_name(&name).map_err(|err| old(clip(&err.to_string())))?;
        entry.take(MAX_PICKLE).read_to_end(&mut pickle).map_err(io)?;
        let root = name.trim_end_matches("data.pkl").to_owned();
        Ok(Rows { dict: self, archive, root, places: places(&pickle).unwrap_or_default() })
    }
}

impl Rows<'_> {
    /// Row `at` of the tensor under `key`, which must have this many rows (or one row for all) of this shape.
    ///
    /// # Errors
    /// [`PtError`], before anything is allocated where a size is wrong.
    pub(crate) fn read(&mut self, key: &str, at: usize, of: usize, row: &[usize]) -> Result<Tensor, PtError> {
        let (start, spread) = self.span(key, of, row)?;
        let place = &self.places[key];
        let found = self.dict.shape(key).map_or(1, |shape| shape[0]);
        let at = if found == 1 { 0 } else { at.min(found - 1) };
        let tensor = self.dict.reader.get(key);
        let dtype = tensor.map_or(pytorch_reader::DType::U8, pytorch_reader::Tensor::dtype);
        let size = dtype.size();
        let from = start + ((place.offset + at * place.strides[0]) * size) as u64;
        let mut bytes = vec![0; spread * size];
        let file = files::open(&self.dict.file);
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
        let Some(shape) = self.dict.shape(key) else { return Err(self.dict.missing(key)) };
        let rows = shape.first().copied().unwrap_or(0);
        if shape.get(1..) != Some(row) || (rows != of && rows != 1) || rows == 0 {
            let expected = [&[of], row].concat();
            return Err(self.dict.wrong_shape(key, shape, format!("{expected:?}")));
        }
        let Some(place) = self.places.get(key).filter(|place| place.strides.len() == shape.len()) else {
            return Err(self.bad(key, "it is stored in a way of its own; save it with .contiguous()".into()));
        };
        let reach = |shape: &[usize], strides: &[usize]| {
            let steps = shape.iter().zip(strides).map(|(n, stride)| n.saturating_sub(1).saturating_mul(*stride));
            steps.fold(1usize, usize::saturating_add)
        };
        let (spread, all) = (reach(row, &place.strides[1..]), reach(shape, &place.strides));
        let values = row.iter().fold(1usize, |product, n| product.saturating_mul(*n));
        if values > MOST_VALUES || spread > values.saturating_mul(MOST_SPREAD) {
            return Err(self.bad(key, "a row of it is spread over the file; save it with .contiguous()".into()));
        }
        let size = self.dict.reader.get(key).map_or(1, |tensor| tensor.dtype().size());
        let need = place.offset.saturating_add(all).saturating_mul(size) as u64;
        let name = format!("{}data/{}", self.root, place.storage);
        let bad = |reason: String| self.dict.bad(key, reason);
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
        self.dict.bad(key, reason)
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

/// What a pickle of a dict of tensors is made of.
#[derive(Clone, Debug)]
enum Value {
    Text(Rc<str>),
    Int(usize),
    Tuple(Rc<[Value]>),
    Dict(Rc<[(Value, Value)]>),
    Tensor(Rc<Place>),
    /// Whatever else; its parts do not matter.
    Other,
    Mark,
}

/// Places of the tensors of a dict by key; `None` where the pickle is none that `torch.save` writes. Its cost was checked.
fn places(pickle: &[u8]) -> Option<HashMap<String, Place>> {
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

    fn line(&mut self) -> Option<()> {
        let end = self.rest.iter().position(|byte| *byte == b'\n')?;
        self.take(end + 1).map(drop)
    }

    fn text(&mut self, length_bytes: usize) -> Option<Value> {
        let length = self.number(length_bytes)?;
        let text = String::from_utf8_lossy(self.take(length)?).into();
        Some(Value::Text(text))
    }

    /// What was pushed since the last mark.
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
            b'c' => self.line().and_then(|()| self.line()).map(|()| Value::Other)?,
            0x93 => self.tuple(2).map(|_| Value::Other)?,
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
    let [Value::Tuple(storage), Value::Int(offset), Value::Tuple(_), Value::Tuple(strides), ..] = &arguments[..] else {
        return None;
    };
    let [_, _, Value::Text(key), ..] = &storage[..] else { return None };
    let number = |value: &Value| if let Value::Int(number) = value { Some(*number) } else { None };
    let strides = strides.iter().map(number).collect::<Option<_>>()?;
    Some(Place { storage: key.to_string(), offset: *offset, strides })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::pt::{Values, read_dict, write_dict};

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
        let mut rows = dict.rows().unwrap();
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
        assert!(read_dict(&path).and_then(|dict| dict.rows()?.check("a", 200, &[2, 3])).is_err());
    }

    #[test]
    fn views_are_gathered() {
        assert!(contiguous(&[2, 1, 3], &[3, 99, 1]) && !contiguous(&[3, 2], &[1, 3]));
        assert_eq!(gathered(&[0, 1, 2, 3, 4, 5], 1, &[3, 2], &[1, 3]), [0, 3, 1, 4, 2, 5]);
        assert_eq!(gathered(&[0, 1, 2, 3], 2, &[2], &[1]), [0, 1, 2, 3]);
        assert_eq!(places(b"\x80\x02}."), Some(HashMap::new()));
        for bytes in [&b""[..], b"N.", b"}h\x07.", b"t.", b"}(X\xff\xff\xff\xff"] {
            assert_eq!(places(bytes), None, "{bytes:?}");
        }
    }
}
