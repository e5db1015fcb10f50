//! Progress bars, notes and the one JSON object.
//!
//! A reader that has seen enough (`| head`) ends the program quietly; a disk that is full is an error. Neither is a panic.

use std::io::{self, Write as _};
use std::sync::Arc;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use super::Common;
use touch2touch_core::text::printable;
use touch2touch_work::job::{Cancel, JobCx, Progress};

/// Reporter of a verb.
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
        self.message(item);
        self.bar.inc(1);
    }

    /// Moves the bar to `done` of `total`.
    pub fn set(&self, done: usize, total: usize) {
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
    }

    /// Says what is being done now.
    pub fn message(&self, text: &str) {
        self.bar.set_message(printable(text).into_owned());
    }

    /// A job whose progress moves the bar.
    pub fn job(&self) -> JobCx {
        let bar = self.bar.clone();
        let show = move |p: Progress| {
            bar.set_length(p.total);
            bar.set_position(p.done);
            bar.set_message(printable(&p.text).into_owned());
        };
        JobCx::new(Cancel::default(), Arc::new(show))
    }

    /// A line on standard error, above the bar.
    pub fn note(&self, text: &str) {
        self.bar.suspend(|| note(text));
    }

    /// True where standard output is for programs.
    pub fn json(&self) -> bool {
        self.json
    }

    /// A line on standard output, now: a JSON object, or the text for people.
    pub fn line(&self, value: &impl Serialize, human: impl FnOnce() -> String) -> anyhow::Result<()> {
        let text = if self.json { serde_json::to_string(value)? } else { human() };
        Ok(print(&text)?)
    }

    /// Ends the bar and prints the result: the JSON object, or the lines for people.
    pub fn finish(self, value: &impl Serialize, human: impl FnOnce() -> String) -> anyhow::Result<()> {
        self.bar.finish_and_clear();
        let text = if self.json { serde_json::to_string(value)? } else { human() };
        Ok(print(text.trim_end())?)
    }
}

/// Why standard output took no more.
#[derive(Debug, thiserror::Error)]
pub(super) enum PrintError {
    /// Whoever read it has gone.
    #[error("standard output was closed")]
    Closed,
    /// Anything else, such as a full disk.
    #[error("cannot write to standard output: {0}")]
    Failed(io::Error),
}

/// A text and a line break on standard output, now. Names from files are shown, never obeyed by the terminal.
pub(super) fn print(text: &str) -> Result<(), PrintError> {
    let mut out = io::stdout().lock();
    writeln!(out, "{}", printable(text)).and_then(|()| out.flush()).map_err(|err| match err.kind() {
        io::ErrorKind::BrokenPipe => PrintError::Closed,
        _ => PrintError::Failed(err),
    })
}

/// A line on standard error, as [`print()`] has it; there is nowhere to say that it took none.
pub(super) fn note(text: &str) {
    writeln!(io::stderr().lock(), "{}", printable(text)).ok();
}

/// An error with its causes, each said once.
pub fn says(err: &anyhow::Error) -> String {
    touch2touch_work::error::says(err.as_ref())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_said_once() {
        let io = || io::Error::from(io::ErrorKind::NotFound);
        let open = touch2touch_work::io::dataset::OpenError::Io { path: "/x".into(), source: io() };
        let text = says(&open.into());
        assert_eq!(text.matches(&io().to_string()).count(), 1, "{text}");
        let chained = anyhow::Error::from(io()).context("cannot begin");
        assert_eq!(says(&chained), format!("cannot begin: {}", io()));
    }
}
