//! Predictions against measurements: which finger an image is of, and how it lies.

use super::fit::{correlation, relief};
use super::{Doubt, Gain, Predict};
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
/// From this likeness on nothing is tried.
const GOOD: f64 = 0.6;

/// Doubt about the images, seen by their predictions. `sound`: nothing was found in the images themselves.
pub(super) fn judge(samples: &[Sample], sound: bool, predict: Predict<'_>) -> Option<Doubt> {
    let both: Vec<&Sample> = samples.iter().filter(|sample| fingers(sample).len() == 2).collect();
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
    consider(ReadAs::ImageSwapFingers, &scores(&both, &predicted, true));
    if sound && mean < GOOD {
        let lays = [Lay::MirrorColumns, Lay::MirrorRows, Lay::Turn].map(ReadAs::ImageLay);
        let others = [ReadAs::ImageBgr(Images::Both), ReadAs::ImageSwapReference];
        for read_as in lays.into_iter().chain(others) {
            let read: Vec<Sample> = both.iter().map(|sample| ReadAs::all(&[read_as], sample)).collect();
            let Some(predicted) = predict(&read.iter().collect::<Vec<_>>()) else { break };
            consider(read_as, &scores(&both, &predicted, false));
        }
    }
    let (read_as, gain) = best?;
    let figures = format!(
        "predictions look like the measured imprints with a likeness of {:.2} instead of {mean:.2}, better on {} of {}",
        gain.read,
        gain.better,
        counted(stored.len(), "pair")
    );
    Some(Doubt::stored(read_as, &figures))
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
    let (mut felt, mut seen) = (Vec::new(), Vec::new());
    let window = rig.color_window(pad).map(|window| window.rectangle());
    let scale = measured.width() as f64 / a.width().max(1) as f64;
    for y in 0..a.height() {
        for x in 0..a.width() {
            let inside = window.is_none_or(|[cx, cy, width, height]| {
                let (u, v) = ((x as f64 + 0.5) * scale, (y as f64 + 0.5) * scale);
                (u - cx).abs() <= width / 2.0 && (v - cy).abs() <= height / 2.0
            });
            if inside {
                felt.push(a[(x, y)]);
                seen.push(b[(x, y)]);
            }
        }
    }
    for values in [&mut felt, &mut seen] {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.iter_mut().for_each(|v| *v -= mean);
    }
    correlation(&felt, &seen)
}
