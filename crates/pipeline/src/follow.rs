//! [`Following`]: touches that appear in a folder, one by one, each as soon as its files are whole; for the studio and for
//! `watch`.
//!
//! The folder is polled, every [`PERIOD`]: unlike the system's notifications, that also sees what another machine writes
//! to a network folder. A poll asks for the time of change of a handful of folders; names are read again when one of
//! them changed, or now and then. A file counts as whole when it can be read to its end (a cut `.pt`, PNG or JPEG
//! cannot) and did not change meanwhile; until then it is tried again, at most for the given patience after its last
//! change.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::io::error::{FileError, FileErrorKind};
use crate::job::Cancel;
use crate::labels::{Labels, PairLabels};
use touch2touch_core::dataset::{PairEntry, PairId, Problem};
use touch2touch_core::sample::Sample;

/// Time between two looks at the folder.
pub const PERIOD: Duration = Duration::from_millis(10);
/// Time that a file that cannot be read may stay unchanged before it is reported.
const PATIENCE: Duration = Duration::from_secs(2);
/// Names are read again at least this often, whatever the folder says about its last change.
const RESCAN: Duration = Duration::from_millis(500);
/// Reading names may take at most this share of the time.
const RESCAN_SHARE: u32 = 20;

/// Size and times of a file, which tell one content of it from another without reading it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Bytes.
    pub bytes: u64,
    /// When it was last written to.
    pub modified: SystemTime,
    /// When it was last written to or renamed, whichever is later.
    pub closed: SystemTime,
}

impl Stamp {
    /// The stamp of a file; `None` if it is not there.
    pub fn of(file: &Path) -> Option<Self> {
        let meta = std::fs::metadata(file).ok()?;
        let modified = meta.modified().ok()?;
        Some(Self { bytes: meta.len(), modified, closed: changed(&meta).map_or(modified, |c| c.max(modified)) })
    }

    /// Nanoseconds since 1970 of the last write; 0 for what is older.
    pub fn modified_ns(&self) -> u64 {
        self.modified.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_nanos() as u64)
    }
}

#[cfg(unix)]
fn changed(meta: &std::fs::Metadata) -> Option<SystemTime> {
    use std::os::unix::fs::MetadataExt as _;
    let (s, ns) = (u64::try_from(meta.ctime()).ok()?, u32::try_from(meta.ctime_nsec()).ok()?);
    SystemTime::UNIX_EPOCH.checked_add(Duration::new(s, ns))
}

#[cfg(not(unix))]
fn changed(_meta: &std::fs::Metadata) -> Option<SystemTime> {
    None
}

/// A touch whose turn it is.
#[derive(Clone, Debug)]
pub struct Ready {
    /// The pair in [`Following::dataset`].
    pub id: PairId,
    /// Name of the pair.
    pub name: String,
    /// GelSlim file of the pair.
    pub file: PathBuf,
    /// Stamp of the file when it was looked at.
    pub stamp: Stamp,
    /// True for a touch that appeared while the folder was followed.
    pub fresh: bool,
    /// True for a touch that was there before, of which only the bubble came later: its prediction stays as it was.
    pub completed: bool,
}

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

#[derive(Clone, Debug)]
struct FollowedPair {
    id: PairId,
    file: PathBuf,
    /// All files of the pair.
    files: Vec<PathBuf>,
    stamp: Stamp,
    /// True until it was given out, and again once it changed.
    waiting: bool,
    completed: bool,
    /// When this stamp was first seen.
    since: Instant,
    /// Not before.
    retry: Instant,
}

/// A followed folder.
#[derive(Debug)]
pub struct Following {
    path: PathBuf,
    dataset: Option<Arc<Dataset>>,
    /// True where touches that lie there already are taken up as well.
    existing: bool,
    seen: BTreeMap<String, FollowedPair>,
    fresh: VecDeque<String>,
    backlog: VecDeque<String>,
    folders: Vec<(PathBuf, Option<SystemTime>)>,
    next_scan: Instant,
    started: SystemTime,
    /// Problems that kept the last look at the folder from finding all touches: it cannot be read, it holds none any more,
    /// or some are left out.
    troubles: Vec<Problem>,
    /// Problems that were said.
    said: Vec<Problem>,
    unsaid: VecDeque<FollowEvent>,
}

