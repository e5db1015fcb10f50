//! Data that are read otherwise than they are stored: the file [`READ_AS_FILE`] in the root of a data set says how.

use std::path::Path;

use super::{Dataset, problem};
use crate::io::error::FileError;
use crate::io::{atomic, files};
use touch2touch_core::dataset::Problem;
use touch2touch_core::mesh::Axes;
use touch2touch_core::read_as::{ReadAs, list, parse_list};
use touch2touch_core::sample::Sample;
use touch2touch_core::turn::Turn;

/// The file that says how a data set is read.
pub const READ_AS_FILE: &str = "read-as.txt";
/// Most bytes of that file: some words.
const MAX_BYTES: u64 = 4096;

/// Ways in which the folder's [`READ_AS_FILE`] says that its data set is read otherwise than stored; none without it.
///
/// # Errors
/// If the file is there and cannot be read, or says something else.
pub(super) fn of(root: &Path) -> Result<Vec<ReadAs>, FileError> {
    let file = root.join(READ_AS_FILE);
    let bad = |reason: String| {
        let what = format!("cannot understand how the data are to be read: {reason}");
        FileError::new(&file, what, "correct that file, or remove it to read the data as they are stored")
    };
    match files::read_to_string(&file, MAX_BYTES) {
        Ok(text) => parse_list(&text).map_err(bad),
        Err(err) if err.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(err) => Err(bad(format!("it cannot be read: {err}"))),
    }
}

/// Says for good how a data set is read; as it is stored where nothing is listed. What was said before is lost.
///
/// # Errors
/// Whatever the disk says.
pub fn write_read_as(root: &Path, read_as: &[ReadAs]) -> std::io::Result<()> {
    let file = root.join(READ_AS_FILE);
    if !read_as.is_empty() {
        return atomic::write_bytes(&file, format!("{}\n", list(read_as)).as_bytes());
    }
    match std::fs::remove_file(&file) {
        Err(err) if err.kind() != std::io::ErrorKind::NotFound => Err(err),
        _ => Ok(()),
    }
}

impl Dataset {
    /// Ways in which it is read otherwise than it is stored.
    pub fn read_as(&self) -> &[ReadAs] {
        &self.read_as
    }

    /// Data set that is read in these ways, whatever its file says.
    #[must_use]
    pub fn reading(mut self, read_as: Vec<ReadAs>) -> Self {
        let said = self.said_read_as();
        self.problems.retain(|problem| Some(problem) != said.as_ref());
        self.read_as = read_as;
        self.problems.extend(self.said_read_as());
        self
    }

    /// That it is not read as it is stored.
    pub(super) fn said_read_as(&self) -> Option<Problem> {
        let file = self.root.as_ref().map_or_else(|| Path::new(&self.title).to_owned(), |root| root.join(READ_AS_FILE));
        let mistakes: Vec<String> = self.read_as.iter().map(|read_as| read_as.mistake()).collect();
        (!self.read_as.is_empty()).then(|| {
            problem(
                file,
                format!("read as {}, because {}", list(&self.read_as), mistakes.join(" and ")),
                "as was asked for; `touch2touch doctor PATH --set read-as=` ends it",
            )
        })
    }

    /// Reads a loaded sample so.
    pub(super) fn read_otherwise(&self, sample: &mut Sample) {
        self.read_as.iter().for_each(|read_as| read_as.apply(sample));
    }

    /// Axes of the CAD models' files that are x, y and z, one after the other.
    pub(super) fn cad_axes(&self) -> impl Iterator<Item = Axes> + '_ {
        self.read_as.iter().filter_map(|read_as| match read_as {
            ReadAs::CadAxes(axes) => Some(*axes),
            _ => None,
        })
    }

    /// Turns by which the pictures of imprints are laid down anew.
    pub(super) fn lays(&self) -> impl Iterator<Item = Turn> + '_ {
        self.read_as.iter().filter_map(|read_as| match read_as {
            ReadAs::Lay(_, lay) => Some(lay.turn()),
            _ => None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::read_as::Depths;

    #[test]
    fn what_the_file_says_is_read_and_can_be_undone() {
        let dir = tempfile::tempdir().unwrap();
        let swap = [ReadAs::SwapFingers(Depths::Imprints), ReadAs::NegateTheta];
        assert_eq!(of(dir.path()).unwrap(), []);
        write_read_as(dir.path(), &swap).unwrap();
        assert_eq!(of(dir.path()).unwrap(), swap);
        write_read_as(dir.path(), &[]).unwrap();
        write_read_as(dir.path(), &[]).unwrap();
        assert!(of(dir.path()).unwrap().is_empty() && !dir.path().join(READ_AS_FILE).exists());
        std::fs::write(dir.path().join(READ_AS_FILE), "swap-toes").unwrap();
        let error = of(dir.path()).unwrap_err().to_string();
        assert!(error.contains("swap-toes") && error.contains(READ_AS_FILE), "{error}");
    }
}
