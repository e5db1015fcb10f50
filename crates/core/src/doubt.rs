//! Doubts about data that look right, found by trying: [`judge`].
//!
//! Fingers swapped, pictures mirrored, another tool's CAD model, the untouched image in place of the touched one: nothing
//! in a file shows it, and every figure that is computed from it looks like one. Each leaves a trace in a handful of pairs
//! together: read otherwise ([`ReadAs`]), the imprints lie on the CAD model at the true pose, the image without contact
//! stays the same from pair to pair, the light comes from where it does, the prediction looks like the measurement. A
//! reading is said where it explains the pairs and what is stored does not.
//!
//! * `fit`, `imprints`: what was pushed in against the tool's outline at the true pose, or where that is not known at the
//!   registered one;
//! * `poses`: true poses against good registrations;
//! * `parts`: one finger, where the other one is right;
//! * `images`: touched against untouched images, over all pairs;
//! * `predictions`: what a generator makes of the images against what was measured.

mod fit;
mod images;
mod imprints;
mod parts;
mod poses;
mod predictions;

use std::collections::BTreeMap;

use super::frames::PlanarPose;
use super::mesh::{Axes, TriMesh};
use super::moments::median;
use super::read_as::ReadAs;
use super::sample::{PadTouch, Reading, Sample};

pub use poses::{Mismatch, Worth};
pub use predictions::{Placed, likeness};

/// The true pose, `grasp_from_object`, of the pair so many places after one.
pub type Beside<'a> = &'a dyn Fn(isize) -> Option<PlanarPose>;

/// A pair that is looked at.
#[derive(Clone, Copy)]
pub struct PairInput<'a> {
    /// Name of its tool, where known.
    pub tool: Option<&'a str>,
    /// Sample as it is stored.
    pub sample: &'a Sample,
    /// True poses of the pairs before and after it; asked only if its own contradicts its imprint.
    pub beside: Option<Beside<'a>>,
}

/// Cause of a doubt.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// It is stored so that it must be read otherwise.
    Stored(ReadAs),
    /// CAD models are those of other tools: the tool, and whose model it has.
    OtherTool(Vec<(String, String)>),
    /// CAD models have other axes: the tools, and how they are to be turned.
    Axes(Vec<String>, Axes),
    /// CAD models of these tools are not theirs, and no other one is.
    NotItsModel(Vec<String>),
    /// Some of the pairs are of another tool than they are named after.
    OtherToolOfSome,
    /// The color images of some of the pairs are those of the other finger.
    SwappedInSome,
    /// One finger's imprints are wrong, and are to be read so if that is known.
    Finger(Option<ReadAs>),
    /// One finger touched nothing.
    NothingFelt,
    /// The touched image is the untouched one, pixel by pixel.
    SameImages,
    /// The untouched image is a single color.
    NoReference,
    /// The color images are gray.
    Gray,
    /// True poses are not where the imprints are.
    Poses(Mismatch),
    /// Imprints do not lie on their CAD models, and nothing that was tried explains it.
    Unexplained,
}

impl Cause {
    /// True where imprints, CAD models and true poses do not go together, and it is known why: what is made of all three is
    /// wrong.
    pub fn is_of_poses(&self) -> bool {
        match self {
            Self::Stored(read_as) | Self::Finger(Some(read_as)) => !read_as.to_string().starts_with("image"),
            Self::Finger(None) => true,
            Self::Poses(_) | Self::OtherTool(_) | Self::Axes(..) | Self::NotItsModel(_) | Self::OtherToolOfSome => true,
            Self::SameImages
            | Self::NoReference
            | Self::Gray
            | Self::Unexplained
            | Self::SwappedInSome
            | Self::NothingFelt => false,
        }
    }

    /// A word for tables.
    pub fn key(&self) -> String {
        match self {
            Self::Stored(read_as) => read_as.to_string(),
            Self::OtherTool(_) => "other-tool".into(),
            Self::Axes(..) => "tool-axes".into(),
            Self::NotItsModel(_) => "not-its-model".into(),
            Self::OtherToolOfSome => "other-tool-of-some".into(),
            Self::SwappedInSome => "swapped-in-some".into(),
            Self::Finger(None) => "finger".into(),
            Self::Finger(Some(read_as)) => format!("finger-{read_as}"),
            Self::NothingFelt => "nothing-felt".into(),
            Self::SameImages => "same-images".into(),
            Self::NoReference => "no-reference".into(),
            Self::Gray => "gray".into(),
            Self::Poses(mismatch) => mismatch.key().into(),
            Self::Unexplained => "unexplained".into(),
        }
    }
}