impl Following {
    /// Follows `path`, which may still be empty; `existing` takes up what lies there already as well.
    ///
    /// # Errors
    /// [`FileError`] if the folder is not there.
    pub fn new(path: &Path, existing: bool) -> Result<Self, FileError> {
        let io = |err| FileError::io(path, "cannot read the folder", err);
        let path = path.canonicalize().map_err(io)?;
        drop(std::fs::read_dir(&path).map_err(io)?);
        let mut following = Self::of(path, existing);
        following.scan(Instant::now(), true);
        Ok(following)
    }

    /// Follows the folder of an open data set, whose pairs keep their ids; `None` for one without a folder.
    pub fn continuing(dataset: Arc<Dataset>) -> Option<Self> {
        let mut following = Self::of(dataset.root.clone()?, false);
        following.dataset = Some(dataset);
        following.enter(Instant::now(), true);
        Some(following)
    }

    fn of(path: PathBuf, existing: bool) -> Self {
        Self {
            path,
            dataset: None,
            existing,
            seen: BTreeMap::new(),
            fresh: VecDeque::new(),
            backlog: VecDeque::new(),
            folders: Vec::new(),
            next_scan: Instant::now(),
            started: SystemTime::now(),
            troubles: Vec::new(),
            said: Vec::new(),
            unsaid: VecDeque::new(),
        }
    }

    /// The data set as far as it is known, known pairs with their ids; `None` while the folder holds none.
    pub fn dataset(&self) -> Option<&Arc<Dataset>> {
        self.dataset.as_ref()
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
        let ready = self.next_ready(Instant::now()).map(FollowEvent::Ready);
        if self.troubles != self.said {
            let new = self.troubles.iter().filter(|trouble| !self.said.contains(trouble)).cloned();
            self.unsaid.extend(new.map(FollowEvent::Trouble));
            if self.troubles.is_empty() {
                self.unsaid.push_back(FollowEvent::Recovered);
            }
            self.said.clone_from(&self.troubles);
        }
        self.unsaid.extend(ready);
        self.unsaid.pop_front()
    }

    /// Next event, waited for. `None` once it is told to stop, with `once` as soon as nothing lies there any more.
    pub fn wait(&mut self, stop: &Cancel, once: bool) -> Option<FollowEvent> {
        while !stop.is_cancelled() {
            let event = self.poll();
            if event.is_some() || once && self.fresh.is_empty() && self.backlog.is_empty() {
                return event;
            }
            std::thread::sleep(PERIOD);
        }
        None
    }

    /// The entry of a touch in the data set.
    pub fn entry(&self, ready: &Ready) -> Option<&PairEntry> {
        self.dataset.as_ref()?.index.get(ready.id)
    }

    /// Labels that people gave a touch; none, as a rule, of one that just arrived.
    ///
    /// # Errors
    /// If there is something that cannot be read.
    pub fn labels(&self, ready: &Ready) -> Result<PairLabels, TaskError> {
        self.dataset.as_ref().map_or_else(|| Ok(PairLabels::default()), |dataset| Labels::of(dataset).load(&ready.name))
    }

    /// The next touch that can be tried, new ones first; `None` if there is nothing to do until the next [`PERIOD`].
    fn next_ready(&mut self, now: Instant) -> Option<Ready> {
        let moved = self.folders.iter().any(|(folder, time)| modified(folder) != *time);
        if moved || now >= self.next_scan {
            self.scan(now, false);
        }
        for fresh in [true, false] {
            let queue = if fresh { &mut self.fresh } else { &mut self.backlog };
            let at = queue.iter().position(|name| self.seen.get(name).is_none_or(|seen| now >= seen.retry));
            let Some(name) = at.and_then(|at| queue.remove(at)) else { continue };
            let Some(seen) = self.seen.get_mut(&name) else { continue };
            let Some(stamp) = Stamp::of(&seen.file) else {
                self.seen.remove(&name);
                continue;
            };
            if stamp != seen.stamp {
                (seen.stamp, seen.since, seen.completed) = (stamp, now, false);
            }
            seen.waiting = false;
            let completed = seen.completed;
            return Some(Ready { id: seen.id, file: seen.file.clone(), stamp, fresh, completed, name });
        }
        None
    }

