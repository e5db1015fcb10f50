//! [`Runtime`]: turns effects and requests into jobs on workers, and their answers into commands.

mod follow;
mod perform;
mod workers;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use workers::{Event, Workers};

use super::answers::Answer;
use super::apply::apply;
use super::command::{Command, LabelsCommand, LibraryCommand, UnsavedCommand};
use super::effect::Effect;
use super::jobs::Worker;
use super::keys::{DatasetSeq, Preview, TouchKey};
use super::results::prediction::PreviewRequest;
use super::services::Services;
use super::state::State;
use super::state::library::Place;
use super::state::results::Request;
use super::state::tasks::Ticket;
use super::state::view::UiRequest;
use super::{demand, labels, results};
use touch2touch_pipeline::io::catch_panic::{catch_panic, lock};
use touch2touch_pipeline::job::{Cancel, Progress};

/// The latest picture on the way of each touch, with the job that made it.
type LatestPreviews = BTreeMap<TouchKey, (Ticket, Arc<Preview>)>;

/// Called from any thread when there is something for [`Runtime::tick`] to do.
pub(crate) type Wake = Arc<dyn Fn() + Send + Sync>;

/// The name of a job: a newer one of the same name replaces one that waits.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(clippy::large_enum_variant, reason = "a few hundred at most, and most are requests")]
pub(super) enum JobId {
    /// Started by a person.
    Task(Ticket),
    /// Demands by a pane.
    Request(Request),
    /// Writing the labels of a pair.
    SaveLabels(DatasetSeq, String),
    /// Writing the settings.
    SaveSettings,
    /// Looking for bundles.
    Bundles,
    /// Following a folder.
    Follow,
    /// Showing a folder.
    Reveal,
    /// Writing labels to another folder.
    KeepLabels(usize),
}

/// Runs what `apply` wants done and what the panes want to show.
pub struct Runtime {
    services: Arc<Services>,
    workers: Workers,
    events: Receiver<Event>,
    sender: Sender<Event>,
    /// Progress by ticket, only the latest.
    progress: Arc<std::sync::Mutex<BTreeMap<Ticket, Progress>>>,
    /// Pictures on the way, only the latest of each touch.
    previews: Arc<std::sync::Mutex<LatestPreviews>>,
    /// The part of them that would be looked at.
    preview_request: Arc<std::sync::Mutex<PreviewRequest>>,
    wake: Wake,
    cancels: BTreeMap<Ticket, Cancel>,
    follower: Option<follow::FollowTask>,
    /// When labels that could not be written are tried again.
    retry_at: Option<Instant>,
    /// Folders that labels were kept in so far: each such job is one of its own.
    kept: usize,
    threaded: bool,
}

impl Runtime {
    /// A runtime with its own threads; `wake` is called when there is news.
    pub fn threads(services: Arc<Services>, wake: Wake) -> Self {
        Self::new(services, wake, true)
    }

    /// A runtime without threads: jobs wait until [`Runtime::run_one`] or [`Runtime::settle`] runs them here.
    pub fn inline(services: Arc<Services>) -> Self {
        Self::new(services, Arc::new(|| {}), false)
    }

    fn new(services: Arc<Services>, wake: Wake, threaded: bool) -> Self {
        let (sender, events) = channel();
        let workers = Workers::new(threaded, &sender, &wake);
        Self {
            services,
            workers,
            events,
            sender,
            progress: Arc::default(),
            previews: Arc::default(),
            preview_request: Arc::default(),
            wake,
            cancels: BTreeMap::new(),
            follower: None,
            retry_at: None,
            kept: 0,
            threaded,
        }
    }

    /// Reads the settings, looks for bundles and opens `place` (else what was open last, else the demo).
    pub fn start(&mut self, state: &mut State, place: Option<Place>) -> Vec<UiRequest> {
        let (settings, problem) = self.services.load_settings();
        let place = place.or_else(|| settings.recent.first().cloned()).unwrap_or(Place::Demo);
        let loaded = Answer::SettingsLoaded(Box::new(settings), problem);
        self.tick(state, vec![loaded.into(), LibraryCommand::Open(place).into()])
    }

