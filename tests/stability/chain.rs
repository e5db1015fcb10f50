//! E20 and E21: the shift, and the statistics behind it.

use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use touch2touch_core::grid::Grid;
use touch2touch_core::moments::Moments;
use touch2touch_core::postprocess::{
    DepthChain, DepthRange, FlagKind, RawPrediction, Reduction, RefitShift, Shift, ShiftFit, ShiftMode, ShiftStats,
    Stats, flags,
};
use touch2touch_core::resample::Resampling;

fn chain() -> DepthChain {
    DepthChain {
        range: DepthRange { min_m: -0.0116, max_m: 0.0225 },
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
