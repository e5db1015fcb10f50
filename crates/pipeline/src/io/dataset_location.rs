//! [`DatasetLocation`]: the folder of a data set as it was opened.

use std::io;
use std::path::{Path, PathBuf};

use super::error::{FileError, FileErrorKind};
use super::files::Identity;

/// A folder that is remembered by what it is and not by its path alone: while a data set is open its folder may be renamed,
/// deleted or replaced, and what is written to the old path would be of nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DatasetLocation {
    root: PathBuf,
    identity: Identity,
}

impl DatasetLocation {
    /// The folder that lies at a path now; `None` where there is none.
    pub fn at(root: &Path) -> Option<Self> {
        let found = std::fs::metadata(root).ok().filter(std::fs::Metadata::is_dir)?;
        Some(Self { root: root.to_owned(), identity: Identity::of(&found) })
    }

    /// Path of the folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Identity of the folder, in a few letters.
    pub fn identity(&self) -> String {
        self.identity.text()
    }

    /// Checks that the folder is still there.
    ///
    /// # Errors
    /// [`FileErrorKind::Lost`], also where the system does not say.
    pub fn check(&self) -> Result<(), FileError> {
        let away = |how: String| {
            let what = format!("the data set is not where it was opened: {} {how}", self.root.display());
            let hint = "put the data set back where it was, or save the labels elsewhere";
            Err(FileError::new("", what, hint).of_kind(FileErrorKind::Lost))
        };
        match std::fs::metadata(&self.root) {
            Ok(found) if Identity::of(&found) == self.identity => Ok(()),
            Ok(_) => away("is another folder now".into()),
            Err(err) if err.kind() == io::ErrorKind::NotFound => away("is gone".into()),
            Err(err) => away(format!("cannot be looked at ({err})")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_the_same_only_where_it_was_and_as_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let (root, elsewhere) = (dir.path().join("data"), dir.path().join("renamed"));
        assert_eq!(DatasetLocation::at(&root), None);
        std::fs::create_dir(&root).unwrap();
        let location = DatasetLocation::at(&root).unwrap();
        std::fs::write(root.join("new"), "1").unwrap();
        assert_eq!(location.check(), Ok(()), "what lies in it may change");
        std::fs::rename(&root, &elsewhere).unwrap();
        assert!(location.check().unwrap_err().to_string().ends_with("data is gone"));
        std::fs::create_dir(&root).unwrap();
        assert!(location.check().unwrap_err().to_string().ends_with("data is another folder now"));
        std::fs::remove_dir(&root).unwrap();
        std::fs::rename(&elsewhere, &root).unwrap();
        assert_eq!(location.check(), Ok(()), "it came back");
    }
}
