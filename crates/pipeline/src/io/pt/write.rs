//! The writer: pickle protocol 2 in an uncompressed zip, one storage per tensor.

use std::io::{Seek, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::{Tensor, Values};
use crate::io::archive;
use crate::io::error::FileError;

/// A value of the dict to be written.
#[derive(Clone, Debug, PartialEq)]
pub enum PtItem {
    /// A tensor on the CPU.
    Tensor(Tensor),
    /// A list of texts.
    Texts(Vec<String>),
    /// A text.
    Text(String),
    /// A Python float.
    Float(f64),
}

impl From<Tensor> for PtItem {
    fn from(tensor: Tensor) -> Self {
        Self::Tensor(tensor)
    }
}

/// `torch.save` aligns storages to this many bytes, so that they can be mapped into memory.
const ALIGNMENT: u16 = 64;

/// Writes a dict that `torch.load(path, weights_only=True)` reads; the order of keys is kept.
///
/// The bytes depend on the content only. The file is written beside its place and renamed when complete.
///
/// # Errors
/// [`FileError`]: before anything is written, of values that do not fill a shape; if the disk refuses.
pub fn write_dict(path: &Path, items: &[(&str, PtItem)]) -> Result<(), FileError> {
    for (key, item) in items {
        if let PtItem::Tensor(tensor) = item {
            let len = tensor.values.len();
            if len != tensor.shape.iter().product::<usize>() {
                let what = format!("key \"{key}\": {len} values do not fill shape {:?}", tensor.shape);
                return Err(FileError::new(path, what, "give as many values as the shape has"));
            }
        }
    }
    archive::write(path, |zip| fill(zip, items)).map_err(|err| FileError::io(path, "cannot write the file", err))
}

fn fill<W: Write + Seek>(zip: &mut ZipWriter<W>, items: &[(&str, PtItem)]) -> std::io::Result<()> {
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored).with_alignment(ALIGNMENT);
    zip.start_file("archive/data.pkl", options)?;
    zip.write_all(&pickle(items))?;
    zip.start_file("archive/byteorder", options)?;
    zip.write_all(b"little")?;
    for (number, tensor) in tensors(items).enumerate() {
        zip.start_file(format!("archive/data/{number}"), options)?;
        zip.write_all(&tensor.values.bytes())?;
    }
    zip.start_file("archive/version", options)?;
    zip.write_all(b"3\n")
}

fn tensors<'a>(items: &'a [(&str, PtItem)]) -> impl Iterator<Item = &'a Tensor> {
    items.iter().filter_map(|(_, item)| match item {
        PtItem::Tensor(tensor) => Some(tensor),
        _ => None,
    })
}

/// The pickle of the dict. Opcodes: see `pickletools` of the Python library.
fn pickle(items: &[(&str, PtItem)]) -> Vec<u8> {
    let mut out = vec![0x80, 2]; // PROTO 2
    out.extend(b"}("); // EMPTY_DICT, MARK
    let mut storage = 0;
    for (key, item) in items {
        text(&mut out, key);
        match item {
            PtItem::Tensor(t) => {
                tensor(&mut out, t, storage);
                storage += 1;
            }
            PtItem::Texts(texts) => {
                out.extend(b"]("); // EMPTY_LIST, MARK
                for t in texts {
                    text(&mut out, t);
                }
                out.push(b'e'); // APPENDS
            }
            PtItem::Text(t) => text(&mut out, t),
            PtItem::Float(x) => {
                out.push(b'G'); // BINFLOAT is big-endian
                out.extend(x.to_be_bytes());
            }
        }
    }
    out.extend(b"u."); // SETITEMS, STOP
    out
}

/// BINUNICODE. A text beyond 4 GiB cannot be in memory twice; the length is saturated rather than wrapped.
fn text(out: &mut Vec<u8>, value: &str) {
    out.push(b'X');
    out.extend(u32::try_from(value.len()).unwrap_or(u32::MAX).to_le_bytes());
    out.extend(value.as_bytes());
}

/// BININT where it fits, else LONG1 with 8 bytes.
fn int(out: &mut Vec<u8>, value: usize) {
    if let Ok(small) = i32::try_from(value) {
        out.push(b'J');
        out.extend(small.to_le_bytes());
    } else {
        out.extend([0x8a, 8]);
        out.extend((value as u64).to_le_bytes());
    }
}

fn int_tuple(out: &mut Vec<u8>, values: &[usize]) {
    out.push(b'('); // MARK
    for &v in values {
        int(out, v);
    }
    out.push(b't'); // TUPLE
}

/// `torch._utils._rebuild_tensor_v2(storage, 0, shape, stride, False, OrderedDict())`.
fn tensor(out: &mut Vec<u8>, tensor: &Tensor, storage: usize) {
    let class = match &tensor.values {
        Values::F32(_) => "FloatStorage",
        Values::F64(_) => "DoubleStorage",
        Values::U8(_) => "ByteStorage",
        Values::I64(_) => "LongStorage",
    };
    out.extend(b"ctorch._utils\n_rebuild_tensor_v2\n(("); // GLOBAL, MARK (arguments), MARK (storage)
    text(out, "storage");
    out.extend(format!("ctorch\n{class}\n").bytes());
    text(out, &storage.to_string());
    text(out, "cpu");
    int(out, tensor.values.len());
    out.extend(b"tQ"); // TUPLE, BINPERSID
    int(out, 0);
    int_tuple(out, &tensor.shape);
    let mut strides = vec![1usize; tensor.shape.len()];
    for i in (1..strides.len()).rev() {
        strides[i - 1] = strides[i] * tensor.shape[i].max(1);
    }
    int_tuple(out, &strides);
    out.push(0x89); // NEWFALSE: no gradient
    out.extend(b"ccollections\nOrderedDict\n)R"); // no backward hooks
    out.extend(b"tR"); // TUPLE, REDUCE
}
