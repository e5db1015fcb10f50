//! Training on a tiny network: the loss falls, a stop costs nothing, what does not count changes nothing.

use super::*;
use crate::Descent as _;
use crate::fixture::{self, run};
use crate::nets::mask::layout;

const SIZE: [usize; 2] = [22, 18];

fn start() -> MaskStart {
    MaskStart { file: fixture::file(&layout(4), 3), size: SIZE, range_m: [-0.01, 0.02], cast: Cast::Saturate }
}

/// Disks and rectangles, pressed in by a centimeter.
fn touches(count: usize) -> Vec<MaskTouch> {
    let mut random = fixture::random(8);
    let mut make = |i: usize| {
        let center = [6.0 + 9.0 * random.uniform(), 5.0 + 7.0 * random.uniform()];
        let inside = |k: usize| {
            let [x, y] = [(k % SIZE[0]) as f64 - center[0], (k / SIZE[0]) as f64 - center[1]];
            if i.is_multiple_of(2) { x.hypot(y) < 4.5 } else { x.abs() < 5.0 && y.abs() < 3.0 }
        };
        let contact: Vec<bool> = (0..SIZE[0] * SIZE[1]).map(inside).collect();
        let imprint_m = contact.iter().map(|&c| if c { 0.01 } else { 0.001 } + 2e-4 * random.normal() as f32).collect();
        MaskTouch { imprint_m, contact, counted: None, predicted: i.is_multiple_of(3) }
    };
    (0..count).map(&mut make).collect()
}

fn config() -> MaskConfig {
    let sensors = Sensors { shift_px: 2, ..Sensors::default() };
    MaskConfig { steps: 160, batch: 4, rate: 1e-2, threads: Some(2), sensors, ..MaskConfig::default() }
}

fn iou(tuner: &MaskTuner, of_start: bool) -> f64 {
    let held = touches(12).split_off(8);
    let imprints: Vec<&[f32]> = held.iter().map(|touch| touch.imprint_m.as_slice()).collect();
    let said = if of_start { tuner.probabilities_at_start(&imprints) } else { tuner.probabilities(&imprints) }.unwrap();
    let (mut both, mut either) = (0, 0);
    for (said, touch) in said.iter().zip(&held) {
        for (&p, &contact) in said.iter().zip(&touch.contact) {
            both += usize::from(p >= 0.5 && contact);
            either += usize::from(p >= 0.5 || contact);
        }
    }
    both as f64 / either as f64
}

#[test]
fn the_loss_falls_and_unseen_touches_are_told_better() {
    let (tuner, losses) = run(MaskTuner::new(&start(), touches(8), config(), None).unwrap());
    let mean = |losses: &[f32]| losses.iter().sum::<f32>() / losses.len() as f32;
    assert!(mean(&losses[150..]) < 0.6 * mean(&losses[..5]), "{losses:?}");
    let (before, after) = (iou(&tuner, true), iou(&tuner, false));
    assert!(after > 0.8 && after > before + 0.2, "{before} {after}");
    assert_eq!(tuner.tuned().len(), start().file.len());
    // The file holds what was learned.
    let again = MaskTuner::new(&MaskStart { file: tuner.tuned(), ..start() }, touches(8), config(), None).unwrap();
    assert!((iou(&again, true) - after).abs() < 1e-9);
}

#[test]
fn a_run_that_is_stopped_goes_on_to_the_same_last_bit_on_any_number_of_threads() {
    let config = |threads| MaskConfig { steps: 7, threads: Some(threads), ..config() };
    let (whole, _) = run(MaskTuner::new(&start(), touches(5), config(1), None).unwrap());
    for (stop, threads) in [(1, 2), (6, 4)] {
        let mut first = MaskTuner::new(&start(), touches(5), config(2), None).unwrap();
        (0..stop).for_each(|_| assert!(first.step().is_ok()));
        let (bytes, _) = (first.to_bytes(), first);
        let resumed = MaskTuner::new(&start(), touches(5), config(threads), Some(&bytes)).unwrap();
        assert_eq!(resumed.steps_done(), stop);
        let (resumed, _) = run(resumed);
        assert!(resumed.to_bytes() == whole.to_bytes() && resumed.tuned() == whole.tuned());
        let other = MaskTuner::new(&start(), touches(4), config(1), Some(&bytes));
        assert!(matches!(other, Err(Error::State(_))));
    }
}

#[test]
fn what_does_not_count_changes_nothing() {
    let config = MaskConfig { steps: 3, ..config() };
    let plain: Vec<MaskTouch> = touches(4)
        .into_iter()
        .map(|touch| MaskTouch { counted: Some((0..SIZE[0] * SIZE[1]).map(|i| i % 5 != 2).collect()), ..touch })
        .collect();
    let mut wrong = plain.clone();
    for touch in &mut wrong {
        touch.contact.iter_mut().skip(2).step_by(5).for_each(|contact| *contact = !*contact);
    }
    let tuned = |touches| run(MaskTuner::new(&start(), touches, config.clone(), None).unwrap()).0.tuned();
    assert!(tuned(plain.clone()) == tuned(wrong));
    assert!(tuned(plain) != tuned(touches(4)));
}

#[test]
fn what_cannot_be_learned_from_is_refused_and_says_why() {
    let new = |touches, config| MaskTuner::new(&start(), touches, config, None).map(drop);
    assert_eq!(new(Vec::new(), config()), Err(Error::NoPairs));
    let none = MaskTouch { counted: Some(vec![false; SIZE[0] * SIZE[1]]), ..touches(1).remove(0) };
    assert_eq!(new(vec![none], config()), Err(Error::NoPairs));
    let mut short = touches(2);
    short[1].contact.pop();
    let Err(Error::Mask { index: 1, why }) = new(short, config()) else { panic!() };
    assert_eq!(why, "its mask has 395 values instead of 396");
    let mut blank = touches(1);
    blank[0].imprint_m.fill(f32::NAN);
    assert!(matches!(new(blank, config()), Err(Error::Mask { index: 0, .. })));
    assert!(matches!(new(touches(1), MaskConfig { steps: 0, ..config() }), Err(Error::Start { .. })));
    let other = MaskStart { file: fixture::start().decoder, ..start() };
    assert!(matches!(MaskTuner::new(&other, touches(1), config(), None), Err(Error::Missing { .. })));
    let falling = MaskStart { range_m: [0.02, -0.01], ..start() };
    assert!(matches!(MaskTuner::new(&falling, touches(1), config(), None), Err(Error::Start { .. })));
}

#[test]
fn meters_reach_the_network_as_the_bundle_says() {
    let near = |cast: Cast, expected: [f32; 3]| {
        let start = MaskStart { range_m: [-0.0116, 0.0225], cast, ..start() };
        for (meters, expected) in [0.026, 0.0, -0.013].into_iter().zip(expected) {
            assert!((start.scaled(meters) * 255.0 - expected).abs() < 1e-3);
        }
    };
    near(Cast::Saturate, [255.0, 86.0, 0.0]);
    near(Cast::Wrap, [25.0, 86.0, 246.0]);
    near(Cast::None, [255.0, 86.744_87, 0.0]);
}
