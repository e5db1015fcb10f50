//! Sums of f64 numbers and of their squares without rounding.

/// Bits per digit.
const DIGIT: usize = 32;
const MASK: i64 = 0xffff_ffff;
/// Additions after which the carries are worked off: each adds less than 2^33 to a digit of 63 bits.
const MOST_PENDING: u32 = 1 << 28;
/// Exponent of the lowest bit of an f64.
const LOWEST: i32 = -1074;
/// Digits of a sum of numbers: 2098 bits for the values, 64 for their count, 32 for the sign.
const NUMBER_DIGITS: usize = 2098 / DIGIT + 4;
/// Digits of a sum of products of two numbers.
const PRODUCT_DIGITS: usize = 2 * 2098 / DIGIT + 4;

/// A sum as a two's complement integer of 32-bit digits with room for carries; the lowest bit is worth `2^lowest`.
#[derive(Clone, Debug)]
pub(super) struct Exact {
    digits: Vec<i64>,
    lowest: i32,
    pending: u32,
}

/// A finite number as sign, whole mantissa and the position of its lowest bit above [`LOWEST`].
fn parts(value: f64) -> (bool, u64, usize) {
    let bits = value.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as usize;
    let fraction = bits & ((1 << 52) - 1);
    match exponent {
        0 => (value.is_sign_negative(), fraction, 0),
        e => (value.is_sign_negative(), fraction | 1 << 52, e - 1),
    }
}

impl Exact {
    pub(super) fn of_numbers() -> Self {
        Self { digits: vec![0; NUMBER_DIGITS], lowest: LOWEST, pending: 0 }
    }

    pub(super) fn of_products() -> Self {
        Self { digits: vec![0; PRODUCT_DIGITS], lowest: 2 * LOWEST, pending: 0 }
    }

    /// Adds a finite number.
    pub(super) fn add(&mut self, value: f64) {
        let (negative, mantissa, at) = parts(value);
        self.add_bits(u128::from(mantissa), at, negative);
    }

    /// Adds the square of a finite number.
    pub(super) fn add_square(&mut self, value: f64) {
        let (_, mantissa, at) = parts(value);
        self.add_bits(u128::from(mantissa) * u128::from(mantissa), 2 * at, false);
    }

    fn add_bits(&mut self, mut mantissa: u128, at: usize, negative: bool) {
        if self.pending == MOST_PENDING {
            self.carry();
        }
        self.pending += 1;
        let shift = at % DIGIT;
        let mut digit = at / DIGIT;
        while mantissa > 0 {
            let part = ((mantissa & MASK as u128) as u64) << shift;
            let (low, high) = (part as i64 & MASK, (part >> DIGIT) as i64);
            if negative {
                self.digits[digit] -= low;
                self.digits[digit + 1] -= high;
            } else {
                self.digits[digit] += low;
                self.digits[digit + 1] += high;
            }
            mantissa >>= DIGIT;
            digit += 1;
        }
    }

    /// Works the carries off: all digits but the last are then within 32 bits, and equal sums have equal digits.
    fn carry(&mut self) {
        let mut carry = 0;
        let last = self.digits.len() - 1;
        for digit in &mut self.digits[..last] {
            let value = *digit + carry;
            *digit = value & MASK;
            carry = value >> DIGIT;
        }
        self.digits[last] += carry;
        self.pending = 0;
    }

    /// Adds another sum of the same kind.
    pub(super) fn merge(&mut self, other: &Self) {
        let mut other = other.clone();
        other.carry();
        self.carry();
        for (a, b) in self.digits.iter_mut().zip(&other.digits) {
            *a += b;
        }
        self.carry();
    }

    /// Whether it is negative, and its size.
    fn magnitude(&self) -> (bool, Vec<u32>) {
        let mut sum = self.clone();
        sum.carry();
        let negative = sum.digits.last().is_some_and(|d| *d < 0);
        if negative {
            sum.digits.iter_mut().for_each(|d| *d = -*d);
            sum.carry();
        }
        (negative, sum.digits.iter().map(|d| *d as u32).collect())
    }

    /// The sum, rounded to the nearest f64.
    pub(super) fn value(&self) -> f64 {
        let (negative, size) = self.magnitude();
        let value = rounded(&size, self.lowest);
        if negative { -value } else { value }
    }
}

/// `count · Σx² - (Σx)²`, rounded once: the population variance times the square of the count.
pub(super) fn spread(sum: &Exact, squares: &Exact, count: u64) -> f64 {
    let (_, sum) = sum.magnitude();
    let (_, squares) = squares.magnitude();
    let mut left = product(&squares, &[count as u32, (count >> DIGIT) as u32]);
    let right = product(&sum, &sum);
    // Never negative (Cauchy and Schwarz), so the borrow ends within the digits.
    let mut borrow = 0i64;
    for (i, digit) in left.iter_mut().enumerate() {
        let value = i64::from(*digit) - i64::from(right.get(i).copied().unwrap_or(0)) + borrow;
        *digit = value as u32;
        borrow = value >> DIGIT;
    }
    rounded(&left, 2 * LOWEST)
}

/// Schoolbook product of two whole numbers.
fn product(a: &[u32], b: &[u32]) -> Vec<u32> {
    let mut out = vec![0u32; a.len() + b.len()];
    for (i, &x) in a.iter().enumerate().filter(|(_, x)| **x > 0) {
        let mut carry = 0u64;
        for (j, &y) in b.iter().enumerate() {
            let value = u64::from(x) * u64::from(y) + u64::from(out[i + j]) + carry;
            out[i + j] = value as u32;
            carry = value >> DIGIT;
        }
        out[i + b.len()] = carry as u32;
    }
    out
}

/// A whole number times `2^lowest` as the nearest f64.
fn rounded(size: &[u32], lowest: i32) -> f64 {
    let Some(top) = size.iter().rposition(|d| *d > 0) else { return 0.0 };
    // The 64 bits from the highest set bit down; what is below only tells a tie from none.
    let bits = DIGIT * (top + 1) - size[top].leading_zeros() as usize;
    let from = bits.saturating_sub(64);
    let digit = |i: usize| size.get(i).copied().unwrap_or(0);
    let window = (0..3).fold(0u128, |w, k| w | u128::from(digit(from / DIGIT + k)) << (DIGIT * k)) >> (from % DIGIT);
    let below = size[..from / DIGIT].iter().any(|d| *d > 0) || digit(from / DIGIT) & ((1u32 << (from % DIGIT)) - 1) > 0;
    let head = window as u64 | u64::from(below);
    // In steps, so that no power of two leaves the range before the number does.
    let mut value = head as f64;
    let mut exponent = lowest + from as i32;
    while exponent != 0 {
        let step = exponent.clamp(-1000, 1000);
        value *= f64::from_bits(((step + 1023) as u64) << 52);
        exponent -= step;
    }
    value
}
