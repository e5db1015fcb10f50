//! Opening files that others wrote: ordinary files only, and never more of one than the reader can use.
//!
//! Every reader of `io`, `infer` and `app` goes through here (`tests/layers.rs` holds them to it). A named pipe would wait
//! for a writer for ever, and a link to `/dev/zero` never ends.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

/// Most bytes of a small file: settings, manifests, reports, masks.
pub const SMALL: u64 = 64 << 20;
/// Most bytes of a model: a protobuf message, which is what an ONNX file is, cannot be larger.
pub const MODEL: u64 = 2 << 30;

/// Opens an ordinary file, or what a link to one leads to.
///
/// # Errors
/// The system's, and [`io::ErrorKind::InvalidInput`] for a pipe, a socket or a device.
pub fn open(path: &Path) -> io::Result<File> {
    // Asked before opening, because opening a named pipe waits for somebody to write to it.
    ordinary(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    ordinary(&file.metadata()?)?;
    Ok(file)
}

fn ordinary(found: &Metadata) -> io::Result<()> {
    if found.is_file() {
        Ok(())
    } else if found.is_dir() {
        Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder, not a file"))
    } else {
        Err(io::Error::new(io::ErrorKind::InvalidInput, "it is a pipe, a socket or a device, not an ordinary file"))
    }
}

/// Opens an ordinary file that this program keeps writing on, for reading and appending; makes it where there is none. A link
/// is not followed: it may lead out of the folder that the file is meant to be in.
///
/// # Errors
/// The system's, and [`io::ErrorKind::InvalidInput`] for a link, a pipe, a socket or a device.
pub fn append(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).append(true);
    // Asked before opening, as in `open`.
    let found = match std::fs::symlink_metadata(path) {
        Ok(found) => found,
        Err(err) if err.kind() == io::ErrorKind::NotFound => match options.clone().create_new(true).open(path) {
            // Somebody else made it meanwhile.
            Err(err) if err.kind() == io::ErrorKind::AlreadyExists => std::fs::symlink_metadata(path)?,
            made => return made,
        },
        Err(err) => return Err(err),
    };
    let link = || io::Error::new(io::ErrorKind::InvalidInput, "it is a link, not an ordinary file");
    if found.is_symlink() {
        return Err(link());
    }
    ordinary(&found)?;
    let file = options.open(path)?;
    if Identity::of(&file.metadata()?) == Identity::of(&found) { Ok(file) } else { Err(link()) }
}

/// Identity of a file or folder: it is the same one only where this is equal, whatever lies at its path later.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Device and inode, where the system has them.
    place: [u64; 2],
    /// When it was made, where the system says: the inode of what was deleted is given out again.
    made: Option<std::time::SystemTime>,
}

impl Identity {
    /// Identity of the file or folder with this metadata.
    pub fn of(found: &Metadata) -> Self {
        #[cfg(unix)]
        let place = {
            use std::os::unix::fs::MetadataExt as _;
            [found.dev(), found.ino()]
        };
        #[cfg(not(unix))]
        let place = [0; 2];
        Self { place, made: found.created().ok() }
    }

    /// It in a few letters, for files.
    pub fn text(self) -> String {
        let made = self.made.and_then(|made| made.duration_since(std::time::UNIX_EPOCH).ok());
        let [device, inode] = self.place;
        format!("{device:x}-{inode:x}-{:x}", made.map_or(0, |made| made.as_nanos()))
    }
}

/// The paths of some files, for messages.
pub fn listed(files: &[PathBuf]) -> String {
    files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(", ")
}

/// Reads an ordinary file of at most `limit` bytes.
///
/// # Errors
/// As [`open`]; [`io::ErrorKind::FileTooLarge`] before anything is read.
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    let too_large = |length: u64| {
        let what = format!("it has {length} bytes, and at most {limit} are read");
        io::Error::new(io::ErrorKind::FileTooLarge, what)
    };
    if length > limit {
        return Err(too_large(length));
    }
    let mut bytes = Vec::new();
    // A file that memory cannot hold is an error, not the end of the program.
    bytes.try_reserve_exact(length as usize).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    // It may grow while it is read.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}

/// [`read`] as text.
///
/// # Errors
/// As [`read`]; [`io::ErrorKind::InvalidData`] for what is not UTF-8.
pub fn read_to_string(path: &Path, limit: u64) -> io::Result<String> {
    String::from_utf8(read(path, limit)?).map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not text"))
}

/// A text from a file or from a library that quotes one, short enough for a message.
pub fn clip(text: &str) -> String {
    const MOST: usize = 400;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{} ...", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_ordinary_files_of_a_bounded_size_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("f");
        std::fs::write(&file, b"12345").unwrap();
        assert_eq!(read(&file, 5).unwrap(), b"12345");
        assert_eq!(read_to_string(&file, 9).unwrap(), "12345");
        let error = read(&file, 4).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert!(error.to_string().contains('5') && error.to_string().contains('4'), "{error}");
        assert_eq!(read(&dir.path().join("no"), 4).unwrap_err().kind(), io::ErrorKind::NotFound);
        assert_eq!(read(dir.path(), 4).unwrap_err().kind(), io::ErrorKind::IsADirectory);
        std::fs::write(&file, b"\xff").unwrap();
        assert_eq!(read_to_string(&file, 9).unwrap_err().kind(), io::ErrorKind::InvalidData);
    }
}
