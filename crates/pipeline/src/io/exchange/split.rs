//! Stems, and which part a pair belongs to.

use std::collections::{BTreeSet, HashMap, HashSet};

use sha2::Digest as _;

use touch2touch_core::rig::Rig;

use super::{ExportChoice, ExportEntry};

/// Shares of the pairs that go to validation and to test.
const VAL: f64 = 0.1;
const TEST: f64 = 0.1;

fn hash(seed: u64, text: &str) -> [u8; 32] {
    let mut hasher = sha2::Sha256::new();
    hasher.update(seed.to_le_bytes());
    hasher.update(text.as_bytes());
    hasher.finalize().into()
}

/// The part (0 train, 1 val, 2 test) of each entry, by its group's name and the seed alone: entries that come later
/// change nothing for those before, but where a part would be empty.
pub(super) fn parts(entries: &[ExportEntry], choice: &ExportChoice) -> Vec<usize> {
    let group = |entry: &'_ ExportEntry| match &entry.tool {
        Some(tool) if choice.by_tool => tool.clone(),
        _ => entry.pair.clone(),
    };
    let is_unseen = |entry: &ExportEntry| entry.held_out && !choice.test_in_train;
    let place = |name: &str| {
        let [a, b, c, d, e, f, g, h, ..] = hash(choice.seed, name);
        u64::from_be_bytes([a, b, c, d, e, f, g, h]) as f64 / 2f64.powi(64)
    };
    let names: BTreeSet<String> = entries.iter().filter(|e| !is_unseen(e)).map(group).collect();
    let mut places: Vec<(f64, String)> = names.into_iter().map(|name| (place(&name), name)).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let by_place = |at: f64| if at < VAL { 1 } else { 2 * usize::from(at < VAL + TEST) };
    let mut parts: Vec<usize> = places.iter().map(|(at, _)| by_place(*at)).collect();
    // The lab's trainer refuses an empty part: each wanted one takes its nearest, as soon as every part can have one.
    if parts.len() >= 3 {
        let held_out = entries.iter().any(is_unseen);
        for (part, wanted) in [(1, true), (2, !held_out), (0, true)] {
            if !wanted || parts.contains(&part) {
                continue;
            }
            let most = (0..3).max_by_key(|donor| parts.iter().filter(|p| *p == donor).count()).unwrap_or(0);
            // Parts lie in the order val, test, train.
            let next = match (part, most) {
                (0, _) | (2, 1) => parts.iter().rposition(|p| *p == most),
                _ => parts.iter().position(|p| *p == most),
            };
            next.into_iter().for_each(|at| parts[at] = part);
        }
    }
    let by_name: HashMap<String, usize> = places.into_iter().map(|(_, name)| name).zip(parts).collect();
    let part =
        |entry: &ExportEntry| if is_unseen(entry) { 2 } else { by_name.get(&group(entry)).copied().unwrap_or(0) };
    entries.iter().map(part).collect()
}

/// The tool, the pair's name and the finger, in characters that no glob and no `splitext` interprets.
fn stem(entry: &ExportEntry, rig: &Rig) -> String {
    let plain = |text: &str| -> String {
        text.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect()
    };
    let mut stem = plain(&entry.pair);
    // The loader selects tools by looking for their name in the stem.
    if let Some(tool) = entry.tool.as_deref().map(plain).filter(|tool| !stem.contains(tool.as_str())) {
        stem = format!("{tool}_{stem}");
    }
    stem.truncate(150);
    format!("{stem}_{}", rig.pad_key(entry.finger))
}

/// A stem that another entry has taken, told apart by a hash.
fn apart(stem: &str, round: u64, entry: &ExportEntry, rig: &Rig) -> String {
    let digest = hash(round, &format!("{}|{}", entry.pair, rig.pad_key(entry.finger)));
    let short: String = digest[..4].iter().map(|b| format!("{b:02x}")).collect();
    format!("{stem}_{short}")
}

/// File stems, each used once: names that become equal get a hash.
pub(super) fn stems(entries: &[ExportEntry], rig: &Rig) -> Vec<String> {
    let mut used = HashSet::new();
    entries
        .iter()
        .map(|entry| {
            let mut stem = stem(entry, rig);
            let mut round = 0;
            // Lower case, because some file systems do not tell capitals apart.
            while !used.insert(stem.to_lowercase()) {
                stem = apart(&stem, round, entry, rig);
                round += 1;
            }
            stem
        })
        .collect()
}

/// Entries by the stems that an export gives them, for files that come without its list.
#[derive(Clone, Debug)]
pub(crate) struct Stems(HashMap<String, Vec<usize>>);

