//! [`JsonArgs`]: where the result of a benchmark goes.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;
use touch2touch::headless::Common;
use touch2touch_pipeline::io::atomic;

/// Destination of the result as one JSON object.
#[derive(Debug, Clone, Args)]
pub(crate) struct JsonArgs {
    /// Print one JSON object on standard output; with `=FILE`, write it to a file and print the text
    /// for people.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    json: Option<Option<PathBuf>>,
}

impl JsonArgs {
    /// Use of standard output.
    pub(crate) fn common(&self) -> Common {
        Common { json: matches!(self.json, Some(None)) }
    }

    /// The file to write.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.json.as_ref()?.as_deref()
    }

    /// Writes the file, where one is named.
    pub(crate) fn write(&self, report: &impl Serialize) -> anyhow::Result<()> {
        self.file().map_or(Ok(()), |file| write(file, report))
    }
}

/// Writes a file.
pub(crate) fn write(file: &Path, report: &impl Serialize) -> anyhow::Result<()> {
    atomic::write_bytes(file, serde_json::to_string_pretty(report)?.as_bytes())
        .map_err(|err| anyhow::anyhow!("cannot write {}: {err}", file.display()))
}
