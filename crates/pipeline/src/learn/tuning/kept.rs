//! An unfinished run of tuning on the disk, so that a stop, a crash or a cancel costs seconds.
//!
//! The folder's name is a digest of everything that the run depends on: what is asked for again finds it, and nothing
//! else does.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::io::{atomic, files};

/// Runs that nobody went on with for so long are removed.
const OLD: Duration = Duration::from_secs(14 * 24 * 3600);

pub(crate) struct KeptRun {
    /// `None` where nothing is kept.
    folder: Option<PathBuf>,
}

impl KeptRun {
    /// Kept files of the run with this digest, below the folder of kept runs, if anything.
    pub(crate) fn of(root: Option<&Path>, digest: &str) -> Self {
        let folder = root.map(|root| {
            remove_old(root);
            root.join(&digest[..16])
        });
        Self { folder }
    }

    pub(crate) fn read(&self, name: &str) -> Option<Vec<u8>> {
        files::read(&self.folder.as_ref()?.join(name), files::MODEL).ok()
    }

    /// Keeps a file. A disk that is full costs the kept run and not the run.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) {
        let Some(folder) = &self.folder else { return };
        let written = std::fs::create_dir_all(folder).and_then(|()| atomic::write_bytes(&folder.join(name), bytes));
        if let Err(err) = written {
            log::warn!("the unfinished run is not kept: {err} ({})", folder.join(name).display());
        }
    }

    pub(crate) fn remove(&self, name: &str) {
        if let Some(folder) = &self.folder {
            std::fs::remove_file(folder.join(name)).ok();
        }
    }

    /// The run is finished: nothing is left of it.
    pub(crate) fn clear(&self) {
        if let Some(folder) = &self.folder {
            std::fs::remove_dir_all(folder).ok();
        }
    }
}

fn remove_old(root: &Path) {
    let Ok(entries) = std::fs::read_dir(root) else { return };
    for folder in entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()) {
        let files = std::fs::read_dir(&folder).into_iter().flatten().flatten();
        let used = files.filter_map(|file| file.metadata().ok()?.modified().ok()).max();
        let age = used.and_then(|used| SystemTime::now().duration_since(used).ok());
        if age.is_some_and(|age| age > OLD) {
            std::fs::remove_dir_all(&folder).ok();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_old_goes_and_what_is_young_stays() {
        let root = tempfile::tempdir().unwrap();
        for (name, age) in [("old", OLD + Duration::from_secs(60)), ("young", Duration::from_secs(60))] {
            let kept = KeptRun { folder: Some(root.path().join(name)) };
            kept.write("part-1.tuner", b"state");
            let file = std::fs::File::options().write(true).open(root.path().join(name).join("part-1.tuner")).unwrap();
            file.set_modified(SystemTime::now() - age).unwrap();
        }
        remove_old(root.path());
        let young = KeptRun { folder: Some(root.path().join("young")) };
        assert_eq!(young.read("part-1.tuner").as_deref(), Some(&b"state"[..]));
        assert!(!root.path().join("old").exists());
        young.clear();
        assert!(young.read("part-1.tuner").is_none() && KeptRun { folder: None }.read("x").is_none());
    }
}
