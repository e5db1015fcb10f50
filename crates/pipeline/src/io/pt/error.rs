//! Faults of a `.pt` file.

use std::path::{Path, PathBuf};

/// Why a `.pt` file, or a value in it, cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PtError {
    /// The file cannot be opened, read or written.
    #[error("{what} ({}): {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// Failed action, as the message begins.
        what: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file is empty, cut off, or its checksums disagree with its content.
    #[error("damaged or truncated file: {reason} ({})", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// Reason, as the message ends.
        reason: String,
    },
    /// The file is not what `torch.save` writes for a dict.
    #[error("not a PyTorch file with a dict of tensors: {reason} ({})", file.display())]
    NotADict {
        /// The file.
        file: PathBuf,
        /// Reason, as the message ends.
        reason: String,
    },
    /// The file would take more memory than a dict of tensors needs.
    #[error("refused: {reason} ({})", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// Demand of the file that is too large.
        reason: String,
    },
    /// The dict has no such key.
    #[error("key \"{key}\" is missing; found {found} ({})", file.display())]
    MissingKey {
        /// The file.
        file: PathBuf,
        /// The key asked for.
        key: String,
        /// The keys that are there.
        found: String,
    },
    /// The key holds something that is not a tensor or a plain number.
    #[error("key \"{key}\" holds {found}, expected a tensor ({})", file.display())]
    NotATensor {
        /// The file.
        file: PathBuf,
        /// The key asked for.
        key: String,
        /// The Python type that was found.
        found: String,
    },
    /// The tensor has another shape.
    #[error("key \"{key}\" has shape {found:?}, expected {expected} ({})", file.display())]
    WrongShape {
        /// The file.
        file: PathBuf,
        /// The key asked for.
        key: String,
        /// The shape in the file.
        found: Vec<usize>,
        /// The accepted shape or shapes.
        expected: String,
    },
    /// The storage is shorter than the tensor's shape says, or its checksum is wrong.
    #[error("key \"{key}\" cannot be read: {reason} ({})", file.display())]
    BadStorage {
        /// The file.
        file: PathBuf,
        /// The key asked for.
        key: String,
        /// Reason, as the message ends.
        reason: String,
    },
    /// A tensor to be written whose length does not match its shape.
    #[error("key \"{key}\": {len} values do not fill shape {shape:?} ({})", file.display())]
    BadTensor {
        /// The file.
        file: PathBuf,
        /// The key.
        key: String,
        /// The values given.
        len: usize,
        /// The shape given.
        shape: Vec<usize>,
    },
}

impl PtError {
    /// The file it is about.
    pub fn file(&self) -> &Path {
        match self {
            Self::Io { file, .. }
            | Self::Damaged { file, .. }
            | Self::NotADict { file, .. }
            | Self::TooLarge { file, .. }
            | Self::MissingKey { file, .. }
            | Self::NotATensor { file, .. }
            | Self::WrongShape { file, .. }
            | Self::BadStorage { file, .. }
            | Self::BadTensor { file, .. } => file,
        }
    }

    /// Advice for the user.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Io { .. } => "check that the file exists and may be read, and that the disk has room",
            Self::Damaged { .. } | Self::BadStorage { .. } => "copy or download the file again",
            Self::NotADict { .. } => "save a dict of tensors with torch.save",
            Self::TooLarge { .. } => "save the tensors of one touch only, uncompressed, with torch.save",
            Self::MissingKey { .. } => "check that the file belongs to this folder and to the released data set",
            Self::NotATensor { .. } => "convert the value with torch.as_tensor(...) before torch.save",
            Self::WrongShape { .. } => "check which version of the data set the file belongs to",
            Self::BadTensor { .. } => "give as many values as the shape has",
        }
    }
}
