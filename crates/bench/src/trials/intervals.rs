//! Sets of numbers on a line, as disjoint closed intervals in order.

/// Closed intervals, `[low, high]`, in order and apart.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Intervals(Vec<[f64; 2]>);

impl Intervals {
    /// The union of some intervals, in any order.
    pub(super) fn union(mut parts: Vec<[f64; 2]>) -> Self {
        parts.retain(|[low, high]| low <= high);
        parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut apart: Vec<[f64; 2]> = Vec::with_capacity(parts.len());
        for [low, high] in parts {
            match apart.last_mut() {
                Some(last) if low <= last[1] => last[1] = last[1].max(high),
                _ => apart.push([low, high]),
            }
        }
        Self(apart)
    }

    /// One interval.
    pub(super) fn one(low: f64, high: f64) -> Self {
        Self::union(vec![[low, high]])
    }

    /// The intervals.
    pub(super) fn parts(&self) -> &[[f64; 2]] {
        &self.0
    }

    /// True where nothing is in it.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Smallest and largest number; `None` of nothing.
    pub(super) fn ends(&self) -> Option<[f64; 2]> {
        Some([self.0.first()?[0], self.0.last()?[1]])
    }

    /// Each interval grown by `by` to both sides.
    pub(super) fn grown(&self, by: f64) -> Self {
        Self::union(self.0.iter().map(|[low, high]| [low - by, high + by]).collect())
    }

    /// All of it moved.
    pub(super) fn moved(&self, by: f64) -> Self {
        Self(self.0.iter().map(|part| part.map(|end| end + by)).collect())
    }

    /// Numbers in both.
    pub(super) fn both(&self, other: &Self) -> Self {
        let pairs = self.0.iter().flat_map(|a| other.0.iter().map(move |b| [a[0].max(b[0]), a[1].min(b[1])]));
        Self::union(pairs.collect())
    }

    /// Shifts that bring the interval from `low` to `high` wholly into one of these.
    pub(super) fn shifts_of(&self, [low, high]: [f64; 2]) -> Self {
        Self::union(self.0.iter().map(|[from, to]| [from - low, to - high]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unions_meet_and_shifts_fit() {
        let set = Intervals::union(vec![[3.0, 4.0], [0.0, 1.0], [0.5, 2.0], [9.0, 8.0]]);
        assert_eq!(set.parts(), [[0.0, 2.0], [3.0, 4.0]]);
        assert_eq!(set.ends(), Some([0.0, 4.0]));
        assert_eq!(set.grown(0.5).parts(), [[-0.5, 4.5]], "what touches is one");
        assert_eq!(set.moved(-3.0).parts(), [[-3.0, -1.0], [0.0, 1.0]]);
        assert_eq!(set.both(&Intervals::one(1.5, 3.5)).parts(), [[1.5, 2.0], [3.0, 3.5]]);
        assert!(set.both(&Intervals::one(2.1, 2.9)).is_empty());
        // An interval of 1.5 fits the first only, from -5 to -4.5 shifted.
        assert_eq!(set.shifts_of([5.0, 6.5]).parts(), [[-5.0, -4.5]]);
    }
}
