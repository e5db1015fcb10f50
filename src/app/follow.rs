//! The room of a followed folder: what arrives is listed, and the newest is shown and predicted.

use super::effect::Effect;
use super::source::Followed;
use super::state::State;
use super::state::library::Follow;
use super::state::results::{Request, Results};
use super::{library, predict};
use touch2touch_pipeline::error::TaskError;

/// A command to the following of a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FollowCommand {
    /// Follows the folder that is open, or stops: what arrives is shown and predicted.
    Set(bool),
}

/// Starts or stops following the folder that is open.
pub(super) fn step(state: &mut State, FollowCommand::Set(on): FollowCommand, effects: &mut Vec<Effect>) {
    if on == state.library.follow.is_some() {
        return;
    }
    if !on {
        state.library.follow = None;
        return effects.push(Effect::Follow(None));
    }
    let Some(open) = &state.library.open else { return };
    if open.source.dataset.root.is_none() {
        let err = TaskError::new("Follow", "the demo has no folder that could be followed");
        return state.log.error(&err.with_hint("Open a folder first."));
    }
    effects.push(Effect::Follow(Some((open.seq, open.source.clone()))));
    state.library.follow = Some(Follow::default());
}

/// Another data set is open, or the same one was read again, which goes on being followed.
pub(super) fn opened(state: &mut State, same_place: bool, effects: &mut Vec<Effect>) {
    if state.library.follow.take().is_some() {
        effects.push(Effect::Follow(None));
        if same_place {
            step(state, FollowCommand::Set(true), effects);
        }
    }
}

/// Takes a touch that arrived into the list; shows and predicts it.
pub(super) fn arrived(state: &mut State, followed: Followed, current: bool, effects: &mut Vec<Effect>) {
    // Of a data set that is not open any more.
    let Some(open) = state.library.open.as_mut().filter(|_| current) else { return };
    open.source = followed.source;
    open.tools = open.index().tools();
    let mut key = open.key(followed.pair);
    let results = &mut state.results;
    results.thumbnails.retain(|pair| pair.0 != key);
    if results.samples.contains(&key) && !followed.completed {
        // A file that was written again: under a new number nothing of the old is shown.
        state.library.last_seq.0 += 1;
        open.seq = state.library.last_seq;
        key = open.key(followed.pair);
        *results = Results::default();
        effects.push(Effect::Follow(Some((open.seq, open.source.clone()))));
    }
    state.tasks.failed.clear();
    state.reorder();
    state.document.marked = true;
    let name = state.library.entry(followed.pair).map_or_else(String::new, |entry| entry.name.clone());
    let Some(follow) = &mut state.library.follow else { return };
    follow.arrived += usize::from(!followed.completed);
    let sample = match followed.sample {
        Ok(sample) => sample,
        Err(err) => {
            follow.broken += 1;
            state.log.error(&err);
            state.tasks.failed.insert(Request::Sample(key), err);
            return;
        }
    };
    follow.newest = Some(name);
    let bytes = sample.bytes();
    state.results.samples.insert(key, sample, bytes);
    // A stroke is not torn from the hand; and a bubble that came later changes nothing about the prediction.
    if state.document.stroke.is_some() || followed.completed {
        return;
    }
    library::select(state, followed.pair, effects);
    // What still waits is of a touch that is not the newest any more; what runs ends.
    for (ticket, task) in &mut state.tasks.running {
        if task.progress.total == 0 && task.recipes.first().is_some_and(|r| r.touch.pair != key) {
            task.cancelling = true;
            effects.push(Effect::Cancel(*ticket));
        }
    }
    predict::same_seed(state, effects);
}
