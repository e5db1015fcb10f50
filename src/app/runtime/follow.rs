//! The thread that follows a folder, as `touch2touch watch` does. It sleeps almost always, and wakes the window only when a
//! touch arrived.

use std::sync::Arc;
use std::sync::mpsc::Sender;

use super::super::answers::Answer;
use super::super::keys::DatasetSeq;
use super::super::source::{Followed, Source};
use super::workers::Event;
use super::{JobId, Runtime, Wake};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::follow::{FollowEvent, Following};
use touch2touch_pipeline::io::catch_panic::catch_panic;
use touch2touch_pipeline::job::Cancel;

/// A followed folder.
pub(super) enum FollowTask {
    /// On a thread of its own, until told to stop.
    Thread(Cancel),
    /// Looked at in each round, where the runtime has no threads.
    Inline(DatasetSeq, Arc<Source>, Box<Following>),
}

impl Runtime {
    /// Follows a data set's folder instead of what was followed before; `None` follows nothing.
    pub(super) fn follow(&mut self, of: Option<(DatasetSeq, Arc<Source>)>) {
        if let Some(FollowTask::Thread(cancel)) = self.follower.take() {
            cancel.cancel();
        }
        let Some((seq, source)) = of else { return };
        if !self.threaded {
            let following = Following::continuing(source.dataset.clone()).map(Box::new);
            self.follower = following.map(|following| FollowTask::Inline(seq, source, following));
            return;
        }
        let cancel = Cancel::default();
        let (stop, sender, wake) = (cancel.clone(), self.sender.clone(), self.wake.clone());
        let thread = std::thread::Builder::new().name("follow".into()).spawn(move || {
            if let Err(message) = catch_panic(|| watch(seq, &source, &stop, &sender, &wake)) {
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
        if let Some(FollowTask::Inline(seq, source, following)) = &mut self.follower {
            while let Some(event) = following.poll() {
                let Some(followed) = followed(source, following, event) else { continue };
                let answer = Answer::Followed(*seq, followed);
                drop(self.sender.send(Event { id: JobId::Follow, answer }));
            }
        }
    }
}

fn watch(seq: DatasetSeq, source: &Source, stop: &Cancel, sender: &Sender<Event>, wake: &Wake) {
    let Some(mut following) = Following::continuing(source.dataset.clone()) else { return };
    while let Some(event) = following.wait(stop, false) {
        let Some(followed) = followed(source, &mut following, event) else { continue };
        if sender.send(Event { id: JobId::Follow, answer: Answer::Followed(seq, followed) }).is_err() {
            return;
        }
        wake();
    }
}

/// The touch that an event is about, with the data set that it arrived in.
fn followed(source: &Source, following: &mut Following, event: FollowEvent) -> Option<Followed> {
    let ready = match event {
        FollowEvent::Ready(ready) => ready,
        FollowEvent::Trouble(trouble) => {
            log::warn!("{}: {} ({})", trouble.file.display(), trouble.what, trouble.hint);
            return None;
        }
        FollowEvent::Recovered => return None,
    };
    let sample = following
        .read(&ready)?
        .map(Arc::new)
        .map_err(|problem| TaskError::new(format!("Load {}", ready.name), problem.what).with_hint(problem.hint));
    Some(Followed {
        source: Arc::new(source.grown(following.dataset()?)),
        pair: ready.id,
        completed: ready.completed,
        sample,
    })
}
