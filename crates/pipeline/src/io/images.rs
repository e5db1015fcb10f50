//! Pictures (PNG, and JPEG for reading) to and from [`Grid`]s.

use std::fmt::Display;
use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ExtendedColorType, ImageDecoder as _, ImageFormat, ImageReader};

use super::error::FileError;
use super::files;
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};

/// Most pixels a side. A file of a few kilobytes can announce a thousand times more.
pub(crate) const MAX_SIDE: u32 = 4096;
/// Most bytes of a file: what a picture of that size takes without compression.
const MAX_BYTES: u64 = 256 << 20;

fn decode(path: &Path) -> Result<DynamicImage, FileError> {
    let bytes = files::read(path, MAX_BYTES).map_err(|err| cannot_access(path, err))?;
    let jpeg = bytes.starts_with(&[0xff, 0xd8]);
    // A JPEG decoder fills what is cut off with gray: the end mark tells a whole file from one being written.
    if jpeg && jpeg_end(&bytes).is_none() {
        return Err(unreadable(path, "the end of the JPEG is missing"));
    }
    let mut reader = ImageReader::new(Cursor::new(bytes));
    reader.set_format(if jpeg { ImageFormat::Jpeg } else { ImageFormat::Png });
    let failed = |err| unreadable(path, err);
    // The size is in the header: it is looked at before there is room for a single pixel.
    let mut decoder = reader.into_decoder().map_err(failed)?;
    let (width, height) = decoder.dimensions();
    if width.max(height) > MAX_SIDE {
        let what = format!("the picture is {width} x {height} pixels; at most {MAX_SIDE} a side are read");
        let hint = "save the picture smaller: the sensors have fewer than 500 pixels a side";
        return Err(FileError::new(path, what, hint));
    }
    // Cameras and phones store pictures as the sensor lies and say how they are to be turned.
    let orientation = decoder.orientation().map_err(failed)?;
    let mut image = DynamicImage::from_decoder(decoder).map_err(failed)?;
    image.apply_orientation(orientation);
    Ok(image)
}

pub(super) fn cannot_access(path: &Path, err: std::io::Error) -> FileError {
    FileError::io(path, "cannot access the picture", err)
}

fn unreadable(path: &Path, err: impl Display) -> FileError {
    FileError::new(path, format!("not a readable PNG or JPEG: {err}"), "copy or save the picture again")
}

/// The refusal of a picture with other channels, another depth or other values than are needed.
pub(super) fn wrong_kind(path: &Path, found: impl Display, expected: &str) -> FileError {
    let what = format!("the picture is {found}, expected {expected}");
    FileError::new(path, what, "save the picture again in that form")
}

/// Place behind the end mark of a JPEG; `None` where there is none.
fn jpeg_end(bytes: &[u8]) -> Option<usize> {
    let mut at = 2;
    loop {
        match [*bytes.get(at)?, *bytes.get(at + 1)?] {
            [0xff, 0xd9] => return Some(at + 2),
            // No marker, or one without a segment, as they stand in compressed data.
            [0xff, 0x00 | 0x01 | 0xd0..=0xd8 | 0xff] | [0..=0xfe, _] => at += 1,
            _ => at += 2 + usize::from(u16::from_be_bytes([*bytes.get(at + 2)?, *bytes.get(at + 3)?])),
        }
    }
}

/// Bytes behind the end of a JPEG, as cameras leave them that write whole buffers; none of a file that cannot be read.
pub(crate) fn bytes_behind(path: &Path) -> usize {
    let Ok(bytes) = files::read(path, MAX_BYTES) else { return 0 };
    let bytes = bytes.trim_ascii_end();
    let end = bytes.starts_with(&[0xff, 0xd8]).then(|| jpeg_end(bytes)).flatten();
    end.map_or(0, |end| bytes.len() - end)
}

/// Turns decoded bytes into a grid. The decoder guarantees the length.
fn grid<T: Copy>(width: u32, height: u32, pixels: Vec<T>) -> Grid<T> {
    let (width, height) = (width as usize, height as usize);
    Grid::from_vec(width, height, pixels).expect("a decoder fills every pixel")
}

