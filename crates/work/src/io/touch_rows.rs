//! Rows of touches in Parquet files, as `touch2touch.ray` in Python writes them: one row for each touch.

use std::path::{Path, PathBuf};

use bytes::Bytes;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;

use super::caught::caught;
use super::files;

/// No larger file is one of rows: the lab's 32,256 touches in one file are some 6 MB.
const MAX_FILE: u64 = 1 << 30;
/// The ending of the files.
const ENDING: &str = "parquet";

/// Figures of a touch; a number that is not there is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TouchRow {
    /// The pair.
    pub pair: String,
    /// Identity of the recipe.
    pub recipe: String,
    /// Verdict on the pose; none without one.
    pub verdict: Option<String>,
    /// True in-hand angle, radians.
    pub true_angle_rad: Option<f64>,
    /// Size of the angle's error, radians.
    pub error_rad: Option<f64>,
    /// Measures against the measured imprint; right, left.
    pub images: [RowImage; 2],
}

/// Measures of one finger's prediction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowImage {
    /// Peak 0.0225 m, dB.
    pub psnr_db: Option<f64>,
    /// Range 0.0225 m, the whole map.
    pub ssim_peak: Option<f64>,
    /// Range 0.0225 m, without the border: scikit-image's.
    pub ssim_standard: Option<f64>,
}

/// Why rows cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RowsError {
    /// A file or folder cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file is not of this form.
    #[error("{}: {why}", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// Why.
        why: String,
    },
    /// A folder holds none.
    #[error("no .parquet file lies in {}", .0.display())]
    Nothing(PathBuf),
}

/// The rows of a file, or of all Parquet files of a folder in the order of their names.
///
/// # Errors
/// [`RowsError`]. A row without a pair is a fault of the file.
pub fn read(path: &Path) -> Result<Vec<TouchRow>, RowsError> {
    let io = |source| RowsError::Io { path: path.to_owned(), source };
    if !std::fs::metadata(path).map_err(io)?.is_dir() {
        return read_file(path);
    }
    let listed = std::fs::read_dir(path).and_then(Iterator::collect::<std::io::Result<Vec<_>>>).map_err(io)?;
    let mut all: Vec<PathBuf> = listed.into_iter().map(|entry| entry.path()).collect();
    all.retain(|file| file.extension().is_some_and(|ending| ending == ENDING));
    all.sort();
    if all.is_empty() {
        return Err(RowsError::Nothing(path.to_owned()));
    }
    let mut rows = Vec::new();
    for file in all {
        rows.append(&mut read_file(&file)?);
    }
    Ok(rows)
}

fn read_file(path: &Path) -> Result<Vec<TouchRow>, RowsError> {
    let bytes = files::read(path, MAX_FILE).map_err(|source| RowsError::Io { path: path.to_owned(), source })?;
    // Of a damaged file the reader may believe sizes that lead nowhere.
    let read = caught(|| rows(bytes.into())).unwrap_or_else(|_| Err("the file is damaged".to_owned()));
    read.map_err(|why| RowsError::Form { path: path.to_owned(), why })
}

fn rows(bytes: Bytes) -> Result<Vec<TouchRow>, String> {
    let no_parquet = |err: parquet::errors::ParquetError| format!("this is no Parquet file that can be read: {err}");
    let reader = SerializedFileReader::new(bytes).map_err(no_parquet)?;
    let mut all = Vec::new();
    for row in reader.get_row_iter(None).map_err(no_parquet)? {
        let mut touch = TouchRow::default();
        for (name, field) in row.map_err(no_parquet)?.get_column_iter() {
            touch.put(name, field);
        }
        if touch.pair.is_empty() {
            let row = all.len() + 1;
            return Err(format!("row {row} names no pair: rows of touches have the columns pair and recipe"));
        }
        all.push(touch);
    }
    Ok(all)
}

impl TouchRow {
    fn put(&mut self, column: &str, field: &Field) {
        let text = || if let Field::Str(text) = field { Some(text.clone()) } else { None };
        let number = || {
            let value = match field {
                Field::Double(value) => Some(*value),
                Field::Float(value) => Some(f64::from(*value)),
                _ => None,
            };
            value.filter(|value| value.is_finite())
        };
        let [right, left] = &mut self.images;
        match column {
            "pair" => self.pair = text().unwrap_or_default(),
            "recipe" => self.recipe = text().unwrap_or_default(),
            "verdict" => self.verdict = text(),
            "true_angle_rad" => self.true_angle_rad = number(),
            "error_rad" => self.error_rad = number(),
            "psnr_right_db" => right.psnr_db = number(),
            "psnr_left_db" => left.psnr_db = number(),
            "ssim_peak_right" => right.ssim_peak = number(),
            "ssim_peak_left" => left.ssim_peak = number(),
            "ssim_right" => right.ssim_standard = number(),
            "ssim_left" => left.ssim_standard = number(),
            _ => {}
        }
    }
}