    /// Reads a touch. `None` where it is gone, or is still being written and comes again; what cannot be read and did not
    /// change for a while is a problem, and comes again when it changes.
    pub fn read(&mut self, ready: &Ready) -> Option<Result<Sample, Problem>> {
        let result = self.dataset.clone()?.load(ready.id);
        let now = Instant::now();
        let seen = self.seen.get_mut(&ready.name)?;
        let Some(stamp) = Stamp::of(&ready.file) else {
            self.seen.remove(&ready.name);
            return None;
        };
        if stamp != ready.stamp {
            (seen.stamp, seen.since) = (stamp, now);
        } else {
            match result {
                Ok(sample) => return Some(Ok(sample)),
                Err(err) if err.kind != FileErrorKind::Failed || now.duration_since(seen.since) >= PATIENCE => {
                    return Some(Err(err.to_problem()));
                }
                Err(_) => {}
            }
        }
        // Soon at first, as most files are whole within milliseconds; a slow copy is not read again and again.
        let age = now.duration_since(seen.since);
        seen.retry = now + (age / 8).clamp(PERIOD, Duration::from_millis(200));
        seen.waiting = true;
        let queue = if ready.fresh { &mut self.fresh } else { &mut self.backlog };
        queue.push_back(ready.name.clone());
        None
    }

    /// Reads the names again.
    fn scan(&mut self, now: Instant, first: bool) {
        // Before the names are read: what appears meanwhile changes the time once more.
        let before: Vec<(PathBuf, Option<SystemTime>)> =
            self.folders.iter().map(|(folder, _)| (folder.clone(), modified(folder))).collect();
        let grown = match &self.dataset {
            Some(dataset) => dataset.grown(),
            None => Dataset::open(&self.path),
        };
        self.troubles.clear();
        match grown {
            Ok(dataset) => {
                self.troubles = dataset.left_out();
                self.dataset = Some(Arc::new(dataset));
                self.enter(now, first);
            }
            Err(err) if err.kind == FileErrorKind::NothingFound => {
                self.folders = vec![(self.path.clone(), modified(&self.path))];
                let known = self.dataset.as_ref().map_or(0, |dataset| dataset.index.pairs.len());
                // An empty folder is one that fills; an emptied one has lost something.
                if known > 0 {
                    self.troubles.push(Problem {
                        file: self.path.clone(),
                        what: format!("no touch is found in the folder any more; {known} were known"),
                        hint: "put them back, or go on: touches that appear here are still taken".into(),
                    });
                }
            }
            Err(err) => self.troubles.push(err.to_problem()),
        }
        for (folder, time) in before {
            if let Some(known) = self.folders.iter_mut().find(|(f, _)| *f == folder) {
                known.1 = time;
            }
        }
        self.next_scan = Instant::now() + RESCAN.max(now.elapsed() * RESCAN_SHARE);
    }

    /// Compares the files of the data set with what was seen of them.
    fn enter(&mut self, now: Instant, first: bool) {
        let Some(dataset) = self.dataset.clone() else { return };
        let time = |folder: &PathBuf| (folder.clone(), modified(folder));
        self.folders = dataset.folders().iter().map(time).collect();
        for (at, entry) in dataset.index.pairs.iter().enumerate() {
            let id = PairId(at as u32);
            let Some(file) = dataset.gelslim_file(id) else { continue };
            let Some(stamp) = Stamp::of(&file) else {
                self.seen.remove(&entry.name);
                continue;
            };
            let files = dataset.pair_files(id);
            // What was written after the start is new, even where it was there before the first look.
            let fresh = !first || stamp.closed >= self.started;
            let (waiting, queued, completed) = match self.seen.get(&entry.name) {
                Some(seen) if seen.stamp == stamp && seen.files == files => continue,
                Some(seen) => (true, seen.waiting, !seen.waiting && seen.stamp == stamp && seen.file == file),
                None => (fresh || self.existing, false, false),
            };
            let seen = FollowedPair { id, file, files, stamp, waiting, completed, since: now, retry: now };
            self.seen.insert(entry.name.clone(), seen);
            if waiting && !queued {
                let queue = if fresh { &mut self.fresh } else { &mut self.backlog };
                queue.push_back(entry.name.clone());
            }
        }
    }
}

fn modified(folder: &Path) -> Option<SystemTime> {
    std::fs::metadata(folder).ok()?.modified().ok()
}
