//! `touch2touch masks export`: contact masks as training folders.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::{Common, VerbResult};

/// What can be done with masks.
#[derive(Debug, Subcommand)]
pub(super) enum MasksVerb {
    /// Write images and masks for training a mask UNet, and check what was written by the loader's rules.
    Export(ExportArgs),
}

/// Arguments of `masks export`.
#[derive(Debug, Args)]
pub(super) struct ExportArgs {
    /// The dataset: a folder in the lab's layout or of image pairs, or `demo`.
    #[arg(long)]
    input: PathBuf,
    /// The folder to write; empty, missing, or a previous export.
    #[arg(long)]
    out: PathBuf,
    /// The form.
    #[arg(long, value_enum, default_value_t = Format::Unet)]
    format: Format,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Format {
    /// `{train,val,test}/{imgs,masks}/<stem>.png`, as the lab's UNet loader reads it.
    Unet,
}
