//! The doctor: loads every pair of a dataset and lists what is wrong with it, in words that say what to do.

mod checks;

use std::ops::ControlFlow;
use std::path::PathBuf;

use rayon::prelude::*;

use super::dataset::{Dataset, Loaded};
use super::stl;
use crate::domain::dataset::{PairId, Problem};
use crate::domain::upright::Turn;

/// What the doctor found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DoctorReport {
    /// Pairs in the index.
    pub pairs: usize,
    /// Pairs that were loaded or tried before the examination ended.
    pub examined: usize,
    /// Everything wrong, dataset first, then CAD models, then pairs in the order of the index.
    pub problems: Vec<Problem>,
}

/// Pairs loaded between two reports of progress.
const BATCH: usize = 16;
/// A larger share of pixels without measurement than this is a problem of its file; smaller ones are summed up in
/// one entry, because every depth camera drops some.
const MANY_INVALID: f64 = 0.02;

/// Loads every pair, on all cores, and lists what is wrong. `progress` is told `(done, total)` on the calling
/// thread and may end the examination.
///
/// What is looked for: files that cannot be read, keys and shapes, NaN and infinities, imprints and CAD models that
/// are not in metres, depths, intrinsics, quaternions, finger sides and poses that cannot be a bubble's, and pixels
/// that do not survive the way from depth to cloud and back.
pub fn examine(dataset: &Dataset, progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>) -> DoctorReport {
    let total = dataset.index.pairs.len();
    let mut report = DoctorReport { pairs: total, examined: 0, problems: dataset.problems.clone() };
    for tool in dataset.index.tools() {
        report.problems.extend(tool_problems(dataset, &tool));
    }
    let mut few = FewInvalid::default();
    let mut turned = Turned::default();
    let ids: Vec<PairId> = (0..total as u32).map(PairId).collect();
    if progress(0, total).is_break() {
        return report;
    }
    for batch in ids.chunks(BATCH) {
        let found: Vec<_> = batch.par_iter().map(|&id| pair_problems(dataset, id)).collect();
        for (id, (problems, invalid, laid)) in batch.iter().zip(found) {
            report.problems.extend(problems);
            turned.add(dataset, *id, laid);
            if let Some((count, pixels)) = invalid {
                few.add(dataset, *id, count, pixels);
            }
        }
        report.examined += batch.len();
        if progress(report.examined, total).is_break() {
            break;
        }
    }
    report.problems.extend(few.problem(report.examined));
    report.problems.extend(turned.problem(report.examined));
    report
}

/// Small numbers of invalid pixels, summed over pairs.
#[derive(Default)]
struct FewInvalid {
    pairs: usize,
    worst: Option<(f64, PathBuf)>,
}

impl FewInvalid {
    fn add(&mut self, dataset: &Dataset, id: PairId, count: usize, pixels: usize) {
        self.pairs += 1;
        let share = count as f64 / pixels as f64;
        if self.worst.as_ref().is_none_or(|(worst, _)| share > *worst) {
            self.worst = dataset.pair_files(id).pop().map(|file| (share, file));
        }
    }

    fn problem(self, examined: usize) -> Option<Problem> {
        let (share, file) = self.worst?;
        Some(Problem {
            file,
            what: format!(
                "{} of {examined} pairs have bubble pixels without measurement (NaN or depth 0), at most {:.3} % as in \
                 this file",
                self.pairs,
                100.0 * share
            ),
            hint: "normal for a depth camera; these pixels are left out everywhere".into(),
        })
    }
}

/// Pairs whose pictures were not upright, summed over pairs.
#[derive(Default)]
struct Turned {
    pairs: usize,
    first: Option<(Turn, PathBuf)>,
}

impl Turned {
    fn add(&mut self, dataset: &Dataset, id: PairId, laid: Turn) {
        if laid != Turn::default() {
            self.pairs += 1;
            self.first.get_or_insert_with(|| (laid, dataset.pair_files(id).first().cloned().unwrap_or_default()));
        }
    }

    fn problem(self, examined: usize) -> Option<Problem> {
        let (laid, file) = self.first?;
        Some(Problem {
            file,
            what: format!(
                "{} of {examined} pairs do not lie upright, as this one ({laid}); the light's colours tell",
                self.pairs
            ),
            hint: "usual for pictures made for training; both pictures of such a pair are read upright".into(),
        })
    }
}

fn tool_problems(dataset: &Dataset, tool: &str) -> Vec<Problem> {
    // A missing file is found when the dataset is opened.
    let Some(path) = dataset.tool_mesh_file(tool) else { return Vec::new() };
    let problem = |what: String, hint: String| Problem { file: path.to_owned(), what, hint };
    match stl::read(path) {
        Err(err) => vec![problem(err.to_string(), err.hint().into())],
        Ok(file) => {
            let mut problems = Vec::new();
            if let (Some(scale), Some([lo, hi])) = (file.suggested_scale, file.mesh.bounds()) {
                let extent = crate::domain::units::significant((hi - lo).max_element());
                problems.push(problem(
                    format!("the CAD model is {extent} units long: not metres"),
                    format!(
                        "export it in metres (multiply by {scale}), or accept the scale: --tool-scale auto, or a file \
                         {} beside it that says auto",
                        super::dataset::UNIT_FILE
                    ),
                ));
            }
            if file.degenerate > 0 {
                problems.push(problem(
                    format!("{} triangles of the CAD model have no area", file.degenerate),
                    "they are left out; repair the mesh if edges look frayed".into(),
                ));
            }
            problems
        }
    }
}

/// The problems of one pair, how many pixels of how many are invalid if that is worth no problem of its own, and how
/// its pictures lay.
fn pair_problems(dataset: &Dataset, id: PairId) -> (Vec<Problem>, Option<(usize, usize)>, Turn) {
    let Loaded { sample, notes, invalid } = match dataset.load_with_notes(id) {
        Ok(loaded) => loaded,
        Err(err) => return (vec![err.to_problem()], None, Turn::default()),
    };
    let mut problems = notes;
    // The bubble's file is the last one.
    let file = dataset.pair_files(id).pop().unwrap_or_default();
    let (mut few, mut pixels) = (0, 0);
    for (pad, touch) in sample.pads.entries() {
        let Some(bubble) = touch.depth() else { continue };
        let invalid = invalid[pad].unwrap_or_default();
        pixels += bubble.imprint.len();
        let share = invalid.total() as f64 / bubble.imprint.len() as f64;
        if invalid.infinite == 0 && share <= MANY_INVALID {
            few += invalid.total();
            continue;
        }
        problems.push(Problem {
            file: file.clone(),
            what: format!(
                "key \"bubble_imprint\": {:.2} % of a finger's pixels are no measurement ({} NaN, {} infinite, {} at \
                 depth 0)",
                100.0 * share,
                invalid.nan,
                invalid.infinite,
                invalid.dropped
            ),
            hint: "these pixels are left out everywhere; record the grasp again if they cover the contact".into(),
        });
    }
    checks::sample(&sample, &file, &mut problems);
    (problems, (few > 0).then_some((few, pixels)), sample.laid)
}
