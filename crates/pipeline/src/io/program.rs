//! The program that runs, and how it is started once more.

use std::ffi::OsString;
use std::process::Command;
use std::sync::OnceLock;

/// Words that start a program with the verbs of `touch2touch`: its path, or an interpreter with what it is to run.
#[derive(Clone, Debug)]
pub struct Program(pub Vec<OsString>);

static PROGRAM: OnceLock<Program> = OnceLock::new();

impl Program {
    /// The executable of this process, where the system knows it.
    pub fn executable() -> Option<Self> {
        Some(Self(vec![std::env::current_exe().ok()?.into()]))
    }

    /// Declares this process to be the program; the first call counts.
    pub fn declare(self) {
        drop(PROGRAM.set(self));
    }

    /// The declared program; `None` in another one that uses this library.
    pub fn declared() -> Option<&'static Self> {
        PROGRAM.get()
    }

    /// A command that starts it once more, without arguments.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.0[0]);
        command.args(&self.0[1..]);
        command
    }
}
