//! Following a folder: the same follower as `touch2touch watch`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::super::super::source::{DataSource, Followed, Following};
use super::LiveSource;
use touch2touch_core::dataset::Problem;
use touch2touch_work::error::TaskError;
use touch2touch_work::io::follow::{Arrival, Follower};
use touch2touch_work::labels::{Labels, Recovered, Reviews};

struct LiveFollowing {
    follower: Follower,
    reviews: Reviews,
    labels: Labels,
    repeats: Arc<Mutex<BTreeMap<String, Labels>>>,
    waiting: Option<PathBuf>,
    /// Troubles of the folder that were said.
    said: Vec<Problem>,
}

/// `None` for the demo.
pub(super) fn start(source: &LiveSource) -> Option<Box<dyn Following>> {
    let follower = Follower::continuing(source.dataset.clone())?;
    let (reviews, labels, repeats) = (source.reviews.clone(), source.labels.clone(), source.repeats.clone());
    let waiting = source.waiting.clone();
    Some(Box::new(LiveFollowing { follower, reviews, labels, repeats, waiting, said: Vec::new() }))
}

impl Following for LiveFollowing {
    fn poll(&mut self) -> Option<Followed> {
        let now = Instant::now();
        let ready = self.follower.poll(now);
        if self.follower.troubles() != self.said {
            for trouble in self.follower.troubles().iter().filter(|trouble| !self.said.contains(trouble)) {
                log::warn!("{}: {} ({})", trouble.file.display(), trouble.what, trouble.hint);
            }
            self.said = self.follower.troubles().to_vec();
        }
        let ready = ready?;
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
            repeats: self.repeats.clone(),
            case: None,
            waiting: self.waiting.clone(),
            recovered: Recovered::default(),
            dataset,
        });
        Some(Followed { source, pair: ready.id, completed: ready.completed, sample })
    }
}
