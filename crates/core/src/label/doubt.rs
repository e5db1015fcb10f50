//! Doubt about the mask of an imprint: how sure a mask model is of it, and how far one drawn by hand is from what it
//! says.

use serde::{Deserialize, Serialize};

use super::agreement::agreement;
use crate::grid::{Grid, Mask};

/// Probabilities of contact that say neither yes nor no: a quarter to three quarters.
pub(crate) const UNSURE: std::ops::RangeInclusive<f32> = 0.25..=0.75;

/// Reasons to look at the mask of a pair, of its finger with the most of each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Doubt {
    /// Share of the image's pixels whose probability of contact is in [`UNSURE`], 0..1; `None` without a mask model.
    pub unsure: Option<f64>,
    /// One minus the Dice of the mask drawn by hand and that of the mask model, 0..1; `None` where nobody drew one.
    pub disagreement: Option<f64>,
}

/// Share of the pixels of a map of contact's probability that are in [`UNSURE`], 0..1; `None` for an empty map.
pub fn unsure_share(probability: &Grid<f32>) -> Option<f64> {
    let unsure = probability.as_slice().iter().filter(|p| UNSURE.contains(*p)).count();
    let share = unsure as f64 / probability.len() as f64;
    share.is_finite().then_some(share)
}

impl Doubt {
    /// Of one finger: the model's probability of contact at any size, its mask of the imprint, and the one drawn by hand
    /// where there is one (of another size there is none).
    pub fn of(probability: &Grid<f32>, model: &Mask, hand: Option<&Mask>) -> Self {
        let disagreement = hand.and_then(|hand| agreement(hand, model)).map(|agreement| 1.0 - agreement.dice);
        Self { unsure: unsure_share(probability), disagreement }
    }

    /// The more of each.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let most = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::max);
        Self { unsure: most(self.unsure, other.unsure), disagreement: most(self.disagreement, other.disagreement) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doubt_counts_what_is_near_one_half_and_what_a_hand_drew_otherwise() {
        let probability = Grid::from_vec(2, 2, vec![0.1, 0.25, 0.6, f32::NAN]).unwrap();
        let model = Mask::from_fn(4, 4, |x, _| x < 2);
        let hand = Mask::from_fn(4, 4, |x, _| x < 1);
        let alone = Doubt::of(&probability, &model, None);
        assert_eq!(alone, Doubt { unsure: Some(0.5), disagreement: None });
        let drawn = Doubt::of(&probability, &model, Some(&hand));
        // 2 * 4 / (8 + 4).
        assert!((drawn.disagreement.unwrap() - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(Doubt::of(&probability, &model, Some(&model)).disagreement, Some(0.0));
        assert_eq!(Doubt::of(&probability, &model, Some(&Mask::filled(2, 2, true))).disagreement, None);
        let empty = Grid::from_vec(0, 0, Vec::new()).unwrap();
        assert_eq!(Doubt::of(&empty, &model, None).unsure, None);
        let both = alone.or(Doubt { unsure: Some(0.2), disagreement: Some(0.9) });
        assert_eq!(both, Doubt { unsure: Some(0.5), disagreement: Some(0.9) });
        assert_eq!(Doubt::default().or(Doubt::default()), Doubt::default());
    }
}