/// Reads any PNG or JPEG as color on the 0..255 scale; gray is repeated, 16 bits are scaled down, alpha is dropped.
///
/// # Errors
/// [`FileError`].
pub fn read_rgb(path: &Path) -> Result<RgbGrid, FileError> {
    let image = decode(path)?;
    let (w, h) = (image.width(), image.height());
    Ok(match image {
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) | DynamicImage::ImageLuma16(_) => {
            let pixels = image.into_rgb16().pixels().map(|p| p.0.map(|v| f32::from(v) / 257.0)).collect();
            grid(w, h, pixels)
        }
        other => grid(w, h, other.into_rgb8().pixels().map(|p| p.0.map(f32::from)).collect()),
    })
}

/// Reads any PNG or JPEG as gray on the 0..255 scale; 16 bits keep their fractions, color is weighted, alpha is dropped.
///
/// # Errors
/// [`FileError`].
pub fn read_gray(path: &Path) -> Result<Grid<f32>, FileError> {
    Ok(gray(decode(path)?))
}

fn gray(image: DynamicImage) -> Grid<f32> {
    let (w, h) = (image.width(), image.height());
    match image {
        DynamicImage::ImageLuma8(_)
        | DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageRgb8(_)
        | DynamicImage::ImageRgba8(_) => grid(w, h, image.into_luma8().into_raw().into_iter().map(f32::from).collect()),
        other => grid(w, h, other.into_luma16().into_raw().into_iter().map(|v| f32::from(v) / 257.0).collect()),
    }
}

/// Reads a gray picture of 16 bits value by value; any other as [`read_gray`] does.
///
/// # Errors
/// [`FileError`].
pub(crate) fn read_depth(path: &Path) -> Result<Result<Grid<u16>, Grid<f32>>, FileError> {
    match decode(path)? {
        DynamicImage::ImageLuma16(image) => Ok(Ok(grid(image.width(), image.height(), image.into_raw()))),
        other => Ok(Err(gray(other))),
    }
}

/// Reads a PNG that must be 8-bit gray without alpha, value by value.
///
/// # Errors
/// [`FileError`] for any other kind.
pub fn read_gray8(path: &Path) -> Result<Grid<u8>, FileError> {
    match decode(path)? {
        DynamicImage::ImageLuma8(image) => Ok(grid(image.width(), image.height(), image.into_raw())),
        other => Err(wrong_kind(path, format_args!("{:?}", other.color()), "8-bit gray")),
    }
}

/// Reads the levels of a mask: gray, or black and one color, however it is stored (palette, alpha, 16 bits). What is
/// transparent is black; the one color is 255.
///
/// # Errors
/// [`FileError`] for a picture of several colors.
pub(crate) fn read_mask(path: &Path) -> Result<Grid<u16>, FileError> {
    let image = match decode(path)? {
        DynamicImage::ImageLuma8(image) => {
            return Ok(grid(image.width(), image.height(), image.into_raw().into_iter().map(u16::from).collect()));
        }
        DynamicImage::ImageLuma16(image) => return Ok(grid(image.width(), image.height(), image.into_raw())),
        other => other,
    };
    let colors = image.to_rgba8();
    let visible = colors.pixels().map(|p| if p.0[3] < 128 { [0; 3] } else { [p.0[0], p.0[1], p.0[2]] });
    let mut color = None;
    let level = |pixel: [u8; 3]| {
        if pixel == [0; 3] {
            return Some(0);
        }
        (*color.get_or_insert(pixel) == pixel).then_some(255)
    };
    match visible.map(level).collect() {
        Some(levels) => Ok(grid(image.width(), image.height(), levels)),
        None => Err(wrong_kind(path, format_args!("{:?}", image.color()), "gray, or black and one other color")),
    }
}

/// Writes 8-bit gray.
///
/// # Errors
/// [`FileError`].
pub fn write_gray8(path: &Path, picture: &Grid<u8>) -> Result<(), FileError> {
    encode(path, picture.as_slice(), picture.size(), ExtendedColorType::L8)
}