    /// One round: answers of jobs, then `commands`, then what has to be done about them, then what is to be shown.
    ///
    /// Returns what only the window can do. Cheap when there is nothing to do.
    pub fn tick(&mut self, state: &mut State, commands: Vec<Command>) -> Vec<UiRequest> {
        let mut ui = Vec::new();
        self.poll_follower();
        while let Ok(Event { id, answer }) = self.events.try_recv() {
            if let JobId::Task(ticket) = &id {
                self.cancels.remove(ticket);
                lock(&self.progress).remove(ticket);
            }
            self.run(state, answer, &mut ui);
            // Only now: until its result is in the state, a request counts as running and is not started again.
            self.workers.forget(&id);
        }
        let progress = std::mem::take(&mut *lock(&self.progress));
        for (ticket, progress) in progress {
            self.run(state, Answer::Progressed(ticket, progress), &mut ui);
        }
        let previews = std::mem::take(&mut *lock(&self.previews));
        for (ticket, preview) in previews.into_values() {
            self.run(state, Answer::Previewed(ticket, preview), &mut ui);
        }
        for command in commands {
            self.run(state, command, &mut ui);
        }
        self.retry(state, &mut ui);
        let request = results::preview_request(state);
        if request != *lock(&self.preview_request) {
            *lock(&self.preview_request) = request;
        }
        let wanted = demand::demands(state);
        if wanted != state.tasks.demanded {
            self.run(state, Answer::Demanded(wanted), &mut ui);
        }
        let ahead = if self.threaded { demand::ahead(state) } else { Vec::new() };
        let services = &self.services;
        let wanted = if ahead.is_empty() { &state.tasks.demanded } else { &ahead };
        self.workers.demand(wanted, |request| {
            Some((state.library.open.as_ref()?.seq, results::job(request, state, services)?))
        });
        ui
    }

    /// Tries labels again that could not be written, after a while.
    fn retry(&mut self, state: &mut State, ui: &mut Vec<UiRequest>) {
        if state.document.failed.is_empty() {
            self.retry_at = None;
            return;
        }
        let now = Instant::now();
        let due = self.retry_at.is_some_and(|at| at <= now);
        if due {
            self.run(state, LabelsCommand::Unsaved(UnsavedCommand::Retry), ui);
        }
        if due || self.retry_at.is_none() {
            self.retry_at = now.checked_add(self.services.retry_after);
        }
    }

    /// The time until [`Runtime::tick`] has to be called although nothing happens; `None` = not at all.
    pub fn next_tick(&self) -> Option<Duration> {
        Some(self.retry_at?.saturating_duration_since(Instant::now()))
    }

    /// Ends: waits for the files that are being written, and has labels that could not be written wait for the next opening
    /// of their data set. Call [`Runtime::tick`] no more.
    pub fn finish(&mut self, state: &mut State) {
        self.follow(None);
        self.workers.close();
        let mut keep: Vec<Effect> = Vec::new();
        while let Ok(Event { answer, .. }) = self.events.try_recv() {
            keep.extend(apply(state, answer.into()).into_iter().filter(|e| matches!(e, Effect::KeepLabels { .. })));
        }
        let unsaved = labels::unsaved(state);
        if let Some(open) = state.library.open.as_ref().filter(|_| !unsaved.is_empty()) {
            keep.push(Effect::keep_waiting(open.source.clone(), unsaved));
        }
        for effect in keep {
            if let Effect::KeepLabels { source, unsaved, folder, .. } = effect {
                match catch_panic(|| source.keep_labels(&unsaved, folder.as_deref())) {
                    Ok(Ok(folder)) => log::warn!("Labels that could not be saved are in {}", folder.display()),
                    Ok(Err(err)) => log::error!("{err}"),
                    Err(message) => log::error!("Keep the labels: {message}"),
                }
            }
        }
        state.document.unsaved.clear();
    }

    /// Runs the first waiting job of a worker here and now; `false` if none waits. Only without threads.
    pub fn run_one(&mut self, worker: Worker) -> bool {
        self.workers.run_one(worker)
    }

    /// Runs jobs here until nothing waits any more. Only without threads.
    pub fn settle(&mut self, state: &mut State) -> Vec<UiRequest> {
        use strum::IntoEnumIterator as _;
        let mut ui = self.tick(state, Vec::new());
        while Worker::iter().any(|worker| self.workers.run_one(worker)) {
            ui.extend(self.tick(state, Vec::new()));
        }
        ui
    }

    /// Jobs that wait on a worker.
    pub fn waiting(&self, worker: Worker) -> usize {
        self.workers.waiting(worker)
    }

    fn run(&mut self, state: &mut State, command: impl Into<Command>, ui: &mut Vec<UiRequest>) {
        let command = command.into();
        log::trace!("{command:?}");
        for effect in apply(state, command) {
            self.perform(effect, ui);
        }
    }
}

impl Drop for Runtime {
    /// Tells every job to stop, and waits for files that are being written.
    fn drop(&mut self) {
        for cancel in self.cancels.values() {
            cancel.cancel();
        }
        self.follow(None);
        self.workers.close();
    }
}
