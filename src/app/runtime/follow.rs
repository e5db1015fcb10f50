//! The thread that follows a folder. It sleeps almost always, and wakes the window only when a touch arrived.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use super::super::answers::Answer;
use super::super::keys::DatasetSeq;
use super::super::source::{DataSource, Following};
use super::lanes::Event;
use super::{JobId, Runtime, Wake};
use touch2touch_work::error::TaskError;
use touch2touch_work::io::caught::caught;
use touch2touch_work::io::follow::PERIOD;
use touch2touch_work::job::Cancel;

/// A followed folder.
pub(super) enum FollowTask {
    /// On a thread of its own, until told to stop.
    Thread(Cancel),
    /// Looked at in each round, where the runtime has no threads.
    Inline(DatasetSeq, Box<dyn Following>),
}

impl Runtime {
    /// Follows a data set's folder instead of what was followed before; `None` follows nothing.
    pub(super) fn follow(&mut self, of: Option<(DatasetSeq, Arc<dyn DataSource>)>) {
        if let Some(FollowTask::Thread(cancel)) = self.follower.take() {
            cancel.cancel();
        }
        let Some((seq, source)) = of else { return };
        if !self.threaded {
            self.follower = source.follow().map(|following| FollowTask::Inline(seq, following));
            return;
        }
        let cancel = Cancel::default();
        let (stop, sender, wake) = (cancel.clone(), self.sender.clone(), self.wake.clone());
        let thread = std::thread::Builder::new().name("follow".into()).spawn(move || {
            if let Err(message) = caught(|| watch(seq, &*source, &stop, &sender, &wake)) {
                let err = TaskError::panicked("Follow", &message);
                drop(sender.send(Event { id: JobId::Follow, answer: Answer::JobFailed(err) }));
                wake();
            }
        });
        match thread {
            Ok(_) => self.follower = Some(FollowTask::Thread(cancel)),
            Err(err) => {
                let answer = Answer::JobFailed(TaskError::from_error("Follow", &err));
                drop(self.sender.send(Event { id: JobId::Follow, answer }));
            }
        }
    }

    pub(super) fn poll_follower(&mut self) {
        if let Some(FollowTask::Inline(seq, following)) = &mut self.follower {
            while let Some(followed) = following.poll() {
                let answer = Answer::Followed(*seq, followed);
                drop(self.sender.send(Event { id: JobId::Follow, answer }));
            }
        }
    }
}

fn watch(seq: DatasetSeq, source: &dyn DataSource, stop: &Cancel, sender: &Sender<Event>, wake: &Wake) {
    let Some(mut following) = source.follow() else { return };
    while !stop.is_cancelled() {
        match following.poll() {
            Some(followed) => {
                if sender.send(Event { id: JobId::Follow, answer: Answer::Followed(seq, followed) }).is_err() {
                    return;
                }
                wake();
            }
            None => std::thread::sleep(PERIOD),
        }
    }
}
