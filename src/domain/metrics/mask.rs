//! Overlap of two contact masks.

use serde::Serialize;

use crate::domain::grid::Mask;

/// How well a mask matches another one, with the counts behind it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MaskScore {
    /// Pixels in both.
    pub both: usize,
    /// Pixels only in the first.
    pub only_first: usize,
    /// Pixels only in the second.
    pub only_second: usize,
}

impl MaskScore {
    /// Compares two masks; `None` if their sizes differ. Counts of several images may be added up for a pooled score.
    pub fn of(first: &Mask, second: &Mask) -> Option<Self> {
        if first.size() != second.size() {
            return None;
        }
        let mut score = Self { both: 0, only_first: 0, only_second: 0 };
        for (&a, &b) in first.as_slice().iter().zip(second.as_slice()) {
            match (a, b) {
                (true, true) => score.both += 1,
                (true, false) => score.only_first += 1,
                (false, true) => score.only_second += 1,
                (false, false) => {}
            }
        }
        Some(score)
    }

    /// Intersection over union, 0 to 1; 1 for two empty masks.
    pub fn iou(self) -> f64 {
        ratio(self.both, self.both + self.only_first + self.only_second)
    }

    /// Dice coefficient, 0 to 1; 1 for two empty masks.
    pub fn dice(self) -> f64 {
        ratio(2 * self.both, 2 * self.both + self.only_first + self.only_second)
    }
}

fn ratio(part: usize, whole: usize) -> f64 {
    if whole == 0 { 1.0 } else { part as f64 / whole as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::grid::Grid;

    #[test]
    fn overlap_of_known_masks() {
        let left = Grid::from_fn(4, 2, |x, _| x < 2);
        let middle = Grid::from_fn(4, 2, |x, _| x == 1 || x == 2);
        let score = MaskScore::of(&left, &middle).unwrap();
        assert_eq!(score, MaskScore { both: 2, only_first: 2, only_second: 2 });
        assert!((score.iou() - 1.0 / 3.0).abs() < 1e-12 && (score.dice() - 0.5).abs() < 1e-12);
        let empty = Grid::filled(4, 2, false);
        assert_eq!(MaskScore::of(&empty, &empty).unwrap().iou(), 1.0);
        assert_eq!(MaskScore::of(&empty, &left).unwrap().dice(), 0.0);
        assert_eq!(MaskScore::of(&left, &Grid::filled(2, 4, false)), None);
    }
}
