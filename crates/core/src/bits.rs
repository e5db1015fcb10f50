//! [`Bits`] and [`Bits64`]: a float as part of a key.

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

/// As [`Bits`], of 64.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Bits64(u64);

impl From<f64> for Bits64 {
    fn from(value: f64) -> Self {
        // + 0.0 turns -0 into 0, which means the same.
        Self((value + 0.0).to_bits())
    }
}

impl Bits64 {
    /// The float.
    pub fn get(self) -> f64 {
        f64::from_bits(self.0)
    }
}