/// Writes an imprint (meters) as 16-bit gray for people: steps of 0.001 mm from -20 mm.
///
/// # Errors
/// [`FileError`].
pub fn write_depth16(path: &Path, imprint: &DepthMap) -> Result<(), FileError> {
    write_gray16(path, &imprint.map(|&d| ((d + 0.02) * 1e6).clamp(0.0, 65535.0) as u16))
}

/// Writes 16-bit gray.
fn write_gray16(path: &Path, picture: &Grid<u16>) -> Result<(), FileError> {
    // The encoder takes native-endian bytes and writes big-endian ones.
    let bytes: Vec<u8> = picture.as_slice().iter().flat_map(|v| v.to_ne_bytes()).collect();
    encode(path, &bytes, picture.size(), ExtendedColorType::L16)
}

/// Writes 8-bit color; values are rounded and limited to 0..255, NaN becomes 0.
///
/// # Errors
/// [`FileError`].
pub fn write_rgb8(path: &Path, picture: &RgbGrid) -> Result<(), FileError> {
    let bytes: Vec<u8> = picture.as_slice().iter().flatten().map(|v| v.round() as u8).collect();
    encode(path, &bytes, picture.size(), ExtendedColorType::Rgb8)
}

/// Writes 8-bit color with opacity, not multiplied.
///
/// # Errors
/// [`FileError`].
pub fn write_rgba8(path: &Path, picture: &Grid<[u8; 4]>) -> Result<(), FileError> {
    encode(path, picture.as_slice().as_flattened(), picture.size(), ExtendedColorType::Rgba8)
}

/// A picture as the bytes of a PNG.
///
/// # Errors
/// As the encoder says; an empty picture has no file.
pub fn png_bytes(picture: &Grid<[u8; 3]>) -> Result<Vec<u8>, image::ImageError> {
    png(picture.as_slice().as_flattened(), picture.size(), ExtendedColorType::Rgb8)
}

fn png(bytes: &[u8], [w, h]: [usize; 2], kind: ExtendedColorType) -> Result<Vec<u8>, image::ImageError> {
    let mut png = Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut png, bytes, w as u32, h as u32, kind, ImageFormat::Png)?;
    Ok(png.into_inner())
}

