//! One finger that is wrong where the other one is right: no reading of both mends it.

use std::collections::BTreeMap;

use super::poses::{Models, Registered};
use super::{Cause, Doubt, PairInput, imprints, with_samples};
use crate::contact::{flat_m, rise};
use crate::mesh::TriMesh;
use crate::rig::PadId;
use crate::sample::Sample;
use crate::units::counted;

/// Fewest pairs that tell the fingers apart.
const FEWEST: usize = 3;
/// Share of the pairs in which the sound finger is right: beside a wrong finger nearly all, of bare shafts, which leave the
/// place along them open to a finger alone, half.
const RIGHT: f64 = 0.75;
/// Share of the pairs in which the other one contradicts the touch, and in which it may be right.
const CONTRADICTS: f64 = 0.5;
const STILL_RIGHT: f64 = 0.2;

/// A finger of some pairs, alone.
struct Alone {
    pad: PadId,
    samples: Vec<Sample>,
    /// Pairs that can be registered by it, those whose pose is good and near the truth, and those whose pose contradicts the
    /// touch: a bare shaft leaves the place open and does neither.
    tried: usize,
    right: usize,
    contradicting: usize,
}

impl Alone {
    fn of(pairs: &[PairInput<'_>], models: &Models<'_>, pad: PadId) -> Self {
        let samples: Vec<Sample> = pairs.iter().map(|pair| alone(pair.sample, pad)).collect();
        let registered = Registered::of(&with_samples(pairs, &samples), models);
        let (tried, right, contradicting) = (registered.tried, registered.right(), registered.contradicting);
        Self { pad, samples, tried, right, contradicting }
    }

    /// Pairs in which it touched something.
    fn touched(&self) -> usize {
        let rises = |sample: &&Sample| {
            let imprint = sample.pad(self.pad).and_then(|touch| Some(&touch.depth()?.imprint));
            imprint.is_some_and(|imprint| rise(imprint) >= flat_m(&sample.rig))
        };
        self.samples.iter().filter(rises).count()
    }

    fn is_at_least(&self, share: f64) -> bool {
        self.tried >= FEWEST && self.right as f64 >= share * self.tried as f64
    }
}

/// Doubt about the imprints of one finger, where the other one's lie on the CAD models at the true poses.
pub(super) fn of_fingers(
    pairs: &[PairInput<'_>],
    tools: &BTreeMap<String, TriMesh>,
    models: &Models<'_>,
) -> Option<Doubt> {
    let rig = &pairs.first()?.sample.rig;
    let fingers: Vec<Alone> = rig.pads().map(|pad| Alone::of(pairs, models, pad)).collect();
    let sound = fingers.iter().filter(|finger| finger.is_at_least(RIGHT)).max_by_key(|finger| finger.right)?;
    let is_wrong = |finger: &&Alone| {
        let contradicts = finger.contradicting as f64 >= CONTRADICTS * finger.tried as f64;
        finger.tried >= FEWEST && contradicts && !finger.is_at_least(STILL_RIGHT)
    };
    let wrong = fingers.iter().find(is_wrong)?;
    let [name, other] = [wrong, sound].map(|finger| format!("{} finger", rig.pad_name(finger.pad)));
    let touched = wrong.touched();
    if (touched as f64) < STILL_RIGHT * wrong.tried as f64 {
        let what = format!(
            "the {name} has contact in {touched} of {}, the {other} in {}",
            counted(wrong.tried, "pair"),
            sound.touched()
        );
        return Some(Doubt::new(Cause::NothingFelt, what, "check that finger's camera and its depth without contact"));
    }
    let figures = format!(
        "registered by the {name} alone, {} of {} poses are good and near the truth, by the {other} alone {} of {}",
        wrong.right, wrong.tried, sound.right, sound.tried
    );
    let read_as =
        imprints::judge(&with_samples(pairs, &wrong.samples), tools, false).and_then(|(doubt, _)| doubt.read_as());
    let how = read_as.map_or("its imprints do not lie on the CAD models".into(), super::ReadAs::mistake);
    let what = format!("of the {name} alone {how}: {figures}");
    Some(Doubt::new(Cause::Finger(read_as), what, "correct what writes that finger's files"))
}

/// The sample with one finger alone.
fn alone(sample: &Sample, pad: PadId) -> Sample {
    let mut sample = sample.clone();
    for (other, touch) in sample.rig.pads().zip(sample.pads.iter_mut()) {
        if other != pad {
            *touch = None;
        }
    }
    sample
}
