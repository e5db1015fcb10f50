//! Choice of pairs for a pass over a data set.

/// The positions of at most `limit` of `len` things, spread evenly; all of them without a limit.
pub fn spread(len: usize, limit: Option<usize>) -> impl ExactSizeIterator<Item = usize> {
    let taken = limit.map_or(len, |limit| limit.min(len));
    (0..taken).map(move |i| i * len / taken)
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
