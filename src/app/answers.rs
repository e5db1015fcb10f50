//! [`Answer`]: what the runtime answers, and what follows from it in the rooms.

use std::path::PathBuf;
use std::sync::Arc;

use super::effect::{Effect, NotSaved};
use super::keys::{DatasetSeq, Revision};
use super::labels::state::Merged;
use super::library::state::Place;
use super::results::prediction::Keyed;
use super::results::{Computed, Preview, Request};
use super::services::{Followed, Opened};
use super::settings::state::Settings;
use super::state::State;
use super::tasks::state::{Level, Ticket};
use super::{adapt, dial, evaluate, export, follow, labels, library, predict, settings, tasks, train, workbench};
use touch2touch_work::adapt::Adapted;
use touch2touch_work::bundles::BundleInfo;
use touch2touch_work::error::{TaskError, TaskErrorKind};
use touch2touch_work::evaluate::Evaluation;
use touch2touch_work::import::Import;
use touch2touch_work::io::statistics::ShiftStatistics;
use touch2touch_work::job::Progress;
use touch2touch_work::propose::Batch;
use touch2touch_work::sweep::Sweep;
use touch2touch_work::tool::UnitSet;
use touch2touch_work::train::Trained;

/// What the runtime answers.
#[derive(Clone, Debug)]
pub enum Answer {
    /// A touch arrived in the followed folder.
    Followed(DatasetSeq, Followed),
    /// A data set was opened.
    Opened(Ticket, DatasetSeq, Place, Opened),
    /// A tool's CAD file is read in another unit, of an opening.
    UnitSet(Ticket, DatasetSeq, UnitSet),
    /// Bundles were looked for.
    Bundles(Vec<BundleInfo>, Vec<TaskError>),
    /// The settings file was read.
    SettingsLoaded(Box<Settings>, Option<TaskError>),
    /// What the runtime was asked for because it is shown.
    Demanded(Vec<Request>),
    /// A result that a pane asked for, of an opening.
    Computed(DatasetSeq, Computed),
    /// Predictions are there.
    Generated(Ticket, Keyed),
    /// A prediction as it looks on the way.
    Previewed(Ticket, Arc<Preview>),
    /// Shift statistics are there.
    Refitted(Ticket, Box<ShiftStatistics>, Option<String>),
    /// A job is under way.
    Progressed(Ticket, Progress),
    /// A job without a result is done, with a line for the log.
    Finished(Ticket, Option<String>),
    /// A job is done that wrote something there, with a line for the log.
    Saved(Ticket, String, PathBuf),
    /// The system was asked to show a place.
    Revealed,
    /// A job ended without a result.
    TaskFailed(Ticket, TaskError),
    /// A result that a pane asked for could not be made.
    RequestFailed(DatasetSeq, Box<Request>, TaskError),
    /// The labels of a pair are on the disk, as they were when this writing was asked for.
    LabelsSaved(String, Revision, Option<Box<Merged>>),
    /// The labels of a pair could not be written.
    LabelsFailed(Box<NotSaved>),
    /// Labels are in another folder, as they were when that was asked for.
    LabelsKept(Vec<(String, Revision)>, PathBuf),
    /// The settings are on the disk.
    SettingsSaved,
    /// A job failed that is neither of a ticket nor of a request.
    JobFailed(TaskError),
    /// The results table is there.
    Evaluated(Ticket, Arc<Evaluation>),
    /// The dial was turned.
    Swept(Ticket, Arc<Sweep>),
    /// Masks were proposed for many pairs.
    ProposedAll(Ticket, Box<Batch>),
    /// Masks were taken over.
    Imported(Ticket, Box<Import>),
    /// A generator was fitted, and is this bundle where one was written.
    Adapted(Ticket, Arc<Adapted>, Option<Box<BundleInfo>>),
    /// A mask model was trained, and is this bundle.
    Trained(Ticket, Arc<Trained>, Box<BundleInfo>),
}

