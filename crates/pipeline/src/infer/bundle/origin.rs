//! Origin of a bundle: a folder, or the program itself.
//!
//! The program carries the bundles of `assets/models`, so that one copied file predicts on a machine that has nothing else.

use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::MANIFEST;
use crate::io::model_id::identity;

use crate::io::files;

/// Text before the name of a bundle of the program, wherever a folder could be named.
const PREFIX: &str = "built-in:";

/// A file's name and content.
type Embedded = (&'static str, &'static [u8]);

#[cfg(feature = "onnx")]
macro_rules! embedded {
    ($($bundle:literal: [$($file:literal),+],)+) => {
        &[$(($bundle, &[$((
            $file,
            include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/models/", $bundle, "/", $file)),
        )),+])),+]
    };
}

/// The bundles of `assets/models`; a test holds this list against the folder.
#[cfg(feature = "onnx")]
static EMBEDDED: &[(&str, &[Embedded])] = embedded! {
    "generator_ldm": ["manifest.json", "condition_encoder.onnx", "denoiser.onnx", "decoder.onnx"],
    "mask_unet": ["manifest.json", "mask_unet.onnx"],
    "tool_classifier": ["manifest.json", "tool_classifier.onnx"],
};

/// Nothing: a build without engines is spared the copying of what it cannot run.
#[cfg(not(feature = "onnx"))]
static EMBEDDED: &[(&str, &[Embedded])] = &[];

/// Origin of a bundle. As text a folder's path, or `built-in:` and a name; both are understood where a folder is named.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Origin {
    /// A folder.
    Folder(PathBuf),
    /// In the program, under this name.
    BuiltIn(&'static str),
}

impl Origin {
    /// All bundles of the program, in the order in which they are offered.
    pub fn built_in() -> impl Iterator<Item = Self> {
        EMBEDDED.iter().map(|(name, _)| Self::BuiltIn(name))
    }

    /// True where a bundle of this identity is one of the program's.
    pub(crate) fn ships(hash: &str) -> bool {
        Self::built_in()
            .any(|origin| origin.file(MANIFEST).read(files::SMALL).is_ok_and(|manifest| identity(&manifest) == hash))
    }

    /// The last part of the folder's path, or the name in the program.
    pub fn short_name(&self) -> String {
        match self {
            Self::Folder(dir) => dir.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(),
            Self::BuiltIn(name) => (*name).to_owned(),
        }
    }

    /// The origin as a path, for messages.
    pub fn path(&self) -> PathBuf {
        match self {
            Self::Folder(dir) => dir.clone(),
            Self::BuiltIn(name) => format!("{PREFIX}{name}").into(),
        }
    }

    /// The file `name` of the bundle; whether it is there shows when it is read.
    pub fn file(&self, name: &str) -> BundleFile {
        let embedded = match self {
            Self::Folder(_) => None,
            Self::BuiltIn(bundle) => embedded(bundle).and_then(|files| files.iter().find(|(file, _)| *file == name)),
        };
        BundleFile { path: self.path().join(name), embedded: embedded.map(|(_, bytes)| *bytes) }
    }
}

impl From<&Path> for Origin {
    fn from(path: &Path) -> Self {
        let name = path.to_str().and_then(|text| text.strip_prefix(PREFIX));
        let known = EMBEDDED.iter().map(|(known, _)| *known).find(|known| Some(*known) == name);
        known.map_or_else(|| Self::Folder(path.to_owned()), Self::BuiltIn)
    }
}

impl From<&PathBuf> for Origin {
    fn from(path: &PathBuf) -> Self {
        path.as_path().into()
    }
}

impl From<&Origin> for Origin {
    fn from(origin: &Origin) -> Self {
        origin.clone()
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.path().display().fmt(f)
    }
}

impl Serialize for Origin {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.path().serialize(serializer)
    }
}

/// A file of a bundle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BundleFile {
    path: PathBuf,
    embedded: Option<&'static [u8]>,
}

impl BundleFile {
    /// Path of the file on the disk, or its name in the program.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The whole content, of a file on the disk at most `limit` bytes.
    ///
    /// # Errors
    /// The errors of [`files::read`]; none for a file of the program.
    pub fn read(&self, limit: u64) -> io::Result<Cow<'static, [u8]>> {
        match self.embedded {
            Some(bytes) => Ok(Cow::Borrowed(bytes)),
            None => files::read(&self.path, limit).map(Cow::Owned),
        }
    }
}

impl From<PathBuf> for BundleFile {
    fn from(path: PathBuf) -> Self {
        Self { path, embedded: None }
    }
}

fn embedded(bundle: &str) -> Option<&'static [Embedded]> {
    EMBEDDED.iter().find(|(name, _)| *name == bundle).map(|(_, files)| *files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "onnx")]
    #[test]
    fn the_program_holds_all_that_ships() {
        let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/models");
        let names = |dir: &Path| -> std::collections::BTreeSet<String> {
            let entries = std::fs::read_dir(dir).unwrap();
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
        };
        assert_eq!(names(&models), EMBEDDED.iter().map(|(name, _)| (*name).to_owned()).collect());
        for (name, files) in EMBEDDED {
            assert_eq!(names(&models.join(name)), files.iter().map(|(file, _)| (*file).to_owned()).collect());
            let manifest = std::fs::read(models.join(name).join(MANIFEST)).unwrap();
            assert!(Origin::ships(&identity(&manifest)) && !Origin::ships(&identity(&manifest[1..])), "{name}");
            for (file, bytes) in *files {
                assert!(std::fs::read(models.join(name).join(file)).unwrap() == *bytes, "{name}/{file}");
            }
        }
    }
}
