//! What the runtime answers: results, progress, failures.

use super::super::command::{Command, Opened};
use super::super::document::Document;
use super::super::effect::Effect;
use super::super::keys::{DatasetSeq, Request};
use super::super::library::{OpenDataset, Place};
use super::super::results::Results;
use super::super::state::State;
use super::super::tasks::{Level, Task, Ticket};
use super::{cancel_all, follow, inspect, masks, preferences, refit, remember, reorder, workbench};
use crate::domain::dataset::PairId;
use crate::work::bundles::BundleKind;
use crate::work::error::{TaskError, TaskErrorKind};

pub(super) fn step(state: &mut State, command: Command, effects: &mut Vec<Effect>) {
    match command {
        Command::Opened(ticket, seq, place, opened) => {
            state.tasks.running.remove(&ticket);
            // A later opening was started meanwhile: this one is not wanted any more.
            if seq == state.library.last_seq {
                show(state, seq, place, opened, effects);
            }
        }
        Command::Followed(seq, followed) => {
            let current = state.library.open.as_ref().map(|open| open.seq);
            follow::arrived(state, followed, current == Some(seq), effects);
        }
        Command::Bundles(bundles, problems) => {
            for problem in &problems {
                state.log.error(problem);
            }
            let lacks = |kind| bundles.iter().all(|bundle| bundle.kind != kind);
            for (kind, text) in [
                (BundleKind::Generator, "No generator was found: nothing can be predicted"),
                (BundleKind::Mask, "No mask model was found: the mask source \"UNet\" is not available"),
            ] {
                if lacks(kind) {
                    let hint = "Put its folder into assets/models beside the program, or name a folder with bundles in \
                                TOUCH2TOUCH_MODELS.";
                    state.log.push(Level::Warning, text, None, Some(hint.into()));
                }
            }
            state.library.bundles = bundles;
            state.library.bundle_problems = problems;
        }
        Command::SettingsLoaded(settings, problem) => {
            state.settings = settings.validated();
            if let Some(problem) = problem {
                state.log.push(Level::Warning, problem.what, Some(problem.why), problem.hint);
            }
            effects.push(Effect::FindBundles(state.settings.bundle_folders.clone()));
        }
        Command::Demanded(list) => state.tasks.demanded = list,
        Command::Computed(computed) => {
            let request = computed.request();
            if is_current(state, &request) {
                computed.keep(state);
                react(state, &request);
            }
        }
        Command::Generated(ticket, predictions) => {
            forget(state, ticket);
            for (key, prediction) in predictions {
                state.keep_prediction(key, prediction);
            }
        }
        // One that comes after its result, or after Cancel, is too late.
        Command::Previewed(ticket, preview)
            if state.tasks.running.get(&ticket).is_some_and(|task| !task.cancelling) =>
        {
            state.results.previews.insert(preview.recipe.touch, preview);
        }
        Command::Refitted(ticket, statistics, saved) => {
            state.tasks.running.remove(&ticket);
            refit::arrived(state, &statistics, saved, effects);
        }
        Command::Progressed(ticket, progress) => {
            if let Some(task) = state.tasks.running.get_mut(&ticket) {
                task.progress = progress;
            }
        }
        Command::Finished(ticket, line) => {
            state.tasks.running.remove(&ticket);
            if let Some(line) = line {
                state.log.info(line);
            }
        }
        Command::TaskFailed(ticket, err) => failed_task(state, ticket, &err),
        Command::RequestFailed(request, err) => failed_request(state, request, err),
        // An answer to anything but the last request: what was changed since is not on the disk yet.
        Command::LabelsSaved(name, revision) if state.document.asked.get(&name) == Some(&revision) => {
            state.document.asked.remove(&name);
            state.document.unsaved.remove(&name);
        }
        Command::SaveFailed(err) => state.log.error(&err),
        // Everything else was carried out before.
        _ => {}
    }
}