/// A doubt about a data set: what seems wrong, by which figures, and what to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// Cause.
    pub cause: Cause,
    /// In words, with the figures that speak for it.
    pub what: String,
    /// Remedy, in words.
    pub hint: String,
    /// The pairs that it is about, by their position among those looked at; empty where it is about all.
    pub pairs: Vec<usize>,
}

impl Doubt {
    /// The reading that makes it right, where there is one.
    pub fn read_as(&self) -> Option<ReadAs> {
        match self.cause {
            Cause::Stored(read_as) => Some(read_as),
            _ => None,
        }
    }

    fn new(cause: Cause, what: String, hint: &str) -> Self {
        Self { cause, what, hint: hint.into(), pairs: Vec::new() }
    }

    fn stored(read_as: ReadAs, figures: &str) -> Self {
        let hint = format!("correct what writes the files, or have them read so with `doctor --set read-as={read_as}`");
        Self::new(Cause::Stored(read_as), format!("{}: {figures}", read_as.mistake()), &hint)
    }
}

/// Predictions of the images of some pairs; see [`Placed`]. One for each sample, in order; none where there is no
/// generator.
pub type Predict<'a> = &'a mut dyn FnMut(&[&Sample]) -> Option<Vec<Placed>>;

/// Doubts about data of which these pairs are a handful. `tools` has the CAD models by tool, in meters.
///
/// A doubt of the imprints is taken for true before the images are looked at, and so on.
pub fn judge(pairs: &[PairInput<'_>], tools: &BTreeMap<String, TriMesh>, predict: Option<Predict<'_>>) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    let depths: Vec<Sample> = pairs.iter().map(|pair| without_color(pair.sample)).collect();
    doubts.extend(of_imprints(&with_samples(pairs, &depths), tools));
    let images = images::judge(pairs);
    let sound = images.is_none();
    doubts.extend(images);
    // Without images to go by a prediction says nothing.
    let readable = sound || doubts.iter().all(|doubt| doubt.read_as().is_some());
    let imprints_known = doubts.iter().all(|doubt| doubt.cause != Cause::Unexplained);
    if let Some(predict) = predict.filter(|_| readable && imprints_known) {
        let readings: Vec<ReadAs> = doubts.iter().filter_map(Doubt::read_as).collect();
        let read: Vec<Sample> = pairs.iter().map(|pair| ReadAs::all(&readings, pair.sample)).collect();
        doubts.extend(predictions::judge(&read, sound, predict));
    }
    doubts
}

