//! Queues and threads. A job that panics is caught here and becomes an ordinary failure.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;

use strum::IntoEnumIterator as _;

use super::super::answers::Answer;
use super::super::jobs::{self, Body, Worker};
use super::super::keys::DatasetSeq;
use super::super::state::results::{Computed, Request};
use super::{JobId, Wake, lock};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::catch_panic::catch_panic;
use touch2touch_pipeline::job::{Cancel, JobCx};

/// The end of a job.
pub(super) struct Event {
    pub(super) id: JobId,
    pub(super) answer: Answer,
}

/// A waiting job.
pub(super) struct Job {
    pub(super) id: JobId,
    pub(super) what: String,
    pub(super) cx: JobCx,
    /// Computes the answer.
    pub(super) body: Body<Answer>,
    /// The answer when there is none.
    pub(super) failed: Box<dyn FnOnce(TaskError) -> Answer + Send>,
}

#[derive(Default)]
struct Queue {
    /// Jobs that a person or a change of the document started: in order, none left out.
    ordered: VecDeque<Job>,
    /// Jobs that a pane wants: replaced as a whole when it wants something else.
    demanded: VecDeque<Job>,
    /// Requests taken from `demanded` whose answer was not handled yet, with the flag that stops them.
    started: BTreeMap<Request, Cancel>,
    closing: bool,
}

impl Queue {
    fn pop(&mut self) -> Option<Job> {
        if let Some(job) = self.ordered.pop_front() {
            return Some(job);
        }
        if self.closing {
            return None;
        }
        let job = self.demanded.pop_front()?;
        if let JobId::Request(request) = &job.id {
            self.started.insert(request.clone(), job.cx.cancel.clone());
        }
        Some(job)
    }
}

struct WorkerState {
    queue: Mutex<Queue>,
    filled: Condvar,
}

pub(super) struct Workers {
    workers: Vec<Arc<WorkerState>>,
    threads: Vec<(Worker, JoinHandle<()>)>,
    sender: Sender<Event>,
    /// The demands that the queues were last filled from.
    demanded: Vec<Request>,
    threaded: bool,
}

/// Threads of each worker. Files go one after the other; models keep one loaded; computing uses what is left.
fn threads_of(worker: Worker) -> usize {
    match worker {
        Worker::Files | Worker::Models | Worker::Batch => 1,
        Worker::Compute => std::thread::available_parallelism().map_or(1, |n| n.get().saturating_sub(1).clamp(1, 4)),
    }
}

impl Workers {
    pub(super) fn new(threaded: bool, sender: &Sender<Event>, wake: &Wake) -> Self {
        let workers: Vec<Arc<WorkerState>> =
            Worker::iter().map(|_| Arc::new(WorkerState { queue: Mutex::default(), filled: Condvar::new() })).collect();
        let mut threads = Vec::new();
        for worker in Worker::iter().filter(|_| threaded) {
            for _ in 0..threads_of(worker) {
                let (state, sender, wake) = (workers[worker as usize].clone(), sender.clone(), wake.clone());
                let thread = std::thread::Builder::new()
                    .name(worker.name().to_owned())
                    .spawn(move || {
                        while run_next(&state, &sender, true) {
                            wake();
                        }
                    })
                    .expect("the system gives a program a handful of threads");
                threads.push((worker, thread));
            }
        }
        Self { workers, threads, sender: sender.clone(), demanded: Vec::new(), threaded }
    }

    /// Queues a job; one of the same name that waits is replaced and keeps its place.
    pub(super) fn submit(&self, worker: Worker, job: Job) {
        let state = &self.workers[worker as usize];
        let mut queue = lock(&state.queue);
        match queue.ordered.iter_mut().find(|waiting| waiting.id == job.id) {
            Some(waiting) => *waiting = job,
            None => queue.ordered.push_back(job),
        }
        state.filled.notify_one();
    }

    /// Takes a waiting job off its queue.
    pub(super) fn withdraw(&self, id: &JobId) -> Option<Job> {
        self.workers.iter().find_map(|state| {
            let mut queue = lock(&state.queue);
            let at = queue.ordered.iter().position(|job| job.id == *id)?;
            queue.ordered.remove(at)
        })
    }

