//! `touch2touch masks import`: masks that lie in one of the forms of an export.

use std::path::PathBuf;

use clap::Args;

use super::super::VerbResult;
use super::super::args::{DatasetArgs, keyed};
use touch2touch_pipeline::export::import::{ImportSetup, import_masks, plan_import};
use touch2touch_pipeline::io::exchange::Format;

/// Arguments of `masks import`.
#[derive(Debug, Args)]
pub(in super::super) struct ImportArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The folder of the masks, one of its parts, or one file. Names are those that an export gives.
    #[arg(long, value_name = "DIR")]
    from: PathBuf,
    /// Their form; else the one that lies there.
    #[arg(long, value_parser = keyed::<Format>())]
    format: Option<Format>,
    /// Also replace hand-drawn masks, and those of pairs marked "done", "flagged" or "skip".
    #[arg(long)]
    over_drawn: bool,
    /// Who imports; else whom the system says.
    #[arg(long, value_name = "NAME")]
    person: Option<String>,
    /// Show what would be imported and write nothing.
    #[arg(long)]
    dry_run: bool,
}

pub(super) fn run(args: &ImportArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let output = args.dataset.output("importing", 1);
    let setup = ImportSetup {
        from: args.from.clone(),
        format: args.format,
        over_drawn: args.over_drawn,
        person: args.person.clone(),
    };
    let planned = plan_import(&dataset, &setup, &output.job())?;
    let found = if args.dry_run {
        planned
    } else {
        output.notes("", planned.lines());
        import_masks(&dataset, &setup, &output.job())?
    };
    output.notes("left out: ", found.unmatched.iter().chain(&found.refused));
    output.finish(&found, || {
        if args.dry_run {
            [found.lines(), vec!["nothing was written (--dry-run)".into()]].concat().join("\n")
        } else {
            found.text()
        }
    })?;
    Ok(found.complete)
}
