//! What is odd about the files of a run: on standard error when it is met, and in the JSON.

use super::Output;
use crate::domain::dataset::Problem;
use crate::domain::findings::{Finding, Findings};

/// The notes of the pairs and CAD models that a verb answers from.
#[derive(Debug, Default)]
pub(super) struct Notes(Findings);

impl Notes {
    /// Takes notes; the first of each kind is said at once.
    pub(super) fn take(&mut self, output: &Output, notes: &[Problem]) {
        for note in notes {
            if self.0.add(note.clone()) {
                output.note(&line(note));
            }
        }
    }

    /// All kinds of notes; how often there were more of one is said now.
    pub(super) fn into_list(self, output: &Output) -> Vec<Finding> {
        let list = self.0.into_list();
        for note in list.iter().filter(|note| note.count > 1) {
            output.note(&format!("{} times, but for file, finger and numbers: {}", note.count, note.what));
        }
        list
    }
}

/// A note as a line of its own.
pub(super) fn line(note: &Problem) -> String {
    format!("note: {}: {} ({})", note.file.display(), note.what, note.hint)
}
