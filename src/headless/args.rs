//! Options that several verbs share, read in one way.

use std::convert::Infallible;
use std::ffi::OsString;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use strum::IntoEnumIterator;

use super::Common;
use touch2touch_core::pose::Registration;
use touch2touch_core::rig::{PadId, Rig};
use touch2touch_pipeline::io::atomic;
use touch2touch_pipeline::io::dataset::{Dataset, ToolScale};
use touch2touch_pipeline::pairs;

/// The data set that a verb reads.
#[derive(Debug, Clone, Args)]
pub struct DatasetArgs {
    /// The data set: a folder in the lab's layout or of image pairs, or a built-in one: `demo`, `test-set` (46 unseen
    /// grasps of each of 9 seen and 3 unseen tools, simulated), `test-set-ambiguous`, `-mixed`, `-misaligned`, `-noise`.
    #[arg(value_name = "PATH")]
    path: PathBuf,
}

impl DatasetArgs {
    /// Path that was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder's data set, or the built-in one of that name; says first what is wrong with it.
    pub(super) fn open(&self) -> anyhow::Result<Dataset> {
        let dataset = Dataset::open(&self.path).map_err(|err| anyhow::anyhow!("{err}; {}", err.hint()))?;
        super::notes::say_problems(&dataset);
        Ok(dataset)
    }

    /// [`Self::open`] with the unit of the CAD models as the command line has it.
    pub fn open_with(&self, tool_scale: Option<ToolScale>) -> anyhow::Result<Dataset> {
        let mut dataset = self.open()?;
        dataset.tool_scale = tool_scale;
        Ok(dataset)
    }
}

/// Destination of the result as one JSON object.
#[derive(Debug, Clone, Args)]
pub struct JsonArgs {
    /// Print one JSON object on standard output, as every verb does; with `=FILE`, write it to a file and print the text
    /// for people.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true)]
    json: Option<Option<PathBuf>>,
}

impl JsonArgs {
    /// Use of standard output.
    pub fn common(&self) -> Common {
        Common { json: matches!(self.json, Some(None)) }
    }

    /// The file to write.
    pub fn file(&self) -> Option<&Path> {
        self.json.as_ref()?.as_deref()
    }

    /// Writes the file, where one is named.
    pub fn write(&self, report: &impl Serialize) -> anyhow::Result<()> {
        let Some(file) = self.file() else { return Ok(()) };
        atomic::write_bytes(file, serde_json::to_string_pretty(report)?.as_bytes())
            .map_err(|err| anyhow::anyhow!("cannot write {}: {err}", file.display()))
    }

    /// Old command lines put a space before the file's name: `--json FILE.json`.
    pub fn with_equals(arguments: Vec<OsString>) -> Vec<OsString> {
        let mut out: Vec<OsString> = Vec::with_capacity(arguments.len());
        // `bench` takes no other word.
        let bench = arguments.get(1).is_some_and(|verb| verb == "bench");
        for argument in arguments {
            let word = !argument.to_string_lossy().starts_with('-');
            let file = Path::new(&argument).extension().is_some_and(|ending| ending == "json") || (bench && word);
            match out.last_mut() {
                Some(last) if last == "--json" && file => {
                    last.push("=");
                    last.push(argument);
                }
                _ => out.push(argument),
            }
        }
        out
    }
}

/// Reads the key of one of a few things, such as a registration.
pub fn keyed<T>() -> impl TypedValueParser<Value = T>
where
    T: IntoEnumIterator + FromStr + Into<&'static str> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(T::iter().map(Into::into))
        .try_map(|key| key.parse().map_err(|_| format!("{key} is none of them")))
}

/// Reads a value by its own words, and lists those that it begins with in the help.
#[derive(Debug)]
pub(super) struct Listed<T> {
    words: fn() -> Vec<PossibleValue>,
    of: PhantomData<fn() -> T>,
}

impl<T> Clone for Listed<T> {
    fn clone(&self) -> Self {
        Self { words: self.words, of: PhantomData }
    }
}

/// A parser of such a value.
pub(super) fn listed<T>(words: fn() -> Vec<PossibleValue>) -> Listed<T> {
    Listed { words, of: PhantomData }
}

impl<T: FromStr<Err = String> + Clone + Send + Sync + 'static> TypedValueParser for Listed<T> {
    type Value = T;

    fn parse_ref(
        &self,
        cmd: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<T, clap::Error> {
        let read: fn(&str) -> Result<T, String> = str::parse;
        read.parse_ref(cmd, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.words)().into_iter()))
    }
}

