//! [`Sheets`]: small results on the disk as lines of text, found again by sheet and key, beside the predictions.
//!
//! A sheet is one file that grows by whole lines: a checksum, a key, a value. A line that is not exactly that (half
//! written, damaged) is not there, and the sheet is written anew with the next value that is put into it. Where nothing
//! is kept on the disk, values live as long as the program.

use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

use crate::io::digest::sha256;
use crate::io::{atomic, files};

/// End of the files' names, which tells them from those of [`super::store`].
pub(crate) const SUFFIX: &str = ".scores";
/// No larger file is one of ours.
const MAX_BYTES: u64 = 512 << 20;
/// Hex digits of a line's checksum.
const DIGITS: usize = 16;

/// Sheets of a folder. Shared by threads.
#[derive(Debug, Default)]
pub(crate) struct Sheets {
    open: Mutex<Open>,
}

#[derive(Debug, Default)]
struct Open {
    folder: Option<PathBuf>,
    sheets: BTreeMap<String, Sheet>,
}

#[derive(Debug, Default)]
struct Sheet {
    lines: BTreeMap<String, String>,
    /// Size and last change of the file when it was last read or written here.
    stamp: Option<(u64, SystemTime)>,
    /// True where the file holds anything but whole lines.
    damaged: bool,
}

impl Sheets {
    /// Sheets of a folder (made when something is first written); `None` keeps nothing on the disk.
    pub(crate) fn new(folder: Option<PathBuf>) -> Self {
        Self { open: Mutex::new(Open { folder, sheets: BTreeMap::new() }) }
    }

    /// Moves to another folder from now on; `None` keeps nothing on the disk.
    pub(crate) fn set_folder(&self, folder: Option<PathBuf>) {
        self.lock().folder = folder;
    }

    /// The value of each key of a sheet, in order; `None` for one that is not there.
    pub(crate) fn get<'a>(&self, sheet: &str, keys: impl IntoIterator<Item = &'a str>) -> Vec<Option<String>> {
        let mut open = self.lock();
        let lines = &open.read(sheet).lines;
        keys.into_iter().map(|key| lines.get(key).cloned()).collect()
    }

    /// True where nothing is in a sheet.
    pub(crate) fn is_empty(&self, sheet: &str) -> bool {
        self.lock().read(sheet).lines.is_empty()
    }

    /// Puts values (without line breaks) under keys (without spaces). What the disk refuses is said in the log and kept
    /// until the program ends.
    pub(crate) fn put(&self, sheet: &str, values: impl IntoIterator<Item = (String, String)>) {
        let mut open = self.lock();
        let file = open.file(sheet);
        let kept = open.read(sheet);
        let mut added = String::new();
        for (key, value) in values {
            added += &line(&key, &value);
            kept.lines.insert(key, value);
        }
        let Some(file) = file.filter(|_| !added.is_empty()) else { return };
        let written = if kept.damaged || kept.stamp.is_none() {
            let all: String = kept.lines.iter().map(|(key, value)| line(key, value)).collect();
            let folder = file.parent().unwrap_or(Path::new(""));
            fs::create_dir_all(folder).and_then(|()| atomic::write_bytes(&file, all.as_bytes()))
        } else {
            append(&file, &added)
        };
        match written {
            Ok(()) => kept.damaged = false,
            Err(err) => log::warn!("scores could not be kept on the disk: {err} ({})", file.display()),
        }
        kept.stamp = stamp(&file);
    }

    fn lock(&self) -> MutexGuard<'_, Open> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Open {
    fn file(&self, sheet: &str) -> Option<PathBuf> {
        Some(self.folder.as_ref()?.join(format!("{sheet}{SUFFIX}")))
    }

    /// A sheet as it is now: read again where another program wrote to it, or removed it.
    fn read(&mut self, sheet: &str) -> &mut Sheet {
        let file = self.file(sheet);
        let kept = self.sheets.entry(sheet.to_owned()).or_default();
        if let Some(file) = file {
            let now = stamp(&file);
            if now != kept.stamp {
                *kept = files::read(&file, MAX_BYTES).map_or_else(|_| Sheet::default(), |bytes| parse(&bytes));
                kept.stamp = now;
            }
        }
        kept
    }
}

