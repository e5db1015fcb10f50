//! numpy's `.npz`: a zip of arrays.

mod npy;

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use super::error::FileError;
use super::pt::{Tensor, Values};
use super::{archive, atomic, files};
use touch2touch_core::grid::{Grid, RgbGrid};

const SAVE_AGAIN: &str = "save it again with numpy";

fn io(file: &Path, err: std::io::Error) -> FileError {
    FileError::io(file, "cannot read or write the file", err)
}

fn bad_array(file: &Path, name: &str, reason: String) -> FileError {
    FileError::new(file, format!("array \"{name}\" cannot be read: {reason}"), SAVE_AGAIN)
}

/// Writes an image as numpy's `.npy`: `f32`, shape `(height, width)`, row-major.
///
/// # Errors
/// [`FileError`] if the file cannot be written.
pub fn write_npy(file: &Path, image: &Grid<f32>) -> Result<(), FileError> {
    write_values(file, &[image.height(), image.width()], Values::F32(image.as_slice().to_vec()))
}

/// Reads a `.npy` file of numbers, row-major. Integers other than `u8` become `i64`.
///
/// # Errors
/// [`FileError`].
pub fn read_npy(file: &Path) -> Result<Tensor, FileError> {
    let io = |err| io(file, err);
    let name = file.file_stem().map(|name| files::clip(&name.to_string_lossy())).unwrap_or_default();
    let failed = |reason| bad_array(file, &name, reason);
    let opened = files::open(file).map_err(io)?;
    let size = opened.metadata().map_err(io)?.len();
    let mut from = std::io::BufReader::new(opened);
    let header = npy::header(&mut from, MAX_VALUES).map_err(failed)?;
    header.values(&mut from, size).map_err(failed)
}

/// Writes the planes of a color picture as `.npy`: f32, 3 x height x width.
///
/// # Errors
/// [`FileError`] if the file cannot be written.
pub fn write_npy_planes(file: &Path, picture: &RgbGrid) -> Result<(), FileError> {
    let values = (0..3).flat_map(|c| picture.as_slice().iter().map(move |pixel| pixel[c])).collect();
    write_values(file, &[3, picture.height(), picture.width()], Values::F32(values))
}

fn write_values(file: &Path, shape: &[usize], values: Values) -> Result<(), FileError> {
    let bytes = npy::bytes(shape, &values);
    atomic::write_bytes(file, &bytes).map_err(|err| io(file, err))
}

/// Writes arrays of numbers under their names, compressed, row-major.
///
/// # Errors
/// [`FileError`] if an array's shape and values disagree, or if the file cannot be written.
pub fn write(path: &Path, arrays: &[(&str, Tensor)]) -> Result<(), FileError> {
    for (name, tensor) in arrays {
        let (shape, len) = (&tensor.shape, tensor.values.len());
        if shape.iter().product::<usize>() != len {
            return Err(bad_array(path, name, format!("{len} values do not fill the shape {shape:?}")));
        }
    }
    archive::write(path, |zip| {
        for (name, tensor) in arrays {
            zip.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default())?;
            zip.write_all(&npy::bytes(&tensor.shape, &tensor.values))?;
        }
        Ok(())
    })
    .map_err(|err| io(path, err))
}

/// Most values of all arrays of a file together: two cameras' images at 1920 x 1080, four of each.
const MAX_VALUES: usize = 1 << 24;
/// Most arrays of a file.
const MAX_ARRAYS: usize = 1000;

/// Reads all arrays of numbers, row-major, by name. Integers other than `u8` become `i64`.
///
/// # Errors
/// [`FileError`]; arrays of other things than numbers (texts, objects) are errors too.
pub fn read(path: &Path) -> Result<BTreeMap<String, Tensor>, FileError> {
    let file = files::open(path).map_err(|err| io(path, err))?;
    read_from(path, std::io::BufReader::new(file))
}

/// [`read`] of a file whose bytes are there; `path` is for messages.
///
/// # Errors
/// As [`read`].
pub(crate) fn read_bytes(path: &Path, bytes: &[u8]) -> Result<BTreeMap<String, Tensor>, FileError> {
    read_from(path, std::io::Cursor::new(bytes))
}

fn read_from(path: &Path, file: impl std::io::Read + std::io::Seek) -> Result<BTreeMap<String, Tensor>, FileError> {
    let archive = |reason: String| {
        FileError::new(path, format!("not a readable .npz archive: {}", files::clip(&reason)), SAVE_AGAIN)
    };
    let mut zip = zip::ZipArchive::new(file).map_err(|err| archive(err.to_string()))?;
    if zip.len() > MAX_ARRAYS {
        return Err(archive(format!("it has {} entries; at most {MAX_ARRAYS} are read", zip.len())));
    }
    let mut arrays = BTreeMap::new();
    let mut room = MAX_VALUES;
    for index in 0..zip.len() {
        let mut entry = zip.by_index(index).map_err(|err| archive(err.to_string()))?;
        let Some(name) = String::from_utf8_lossy(entry.name_raw()).strip_suffix(".npy").map(str::to_owned) else {
            continue;
        };
        let failed = |reason| bad_array(path, &files::clip(&name), reason);
        let size = entry.size();
        let header = npy::header(&mut entry, room).map_err(failed)?;
        room -= header.count;
        let tensor = header.values(&mut entry, size).map_err(failed)?;
        arrays.insert(name, tensor);
    }
    Ok(arrays)
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
}
