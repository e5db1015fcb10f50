//! From effects to jobs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::super::answers::Answer;
use super::super::effect::{Access, Effect, LabelsToSave, NotSaved, TaskJob};
use super::super::jobs::{Body, Worker};
use super::super::keys::Preview;
use super::super::results::prediction::{Onlooker, PreviewSink};
use super::super::source::Source;
use super::super::state::labels::Merged;
use super::super::state::tasks::Ticket;
use super::super::state::view::UiRequest;
use super::workers::{Event, Job};
use super::{JobId, Runtime, lock};
use touch2touch_core::dataset::Problem;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::folders;
use touch2touch_pipeline::job::{Cancel, JobCx};
use touch2touch_pipeline::steps::bundles;

impl Runtime {
    pub(super) fn perform(&mut self, effect: Effect, ui: &mut Vec<UiRequest>) {
        match effect {
            Effect::Ui(request) => ui.push(request),
            Effect::Start(ticket, started) => self.start_task(ticket, started),
            Effect::Cancel(ticket) => self.cancel(ticket),
            Effect::Follow(of) => self.follow(of),
            Effect::FindBundles(folders) => self.find_bundles(folders),
            Effect::SaveLabels(source, save) => self.save_labels(source, *save),
            Effect::KeepLabels { source, unsaved, folder, revisions } => {
                self.kept += 1;
                let id = JobId::KeepLabels(self.kept);
                self.unwatched(Worker::Files, id, "Keep the labels elsewhere", move |_| {
                    let folder = source.keep_labels(&unsaved, folder.as_deref())?;
                    Ok(Answer::LabelsKept(revisions, folder))
                });
            }
            Effect::SaveSettings(settings) => {
                let services = self.services.clone();
                self.unwatched(Worker::Files, JobId::SaveSettings, "Save the preferences", move |_| {
                    services.save_settings(&settings)?;
                    Ok(Answer::Done)
                });
            }
            Effect::Reveal(place) => {
                self.unwatched(Worker::Files, JobId::Reveal, "Show the folder", move |_| reveal(&place));
            }
        }
    }

    /// Queues a job that a person started.
    fn start_task(&mut self, ticket: Ticket, TaskJob { what, worker, body }: TaskJob) {
        let cancel = Cancel::default();
        self.cancels.insert(ticket, cancel.clone());
        let (latest, wake) = (self.progress.clone(), self.wake.clone());
        let progress = Arc::new(move |progress| {
            // Only the first since the last round wakes: the rest is picked up with it.
            if lock(&latest).insert(ticket, progress).is_none() {
                wake();
            }
        });
        let (latest, wake) = (self.previews.clone(), self.wake.clone());
        let sink: PreviewSink = Arc::new(move |preview: Preview| {
            lock(&latest).insert(preview.recipe.touch, (ticket, Arc::new(preview)));
            wake();
        });
        let onlooker = Onlooker { request: self.preview_request.clone(), sink };
        let access = Access { services: self.services.clone(), onlooker };
        let body: Body<Answer> = Box::new(move |cx| Ok(Answer::TaskResult(ticket, body(&access, cx)?)));
        let failed = Box::new(move |err| Answer::TaskFailed(ticket, err));
        let cx = JobCx::new(cancel, progress);
        self.workers.submit(worker, Job { id: JobId::Task(ticket), what, cx, body, failed });
    }

    fn cancel(&mut self, ticket: Ticket) {
        if let Some(cancel) = self.cancels.get(&ticket) {
            cancel.cancel();
        }
        // One that waits ends at once, not when its turn comes.
        if let Some(job) = self.workers.withdraw(&JobId::Task(ticket)) {
            let answer = (job.failed)(TaskError::cancelled(job.what));
            drop(self.sender.send(Event { id: job.id, answer }));
            (self.wake)();
        }
    }

    fn find_bundles(&self, folders: Vec<PathBuf>) {
        // On the worker of the models: hashing them must not hold up the files.
        self.unwatched(Worker::Models, JobId::Bundles, "Look for model bundles", move |_| {
            let found = bundles::find(&folders);
            let refused = |p: Problem| {
                let why = format!("{} ({})", p.what, p.file.display());
                TaskError::new("A model bundle was refused", why).with_hint(p.hint)
            };
            Ok(Answer::Bundles(found.bundles, found.problems.into_iter().map(refused).collect()))
        });
    }

    fn save_labels(&self, source: Arc<Source>, save: LabelsToSave) {
        let not = NotSaved { source: source.clone(), save: save.clone(), err: TaskError::new("", "") };
        let body: Body<Answer> = Box::new(move |_| {
            let now = source.labels.save(&save.name, &save.labels, &save.deed)?;
            let LabelsToSave { name, revision, labels: given, .. } = save;
            let merged = now.map(|now| Box::new(Merged { given, now }));
            Ok(Answer::LabelsSaved(name, revision, merged))
        });
        let id = JobId::SaveLabels(not.save.seq, not.save.name.clone());
        let failed = Box::new(move |err| Answer::LabelsFailed(Box::new(NotSaved { err, ..not })));
        let what = "Save the labels".to_owned();
        self.workers.submit(Worker::Files, Job { id, what, cx: JobCx::unwatched(), body, failed });
    }

    /// Queues a job that shows no progress.
    fn unwatched(
        &self,
        worker: Worker,
        id: JobId,
        what: &str,
        body: impl FnOnce(&JobCx) -> Result<Answer, TaskError> + Send + 'static,
    ) {
        let (what, failed) = (what.to_owned(), Box::new(Answer::JobFailed));
        self.workers.submit(worker, Job { id, what, cx: JobCx::unwatched(), body: Box::new(body), failed });
    }
}

fn reveal(place: &Path) -> Result<Answer, TaskError> {
    folders::reveal(place).map_err(|err| {
        TaskError::new("Show the folder", format!("{err} ({})", place.display())).with_hint("Copy the path instead.")
    })?;
    Ok(Answer::Done)
}