/// One write, so that what two programs add does not mix.
fn append(file: &Path, lines: &str) -> io::Result<()> {
    OpenOptions::new().append(true).open(file)?.write_all(lines.as_bytes())
}

fn stamp(file: &Path) -> Option<(u64, SystemTime)> {
    let found = fs::metadata(file).ok()?;
    Some((found.len(), found.modified().ok()?))
}

fn line(key: &str, value: &str) -> String {
    let text = format!("{key} {value}");
    format!("{} {text}\n", &sha256(text.as_bytes())[..DIGITS])
}

fn parse(bytes: &[u8]) -> Sheet {
    let whole = |line: &[u8]| {
        let line = std::str::from_utf8(line).ok()?;
        let (sum, text) = line.split_once(' ')?;
        let (key, value) = text.split_once(' ')?;
        (sha256(text.as_bytes())[..DIGITS] == *sum).then(|| (key.to_owned(), value.to_owned()))
    };
    let mut sheet = Sheet { damaged: bytes.last().is_some_and(|last| *last != b'\n'), ..Sheet::default() };
    for line in bytes.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()) {
        match whole(line) {
            Some((key, value)) => drop(sheet.lines.insert(key, value)),
            None => sheet.damaged = true,
        }
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(sheets: &Sheets, key: &str, value: &str) {
        sheets.put("s", [(key.to_owned(), value.to_owned())]);
    }

    fn get(sheets: &Sheets, key: &str) -> Option<String> {
        sheets.get("s", [key]).remove(0)
    }

    #[test]
    fn values_come_back_from_the_disk_and_the_last_one_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("made");
        let sheets = Sheets::new(Some(path.clone()));
        put(&sheets, "a", "1 2");
        put(&sheets, "b", "3");
        put(&sheets, "a", "4");
        let again = Sheets::new(Some(path.clone()));
        assert_eq!((get(&again, "a"), get(&again, "b"), get(&again, "c")), (Some("4".into()), Some("3".into()), None));
        // What another program adds or removes is seen.
        put(&again, "c", "5");
        assert_eq!(get(&sheets, "c"), Some("5".into()));
        fs::remove_file(path.join("s.scores")).unwrap();
        assert_eq!(get(&sheets, "a"), None);
        let memory = Sheets::new(None);
        put(&memory, "a", "1");
        assert_eq!(get(&memory, "a"), Some("1".into()));
    }

    #[test]
    fn what_is_damaged_is_not_there_and_is_written_anew() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("s.scores");
        let start = || {
            let sheets = Sheets::new(Some(folder.path().to_owned()));
            fs::remove_file(&file).ok();
            put(&sheets, "a", "1");
            put(&sheets, "b", "2");
            fs::read(&file).unwrap()
        };
        let whole = start();
        let second = whole.iter().position(|b| *b == b'\n').unwrap() + 1;
        let mut flipped = whole.clone();
        flipped[second - 2] ^= 1;
        for (bytes, kept) in [
            (whole[..whole.len() - 1].to_vec(), [true, true]),
            (whole[..whole.len() - 2].to_vec(), [true, false]),
            (flipped, [false, true]),
            (vec![0xff; 4000], [false, false]),
            (Vec::new(), [false, false]),
        ] {
            start();
            fs::write(&file, &bytes).unwrap();
            let sheets = Sheets::new(Some(folder.path().to_owned()));
            assert_eq!([get(&sheets, "a").is_some(), get(&sheets, "b").is_some()], kept);
            put(&sheets, "c", "3");
            let again = Sheets::new(Some(folder.path().to_owned()));
            assert_eq!(get(&again, "c"), Some("3".into()));
            assert_eq!([get(&again, "a").is_some(), get(&again, "b").is_some()], kept);
            assert!(!parse(&fs::read(&file).unwrap()).damaged);
        }
    }
}
