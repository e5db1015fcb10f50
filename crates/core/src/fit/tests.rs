use super::*;
use crate::resample::moved;

const SIDE: usize = 64;

/// A touch somewhere: two bumps of some millimeters.
fn touch(seed: usize) -> DepthMap {
    let center = |k: usize| [(seed * 37 + k * 17) % 29 + 18, (seed * 23 + k * 41) % 27 + 19].map(|v| v as f64);
    let (a, b) = (center(0), center(1));
    Grid::from_fn(SIDE, SIDE, |x, y| {
        let bump = |c: [f64; 2], w: f64| (-((x as f64 - c[0]).powi(2) + (y as f64 - c[1]).powi(2)) / (w * w)).exp();
        (0.006 * bump(a, 7.0) + 0.004 * bump(b, 4.0)) as f32
    })
}

/// Picture that a rig makes of a touch: moved, on another scale, under a fixed pattern, half as strong at the left.
fn measured(touch: &DepthMap, offset_px: [f64; 2]) -> DepthMap {
    let there = moved(touch, offset_px);
    Grid::from_fn(SIDE, SIDE, |x, y| {
        let pattern = 0.0005 * ((x / 2 + y / 3) % 3) as f64;
        let gain = if x < SIDE / 2 { 0.5 } else { 1.0 };
        (1.5 * gain * f64::from(there[(x, y)]) + 0.001 + pattern) as f32
    })
}

fn rms(a: &DepthMap, b: &DepthMap) -> f64 {
    let squares = a.as_slice().iter().zip(b.as_slice()).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

/// Predictions and measurements of two pads with different offsets.
fn rig(n: usize) -> (Vec<DepthMap>, Vec<DepthMap>, Vec<usize>) {
    const OFFSETS: [[f64; 2]; 2] = [[-5.25, -3.0], [-1.0, -4.5]];
    let touches: Vec<DepthMap> = (0..n).map(touch).collect();
    let pads: Vec<usize> = (0..n).map(|i| i % 2).collect();
    let targets = touches.iter().zip(&pads).map(|(t, &pad)| measured(t, OFFSETS[pad])).collect();
    (touches, targets, pads)
}

fn cases<'a>((predictions, targets, pads): &'a (Vec<DepthMap>, Vec<DepthMap>, Vec<usize>)) -> Vec<FitPair<'a>> {
    let pairs = predictions.iter().zip(targets).zip(pads);
    pairs.map(|((prediction, target), &pad)| FitPair { prediction, target, pad }).collect()
}

#[test]
fn a_known_offset_field_and_gain_are_recovered_and_serve_unseen_touches() {
    let rig = rig(40);
    let corrections = closed_form(&cases(&rig), 3).unwrap();
    assert!(corrections[2].is_none(), "a pad without pairs");
    for (pad, expected) in [[-5.25, -3.0], [-1.0, -4.5]].into_iter().enumerate() {
        let fit = corrections[pad].as_ref().unwrap();
        let off = fit.offset_px.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // A half-strength side pulls the best correlation a little towards the other.
        assert!(off < 0.6, "pad {pad}: {:?}", fit.offset_px);
        assert!(fit.fits([SIDE, SIDE]));
        let ratio = f64::from(fit.gain[(18, 30)]) / f64::from(fit.gain[(46, 30)]);
        assert!((ratio - 0.5).abs() < 0.15, "pad {pad}: {ratio}");
    }
    let fit = corrections[0].as_ref().unwrap();
    let (mut before, mut after) = (0.0, 0.0);
    for seed in 100..110 {
        let truth = measured(&touch(seed), [-5.25, -3.0]);
        before += rms(&touch(seed), &truth);
        after += rms(&fit.apply(&touch(seed)), &truth);
    }
    assert!(after < 0.2 * before, "{before} to {after}");
}

