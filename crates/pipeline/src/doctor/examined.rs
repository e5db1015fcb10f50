//! [`examined`]: the pairs read, and other readings of the data tried on a handful.

use std::ops::ControlFlow;

use crate::doubts::{self, Generator, PAIRS, examine_reading};
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::io::doctor::{self, DoctorReport};
use crate::job::JobCx;
use touch2touch_core::findings::Findings;

/// Faults of a data set: those of all pairs first, then those of single files.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Examined {
    /// The faults.
    pub report: DoctorReport,
    /// The readings that would set it right, as `doctor --set read-as=` takes them; `None` where there is none.
    pub read_as: Option<String>,
}

/// Reads the pairs, at most `most` of them, and lists what is wrong, then tries on a handful which other reading would explain them
/// better; with a generator, also by its predictions.
///
/// # Errors
/// If the job was told to stop.
pub fn examined(
    dataset: &Dataset,
    most: usize,
    generator: Option<Generator<'_>>,
    cx: &JobCx,
) -> Result<Examined, TaskError> {
    const WHAT: &str = "Check the pairs";
    let mut report = doctor::examine(dataset, most, &mut |done, total| {
        cx.progress(done as u64, total as u64, format!("{done} of {total} pairs"));
        if cx.cancel.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    cx.check(WHAT)?;
    let doubts = examine_reading(dataset, PAIRS, generator, &cx.quiet());
    cx.check(WHAT)?;
    let mut found = Findings::default();
    found.extend(doubts::problems(dataset, &doubts));
    report.problems.splice(0..0, found.into_list());
    Ok(Examined { report, read_as: doubts::remedy(dataset, &doubts) })
}
