//! Options that several verbs share, read in one way.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;

use crate::io::dataset::{Dataset, ToolScale};

/// The dataset that a verb reads.
#[derive(Debug, Clone, Args)]
pub(super) struct DatasetArgs {
    /// The dataset: a folder in the lab's layout or of image pairs, or a built-in one: `demo`, `test-set` (46 unseen
    /// grasps of each of 9 seen and 3 unseen tools, simulated), `test-set-ambiguous`, `-mixed`, `-misaligned`, `-noise`.
    #[arg(value_name = "PATH", required_unless_present = "input")]
    path: Option<PathBuf>,
    /// The same as PATH.
    #[arg(long, value_name = "PATH", conflicts_with = "path")]
    input: Option<PathBuf>,
}

impl DatasetArgs {
    /// What was named.
    pub(super) fn path(&self) -> &Path {
        // The parser sees to it that one of them is there.
        self.path.as_deref().or(self.input.as_deref()).unwrap_or(Path::new(""))
    }

    /// The folder's dataset, or the built-in one of that name.
    pub(super) fn open(&self) -> anyhow::Result<Dataset> {
        Dataset::open(self.path()).map_err(|err| anyhow::anyhow!("{err}; {}", err.hint()))
    }

    /// [`Self::open`] with the unit of the CAD models as the command line has it.
    pub(super) fn open_with(&self, tool_scale: Option<ToolScale>) -> anyhow::Result<Dataset> {
        let mut dataset = self.open()?;
        dataset.tool_scale = tool_scale;
        Ok(dataset)
    }
}

/// How much of a dataset is taken.
#[derive(Debug, Clone, Copy, Default, Args)]
pub(super) struct LimitArgs {
    /// Take only this many, spread evenly over the dataset.
    #[arg(long, value_name = "N", value_parser = at_least_one::<usize>)]
    limit: Option<usize>,
}

impl LimitArgs {
    /// The positions that are taken of `len`.
    pub(super) fn spread(self, len: usize) -> Vec<usize> {
        super::spread(len, self.limit)
    }
}

/// Reads a number of things to do: none is a mistake, and said as one.
pub(super) fn at_least_one<T: FromStr + PartialOrd + From<u8>>(text: &str) -> Result<T, String> {
    match text.parse::<T>() {
        Ok(number) if number >= T::from(1) => Ok(number),
        Ok(_) => Err("that leaves nothing to do; give 1 or more, or leave the option out".to_owned()),
        Err(_) => Err("a whole number of 1 or more is needed".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_to_do_is_no_number_of_things() {
        assert_eq!(at_least_one::<usize>("3"), Ok(3));
        assert!(at_least_one::<u32>("0").unwrap_err().contains("nothing to do"));
        for bad in ["-1", "x", "", "1.5"] {
            assert!(at_least_one::<usize>(bad).unwrap_err().contains("whole number"), "{bad}");
        }
    }
}
