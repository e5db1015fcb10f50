//! [`apply`]: the only writer of the state. Pure: no files, no threads, no clock.

mod answers;
mod evaluate;
mod follow;
mod generate;
mod inspect;
mod masks;
mod preferences;
mod refit;
mod workbench;

use super::command::{Command, Hover};
use super::document::Review;
use super::effect::Effect;
use super::keys::Request;
use super::library::Place;
use super::settings::MAX_RECENT;
use super::state::State;
use super::tasks::Level;
use crate::domain::dataset::PairId;

/// Carries a command out. What has to happen outside the state comes back.
///
/// Every command is legal in every state: one that makes no sense now changes nothing, or leaves a notice in the log.
pub fn apply(state: &mut State, command: Command) -> Vec<Effect> {
    let mut effects = Vec::new();
    step(state, command, &mut effects);
    effects
}

fn step(state: &mut State, command: Command, effects: &mut Vec<Effect>) {
    match command {
        Command::Open(place) => open(state, place, effects),
        Command::Reload => {
            if let Some(place) = state.library.open.as_ref().map(|open| open.place.clone()) {
                open(state, place, effects);
            }
        }
        Command::SetFollow(on) => follow::set(state, on, effects),
        Command::ForgetRecent(place) => {
            state.settings.recent.retain(|p| *p != place);
            save_settings(state, effects);
        }
        Command::SetFilter(filter) => {
            state.library.filter = filter;
            reorder(state);
        }
        Command::SetToolFilter(tool) => {
            state.library.tool = tool;
            reorder(state);
        }
        Command::SetSort(sort) => {
            state.library.sort = sort;
            reorder(state);
        }
        Command::ShowRows(rows) => state.library.rows = rows,

        Command::Select(pair) => select(state, pair, effects),
        Command::Step(by) => step_by(state, by, effects),
        Command::First => select_row(state, 0, effects),
        Command::Last => select_row(state, usize::MAX, effects),
        Command::NextUnfinished => select_next_unfinished(state, effects),
        Command::SelectFinger(finger) => {
            if finger != state.selection.finger {
                // A stroke is drawn on the finger it began on; it must not end out of sight.
                masks::end_stroke(state, effects);
                state.selection.finger = finger;
            }
        }
        Command::ShowBothFingers(both) => {
            masks::end_stroke(state, effects);
            state.selection.both_fingers = both;
        }
        Command::HoverPixel(hover) => state.selection.hover = hover.filter(is_finite),
        Command::HoverPoint(point) => state.selection.hover_point = point.filter(|p| p.is_finite()),
        Command::ShowPanes(panes) => state.selection.panes = panes,
        Command::SetPalette(open) => state.selection.palette = open,
        Command::SetShortcutSheet(open) => state.selection.shortcut_sheet = open,
        Command::Ui(request) => effects.push(Effect::Ui(request)),

        Command::Generate => generate::generate(state, false, effects),
        Command::GenerateNewSeed => generate::generate(state, true, effects),
        Command::Refit => refit::start(state, effects),
        Command::Seeds(command) => state.seeds.step(command),
        Command::Choose(recipe) => {
            if state.results.predictions.contains(&recipe) {
                state.results.chosen.insert(recipe.touch, recipe);
            }
        }
        Command::Cancel(ticket) => {
            if let Some(task) = state.tasks.running.get_mut(&ticket) {
                task.cancelling = true;
                effects.push(Effect::Cancel(ticket));
            }
        }
        Command::CancelAll => cancel_all(state, effects),
        Command::Retry => state.tasks.failed.clear(),

        Command::BeginStroke { finger, source, at_px, erase } => {
            masks::begin_stroke(state, finger, source, at_px, erase, effects);
        }
        Command::StrokeTo(at_px) => masks::stroke_to(state, at_px),
        Command::EndStroke => masks::end_stroke(state, effects),
        Command::CancelStroke => masks::cancel_stroke(state),
        Command::FillHoles => masks::fill_holes(state, effects),
        Command::LargestIsland => masks::largest_island(state, effects),
        Command::AdoptAutomatic => masks::adopt_automatic(state, effects),
        Command::ResetMask => masks::reset(state, effects),
        Command::Undo => masks::undo(state, effects),
        Command::Redo => masks::redo(state, effects),
        Command::SetReview(review) => {
            masks::set_review(state, review, effects);
            reorder(state);
        }
        Command::DoneAndNext => {
            masks::set_review(state, Review::Done, effects);
            // Before the list is sorted anew, so that "next" is what the person sees as next.
            select_next_unfinished(state, effects);
            reorder(state);
        }
        Command::AcceptPose(source, accept) => masks::accept_pose(state, source, accept, effects),
        Command::Inspect(command) => inspect::step(state, command),
        Command::Save => save_all(state, effects),
        Command::ExportMasks(folder) => {
            let Some(source) = state.library.open.as_ref().map(|open| open.source.clone()) else { return };
            let ticket = state.tasks.start("Export masks".into(), Vec::new());
            effects.push(Effect::ExportMasks { ticket, source, labels: state.document.labels.clone(), folder });
        }

        Command::Evaluate(command) => evaluate::step(state, command, effects),
        Command::Workbench(command) => workbench::step(state, command, effects),

        Command::LogSeen(number) => state.log.seen = state.log.seen.max(number),
        Command::Report(err) => state.log.error(&err),
        Command::Notice(text) => state.log.info(text),

        other => {
            if let Some(other) = preferences::step(state, other, effects) {
                answers::step(state, other, effects);
            }
        }
    }
}

