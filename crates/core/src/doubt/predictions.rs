//! Predictions against measurements: which finger an image is of, and how it lies.

use super::fit::{correlation, relief};
use super::{Cause, Doubt, Gain, Predict};
use crate::grid::DepthMap;
use crate::read_as::{Images, Lay, ReadAs};
use crate::rig::{PadId, PerPad, Rig};
use crate::sample::{PadTouch, Sample};
use crate::units::counted;

/// Predicted imprints of a pair, meters, raw orientation: by the pad whose image it is made from, then by the pad in whose
/// imprint it is placed.
pub type Placed = PerPad<PerPad<DepthMap>>;

/// Mean likeness of predictions that are of the right finger.
const ALIKE: f64 = 0.3;
/// By how much more a reading must have it.
const CLEARLY: f64 = 0.12;
/// Likeness of a single pair's prediction to the other finger's imprint, and by how much that must be more, for the pair to be
/// called swapped; and the fewest such pairs.
const SURELY_ALIKE: f64 = 0.5;
const SURELY: f64 = 0.3;
const SOME: usize = 2;
/// From this likeness on nothing is tried.
const GOOD: f64 = 0.6;

/// Doubt about the images, seen by their predictions. `sound`: nothing was found in the images themselves.
pub(super) fn judge(samples: &[Sample], sound: bool, predict: Predict<'_>) -> Option<Doubt> {
    let (at, both): (Vec<usize>, Vec<&Sample>) =
        samples.iter().enumerate().filter(|(_, sample)| fingers(sample).len() == 2).unzip();
    if both.is_empty() {
        return None;
    }
    let predicted = predict(&both)?;
    let stored = scores(&both, &predicted, false);
    let mean = stored.iter().sum::<f64>() / stored.len().max(1) as f64;
    let mut best: Option<(ReadAs, Gain)> = None;
    let mut consider = |read_as: ReadAs, read: &[f64]| {
        let gain = Gain::between(&stored, read);
        if gain.explains(ALIKE, CLEARLY) && best.as_ref().is_none_or(|(_, known)| gain.read > known.read) {
            best = Some((read_as, gain));
        }
    };
    let swapped = scores(&both, &predicted, true);
    consider(ReadAs::ImageSwapFingers, &swapped);
    if sound && mean < GOOD {
        let lays = [Lay::MirrorColumns, Lay::MirrorRows, Lay::Turn].map(ReadAs::ImageLay);
        let others = [ReadAs::ImageBgr(Images::Both), ReadAs::ImageSwapReference];
        for read_as in lays.into_iter().chain(others) {
            let read: Vec<Sample> = both.iter().map(|sample| ReadAs::all(&[read_as], sample)).collect();
            let Some(predicted) = predict(&read.iter().collect::<Vec<_>>()) else { break };
            consider(read_as, &scores(&both, &predicted, false));
        }
    }
    let Some((read_as, gain)) = best else {
        return swapped_in_some(&stored, &swapped, &at);
    };
    let figures = format!(
        "predictions look like the measured imprints with a similarity of {:.2} instead of {mean:.2}, better on {} of {}",
        gain.read,
        gain.better,
        counted(stored.len(), "pair")
    );
    Some(Doubt::stored(read_as, &figures))
}

/// Pairs whose predictions look like the imprints of the other finger alone.
fn swapped_in_some(stored: &[f64], swapped: &[f64], at: &[usize]) -> Option<Doubt> {
    let is_swapped = |i: &usize| swapped[*i] >= SURELY_ALIKE && swapped[*i] - stored[*i] >= SURELY;
    let some: Vec<usize> = (0..stored.len()).filter(is_swapped).collect();
    if some.len() < SOME {
        return None;
    }
    let mean = |scores: &[f64]| some.iter().map(|i| scores[*i]).sum::<f64>() / some.len() as f64;
    let what = format!(
        "the color images of the fingers are swapped in {} of {}: their predictions look like the other finger's imprint with a \
         likeness of {:.2}, like the own one's with {:.2}",
        some.len(),
        counted(stored.len(), "pair"),
        mean(swapped),
        mean(stored)
    );
    let doubt = Doubt::new(Cause::SwappedInSome, what, "correct these pairs, and look at those beside them");
    Some(Doubt { pairs: some.iter().map(|i| at[*i]).collect(), ..doubt })
}

/// The pads with both sensors.
fn fingers(sample: &Sample) -> Vec<PadId> {
    let both = |touch: &PadTouch| touch.color().is_some() && touch.depth().is_some();
    sample.pads.entries().filter(|(_, touch)| both(touch)).map(|(pad, _)| pad).collect()
}

/// The likeness of each pair's predictions, of their own finger's image or the other one's.
fn scores(samples: &[&Sample], predicted: &[Placed], swapped: bool) -> Vec<f64> {
    let score = |(sample, predicted): (&&Sample, &Placed)| {
        let pads = fingers(sample);
        let from = |index: usize| pads[if swapped { pads.len() - 1 - index } else { index }];
        let of = |index: usize| {
            let predicted = predicted[from(index)].as_ref()?[pads[index]].as_ref()?;
            let measured = &sample.pad(pads[index])?.depth()?.imprint;
            Some(likeness(predicted, measured, &sample.rig, pads[index]))
        };
        let each: Vec<f64> = (0..pads.len()).filter_map(of).collect();
        each.iter().sum::<f64>() / each.len().max(1) as f64
    };
    samples.iter().zip(predicted).map(score).collect()
}

/// Correlation of what is pushed in in two imprints, where the color sensor's window lies, -1..1.
pub fn likeness(predicted: &DepthMap, measured: &DepthMap, rig: &Rig, pad: PadId) -> f64 {
    if predicted.size() != measured.size() {
        return 0.0;
    }
    let [a, b] = [predicted, measured].map(relief);
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    let window = rig.color_window(pad).map(|window| window.rectangle());
    let scale = measured.width() as f64 / a.width().max(1) as f64;
    for y in 0..a.height() {
        for x in 0..a.width() {
            let inside = window.is_none_or(|[cx, cy, width, height]| {
                let (u, v) = ((x as f64 + 0.5) * scale, (y as f64 + 0.5) * scale);
                (u - cx).abs() <= width / 2.0 && (v - cy).abs() <= height / 2.0
            });
            if inside {
                ours.push(a[(x, y)]);
                theirs.push(b[(x, y)]);
            }
        }
    }
    for values in [&mut ours, &mut theirs] {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.iter_mut().for_each(|v| *v -= mean);
    }
    correlation(&ours, &theirs)
}
