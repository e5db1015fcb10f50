//! [`Following`]: what happens in a followed folder, one event after the other, for the studio and for `watch`.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use super::error::TaskError;
use super::job::Cancel;
use super::labels::{Labels, PairLabels};
use crate::io::dataset::{Dataset, OpenError};
use crate::io::follow::{Arrival, FollowConfig, Follower, PERIOD, Ready};
use touch2touch_core::dataset::{PairEntry, Problem};

/// Event in a followed folder.
#[derive(Debug)]
pub enum FollowEvent {
    /// Something is wrong with the folder as a whole; said once for as long as it lasts.
    Trouble(Problem),
    /// Nothing is wrong with it any more.
    Recovered,
    /// A touch can be read; see [`Following::read`].
    Ready(Ready),
}

/// A followed folder.
#[derive(Debug)]
pub struct Following {
    follower: Follower,
    /// Troubles of the folder that were said.
    said: Vec<Problem>,
    unsaid: VecDeque<FollowEvent>,
}

impl Following {
    /// Follows a folder, which may still be empty.
    ///
    /// # Errors
    /// [`OpenError::Io`] if the folder is not there.
    pub fn new(folder: &Path, config: FollowConfig) -> Result<Self, OpenError> {
        Follower::new(folder, config).map(Self::of)
    }

    /// Follows the folder of an open data set, whose pairs keep their ids; `None` for one without a folder.
    pub fn continuing(dataset: Arc<Dataset>) -> Option<Self> {
        Follower::continuing(dataset).map(Self::of)
    }

    fn of(follower: Follower) -> Self {
        Self { follower, said: Vec::new(), unsaid: VecDeque::new() }
    }

    /// The data set as far as it is known, known pairs with their ids; `None` while the folder holds none.
    pub fn dataset(&self) -> Option<&Arc<Dataset>> {
        self.follower.dataset()
    }

    /// Nothing was wrong with the folder at the last look.
    pub fn is_in_order(&self) -> bool {
        self.said.is_empty()
    }

    /// The next thing that happened; `None` if there is nothing until the next [`PERIOD`].
    pub fn poll(&mut self) -> Option<FollowEvent> {
        let said = self.unsaid.pop_front();
        if said.is_some() {
            return said;
        }
        let ready = self.follower.poll(Instant::now()).map(FollowEvent::Ready);
        let now = self.follower.troubles();
        if now != self.said {
            let new = now.iter().filter(|trouble| !self.said.contains(trouble)).cloned();
            self.unsaid.extend(new.map(FollowEvent::Trouble));
            if now.is_empty() {
                self.unsaid.push_back(FollowEvent::Recovered);
            }
            self.said = now.to_vec();
        }
        self.unsaid.extend(ready);
        self.unsaid.pop_front()
    }

    /// Next event, waited for. `None` once it is told to stop, with `once` as soon as nothing lies there any more.
    pub fn wait(&mut self, stop: &Cancel, once: bool) -> Option<FollowEvent> {
        while !stop.is_cancelled() {
            let event = self.poll();
            if event.is_some() || once && self.follower.waiting() == 0 {
                return event;
            }
            std::thread::sleep(PERIOD);
        }
        None
    }

    /// Reads a touch.
    pub fn read(&mut self, ready: &Ready) -> Arrival {
        self.follower.load(ready, Instant::now())
    }

    /// The entry of a touch in the data set.
    pub fn entry(&self, ready: &Ready) -> Option<&PairEntry> {
        self.dataset()?.index.get(ready.id)
    }

    /// Labels that people gave a touch; none, as a rule, of one that just arrived.
    ///
    /// # Errors
    /// If there is something that cannot be read.
    pub fn labels(&self, ready: &Ready) -> Result<PairLabels, TaskError> {
        self.dataset().map_or_else(|| Ok(PairLabels::default()), |dataset| Labels::of(dataset).load(&ready.name))
    }
}
