//! Gray TIFF pictures as depth cameras store them: 8 or 16 bits, or floats. Others are refused by what they are.

use std::io::Cursor;
use std::path::Path;

use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult};

use super::error::FileError;
use super::files;
use super::images::{MAX_SIDE, cannot_access, wrong_kind};
use touch2touch_core::grid::Grid;

/// Values of a picture.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Gray {
    /// 8 bits.
    U8(Grid<f32>),
    /// 16 bits.
    U16(Grid<u16>),
    /// Floats.
    Float(Grid<f32>),
}

/// Most bytes of a file: what a picture of the largest size takes in doubles.
const MAX_BYTES: u64 = 160 << 20;

const EXPECTED: &str = "a gray TIFF of 16 bits or floats (tifffile.imwrite(name, array) writes it)";

/// Reads a gray TIFF.
///
/// # Errors
/// [`FileError`] for any other kind.
pub(crate) fn read(file: &Path) -> Result<Gray, FileError> {
    let bytes = files::read(file, MAX_BYTES).map_err(|err| cannot_access(file, err))?;
    decode(bytes).map_err(|found| wrong_kind(file, found, EXPECTED))
}

fn decode(bytes: Vec<u8>) -> Result<Gray, String> {
    let fail = |err: tiff::TiffError| format!("not a readable TIFF ({err})");
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(fail)?;
    let (width, height) = decoder.dimensions().map_err(fail)?;
    if width.max(height) > MAX_SIDE || width.min(height) == 0 {
        return Err(format!("{width} x {height} pixels"));
    }
    let color = decoder.colortype().map_err(fail)?;
    if !matches!(color, ColorType::Gray(_)) {
        return Err(format!("a TIFF in color ({color:?})"));
    }
    let size = [width as usize, height as usize];
    Ok(match decoder.read_image().map_err(fail)? {
        DecodingResult::U8(values) => Gray::U8(grid(size, values.into_iter().map(f32::from).collect())?),
        DecodingResult::U16(values) => Gray::U16(grid(size, values)?),
        DecodingResult::F32(values) => Gray::Float(grid(size, values)?),
        DecodingResult::F64(values) => Gray::Float(grid(size, values.into_iter().map(|v| v as f32).collect())?),
        _ => return Err("a TIFF of other numbers".into()),
    })
}

fn grid<T: Copy>([width, height]: [usize; 2], values: Vec<T>) -> Result<Grid<T>, String> {
    Grid::from_vec(width, height, values).map_err(|err| err.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A TIFF of 3 x 2 pixels in two strips.
    fn file(little: bool, bits: u16, format: u16, compression: u16, values: &[u8]) -> Vec<u8> {
        let two = |v: u16| if little { v.to_le_bytes() } else { v.to_be_bytes() };
        let four = |v: u32| if little { v.to_le_bytes() } else { v.to_be_bytes() };
        let half = values.len() as u32 / 2;
        let lists = 8 + 2 + 12 * 9 + 4;
        let properties = [
            (256u16, 4u16, 1u32, 3u32),
            (257, 4, 1, 2),
            (258, 4, 1, bits.into()),
            (259, 4, 1, compression.into()),
            (262, 4, 1, 1),
            (273, 4, 2, lists),
            (278, 4, 1, 1),
            (279, 4, 2, lists + 8),
            (339, 4, 1, format.into()),
        ];
        let start = lists + 16;
        let mut out = if little { b"II".to_vec() } else { b"MM".to_vec() };
        out.extend(two(42));
        out.extend(four(8));
        out.extend(two(9));
        for (tag, kind, count, value) in properties {
            out.extend([two(tag), two(kind)].concat());
            out.extend([four(count), four(value)].concat());
        }
        out.extend(four(0));
        out.extend([four(start), four(start + half), four(half), four(half)].concat());
        out.extend(values);
        out
    }

    #[test]
    fn depths_are_read_and_the_rest_is_named() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.tif");
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            super::read(&path).map_err(|err| err.to_string())
        };
        let levels = [1u16, 2, 3, 500, 5, 65_535];
        let depths = [0.5f32, -1.0, 2.0, f32::NAN, 0.25, 1e-3];
        for little in [true, false] {
            let bytes: Vec<u8> =
                levels.iter().flat_map(|v| if little { v.to_le_bytes() } else { v.to_be_bytes() }).collect();
            assert_eq!(
                read(&file(little, 16, 1, 1, &bytes)),
                Ok(Gray::U16(Grid::from_vec(3, 2, levels.to_vec()).unwrap()))
            );
            let bytes: Vec<u8> =
                depths.iter().flat_map(|v| if little { v.to_le_bytes() } else { v.to_be_bytes() }).collect();
            let Ok(Gray::Float(grid)) = read(&file(little, 32, 3, 1, &bytes)) else { panic!("floats") };
            assert!(grid.as_slice().iter().zip(&depths).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
        let whole = file(true, 16, 1, 1, &[0; 12]);
        for bytes in [&whole[..whole.len() - 1], &whole[..40], b"no", b""] {
            let why = read(bytes).unwrap_err();
            assert!(why.contains("not a readable TIFF") && why.contains("a.tif"), "{why}");
        }
        let why = read(&file(true, 32, 1, 1, &[0; 24])).unwrap_err();
        assert!(why.contains("other numbers"), "{why}");
    }
}
