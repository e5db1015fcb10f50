use super::*;
use proptest::prelude::*;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn bits(m: &Moments) -> [u64; 2] {
    [m.mean().unwrap(), m.std().unwrap()].map(f64::to_bits)
}

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
    // 0.09 is no binary fraction: sums that round give it a deviation of 7e-9.
    let m: Moments = std::iter::repeat_n(f64::from(0.09f32), 100_000).collect();
    assert_eq!((m.mean(), m.std()), (Some(f64::from(0.09f32)), Some(0.0)));
}

#[test]
fn what_cancels_is_not_lost() {
    let m: Moments = [1e300, 1.0, -1e300, 1e-300].into_iter().collect();
    assert_eq!(m.mean(), Some(0.25));
    let huge: Moments = [f64::MAX, f64::MAX].into_iter().collect();
    assert_eq!(huge.std(), Some(0.0));
    let tiny: Moments = [f64::from_bits(1), -f64::from_bits(1)].into_iter().collect();
    assert_eq!((tiny.mean(), tiny.count()), (Some(0.0), 2));
}

#[test]
fn what_is_no_number_is_counted_and_left_out() {
    let m: Moments = [f64::NAN, 1.0, f64::INFINITY, 3.0, f64::NEG_INFINITY].into_iter().collect();
    assert_eq!((m.mean(), m.std(), m.count(), m.invalid()), (Some(2.0), Some(1.0), 2, 3));
}

#[test]
fn carries_survive_many_additions() {
    // Every addition sets the digit's highest bits, and the sum is known.
    let mut m = Moments::default();
    let value = f64::from(u32::MAX);
    for _ in 0..300_000 {
        m.add(value);
        m.add(-value);
        m.add(value);
    }
    assert_eq!(m.mean(), Some(value / 3.0));
}

proptest! {
    #[test]
    fn any_order_and_any_split_give_the_same_bits(
        values in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO, 1..200),
        seed in any::<u64>(),
    ) {
        // Squares of the largest leave f64; scaled, the deviation is a number.
        let values: Vec<f64> = values.into_iter().map(|v| v * 1e-160).collect();
        let whole: Moments = values.iter().copied().collect();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut shuffled = values.clone();
        shuffled.shuffle(&mut rng);
        let mut parts: Vec<Moments> = (0..4).map(|_| Moments::default()).collect();
        for v in shuffled {
            parts[rng.random_range(0..4)].add(v);
        }
        parts.shuffle(&mut rng);
        let mut merged = Moments::default();
        for part in &parts {
            merged.merge(part);
        }
        prop_assert_eq!(bits(&merged), bits(&whole));
        prop_assert_eq!(merged.extremes(), whole.extremes());
    }

    #[test]
    fn figures_agree_with_two_passes(values in prop::collection::vec(-1e3f64..1e3, 2..100)) {
        let m: Moments = values.iter().copied().collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let std = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
        prop_assert!((m.mean().unwrap() - mean).abs() <= 1e-12 * mean.abs().max(1.0));
        prop_assert!((m.std().unwrap() - std).abs() <= 1e-9 * std.max(1e-3));
    }
}
