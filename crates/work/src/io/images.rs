//! Pictures (PNG, and JPEG for reading) to and from [`Grid`]s.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ExtendedColorType, ImageDecoder as _, ImageFormat, ImageReader};

use super::files;
use touch2touch_core::grid::{Grid, RgbGrid};

/// Why a picture cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file cannot be opened, read or written.
    #[error("cannot access the picture ({}): {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file is no PNG or JPEG, or a damaged one.
    #[error("not a readable PNG or JPEG: {source} ({})", file.display())]
    Decode {
        /// The file.
        file: PathBuf,
        /// The decoder's reason.
        source: image::ImageError,
    },
    /// The picture has too many pixels.
    #[error("the picture is {} x {} pixels; at most {MAX_SIDE} a side are read ({})", size[0], size[1], file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// Width and height.
        size: [u32; 2],
    },
    /// The picture has other channels or another depth than asked for.
    #[error("the picture is {found}, expected {expected} ({})", file.display())]
    Kind {
        /// The file.
        file: PathBuf,
        /// Form of the picture.
        found: String,
        /// Form that is needed.
        expected: &'static str,
    },
}

impl PictureError {
    /// The file it is about.
    pub fn file(&self) -> &Path {
        match self {
            Self::Io { file, .. }
            | Self::Decode { file, .. }
            | Self::TooLarge { file, .. }
            | Self::Kind { file, .. } => file,
        }
    }

    /// Advice for the user.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Io { .. } => "check that the file exists and may be read, and that the disk has room",
            Self::Decode { .. } => "copy or save the picture again",
            Self::TooLarge { .. } => "save the picture smaller: the sensors have fewer than 500 pixels a side",
            Self::Kind { .. } => "save the picture again in that form",
        }
    }
}

/// Most pixels a side. A file of a few kilobytes can announce a thousand times more.
pub(crate) const MAX_SIDE: u32 = 4096;
/// Most bytes of a file: what a picture of that size takes without compression.
const MAX_BYTES: u64 = 256 << 20;

fn decode(path: &Path) -> Result<DynamicImage, PictureError> {
    let io = |source| PictureError::Io { file: path.to_owned(), source };
    let bytes = files::read(path, MAX_BYTES).map_err(io)?;
    let jpeg = bytes.starts_with(&[0xff, 0xd8]);
    // A JPEG decoder fills what is cut off with gray: the end mark tells a whole file from one being written.
    if jpeg && !bytes.trim_ascii_end().ends_with(&[0xff, 0xd9]) {
        let cut = std::io::Error::new(std::io::ErrorKind::UnexpectedEof, "the end of the JPEG is missing");
        return Err(PictureError::Decode { file: path.to_owned(), source: image::ImageError::IoError(cut) });
    }
    let mut reader = ImageReader::new(Cursor::new(bytes));
    reader.set_format(if jpeg { ImageFormat::Jpeg } else { ImageFormat::Png });
    let failed = |source| PictureError::Decode { file: path.to_owned(), source };
    // The size is in the header: it is looked at before there is room for a single pixel.
    let decoder = reader.into_decoder().map_err(failed)?;
    let (width, height) = decoder.dimensions();
    if width.max(height) > MAX_SIDE {
        return Err(PictureError::TooLarge { file: path.to_owned(), size: [width, height] });
    }
    DynamicImage::from_decoder(decoder).map_err(failed)
}

/// Turns decoded bytes into a grid. The decoder guarantees the length.
fn grid<T: Copy>(width: u32, height: u32, pixels: Vec<T>) -> Grid<T> {
    let (width, height) = (width as usize, height as usize);
    Grid::from_vec(width, height, pixels).expect("a decoder fills every pixel")
}

/// Reads any PNG or JPEG as color on the 0..255 scale; gray is repeated, 16 bits are scaled down, alpha is dropped.
///
/// # Errors
/// [`PictureError`].
pub fn read_rgb(path: &Path) -> Result<RgbGrid, PictureError> {
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
/// [`PictureError`].
pub fn read_gray(path: &Path) -> Result<Grid<f32>, PictureError> {
    let image = decode(path)?;
    let (w, h) = (image.width(), image.height());
    Ok(match image {
        DynamicImage::ImageLuma8(_) | DynamicImage::ImageLumaA8(_) => {
            grid(w, h, image.into_luma8().into_raw().into_iter().map(f32::from).collect())
        }
        DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_) => {
            grid(w, h, image.into_luma8().into_raw().into_iter().map(f32::from).collect())
        }
        other => grid(w, h, other.into_luma16().into_raw().into_iter().map(|v| f32::from(v) / 257.0).collect()),
    })
}

