//! Sweeps over parts of the pairs as one: [`Sweep::joined`]. A part is read again from the JSON object that it was written as.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use serde_json::Value;

use super::{Dial, Outcome, Series, Setting, Sweep, hand_note};
use crate::error::{Remark, TaskError};
use crate::labels::ImprintSource;
use crate::recipe::{ModelName, Recipe};

/// A sweep as it is written.
#[derive(Deserialize)]
struct Written {
    dataset: String,
    dial: Dial,
    at: Value,
    in_force: Recipe<ModelName>,
    series: Vec<WrittenSeries>,
    left_out: Vec<Remark>,
    notes: Vec<String>,
    pairs: usize,
    complete: bool,
    seconds: f64,
}

#[derive(Deserialize)]
struct WrittenSeries {
    source: ImprintSource,
    base: WrittenPoint,
    points: Vec<WrittenPoint>,
}

#[derive(Deserialize)]
struct WrittenPoint {
    value: Value,
    cases: Vec<Outcome>,
}

/// A setting that was written as a number or a name.
fn setting(dial: Dial, value: &Value) -> Result<Option<Setting>, String> {
    match value {
        Value::Null => Ok(None),
        Value::String(name) => dial.parse(name).map(Some),
        other => dial.parse(&other.to_string()).map(Some),
    }
}

impl<'de> Deserialize<'de> for Sweep<ModelName> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Self::of_written(Written::deserialize(from)?).map_err(D::Error::custom)
    }
}

impl Sweep<ModelName> {
    fn of_written(of: Written) -> Result<Self, String> {
        let Written { dataset, dial, at, in_force, series, left_out, notes, pairs, complete, seconds } = of;
        let at = setting(dial, &at)?;
        let one = |of: WrittenSeries| {
            let values: Vec<Option<Setting>> =
                of.points.iter().map(|point| setting(dial, &point.value)).collect::<Result<_, _>>()?;
            let values: Option<Vec<Setting>> = values.into_iter().collect();
            let columns = std::iter::once(of.base.cases).chain(of.points.into_iter().map(|point| point.cases));
            let values = values.ok_or("a value is missing")?;
            Ok(Series::of_columns(of.source, columns.collect(), &values, at))
        };
        let series = series.into_iter().map(one).collect::<Result<_, String>>()?;
        let unit = dial.unit();
        Ok(Self { dataset, dial, unit, at, in_force, series, left_out, notes, pairs, complete, seconds })
    }

    /// Sweeps of one setup over other pairs each, as one over all of these.
    ///
    /// # Errors
    /// If there is none, or they are of different values.
    pub fn joined(sweeps: Vec<Self>) -> Result<Self, TaskError> {
        let fail = |why: &str| TaskError::new(super::WHAT, why);
        let mut sweeps = sweeps.into_iter();
        let mut all = sweeps.next().ok_or_else(|| fail("there are no parts to put together"))?;
        for one in sweeps {
            if (one.dial, one.at) != (all.dial, all.at) {
                return Err(fail("the parts are of different dials"));
            }
            for series in one.series {
                match all.series.iter_mut().find(|known| known.source == series.source) {
                    Some(known) => known.append(series).map_err(|why| fail(&why))?,
                    None => all.series.push(series),
                }
            }
            all.left_out.extend(one.left_out);
            all.notes.extend(one.notes);
            all.pairs += one.pairs;
            all.complete &= one.complete;
            all.seconds += one.seconds;
        }
        all.series.sort_by_key(|series| series.source);
        // What is said of all pairs is said again of the sum.
        let hand: Option<String> = hand_note(all.dial, all.hand());
        let mut notes = Vec::new();
        for note in std::mem::take(&mut all.notes) {
            if !note.ends_with(super::NOT_MOVED) && !notes.contains(&note) {
                notes.push(note);
            }
        }
        let place = notes.iter().position(|note| note == super::NO_GENERATOR).unwrap_or(notes.len());
        hand.into_iter().for_each(|note| notes.insert(place, note));
        all.notes = notes;
        Ok(all)
    }

    /// Imprints with a mask that was drawn by hand.
    fn hand(&self) -> usize {
        let by_hand = |series: &Series| {
            let columns = || std::iter::once(&series.base).chain(&series.points);
            (0..series.base.cases.len()).filter(|&row| columns().any(|point| point.cases[row].hand)).count()
        };
        self.series.iter().map(by_hand).sum()
    }
}
