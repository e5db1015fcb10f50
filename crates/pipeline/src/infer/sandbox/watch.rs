//! A process under a bound of memory and time.

use std::ffi::OsString;
use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Time between two looks at the process.
const POLL: Duration = Duration::from_millis(5);
/// Time between two looks at its memory, where nothing else bounds it.
const POLL_MEMORY: Duration = Duration::from_millis(200);
/// Most bytes of what it says that are kept.
const MAX_TEXT: u64 = 1 << 16;

/// Limits of the process.
pub(super) struct Limits {
    /// Bytes; `None` for no bound.
    pub(super) memory: Option<u64>,
    pub(super) time: Duration,
}

/// End of the process.
#[derive(Debug)]
pub(super) enum End {
    Ended(ExitStatus),
    /// It was ended after the time was over.
    TooLong,
    /// It was ended because of its memory.
    TooMuch,
}

/// Output and end of the process.
#[derive(Debug)]
pub(super) struct ProcessEnd {
    pub(super) end: End,
    /// Standard output, its beginning.
    pub(super) output: String,
    /// Standard error, its beginning.
    pub(super) errors: String,
}

/// Runs a program to its end, or to the end of its limits.
pub(super) fn watch(words: &[OsString], limits: Limits) -> io::Result<ProcessEnd> {
    let mut child = command(words, limits.memory)
        // An address space of its own for each thread's heap would count, though nothing is in it.
        .env("MALLOC_ARENA_MAX", "2")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    std::thread::scope(|scope| {
        let output = scope.spawn(move || beginning(stdout));
        let errors = scope.spawn(move || beginning(stderr));
        let end = wait(&mut child, &limits);
        if end.is_err() {
            // The readers end with the process.
            child.kill().ok();
            child.wait().ok();
        }
        let text = |reader: std::thread::ScopedJoinHandle<'_, String>| reader.join().unwrap_or_default();
        Ok(ProcessEnd { output: text(output), errors: text(errors), end: end? })
    })
}

/// A program and its arguments, with a bound on its memory where the system has one for processes.
fn command(words: &[OsString], memory: Option<u64>) -> Command {
    let Some(memory) = memory.filter(|_| cfg!(unix)) else {
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]);
        return command;
    };
    // Only the shell can set a limit without unsafe code. It is tried out first: where the system has no such limit, or a
    // lower one is in force, the program is started all the same.
    const LIMITED: &str = r#"(ulimit -v "$1") 2>/dev/null && ulimit -v "$1"; shift; exec "$@""#;
    let mut command = Command::new("/bin/sh");
    command.args(["-c", LIMITED, "sh"]).arg((memory >> 10).to_string()).args(words);
    command
}

fn wait(child: &mut Child, limits: &Limits) -> io::Result<End> {
    let begin = Instant::now();
    let mut asked = begin;
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(End::Ended(status));
        }
        let mut end = (begin.elapsed() > limits.time).then_some(End::TooLong);
        // Linux keeps to the limit by itself.
        let looked_at = cfg!(unix) && !cfg!(target_os = "linux");
        if let Some(memory) = limits.memory.filter(|_| looked_at && asked.elapsed() > POLL_MEMORY) {
            asked = Instant::now();
            if resident(child.id()).is_some_and(|bytes| bytes > memory) {
                end = Some(End::TooMuch);
            }
        }
        if let Some(end) = end {
            child.kill()?;
            child.wait()?;
            return Ok(end);
        }
        std::thread::sleep(POLL);
    }
}

/// Bytes of memory a process holds; `None` where that cannot be found out.
fn resident(id: u32) -> Option<u64> {
    let output = Command::new("ps").args(["-o", "rss=", "-p", &id.to_string()]).output().ok()?;
    Some(String::from_utf8(output.stdout).ok()?.trim().parse::<u64>().ok()? << 10)
}

/// The beginning of what a pipe carries; the rest is taken and dropped, so that nobody waits for a full pipe.
fn beginning(pipe: Option<impl Read>) -> String {
    let Some(mut pipe) = pipe else { return String::new() };
    let mut text = Vec::new();
    let read = pipe.by_ref().take(MAX_TEXT).read_to_end(&mut text);
    if let Err(err) = read.and_then(|_| io::copy(&mut pipe, &mut io::sink())) {
        log::debug!("a pipe broke: {err}");
    }
    String::from_utf8_lossy(&text).into_owned()
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;

    fn shell(script: &str, limits: Limits) -> ProcessEnd {
        watch(&["/bin/sh", "-c", script].map(OsString::from), limits).unwrap()
    }

    #[test]
    fn what_takes_too_long_is_ended_and_what_it_said_is_known() {
        let begin = Instant::now();
        let limits = Limits { memory: Some(1 << 30), time: Duration::from_millis(300) };
        let seen = shell("echo begun; exec sleep 100", limits);
        assert!(matches!(seen.end, End::TooLong), "{seen:?}");
        assert_eq!(seen.output, "begun\n");
        assert!(begin.elapsed() < Duration::from_secs(20));
    }

    #[test]
    fn a_flood_of_words_is_cut_and_waits_for_nobody() {
        let limits = Limits { memory: Some(1 << 30), time: Duration::from_secs(60) };
        let seen = shell("head -c 1000000 /dev/zero; echo last >&2; exit 3", limits);
        assert!(matches!(seen.end, End::Ended(status) if status.code() == Some(3)), "{seen:?}");
        assert_eq!((seen.output.len() as u64, seen.errors.as_str()), (MAX_TEXT, "last\n"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_memory_is_bounded() {
        let limits = |memory| Limits { memory: Some(memory), time: Duration::from_secs(60) };
        // One line of 300 MB, which the shell holds as a whole.
        let script = "x=$(head -c 300000000 /dev/zero | tr '\\0' x); echo ${#x}";
        let tight = shell(script, limits(100 << 20));
        assert!(!tight.output.contains("300000000"), "{tight:?}");
        assert_eq!(shell(script, limits(8 << 30)).output.trim(), "300000000");
    }

    #[test]
    fn a_program_that_is_not_there_is_an_end_with_words() {
        let limits = Limits { memory: Some(1 << 30), time: Duration::from_secs(60) };
        let seen = watch(&["/nowhere/at/all".into()], limits).unwrap();
        assert!(matches!(seen.end, End::Ended(status) if !status.success()) && !seen.errors.is_empty(), "{seen:?}");
    }
}
