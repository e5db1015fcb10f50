//! Shares of a run: `--shard I/N` of a verb does the I-th of N parts of its pairs, on whatever machine, and its JSON object is a
//! *part*, of which `merge` makes what one run prints.

use std::collections::HashSet;
use std::path::Path;

use clap::Args;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::notes::Notes;
use super::{Output, VerbResult};
use touch2touch_core::dataset::Problem;
use touch2touch_core::findings::{Finding, Findings};
use touch2touch_work::io::files;

/// No larger file is a part: a row of the most talkative verb takes some 10 kB.
const MAX_FILE: u64 = 4 << 30;

/// A share of the pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Shard {
    /// From 1 on.
    at: usize,
    of: usize,
}

/// Option for doing a share of the pairs.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct ShardArg {
    /// Do only the I-th of N parts of the pairs, counted from 1, as a job of an array; `merge` puts the parts' JSON objects
    /// together.
    #[arg(long, value_name = "I/N", value_parser = parse, requires = "json")]
    pub(super) shard: Option<Shard>,
}

pub(super) fn parse(text: &str) -> Result<Shard, String> {
    let numbers = text.split_once('/').and_then(|(at, of)| Some((at.parse().ok()?, of.parse().ok()?)));
    match numbers {
        Some((at, of)) if (1..=of).contains(&at) => Ok(Shard { at, of }),
        _ => Err("two numbers are needed, such as 3/8: the third of eight parts".to_owned()),
    }
}

impl Shard {
    /// The part of things in order that is its: parts are as large as each other, and follow each other.
    pub(super) fn share<T>(self, mut all: Vec<T>) -> Vec<T> {
        let bound = |n: usize| n * all.len() / self.of;
        let (first, end) = (bound(self.at - 1), bound(self.at));
        all.truncate(end);
        all.drain(..first);
        all
    }

    /// Part of a file's name.
    pub(super) fn suffix(self) -> String {
        format!("-{}-of-{}", self.at, self.of)
    }
}

impl ShardArg {
    /// The things, in order, that are to be done; all without the option.
    pub(super) fn share<T>(self, all: Vec<T>) -> Vec<T> {
        match self.shard {
            Some(shard) => shard.share(all),
            None => all,
        }
    }

    /// Ends a verb: prints its report, or that as a part. True where everything was done, as `complete` says.
    pub(super) fn finish<T: Serialize>(
        self,
        output: Output,
        (verb, complete): (Sharded, bool),
        problems: Vec<Problem>,
        report: &T,
        human: impl FnOnce() -> String,
    ) -> VerbResult {
        match self.shard {
            None => output.finish(report, human)?,
            Some(shard) => {
                let words: Vec<String> = std::env::args().skip(1).collect();
                let part = Mark { verb, shard, command: command(&words), complete, problems };
                output.finish(&Part { part, report }, String::new)?;
            }
        }
        Ok(complete)
    }
}

/// Words of a command line that all its parts share.
fn command(words: &[String]) -> Vec<String> {
    let mut own = false;
    let shared = |word: &&String| {
        let value = std::mem::replace(&mut own, **word == "--shard");
        !value && !own && !word.starts_with("--shard=") && *word != "--json"
    };
    words.iter().filter(shared).cloned().collect()
}

/// Verbs of which there are parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Sharded {
    Generate,
    Pose,
    MasksPropose,
}

/// A part's words about itself.
#[derive(Debug, Serialize, Deserialize)]
struct Mark {
    verb: Sharded,
    shard: Shard,
    /// The command line without its share.
    command: Vec<String>,
    /// True where all of its share was done.
    complete: bool,
    /// Oddities of the files, one by one.
    problems: Vec<Problem>,
}

#[derive(Serialize)]
struct Part<'a, T> {
    part: Mark,
    #[serde(flatten)]
    report: &'a T,
}

#[derive(Deserialize)]
struct Marked {
    part: Option<Mark>,
}

/// The parts of one run, in order.
pub(super) struct Parts {
    pub(super) verb: Sharded,
    texts: Vec<String>,
    notes: Vec<Finding>,
    complete: bool,
}

