//! The labels stored for a pair, which go to the document.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::LabelsKey;
use super::super::keys::dataset::Read;
use super::super::results::Computes;
use super::super::services::Services;
use super::super::state::State;
use super::super::state::labels::Stored;
use super::super::state::tasks::Level;
use touch2touch_pipeline::error::TaskError;

/// The name of the pair.
fn name(state: &State, key: &LabelsKey) -> Option<String> {
    Some(state.library.entry(key.0.pair)?.name.clone())
}

impl Computes for LabelsKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Read>> {
        let (source, name) = (state.library.open.as_ref()?.source.clone(), name(state, self)?);
        Some(Job::new(Worker::Files, format!("Labels of {name}"), move |_| {
            let labels = source.labels.load(&name)?;
            let told = source.labels.past(&name, &labels);
            Ok(Read { labels, told })
        }))
    }

    fn arrived(&self, state: &mut State, read: &Arc<Read>) {
        let Some(name) = name(state, self) else { return };
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
        state.history.restore(&name, &read.told.done, &read.told.undone);
        if let Some(problem) = &read.told.problem {
            let (why, hint) = (problem.why.clone(), problem.hint.clone());
            state.log.push(Level::Warning, problem.what.clone(), Some(why), hint);
        }
    }

    fn failed(&self, state: &mut State, err: &TaskError) -> bool {
        if let Some(name) = name(state, self) {
            state.document.stored.insert(name, Stored::Blocked(err.clone()));
        }
        true
    }
}
