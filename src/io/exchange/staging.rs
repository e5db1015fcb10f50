//! The folder beside an export in which the new one is made. What a killed run leaves is taken away by the next one.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::io::{atomic, files};

/// How the folder's name begins.
const PREFIX: &str = ".touch2touch-export-";
/// The file in it that is locked while a program works there, and names the folder that is being exported.
const LOCK: &str = "lock";
const NEW: &str = "new";
const OLD: &str = "old";

/// A folder that is gone when it is dropped.
pub(super) struct Staging {
    folder: TempDir,
    /// Held locked.
    _lock: File,
}

impl Staging {
    /// A folder beside `target`.
    pub(super) fn new(target: &Path) -> io::Result<Self> {
        let parent = target.parent().unwrap_or(target);
        let folder = tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent)?;
        // Locked before it has its place: a folder without a lock is one that is still being made.
        let mut lock = tempfile::NamedTempFile::new_in(folder.path())?;
        lock.as_file().try_lock().ok();
        let name = target.file_name().unwrap_or_default();
        io::Write::write_all(&mut lock, name.as_encoded_bytes())?;
        let lock = lock.persist(folder.path().join(LOCK)).map_err(|err| err.error)?;
        Ok(Self { folder, _lock: lock })
    }

    /// Where the new content is made.
    pub(super) fn new_content(&self) -> PathBuf {
        self.folder.path().join(NEW)
    }

    /// Where the previous content is put out of the way.
    pub(super) fn old_content(&self) -> PathBuf {
        self.folder.path().join(OLD)
    }
}

/// Removes what killed runs left in `parent`. A run that was killed between moving the previous export away and putting
/// the new one in its place gets the previous one back.
pub(super) fn sweep(parent: &Path) {
    let Ok(entries) = std::fs::read_dir(parent) else { return };
    for entry in entries.flatten() {
        let ours = entry.file_name().to_string_lossy().starts_with(PREFIX);
        if !ours || !entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            continue;
        }
        let left = entry.path();
        let (lock, old) = (left.join(LOCK), left.join(OLD));
        let abandoned = match lock.exists() {
            true => atomic::is_abandoned(&lock),
            // Of a run that was killed before it had one, or of a program that had none.
            false => !atomic::is_newborn(&left) && !old.exists(),
        };
        if !abandoned {
            continue;
        }
        if let Ok(name) = files::read_to_string(&lock, files::SMALL)
            && let target = parent.join(name)
            && target.parent() == Some(parent)
            && old.is_dir()
            && !target.exists()
            && std::fs::rename(&old, &target).is_err()
        {
            continue;
        }
        if let Err(err) = std::fs::remove_dir_all(&left) {
            log::warn!("what a killed export left cannot be removed: {err}: {}", left.display());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_killed_run_is_cleaned_up_and_a_running_one_is_left_alone() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("unet");
        // Killed while it wrote: as a program leaves it whose destructors did not run.
        let killed = Staging::new(&target).unwrap();
        std::fs::create_dir(killed.new_content()).unwrap();
        let left = killed.folder.keep();
        drop(killed._lock);
        let running = Staging::new(&target).unwrap();
        sweep(dir.path());
        assert!(!left.exists() && running.folder.path().is_dir());
    }

    #[test]
    fn the_previous_export_comes_back_where_a_run_was_killed_between_two_renames() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("unet");
        let killed = Staging::new(&target).unwrap();
        std::fs::create_dir(killed.old_content()).unwrap();
        std::fs::write(killed.old_content().join("mask"), "mine").unwrap();
        let left = killed.folder.keep();
        drop(killed._lock);
        sweep(dir.path());
        assert_eq!(std::fs::read(target.join("mask")).unwrap(), b"mine");
        assert!(!left.exists());
    }
}
