//! The journal of a pair, which only grows, and the lock that is held while labels are written.

use std::fs::File;
use std::io::{ErrorKind, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{MaskStore, refused};
use crate::io::error::FileError;
use crate::io::{atomic, files, names};

/// The file that is locked while labels are written.
const LOCK: &str = ".lock";
const JOURNAL_SUFFIX: &str = ".journal.jsonl";

impl MaskStore {
    /// Keeps other programs that ask as well from writing here until the answer is dropped. Where the disk knows no locks
    /// nothing is kept out.
    ///
    /// # Errors
    /// [`FileError`] where the data set was moved, or something lies in the lock's place that is no ordinary file.
    pub fn hold(&self) -> Result<Option<File>, FileError> {
        const WHAT: &str = "lock the labels";
        self.make_folder(WHAT)?;
        let file = self.folder.join(LOCK);
        match files::append(&file) {
            Ok(open) => Ok(open.lock().is_ok().then_some(open)),
            Err(source) if matches!(source.kind(), ErrorKind::InvalidInput | ErrorKind::IsADirectory) => {
                Err(refused(&file, WHAT, source))
            }
            Err(_) => Ok(None),
        }
    }

    /// Path of a pair's journal, whether it exists or not.
    pub fn journal_file(&self, pair: &str) -> PathBuf {
        self.folder.join(format!("{}{JOURNAL_SUFFIX}", names::label(pair)))
    }

    /// Appends a line to the journal of a pair: who did what, before and after. Nothing is ever removed from it.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn append_journal(&self, pair: &str, line: &impl Serialize) -> Result<(), FileError> {
        const WHAT: &str = "write the journal";
        let file = self.journal_file(pair);
        let io = |err| refused(&file, WHAT, err);
        self.make_folder(WHAT)?;
        let mut bytes = serde_json::to_vec(line).map_err(|err| io(err.into()))?;
        bytes.push(b'\n');
        unshare(&file).map_err(io)?;
        let mut out = files::append(&file).map_err(io)?;
        // A line cut short by a crash is closed, so that this one stands by itself.
        let length = out.metadata().map_err(io)?.len();
        if length > 0 {
            let mut last = [0];
            out.seek(SeekFrom::End(-1)).and_then(|_| out.read_exact(&mut last)).map_err(io)?;
            if last != *b"\n" {
                bytes.insert(0, b'\n');
            }
        }
        // One write, so that a crash can only cut this line short.
        out.write_all(&bytes).and_then(|()| atomic::flushed(out.sync_data())).map_err(io)
    }

    /// The lines of the journal of a pair; empty if there is none.
    ///
    /// # Errors
    /// [`FileError`].
    pub fn journal(&self, pair: &str) -> Result<Vec<u8>, FileError> {
        let file = self.journal_file(pair);
        match files::read(&file, files::SMALL) {
            Err(err) if err.kind() == ErrorKind::NotFound => Ok(Vec::new()),
            read => read.map_err(|err| refused(&file, "read the journal", err)),
        }
    }
}

/// Gives a journal that a copy of the data set shares (hard links, as `cp -al` makes them) a file of its own: what is appended
/// would be in both. Masks and reviews are new files each time.
#[cfg(unix)]
fn unshare(file: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::MetadataExt as _;
    if !file.symlink_metadata().is_ok_and(|there| there.is_file() && there.nlink() > 1) {
        return Ok(());
    }
    let mut shared = files::open(file)?;
    atomic::write(file, |own| std::io::copy(&mut shared, own).map(drop))
}

#[cfg(not(unix))]
fn unshare(_file: &Path) -> std::io::Result<()> {
    Ok(())
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::masks::{StoredMask, StoredReview};
    use touch2touch_core::grid::Mask;
    use touch2touch_core::label::{Marks, Provenance};
    use touch2touch_core::rig::lab;

    #[test]
    fn copies_of_a_data_set_that_share_their_files_keep_their_own_labels() {
        let dir = tempfile::tempdir().unwrap();
        let [one, copy] = ["one", "copy"].map(|name| MaskStore::in_folder(dir.path().join(name)));
        let mask = |on| StoredMask {
            mask: Mask::from_fn(4, 4, |_, _| on),
            marks: Marks::all([4, 4], Provenance::told("drawn")),
            person: String::new(),
            saved_unix_s: 0,
        };
        let finger = lab::LEFT;
        one.append_journal("p", &1).unwrap();
        one.save("p", finger, Some(&mask(true))).unwrap();
        one.save_review("p", &StoredReview { review: "done".into(), ..StoredReview::default() }).unwrap();
        drop(one.hold().unwrap());
        std::fs::create_dir(copy.folder()).unwrap();
        for entry in std::fs::read_dir(one.folder()).unwrap().flatten() {
            std::fs::hard_link(entry.path(), copy.folder().join(entry.file_name())).unwrap();
        }
        let held = copy.hold().unwrap();
        copy.append_journal("p", &2).unwrap();
        copy.append_journal("p", &3).unwrap();
        copy.save("p", finger, Some(&mask(false))).unwrap();
        copy.save_review("p", &StoredReview { review: "flagged".into(), ..StoredReview::default() }).unwrap();
        drop(held);
        one.append_journal("p", &4).unwrap();
        assert_eq!(
            (one.journal("p").unwrap(), copy.journal("p").unwrap()),
            (b"1\n4\n".to_vec(), b"1\n2\n3\n".to_vec())
        );
        let stored = |store: &MaskStore| {
            (store.load("p", finger).unwrap().unwrap().mask[(0, 0)], store.load_review("p").unwrap().unwrap().review)
        };
        assert_eq!(stored(&one), (true, "done".to_owned()));
        assert_eq!(stored(&copy), (false, "flagged".to_owned()));
    }
}
