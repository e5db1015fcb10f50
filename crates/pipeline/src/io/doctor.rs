//! The doctor: loads the pairs of a data set and lists what is wrong with it, in words that say what to do.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::ops::ControlFlow;
use std::path::PathBuf;

use rayon::prelude::*;

use super::dataset::{Dataset, Loaded};
use super::error::FileError;
use touch2touch_core::dataset::{PairId, Problem, Split};
use touch2touch_core::findings::{Finding, Findings};
use touch2touch_core::turn::Turn;

/// Findings of the doctor.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DoctorReport {
    /// Pairs in the index.
    pub pairs: usize,
    /// Pairs that were loaded or tried before the examination ended.
    pub examined: usize,
    /// Everything wrong, data set first, then CAD models, then pairs in the order of the index. What differs only in file,
    /// finger or numbers is one entry.
    pub problems: Vec<Finding>,
}

impl DoctorReport {
    /// Of a data set whose pairs cannot be read at all.
    pub fn refused(why: &FileError) -> Self {
        let mut findings = Findings::default();
        findings.add(why.to_problem());
        Self { pairs: 0, examined: 0, problems: findings.into_list() }
    }
}

/// Pairs loaded between two reports of progress.
const BATCH: usize = 16;
/// Most pairs that are loaded where nobody asks for all: what is wrong with more than a few shows in these, within a minute.
pub const MOST_PAIRS: usize = 2000;