#[test]
fn the_line_is_exact_where_nothing_else_is_wrong() {
    let touches: Vec<DepthMap> = (0..6).map(touch).collect();
    let targets = touches.iter().map(|t| t.map(|v| 0.7 * v - 0.002)).collect();
    let fit = closed_form(&cases(&(touches, targets, vec![0; 6])), 1).unwrap().remove(0).unwrap();
    assert!((fit.line[0] - 0.7).abs() < 1e-4 && (fit.line[1] + 0.002).abs() < 1e-6, "{:?}", fit.line);
    assert!(fit.offset_px.iter().all(|v| v.abs() < 0.07), "{:?}", fit.offset_px);
    assert!(rms(&fit.apply(&touch(50)), &touch(50).map(|v| 0.7 * v - 0.002)) < 2e-5);
}

#[test]
fn poor_inputs_are_refused_or_give_a_finite_fit() {
    assert!(closed_form(&[], 1).is_err());
    let (good, small) = (touch(1), Grid::filled(4, 4, 0.0));
    let case = |prediction, target| FitPair { prediction, target, pad: 0 };
    let sizes = closed_form(&[case(&good, &good), case(&good, &small)], 1).unwrap_err();
    assert_eq!(sizes.to_string(), format!("pair 1 has a picture of [4, 4] pixels instead of [{SIDE}, {SIDE}]"));
    let broken = good.map(|_| f32::NAN);
    assert!(closed_form(&[case(&broken, &good)], 1).is_err());
    let flat = Grid::filled(SIDE, SIDE, 0.003);
    // One pair, equal pictures, flat pictures, nothing measured: no NaN, and never worse than the prediction.
    for pairs in [
        vec![case(&good, &good)],
        vec![case(&good, &good); 5],
        vec![case(&flat, &flat); 3],
        vec![case(&flat, &good); 3],
        vec![case(&good, &flat); 3],
        vec![case(&good, &broken); 2],
    ] {
        let fit = closed_form(&pairs, 1).unwrap().remove(0).unwrap();
        assert!(fit.fits([SIDE, SIDE]));
        let target = if pairs[0].target.as_slice()[0].is_finite() { pairs[0].target } else { pairs[0].prediction };
        let (before, after) = (rms(pairs[0].prediction, target), rms(&fit.apply(pairs[0].prediction), target));
        assert!(after <= before + 1e-6, "{before} to {after}");
    }
}

#[test]
fn what_is_left_out_is_judged_by_the_others() {
    let rig = rig(24);
    let all = cases(&rig);
    let folds = folds(&[None; 24], &(0..24).map(|i| i / 2).collect::<Vec<_>>(), 3);
    assert_eq!(&folds[..8], [0, 0, 1, 1, 2, 2, 0, 0]);
    let predictions = left_out(&all, 2, &folds).unwrap();
    let error = |i: usize| rms(predictions[i].as_ref().unwrap(), all[i].target) / rms(all[i].prediction, all[i].target);
    assert!((0..24).all(|i| error(i) < 0.5), "{:?}", (0..24).map(error).collect::<Vec<_>>());
    // With a single fold nothing is left to learn from.
    assert_eq!(left_out(&all[..1], 2, &[0]).unwrap(), [None]);
    let tools: Vec<Option<&str>> = (0..24).map(|i| Some(["a", "b", "c"][i % 3])).collect();
    let by_tool = super::folds(&tools, &[0; 24], 5);
    assert_eq!(&by_tool[..4], [0, 1, 2, 0]);
}

#[test]
fn a_wrong_partner_and_a_turned_picture_are_found() {
    let mut rig = rig(24);
    rig.1.swap(3, 9);
    rig.1[14] = rig.1[14].rotated_180();
    let all = cases(&rig);
    let predictions = left_out(&all, 2, &folds(&[None; 24], &(0..24).collect::<Vec<_>>(), 6)).unwrap();
    let in_doubt = doubts(&all, &predictions);
    let of = |case: usize| in_doubt.iter().find(|d| d.case == case);
    assert_eq!((of(3).unwrap().partner, of(9).unwrap().partner), (Some(9), Some(3)), "{in_doubt:?}");
    assert_eq!(of(14).unwrap().turn.as_deref(), Some("turned by 180°"), "{in_doubt:?}");
    assert_eq!(in_doubt.len(), 3, "{in_doubt:?}");
    assert!(doubts(&all[..4], &predictions[..4]).is_empty(), "too few to tell");
}
