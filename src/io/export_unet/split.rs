//! Stems, and which part a pair belongs to.

use std::collections::HashSet;

use sha2::Digest as _;

use crate::domain::rig::Rig;

use super::{ExportConfig, ExportEntry, ExportError};

fn hash(seed: u64, text: &str) -> [u8; 32] {
    let mut hasher = sha2::Sha256::new();
    hasher.update(seed.to_le_bytes());
    hasher.update(text.as_bytes());
    hasher.finalize().into()
}

/// The part (0 train, 1 val, 2 test) of each entry. Independent of the order of entries.
pub(super) fn parts(entries: &[ExportEntry], config: &ExportConfig) -> Result<Vec<usize>, ExportError> {
    let (val, test) = (config.val, config.test);
    if !(val >= 0.0 && test >= 0.0 && val + test < 1.0) {
        return Err(ExportError::Shares { val, test });
    }
    let is_unseen = |entry: &ExportEntry| entry.tool.as_ref().is_some_and(|t| config.test_tools.contains(t));
    let mut pairs: Vec<&str> = entries.iter().filter(|e| !is_unseen(e)).map(|e| e.pair.as_str()).collect();
    pairs.sort_unstable();
    pairs.dedup();
    // A shuffle that only depends on names and seed.
    pairs.sort_by_cached_key(|pair| (hash(config.seed, pair), *pair));
    // A wanted part gets at least one pair as soon as every part can have one.
    let count = |share: f64| {
        let least = usize::from(share > 0.0 && pairs.len() >= 3);
        ((pairs.len() as f64 * share).round() as usize).max(least)
    };
    let (num_val, num_test) = (count(val), count(test));
    let in_val: HashSet<&str> = pairs.iter().take(num_val).copied().collect();
    let in_test: HashSet<&str> = pairs.iter().skip(num_val).take(num_test).copied().collect();
    let part = |entry: &ExportEntry| {
        if is_unseen(entry) || in_test.contains(entry.pair.as_str()) {
            2
        } else {
            usize::from(in_val.contains(entry.pair.as_str()))
        }
    };
    Ok(entries.iter().map(part).collect())
}

/// File stems: the tool, the pair's name and the finger, in characters that no glob and no `splitext` interprets.
/// Names that become equal get a hash, so that each stem is used once.
pub(super) fn stems(entries: &[ExportEntry], rig: &Rig) -> Vec<String> {
    let plain = |text: &str| -> String {
        text.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect()
    };
    let mut used = HashSet::new();
    entries
        .iter()
        .map(|entry| {
            let mut stem = plain(&entry.pair);
            // The loader selects tools by looking for their name in the stem.
            if let Some(tool) = entry.tool.as_deref().map(plain).filter(|tool| !stem.contains(tool.as_str())) {
                stem = format!("{tool}_{stem}");
            }
            stem.truncate(150);
            let finger = rig.pad_key(entry.finger);
            stem = format!("{stem}_{finger}");
            let mut round = 0;
            // Lower case, because some file systems do not tell capitals apart.
            while !used.insert(stem.to_lowercase()) {
                let digest = hash(round, &format!("{}|{finger}", entry.pair));
                let short: String = digest[..4].iter().map(|b| format!("{b:02x}")).collect();
                stem = format!("{stem}_{short}");
                round += 1;
            }
            stem
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::rig::lab;

    fn entries(n: usize) -> Vec<ExportEntry> {
        (0..n)
            .flat_map(|i| {
                lab::PADS.map(|finger| ExportEntry {
                    pair: format!("pattern_0{}/data_{i}", i % 2),
                    tool: Some(format!("pattern_0{}", i % 2)),
                    finger,
                })
            })
            .collect()
    }

    #[test]
    fn parts_depend_on_names_and_seed_only() {
        let list = entries(50);
        let config = ExportConfig { val: 0.2, test: 0.1, ..ExportConfig::default() };
        let parts_here = parts(&list, &config).unwrap();
        for part in 0..3 {
            let n = parts_here.iter().filter(|&&p| p == part).count();
            assert_eq!(n, [70, 20, 10][part]);
        }
        assert!(parts_here.chunks(2).all(|p| p[0] == p[1]), "fingers of a pair stay together");
        let mut reversed = list.clone();
        reversed.reverse();
        let mut back = parts(&reversed, &config).unwrap();
        back.reverse();
        assert_eq!(back, parts_here);
        assert_ne!(parts(&list, &ExportConfig { seed: 1, ..config.clone() }).unwrap(), parts_here);
        let unseen = ExportConfig { test_tools: vec!["pattern_01".into()], ..config };
        let unseen_parts = parts(&list, &unseen).unwrap();
        assert!(list.iter().zip(unseen_parts).all(|(e, p)| e.tool.as_deref() != Some("pattern_01") || p == 2));
        assert_eq!(parts(&entries(3), &ExportConfig::default()).unwrap().iter().filter(|&&p| p == 0).count(), 2);
        assert!(parts(&list, &ExportConfig { val: 0.6, test: 0.4, ..ExportConfig::default() }).is_err());
        assert!(parts(&list, &ExportConfig { val: f64::NAN, ..ExportConfig::default() }).is_err());
    }

    #[test]
    fn stems_hold_the_tool_and_are_unique() {
        let entry =
            |pair: &str, tool: &str| ExportEntry { pair: pair.into(), tool: Some(tool.into()), finger: lab::RIGHT };
        let list = [entry("a/data_1", "a"), entry("a_data_1", "a"), entry("x[1].*", "b.c"), entry("A/data_1", "A")];
        let out = stems(&list, &Rig::lab());
        assert_eq!(out[0], "a_data_1_right");
        assert!(out[1].starts_with("a_data_1_right_") && out[2] == "b_c_x_1____right");
        assert!(out[3].starts_with("A_data_1_right_"));
    }
}