fn is_finite(hover: &Hover) -> bool {
    hover.at_px.iter().all(|v| v.is_finite())
}

fn open(state: &mut State, place: Place, effects: &mut Vec<Effect>) {
    masks::end_stroke(state, effects);
    state.library.last_seq.0 += 1;
    let seq = state.library.last_seq;
    let ticket = state.tasks.start(format!("Open {place}"), Vec::new());
    if let Some(task) = state.tasks.running.get_mut(&ticket) {
        task.opening = Some(seq);
    }
    state.library.opening = Some(place.clone());
    state.library.failure = None;
    effects.push(Effect::Open { ticket, seq, place });
}

/// Puts a place first among the recent ones.
fn remember(state: &mut State, place: &Place, effects: &mut Vec<Effect>) {
    let recent = &mut state.settings.recent;
    recent.retain(|p| p != place);
    recent.insert(0, place.clone());
    recent.truncate(MAX_RECENT);
    save_settings(state, effects);
}

fn reorder(state: &mut State) {
    state.library.reorder(&state.document.reviews);
}

fn select_row(state: &mut State, row: usize, effects: &mut Vec<Effect>) {
    let last = state.library.order.len().wrapping_sub(1);
    if let Some(pair) = state.library.order.get(row.min(last)).copied() {
        select(state, pair, effects);
    }
}

fn step_by(state: &mut State, by: i64, effects: &mut Vec<Effect>) {
    let row = state.selection.pair.and_then(|pair| state.library.row_of(pair));
    match row {
        Some(row) => {
            let row = (row as i64).saturating_add(by).max(0) as usize;
            select_row(state, row, effects);
        }
        // What is selected was filtered away: start where the list starts.
        None => select_row(state, 0, effects),
    }
}

fn select_next_unfinished(state: &mut State, effects: &mut Vec<Effect>) {
    let order = &state.library.order;
    let start = state.selection.pair.and_then(|pair| state.library.row_of(pair)).map_or(0, |row| row + 1);
    let unfinished = |pair: &&PairId| {
        Some(**pair) != state.selection.pair
            && state.library.entry(**pair).is_some_and(|e| !state.document.review(&e.name).is_finished())
    };
    let next = order[start.min(order.len())..].iter().chain(order).find(unfinished).copied();
    match next {
        Some(pair) => select(state, pair, effects),
        None => state.log.info("Every pair of the list is done or skipped"),
    }
}

fn select(state: &mut State, pair: PairId, effects: &mut Vec<Effect>) {
    if state.library.entry(pair).is_none() || state.selection.pair == Some(pair) {
        return;
    }
    masks::end_stroke(state, effects);
    state.selection.pair = Some(pair);
    state.selection.hover_point = None;
    state.workbench.leave_pair();
    inspect::rewind(state);
    // What failed while it was only loaded ahead was not reported then.
    if let Some(key) = state.pair_key()
        && let Some(err) = state.tasks.failed.get(&Request::Sample(key))
    {
        state.log.error(err);
    }
    say_notes(state);
    preferences::follow_range(state);
}

/// What is odd about the files of the selected pair, once it is loaded; each pair once.
fn say_notes(state: &mut State) {
    let Some((key, sample)) = state.pair_key().and_then(|key| Some((key, state.results.samples.get(&key)?.clone())))
    else {
        return;
    };
    if sample.notes.is_empty() || !state.results.noted.insert(Request::Sample(key)) {
        return;
    }
    let name = state.pair_name().to_owned();
    for note in &sample.notes {
        let detail = format!("{} ({})", note.what, note.file.display());
        state.log.push(Level::Warning, format!("{name} is odd"), Some(detail), Some(note.hint.clone()));
    }
}

fn cancel_all(state: &mut State, effects: &mut Vec<Effect>) {
    for (ticket, task) in &mut state.tasks.running {
        task.cancelling = true;
        effects.push(Effect::Cancel(*ticket));
    }
}

fn save_settings(state: &State, effects: &mut Vec<Effect>) {
    effects.push(Effect::SaveSettings(Box::new(state.settings.clone())));
}

/// Writes the labels of a pair of the open data set.
fn save_labels(state: &mut State, name: &str, effects: &mut Vec<Effect>) {
    let Some(open) = &state.library.open else { return };
    let revision = state.document.next_revision();
    let Some(labels) = state.document.labels.get(name) else { return };
    let save = super::command::LabelsToSave { seq: open.seq, name: name.to_owned(), revision, labels: labels.clone() };
    effects.push(Effect::SaveLabels(open.source.clone(), Box::new(save)));
    state.document.unsaved.insert(name.to_owned());
    state.document.asked.insert(name.to_owned(), revision);
}

fn save_all(state: &mut State, effects: &mut Vec<Effect>) {
    masks::end_stroke(state, effects);
    let unsaved: Vec<String> = state.document.unsaved.iter().cloned().collect();
    for name in unsaved {
        save_labels(state, &name, effects);
    }
    save_settings(state, effects);
    state.log.push(Level::Info, "Labels and preferences are being written", None, None);
}
