//! Run-length coding of masks: lengths of alternating runs, row by row, starting with `false`.

use crate::grid::Mask;

/// More pixels than any sensor has: a damaged header must not ask for gigabytes.
const MAX_PIXELS: usize = 1 << 26;

/// The lengths of the runs; the first one is of `false` and may be 0.
pub(crate) fn encode_runs(mask: &Mask) -> Vec<u32> {
    let mut runs = vec![0];
    let mut current = false;
    for &value in mask.as_slice() {
        if value != current {
            current = value;
            runs.push(0);
        }
        if let Some(last) = runs.last_mut() {
            *last += 1;
        }
    }
    runs
}

/// The mask behind [`encode_runs`]; `None` if the runs do not fill exactly the given size, or that is none of a mask.
pub(crate) fn decode_runs(width: usize, height: usize, runs: &[u32]) -> Option<Mask> {
    let pixels = width.checked_mul(height).filter(|&n| n <= MAX_PIXELS)?;
    let covered: u64 = runs.iter().map(|&n| u64::from(n)).sum();
    if covered != pixels as u64 {
        return None;
    }
    let mut bits = Vec::with_capacity(pixels);
    for (i, &n) in runs.iter().enumerate() {
        bits.resize(bits.len() + n as usize, i % 2 == 1);
    }
    Mask::from_vec(width, height, bits).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_runs_are_refused() {
        assert_eq!(encode_runs(&Mask::from_vec(2, 2, vec![true, false, false, true]).unwrap()), [0, 1, 2, 1]);
        for (width, height, runs) in
            [(2, 2, &[0, 1, 2][..]), (2, 2, &[u32::MAX, u32::MAX]), (usize::MAX, 2, &[]), (1 << 20, 1 << 20, &[])]
        {
            assert_eq!(decode_runs(width, height, runs), None);
        }
    }
}
