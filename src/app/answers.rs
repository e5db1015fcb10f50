//! [`Answer`]: what the runtime answers, and what follows from it in the rooms.

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::{Effect, NotSaved, TaskResult};
use super::jobs::Worker;
use super::keys::{DatasetSeq, Preview, Revision};
use super::source::Followed;
use super::state::State;
use super::state::labels::Merged;
use super::state::learn::Network;
use super::state::results::{Computed, Request};
use super::state::settings::Settings;
use super::state::tasks::{Level, TaskKind, Ticket};
use super::{follow, labels, library, results, settings, tasks, workbench};
use touch2touch_pipeline::error::{TaskError, TaskErrorKind};
use touch2touch_pipeline::job::Progress;
use touch2touch_pipeline::steps::bundles::BundleInfo;
use touch2touch_pipeline::steps::recipe::Stage;

/// An answer of the runtime.
#[derive(Clone, Debug)]
pub enum Answer {
    /// A touch arrived in the followed folder.
    Followed(DatasetSeq, Followed),
    /// Bundles were looked for.
    Bundles(Vec<BundleInfo>, Vec<TaskError>),
    /// The settings file was read.
    SettingsLoaded(Box<Settings>, Option<TaskError>),
    /// The demands that were handed to the runtime.
    Demanded(Vec<Request>),
    /// A result that a pane asked for, of an opening.
    Computed(DatasetSeq, Computed),
    /// A prediction as it looks on the way.
    Previewed(Ticket, Arc<Preview>),
    /// A job is under way.
    Progressed(Ticket, Progress),
    /// A task is done.
    TaskResult(Ticket, TaskResult),
    /// Something is done of which nothing follows.
    Done,
    /// It ended without a result.
    TaskFailed(Ticket, TaskError),
    /// A result that a pane asked for could not be made.
    RequestFailed(DatasetSeq, Box<Request>, TaskError),
    /// The labels of a pair are on the disk, as they were when this writing was asked for.
    LabelsSaved(String, Revision, Option<Box<Merged>>),
    /// The labels of a pair could not be written.
    LabelsFailed(Box<NotSaved>),
    /// Labels are in another folder, as they were when that was asked for.
    LabelsKept(Vec<(String, Revision)>, PathBuf),
    /// A job failed that is neither of a ticket nor of a request.
    JobFailed(TaskError),
}

pub(super) fn step(state: &mut State, answer: Answer, effects: &mut Vec<Effect>) {
    match answer {
        Answer::Followed(seq, followed) => {
            let current = state.library.is_open(seq);
            follow::arrived(state, followed, current, effects);
        }
        Answer::Bundles(bundles, problems) => library::found(state, bundles, problems),
        Answer::SettingsLoaded(settings, problem) => {
            state.settings = settings.validated();
            if let Some(problem) = problem {
                state.log.push(Level::Warning, problem.what, Some(problem.why), problem.hint);
            }
            effects.push(Effect::FindBundles(state.settings.bundle_folders.clone()));
        }
        Answer::Demanded(list) => state.tasks.demanded = list,
        Answer::Computed(seq, computed) if state.library.is_open(seq) => {
            let request = computed.request();
            results::keep(computed, state);
            match request {
                Request::Sample(key) if state.is_selected(key) => {
                    settings::follow_range(state);
                    library::say_notes(state);
                }
                Request::Estimate(key) if key.stage >= Stage::Cloud => workbench::refresh_cost(state),
                Request::Run(key) => workbench::run_arrived(state, &key),
                _ => {}
            }
        }
        // One that comes after its result, or after Cancel, is too late.
        Answer::Previewed(ticket, preview) if state.tasks.running.get(&ticket).is_some_and(|task| !task.cancelling) => {
            state.results.previews.insert(preview.recipe.touch, preview);
        }
        Answer::Progressed(ticket, progress) => {
            if let Some(task) = state.tasks.running.get_mut(&ticket) {
                task.progress = progress;
            }
        }
        Answer::TaskResult(ticket, end) => apply_result(state, ticket, &end, effects),
        Answer::TaskFailed(ticket, err) => failed_task(state, ticket, &err),
        Answer::RequestFailed(seq, request, err) if state.library.is_open(seq) => failed_request(state, *request, err),
        Answer::LabelsSaved(name, revision, merged) => {
            // An answer to anything but the last request: what was changed since is not on the disk yet.
            if state.document.asked.get(&name) == Some(&revision) {
                labels::unsaved::saved(state, &name, effects);
            }
            if let Some(merged) = merged {
                labels::merged(state, &name, &merged, effects);
            }
        }
        Answer::LabelsFailed(not) => labels::unsaved::failed(state, *not, effects),
        Answer::LabelsKept(revisions, folder) => labels::unsaved::kept(state, revisions, folder, effects),
        Answer::JobFailed(err) => state.log.error(&err),
        // What came too late, or needs nothing.
        Answer::Computed(..) | Answer::RequestFailed(..) | Answer::Previewed(..) | Answer::Done => {}
    }
}

/// Applies the result of a task.
fn apply_result(state: &mut State, ticket: Ticket, end: &TaskResult, effects: &mut Vec<Effect>) {
    let task = tasks::forget(state, ticket);
    // What took minutes and is of another data set has nowhere to be shown.
    if end.kind.worker() == Worker::Batch && task.is_none_or(|task| task.outdated) {
        return;
    }
    let before = state.library.open.as_ref().map(|open| (open.seq, open.place.clone()));
    end.apply_to(state, effects);
    if let Some(open) = &state.library.open
        && before.as_ref().is_none_or(|(seq, _)| *seq != open.seq)
    {
        let again = before.is_some_and(|(_, place)| place == open.place);
        follow::opened(state, again, effects);
    }
}

fn failed_task(state: &mut State, ticket: Ticket, err: &TaskError) {
    let Some(task) = tasks::forget(state, ticket) else { return };
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
    if err.is_cancelled() && !task.outdated {
        // Before anything was said nothing was done; what was left then is left no more.
        let far = task.progress.text.split(", about").next().unwrap_or_default();
        let kept = Some(far.to_owned()).filter(|far| !far.is_empty());
        // A fit in closed form has nothing to go on from.
        let network = state.learn.started;
        if task.kind == TaskKind::Learn && (network == Network::Masks || state.learn.form.tune) {
            state.learn.stopped[network as usize] = kept;
        }
    }
    state.log.error(err);
}

fn failed_request(state: &mut State, request: Request, err: TaskError) {
    if err.is_cancelled() {
        return;
    }
    // What a pane shows in place of the result is not said a second time, except what nobody would look for there.
    let awaited = matches!(&request, Request::Run(key) if workbench::run_failed(state, key));
    if results::failed(&request, state, &err) || awaited || err.kind == TaskErrorKind::Panicked {
        state.log.error(&err);
    }
    state.tasks.failed.insert(request, err);
}
