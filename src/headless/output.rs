//! Progress bars, notes and the one JSON object.
//!
//! A reader that has seen enough (`| head`) ends the program quietly; a disk that is full is an error. Neither is a panic.

use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::Common;
use touch2touch_core::text::printable;
use touch2touch_pipeline::job::{Cancel, JobCx, Progress};

/// Reporter of a verb.
pub struct Output {
    json: bool,
    bar: Arc<Mutex<Bar>>,
}

/// A line on a terminal that says how far a verb is.
struct Bar {
    what: &'static str,
    begun: Instant,
    /// When it was drawn last.
    drawn: Option<Instant>,
    done: u64,
    total: u64,
    text: String,
}

impl Bar {
    fn draw(&mut self) {
        const PAUSE: Duration = Duration::from_millis(100);
        /// Characters of the line.
        const WIDTH: usize = 79;
        if !io::stderr().is_terminal() || self.drawn.is_some_and(|at| at.elapsed() < PAUSE) {
            return;
        }
        self.drawn = Some(Instant::now());
        let took = self.begun.elapsed().as_secs_f64();
        let left = match self.done {
            0 => String::new(),
            done => format!(" + {:.0}", took * self.total.saturating_sub(done) as f64 / done as f64),
        };
        let line = format!("{} {}/{}  {took:.0}{left} s  {}", self.what, self.done, self.total, printable(&self.text));
        let line: String = line.chars().take(WIDTH).collect();
        clear();
        DRAWN.store(true, Ordering::Relaxed);
        write!(io::stderr(), "{line}").ok();
    }
}

/// True where such a line stands on standard error.
static DRAWN: AtomicBool = AtomicBool::new(false);

/// Takes that line away; what is printed next stands in its place.
fn clear() {
    if DRAWN.swap(false, Ordering::Relaxed) {
        write!(io::stderr(), "\r\x1b[2K").ok();
    }
}

fn update(bar: &Mutex<Bar>, change: impl FnOnce(&mut Bar)) {
    let mut bar = bar.lock().unwrap_or_else(PoisonError::into_inner);
    change(&mut bar);
    bar.draw();
}

impl Output {
    /// A reporter with a bar of `total` steps on standard error, where that is a terminal.
    pub fn new(common: Common, what: &'static str, total: usize) -> Self {
        let bar = Bar { what, begun: Instant::now(), drawn: None, done: 0, total: total as u64, text: String::new() };
        Self { json: common.json, bar: Arc::new(Mutex::new(bar)) }
    }

    /// One step is done; `item` says on what.
    pub fn step(&self, item: &str) {
        update(&self.bar, |bar| {
            bar.done += 1;
            item.clone_into(&mut bar.text);
        });
    }

    /// Moves the bar to `done` of `total`.
    pub fn set(&self, done: usize, total: usize) {
        update(&self.bar, |bar| (bar.done, bar.total) = (done as u64, total as u64));
    }

    /// Says what is being done now.
    pub fn message(&self, text: &str) {
        update(&self.bar, |bar| text.clone_into(&mut bar.text));
    }

    /// A job whose progress moves the bar.
    pub fn job(&self) -> JobCx {
        let bar = self.bar.clone();
        let show = move |p: Progress| update(&bar, |bar| (bar.done, bar.total, bar.text) = (p.done, p.total, p.text));
        JobCx::new(Cancel::default(), Arc::new(show))
    }

    /// A line on standard error.
    pub fn note(&self, text: &str) {
        note(text);
    }

    /// A line on standard error for each of them, which begins with `start`.
    pub fn notes(&self, start: &str, all: impl IntoIterator<Item: Display>) {
        all.into_iter().for_each(|one| self.note(&format!("{start}{one}")));
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
        self.line(value, || human().trim_end().to_owned())
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
    clear();
    let mut out = io::stdout().lock();
    writeln!(out, "{}", printable(text)).and_then(|()| out.flush()).map_err(|err| match err.kind() {
        io::ErrorKind::BrokenPipe => PrintError::Closed,
        _ => PrintError::Failed(err),
    })
}

/// A line on standard error, as [`print()`] has it; there is nowhere to say that it took none.
pub(super) fn note(text: &str) {
    clear();
    writeln!(io::stderr().lock(), "{}", printable(text)).ok();
}

/// An error with its causes, each said once.
pub fn says(err: &anyhow::Error) -> String {
    touch2touch_pipeline::error::says(err.as_ref())
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
        let open = touch2touch_pipeline::io::error::FileError::io("/x", "cannot open", io());
        let text = says(&open.into());
        assert_eq!(text.matches(&io().to_string()).count(), 1, "{text}");
        let chained = anyhow::Error::from(io()).context("cannot begin");
        assert_eq!(says(&chained), format!("cannot begin: {}", io()));
    }
}
