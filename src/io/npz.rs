//! numpy's `.npz`: a zip of arrays.

use std::collections::BTreeMap;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use npyz::{NpyFile, Order, TypeChar, WriterBuilder as _};

use super::atomic;
use super::pt::{Tensor, Values};
use crate::domain::grid::{Grid, RgbGrid};

/// Why an `.npz` file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum NpzError {
    /// The file cannot be opened.
    #[error("cannot read or write the file ({}): {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Not a zip archive, or a damaged one.
    #[error("not a readable .npz archive: {reason} ({})", file.display())]
    Archive {
        /// The file.
        file: PathBuf,
        /// What was found.
        reason: String,
    },
    /// An array that cannot be read.
    #[error("array \"{name}\" cannot be read: {reason} ({})", file.display())]
    Array {
        /// The file.
        file: PathBuf,
        /// The array's name.
        name: String,
        /// What was found.
        reason: String,
    },
}

/// Writes an image as numpy's `.npy`: `f32`, shape `(height, width)`, row-major.
///
/// # Errors
/// [`NpzError::Io`] if the file cannot be written.
pub fn write_npy(file: &Path, image: &Grid<f32>) -> Result<(), NpzError> {
    write_values(file, &[image.height() as u64, image.width() as u64], image.as_slice())
}

/// Writes the planes of a color picture as `.npy`: f32, 3 x height x width.
///
/// # Errors
/// [`NpzError::Io`] if the file cannot be written.
pub fn write_npy_planes(file: &Path, picture: &RgbGrid) -> Result<(), NpzError> {
    let values: Vec<f32> = (0..3).flat_map(|c| picture.as_slice().iter().map(move |pixel| pixel[c])).collect();
    write_values(file, &[3, picture.height() as u64, picture.width() as u64], &values)
}

fn write_values(file: &Path, shape: &[u64], values: &[f32]) -> Result<(), NpzError> {
    atomic::write(file, |out| {
        // Buffered: the writer hands over value by value.
        let mut bytes = Vec::with_capacity(128 + 4 * values.len());
        let mut writer = npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut bytes).begin_nd()?;
        writer.extend(values)?;
        writer.finish()?;
        out.write_all(&bytes)
    })
    .map_err(|source| NpzError::Io { file: file.to_owned(), source })
}

/// Writes arrays of numbers under their names, compressed, row-major.
///
/// # Errors
/// [`NpzError::Array`] if an array's shape and values disagree, [`NpzError::Io`] if the file cannot be written.
pub fn write(path: &Path, arrays: &[(&str, Tensor)]) -> Result<(), NpzError> {
    for (name, tensor) in arrays {
        let shape = &tensor.shape;
        let len = match &tensor.values {
            Values::F32(v) => v.len(),
            Values::F64(v) => v.len(),
            Values::U8(v) => v.len(),
            Values::I64(v) => v.len(),
        };
        if shape.iter().product::<usize>() != len {
            let reason = format!("{len} values do not fill the shape {shape:?}");
            return Err(NpzError::Array { file: path.to_owned(), name: (*name).to_owned(), reason });
        }
    }
    atomic::write(path, |out| {
        let mut zip = zip::ZipWriter::new(out);
        for (name, tensor) in arrays {
            zip.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default())?;
            zip.write_all(&npy_bytes(tensor)?)?;
        }
        zip.finish()?;
        Ok(())
    })
    .map_err(|source| NpzError::Io { file: path.to_owned(), source })
}

fn npy_bytes(tensor: &Tensor) -> std::io::Result<Vec<u8>> {
    fn bytes<T: npyz::AutoSerialize>(shape: &[usize], values: &[T]) -> std::io::Result<Vec<u8>> {
        let shape: Vec<u64> = shape.iter().map(|&n| n as u64).collect();
        let mut bytes = Vec::with_capacity(128 + size_of_val(values));
        let mut writer = npyz::WriteOptions::new().default_dtype().shape(&shape).writer(&mut bytes).begin_nd()?;
        writer.extend(values)?;
        writer.finish()?;
        Ok(bytes)
    }
    match &tensor.values {
        Values::F32(v) => bytes(&tensor.shape, v),
        Values::F64(v) => bytes(&tensor.shape, v),
        Values::U8(v) => bytes(&tensor.shape, v),
        Values::I64(v) => bytes(&tensor.shape, v),
    }
}

