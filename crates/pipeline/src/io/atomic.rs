//! Files that are either the old or the new one, never half of either.

use std::collections::BTreeSet;
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once};
use std::time::Duration;

use tempfile::NamedTempFile;

use super::error::FileError;

/// Start of the name of a temporary file.
const PREFIX: &str = ".tmp-";
/// End of the name of a temporary file.
const SUFFIX: &str = ".part";
/// Younger than this, what is not locked may be what another run is just about to lock.
const NEWBORN: Duration = Duration::from_secs(10);

/// Writes to a temporary file in the same folder, flushes it to the disk, and renames it over `path`; a link there is
/// replaced, not followed.
///
/// A crash at any moment leaves the previous file (or none) and at most a stray temporary file, which the next run that
/// writes into the folder removes.
///
/// # Errors
/// Whatever the disk says; `path` is then unchanged.
pub fn write(path: &Path, content: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    sweep_once(folder);
    let mut temporary = probe(folder)?;
    content(temporary.as_file_mut())?;
    flushed(temporary.as_file().sync_all())?;
    temporary.persist(path).map_err(|err| err.error)?;
    // The rename itself is in the folder; not every system can flush a folder, and the content is safe already.
    #[cfg(unix)]
    if let Ok(folder) = File::open(folder) {
        folder.sync_all().ok();
    }
    Ok(())
}

/// What flushing a file came to. Some mounts (network shares, folders of a virtual machine) cannot flush: what was written is
/// kept there as well as they keep anything, and the log says so once.
///
/// # Errors
/// Any other failure: the disk has not taken it.
pub(super) fn flushed(result: io::Result<()>) -> io::Result<()> {
    static SAID: Once = Once::new();
    match result {
        Err(err) if matches!(err.kind(), ErrorKind::InvalidInput | ErrorKind::Unsupported) => {
            SAID.call_once(|| {
                log::warn!("this disk cannot flush files ({err}): a power cut may lose what was saved last")
            });
            Ok(())
        }
        other => other,
    }
}

/// [`write()`] with the bytes at hand.
///
/// # Errors
/// As [`write()`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write(path, |file| io::Write::write_all(file, bytes))
}

/// Writes a value as JSON for people to read; `what` failed where it could not be written, as in "cannot write the report".
///
/// # Errors
/// If the disk refuses.
pub fn write_json(file: &Path, what: &str, value: &impl serde::Serialize) -> Result<(), FileError> {
    let text = serde_json::to_vec_pretty(value).map_err(io::Error::from);
    text.and_then(|text| write_bytes(file, &text)).map_err(|err| FileError::io(file, what, err))
}

/// An empty file in `folder` that is gone when it is dropped: whether the folder can be written, and how it takes names.
///
/// # Errors
/// Whatever the disk says.
pub(crate) fn probe(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    // Temporary files are private by default; the finished file is an ordinary one.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o644));
    }
    let temporary = builder.tempfile_in(folder)?;
    // The system lets go of it when this program ends, however it ends. Where there are no locks nothing is swept.
    temporary.as_file().try_lock().ok();
    Ok(temporary)
}

/// True where no running program holds `file`: one that was killed left it.
pub(super) fn is_abandoned(file: &Path) -> bool {
    let Ok(open) = File::open(file) else { return false };
    match open.try_lock_shared() {
        Ok(()) => true,
        Err(TryLockError::WouldBlock | TryLockError::Error(_)) => false,
    }
}

/// True where `path` is so new that a run may be about to lock it.
pub(super) fn is_newborn(path: &Path) -> bool {
    let changed = std::fs::symlink_metadata(path).and_then(|meta| meta.modified());
    changed.is_ok_and(|time| time.elapsed().is_ok_and(|age| age < NEWBORN))
}

/// Removes what killed runs left in `folder`, at the first write of this run into it.
fn sweep_once(folder: &Path) {
    static SWEPT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let Ok(absolute) = folder.canonicalize() else { return };
    let first = SWEPT.lock().unwrap_or_else(std::sync::PoisonError::into_inner).insert(absolute);
    if first {
        sweep(folder);
    }
}

fn sweep(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if !(name.starts_with(PREFIX) && name.ends_with(SUFFIX)) {
            continue;
        }
        // Of the entry itself: a link is not one of ours.
        let Ok(meta) = entry.metadata() else { continue };
        let path = entry.path();
        // What has content was locked before it had any.
        if meta.is_file() && (meta.len() > 0 || !is_newborn(&path)) && is_abandoned(&path) {
            std::fs::remove_file(path).ok();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_replaced_and_not_followed() {
        let dir = tempfile::tempdir().unwrap();
        let (target, link) = (dir.path().join("target"), dir.path().join("link"));
        std::fs::write(&target, "mine").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(&target, &link).unwrap();
        write_bytes(&link, b"new").unwrap();
        assert_eq!(std::fs::read(&target).unwrap(), b"mine");
        assert_eq!(std::fs::read(&link).unwrap(), b"new");
        assert!(!std::fs::symlink_metadata(&link).unwrap().is_symlink());
    }

    #[test]
    fn a_disk_that_cannot_flush_takes_what_is_written_and_one_that_fails_does_not() {
        for kind in [ErrorKind::InvalidInput, ErrorKind::Unsupported] {
            assert!(flushed(Err(kind.into())).is_ok());
        }
        for kind in [ErrorKind::StorageFull, ErrorKind::Other, ErrorKind::QuotaExceeded] {
            assert_eq!(flushed(Err(kind.into())).unwrap_err().kind(), kind);
        }
    }

    #[test]
    fn what_a_killed_run_left_goes_and_what_a_running_one_writes_stays() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at(".tmp-left.part"), "half").unwrap();
        std::fs::write(at(".tmp-newborn.part"), "").unwrap();
        std::fs::write(at("notes.part"), "mine").unwrap();
        let running = probe(dir.path()).unwrap();
        std::fs::write(running.path(), "half").unwrap();
        write_bytes(&at("new"), b"new").unwrap();
        assert!(!at(".tmp-left.part").exists());
        for stays in [&at(".tmp-newborn.part"), &at("notes.part"), &at("new"), &running.path().to_owned()] {
            assert!(stays.exists(), "{}", stays.display());
        }
        // Once per run: a folder of many files is not read again for each.
        std::fs::write(at(".tmp-later.part"), "half").unwrap();
        write_bytes(&at("new"), b"newer").unwrap();
        assert!(at(".tmp-later.part").exists());
    }
}
