//! E20, E21 and E23: the shift, the statistics behind it, and depth in eight bits.

use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use touch2touch_core::contact::{ByteCast, LAB_IMPRINT_MAX_M, LAB_IMPRINT_MIN_M, lab_unet_input};
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::moments::Moments;
use touch2touch_core::postprocess::{
    DepthChain, DepthRange, FlagKind, Mapping, RawPrediction, Reduction, RefitShift, Shift, ShiftFit, ShiftMode,
    ShiftStats, Stats, flags,
};
use touch2touch_core::resample::Resampling;

fn chain() -> DepthChain {
    DepthChain {
        range: DepthRange { min_m: -0.0116, max_m: 0.0225 },
        mapping: Mapping::Doubled,
        reduction: Reduction::Mean,
        shift: Shift::None,
        correction: None,
        size: [32, 24],
        resampling: Resampling::Bilinear,
        rotation_deg: 0,
        window: None,
        offset: [0.0; 2],
    }
}

#[test]
fn e20_a_deviation_of_zero_is_not_divided_by() {
    // In f32 the deviation of a constant 0.09 comes out as 7e-9 or so, which a test for zero misses.
    let constant = RawPrediction { channels: vec![Grid::filled(32, 24, 0.09f32); 3] };
    let truth = Grid::from_fn(32, 24, |x, _| 0.0005 * x as f32);
    let mut fit = ShiftFit::default();
    fit.add(&chain(), &constant, &truth).unwrap();
    let own = fit.stats().unwrap();
    for pred_std in [own.pred_std, 0.0, 7e-9, -1.0, f64::NAN] {
        let stats = ShiftStats { pred_std, ..own };
        for mode in [ShiftMode::PaperShift, ShiftMode::Refit(RefitShift::new(stats, "b"))] {
            let chain = chain().with_mode(mode, Some(stats)).unwrap();
            let found = flags(&chain, &constant, Some(&truth)).unwrap();
            // Only the mean is moved: it is the truth's, and nobody is at the end of the range.
            let moved = Stats::of(&chain.run(&constant).unwrap());
            assert!((moved.mean - own.gt_mean).abs() < 1e-7 && moved.std < 1e-7, "{pred_std}: {moved:?}");
            assert!(found.iter().any(|f| f.kind == FlagKind::NoSpread), "{pred_std}: {found:?}");
        }
    }
    // Relative: the same picture in nanometers is judged the same.
    let tiny = ShiftStats { pred_mean: 0.0126e-6, pred_std: 0.0015e-6, gt_mean: 0.0, gt_std: 1.0 };
    assert!(!tiny.has_no_spread(0.0225e-6) && tiny.has_no_spread(0.0225));
}

#[test]
fn e21_deviations_survive_any_mean_and_any_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for mean in [0.0, 0.004, 0.09, 1.0, 10.0, 1e3, 1e6] {
        let spread: Vec<f64> = (0..5000).map(|_| 0.0042 * (rng.random::<f64>() + rng.random::<f64>() - 1.0)).collect();
        let mut values: Vec<f64> = spread.iter().map(|s| mean + s).collect();
        // The truth about the numbers as they are stored: about their first, which subtracts without rounding.
        let about = values[0];
        let n = values.len() as f64;
        let shift = values.iter().map(|v| v - about).sum::<f64>() / n;
        let truth = (values.iter().map(|v| (v - about - shift).powi(2)).sum::<f64>() / n).sqrt();
        for _ in 0..4 {
            values.shuffle(&mut rng);
            let m: Moments = values.iter().copied().collect();
            let (found, s) = (m.mean().unwrap(), m.std().unwrap());
            assert!((found - about - shift).abs() <= 1e-12 * mean.max(1.0), "mean {mean}: {found}");
            assert!((s / truth - 1.0).abs() <= 1e-9, "mean {mean}: {s} for {truth}");
        }
    }
}

#[test]
fn e21_a_pass_over_images_hardly_depends_on_its_order() {
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    let mut touches: Vec<(RawPrediction, DepthMap)> = (0..12)
        .map(|_| {
            let channels = (0..3).map(|_| Grid::from_fn(16, 16, |_, _| rng.random_range(-1.2f32..1.2))).collect();
            (RawPrediction { channels }, Grid::from_fn(32, 24, |_, _| rng.random_range(-0.002f32..0.02)))
        })
        .collect();
    touches[3].1[(0, 0)] = f32::NAN;
    let mut first = None;
    for _ in 0..4 {
        touches.shuffle(&mut rng);
        let mut fit = ShiftFit::default();
        touches.iter().for_each(|(raw, truth)| fit.add(&chain(), raw, truth).unwrap());
        let s = fit.stats().unwrap();
        let figures = [s.pred_mean, s.pred_std, s.gt_mean, s.gt_std];
        for (now, then) in figures.into_iter().zip(*first.get_or_insert(figures)) {
            assert!((now - then).abs() <= 1e-13 * then.abs().max(1e-3), "{now} {then}");
        }
        assert_eq!((fit.touches, fit.measured.invalid()), (12, 1));
    }
}

#[test]
fn e23_eight_bits_lose_half_a_step_and_count_what_does_not_fit() {
    let (min, max) = (f64::from(LAB_IMPRINT_MIN_M), f64::from(LAB_IMPRINT_MAX_M));
    let step = (max - min) / 255.0;
    assert!((step - 134e-6).abs() < 1e-6);
    let ramp = Grid::from_fn(2000, 1, |x, _| (min + (max - min) * x as f64 / 2000.0) as f32);
    for cast in [ByteCast::Saturate, ByteCast::Wrap] {
        let bytes = lab_unet_input(&ramp, cast);
        assert_eq!((bytes.out_of_range, bytes.not_finite), (0, 0));
        let levels: Vec<f64> = bytes.image.as_slice().iter().map(|v| (f64::from(*v) * 255.0).round()).collect();
        assert!(levels.windows(2).all(|w| w[0] <= w[1]), "a ramp stays one");
        // Truncated: the middle of a step is half a step above its level.
        for (level, depth) in levels.iter().zip(ramp.as_slice()) {
            let back = min + (level + 0.5) * step;
            assert!((back - f64::from(*depth)).abs() <= step / 2.0 + 1e-8, "{depth}: {back}");
        }
    }
    let outside = Grid::from_vec(4, 1, vec![-0.013, 0.030, f32::NAN, 0.0]).unwrap();
    let levels = |cast| {
        let found = lab_unet_input(&outside, cast);
        assert_eq!((found.out_of_range, found.not_finite), (2, 1));
        found.image.map(|v| (v * 255.0).round() as i32).into_vec()
    };
    assert_eq!(levels(ByteCast::Wrap)[..2], [246, 55], "as the lab's cast wraps");
    assert_eq!(levels(ByteCast::Saturate)[..2], [0, 255]);
}