/// Loads the pairs, at most `most` that are spread evenly, on all cores, and lists what is wrong. `progress` is told
/// `(done, total)` on the calling thread and may end the examination.
///
/// It looks for files that cannot be read, wrong keys and shapes, NaN and infinities, imprints and CAD models that are
/// not in meters, depths, intrinsics, quaternions, finger sides and poses that cannot be a bubble's, and pixels that do
/// not survive the way from depth to cloud and back.
pub fn examine(
    dataset: &Dataset,
    most: usize,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> DoctorReport {
    let pairs = dataset.index.pairs.len();
    let total = pairs.min(most);
    let id = |place: usize| PairId((place * pairs / total.max(1)) as u32);
    let mut findings = Findings::default();
    findings.extend(dataset.problems.iter().cloned());
    for tool in dataset.index.tools() {
        // A missing file is found when the data set is opened.
        findings.extend(match dataset.tool_with_notes(&tool) {
            Ok(file) => file.map_or_else(Vec::new, |file| file.notes),
            Err(err) => vec![err.to_problem()],
        });
    }
    let mut few = FewInvalid::default();
    let mut turned = Turned::default();
    let mut repeated = Repeated::default();
    let mut examined = 0;
    let mut go_on = progress(0, total).is_continue();
    while go_on && examined < total {
        let batch: Vec<PairId> = (examined..total.min(examined + BATCH)).map(id).collect();
        let found: Vec<_> = batch.par_iter().map(|&id| look_at(dataset, id)).collect();
        for (id, look) in batch.iter().zip(found) {
            findings.extend(look.problems);
            turned.add(dataset, *id, look.laid);
            repeated.add(dataset, *id, look.print);
            if look.few_invalid > 0 {
                few.add(dataset, *id, look.few_invalid, look.pixels);
            }
        }
        examined += batch.len();
        go_on = progress(examined, total).is_continue();
    }
    if examined > 0 {
        findings.extend(few.problem(examined));
        findings.extend(turned.problem(examined));
        findings.extend(repeated.problem(dataset));
    }
    DoctorReport { pairs, examined, problems: findings.into_list() }
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

/// Pairs of the training and of the test set by what their sensors felt.
#[derive(Default)]
struct Repeated {
    train: HashMap<u64, PairId>,
    test: Vec<(u64, PairId)>,
}

impl Repeated {
    fn add(&mut self, dataset: &Dataset, id: PairId, print: u64) {
        match dataset.index.get(id).map(|entry| entry.split) {
            Some(Split::Train) => drop(self.train.insert(print, id)),
            Some(Split::Test) => self.test.push((print, id)),
            // Pairs of the training set are in `test/train_only` for their statistics.
            Some(Split::TrainOnly | Split::None) | None => {}
        }
    }

    fn problem(self, dataset: &Dataset) -> Option<Problem> {
        let both: Vec<(PairId, PairId)> =
            self.test.iter().filter_map(|(print, id)| Some((*id, *self.train.get(print)?))).collect();
        let (test, train) = both.first()?;
        Some(Problem {
            file: dataset.pair_files(*test).first().cloned().unwrap_or_default(),
            what: format!(
                "{} of {} test pairs are also in the training set, this one as {}",
                both.len(),
                self.test.len(),
                dataset.index.get(*train).map_or("?", |entry| &entry.name)
            ),
            hint:
                "take them out of one of the two: what a model trained on them has there says nothing about new grasps"
                    .into(),
        })
    }
}

/// Pairs whose pictures were not upright, summed over pairs.
#[derive(Default)]
struct Turned {
    pairs: usize,
    mirrored: usize,
    upside_down: usize,
    first: Option<(Turn, PathBuf)>,
}

impl Turned {
    fn add(&mut self, dataset: &Dataset, id: PairId, laid: Turn) {
        if laid != Turn::default() {
            self.pairs += 1;
            self.mirrored += usize::from(laid.mirrored);
            self.upside_down += usize::from(laid.quarters % 4 == 2 && !laid.mirrored);
            self.first.get_or_insert_with(|| (laid, dataset.pair_files(id).first().cloned().unwrap_or_default()));
        }
    }

    fn problem(self, examined: usize) -> Option<Problem> {
        let (laid, file) = self.first?;
        // Exchanged colors look like a mirror. Pictures made for training are mirrored now and then, not all of them.
        if self.mirrored == examined && examined > 1 {
            return Some(Problem {
                file,
                what: format!(
                    "red and blue are exchanged in all {examined} pairs, or all of them are mirrored, as this one ({laid}); \
                     the light's colors tell"
                ),
                hint:
                    "OpenCV has pixels as blue, green, red: write them as red, green, blue; pictures that are mirrored \
                       are read upright as they are"
                        .into(),
            });
        }
        if self.upside_down == examined && examined > 1 {
            return Some(Problem {
                file,
                what: format!(
                    "all {examined} pairs lie upside down, or their GelSlim pictures are negatives; the light's colors tell"
                ),
                hint: "write negatives as 255 minus the picture; pictures that are turned are read upright as they are"
                    .into(),
            });
        }
        Some(Problem {
            file,
            what: format!(
                "{} of {examined} pairs do not lie upright, as this one ({laid}); the light's colors tell",
                self.pairs
            ),
            hint: "usual for pictures made for training; both pictures of such a pair are read upright".into(),
        })
    }
}

/// Findings on one pair.
#[derive(Default)]
struct Look {
    problems: Vec<Problem>,
    /// Invalid pixels that are worth no problem of their own, of how many.
    few_invalid: usize,
    pixels: usize,
    /// Turn in which its pictures lay.
    laid: Turn,
    /// The same for equal readings, and practically never for others.
    print: u64,
}

fn look_at(dataset: &Dataset, id: PairId) -> Look {
    let Loaded { sample, invalid } = match dataset.load_with_counts(id) {
        Ok(loaded) => loaded,
        Err(err) => return Look { problems: vec![err.to_problem()], ..Look::default() },
    };
    let (mut few_invalid, mut pixels) = (0, 0);
    let mut print = DefaultHasher::new();
    for (pad, touch) in sample.pads.entries() {
        if let Some(color) = touch.color() {
            color.difference.as_slice().iter().flatten().for_each(|v| v.to_bits().hash(&mut print));
        }
        let Some(bubble) = touch.depth() else { continue };
        bubble.imprint.as_slice().iter().for_each(|v| v.to_bits().hash(&mut print));
        let invalid = invalid[pad].unwrap_or_default();
        pixels += bubble.imprint.len();
        if !invalid.are_many(bubble.imprint.len()) {
            few_invalid += invalid.total();
        }
    }
    Look { problems: sample.notes, few_invalid, pixels, laid: sample.laid, print: print.finish() }
}