/// Figures of the registrations of some pairs: before and after a cure they tell what the cure is worth.
pub fn worth(pairs: &[PairInput<'_>], tools: &BTreeMap<String, TriMesh>) -> Worth {
    poses::Registered::of(pairs, &poses::models(pairs, tools)).worth()
}

/// Doubt about imprints, CAD models and true poses, which are judged together: each of the three may be what is wrong.
fn of_imprints(pairs: &[PairInput<'_>], tools: &BTreeMap<String, TriMesh>) -> Option<Doubt> {
    let models = poses::models(pairs, tools);
    let registered = poses::Registered::of(pairs, &models);
    let of_all = of_all_imprints(pairs, tools, &models, &registered);
    let explained = |doubt: &Doubt| !matches!(doubt.cause, Cause::Unexplained | Cause::Poses(Mismatch::Unknown));
    if registered.agree() || of_all.as_ref().is_some_and(explained) {
        return of_all;
    }
    parts::of_fingers(pairs, tools, &models).or(of_all).or_else(|| registered.mostly_wrong())
}

/// Doubt about the imprints of all pairs and both fingers together.
fn of_all_imprints(
    pairs: &[PairInput<'_>],
    tools: &BTreeMap<String, TriMesh>,
    models: &poses::Models<'_>,
    registered: &poses::Registered<'_, '_>,
) -> Option<Doubt> {
    let mismatch = registered.mismatch(pairs);
    if let Some((mismatch, _)) = mismatch.filter(|(mismatch, _)| mismatch.is_rigid()) {
        // No mirror image and no factor of the imprints looks like this.
        return Some(registered.doubt(mismatch));
    }
    let by_imprints = imprints::judge(pairs, tools, !registered.agree());
    if let Some((mismatch, likeness)) = mismatch {
        // An explanation is better than none, and of two the likelier.
        let margin = if mismatch == Mismatch::Unknown { -SAME } else { SAME };
        if by_imprints.as_ref().is_none_or(|(_, explained)| *explained <= likeness + margin) {
            return Some(registered.doubt(mismatch));
        }
    }
    let (doubt, _) = by_imprints?;
    let with_models = |others: BTreeMap<String, TriMesh>| {
        let models = poses::models(pairs, &tools.clone().into_iter().chain(others).collect());
        registered.is_cured_by(&poses::Registered::of(pairs, &models))
    };
    let turned = |(name, mesh): (&String, &TriMesh), axes: Axes| (name.clone(), axes.apply(mesh));
    // A cure is tried to the end before it is offered.
    let cured = match &doubt.cause {
        Cause::Stored(ReadAs::CadAxes(axes)) => with_models(tools.iter().map(|tool| turned(tool, *axes)).collect()),
        Cause::Stored(read_as) => {
            let read: Vec<Sample> = pairs.iter().map(|pair| ReadAs::all(&[*read_as], pair.sample)).collect();
            registered.is_cured_by(&poses::Registered::of(&with_samples(pairs, &read), models))
        }
        Cause::Axes(names, axes) => {
            with_models(names.iter().filter_map(|name| Some(turned(tools.get_key_value(name)?, *axes))).collect())
        }
        Cause::OtherTool(list) => {
            let other = list.iter().filter_map(|(name, other)| Some((name.clone(), tools.get(other)?.clone())));
            with_models(other.collect())
        }
        _ => true,
    };
    if cured { Some(doubt) } else { registered.unexplained() }
}

/// A sample without its color images: what is tried on it need not copy them.
fn without_color(sample: &Sample) -> Sample {
    let depths = |touch: &Option<PadTouch>| {
        let touch = touch.as_ref()?;
        let mut kept = PadTouch::default();
        kept.lent.clone_from(&touch.lent);
        for (sensor, reading) in touch.readings() {
            if let Reading::Depth(depth) = reading {
                kept.set(*sensor, depth.clone());
            }
        }
        Some(kept)
    };
    let pads = sample.pads.iter().map(depths).collect();
    Sample { rig: sample.rig.clone(), pads, notes: Vec::new(), ..*sample }
}

/// The pairs with other samples, in order.
fn with_samples<'a>(pairs: &[PairInput<'a>], samples: &'a [Sample]) -> Vec<PairInput<'a>> {
    pairs.iter().zip(samples).map(|(pair, sample)| PairInput { sample, ..*pair }).collect()
}

/// Gain of a reading: how much better pairs are under it than as they are stored.
struct Gain {
    /// Mean of the score when read so.
    read: f64,
    /// Mean by which that is more.
    mean: f64,
    /// Pairs where it is clearly more.
    better: usize,
    /// Pairs where it is clearly more or less.
    decided: usize,
}

/// Scores that differ by no more are the same.
const SAME: f64 = 0.03;
/// Share of the pairs that tell anything, which must tell the same.
const AGREED: f64 = 0.8;

impl Gain {
    /// Between the scores of the same pairs as stored and read otherwise.
    fn between(stored: &[f64], read: &[f64]) -> Self {
        let gains: Vec<f64> = read.iter().zip(stored).map(|(read, stored)| read - stored).collect();
        let n = gains.len().max(1) as f64;
        Self {
            read: read.iter().sum::<f64>() / n,
            mean: gains.iter().sum::<f64>() / n,
            better: gains.iter().filter(|gain| **gain > SAME).count(),
            decided: gains.iter().filter(|gain| gain.abs() > SAME).count(),
        }
    }

    /// True where the reading explains the pairs: a mean score of at least `score`, by `gain` more than as stored, and
    /// nearly all pairs agree.
    fn explains(&self, score: f64, gain: f64) -> bool {
        self.read >= score && self.mean >= gain && self.better as f64 >= AGREED * self.decided as f64
    }
}

#[cfg(test)]
mod tests;
