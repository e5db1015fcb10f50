//! `touch2touch merge`: the parts of a run (`--shard I/N --json`) as what one run prints.

use std::path::PathBuf;

use clap::Args;

use super::shards::{Parts, Sharded};
use super::{Common, Output, VerbResult, generate, masks, pose};

/// Arguments of `merge`.
#[derive(Debug, Args)]
pub(super) struct MergeArgs {
    /// The JSON objects of all parts of a run, in any order.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    common: Common,
}

pub(super) fn run(args: &MergeArgs) -> VerbResult {
    let parts = Parts::read(&args.files)?;
    let output = Output::new(args.common, "merging", args.files.len());
    match parts.verb {
        Sharded::Generate => generate::merge(&parts, output),
        Sharded::Pose => pose::merge(&parts, output),
        Sharded::MasksPropose => masks::merge_proposals(&parts, output),
    }
}
