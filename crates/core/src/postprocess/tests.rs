use super::*;

const MIN: f64 = -0.0116;
const MAX: f64 = 0.0225;

fn chain() -> DepthChain {
    DepthChain {
        range: DepthRange { min_m: MIN, max_m: MAX },
        reduction: Reduction::Mean,
        shift: Shift::ExactInverse,
        correction: None,
        size: [6, 4],
        resampling: Resampling::Bilinear,
        rotation_deg: 0,
        window: None,
        offset: [0.0; 2],
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
    let raw = chain().with_mode(ShiftMode::Raw, None).unwrap();
    let (meters, raw) = (raw.meters(&picture()).unwrap(), raw.run(&picture()).unwrap());
    assert_eq!(meters, raw, "neither shifted nor resized");
    let inverse = chain().with_mode(ShiftMode::ExactInverse, None).unwrap().run(&picture()).unwrap();
    for ((&d, &r), &i) in correct.as_slice().iter().zip(raw.as_slice()).zip(inverse.as_slice()) {
        // f32 meters: half a micrometer would be 5e-7.
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
fn luma_weighs_the_channels_as_the_released_code() {
    let channels = [1.0, -1.0, -1.0].map(|v| Grid::filled(2, 2, v)).to_vec();
    let chain = DepthChain { reduction: Reduction::Luma, size: [2, 2], ..chain() };
    let depth = chain.run(&RawPrediction { channels }).unwrap();
    // The weights add up to 0.9999, and the range is mapped twice before the inverse takes the maximum off.
    assert!((f64::from(depth[(0, 0)]) - (0.2988 * MAX + 0.701 * MIN)).abs() < 1e-8);
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
fn a_picture_is_moved_in_the_raw_orientation_whichever_way_it_is_turned() {
    for rotation_deg in [0, 180] {
        let still = DepthChain { rotation_deg, ..chain() };
        assert_eq!(still.clone().placed(Some([0.4, 0.1])), still, "no window, nothing to move");
        // One pixel of six to the right, one of four up.
        let moving = DepthChain { window: Some([0.5, 0.5]), ..still.clone() }.placed(Some([0.5 + 1.0 / 6.0, 0.25]));
        let [still, moving] = [still, moving].map(|chain| chain.run(&picture()).unwrap());
        for y in 0..4 {
            for x in 0..6usize {
                assert_eq!(moving[(x, y)], still[(x.saturating_sub(1), (y + 1).min(3))], "{rotation_deg} {x} {y}");
            }
        }
    }
}

#[test]
fn malformed_pictures_and_ranges_are_errors() {
    let empty = RawPrediction { channels: vec![] };
    assert_eq!(chain().run(&empty), Err(PostprocessError::Malformed));
    let mixed = RawPrediction { channels: vec![Grid::filled(2, 2, 0.0), Grid::filled(3, 2, 0.0)] };
    assert_eq!(chain().run(&mixed), Err(PostprocessError::Malformed));
    let flat = DepthChain { range: DepthRange { min_m: 0.1, max_m: 0.1 }, ..chain() };
    assert!(matches!(flat.run(&picture()), Err(PostprocessError::Range(..))));
    let holes = RawPrediction { channels: vec![Grid::filled(6, 4, f32::NAN)] };
    assert!(chain().run(&holes).unwrap().as_slice().iter().all(|v| v.is_nan()));
    assert_eq!(Stats::of(&Grid::filled(2, 2, f32::NAN)).count, 0);
}

/// A bar on a background, as a decoder means it.
fn imprint() -> Grid<f32> {
    Grid::from_fn(60, 48, |x, y| {
        let bar = (10..30).contains(&x) && y < 40;
        1e-5 * ((x * 7 + y * 3) % 11) as f32 + if bar { 0.008 + 1e-4 * x as f32 } else { 0.0 }
    })
}

/// The decoder's picture of a depth, `n` channels.
fn decoded(depth: &Grid<f32>, n: usize) -> RawPrediction {
    let unit = depth.map(|&d| (2.0 * (f64::from(d) - MIN) / (MAX - MIN) - 1.0) as f32);
    RawPrediction { channels: vec![unit; n] }
}

fn whole(mode: ShiftMode) -> DepthChain {
    DepthChain { size: [60, 48], ..chain() }.with_mode(mode, Some(stats())).unwrap()
}

fn kinds(flags: &[Flag]) -> Vec<FlagKind> {
    flags.iter().map(|f| f.kind).collect()
}

#[test]
fn the_doubled_mapping_is_flagged_with_and_without_a_truth() {
    let raw = decoded(&imprint(), 3);
    let alone = flags(&whole(ShiftMode::Raw), &raw, None).unwrap();
    assert_eq!(kinds(&alone), [FlagKind::DoubledMapping]);
    assert!(alone[0].action.contains("exact inverse"), "{alone:?}");
    assert_eq!(flags(&whole(ShiftMode::Raw), &raw, Some(&imprint())).unwrap(), alone);
    // A decoder that ends in 0 to 1 looks the same, but its cure is another.
    let unit = RawPrediction { channels: vec![raw.channels[0].map(|v| (v + 1.0) / 2.0)] };
    let mapped = flags(&DepthChain { size: [60, 48], ..chain() }, &unit, None).unwrap();
    assert_eq!(kinds(&mapped), [FlagKind::DoubledMapping]);
    assert!(mapped[0].action.contains("output range"));
}

#[test]
fn a_turn_too_many_and_a_mirror_image_are_told_apart() {
    let truth = imprint();
    for (raw, expected) in [
        (decoded(&truth.rotated_180(), 1), FlagKind::TurnedBy180),
        (decoded(&truth.rows_reversed(), 1), FlagKind::Mirrored),
    ] {
        let found = flags(&whole(ShiftMode::ExactInverse), &raw, Some(&truth)).unwrap();
        assert_eq!((found[0].kind, found[0].severity), (expected, Severity::Wrong), "{found:?}");
        assert!(found[0].what.contains("with the truth"));
    }
    let other = Grid::from_fn(60, 48, |x, y| if (x / 3 + y / 3) % 2 == 0 { 0.004f32 } else { 0.0 });
    let unlike = flags(&whole(ShiftMode::ExactInverse), &decoded(&other, 1), Some(&truth)).unwrap();
    assert_eq!(kinds(&unlike), [FlagKind::Unlike]);
}

#[test]
fn holes_constants_clamps_and_disagreeing_channels_are_flagged() {
    let exact = whole(ShiftMode::ExactInverse);
    let of = |raw: &RawPrediction| kinds(&flags(&exact, raw, Some(&imprint())).unwrap());
    let mut raw = decoded(&imprint(), 3);
    raw.channels[1].as_mut_slice()[7] = f32::NAN;
    raw.channels[2].as_mut_slice()[9] = f32::INFINITY;
    assert!(of(&raw).starts_with(&[FlagKind::NotFinite]));
    let nothing = RawPrediction { channels: vec![Grid::filled(60, 48, f32::NAN); 3] };
    assert_eq!(of(&nothing), [FlagKind::NotFinite]);
    let flat = RawPrediction { channels: vec![Grid::filled(60, 48, -0.3); 3] };
    assert!(of(&flat).contains(&FlagKind::Constant));
    let mut raw = decoded(&imprint(), 1);
    raw.channels[0].as_mut_slice()[..600].fill(1.5);
    let clamped = flags(&exact, &raw, None).unwrap();
    assert_eq!((clamped[0].kind, clamped[0].severity), (FlagKind::Clamped, Severity::Caution));
    assert!(clamped[0].what.starts_with("600 of 2880"), "{}", clamped[0].what);
    let mut raw = decoded(&imprint(), 3);
    raw.channels[1] = raw.channels[1].map(|v| v + 0.2);
    assert!(of(&raw).contains(&FlagKind::ChannelsApart));
}

#[test]
fn a_refit_brings_mean_and_deviation_of_its_dataset() {
    let raw_chain = whole(ShiftMode::Raw);
    let pairs: Vec<(RawPrediction, Grid<f32>)> = (0..6)
        .map(|k| {
            let depth = imprint().map(|d| d * (1.0 + 0.1 * k as f32));
            (decoded(&depth.map(|d| 0.7 * d - 0.001), 3), depth)
        })
        .collect();
    let mut fit = ShiftFit::default();
    for (raw, truth) in &pairs {
        fit.add(&raw_chain, raw, truth).unwrap();
    }
    let stats = fit.stats().unwrap();
    assert_eq!((fit.touches, fit.measured.count()), (6, 6 * 60 * 48));
    let refit = ShiftMode::Refit(RefitShift::new(stats, "0123456789abcdef0123"));
    let mut after = ShiftFit::default();
    for (raw, truth) in &pairs {
        let depth = whole(refit).run(raw).unwrap();
        after.predicted.extend(depth.as_slice().iter().map(|&v| f64::from(v)));
        after.measured.extend(truth.as_slice().iter().map(|&v| f64::from(v)));
    }
    let after = after.stats().unwrap();
    assert!((after.pred_mean - after.gt_mean).abs() < 1e-8 && (after.pred_std - after.gt_std).abs() < 1e-8);
    assert_eq!(ShiftFit::default().stats(), None);
}

#[test]
fn statistics_serve_only_the_bundle_they_are_of() {
    let refit = RefitShift::new(stats(), "0123456789abcdef0123456789abcdef");
    assert_eq!(refit.check("0123456789abcdef0123456789abcdef"), Ok(()));
    let err = refit.check("fedcba9876543210").unwrap_err();
    assert!(err.contains("0123456789abcdef") && err.contains("fedcba9876543210"), "{err}");
    let text = serde_json::to_string(&ShiftMode::Refit(refit)).unwrap();
    assert_eq!(serde_json::from_str::<ShiftMode>(&text).unwrap(), ShiftMode::Refit(refit));
    assert_eq!(refit.stats(), stats());
    use strum::IntoEnumIterator as _;
    let without_data = [ShiftMode::Raw, ShiftMode::PaperShift, ShiftMode::ExactInverse];
    assert_eq!(ShiftMode::iter().collect::<Vec<_>>(), without_data, "a refit needs a data set");
}