    /// Makes `wanted`, in this order, what waits: what is not wanted any more is dropped, or told to stop if it runs.
    pub(super) fn demand(
        &mut self,
        wanted: &[Request],
        mut prepare: impl FnMut(&Request) -> Option<(DatasetSeq, jobs::Job<Computed>)>,
    ) {
        let (mut started, mut placed) = (BTreeSet::new(), BTreeSet::new());
        for state in &self.workers {
            let queue = lock(&state.queue);
            started.extend(queue.started.keys().cloned());
            placed.extend(queue.demanded.iter().filter_map(|job| match &job.id {
                JobId::Request(request) => Some(request.clone()),
                _ => None,
            }));
        }
        let is_placed = |request: &Request| started.contains(request) || placed.contains(request);
        if wanted == self.demanded && started.iter().all(|r| wanted.contains(r)) && wanted.iter().all(is_placed) {
            return;
        }
        // What runs for nobody is told to stop; what cannot stop ends and lands under its key.
        for state in &self.workers {
            for (request, cancel) in &lock(&state.queue).started {
                if !wanted.contains(request) {
                    cancel.cancel();
                }
            }
        }
        let mut fresh: Vec<VecDeque<Job>> = self.workers.iter().map(|_| VecDeque::new()).collect();
        for request in wanted.iter().filter(|r| !started.contains(r)) {
            let Some((seq, jobs::Job { worker, what, body })) = prepare(request) else { continue };
            let failed = request.clone();
            fresh[worker as usize].push_back(Job {
                id: JobId::Request(request.clone()),
                what,
                cx: JobCx::unwatched(),
                body: Box::new(move |cx| Ok(Answer::Computed(seq, body(cx)?))),
                failed: Box::new(move |err| Answer::RequestFailed(seq, Box::new(failed), err)),
            });
        }
        for (state, mut jobs) in self.workers.iter().zip(fresh) {
            let mut queue = lock(&state.queue);
            // A thread may have started one since `started` was read.
            jobs.retain(|job| !matches!(&job.id, JobId::Request(r) if queue.started.contains_key(r)));
            queue.demanded = jobs;
            state.filled.notify_all();
        }
        self.demanded = wanted.to_vec();
    }

    /// The answer of a job was handled.
    pub(super) fn forget(&mut self, id: &JobId) {
        if let JobId::Request(request) = id {
            for state in &self.workers {
                lock(&state.queue).started.remove(request);
            }
        }
    }

    pub(super) fn run_one(&self, worker: Worker) -> bool {
        !self.threaded && run_next(&self.workers[worker as usize], &self.sender, false)
    }

    pub(super) fn waiting(&self, worker: Worker) -> usize {
        let queue = lock(&self.workers[worker as usize].queue);
        queue.ordered.len() + queue.demanded.len()
    }

    /// Lets the threads end. Files that wait to be written are written first; nothing else is waited for.
    pub(super) fn close(&mut self) {
        for worker in Worker::iter() {
            let state = &self.workers[worker as usize];
            let mut queue = lock(&state.queue);
            queue.closing = true;
            if worker != Worker::Files {
                queue.ordered.clear();
            }
            state.filled.notify_all();
        }
        for (worker, thread) in self.threads.drain(..) {
            if worker == Worker::Files && thread.join().is_err() {
                log::error!("the files worker ended early");
            }
        }
        // Without threads the files are written here.
        while self.run_one(Worker::Files) {}
    }
}

/// Runs a worker's next job and sends its end; `false` if there is none. With `wait` there is none only at the end.
fn run_next(state: &WorkerState, sender: &Sender<Event>, wait: bool) -> bool {
    let Job { id, what, cx, body, failed } = {
        let mut queue = lock(&state.queue);
        loop {
            if let Some(job) = queue.pop() {
                break job;
            }
            if !wait || queue.closing {
                return false;
            }
            queue = state.filled.wait(queue).unwrap_or_else(std::sync::PoisonError::into_inner);
        }
    };
    let outcome = if cx.cancel.is_cancelled() {
        Err(TaskError::cancelled(what))
    } else {
        match catch_panic(|| body(&cx)) {
            Ok(outcome) => outcome,
            Err(message) => Err(TaskError::panicked(what, &message)),
        }
    };
    // Nobody listens any more where the runtime is gone.
    drop(sender.send(Event { id, answer: outcome.unwrap_or_else(failed) }));
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_pipeline::error::TaskErrorKind;

    #[test]
    fn a_panic_in_a_job_is_its_failure_and_the_worker_goes_on() {
        let (sender, events) = std::sync::mpsc::channel();
        let wake: Wake = Arc::new(|| {});
        let workers = Workers::new(false, &sender, &wake);
        let submit = |id, body: Body<Answer>| {
            let (what, failed) = ("Load".to_owned(), Box::new(Answer::JobFailed));
            workers.submit(Worker::Files, Job { id, what, cx: JobCx::unwatched(), body, failed });
        };
        submit(JobId::Bundles, Box::new(|_| panic!("the file bit back")));
        submit(JobId::Reveal, Box::new(|_| Ok(Answer::Done)));
        assert!(workers.run_one(Worker::Files) && workers.run_one(Worker::Files) && !workers.run_one(Worker::Files));
        let answers: Vec<Answer> = events.try_iter().map(|event| event.answer).collect();
        let [Answer::JobFailed(err), Answer::Done] = &answers[..] else { panic!("{answers:?}") };
        assert!(err.kind == TaskErrorKind::Panicked && err.why.contains("the file bit back"), "{err}");
    }
}
