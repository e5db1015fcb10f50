//! The journal of a pair, which only grows, and the lock that is held while labels are written.

use std::fs::File;
use std::io::{ErrorKind, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::PathBuf;

use serde::Serialize;

use super::{MaskStore, StoreError};
use crate::io::{atomic, files, names};

/// The file that is locked while labels are written.
const LOCK: &str = ".lock";
const JOURNAL_SUFFIX: &str = ".journal.jsonl";

impl MaskStore {
    /// Keeps other programs that ask as well from writing here until the answer is dropped. Where the disk knows no locks
    /// nothing is kept out.
    ///
    /// # Errors
    /// [`StoreError::Lost`], and [`StoreError::Io`] where something lies in the lock's place that is no ordinary file.
    pub fn hold(&self) -> Result<Option<File>, StoreError> {
        const WHAT: &str = "lock the labels";
        self.make_folder(WHAT)?;
        let file = self.folder.join(LOCK);
        match files::append(&file) {
            Ok(open) => Ok(open.lock().is_ok().then_some(open)),
            Err(source) if matches!(source.kind(), ErrorKind::InvalidInput | ErrorKind::IsADirectory) => {
                Err(StoreError::Io { file, what: WHAT, source })
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
    /// [`StoreError::Lost`] and [`StoreError::Io`].
    pub fn append_journal(&self, pair: &str, line: &impl Serialize) -> Result<(), StoreError> {
        const WHAT: &str = "write the journal";
        let file = self.journal_file(pair);
        let io = |source| StoreError::Io { file: file.clone(), what: WHAT, source };
        self.make_folder(WHAT)?;
        let mut bytes = serde_json::to_vec(line).map_err(|err| io(err.into()))?;
        bytes.push(b'\n');
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
    /// [`StoreError::Io`].
    pub fn journal(&self, pair: &str) -> Result<Vec<u8>, StoreError> {
        let file = self.journal_file(pair);
        match files::read(&file, files::SMALL) {
            Err(err) if err.kind() == ErrorKind::NotFound => Ok(Vec::new()),
            read => read.map_err(|source| StoreError::Io { file, what: "read the journal", source }),
        }
    }
}
