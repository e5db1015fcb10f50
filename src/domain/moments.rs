//! Mean and deviation of a stream of numbers, the same to the last bit in whatever order the numbers come.
//!
//! The sums of the numbers and of their squares are kept exactly, as fixed-point integers as wide as the range of f64,
//! and rounded once at the end. So partial sums can be merged in any order, a large mean does not swallow a small
//! spread, and two runs over the same data agree however the work was split.
//!
//! Source: the superaccumulator of Kulisch (1971), in the carry-save form of Neal (2015, arXiv:1505.05571).

mod exact;

use exact::Exact;

/// Count, extremes, mean and deviation of a stream of numbers. Values that are not finite are counted and left out.
#[derive(Clone, Debug)]
pub struct Moments {
    sum: Exact,
    squares: Exact,
    count: u64,
    invalid: u64,
    min: f64,
    max: f64,
}

impl Default for Moments {
    fn default() -> Self {
        Self {
            sum: Exact::of_numbers(),
            squares: Exact::of_products(),
            count: 0,
            invalid: 0,
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
        }
    }
}

impl Moments {
    /// Adds one number.
    pub fn add(&mut self, value: f64) {
        if !value.is_finite() {
            self.invalid += 1;
            return;
        }
        self.sum.add(value);
        self.squares.add_square(value);
        self.count += 1;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    /// Adds the numbers of another stream. `a.merge(b)` and `b.merge(a)` give equal figures, bit for bit.
    pub fn merge(&mut self, other: &Self) {
        self.sum.merge(&other.sum);
        self.squares.merge(&other.squares);
        self.count += other.count;
        self.invalid += other.invalid;
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
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
        (self.count > 0).then(|| self.sum.value() / self.count as f64)
    }

    /// The population deviation, rounded once from the exact variance; `None` without a number.
    pub fn std(&self) -> Option<f64> {
        (self.count > 0).then(|| {
            let count = self.count as f64;
            (exact::spread(&self.sum, &self.squares, self.count).sqrt()) / count
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
mod tests;