pub(super) fn step(state: &mut State, answer: Answer, effects: &mut Vec<Effect>) {
    match answer {
        Answer::Opened(ticket, seq, place, opened) => {
            state.tasks.running.remove(&ticket);
            // A later opening was started meanwhile: this one is not wanted any more.
            if seq == state.library.last_seq {
                let again = library::show(state, seq, place, opened, effects);
                follow::opened(state, again, effects);
                export::opened(state, effects);
            }
        }
        Answer::Followed(seq, followed) => {
            let current = is_open(state, seq);
            follow::arrived(state, followed, current, effects);
        }
        Answer::UnitSet(ticket, seq, set) => {
            tasks::forget(state, ticket);
            let current = is_open(state, seq);
            library::unit_set(state, set, current);
        }
        Answer::Bundles(bundles, problems) => {
            library::found(state, bundles, problems);
            export::case_models(state, effects);
        }
        Answer::SettingsLoaded(settings, problem) => {
            state.settings = settings.validated();
            if let Some(problem) = problem {
                state.log.push(Level::Warning, problem.what, Some(problem.why), problem.hint);
            }
            effects.push(Effect::FindBundles(state.settings.bundle_folders.clone()));
        }
        Answer::Demanded(list) => state.tasks.demanded = list,
        Answer::Computed(seq, computed) if is_open(state, seq) => {
            let request = computed.request();
            computed.keep(state);
            react(state, &request);
        }
        Answer::Generated(ticket, predictions) => {
            tasks::forget(state, ticket);
            for (key, prediction) in predictions {
                state.keep_prediction(key, prediction, true);
            }
        }
        // One that comes after its result, or after Cancel, is too late.
        Answer::Previewed(ticket, preview) if state.tasks.running.get(&ticket).is_some_and(|task| !task.cancelling) => {
            state.results.previews.insert(preview.recipe.touch, preview);
        }
        Answer::Refitted(ticket, statistics, saved) => {
            state.tasks.running.remove(&ticket);
            predict::refit::arrived(state, &statistics, saved, effects);
        }
        Answer::Progressed(ticket, progress) => {
            evaluate::progressed(state, ticket, &progress);
            if let Some(task) = state.tasks.running.get_mut(&ticket) {
                task.progress = progress;
            }
        }
        Answer::Finished(ticket, line) => {
            state.tasks.running.remove(&ticket);
            if let Some(line) = line {
                state.log.info(line);
            }
        }
        Answer::Saved(ticket, line, place) => {
            state.tasks.running.remove(&ticket);
            state.log.saved(line, place);
        }
        Answer::TaskFailed(ticket, err) => failed_task(state, ticket, &err),
        Answer::RequestFailed(seq, request, err) if is_open(state, seq) => failed_request(state, *request, err),
        Answer::LabelsSaved(name, revision, merged) => {
            // An answer to anything but the last request: what was changed since is not on the disk yet.
            if state.document.asked.get(&name) == Some(&revision) {
                labels::unsaved::saved(state, &name, effects);
                labels::saved(state);
            }
            if let Some(merged) = merged {
                labels::merged(state, &name, &merged, effects);
            }
        }
        Answer::LabelsFailed(not) => labels::unsaved::failed(state, *not, effects),
        Answer::LabelsKept(revisions, folder) => labels::unsaved::kept(state, revisions, folder, effects),
        Answer::JobFailed(err) => state.log.error(&err),
        Answer::Evaluated(ticket, evaluation) => {
            state.tasks.running.remove(&ticket);
            evaluate::arrived(state, ticket, evaluation);
        }
        Answer::Swept(ticket, sweep) => {
            state.tasks.running.remove(&ticket);
            dial::arrived(state, ticket, sweep);
        }
        Answer::ProposedAll(ticket, batch) => {
            state.tasks.running.remove(&ticket);
            labels::proposed(state, ticket, &batch);
        }
        Answer::Imported(ticket, import) => {
            state.tasks.running.remove(&ticket);
            if state.export.import.take_if(|under_way| *under_way == ticket).is_some() {
                labels::imported(state, &import);
            }
        }
        Answer::Adapted(ticket, adapted, bundle) => {
            state.tasks.running.remove(&ticket);
            adapt::arrived(state, ticket, adapted, bundle.map(|bundle| *bundle));
        }
        Answer::Trained(ticket, trained, bundle) => {
            state.tasks.running.remove(&ticket);
            train::arrived(state, ticket, trained, *bundle, effects);
        }
        // What came too late, or needs nothing.
        Answer::Computed(..)
        | Answer::RequestFailed(..)
        | Answer::Previewed(..)
        | Answer::SettingsSaved
        | Answer::Revealed => {}
    }
}

/// Whether a data set is the one that is open: what is of an earlier opening comes too late.
fn is_open(state: &State, seq: DatasetSeq) -> bool {
    state.library.open.as_ref().is_some_and(|open| open.seq == seq)
}

/// What the rooms do about a result that is there now.
fn react(state: &mut State, request: &Request) {
    match request {
        Request::Sample(key) if state.is_selected(*key) => {
            settings::follow_range(state);
            library::say_notes(state);
        }
        Request::Cloud(_) => workbench::refresh_cost(state),
        Request::Run(key) => workbench::run_arrived(state, key),
        _ => {}
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
    if state.table.running.take_if(|running| *running == ticket).is_some() {
        // What was scored before it stopped is kept.
        state.table.round += 1;
    }
    state.log.error(err);
}

fn failed_request(state: &mut State, request: Request, err: TaskError) {
    if err.is_cancelled() {
        return;
    }
    // What a pane shows in place of the result is not said a second time, except what nobody would look for there.
    let awaited = matches!(&request, Request::Run(key) if workbench::run_failed(state, key));
    if request.failed(state, &err) || awaited || err.kind == TaskErrorKind::Panicked {
        state.log.error(&err);
    }
    state.tasks.failed.insert(request, err);
}