/// An array larger than this is refused: a damaged header must not ask for all memory.
const MAX_BYTES: u64 = 1 << 31;

/// Reads all arrays of numbers, row-major, by name. Integers other than `u8` become `i64`.
///
/// # Errors
/// [`NpzError`]; arrays of other things than numbers (texts, objects) are errors too.
pub fn read(path: &Path) -> Result<BTreeMap<String, Tensor>, NpzError> {
    let file = std::fs::File::open(path).map_err(|source| NpzError::Io { file: path.to_owned(), source })?;
    let archive = |err: zip::result::ZipError| NpzError::Archive { file: path.to_owned(), reason: err.to_string() };
    let mut zip = zip::ZipArchive::new(std::io::BufReader::new(file)).map_err(archive)?;
    let mut arrays = BTreeMap::new();
    for index in 0..zip.len() {
        let mut entry = zip.by_index(index).map_err(archive)?;
        let Some(name) = String::from_utf8_lossy(entry.name_raw()).strip_suffix(".npy").map(str::to_owned) else {
            continue;
        };
        let failed = |reason: String| NpzError::Array { file: path.to_owned(), name: name.clone(), reason };
        if entry.size() > MAX_BYTES {
            return Err(failed(format!("{} bytes is too large", entry.size())));
        }
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).map_err(|err| failed(err.to_string()))?;
        let tensor = array(&bytes).map_err(failed)?;
        arrays.insert(name, tensor);
    }
    Ok(arrays)
}

fn array(bytes: &[u8]) -> Result<Tensor, String> {
    let npy = NpyFile::new(bytes).map_err(|err| err.to_string())?;
    let shape: Vec<usize> = npy.shape().iter().map(|&n| n as usize).collect();
    let fortran = npy.order() == Order::Fortran;
    let npyz::DType::Plain(kind) = npy.dtype() else { return Err("it is an array of records".into()) };
    // Beyond the file's own length nothing can be read, so the header cannot ask for more.
    if npy.len() > bytes.len() as u64 {
        return Err(format!("{:?} values do not fit into {} bytes", shape, bytes.len()));
    }
    let text = kind.to_string();
    macro_rules! values {
        ($t:ty) => {
            npy.into_vec::<$t>().map_err(|err| err.to_string())?
        };
    }
    let whole = |v: Vec<i64>| Values::I64(v);
    let values = match (kind.type_char(), kind.size_field()) {
        (TypeChar::Float, 4) => Values::F32(values!(f32)),
        (TypeChar::Float, 8) => Values::F64(values!(f64)),
        (TypeChar::Uint, 1) => Values::U8(values!(u8)),
        (TypeChar::Bool, 1) => Values::U8(values!(bool).into_iter().map(u8::from).collect()),
        (TypeChar::Uint, 2) => whole(values!(u16).into_iter().map(i64::from).collect()),
        (TypeChar::Uint, 4) => whole(values!(u32).into_iter().map(i64::from).collect()),
        (TypeChar::Int, 1) => whole(values!(i8).into_iter().map(i64::from).collect()),
        (TypeChar::Int, 2) => whole(values!(i16).into_iter().map(i64::from).collect()),
        (TypeChar::Int, 4) => whole(values!(i32).into_iter().map(i64::from).collect()),
        (TypeChar::Int, 8) => whole(values!(i64)),
        _ => return Err(format!("its element type {text} is not supported")),
    };
    let values = if fortran && shape.len() > 1 { row_major(&shape, values) } else { values };
    Ok(Tensor { shape, values })
}

