//! [`Pair`]: a picture of a touch and the imprint measured of it.

use crate::error::{Error, Result};

/// A picture of a touch and the imprint that was measured of the same touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Pair {
    /// The difference image: three planes of `side` × `side` values in the scale of the bundle's mean and standard
    /// deviation, which are not yet applied.
    pub picture: Vec<f32>,
    /// The imprint as the decoder draws it (its turn included), `side` × `side`, 0..1 over [`crate::Start::unit_m`].
    pub imprint: Vec<f32>,
    /// Pad that was touched; `None` for a simulated pair, whose imprint lies where the bundle expects it.
    pub frame: Option<usize>,
}

/// Beyond this a value of a difference image or an imprint is a mistake of scale.
const LARGEST: f32 = 1e4;

/// Refuses pairs that cannot be learned from, and sets without any.
pub(crate) fn check(pairs: &[Pair], side: usize, pads: usize) -> Result<()> {
    if pairs.is_empty() {
        return Err(Error::NoPairs);
    }
    for (index, pair) in pairs.iter().enumerate() {
        if let Some(why) = fault(pair, side, pads) {
            return Err(Error::Pair { index, why });
        }
    }
    Ok(())
}

fn fault(pair: &Pair, side: usize, pads: usize) -> Option<String> {
    let pixels = side * side;
    for (what, values, count) in [("picture", &pair.picture, 3 * pixels), ("imprint", &pair.imprint, pixels)] {
        if values.len() != count {
            return Some(format!("its {what} has {} values instead of {count}", values.len()));
        }
        let bad = values.iter().filter(|value| !value.is_finite()).count();
        if bad > 0 {
            return Some(format!("its {what} has {bad} values that are not numbers"));
        }
        if let Some(value) = values.iter().find(|value| value.abs() > LARGEST) {
            return Some(format!("its {what} has a value of {value}: the scale is wrong"));
        }
    }
    if pair.frame.is_some_and(|pad| pad >= pads) {
        return Some(format!("it is of pad {}, and there are {pads}", pair.frame.unwrap_or_default()));
    }
    None
}
