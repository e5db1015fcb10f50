//! Shift statistics in a file, with where they come from: they serve only the bundle that they are of.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::FileError;
use super::{atomic, files};
use touch2touch_core::postprocess::{RefitShift, ShiftFit, ShiftStats};

const FORMAT: &str = "touch2touch-shift-statistics";
const VERSION: u32 = 1;
const MAKE: &str = "make them with `touch2touch stats`";

/// Statistics of a data set's predictions by one bundle and of its measurements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShiftStatistics {
    format: String,
    version: u32,
    /// Origin of the statistics: bundle, data set and settings.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Touches (one finger of a pair each) that the figures are of.
    pub touches: u64,
    /// Predicted pixels, at the decoder's size.
    pub predicted_pixels: u64,
    /// Measured pixels.
    pub measured_pixels: u64,
    /// Pixels that were no numbers and are left out, predicted and measured.
    pub left_out: [u64; 2],
    /// Smallest and largest raw prediction and measurement, meters.
    pub extremes_m: [[f64; 2]; 2],
    /// The figures, meters.
    pub stats: ShiftStats,
}

/// Origin of statistics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name of the bundle that predicted.
    pub bundle: String,
    /// Hash of that bundle: the identity that counts.
    pub bundle_hash: String,
    /// The data set.
    pub dataset: String,
    /// Seed of the noise.
    pub seed: u64,
    /// Sampling steps.
    pub steps: u32,
    /// The sampler.
    pub sampler: String,
    /// Share of fresh noise per step.
    pub eta: f64,
    /// The engine that ran the model.
    pub engine: String,
    /// Scale of the data set's lengths: measured or assumed.
    pub scale: String,
    /// When, UTC, as in `2026-11-21T09:30:00Z`.
    pub made: String,
}

impl ShiftStatistics {
    /// From a pass over a data set; `None` without a pixel on one of the sides.
    pub fn new(provenance: Provenance, fit: &ShiftFit) -> Option<Self> {
        Some(Self {
            format: FORMAT.into(),
            version: VERSION,
            provenance,
            touches: fit.touches,
            predicted_pixels: fit.predicted.count(),
            measured_pixels: fit.measured.count(),
            left_out: [fit.predicted.invalid(), fit.measured.invalid()],
            extremes_m: [fit.predicted.extremes()?, fit.measured.extremes()?],
            stats: fit.stats()?,
        })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// See [`FileError`].
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let io = |err| FileError::io(path, "cannot read the statistics", err);
        let parse = |why: String| {
            FileError::new(path, format!("not a statistics file: {why}; make one with `touch2touch stats`"), MAKE)
        };
        let found: Self = serde_json::from_slice(&files::read(path, files::SMALL).map_err(io)?)
            .map_err(|err| parse(err.to_string()))?;
        if found.format != FORMAT || found.version != VERSION {
            return Err(parse(format!(
                "format \"{}\" version {}, expected \"{FORMAT}\" version {VERSION}",
                found.format, found.version
            )));
        }
        let ShiftStats { pred_mean, pred_std, gt_mean, gt_std } = found.stats;
        let finite = [pred_mean, pred_std, gt_mean, gt_std].iter().all(|v| v.is_finite());
        if !finite || pred_std < 0.0 || gt_std < 0.0 {
            return Err(FileError::new(
                path,
                "the statistics are not finite, or a deviation is negative; make them again",
                MAKE,
            ));
        }
        Ok(found)
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        atomic::write_json(path, "cannot write the statistics", self)
    }

    /// The shift they stand for, for the bundle that they are of.
    ///
    /// # Errors
    /// [`FileError`] of another bundle, naming both.
    pub fn shift_for(&self, name: &str, hash: &str) -> Result<RefitShift, FileError> {
        if self.provenance.bundle_hash != hash {
            let start = |hash: &str| hash.get(..12).unwrap_or(hash).to_owned();
            let what = format!(
                "the shift statistics are of the bundle \"{}\" ({}…), but the model is \"{name}\" ({}…): statistics of one model say nothing about another; make them for this one with `touch2touch stats`",
                self.provenance.bundle,
                start(&self.provenance.bundle_hash),
                start(hash)
            );
            return Err(FileError::new("", what, MAKE));
        }
        Ok(RefitShift::new(self.stats, hash))
    }
}

/// Seconds since 1970 as a date and time in UTC.
///
/// Source: the civil-from-days algorithm of Howard Hinnant, "chrono-compatible low-level date algorithms".
pub(crate) fn utc_text(unix_s: u64) -> String {
    let (days, rest) = ((unix_s / 86_400) as i64 + 719_468, unix_s % 86_400);
    let era = days.div_euclid(146_097);
    let day_of_era = days.rem_euclid(146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = era * 400 + year_of_era + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}Z", rest / 3600, rest / 60 % 60, rest % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::moments::Moments;

    fn made() -> ShiftStatistics {
        let of = |values: [f64; 3]| values.into_iter().collect::<Moments>();
        let fit = ShiftFit { predicted: of([0.011, 0.0137, 0.012]), measured: of([0.0, 0.0101, 0.003]), touches: 1 };
        let provenance = Provenance {
            bundle: "small".into(),
            bundle_hash: "0123456789abcdef0123456789abcdef".into(),
            dataset: "demo".into(),
            seed: 42,
            steps: 10,
            sampler: "ddim".into(),
            eta: 0.0,
            engine: "rten".into(),
            scale: "measured".into(),
            made: utc_text(0),
        };
        ShiftStatistics::new(provenance, &fit).unwrap()
    }

    #[test]
    fn a_file_comes_back_to_the_last_bit_and_serves_one_bundle() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("stats.json");
        made().write(&file).unwrap();
        let back = ShiftStatistics::read(&file).unwrap();
        assert_eq!(back, made());
        assert_eq!(back.shift_for("small", "0123456789abcdef0123456789abcdef").unwrap().stats(), made().stats);
        let err = back.shift_for("large", "ffff456789abcdef").unwrap_err().to_string();
        for named in ["small", "large", "0123456789ab", "ffff456789ab"] {
            assert!(err.contains(named), "{named} is not named: {err}");
        }
    }
}
