//! [`Share`]: so many of so many, with its interval.

use serde::Serialize;

/// Normal quantile of a two-sided 95 % interval.
const Z: f64 = 1.959_963_985;

/// So many of so many, with the 95 % interval of Wilson's score, which holds for small counts and at none and all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// Number that succeeded.
    pub hits: usize,
    /// Number in all.
    pub of: usize,
    /// Lower and upper end of the interval of the share, 0..1; 0 and 1 where nothing was tried.
    pub interval: [f64; 2],
}

impl Share {
    /// The share of `hits` among `of`; hits beyond that count as all.
    pub fn new(hits: usize, of: usize) -> Self {
        let hits = hits.min(of);
        let n = of as f64;
        let interval = if of == 0 {
            [0.0, 1.0]
        } else {
            let p = hits as f64 / n;
            let middle = p + Z * Z / (2.0 * n);
            let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
            let scale = 1.0 + Z * Z / n;
            // Rounding must not put an end beyond the share itself.
            [((middle - half) / scale).clamp(0.0, p), ((middle + half) / scale).clamp(p, 1.0)]
        };
        Self { hits, of, interval }
    }

    /// The share of the true ones.
    pub fn count(successes: impl IntoIterator<Item = bool>) -> Self {
        let (hits, of) = successes.into_iter().fold((0, 0), |(hits, of), one| (hits + usize::from(one), of + 1));
        Self::new(hits, of)
    }
}

impl std::fmt::Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, high] = self.interval.map(|end| 100.0 * end);
        write!(f, "{}/{} ({low:.0}-{high:.0} %)", self.hits, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_interval_is_wilsons() {
        // Newcombe 1998, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29, score method without correction.
        for (hits, of, low, high) in
            [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)]
        {
            let [a, b] = Share::new(hits, of).interval;
            assert!((a - low).abs() < 6e-5 && (b - high).abs() < 6e-5, "{hits} of {of}: {a} {b}");
        }
        assert_eq!(Share::new(0, 0).interval, [0.0, 1.0]);
        assert_eq!(Share::count([true, false, true]), Share::new(2, 3));
        assert_eq!(Share::new(18, 30).to_string(), "18/30 (42-75 %)");
    }

    proptest! {
        #[test]
        fn the_interval_holds_the_share_and_shrinks_with_more_trials(of in 1usize..500, part in 0.0f64..=1.0) {
            let hits = (part * of as f64) as usize;
            let ([low, high], share) = (Share::new(hits, of).interval, hits as f64 / of as f64);
            prop_assert!(0.0 <= low && low <= share && share <= high && high <= 1.0);
            let [a, b] = Share::new(hits * 4, of * 4).interval;
            prop_assert!(b - a < high - low);
        }
    }
}