fn encode(path: &Path, bytes: &[u8], size: [usize; 2], kind: ExtendedColorType) -> Result<(), FileError> {
    let png = png(bytes, size, kind).map_err(|err| unreadable(path, err))?;
    super::atomic::write_bytes(path, &png).map_err(|err| cannot_access(path, err))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;

    #[test]
    fn every_kind_survives_the_round_trip() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("p.png");
        let gray = Grid::from_fn(5, 3, |x, y| (x * 50 + y) as u8);
        write_gray8(&path, &gray).unwrap();
        assert_eq!(read_gray8(&path).unwrap(), gray);
        assert_eq!(read_gray(&path).unwrap(), gray.map(|&v| f32::from(v)));
        let deep = Grid::from_fn(4, 3, |x, y| (x * 20000 + y) as u16);
        write_gray16(&path, &deep).unwrap();
        assert!((read_gray(&path).unwrap()[(3, 0)] - 60000.0 / 257.0).abs() < 1e-3);
        let color = Grid::from_fn(3, 2, |x, y| [x as f32 * 100.0, y as f32, 7.4]);
        write_rgb8(&path, &color).unwrap();
        assert_eq!(read_rgb(&path).unwrap()[(2, 1)], [200.0, 1.0, 7.0]);
        assert!(read_gray8(&path).unwrap_err().to_string().contains("expected 8-bit gray"));
    }

    /// A 3 x 2 picture, bright at the upper left, as JPEG with this EXIF orientation.
    fn jpeg(orientation: u8) -> Vec<u8> {
        let mut jpeg = Vec::new();
        let pixels: Vec<u8> = (0..48 * 32).map(|i| if i % 48 < 16 && i / 48 < 16 { 250 } else { 20 }).collect();
        JpegEncoder::new_with_quality(&mut jpeg, 95).encode(&pixels, 48, 32, ExtendedColorType::L8).unwrap();
        let tiff = [b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".as_slice(), &[orientation], &[0; 7]].concat();
        let length = (2 + 6 + tiff.len() as u16).to_be_bytes();
        [&jpeg[..2], b"\xff\xe1", &length, b"Exif\0\0", &tiff, &jpeg[2..]].concat()
    }

    #[test]
    fn a_picture_lies_as_its_file_says() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("p.jpg");
        // Upright, turned by 180 degrees, to be turned by 90 clockwise, to be turned by 270.
        for (orientation, size, bright) in
            [(1, [48, 32], [4, 4]), (3, [48, 32], [44, 28]), (6, [32, 48], [28, 4]), (8, [32, 48], [4, 44])]
        {
            std::fs::write(&path, jpeg(orientation)).unwrap();
            for picture in [read_gray(&path).unwrap(), read_rgb(&path).unwrap().map(|p| p[0])] {
                assert_eq!(picture.size(), size, "{orientation}");
                assert!(picture[(bright[0], bright[1])] > 200.0, "{orientation}");
                assert!(picture[(size[0] - 1 - bright[0], size[1] - 1 - bright[1])] < 60.0, "{orientation}");
            }
        }
    }

    #[test]
    fn what_a_camera_left_behind_the_end_of_a_jpeg_is_no_harm_and_a_missing_end_is() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("p.jpg");
        let whole = jpeg(1);
        let sound = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            (read_gray(&path).map(|picture| picture[(4, 4)] > 200.0).ok(), bytes_behind(&path))
        };
        assert_eq!(sound(&whole), (Some(true), 0));
        assert_eq!(sound(&[&whole, b"\n".as_slice()].concat()), (Some(true), 0));
        assert_eq!(sound(&[&whole, [0; 70].as_slice()].concat()), (Some(true), 70));
        assert_eq!(sound(&[&whole, whole.as_slice()].concat()), (Some(true), whole.len()));
        for cut in [whole.len() - 1, whole.len() / 2, 30, 3] {
            assert_eq!(sound(&whole[..cut]), (None, 0), "{cut}");
        }
    }

    #[test]
    fn a_mask_is_the_same_however_it_is_stored() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.png");
        let on = |i: usize| i.is_multiple_of(3);
        let store = |pixel: &dyn Fn(bool) -> Vec<u8>, kind| {
            let bytes: Vec<u8> = (0..12).flat_map(|i| pixel(on(i))).collect();
            encode(&path, &bytes, [4, 3], kind).unwrap();
            read_mask(&path).map(|levels| levels.as_slice().iter().map(|&v| v > 0).collect::<Vec<_>>())
        };
        let level = |of: [u8; 2]| move |on: bool| vec![of[usize::from(on)]];
        let want: Vec<bool> = (0..12).map(on).collect();
        assert_eq!(store(&level([0, 255]), ExtendedColorType::L8).unwrap(), want);
        assert_eq!(store(&level([0, 1]), ExtendedColorType::L8).unwrap(), want);
        let wide = |on: bool| u16::from(on).to_ne_bytes().to_vec();
        assert_eq!(store(&wide, ExtendedColorType::L16).unwrap(), want);
        // As palettes and layers come out of a decoder.
        let colors = |of: [[u8; 4]; 2], n: usize| move |on: bool| of[usize::from(on)][..n].to_vec();
        let red = colors([[0, 0, 0, 255], [128, 0, 0, 255]], 3);
        assert_eq!(store(&red, ExtendedColorType::Rgb8).unwrap(), want);
        let layer = colors([[9, 9, 9, 0], [255, 255, 255, 255]], 4);
        assert_eq!(store(&layer, ExtendedColorType::Rgba8).unwrap(), want);
        assert_eq!(store(&|on| vec![255, if on { 255 } else { 0 }], ExtendedColorType::La8).unwrap(), want);
        let several = colors([[0, 9, 0, 255], [128, 0, 0, 255]], 3);
        let why = store(&several, ExtendedColorType::Rgb8).unwrap_err().to_string();
        assert!(why.contains("black and one other color") && why.contains("m.png"), "{why}");
    }
}