/// Reads a registration, and lists them in the help.
#[derive(Debug, Clone, Copy)]
pub(super) struct RegistrationParser;

impl TypedValueParser for RegistrationParser {
    type Value = Registration;

    fn parse_ref(
        &self,
        cmd: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<Registration, clap::Error> {
        let read: fn(&str) -> Result<Registration, String> = str::parse;
        read.parse_ref(cmd, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(Registration::iter().map(|e| PossibleValue::new(e.key()).help(e.description()))))
    }
}

/// Limit on how much of a data set is taken.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct LimitArgs {
    /// Take only this many, spread evenly over the data set.
    #[arg(long, value_name = "N", value_parser = at_least_one::<usize>)]
    limit: Option<usize>,
}

impl LimitArgs {
    /// The positions that are taken of `len`.
    pub fn spread(self, len: usize) -> Vec<usize> {
        pairs::spread(len, self.limit).collect()
    }

    /// The position of the pair that is named, else those that are taken of all.
    pub(crate) fn or_pair(self, dataset: &Dataset, pair: Option<&str>) -> anyhow::Result<Vec<usize>> {
        match pair {
            Some(name) => Ok(vec![super::find_pair(dataset, name)?.0 as usize]),
            None => Ok(self.spread(dataset.index.pairs.len())),
        }
    }
}

/// Reads a number of things to do: none is a mistake, and said as one.
pub fn at_least_one<T: FromStr + PartialOrd + From<u8>>(text: &str) -> Result<T, String> {
    match text.parse::<T>() {
        Ok(number) if number >= T::from(1) => Ok(number),
        Ok(_) => Err("that leaves nothing to do; give 1 or more, or leave the option out".to_owned()),
        Err(_) => Err("a whole number of 1 or more is needed".to_owned()),
    }
}

/// Finger whose image is meant: the name of one, or `both`, which means all.
#[derive(Debug, Clone)]
pub(super) struct FingerArg(String);

impl FromStr for FingerArg {
    type Err = Infallible;

    fn from_str(name: &str) -> Result<Self, Infallible> {
        Ok(Self(name.to_lowercase()))
    }
}

impl FingerArg {
    /// The fingers it stands for. A rig with a single one has no other, however it is called.
    pub(super) fn fingers(&self, rig: &Rig) -> anyhow::Result<Vec<PadId>> {
        let all = rig.pad_list();
        if self.0 == "both" || all.len() == 1 {
            return Ok(all);
        }
        let finger = rig.pad_of_key(&self.0).ok_or_else(|| {
            let names: Vec<_> = all.iter().map(|pad| rig.pad_key(*pad)).collect();
            anyhow::anyhow!("there is no finger \"{}\"; name one of {} or both", self.0, names.join(", "))
        })?;
        Ok(vec![finger])
    }
}

/// A time as minutes.
pub(super) fn parse_minutes(text: &str) -> Result<Duration, String> {
    let minutes = text.parse().ok().filter(|minutes: &f64| (0.01..=100_000.0).contains(minutes));
    let seconds = minutes.map(|minutes| Duration::from_secs_f64(60.0 * minutes));
    seconds.ok_or_else(|| "it must be a number of minutes between 0.01 and 100,000".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_json_file_may_follow_a_space_and_a_path_is_no_json_file() {
        let with =
            |words: &str| JsonArgs::with_equals(words.split(' ').map(OsString::from).collect()).join(" ".as_ref());
        assert_eq!(with("t pose --json a/b.json demo"), "t pose --json=a/b.json demo");
        assert_eq!(with("t pose --json demo --pair x.json"), "t pose --json demo --pair x.json");
        assert_eq!(with("t bench generator --json out --grasps 3"), "t bench generator --json=out --grasps 3");
        assert_eq!(with("t bench generator --json --grasps 3"), "t bench generator --json --grasps 3");
        assert_eq!(with("t pose demo --json"), "t pose demo --json");
    }

    #[test]
    fn nothing_to_do_is_no_number_of_things() {
        assert_eq!(at_least_one::<usize>("3"), Ok(3));
        assert!(at_least_one::<u32>("0").unwrap_err().contains("nothing to do"));
        for bad in ["-1", "x", "", "1.5"] {
            assert!(at_least_one::<usize>(bad).unwrap_err().contains("whole number"), "{bad}");
        }
    }
}