impl Stems {
    /// All that an export of any of `entries` gives.
    pub(crate) fn of(entries: &[ExportEntry], rig: &Rig) -> Self {
        let mut all: HashMap<String, Vec<usize>> = HashMap::new();
        for (at, entry) in entries.iter().enumerate() {
            let stem = stem(entry, rig);
            all.entry(apart(&stem, 0, entry, rig)).or_default().push(at);
            all.entry(stem).or_default().push(at);
        }
        Self(all)
    }

    /// The entries that a stem may be of: more than one where their names became equal.
    pub(crate) fn find(&self, stem: &str) -> &[usize] {
        self.0.get(stem).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::rig::lab;

    fn entries(n: usize) -> Vec<ExportEntry> {
        (0..n)
            .flat_map(|i| {
                lab::PADS.map(|finger| ExportEntry {
                    pair: format!("pattern_0{}/data_{i}", i % 2),
                    tool: Some(format!("pattern_0{}", i % 2)),
                    finger,
                    held_out: false,
                })
            })
            .collect()
    }

    fn counts(parts: &[usize]) -> [usize; 3] {
        [0, 1, 2].map(|part| parts.iter().filter(|&&p| p == part).count())
    }

    #[test]
    fn parts_depend_on_names_and_seed_only() {
        let list = entries(500);
        let config = ExportChoice::default();
        let here = parts(&list, &config);
        let [train, val, test] = counts(&here);
        assert!((750..850).contains(&train) && (70..130).contains(&val) && (70..130).contains(&test), "{train} {val}");
        assert!(here.chunks(2).all(|p| p[0] == p[1]), "fingers of a pair stay together");
        let mut reversed = list.clone();
        reversed.reverse();
        let mut back = parts(&reversed, &config);
        back.reverse();
        assert_eq!(back, here);
        assert_eq!(parts(&list[..600], &config), here[..600], "what comes later changes nothing before");
        assert_ne!(parts(&list, &ExportChoice { seed: 1, ..config }), here);
    }

    #[test]
    fn no_wanted_part_is_empty_as_soon_as_every_part_can_have_one() {
        for n in 3..12 {
            for seed in 0..40 {
                let config = ExportChoice { seed, ..ExportChoice::default() };
                let counts = counts(&parts(&entries(n), &config));
                assert!(counts.iter().all(|&n| n > 0), "{n} pairs, seed {seed}: {counts:?}");
            }
        }
        assert_eq!(counts(&parts(&entries(1), &ExportChoice::default())).iter().sum::<usize>(), 2);
    }

    #[test]
    fn what_is_held_out_never_trains_and_tools_stay_together() {
        let mut list = entries(200);
        list.iter_mut().take(100).for_each(|entry| entry.held_out = true);
        let out = parts(&list, &ExportChoice::default());
        assert!(out[..100].iter().all(|&p| p == 2) && out[100..].contains(&0));
        let asked = ExportChoice { test_in_train: true, ..ExportChoice::default() };
        assert!(parts(&list, &asked)[..100].contains(&0));
        let by_tool = parts(&list[100..], &ExportChoice { by_tool: true, ..ExportChoice::default() });
        let of = |tool: &str| {
            let mine = list[100..].iter().zip(&by_tool).filter(|(e, _)| e.tool.as_deref() == Some(tool));
            mine.map(|(_, part)| *part).collect::<BTreeSet<_>>()
        };
        assert!(of("pattern_00").len() == 1 && of("pattern_01").len() == 1);
    }

    #[test]
    fn stems_hold_the_tool_and_are_unique() {
        let entry = |pair: &str, tool: &str| ExportEntry {
            pair: pair.into(),
            tool: Some(tool.into()),
            finger: lab::RIGHT,
            held_out: false,
        };
        let list = [entry("a/data_1", "a"), entry("a_data_1", "a"), entry("x[1].*", "b.c"), entry("A/data_1", "A")];
        let out = stems(&list, &Rig::lab());
        assert_eq!(out[0], "a_data_1_right");
        assert!(out[1].starts_with("a_data_1_right_") && out[2] == "b_c_x_1____right");
        assert!(out[3].starts_with("A_data_1_right_"));
        let stems = Stems::of(&list, &Rig::lab());
        assert_eq!((stems.find(&out[1]), stems.find(&out[2])), (&[1][..], &[2][..]));
        assert_eq!((stems.find(&out[0]), stems.find("a_data_1")), (&[0, 1][..], &[][..]), "nobody can say which");
    }
}
