//! `touch2touch cache`: the predictions and scores that the studio and the verbs keep on the disk.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::{Common, Output, VerbResult};
use crate::app::services::Services as _;
use crate::app::services::live::LiveServices;
use touch2touch_pipeline::infer::store::{Store, user_folder};

/// Arguments of `cache`.
#[derive(Debug, Args)]
pub(super) struct CacheArgs {
    /// Remove all of them.
    #[arg(long)]
    clear: bool,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Serialize)]
struct Report {
    folder: PathBuf,
    predictions: usize,
    /// Files of scores, one per method and way to score.
    sheets: usize,
    bytes: u64,
    budget_bytes: u64,
    /// Number of files that `--clear` removed.
    #[serde(skip_serializing_if = "Option::is_none")]
    removed: Option<usize>,
    /// And the files of scores among it.
    #[serde(skip_serializing_if = "Option::is_none")]
    removed_sheets: Option<usize>,
}

/// The user's kept predictions with the budget of the studio's preferences; `None` without a folder for them.
pub(super) fn store() -> Option<Store> {
    let (settings, _) = LiveServices::new().load_settings();
    Some(Store::new(user_folder()?, u64::from(settings.cache_mib) << 20))
}

pub(super) fn run(args: &CacheArgs) -> VerbResult {
    let store = store().ok_or_else(|| {
        anyhow::anyhow!("this system names no folder for such files; set TOUCH2TOUCH_CACHE to one (an absolute path)")
    })?;
    let removed = match args.clear {
        true => {
            Some(store.clear().map_err(|err| anyhow::anyhow!("cannot remove: {err}: {}", store.folder().display()))?)
        }
        false => None,
    };
    let usage = store.usage();
    let report = Report {
        folder: store.folder().to_owned(),
        predictions: usage.predictions,
        sheets: usage.sheets,
        bytes: usage.bytes,
        budget_bytes: store.budget(),
        removed: removed.map(|usage| usage.predictions),
        removed_sheets: removed.map(|usage| usage.sheets),
    };
    let output = Output::new(args.common, "", 0);
    output.finish(&report, || {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let mut text = String::new();
        if let Some(removed) = removed {
            let (predictions, sheets) = (removed.predictions, removed.sheets);
            text += &format!("removed      {predictions} and {sheets} of scores ({:.1} MiB)\n", mib(removed.bytes));
        }
        text + &format!(
            "folder       {}\npredictions  {}\nscores       {} files\nsize         {:.1} of {:.0} MiB (Preferences, \"Keep predictions\")\n",
            report.folder.display(),
            report.predictions,
            report.sheets,
            mib(report.bytes),
            mib(report.budget_bytes)
        )
    })?;
    Ok(true)
}