/// Reorders values whose first index runs fastest.
fn row_major(shape: &[usize], values: Values) -> Values {
    fn reorder<T: Copy>(shape: &[usize], values: &[T]) -> Vec<T> {
        let mut index = vec![0usize; shape.len()];
        let mut out = Vec::with_capacity(values.len());
        for _ in 0..values.len() {
            let at = index.iter().zip(shape).rev().fold(0, |at, (&i, &n)| at * n + i);
            out.push(values[at]);
            for axis in (0..shape.len()).rev() {
                index[axis] += 1;
                if index[axis] < shape[axis] {
                    break;
                }
                index[axis] = 0;
            }
        }
        out
    }
    match values {
        Values::F32(v) => Values::F32(reorder(shape, &v)),
        Values::F64(v) => Values::F64(reorder(shape, &v)),
        Values::U8(v) => Values::U8(reorder(shape, &v)),
        Values::I64(v) => Values::I64(reorder(shape, &v)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A version 1.0 header and the data.
    fn npy(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let mut header = format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}");
        while !(header.len() + 11).is_multiple_of(64) {
            header.push(' ');
        }
        header.push('\n');
        let mut out = b"\x93NUMPY\x01\x00".to_vec();
        out.extend((header.len() as u16).to_le_bytes());
        out.extend(header.bytes());
        out.extend(data);
        out
    }

    fn write(path: &Path, entries: &[(&str, Vec<u8>)]) {
        let mut zip = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
        for (name, bytes) in entries {
            zip.start_file(*name, zip::write::SimpleFileOptions::default()).unwrap();
            zip.write_all(bytes).unwrap();
        }
        zip.finish().unwrap();
    }

    #[test]
    fn arrays_are_read_in_either_order() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        let f32s = |v: &[f32]| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        write(
            &path,
            &[
                ("c.npy", npy("<f4", "False", "(2, 3)", &f32s(&[0., 1., 2., 3., 4., 5.]))),
                ("fortran.npy", npy("<f4", "True", "(2, 3)", &f32s(&[0., 3., 1., 4., 2., 5.]))),
                ("theta.npy", npy("<f8", "False", "()", &(-0.25f64).to_le_bytes())),
                ("big.npy", npy(">i4", "False", "(1,)", &[0, 0, 1, 0])),
                ("flag.npy", npy("|b1", "False", "(2,)", &[1, 0])),
                ("readme.txt", b"hello".to_vec()),
            ],
        );
        let arrays = read(&path).unwrap();
        assert_eq!(arrays["c"], Tensor::f32(&[2, 3], vec![0., 1., 2., 3., 4., 5.]));
        assert_eq!(arrays["fortran"], arrays["c"]);
        assert_eq!(arrays["theta"], Tensor::f64(&[], vec![-0.25]));
        assert_eq!(arrays["big"].values, Values::I64(vec![256]));
        assert_eq!(arrays["flag"].values, Values::U8(vec![1, 0]));
        assert_eq!(arrays.len(), 5);
    }

    #[test]
    fn a_written_image_is_an_array() {
        let dir = tempfile::tempdir().unwrap();
        for width in [1, 7, 64] {
            let image = Grid::from_fn(width, 3, |x, y| x as f32 - 0.1 * y as f32);
            let path = dir.path().join("i.npy");
            write_npy(&path, &image).unwrap();
            let read = array(&std::fs::read(&path).unwrap()).unwrap();
            assert_eq!(read, Tensor::f32(&[3, width], image.into_vec()));
        }
    }

    #[test]
    fn damaged_archives_and_arrays_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npz");
        for (entry, word) in [
            (npy("<f4", "False", "(4000000000000,)", &[0; 8]), "do not fit"),
            (npy("<f4", "False", "(3,)", &[0; 8]), "cannot be read"),
            (npy("<U5", "False", "(1,)", &[0; 20]), "not supported"),
            (b"junk".to_vec(), "cannot be read"),
        ] {
            write(&path, &[("x.npy", entry)]);
            let text = read(&path).unwrap_err().to_string();
            assert!(text.contains(word) && text.contains("\"x\""), "{text}");
        }
        std::fs::write(&path, b"not a zip").unwrap();
        assert!(matches!(read(&path), Err(NpzError::Archive { .. })));
        assert!(matches!(read(&dir.path().join("none.npz")), Err(NpzError::Io { .. })));
    }
}
