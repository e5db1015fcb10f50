//! Blind repeats: some pairs that a person marked done come back without their mask, so that it is known how far one
//! agrees with oneself. The second masks lie apart from the first, in a folder of their own, and never replace them.
//!
//! The choice of pairs follows from their name and the person alone: neither chance nor choice has a part in it.

use std::collections::BTreeMap;

use serde::Serialize;

use super::agreement::{Compared, compare_labels};
use super::labels::{DrawnMask, Labels, PairLabels, Record, Review, working_seconds};
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::io::digest::sha256;

/// The share of pairs that come back where nothing else was chosen.
pub const SHARE: f64 = 0.05;
/// So many other pairs were marked done by the person before one comes back.
pub(crate) const APART: usize = 10;

/// A mask drawn twice by one person.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Repeat {
    /// The first against the second.
    #[serde(flatten)]
    pub compared: Compared,
    /// Time on the pair's masks the first and the second time, without pauses.
    pub seconds: [u64; 2],
}

/// The repeats of a person.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Repeats {
    /// Masks drawn twice, the worst first.
    pub masks: Vec<Repeat>,
    /// Pairs that are to come back, in the order in which they were done.
    #[serde(skip)]
    pub due: Vec<String>,
}

/// True where a pair of a person comes back, where a share of them does: the same answer every time.
pub(crate) fn comes_back(pair: &str, person: &str, share: f64) -> bool {
    let digest = sha256(format!("{person}\n{pair}").as_bytes());
    let draw = digest.get(..12).and_then(|digits| u64::from_str_radix(digits, 16).ok());
    draw.is_some_and(|draw| (draw as f64) < share.clamp(0.0, 1.0) * (1_u64 << 48) as f64)
}

/// When a person marked a pair done, if that was the last that was said about its state.
fn done_at(records: &[Record], person: &str) -> Option<u64> {
    let last = records.iter().rev().find(|record| record.review.is_some())?;
    (last.review.is_some_and(|[_, after]| after == Review::Done) && last.person == person).then_some(last.unix_s)
}

/// The pairs that come back now, of those done with the time of that.
fn due(mut done: Vec<(u64, String)>, repeated: &BTreeMap<String, Review>, person: &str, share: f64) -> Vec<String> {
    done.sort();
    let ready = done.len().saturating_sub(APART);
    let comes = |(_, pair): &(u64, String)| {
        comes_back(pair, person, share)
            && !matches!(repeated.get(pair), Some(Review::Done | Review::Skip | Review::Flagged))
    };
    done.into_iter().take(ready).filter(comes).map(|(_, pair)| pair).collect()
}

/// Who draws pairs a second time.
#[derive(Clone, Copy, Debug)]
pub struct Repeater<'a> {
    /// The person.
    pub person: &'a str,
    /// The share of the pairs that come back.
    pub share: f64,
}

/// Repeats of a person: the pairs drawn a second time, and those that come back next.
///
/// # Errors
/// If masks cannot be read.
pub fn repeats(
    dataset: &Dataset,
    labels: &Labels,
    reviews: &BTreeMap<String, Review>,
    journals: &BTreeMap<String, Vec<Record>>,
    Repeater { person, share }: Repeater<'_>,
) -> Result<Repeats, TaskError> {
    if person.is_empty() || labels.folder().is_err() || dataset.rig.depth().is_none() {
        return Ok(Repeats::default());
    }
    let again = labels.repeats_of(person)?;
    let repeated = again.reviews().states;
    let done = journals.iter().filter(|(pair, _)| reviews.get(*pair) == Some(&Review::Done));
    let done = done.filter_map(|(pair, records)| Some((done_at(records, person)?, pair.clone()))).collect();
    let mut out = Repeats { masks: Vec::new(), due: due(done, &repeated, person, share) };
    for compared in compare_labels(dataset, labels, &again)?.masks {
        if repeated.get(&compared.pair) != Some(&Review::Done) {
            continue;
        }
        let [first, second] = [labels.load(&compared.pair)?, again.load(&compared.pair)?];
        let pad = dataset.rig.pad_of_key(&compared.finger);
        let accepted =
            |of: &PairLabels| pad.and_then(|pad| of.measured(pad)).is_some_and(DrawnMask::is_merely_accepted);
        // The same automatic mask accepted twice says nothing about how far one agrees with oneself.
        if !(accepted(&first) && accepted(&second)) {
            let first = journals.get(&compared.pair).map_or(0, |records| working_seconds(records));
            let second = working_seconds(&again.records(&compared.pair)?);
            out.masks.push(Repeat { compared, seconds: [first, second] });
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_pairs_come_back_every_time_and_about_as_many_as_wanted() {
        let names: Vec<String> = (0..4000).map(|i| format!("tool/data_{i}")).collect();
        let count = |person: &str, share| names.iter().filter(|name| comes_back(name, person, share)).count();
        assert_eq!((count("Anna", 0.0), count("Anna", 1.0), count("Anna", f64::NAN)), (0, 4000, 0));
        let found = count("Anna", SHARE);
        assert!((140..260).contains(&found), "{found} of 4000 at 5 %");
        assert_eq!(found, count("Anna", SHARE));
        // Another person has others; a larger share has the same and more.
        let both = names.iter().filter(|n| comes_back(n, "Anna", SHARE) && comes_back(n, "Ben", SHARE)).count();
        assert!(both < 40, "{both}");
        assert!(names.iter().all(|n| !comes_back(n, "Anna", 0.05) || comes_back(n, "Anna", 0.2)));
    }

    #[test]
    fn a_pair_comes_back_once_and_not_before_others_were_done() {
        let done = |count: u64| (0..count).map(|i| (100 - i, format!("p{i:02}"))).collect::<Vec<_>>();
        let none = BTreeMap::new();
        assert!(due(done(APART as u64), &none, "Anna", 1.0).is_empty());
        assert_eq!(due(done(12), &none, "Anna", 1.0), ["p11", "p10"], "the first that were done");
        let repeated = BTreeMap::from([("p11".to_owned(), Review::Done), ("p10".to_owned(), Review::InProgress)]);
        assert_eq!(due(done(12), &repeated, "Anna", 1.0), ["p10"], "one that was begun comes again");
        assert!(due(done(12), &none, "Anna", 0.0).is_empty());
    }

    #[test]
    fn done_counts_where_the_person_said_so_last() {
        let said = |person: &str, after| Record {
            unix_s: 5,
            person: person.into(),
            review: Some([Review::InProgress, after]),
            ..Record::default()
        };
        assert_eq!(done_at(&[said("Anna", Review::Done), Record::default()], "Anna"), Some(5));
        assert_eq!(done_at(&[said("Anna", Review::Done)], "Ben"), None);
        assert_eq!(done_at(&[said("Anna", Review::Done), said("Ben", Review::Flagged)], "Anna"), None);
        assert_eq!(done_at(&[], "Anna"), None);
    }
}
