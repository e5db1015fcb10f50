//! The folder beside another one in which its new content is made, so that it is there whole or not at all. What a killed
//! run leaves is taken away by the next one.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::{atomic, files};

/// Start of the folder's name.
const PREFIX: &str = ".touch2touch-new-";
/// The file in it that is locked while a program works there, and names the folder whose content is being made.
const LOCK: &str = "lock";
const NEW: &str = "new";
const OLD: &str = "old";

/// A folder that is gone when it is dropped.
pub(crate) struct Staging {
    folder: TempDir,
    /// Held locked.
    _lock: File,
}

impl Staging {
    /// A folder beside `target`.
    pub(crate) fn new(target: &Path) -> io::Result<Self> {
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

    /// Path at which the new content is made.
    pub(crate) fn new_content(&self) -> PathBuf {
        self.folder.path().join(NEW)
    }

    /// Path at which the previous content is put out of the way.
    fn old_content(&self) -> PathBuf {
        self.folder.path().join(OLD)
    }

    /// Puts the new content in the place of `target`, which is as it was if that cannot be done.
    pub(crate) fn put(self, target: &Path) -> io::Result<()> {
        let (new, old) = (self.new_content(), self.old_content());
        let there = target.exists();
        if there {
            std::fs::rename(target, &old)?;
        }
        let put = std::fs::rename(new, target);
        if put.is_err() && there && std::fs::rename(&old, target).is_err() {
            // Left where it is, where the next run finds it.
            log::error!("the previous content cannot be put back: {}", self.folder.keep().display());
        }
        put
    }
}

/// Start of the name of the file that keeps a folder for one program.
const CLAIM: &str = ".touch2touch-claim-";

/// A folder that is kept for this run until it is dropped, from before its content is computed.
#[derive(Debug)]
pub(crate) struct Claim {
    file: PathBuf,
    /// Held locked.
    _lock: File,
}

impl Claim {
    /// Keeps `target` for this run; `None` where another one has it. The folder above it must be there.
    pub(crate) fn of(target: &Path) -> io::Result<Option<Self>> {
        let mut name = std::ffi::OsString::from(CLAIM);
        name.push(target.file_name().unwrap_or_default());
        let file = target.with_file_name(name);
        loop {
            match File::create_new(&file) {
                Err(err) if err.kind() != io::ErrorKind::AlreadyExists => return Err(err),
                _ => {}
            }
            // An ordinary file only: neither a link, which would lead elsewhere, nor a pipe, which would hold this up.
            if file.symlink_metadata().is_ok_and(|there| there.is_symlink()) {
                let what = format!("it is a link, not an ordinary file: {}", file.display());
                return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
            }
            let lock = match files::open(&file) {
                Err(err) if err.kind() == io::ErrorKind::NotFound => continue,
                opened => opened?,
            };
            match lock.try_lock() {
                Err(std::fs::TryLockError::WouldBlock) => return Ok(None),
                // Where the disk knows no locks nothing is kept out.
                Err(std::fs::TryLockError::Error(_)) | Ok(()) => {}
            }
            // Whoever had it may have taken the file away since it was opened.
            if file.symlink_metadata().is_ok_and(|there| same_file(&there, &lock)) {
                return Ok(Some(Self { file, _lock: lock }));
            }
        }
    }
}

#[cfg(unix)]
fn same_file(there: &std::fs::Metadata, open: &File) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    open.metadata().is_ok_and(|open| (open.dev(), open.ino()) == (there.dev(), there.ino()))
}

#[cfg(not(unix))]
fn same_file(_there: &std::fs::Metadata, _open: &File) -> bool {
    true
}

impl Drop for Claim {
    fn drop(&mut self) {
        std::fs::remove_file(&self.file).ok();
    }
}

/// Gives up a claim whose run was killed, and says so. Locked while it is removed: nobody takes it over meanwhile.
fn release(file: &Path) {
    if !file.symlink_metadata().is_ok_and(|there| there.is_file()) || atomic::is_newborn(file) {
        return;
    }
    let Ok(lock) = files::open(file) else { return };
    let abandoned = lock.try_lock().is_ok() && file.symlink_metadata().is_ok_and(|there| same_file(&there, &lock));
    if abandoned && std::fs::remove_file(file).is_ok() {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let target = file.with_file_name(name.trim_start_matches(CLAIM));
        log::warn!(
            "a run that was stopped before it could write {} left a mark there, which is removed",
            target.display()
        );
    }
}

/// Removes what killed runs left in `parent`, their claims too. A run that was killed between moving the previous export away and putting
/// the new one in its place gets the previous one back.
pub(crate) fn sweep(parent: &Path) {
    let Ok(entries) = std::fs::read_dir(parent) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with(CLAIM) {
            release(&entry.path());
            continue;
        }
        if !name.starts_with(PREFIX) || !entry.file_type().is_ok_and(|kind| kind.is_dir()) {
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
            log::warn!("what a killed run left cannot be removed: {err}: {}", left.display());
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
    fn a_folder_is_kept_for_one_run_at_a_time() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("fitted");
        let first = Claim::of(&target).unwrap().unwrap();
        assert!(Claim::of(&target).unwrap().is_none());
        assert!(Claim::of(&dir.path().join("other")).unwrap().is_some());
        drop(first);
        let again = Claim::of(&target).unwrap().unwrap();
        assert!(again.file.is_file());
        drop(again);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "nothing is left");
        // What a killed run left is nobody's.
        std::fs::write(dir.path().join(format!("{CLAIM}fitted")), "").unwrap();
        assert!(Claim::of(&target).unwrap().is_some());
        // Many at once: never two together.
        let holders = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..200 {
                        if let Some(claim) = Claim::of(&target).unwrap() {
                            assert_eq!(holders.fetch_add(1, std::sync::atomic::Ordering::SeqCst), 0);
                            holders.fetch_sub(1, std::sync::atomic::Ordering::SeqCst);
                            drop(claim);
                        }
                    }
                });
            }
        });
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(dir.path().join("nowhere"), dir.path().join(format!("{CLAIM}link"))).unwrap();
            assert!(Claim::of(&dir.path().join("link")).is_err(), "a link is not followed");
        }
    }

    #[test]
    fn claims_of_killed_runs_go_with_what_they_left_and_those_of_running_ones_stay() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let claim = |name: &str| at(&format!("{CLAIM}{name}"));
        let old = |file: &Path| {
            let open = File::options().write(true).open(file).unwrap();
            open.set_modified(std::time::SystemTime::now() - std::time::Duration::from_secs(60)).unwrap();
        };
        for name in ["killed", "newborn"] {
            std::fs::write(claim(name), "").unwrap();
        }
        let running = Claim::of(&at("running")).unwrap().unwrap();
        [claim("killed"), claim("running")].iter().for_each(|file| old(file));
        sweep(dir.path());
        let left = ["killed", "newborn", "running"].map(|name| claim(name).exists());
        assert_eq!(left, [false, true, true]);
        assert!(Claim::of(&at("running")).unwrap().is_none());
        drop(running);
        assert!(Claim::of(&at("killed")).unwrap().is_some());
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
