//! Gray TIFF pictures as depth cameras store them: 16 bits or floats, not compressed. Others are refused by what they are.

use std::path::Path;

use super::files;
use super::images::{MAX_SIDE, PictureError};
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
/// Most entries of the list of properties, and most strips.
const MOST: usize = 1 << 16;

const EXPECTED: &str =
    "a gray TIFF of 16 bits or floats, not compressed and not tiled (tifffile.imwrite(name, array) writes it)";

struct Reader<'a> {
    bytes: &'a [u8],
    little: bool,
}

impl Reader<'_> {
    fn number(&self, at: usize, size: usize) -> Option<usize> {
        let bytes = self.bytes.get(at..at.checked_add(size)?)?;
        let fold = |value: usize, byte: &u8| value << 8 | usize::from(*byte);
        Some(if self.little { bytes.iter().rev().fold(0, fold) } else { bytes.iter().fold(0, fold) })
    }

    /// The whole numbers of a property in the list at `list`; `None` without it.
    fn property(&self, list: usize, tag: usize) -> Option<Vec<usize>> {
        let entries = self.number(list, 2)?;
        let entry = (0..entries).map(|i| list + 2 + 12 * i).find(|at| self.number(*at, 2) == Some(tag))?;
        let size = match self.number(entry + 2, 2)? {
            1 => 1,
            3 => 2,
            4 => 4,
            _ => return None,
        };
        let count = self.number(entry + 4, 4).filter(|count| *count <= MOST)?;
        let at = if count * size <= 4 { entry + 8 } else { self.number(entry + 8, 4)? };
        (0..count).map(|i| self.number(at + size * i, size)).collect()
    }

    fn picture(&self) -> Result<Gray, String> {
        let cut = || "a TIFF that is cut off".to_owned();
        if self.number(2, 2) != Some(42) {
            return Err("a BigTIFF or something else that begins like a TIFF".into());
        }
        let list = self.number(4, 4).ok_or_else(cut)?;
        let one = |tag: usize, default: Option<usize>| {
            let values = self.property(list, tag);
            values.and_then(|values| values.first().copied()).or(default).ok_or_else(cut)
        };
        let (width, height) = (one(256, None)?, one(257, None)?);
        if width.max(height) > MAX_SIDE as usize || width.min(height) == 0 {
            return Err(format!("{width} x {height} pixels"));
        }
        if one(277, Some(1))? != 1 {
            return Err("a TIFF in color".into());
        }
        if one(259, Some(1))? != 1 {
            return Err("a compressed TIFF".into());
        }
        let (bits, float) = (one(258, Some(1))?, one(339, Some(1))? == 3);
        let strips = self.property(list, 273).ok_or("a tiled TIFF")?;
        let sizes = self.property(list, 279).ok_or_else(cut)?;
        let mut values = Vec::new();
        for (at, size) in strips.iter().zip(&sizes) {
            values.extend_from_slice(self.bytes.get(*at..at.saturating_add(*size)).ok_or_else(cut)?);
        }
        let need = width * height * bits / 8;
        let values = values.get(..need).ok_or_else(cut)?;
        let size = (bits / 8).max(1);
        let little = self.little;
        let each = values.chunks_exact(size).map(|value| {
            let mut bytes = [0; 8];
            bytes[..value.len()].copy_from_slice(value);
            if !little {
                bytes[..value.len()].reverse();
            }
            u64::from_le_bytes(bytes)
        });
        let grid = |values: Vec<f32>| Grid::from_vec(width, height, values).map_err(|_| cut());
        Ok(match (bits, float) {
            (8, false) => Gray::U8(grid(each.map(|v| v as f32).collect())?),
            (16, false) => {
                Gray::U16(Grid::from_vec(width, height, each.map(|v| v as u16).collect()).map_err(|_| cut())?)
            }
            (32, true) => Gray::Float(grid(each.map(|v| f32::from_bits(v as u32)).collect())?),
            (64, true) => Gray::Float(grid(each.map(|v| f64::from_bits(v) as f32).collect())?),
            _ => return Err(format!("a TIFF with {bits} bits a pixel{}", if float { " as floats" } else { "" })),
        })
    }
}

/// Reads a gray TIFF.
///
/// # Errors
/// [`PictureError::Kind`] for any other kind.
pub(crate) fn read(file: &Path) -> Result<Gray, PictureError> {
    let bytes = files::read(file, MAX_BYTES).map_err(|source| PictureError::Io { file: file.to_owned(), source })?;
    let kind = |found| PictureError::Kind { file: file.to_owned(), found, expected: EXPECTED };
    let little = match bytes.get(..2) {
        Some(b"II") => true,
        Some(b"MM") => false,
        _ => return Err(kind("no TIFF".into())),
    };
    Reader { bytes: &bytes, little }.picture().map_err(kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A TIFF of 3 x 2 pixels in two strips.
    fn file(little: bool, bits: u16, format: u16, compression: u16, values: &[u8]) -> Vec<u8> {
        let two = |v: u16| if little { v.to_le_bytes() } else { v.to_be_bytes() };
        let four = |v: u32| if little { v.to_le_bytes() } else { v.to_be_bytes() };
        let half = values.len() as u32 / 2;
        let properties = [
            (256u16, 4u16, 1u32, 3u32),
            (257, 4, 1, 2),
            (258, 4, 1, bits.into()),
            (259, 4, 1, compression.into()),
            (273, 4, 2, 8 + 2 + 12 * 7 + 4),
            (279, 4, 2, 8 + 2 + 12 * 7 + 4 + 8),
            (339, 4, 1, format.into()),
        ];
        let start = 8 + 2 + 12 * 7 + 4 + 16;
        let mut out = if little { b"II".to_vec() } else { b"MM".to_vec() };
        out.extend(two(42));
        out.extend(four(8));
        out.extend(two(7));
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
        for (bytes, says) in [
            (file(true, 16, 1, 5, &[0; 12]), "compressed"),
            (file(true, 12, 1, 1, &[0; 12]), "12 bits"),
            (file(true, 16, 1, 1, &[0; 10]), "cut off"),
            (b"II\x2b\0".to_vec(), "BigTIFF"),
            (b"no".to_vec(), "no TIFF"),
        ] {
            let why = read(&bytes).unwrap_err();
            assert!(why.contains(says) && why.contains("a.tif"), "{why}");
        }
        let whole = file(true, 16, 1, 1, &[0; 12]);
        for cut in 0..whole.len() {
            assert!(read(&whole[..cut]).is_err(), "{cut}");
        }
    }
}
