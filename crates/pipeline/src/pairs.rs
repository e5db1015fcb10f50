//! Choice of pairs for a pass over a data set.

use std::collections::BTreeMap;

use crate::io::dataset::Dataset;
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::{PadId, Rig};

/// The positions of at most `limit` of `len` things, spread evenly; all of them without a limit.
pub fn spread(len: usize, limit: Option<usize>) -> impl ExactSizeIterator<Item = usize> {
    let taken = limit.map_or(len, |limit| limit.min(len));
    (0..taken).map(move |i| i * len / taken)
}

/// The pairs by tool, in the order of the index.
pub(crate) fn by_tool(dataset: &Dataset) -> BTreeMap<Option<&str>, Vec<PairId>> {
    let mut tools: BTreeMap<Option<&str>, Vec<PairId>> = BTreeMap::new();
    for (id, entry) in (0u32..).zip(&dataset.index.pairs) {
        tools.entry(entry.tool.as_deref()).or_default().push(PairId(id));
    }
    tools
}

/// The pads of a rig that a name means: one, or all of them by `both`. A rig with a single one has no other, however it is
/// called.
///
/// # Errors
/// If no pad has this name; those that there are are said.
pub fn pads_named(rig: &Rig, name: &str) -> Result<Vec<PadId>, String> {
    let (all, name) = (rig.pad_list(), name.to_lowercase());
    if name == "both" || all.len() == 1 {
        return Ok(all);
    }
    let names: Vec<_> = all.iter().map(|pad| rig.pad_key(*pad)).collect();
    let lacks = || format!("there is no finger \"{name}\"; name one of {} or both", names.join(", "));
    Ok(vec![rig.pad_of_key(&name).ok_or_else(lacks)?])
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn what_is_taken_lies_evenly() {
        let taken = |len, limit| spread(len, limit).collect::<Vec<_>>();
        assert_eq!(taken(10, Some(4)), [0, 2, 5, 7]);
        assert_eq!((taken(3, Some(5)), taken(3, None)), (vec![0, 1, 2], vec![0, 1, 2]));
        assert_eq!((taken(0, Some(5)), taken(0, None)), (vec![], vec![]));
    }
}
