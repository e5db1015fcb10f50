//! Following a folder: the same follower as `touch2touch watch`.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use super::super::super::document::Review;
use super::super::{DataSource, Followed, Following};
use super::LiveSource;
use crate::io::follow::{Arrival, Follower};
use crate::work::error::TaskError;
use crate::work::labels::Labels;

struct LiveFollowing {
    follower: Follower,
    reviews: BTreeMap<String, Review>,
    labels: Labels,
}

/// `None` for the demo.
pub(super) fn start(source: &LiveSource) -> Option<Box<dyn Following>> {
    let follower = Follower::continuing(source.dataset.clone())?;
    Some(Box::new(LiveFollowing { follower, reviews: source.reviews.clone(), labels: source.labels.clone() }))
}

impl Following for LiveFollowing {
    fn poll(&mut self) -> Option<Followed> {
        let now = Instant::now();
        let ready = self.follower.poll(now)?;
        let sample = match self.follower.load(&ready, now) {
            Arrival::Unfinished | Arrival::Gone => return None,
            Arrival::Broken(problem) => {
                Err(TaskError::new(format!("Load {}", ready.name), problem.what).with_hint(problem.hint))
            }
            Arrival::Whole(loaded) => Ok(Arc::new(loaded.sample)),
        };
        let dataset = self.follower.dataset()?.clone();
        let source: Arc<dyn DataSource> = Arc::new(LiveSource {
            labels: self.labels.continued(&dataset),
            problems: dataset.problems.clone(),
            reviews: self.reviews.clone(),
            dataset,
        });
        Some(Followed { source, pair: ready.id, completed: ready.completed, sample })
    }
}
