//! Progress bars, notes and the one JSON object.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "this is the only module that prints")]

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use super::Common;

/// Where a verb reports to.
pub struct Output {
    json: bool,
    bar: ProgressBar,
}

impl Output {
    /// A reporter with a bar of `total` steps on standard error; the bar hides itself where that is no terminal.
    pub fn new(common: Common, what: &'static str, total: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{prefix} [{wide_bar}] {pos}/{len}  {elapsed} + {eta}  {msg}") {
            bar.set_style(style);
        }
        bar.set_prefix(what);
        Self { json: common.json, bar }
    }

    /// One step is done; `item` says on what.
    pub fn step(&self, item: &str) {
        self.bar.set_message(item.to_owned());
        self.bar.inc(1);
    }

    /// Moves the bar to `done` of `total`.
    pub fn set(&self, done: usize, total: usize) {
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
    }

    /// What is being done now.
    pub fn message(&self, text: &str) {
        self.bar.set_message(text.to_owned());
    }

    /// A line on standard error, above the bar.
    pub fn note(&self, text: &str) {
        self.bar.suspend(|| note(text));
    }

    /// Whether standard output is for programs.
    pub fn json(&self) -> bool {
        self.json
    }

    /// A line on standard output, now: a JSON object, or the text for people.
    pub fn line(&self, value: &impl Serialize, human: impl FnOnce() -> String) -> anyhow::Result<()> {
        use std::io::Write as _;
        let text = if self.json { serde_json::to_string(value)? } else { human() };
        let mut out = std::io::stdout().lock();
        writeln!(out, "{text}")?;
        Ok(out.flush()?)
    }

    /// Ends the bar and prints the result: the JSON object, or the lines for people.
    pub fn finish(self, value: &impl Serialize, human: impl FnOnce() -> String) -> anyhow::Result<()> {
        self.bar.finish_and_clear();
        if self.json {
            println!("{}", serde_json::to_string(value)?);
        } else {
            println!("{}", human().trim_end());
        }
        Ok(())
    }
}

/// A line on standard error.
pub(super) fn note(text: &str) {
    eprintln!("{text}");
}

/// Sends warnings and errors of the libraries and of our own layers to standard error.
pub(super) fn start_log() {
    struct Stderr;
    impl log::Log for Stderr {
        fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
            // The window stack warns about things nobody can act on; ours always count.
            metadata.target().starts_with("touch2touch") || metadata.level() <= log::Level::Error
        }
        fn log(&self, record: &log::Record<'_>) {
            if self.enabled(record.metadata()) {
                note(&format!("{}: {}", record.level().as_str().to_lowercase(), record.args()));
            }
        }
        fn flush(&self) {}
    }
    static LOG: Stderr = Stderr;
    if log::set_logger(&LOG).is_ok() {
        log::set_max_level(log::LevelFilter::Warn);
    }
}
