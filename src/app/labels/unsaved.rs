//! Labels that are not on the disk yet: what is asked before the window closes, trying again, and where they go else.

use std::path::PathBuf;

use super::super::state::labels::Question;
use super::{end_stroke, save_again};
use crate::app::effect::{Effect, NotSaved};
use crate::app::keys::Revision;
use crate::app::state::State;
use crate::app::state::tasks::Level;
use crate::app::state::view::{Purpose, UiRequest};
use touch2touch_pipeline::error::TaskErrorKind;
use touch2touch_pipeline::labels::{Operation, Unsaved};

/// A command to labels that are not on the disk.
#[derive(Clone, Debug)]
pub enum UnsavedCommand {
    /// The window is to be closed: at once where all is saved, else once it is or the person says.
    Close,
    /// The window stays open; nothing is asked any more.
    Stay,
    /// Closes the window without what could not be saved.
    Discard,
    /// Tries again to write what could not be.
    Retry,
    /// Asks for a folder to write it to instead.
    AskFolder,
    /// Writes it to that folder.
    Elsewhere(PathBuf),
}

pub(in crate::app) fn step(state: &mut State, command: UnsavedCommand, effects: &mut Vec<Effect>) {
    match command {
        UnsavedCommand::Close => {
            end_stroke(state, effects);
            state.document.question = Some(Question::Closing);
            retry(state, effects);
            close_when_saved(state, effects);
        }
        UnsavedCommand::Stay => state.document.question = None,
        UnsavedCommand::Discard => {
            if state.document.question == Some(Question::Closing) {
                let doc = &mut state.document;
                doc.unsaved.clear();
                doc.asked.clear();
                doc.failed.clear();
                close_when_saved(state, effects);
            }
        }
        UnsavedCommand::Retry => retry(state, effects),
        UnsavedCommand::AskFolder => effects.push(Effect::Ui(UiRequest::Pick(Purpose::Labels))),
        UnsavedCommand::Elsewhere(folder) => elsewhere(state, folder, effects),
    }
}

fn retry(state: &mut State, effects: &mut Vec<Effect>) {
    let failed: Vec<String> = state.document.failed.keys().cloned().collect();
    for name in failed {
        save_again(state, &name, Operation::named("saved again"), effects);
    }
}

fn elsewhere(state: &mut State, folder: PathBuf, effects: &mut Vec<Effect>) {
    end_stroke(state, effects);
    let unsaved = unsaved(state);
    let revisions: Vec<(String, Revision)> =
        unsaved.iter().filter_map(|one| Some((one.name.clone(), *state.document.asked.get(&one.name)?))).collect();
    if let Some(open) = state.library.open.as_ref().filter(|_| !unsaved.is_empty()) {
        effects.push(Effect::KeepLabels { source: open.source.clone(), unsaved, folder: Some(folder), revisions });
    }
}

/// Closes the window if that is asked and nothing is left to save; takes the question back if it has its answer.
fn close_when_saved(state: &mut State, effects: &mut Vec<Effect>) {
    let doc = &mut state.document;
    if doc.unsaved.is_empty() && doc.question.take() == Some(Question::Closing) {
        effects.push(Effect::Ui(UiRequest::Close));
    }
}

/// The labels of a pair are on the disk, as they were when that was asked for.
pub(in crate::app) fn saved(state: &mut State, name: &str, effects: &mut Vec<Effect>) {
    let doc = &mut state.document;
    doc.asked.remove(name);
    doc.unsaved.remove(name);
    doc.elsewhere.remove(name);
    if doc.failed.remove(name).is_some() {
        state.log.info(format!("Saved after all: the labels of {name}"));
    }
    close_when_saved(state, effects);
}

/// The labels of a pair could not be written.
pub(in crate::app) fn failed(state: &mut State, not: NotSaved, effects: &mut Vec<Effect>) {
    let NotSaved { source, save, err } = not;
    if state.library.open.as_ref().is_none_or(|open| open.seq != save.seq) {
        // Another data set is open by now: nobody would try again.
        state.log.error(&err);
        let unsaved = Unsaved { name: save.name, labels: save.labels, deed: save.deed };
        return effects.push(Effect::keep_waiting(source, vec![unsaved]));
    }
    let doc = &mut state.document;
    if doc.asked.get(&save.name) != Some(&save.revision) {
        // What was changed since is being written: that says how it went. Or it was thrown away.
        return;
    }
    let lost = err.kind == TaskErrorKind::Lost;
    let known = doc.failed.insert(save.name, err.clone());
    if lost && known.is_none() && doc.question.is_none() {
        doc.question = Some(Question::Lost);
    }
    // Tried again every few seconds: said once.
    if known.as_ref() != Some(&err) {
        state.log.error(&err);
    }
}

/// Labels are in another folder, as they were when that was asked for.
pub(in crate::app) fn kept(
    state: &mut State,
    revisions: Vec<(String, Revision)>,
    folder: PathBuf,
    effects: &mut Vec<Effect>,
) {
    let doc = &mut state.document;
    for (name, revision) in revisions {
        if doc.asked.get(&name) == Some(&revision) {
            doc.asked.remove(&name);
            doc.unsaved.remove(&name);
            doc.failed.remove(&name);
            doc.elsewhere.insert(name);
        }
    }
    let hint = "Once the data can be written again: touch2touch label DATA --take-in FOLDER.";
    let text = format!("Labels were saved to {}", folder.display());
    state.log.push(Level::Warning, text, None, Some(hint.into()));
    state.log.place_last(folder);
    close_when_saved(state, effects);
}

/// The labels that are not on the disk, as they are now.
pub fn unsaved(state: &State) -> Vec<Unsaved> {
    let one = |name: &String| {
        let deed = Operation { person: state.settings.known_labeler(), ..Operation::named("saved elsewhere") };
        Some(Unsaved { name: name.clone(), labels: state.document.finished(name)?, deed })
    };
    state.document.unsaved.iter().filter_map(one).collect()
}
