//! Why a data set cannot be opened, or one of its pairs not be loaded.

use std::path::{Path, PathBuf};

use crate::io::error::{FileError, FileErrorKind};
use crate::io::files::listed;
use touch2touch_core::dataset::PairId;

pub(super) fn no_folder(path: &Path, err: std::io::Error) -> FileError {
    FileError { hint: "check the path and its permissions", ..FileError::io(path, "cannot read the folder", err) }
}

/// Of a declaration of the sensors: its pictures would be read as another sensor's.
pub(super) fn bad_rig(path: &Path, why: impl Into<String>) -> FileError {
    let hint = "correct it, or remove it to take the pictures for the lab's sensors";
    FileError::new(path, why, hint).of_kind(FileErrorKind::Rig)
}

/// Of a folder in which nothing looks like a data set; `instead`: the container of another kind that lies there.
pub(super) fn nothing_found(path: &Path, instead: Option<&str>) -> FileError {
    let hint = match instead {
        Some(_) => {
            "five lines of Python make a folder of it that opens, with touch2touch.from_arrays: docs/python.md, \
             \"Arrays and containers\""
        }
        None => {
            "open the folder that holds train/, test/ and tools_stls/, a folder of GelSlim .pt files, of \
             NAME_gelslim.png (with NAME_bubble.png), or of NAME_touch.png with reference.png"
        }
    };
    let instead = instead.map_or(String::new(), |what| format!(", but {what}"));
    FileError::new(path, format!("no paired touches found{instead}"), hint).of_kind(FileErrorKind::NothingFound)
}

/// Of a reader that broke on these files.
pub(super) fn bug(files: &[PathBuf], message: &str) -> FileError {
    let what = format!("reading {} failed, which is a bug: {message}", listed(files));
    let hint = "please report it with these files; the other pairs are not affected";
    FileError::new(files.first().cloned().unwrap_or_default(), what, hint)
}

pub(super) fn no_such_pair(id: PairId) -> FileError {
    let what = format!("the data set has no pair number {}", id.0);
    FileError::new("", what, "open the data set again").of_kind(FileErrorKind::Content)
}
