//! Why a data set cannot be opened, or one of its pairs not be loaded.

use std::path::{Path, PathBuf};

use crate::io::files::listed;
use crate::io::images::PictureError;
use crate::io::pt::PtError;
use touch2touch_core::dataset::{PairId, Problem};

/// Why a folder cannot be opened as a data set.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The folder does not exist or may not be read.
    #[error("cannot read the folder ({}): {source}", path.display())]
    Io {
        /// The folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file that declares the sensors cannot be used: its pictures would be read as another sensor's.
    #[error("{why} ({})", path.display())]
    Rig {
        /// The file.
        path: PathBuf,
        /// Fault of the file.
        why: String,
    },
    /// Nothing in the folder looks like a data set.
    #[error("no paired touches found{} ({})", instead.as_ref().map_or(String::new(), |what| format!(", but {what}")), path.display())]
    NothingFound {
        /// The folder.
        path: PathBuf,
        /// Container of another kind that lies there, by what it is.
        instead: Option<&'static str>,
    },
    /// The file that says how the data are to be read cannot be understood.
    #[error("how the data are to be read is not understood: {reason} ({})", file.display())]
    ReadAs {
        /// The file that says it.
        file: PathBuf,
        /// Fault of the file.
        reason: String,
    },
}

impl OpenError {
    /// Advice for the user.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Io { .. } => "check the path and its permissions",
            Self::ReadAs { .. } => "correct that file, or remove it to read the data as they are stored",
            Self::Rig { .. } => "correct it, or remove it to take the pictures for the lab's sensors",
            Self::NothingFound { instead: Some(_), .. } => {
                "five lines of Python make a folder of it that opens, with touch2touch.from_arrays: docs/python.md, \
                 \"Arrays and containers\""
            }
            Self::NothingFound { .. } => {
                "open the folder that holds train/, test/ and tools_stls/, a folder of GelSlim .pt files, of \
                 NAME_gelslim.png (with NAME_bubble.png), or of NAME_touch.png with reference.png"
            }
        }
    }

    /// Entry of a problem list with the same message and advice.
    pub fn to_problem(&self) -> Problem {
        let (Self::Io { path, .. }
        | Self::Rig { path, .. }
        | Self::NothingFound { path, .. }
        | Self::ReadAs { file: path, .. }) = self;
        Problem { file: path.clone(), what: self.to_string(), hint: self.hint().into() }
    }
}

/// Why one pair cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// A `.pt` file of the pair.
    #[error(transparent)]
    Pt(#[from] PtError),
    /// A picture of the pair.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// Touched and untouched image do not fit each other.
    #[error("the touched image has {:?} pixels, the untouched one {:?} ({})", sizes[0], sizes[1], file.display())]
    Sizes {
        /// The touched image.
        file: PathBuf,
        /// Width and height of each.
        sizes: [[usize; 2]; 2],
    },
    /// More of an image is no measurement than is one.
    #[error(
        "{:.0} % of the {what} are no measurement (NaN, infinite or depth 0): too few are left ({})",
        100.0 * share,
        file.display()
    )]
    MostlyInvalid {
        /// The file.
        file: PathBuf,
        /// Pixels that are meant, such as "pixels of the right imprint".
        what: String,
        /// The share that is no measurement.
        share: f64,
    },
    /// The program failed on the pair's files.
    #[error("reading the pair failed, which is a bug: {message} ({})", listed(files))]
    Bug {
        /// The pair's files.
        files: Vec<PathBuf>,
        /// Message of the panic.
        message: String,
    },
    /// The pair is not one of this data set.
    #[error("the data set has no pair number {}", id.0)]
    NoSuchPair {
        /// The number asked for.
        id: PairId,
    },
}

impl LoadError {
    /// The file it is about.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Pt(err) => Some(err.file()),
            Self::Picture(err) => Some(err.file()),
            Self::Sizes { file, .. } | Self::MostlyInvalid { file, .. } => Some(file),
            Self::Bug { files, .. } => files.first().map(PathBuf::as_path),
            Self::NoSuchPair { .. } => None,
        }
    }

    /// Advice for the user.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Pt(err) => err.hint(),
            Self::Picture(err) => err.hint(),
            Self::Sizes { .. } => "take both images with the same camera settings",
            Self::MostlyInvalid { .. } => "record the grasp again, or remove the file",
            Self::Bug { .. } => "please report it with these files; the other pairs are not affected",
            Self::NoSuchPair { .. } => "open the data set again",
        }
    }

    /// Entry of a problem list with the same message and advice.
    pub fn to_problem(&self) -> Problem {
        Problem {
            file: self.file().map(Path::to_owned).unwrap_or_default(),
            what: self.to_string(),
            hint: self.hint().into(),
        }
    }
}
