//! Tells the program which commit it is built from.
//!
//! Only release builds are told: a build for development would otherwise compile the package again after every commit.
//! `TOUCH2TOUCH_COMMIT` overrides what git says, for builds from an archive of the source.

use std::path::Path;
use std::process::Command;

const VARIABLE: &str = "TOUCH2TOUCH_COMMIT";

fn main() {
    println!("cargo::rerun-if-env-changed={VARIABLE}");
    println!("cargo::rerun-if-changed=build.rs");
    let named = std::env::var(VARIABLE).ok().filter(|commit| !commit.is_empty());
    let release = std::env::var("PROFILE").is_ok_and(|profile| profile == "release");
    if let Some(commit) = named.or_else(|| if release { commit() } else { None }) {
        println!("cargo::rustc-env={VARIABLE}={commit}");
    }
}

/// The commit of the source with its date, and whether files were changed since.
fn commit() -> Option<String> {
    // A source archive may have been unpacked inside some other repository, which then has nothing to tell.
    if !git(&["rev-parse", "--show-prefix"])?.is_empty() {
        return None;
    }
    // Every commit and checkout adds a line to this log; a worktree has one of its own.
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    if Path::new(&log).exists() {
        println!("cargo::rerun-if-changed={log}");
    }
    let sources = ["src", "crates", "shaders", "assets", "Cargo.toml", "Cargo.lock"];
    for source in sources {
        println!("cargo::rerun-if-changed={source}");
    }
    let commit = git(&["show", "--no-patch", "--format=%h of %cs", "--abbrev=12", "HEAD"])?;
    let changed = git(&[&["status", "--porcelain", "--"], sources.as_slice()].concat())?;
    Some(if changed.is_empty() { commit } else { format!("{commit}, with changes") })
}

/// What git answers in the package's folder; `None` without git or a repository.
fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
