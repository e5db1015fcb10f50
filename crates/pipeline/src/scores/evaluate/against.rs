//! Differences between the methods of an evaluation, and from those of an earlier one.

use std::path::Path;

use serde::Deserialize;

use super::{Evaluation, WHAT};
use crate::error::TaskError;
use crate::io::files;
use touch2touch_core::evaluation::{self, Difference, Scores};

/// No larger file is an evaluation: the lab's 32,256 pairs by two methods take some 50 MB.
const MAX_FILE: u64 = 1 << 30;

/// The part of an evaluation's file that is compared.
#[derive(Deserialize)]
struct Earlier {
    pairs: Option<Vec<Scores>>,
}

/// The generators among some methods.
fn generators(scores: &[Scores]) -> impl Iterator<Item = &Scores> {
    scores.iter().filter(|scores| !scores.upper_bound)
}

/// Each further generator less the first.
pub(super) fn among(scores: &[Scores], resamples: usize) -> Vec<Difference> {
    let mut of = generators(scores);
    let Some(first) = of.next() else { return Vec::new() };
    of.filter_map(|to| evaluation::difference(first, to, resamples)).collect()
}

impl Evaluation {
    /// Adds the differences of this evaluation's generators from those of an earlier one, whose file has every grasp
    /// (`evaluate --json --pairs`, or `evaluation.json` of an exported table).
    ///
    /// # Errors
    /// If the file cannot be read, has no grasps, or none in common with this evaluation.
    pub fn against(&mut self, file: &Path) -> Result<(), TaskError> {
        let fail = |why: String| TaskError::new(WHAT, format!("{why} ({})", file.display()));
        let text =
            files::read(file, MAX_FILE).map_err(|err| fail(format!("the earlier evaluation cannot be read: {err}")))?;
        let earlier: Earlier =
            serde_json::from_slice(&text).map_err(|err| fail(format!("this is no evaluation: {err}")))?;
        let earlier = earlier.pairs.ok_or_else(|| {
            fail("the earlier evaluation has no figures of single grasps".to_owned())
                .with_hint("Write it with --pairs, or by --out.")
        })?;
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let known = self.differences.len();
        for from in generators(&earlier) {
            let from = Scores { method: format!("{} ({stem})", from.method), ..from.clone() };
            let of = |to| evaluation::difference(&from, to, self.setup.resamples);
            self.differences.extend(generators(&self.scores).filter_map(of));
        }
        if self.differences.len() == known {
            return Err(fail("no grasp of a generator is in both evaluations".to_owned()));
        }
        Ok(())
    }
}
