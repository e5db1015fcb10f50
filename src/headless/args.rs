//! Options that several verbs share, read in one way.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use strum::IntoEnumIterator;

use super::{Common, Output};
use touch2touch_core::align::Range;
use touch2touch_core::pose::Registration;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::pairs;

/// The data set that a verb reads.
#[derive(Debug, Clone, Args)]
pub struct DatasetArgs {
    /// The data set: a folder in the lab's layout or of image pairs, or a built-in one: `demo`, `test-set` (46 unseen
    /// grasps of each of 9 seen and 3 unseen tools, simulated), `test-set-ambiguous`, `-mixed`, `-misaligned`, `-noise`, `-turned`.
    #[arg(value_name = "PATH")]
    path: PathBuf,
    #[command(flatten)]
    common: Common,
}

impl DatasetArgs {
    /// Path that was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The reporter of a verb on it, with a bar of `total` steps.
    pub fn output(&self, what: &'static str, total: usize) -> Output {
        Output::new(self.common, what, total)
    }

    /// The folder's data set, or the built-in one of that name; says first what is wrong with it.
    pub fn open(&self) -> anyhow::Result<Dataset> {
        let dataset = Dataset::open(&self.path).map_err(|err| anyhow::anyhow!("{err}; {}", err.hint))?;
        super::notes::say_problems(&dataset);
        Ok(dataset)
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
#[derive(Debug, Clone)]
pub(super) struct Listed<T> {
    words: fn() -> Vec<PossibleValue>,
    read: fn(&str) -> Result<T, String>,
}

/// A parser of such a value.
pub(super) fn listed<T: FromStr<Err = String>>(words: fn() -> Vec<PossibleValue>) -> Listed<T> {
    Listed { words, read: str::parse }
}

impl<T: Clone + Send + Sync + 'static> TypedValueParser for Listed<T> {
    type Value = T;

    fn parse_ref(
        &self,
        cmd: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<T, clap::Error> {
        self.read.parse_ref(cmd, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.words)().into_iter()))
    }
}

/// The registration, or several where a verb takes them.
#[derive(Debug, Clone, Args)]
pub(super) struct RegistrationArgs {
    /// The registration. `distance_field` may be followed by `:gate=MM`, beyond which points are ignored.
    #[arg(long = "engine", value_name = "ENGINE", default_value = Registration::default().key(), value_parser = registrations())]
    chosen: Registrations,
    /// Poses of the tool in the hand among which `joint` looks for it: `free` (default), `lab` (22.5,5), or up to so many degrees
    /// and millimeters from 0.
    #[arg(long, value_name = "DEG,MM")]
    range: Option<Range>,
}

#[derive(Debug, Clone)]
struct Registrations(Vec<Registration>);

impl FromStr for Registrations {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(Self(if text == "all" { Registration::iter().collect() } else { vec![text.parse()?] }))
    }
}

fn registrations() -> Listed<Registrations> {
    listed(|| {
        let one = Registration::iter().map(|by| PossibleValue::new(by.key()).help(by.description()));
        one.chain([PossibleValue::new("all").help("All of them, one after the other, for `pose`")]).collect()
    })
}

impl RegistrationArgs {
    /// All of them, in this order.
    pub(super) fn all(&self) -> anyhow::Result<Vec<Registration>> {
        let Some(range) = self.range else { return Ok(self.chosen.0.clone()) };
        if let [by] = self.chosen.0[..] {
            return Ok(vec![by.with_range(range).map_err(anyhow::Error::msg)?]);
        }
        Ok(self.chosen.0.iter().map(|by| by.with_range(range).unwrap_or(*by)).collect())
    }

    /// The only one.
    pub(super) fn one(&self) -> anyhow::Result<Registration> {
        match self.all()?[..] {
            [registration] => Ok(registration),
            _ => anyhow::bail!("--engine all is for `touch2touch pose`; one registration is needed here"),
        }
    }
}

/// Limit on how much of a data set is taken.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct LimitArgs {
    /// Use only this many pairs, spread evenly over the data set.
    #[arg(long, value_name = "N", value_parser = at_least_one::<usize>)]
    limit: Option<usize>,
}

impl LimitArgs {
    /// The positions that are taken of `len`.
    pub fn spread(self, len: usize) -> Vec<usize> {
        pairs::spread(len, self.limit).collect()
    }
}

/// One pair, or a number of them.
#[derive(Debug, Clone, Args)]
pub(super) struct PairArgs {
    /// Only this pair, by its name or a unique part of it.
    #[arg(long, conflicts_with = "limit")]
    pair: Option<String>,
    #[command(flatten)]
    limit: LimitArgs,
}

impl PairArgs {
    /// The position of the pair that is named, else those that are taken of all.
    pub(super) fn of(&self, dataset: &Dataset) -> anyhow::Result<Vec<usize>> {
        match &self.pair {
            Some(name) => Ok(vec![super::find_pair(dataset, name)?.0 as usize]),
            None => Ok(self.limit.spread(dataset.index.pairs.len())),
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
    fn nothing_to_do_is_no_number_of_things() {
        assert_eq!(at_least_one::<usize>("3"), Ok(3));
        assert!(at_least_one::<u32>("0").unwrap_err().contains("nothing to do"));
        for bad in ["-1", "x", "", "1.5"] {
            assert!(at_least_one::<usize>(bad).unwrap_err().contains("whole number"), "{bad}");
        }
    }
}