impl Parts {
    /// Reads the parts of a run.
    ///
    /// # Errors
    /// If a file is no part, they are of different runs, or one is missing or there twice.
    pub(super) fn read<P: AsRef<Path>>(paths: &[P]) -> anyhow::Result<Self> {
        let mut parts = Vec::new();
        for path in paths {
            let path = path.as_ref();
            let bytes = files::read(path, MAX_FILE).map_err(|err| anyhow::anyhow!("{}: {err}", path.display()))?;
            let text = String::from_utf8(bytes).map_err(|_| anyhow::anyhow!("{} is no text", path.display()))?;
            let marked: Marked = serde_json::from_str(&text)
                .map_err(|err| anyhow::anyhow!("{} is not the JSON object of a verb: {err}", path.display()))?;
            let Some(mark) = marked.part else {
                anyhow::bail!("{} is no part of a run: make it with --shard I/N --json", path.display());
            };
            parts.push((mark, text, path));
        }
        parts.sort_by_key(|(mark, ..)| mark.shard.at);
        let Some((first, ..)) = parts.first() else { anyhow::bail!("there are no parts to merge") };
        for (mark, _, path) in &parts {
            if (&mark.command, mark.shard.of) != (&first.command, first.shard.of) {
                anyhow::bail!(
                    "{} is of another run: `{}` in {} parts, not `{}` in {}",
                    path.display(),
                    mark.command.join(" "),
                    mark.shard.of,
                    first.command.join(" "),
                    first.shard.of
                );
            }
        }
        for (place, (mark, _, path)) in parts.iter().enumerate() {
            match mark.shard.at.cmp(&(place + 1)) {
                std::cmp::Ordering::Less => anyhow::bail!("part {} is there twice: {}", mark.shard.at, path.display()),
                std::cmp::Ordering::Greater => anyhow::bail!("part {} of {} is missing", place + 1, mark.shard.of),
                std::cmp::Ordering::Equal => {}
            }
        }
        if parts.len() < first.shard.of {
            anyhow::bail!("part {} of {} is missing", parts.len() + 1, first.shard.of);
        }
        let notes = notes(parts.iter().map(|(mark, ..)| mark.problems.as_slice()));
        let (verb, complete) = (first.verb, parts.iter().all(|(mark, ..)| mark.complete));
        Ok(Self { verb, complete, texts: parts.into_iter().map(|(_, text, _)| text).collect(), notes })
    }

    /// The reports of the parts.
    ///
    /// # Errors
    /// If one is not of that verb.
    pub(super) fn reports<T: DeserializeOwned>(&self) -> anyhow::Result<Vec<T>> {
        let read = |text: &String| serde_json::from_str(text);
        self.texts.iter().map(read).collect::<Result<_, _>>().map_err(|err| anyhow::anyhow!("a part is damaged: {err}"))
    }

    /// Oddities of the files, by kind.
    pub(super) fn notes(&self) -> Vec<Finding> {
        self.notes.clone()
    }

    /// True where each part did all of its share.
    pub(super) fn complete(&self) -> bool {
        self.complete
    }
}

/// Oddities of parts by kind. Each part says what it met on the way to its pairs: what is the same in another was met there too.
fn notes<'a>(parts: impl Iterator<Item = &'a [Problem]>) -> Vec<Finding> {
    let key = |problem: &'a Problem| (&problem.file, &problem.what, &problem.hint);
    let (mut findings, mut before) = (Findings::default(), HashSet::new());
    for part in parts {
        findings.extend(part.iter().filter(|problem| !before.contains(&key(problem))).cloned());
        before.extend(part.iter().map(key));
    }
    findings.into_list()
}

impl Notes {
    /// Oddities one by one, for a part.
    pub(super) fn for_part(&self, shard: ShardArg) -> Vec<Problem> {
        if shard.shard.is_some() { self.problems().to_vec() } else { Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_all_there_is_and_nothing_twice() {
        for (len, of) in [(10, 3), (2, 5), (0, 2), (96, 64)] {
            let parts = (1..=of).map(|at| Shard { at, of }.share((0..len).collect::<Vec<_>>()));
            let sizes: Vec<usize> = parts.clone().map(|part| part.len()).collect();
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1, "{sizes:?}");
            assert_eq!(parts.flatten().collect::<Vec<_>>(), (0..len).collect::<Vec<_>>());
        }
        assert_eq!(parse("3/8"), Ok(Shard { at: 3, of: 8 }));
        for bad in ["0/8", "9/8", "3", "a/b", "3/0", "-1/4"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_command_is_the_same_in_all_parts() {
        let words = |text: &str| command(&text.split(' ').map(str::to_owned).collect::<Vec<_>>()).join(" ");
        let all = "pose demo --limit 4";
        for text in ["pose demo --shard 1/2 --limit 4 --json", "pose --shard=2/2 demo --json --limit 4"] {
            assert_eq!(words(text), all);
        }
    }
}
