//! The labels stored for a pair, which go to the document.

use std::sync::Arc;

use super::super::labels::state::{PairLabels, Stored};
use super::{Computes, Job, Lane, PairKey, SharedServices, State};
use crate::work::error::TaskError;
use crate::work::labels::Past;

/// The labels stored for a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LabelsKey(pub PairKey);

/// Labels as they were read.
#[derive(Clone, Debug, PartialEq)]
pub struct Read {
    labels: PairLabels,
    /// What was done before, and can be taken back; the oldest first.
    done: Vec<Past>,
    /// What was taken back.
    undone: Vec<Past>,
}

impl LabelsKey {
    fn name(self, state: &State) -> Option<String> {
        Some(state.library.entry(self.0.pair)?.name.clone())
    }
}

impl Computes for LabelsKey {
    type Value = Read;

    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Read>> {
        let (source, name) = (state.library.open.as_ref()?.source.clone(), self.name(state)?);
        Some(Job::new(Lane::Files, format!("Labels of {name}"), move |_| {
            let labels = source.load_labels(&name)?;
            let [done, undone] = source.past(&name, &labels).into();
            Ok(Read { labels, done, undone })
        }))
    }

    fn arrived(&self, state: &mut State, read: &Arc<Read>) {
        let Some(name) = self.name(state) else { return };
        let doc = &mut state.document;
        if doc.stored.insert(name.clone(), Stored::Loaded) == Some(Stored::Loaded) {
            // Read twice: what is here may be newer.
            return;
        }
        let mut labels = read.labels.clone();
        for hand in labels.masks.values_mut() {
            hand.revision = doc.next_revision();
        }
        let (review, note) = (labels.review, labels.note.clone());
        doc.labels.insert(name.clone(), labels);
        doc.set_review(&name, review);
        doc.set_note(&name, note);
        state.history.restore(&name, &read.done, &read.undone);
    }

    fn failed(&self, state: &mut State, err: &TaskError) -> bool {
        if let Some(name) = self.name(state) {
            state.document.stored.insert(name, Stored::Blocked(err.clone()));
        }
        true
    }
}
