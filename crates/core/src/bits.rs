//! [`Bits`]: a float as part of a key.

/// A float that compares and hashes by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Bits(u32);

impl From<f32> for Bits {
    fn from(value: f32) -> Self {
        Self(value.to_bits())
    }
}

impl Bits {
    /// The float.
    pub fn get(self) -> f32 {
        f32::from_bits(self.0)
    }
}