/// Reads a PNG that must be 8-bit gray without alpha, value by value.
///
/// # Errors
/// [`PictureError::Kind`] for any other kind.
pub fn read_gray8(path: &Path) -> Result<Grid<u8>, PictureError> {
    match decode(path)? {
        DynamicImage::ImageLuma8(image) => Ok(grid(image.width(), image.height(), image.into_raw())),
        other => Err(wrong_kind(path, &other, "8-bit gray")),
    }
}

fn wrong_kind(file: &Path, image: &DynamicImage, expected: &'static str) -> PictureError {
    PictureError::Kind { file: file.to_owned(), found: format!("{:?}", image.color()), expected }
}

/// Writes 8-bit gray.
///
/// # Errors
/// [`PictureError`].
pub fn write_gray8(path: &Path, picture: &Grid<u8>) -> Result<(), PictureError> {
    encode(path, picture.as_slice(), picture.size(), ExtendedColorType::L8)
}

/// Writes 16-bit gray.
///
/// # Errors
/// [`PictureError`].
pub fn write_gray16(path: &Path, picture: &Grid<u16>) -> Result<(), PictureError> {
    // The encoder takes native-endian bytes and writes big-endian ones.
    let bytes: Vec<u8> = picture.as_slice().iter().flat_map(|v| v.to_ne_bytes()).collect();
    encode(path, &bytes, picture.size(), ExtendedColorType::L16)
}

/// Writes 8-bit color; values are rounded and limited to 0..255, NaN becomes 0.
///
/// # Errors
/// [`PictureError`].
pub fn write_rgb8(path: &Path, picture: &RgbGrid) -> Result<(), PictureError> {
    let bytes: Vec<u8> = picture.as_slice().iter().flatten().map(|v| v.round() as u8).collect();
    encode(path, &bytes, picture.size(), ExtendedColorType::Rgb8)
}

/// Writes 8-bit color with opacity, not multiplied.
///
/// # Errors
/// [`PictureError`].
pub fn write_rgba8(path: &Path, picture: &Grid<[u8; 4]>) -> Result<(), PictureError> {
    encode(path, picture.as_slice().as_flattened(), picture.size(), ExtendedColorType::Rgba8)
}

/// Picture as it comes back from a JPEG file of a quality (1 to 100).
///
/// # Errors
/// As encoder and decoder say; an empty picture has no file.
pub(crate) fn through_jpeg(picture: &Grid<u8>, quality: u8) -> Result<Grid<u8>, image::ImageError> {
    let [w, h] = picture.size().map(|n| n as u32);
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, quality).encode(picture.as_slice(), w, h, ExtendedColorType::L8)?;
    let image = image::load_from_memory_with_format(&jpeg, ImageFormat::Jpeg)?.into_luma8();
    Ok(grid(image.width(), image.height(), image.into_raw()))
}

/// A picture as the bytes of a PNG.
///
/// # Errors
/// As the encoder says; an empty picture has no file.
pub(crate) fn png_bytes(picture: &Grid<[u8; 3]>) -> Result<Vec<u8>, image::ImageError> {
    png(picture.as_slice().as_flattened(), picture.size(), ExtendedColorType::Rgb8)
}

fn png(bytes: &[u8], [w, h]: [usize; 2], kind: ExtendedColorType) -> Result<Vec<u8>, image::ImageError> {
    let mut png = Cursor::new(Vec::new());
    image::write_buffer_with_format(&mut png, bytes, w as u32, h as u32, kind, ImageFormat::Png)?;
    Ok(png.into_inner())
}

fn encode(path: &Path, bytes: &[u8], size: [usize; 2], kind: ExtendedColorType) -> Result<(), PictureError> {
    let png = png(bytes, size, kind).map_err(|source| PictureError::Decode { file: path.to_owned(), source })?;
    super::atomic::write_bytes(path, &png).map_err(|source| PictureError::Io { file: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn too_many_pixels_are_refused_by_the_header() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("p.png");
        let side = MAX_SIDE as usize;
        for size in [[side + 1, 1], [1, side + 1]] {
            write_gray8(&path, &Grid::filled(size[0], size[1], 3)).unwrap();
            let error = read_rgb(&path).unwrap_err();
            assert!(matches!(error, PictureError::TooLarge { .. }), "{error}");
            assert!(error.to_string().contains("4097") && error.to_string().contains("p.png"), "{error}");
        }
        write_gray8(&path, &Grid::filled(side, 1, 3)).unwrap();
        assert_eq!(read_gray(&path).unwrap().size(), [side, 1]);
    }

    #[test]
    fn damaged_pictures_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("p.png");
        write_gray8(&path, &Grid::filled(40, 40, 3)).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in [0, 5, 20, whole.len() / 2] {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(matches!(read_rgb(&path), Err(PictureError::Decode { .. })), "{length}");
        }
    }
}