fn show(state: &mut State, seq: DatasetSeq, place: Place, opened: Opened, effects: &mut Vec<Effect>) {
    masks::end_stroke(state, effects);
    // Predictions under way are of the data set before.
    cancel_all(state, effects);
    let before = state.entry().map(|entry| entry.name.clone());
    let same_place = state.library.open.as_ref().is_some_and(|open| open.place == place);
    state.results = Results::default();
    state.table.result = None;
    state.table.running = None;
    state.history.clear();
    state.tasks.failed.clear();
    state.document =
        Document { reviews: opened.reviews, last_revision: state.document.last_revision, ..Document::default() };
    state.library.opening = None;
    let tools = opened.source.index().tools();
    state.library.open = Some(OpenDataset { seq, place: place.clone(), source: opened.source.clone(), tools });
    follow::opened(state, same_place, effects);
    if !same_place {
        state.library.filter.clear();
        state.library.tool = None;
        state.library.rows = 0..0;
    }
    reorder(state);
    let kept = before.filter(|_| same_place).and_then(|name| {
        let at = opened.source.index().pairs.iter().position(|entry| entry.name == name)?;
        u32::try_from(at).ok().map(PairId)
    });
    state.selection.pair = kept.or_else(|| state.library.order.first().copied());
    state.selection.hover = None;
    state.selection.hover_point = None;
    state.workbench.leave_pair();
    inspect::rewind(state);
    state.inspect.pins = [None, None];
    let (pairs, problems) = (opened.source.index().pairs.len(), opened.source.problems().len());
    let (level, hint) = match problems {
        0 => (Level::Info, None),
        _ => (Level::Warning, Some("The list of problems says which files, and what to do.".to_owned())),
    };
    let text = match problems {
        0 => format!("{}: {pairs} pairs", opened.source.title()),
        n => format!("{}: {pairs} pairs, {n} problem{}", opened.source.title(), if n == 1 { "" } else { "s" }),
    };
    state.log.push(level, text, None, hint);
    remember(state, &place, effects);
}

/// Whether a result is of the data set that is open.
fn is_current(state: &State, request: &Request) -> bool {
    let current = state.library.open.as_ref().map(|open| open.seq);
    request.dataset().is_none_or(|seq| Some(seq) == current)
}

/// What the rooms do about a result that is there now.
fn react(state: &mut State, request: &Request) {
    match request {
        Request::Sample(key) if state.is_selected(*key) => {
            preferences::follow_range(state);
            super::say_notes(state);
        }
        Request::Cloud(_) => workbench::refresh_cost(state),
        Request::Run(key) => workbench::run_arrived(state, key),
        _ => {}
    }
}

/// Ends a task; what it showed on the way is not shown any more.
fn forget(state: &mut State, ticket: Ticket) -> Option<Task> {
    let task = state.tasks.running.remove(&ticket)?;
    for recipe in &task.recipes {
        if state.results.previews.get(&recipe.touch).is_some_and(|preview| preview.recipe == *recipe) {
            state.results.previews.remove(&recipe.touch);
        }
    }
    Some(task)
}

fn failed_task(state: &mut State, ticket: Ticket, err: &TaskError) {
    let Some(task) = forget(state, ticket) else { return };
    let current = state.library.open.as_ref().map(|open| open.seq);
    let outdated = task.recipes.iter().any(|r| Some(r.touch.pair.dataset) != current);
    if outdated && err.is_cancelled() {
        return;
    }
    if task.opening.is_some_and(|seq| seq != state.library.last_seq) {
        // A later opening was started meanwhile.
        return;
    }
    if task.opening.is_some() {
        state.library.opening = None;
        state.library.failure = Some(err.clone());
    }
    state.table.running.take_if(|running| *running == ticket);
    state.log.error(err);
}

fn failed_request(state: &mut State, request: Request, err: TaskError) {
    if !is_current(state, &request) || err.is_cancelled() {
        return;
    }
    // What a pane shows in place of the result is not said a second time, except what nobody would look for there.
    let awaited = matches!(&request, Request::Run(key) if workbench::run_failed(state, key));
    if request.failed(state, &err) || awaited || err.kind == TaskErrorKind::Panicked {
        state.log.error(&err);
    }
    state.tasks.failed.insert(request, err);
}
