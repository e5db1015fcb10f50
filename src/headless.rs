//! The command line: every verb calls the code that the studio's buttons call.

use std::process::ExitCode;

/// Parses the arguments and runs the verb or the window.
pub fn main() -> ExitCode {
    ExitCode::SUCCESS
}
