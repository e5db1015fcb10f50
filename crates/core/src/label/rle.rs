//! Run-length coding of masks: lengths of alternating runs, row by row, starting with `false`.

use crate::grid::Mask;

/// Runs that do not make a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RleError {
    /// The runs are too few or too many.
    #[error("the runs cover {covered} pixels, a mask of {width} x {height} has {}", width * height)]
    Length {
        /// Pixels covered.
        covered: u64,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The size itself is not a mask's.
    #[error("{width} x {height} is no size of a mask")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

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

/// The mask behind [`encode_runs`].
///
/// # Errors
/// [`RleError`] if the runs do not fill exactly the given size.
pub(crate) fn decode_runs(width: usize, height: usize, runs: &[u32]) -> Result<Mask, RleError> {
    let Some(pixels) = width.checked_mul(height).filter(|&n| n <= MAX_PIXELS) else {
        return Err(RleError::Size { width, height });
    };
    let covered: u64 = runs.iter().map(|&n| u64::from(n)).sum();
    if covered != pixels as u64 {
        return Err(RleError::Length { covered, width, height });
    }
    let mut bits = Vec::with_capacity(pixels);
    for (i, &n) in runs.iter().enumerate() {
        bits.resize(bits.len() + n as usize, i % 2 == 1);
    }
    Mask::from_vec(width, height, bits).map_err(|_| RleError::Length { covered, width, height })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_runs_are_refused() {
        assert_eq!(encode_runs(&Mask::from_vec(2, 2, vec![true, false, false, true]).unwrap()), [0, 1, 2, 1]);
        assert!(matches!(decode_runs(2, 2, &[0, 1, 2]), Err(RleError::Length { covered: 3, .. })));
        assert!(decode_runs(2, 2, &[u32::MAX, u32::MAX]).is_err());
        assert!(matches!(decode_runs(usize::MAX, 2, &[]), Err(RleError::Size { .. })));
        assert!(matches!(decode_runs(1 << 20, 1 << 20, &[]), Err(RleError::Size { .. })));
    }
}
