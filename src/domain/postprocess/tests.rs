use super::*;

const MIN: f64 = -0.0116;
const MAX: f64 = 0.0225;

fn chain() -> DepthChain {
    DepthChain {
        range: DepthRange { min_m: MIN, max_m: MAX },
        mapping: Mapping::Correct,
        reduction: Reduction::Mean,
        shift: Shift::None,
        size: [6, 4],
        resampling: Resampling::Bilinear,
        rotation_deg: 0,
    }
}

fn picture() -> RawPrediction {
    let channel = |c: usize| Grid::from_fn(6, 4, |x, y| ((x * 3 + y * 5 + c) % 7) as f32 / 3.5 - 0.9);
    RawPrediction { channels: (0..3).map(channel).collect() }
}

fn stats() -> ShiftStats {
    ShiftStats { pred_mean: 0.0126, pred_std: 0.0015, gt_mean: 0.0027, gt_std: 0.0033 }
}

#[test]
fn the_doubled_mapping_is_half_of_depth_plus_maximum_and_the_inverse_undoes_it() {
    let correct = chain().run(&picture()).unwrap();
    let raw = chain().with_mode(ShiftMode::Raw, None).unwrap().run(&picture()).unwrap();
    let inverse = chain().with_mode(ShiftMode::ExactInverse, None).unwrap().run(&picture()).unwrap();
    for ((&d, &r), &i) in correct.as_slice().iter().zip(raw.as_slice()).zip(inverse.as_slice()) {
        // f32 metres: half a micrometre would be 5e-7.
        assert!((f64::from(r) - (f64::from(d) + MAX) / 2.0).abs() < 1e-8);
        assert!((i - d).abs() < 1e-8);
        assert!(f64::from(r) >= (MIN + MAX) / 2.0, "the raw value can never be below the middle of the range");
    }
}

#[test]
fn the_papers_shift_is_an_affine_map() {
    let raw = chain().with_mode(ShiftMode::Raw, None).unwrap().run(&picture()).unwrap();
    let paper = chain().with_mode(ShiftMode::PaperShift, Some(stats())).unwrap().run(&picture()).unwrap();
    for (&r, &p) in raw.as_slice().iter().zip(paper.as_slice()) {
        assert!((f64::from(p) - (2.2 * f64::from(r) - 0.02502)).abs() < 1e-7);
    }
    assert_eq!(chain().with_mode(ShiftMode::PaperShift, None), Err(PostprocessError::NoStatistics));
}

#[test]
fn a_deviation_of_almost_zero_is_not_divided_by() {
    for pred_std in [0.0, 7e-9, f64::NAN, -1.0] {
        let stats = ShiftStats { pred_std, ..stats() };
        let (depth, ledger) =
            chain().with_mode(ShiftMode::PaperShift, Some(stats)).unwrap().run_with_ledger(&picture()).unwrap();
        assert!(depth.as_slice().iter().all(|v| v.is_finite() && v.abs() < 0.05));
        assert!(ledger.iter().any(|s| { s.note.as_deref().is_some_and(|n| n.contains("only the mean")) }));
    }
}

#[test]
fn luma_weighs_the_channels_as_the_released_code() {
    let channels = [1.0, -1.0, -1.0].map(|v| Grid::filled(2, 2, v)).to_vec();
    let chain = DepthChain { reduction: Reduction::Luma, size: [2, 2], ..chain() };
    let depth = chain.run(&RawPrediction { channels }).unwrap();
    assert!((f64::from(depth[(0, 0)]) - (0.2989 * MAX + 0.701 * MIN)).abs() < 1e-8);
    let two = RawPrediction { channels: vec![Grid::filled(2, 2, 0.0); 2] };
    assert_eq!(chain.run(&two), Err(PostprocessError::Channels(2)));
}

#[test]
fn the_last_step_turns_and_resizes() {
    let chain = DepthChain { rotation_deg: 180, size: [3, 2], ..chain() };
    let turned = chain.run(&picture()).unwrap();
    let straight = DepthChain { rotation_deg: 0, ..chain.clone() }.run(&picture()).unwrap();
    assert_eq!(turned.size(), [3, 2]);
    assert_eq!(turned, straight.rotated_180());
    assert_eq!(DepthChain { rotation_deg: 90, ..chain }.run(&picture()), Err(PostprocessError::Rotation(90)));
}

#[test]
fn the_ledger_tells_every_step_and_its_numbers() {
    let raw = RawPrediction { channels: vec![Grid::from_vec(2, 1, vec![-2.0, 1.0]).unwrap()] };
    let chain = DepthChain { size: [2, 1], ..chain() }.with_mode(ShiftMode::ExactInverse, None).unwrap();
    let (depth, ledger) = chain.run_with_ledger(&raw).unwrap();
    assert_eq!(ledger.iter().map(|s| s.name).collect::<Vec<_>>(), ["Decoder", "Metres", "Shift", "Raw orientation"]);
    assert_eq!((ledger[0].stats.min, ledger[0].stats.max, ledger[0].stats.count), (-2.0, 1.0, 2));
    assert!(ledger[1].note.as_deref().unwrap().starts_with("1 values outside"));
    assert!((ledger[3].stats.mean - (MIN + MAX) / 2.0).abs() < 1e-8);
    assert!((ledger[3].stats.std - (MAX - MIN) / 2.0).abs() < 1e-8);
    assert_eq!(ledger[3].image, depth);
}

#[test]
fn malformed_pictures_and_ranges_are_errors() {
    let empty = RawPrediction { channels: vec![] };
    assert_eq!(chain().run(&empty), Err(PostprocessError::Malformed));
    let mixed = RawPrediction { channels: vec![Grid::filled(2, 2, 0.0), Grid::filled(3, 2, 0.0)] };
    assert_eq!(chain().run(&mixed), Err(PostprocessError::Malformed));
    let flat = DepthChain { range: DepthRange { min_m: 0.1, max_m: 0.1 }, ..chain() };
    assert!(matches!(flat.run(&picture()), Err(PostprocessError::Range { .. })));
    let holes = RawPrediction { channels: vec![Grid::filled(6, 4, f32::NAN)] };
    assert!(chain().run(&holes).unwrap().as_slice().iter().all(|v| v.is_nan()));
    assert_eq!(Stats::of(&Grid::filled(2, 2, f32::NAN)).count, 0);
}

#[test]
fn statistics_survive_a_large_mean() {
    // A spread of 0.5 beside means up to 1e6, in f32 pixels that hold it exactly.
    for mean in [0.0f32, 10.0, 1000.0, 1e6] {
        let image = Grid::from_fn(100, 100, |x, _| mean + if x % 2 == 0 { 0.5 } else { -0.5 });
        let stats = Stats::of(&image);
        assert!((stats.std - 0.5).abs() < 1e-9 * 0.5, "{mean}: {}", stats.std);
    }
}
