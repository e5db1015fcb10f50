//! Scores of many touches that were felt elsewhere: [`scores`] of the rows that `touch2touch.ray` in Python writes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::error::TaskError;
use crate::io::dataset::{Dataset, SourceKind};
use crate::io::touch_rows::{self, RowImage, TouchRow};
use touch2touch_core::catalog::pattern_of;
use touch2touch_core::dataset::{Index, PairEntry};
use touch2touch_core::evaluation::{GraspScore, Group, ImageScore, PEAK_M, Scores, SquaredError};
use touch2touch_core::label::Doubt;
use touch2touch_core::sample::Scale;

/// Name of the task in errors.
const WHAT: &str = "Open scores";

/// Scores that were read from files.
#[derive(Clone, Debug, PartialEq)]
pub struct RowScores {
    /// The scores by each recipe, of pairs of the data set.
    pub scores: Vec<Scores>,
    /// Pairs of the data set that have some.
    pub pairs: usize,
    /// Rows of pairs that are not in the data set.
    pub elsewhere: usize,
}

impl RowScores {
    /// Summary in words.
    pub fn text(&self) -> String {
        let elsewhere = match self.elsewhere {
            0 => String::new(),
            n => format!("; {n} rows are of pairs that are not in this data set"),
        };
        let recipes: Vec<&str> = self.scores.iter().map(|scores| scores.method.as_str()).collect();
        format!("scores of {} pairs by {}{elsewhere}", self.pairs, recipes.join(", "))
    }
}

/// The scores in a Parquet file, or in a folder of such files, of the pairs of a data set.
///
/// # Errors
/// If they cannot be read, or no row is of a pair of the data set.
pub fn scores(dataset: &Dataset, path: &Path) -> Result<RowScores, TaskError> {
    let rows = touch_rows::read(path).map_err(|err| {
        TaskError::from_error(WHAT, &err)
            .with_hint("Name a file or folder of rows that touch2touch.ray wrote, compressed by Snappy or not at all.")
    })?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let found = of_rows(&dataset.index, dataset.kind == SourceKind::Demo, &name, rows);
    if found.scores.is_empty() {
        let why = format!("none of the {} rows is of a pair of this data set ({})", found.elsewhere, path.display());
        return Err(TaskError::new(WHAT, why).with_hint("Open the data set that they were made of."));
    }
    Ok(found)
}

fn of_rows(index: &Index, simulated: bool, name: &str, rows: Vec<TouchRow>) -> RowScores {
    let entries: BTreeMap<&str, &PairEntry> = index.pairs.iter().map(|entry| (entry.name.as_str(), entry)).collect();
    let total = rows.len();
    let mut recipes: BTreeMap<String, BTreeMap<String, GraspScore>> = BTreeMap::new();
    let mut known = 0;
    for row in rows {
        let Some(entry) = entries.get(row.pair.as_str()) else { continue };
        known += 1;
        // Where a touch was felt twice, the rows are the same.
        recipes.entry(row.recipe.clone()).or_default().insert(row.pair.clone(), grasp(&row, entry, simulated));
    }
    let several = recipes.len() > 1;
    let pairs = recipes.values().flat_map(BTreeMap::keys).collect::<BTreeSet<_>>().len();
    let scores = recipes.into_iter().map(|(recipe, grasps)| Scores {
        method: if several { format!("{name} {recipe}") } else { name.to_owned() },
        upper_bound: false,
        grasps: grasps.into_values().collect(),
        measured_features: Vec::new(),
    });
    RowScores { scores: scores.collect(), pairs, elsewhere: total - known }
}

fn grasp(row: &TouchRow, entry: &PairEntry, simulated: bool) -> GraspScore {
    // A touch whose truth is known and that has no error has no pose.
    let angle_error_rad = row.error_rad.or(row.true_angle_rad.map(|_| f64::NAN));
    GraspScore {
        pair: row.pair.clone(),
        tool: entry.tool.as_deref().map(|name| pattern_of(name).to_owned()),
        group: Group::of(entry, simulated, None),
        scale: Scale::Measured,
        images: row.images.iter().enumerate().filter_map(image).collect(),
        angle_error_rad,
        position_error_m: None,
        verdict: row.verdict.as_deref().and_then(|grade| grade.parse().ok()),
        seconds: None,
        doubt: Doubt::default(),
        seed_spread_m: None,
    }
}

/// The figures of a finger. A PSNR is a mean squared error; every image counts as one pixel.
fn image((finger, of): (usize, &RowImage)) -> Option<ImageScore> {
    let mse = PEAK_M * PEAK_M * 10f64.powf(-of.psnr_db? / 10.0);
    let error = SquaredError { sum: mse, pixels: 1 };
    let (ssim_peak, ssim_standard) = (of.ssim_peak, of.ssim_standard);
    Some(ImageScore { finger, error, ssim_peak, ssim_standard, ..ImageScore::default() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::evaluation::Metric;

    fn row(pair: &str, recipe: &str, error_rad: Option<f64>, psnr_db: f64) -> TouchRow {
        let image = RowImage { psnr_db: Some(psnr_db), ssim_peak: Some(0.9), ssim_standard: Some(0.8) };
        TouchRow {
            pair: pair.into(),
            recipe: recipe.into(),
            verdict: error_rad.map(|_| "check".into()),
            true_angle_rad: Some(0.1),
            error_rad,
            images: [image, RowImage::default()],
        }
    }

    #[test]
    fn rows_are_scores_of_the_pairs_that_are_there() {
        let dataset = Dataset::demo();
        let [a, b] = [0, 1].map(|at| dataset.index.pairs[at].name.clone());
        let rows = vec![
            row(&a, "r1", Some(0.02), 25.0),
            row(&b, "r1", None, 20.0),
            row(&a, "r1", Some(0.02), 25.0),
            row("gone", "r1", Some(0.02), 25.0),
            row(&a, "r2", Some(0.3), 15.0),
        ];
        let found = of_rows(&dataset.index, true, "rows", rows);
        assert_eq!((found.pairs, found.elsewhere, found.scores.len()), (2, 1, 2));
        assert!(found.text().contains("2 pairs by rows r1, rows r2; 1 rows"), "{}", found.text());
        let first = &found.scores[0].grasps;
        assert_eq!(first.len(), 2);
        let value = |at: usize, metric| first.iter().find(|g| g.pair == [&a, &b][at].as_str()).unwrap().metric(metric);
        assert_eq!(value(0, Metric::Angle), Some(0.02));
        assert!(value(1, Metric::Angle).unwrap().is_nan() && value(1, Metric::Verdict).is_none());
        assert!((value(0, Metric::Psnr).unwrap() - 25.0).abs() < 1e-9);
        assert_eq!((value(0, Metric::Ssim), value(0, Metric::SsimTool)), (Some(0.9), None));
    }

    #[test]
    fn what_is_no_file_of_rows_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let dataset = Dataset::demo();
        let why = |path: &Path| scores(&dataset, path).unwrap_err().to_string();
        assert!(why(&folder.path().join("gone")).contains("gone"));
        assert!(why(folder.path()).contains("no .parquet file lies in"));
        let file = folder.path().join("a.parquet");
        for bytes in [&b""[..], b"PAR1", b"PAR1 nothing at all PAR1", &[0xff; 4000]] {
            std::fs::write(&file, bytes).unwrap();
            assert!(why(&file).contains("a.parquet"), "{}", why(&file));
        }
    }
}
