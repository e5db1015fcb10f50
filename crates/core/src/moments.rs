//! Mean and deviation of a stream of numbers.
//!
//! Sums of the differences from the first number and of their squares, compensated after Neumaier: a large mean does
//! not swallow a small spread, and a constant has none. The figures depend on the order of the numbers in their last
//! bits only, so a pass adds them in the data set's order.

/// The value in the middle of those that are finite; `None` of nothing.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// A sum with what its roundings lost.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    total: f64,
    lost: f64,
}

impl Sum {
    fn add(&mut self, value: f64) {
        let total = self.total + value;
        let (large, small) = if self.total.abs() >= value.abs() { (self.total, value) } else { (value, self.total) };
        self.lost += large - total + small;
        self.total = total;
    }

    fn value(self) -> f64 {
        self.total + self.lost
    }
}

/// Count, extremes, mean and deviation of a stream of numbers. Values that are not finite are counted and left out.
#[derive(Clone, Debug)]
pub struct Moments {
    /// The first number; the sums are of the differences from it.
    about: f64,
    sum: Sum,
    squares: Sum,
    count: u64,
    invalid: u64,
    min: f64,
    max: f64,
}

impl Default for Moments {
    fn default() -> Self {
        let (sum, squares) = (Sum::default(), Sum::default());
        Self { about: 0.0, sum, squares, count: 0, invalid: 0, min: f64::INFINITY, max: f64::NEG_INFINITY }
    }
}

impl Moments {
    /// Adds one number.
    pub fn add(&mut self, value: f64) {
        if !value.is_finite() {
            self.invalid += 1;
            return;
        }
        if self.count == 0 {
            self.about = value;
        }
        let apart = value - self.about;
        self.sum.add(apart);
        self.squares.add(apart * apart);
        self.count += 1;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    /// Numbers that count.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Values that were not finite.
    pub fn invalid(&self) -> u64 {
        self.invalid
    }

    /// Smallest and largest; `None` without a number.
    pub fn extremes(&self) -> Option<[f64; 2]> {
        (self.count > 0).then_some([self.min, self.max])
    }

    /// The mean; `None` without a number.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.about + self.sum.value() / self.count as f64)
    }

    /// The population deviation; `None` without a number, infinite for numbers whose squares are.
    pub fn std(&self) -> Option<f64> {
        (self.count > 0).then(|| {
            let (n, squares) = (self.count as f64, self.squares.total);
            let mean = self.sum.value() / n;
            if squares.is_finite() { (self.squares.value() / n - mean * mean).max(0.0).sqrt() } else { f64::INFINITY }
        })
    }
}

impl Extend<f64> for Moments {
    fn extend<I: IntoIterator<Item = f64>>(&mut self, values: I) {
        for value in values {
            self.add(value);
        }
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut moments = Self::default();
        moments.extend(values);
        moments
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_sets_have_their_textbook_figures() {
        let m: Moments = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0].into_iter().collect();
        assert_eq!((m.mean(), m.std(), m.count()), (Some(5.0), Some(2.0), 8));
        assert_eq!(m.extremes(), Some([2.0, 9.0]));
        let one: Moments = [-0.1].into_iter().collect();
        assert_eq!((one.mean(), one.std()), (Some(-0.1), Some(0.0)));
        let none = Moments::default();
        assert_eq!((none.mean(), none.std(), none.extremes(), none.count()), (None, None, None, 0));
    }

    #[test]
    fn a_constant_has_no_spread_however_often_it_comes() {
        // 0.09 is no binary fraction: plain sums give it a deviation of 7e-9.
        let m: Moments = std::iter::repeat_n(f64::from(0.09f32), 100_000).collect();
        assert_eq!((m.mean(), m.std()), (Some(f64::from(0.09f32)), Some(0.0)));
    }

    #[test]
    fn what_is_no_number_is_counted_and_left_out_and_huge_is_not_zero() {
        let m: Moments = [f64::NAN, 1.0, f64::INFINITY, 3.0, f64::NEG_INFINITY].into_iter().collect();
        assert_eq!((m.mean(), m.std(), m.count(), m.invalid()), (Some(2.0), Some(1.0), 2, 3));
        let huge: Moments = [0.0, 1e300, 1.0].into_iter().collect();
        assert_eq!((huge.mean(), huge.std()), (Some(1e300 / 3.0), Some(f64::INFINITY)));
        let large: Moments = [0.0, f64::from(f32::MAX)].into_iter().collect();
        assert!((large.std().unwrap() / f64::from(f32::MAX) - 0.5).abs() < 1e-12);
    }
}
