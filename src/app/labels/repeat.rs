//! Blind repeats: a pair that was done is shown as if nobody had drawn on it, and what is drawn then is kept apart.
//!
//! While a pair is drawn a second time, all that the document knows of it is of that second time: nothing else of the
//! studio has to know. When it is done and left, it is forgotten, and read again as it was.

use super::super::state::State;
use super::super::state::labels::Repeating;
use super::Review;
use touch2touch_core::dataset::PairId;

/// So many pairs are done between two that come back.
const BETWEEN: usize = 4;

/// The pair that comes back now, if one does; `all_done`: there is nothing else to be done in the list.
pub(in crate::app) fn next_repeat(state: &State, all_done: bool) -> Option<PairId> {
    let (doc, library) = (&state.document, &state.library);
    let due = &doc.stats.as_ref().filter(|_| state.settings.repeats_percent > 0.0)?.repeats.due;
    if doc.since_repeat < BETWEEN && !all_done {
        return None;
    }
    let name = |pair: &PairId| library.entry(*pair).map(|entry| entry.name.as_str());
    let free = |name: &&String| {
        doc.review(name) == Review::Done
            && !doc.repeats.contains_key(*name)
            && !doc.repeated.contains(*name)
            && !doc.unsaved.contains(*name)
            && doc.blocked(name).is_none()
            && state.pair_name() != name.as_str()
    };
    due.iter().filter(free).find_map(|due| library.order.iter().find(|pair| name(pair) == Some(due)).copied())
}

/// Makes a pair one that nobody has drawn on, to be shown next.
pub(in crate::app) fn begin_repeat(state: &mut State, pair: PairId) {
    let Some(name) = state.library.entry(pair).map(|entry| entry.name.clone()) else { return };
    let person = state.settings.labeler();
    let doc = &mut state.document;
    let repeating = Repeating { person, review: doc.review(&name), note: doc.note(&name).to_owned() };
    doc.forget(&name);
    doc.repeats.insert(name.clone(), repeating);
    doc.since_repeat = 0;
    state.history.forget(&name);
}

/// Gives pairs that were drawn a second time, written and left their first labels back.
pub(in crate::app) fn end_repeats(state: &mut State) {
    let shown = state.pair_name().to_owned();
    let doc = &mut state.document;
    let over = |name: &&String| doc.review(name).is_judged() && !doc.unsaved.contains(*name) && **name != shown;
    let ended: Vec<String> = doc.repeats.keys().filter(over).cloned().collect();
    if ended.is_empty() {
        return;
    }
    for name in ended {
        let Some(Repeating { review, note, .. }) = doc.repeats.remove(&name) else { continue };
        doc.forget(&name);
        doc.repeated.insert(name.clone());
        if review != Review::Todo {
            doc.reviews.insert(name.clone(), review);
        }
        if !note.is_empty() {
            doc.notes.insert(name.clone(), note);
        }
        state.history.forget(&name);
    }
    state.reorder();
}
