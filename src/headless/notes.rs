//! Oddities of the files of a run: on standard error when they are met, and in the JSON. Faults of the data set as a
//! whole come first.

use super::{Output, output};
use touch2touch_core::dataset::Problem;
use touch2touch_core::findings::{Finding, Findings};
use touch2touch_pipeline::io::dataset::Dataset;

/// The notes of the data set, its pairs and CAD models that a verb answers from.
#[derive(Debug)]
pub(super) struct Notes {
    findings: Findings,
    /// Number of each kind in the data set itself, which was said when it was opened.
    said: Vec<usize>,
}

impl Notes {
    /// Begins with the problems of the data set, which [`say_problems`] said.
    pub(super) fn of(dataset: &Dataset) -> Self {
        let findings = problems(dataset);
        let said = findings.list().iter().map(|kind| kind.count).collect();
        Self { said, findings }
    }

    /// Takes notes; the first of each kind is said at once.
    pub(super) fn take(&mut self, output: &Output, notes: &[Problem]) {
        for note in notes {
            if self.findings.add(note.clone()) {
                output.note(&line(note));
            }
        }
    }

    /// All kinds of notes; how often there were more of one is said now.
    pub(super) fn into_list(self, output: &Output) -> Vec<Finding> {
        let list = self.findings.into_list();
        for (at, kind) in list.iter().enumerate() {
            if kind.count > *self.said.get(at).unwrap_or(&1) {
                output.note(&times(kind));
            }
        }
        list
    }
}

/// Says what is wrong with a data set as a whole.
pub(super) fn say_problems(dataset: &Dataset) {
    problems(dataset).list().iter().for_each(say);
}

/// Says what a job found, but for what [`say_problems`] said.
pub(super) fn say_found(dataset: &Dataset, found: &[Finding]) {
    let said = |odd: &&Finding| !dataset.problems.iter().any(|p| (&p.file, &p.what) == (&odd.file, &odd.what));
    found.iter().filter(said).for_each(say);
}

fn say(kind: &Finding) {
    output::note(&format!("note: {}: {} ({})", kind.file.display(), kind.what, kind.hint));
    if kind.count > 1 {
        output::note(&times(kind));
    }
}

fn problems(dataset: &Dataset) -> Findings {
    let mut findings = Findings::default();
    findings.extend(dataset.problems.iter().cloned());
    findings
}

fn times(kind: &Finding) -> String {
    format!("{} times, with other files, fingers or numbers: {}", kind.count, kind.what)
}

/// A note as a line of its own.
pub(super) fn line(note: &Problem) -> String {
    format!("note: {}: {} ({})", note.file.display(), note.what, note.hint)
}
