//! Flags: implausible things about a depth chain, each with what was seen, why that is odd, and what to do.

use super::{DepthChain, DepthRange, PostprocessError, RELATIVE_NO_SPREAD, RawPrediction, Shift, Stage, Stats};
use crate::grid::{DepthMap, Grid};
use crate::resample::bilinear;
use crate::units::{text_mm, text_percent};

/// Share of clamped values from which it matters.
const CLAMPED: f64 = 0.01;
/// By how much another orientation must correlate better, and how well at least.
const TURNED_BY: f64 = 0.1;
const TURNED_AT_LEAST: f64 = 0.3;
/// A correlation below this means that prediction and truth have little in common.
const UNLIKE: f64 = 0.3;
/// Root mean square disagreement of the channels that is worth a word, meters.
const CHANNELS_APART_M: f64 = 5e-4;

/// Severity: how much a person should care.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The result cannot be right.
    Wrong,
    /// The result may be wrong.
    Caution,
}

/// Kind of implausible thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FlagKind {
    /// Values that are not numbers.
    NotFinite,
    /// An image of one value.
    Constant,
    /// The result lies in the upper half of the range: mapped twice.
    DoubledMapping,
    /// The truth turned by 180 degrees fits better.
    TurnedBy180,
    /// The truth mirrored fits better.
    Mirrored,
    /// Decoder values outside -1 to 1.
    Clamped,
    /// The shift could not divide by the predictions' deviation.
    NoSpread,
    /// Depths outside what the model was trained on.
    OutOfRange,
    /// The channels, which should be equal, are not.
    ChannelsApart,
    /// Prediction and truth have little in common.
    Unlike,
}

/// One thing that is implausible.
#[derive(Clone, Debug, PartialEq)]
pub struct Flag {
    /// Severity: how much a person should care.
    pub severity: Severity,
    /// Kind of thing.
    pub kind: FlagKind,
    /// Observation, with its numbers.
    pub what: String,
    /// Why that is odd.
    pub why: &'static str,
    /// Remedy.
    pub action: &'static str,
}

/// Everything that is implausible, the worst first. `truth` is the measured imprint (meters, raw orientation); a result of
/// another size is resized to it for the comparison.
///
/// # Errors
/// See [`PostprocessError`].
pub fn flags(chain: &DepthChain, raw: &RawPrediction, truth: Option<&DepthMap>) -> Result<Vec<Flag>, PostprocessError> {
    let mut seen = Vec::new();
    let look = &mut |stage, image: &Grid<f32>| seen.push(Seen { stage, stats: Stats::of(image), len: image.len() });
    let result = chain.walk(raw, look)?;
    let mut list = List(Vec::new());
    list.numbers(&seen);
    list.clamped(raw);
    list.channels(chain, raw);
    list.doubled(chain, &seen);
    list.no_spread(chain);
    list.range(chain, &result);
    if let Some(truth) = truth {
        let same = result.size() == truth.size();
        list.against(&if same { result } else { bilinear(&result, truth.width(), truth.height()) }, truth);
    }
    list.0.sort_by_key(|flag| (flag.severity, flag.kind));
    Ok(list.0)
}

/// An image on the way.
struct Seen {
    stage: Stage,
    stats: Stats,
    /// Pixels.
    len: usize,
}

impl Seen {
    /// A value with its unit.
    fn text(&self, value: f64) -> String {
        if self.stage == Stage::Channel { format!("{value:.3}") } else { text_mm(value) }
    }
}

/// Pearson's correlation over the pixels that are finite in both images, in f64. `None` for images of different size,
/// and where one of them is flat.
fn correlation(a: &Grid<f32>, b: &Grid<f32>) -> Option<f64> {
    if a.size() != b.size() {
        return None;
    }
    let pairs = || {
        let both = a.as_slice().iter().zip(b.as_slice()).filter(|(a, b)| a.is_finite() && b.is_finite());
        both.map(|(&a, &b)| (f64::from(a), f64::from(b)))
    };
    let count = pairs().count() as f64;
    if count == 0.0 {
        return None;
    }
    let (mean_a, mean_b) = (pairs().map(|p| p.0).sum::<f64>() / count, pairs().map(|p| p.1).sum::<f64>() / count);
    let (mut aa, mut bb, mut ab, mut size_a, mut size_b) = (0.0, 0.0, 0.0, 0.0f64, 0.0f64);
    for (a, b) in pairs() {
        (size_a, size_b) = (size_a.max(a.abs()), size_b.max(b.abs()));
        let (a, b) = (a - mean_a, b - mean_b);
        (aa, bb, ab) = (aa + a * a, bb + b * b, ab + a * b);
    }
    let spread = |sum: f64, size: f64| (sum / count).sqrt() > RELATIVE_NO_SPREAD * size;
    (spread(aa, size_a) && spread(bb, size_b)).then(|| ab / (aa.sqrt() * bb.sqrt())).filter(|r| r.is_finite())
}

struct List(Vec<Flag>);

impl List {
    fn add(&mut self, kind: FlagKind, what: String, why: &'static str, action: &'static str) {
        let severity = if kind <= FlagKind::Mirrored { Severity::Wrong } else { Severity::Caution };
        self.0.push(Flag { severity, kind, what, why, action });
    }

    fn numbers(&mut self, seen: &[Seen]) {
        // Where it begins; later images only carry it on.
        if let Some(bad) = seen.iter().find(|s| s.stats.count < s.len) {
            self.add(
                FlagKind::NotFinite,
                format!("{} of {} values are not numbers.", bad.len - bad.stats.count, bad.len),
                "A model that gives NaN or infinity has met an input or a schedule it cannot take.",
                "Generate again with another sampler or more steps; if it stays, check the bundle.",
            );
        }
        if let Some(flat) = seen.iter().find(|s| s.stats.is_flat() && s.len > 1) {
            self.add(
                FlagKind::Constant,
                format!("All values are {}.", flat.text(flat.stats.mean)),
                "An imprint has a touched and an untouched part; a constant image shows neither.",
                "Check that the GelSlim image shows a contact and that the bundle fits this sensor.",
            );
        }
    }

    fn clamped(&mut self, raw: &RawPrediction) {
        let values = || raw.channels.iter().flat_map(|c| c.as_slice()).filter(|v| v.is_finite());
        let (count, clamped) = (values().count(), values().filter(|v| v.abs() > 1.0).count());
        let share = clamped as f64 / count as f64;
        if clamped > 0 && share >= CLAMPED {
            let share = text_percent(share);
            self.add(
                FlagKind::Clamped,
                format!("{clamped} of {count} decoder values ({share}) were outside -1 to 1 and were clamped."),
                "Beyond its range the model cannot say how deep: those pixels read the end of the range.",
                "Check the bundle's output range, or use more steps.",
            );
        }
    }

    fn channels(&mut self, chain: &DepthChain, raw: &RawPrediction) {
        let n = raw.channels.len();
        let meters_per_unit = (chain.range.max_m - chain.range.min_m) / 2.0;
        let (mut sum, mut count) = (0.0, 0usize);
        for i in 0..raw.channels[0].len() {
            let values = || raw.channels.iter().map(|c| f64::from(c.as_slice()[i]));
            let mean = values().sum::<f64>() / n as f64;
            let spread = values().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
            if spread.is_finite() {
                sum += spread;
                count += 1;
            }
        }
        let apart_m = meters_per_unit * (sum / count.max(1) as f64).sqrt();
        if apart_m > CHANNELS_APART_M {
            self.add(
                FlagKind::ChannelsApart,
                format!("The {n} channels disagree by {} (root mean square).", text_mm(apart_m)),
                "They are trained to be copies of one depth; where they differ the model is unsure.",
                "Use more steps, and compare several seeds before trusting the detail.",
            );
        }
    }

    fn doubled(&mut self, chain: &DepthChain, seen: &[Seen]) {
        let Some(result) = seen.iter().find(|s| s.stage == Stage::Shifted) else { return };
        let DepthRange { min_m, max_m } = chain.range;
        let middle = (min_m + max_m) / 2.0;
        if result.stats.count == 0 || result.stats.min < middle - 1e-9 * (max_m - min_m) {
            return;
        }
        let (least, middle) = (text_mm(result.stats.min), text_mm(middle));
        self.add(
            FlagKind::DoubledMapping,
            format!("The smallest depth is {least}, not below {middle}, the middle of the range."),
            "An imprint has untouched pixels near 0; only a range that was mapped twice leaves all of them in the upper half.",
            match chain.shift {
                Shift::None => "Choose the exact inverse: 2 · value - max is the depth.",
                Shift::PaperMeanStd(_) => "Check the shift's statistics, or choose the exact inverse.",
                Shift::ExactInverse => {
                    "The decoder's picture seems to be in 0 to 1 already: correct the bundle's output range."
                }
            },
        );
    }

    fn no_spread(&mut self, chain: &DepthChain) {
        if let Shift::PaperMeanStd(stats) = chain.shift
            && stats.has_no_spread(chain.range.max_m)
        {
            self.add(
                FlagKind::NoSpread,
                format!("Only the mean was shifted: the predictions' deviation is {:e} m.", stats.pred_std),
                "Dividing by a deviation of zero would send every pixel to the end of the range.",
                "Compute the statistics again over more pairs.",
            );
        }
    }

    fn range(&mut self, chain: &DepthChain, result: &DepthMap) {
        let DepthRange { min_m, max_m } = chain.range;
        let slack = 1e-3 * (max_m - min_m);
        let outside = |v: &&f32| f64::from(**v) < min_m - slack || f64::from(**v) > max_m + slack;
        let values = result.as_slice();
        let (count, of) = (values.iter().filter(outside).count(), values.iter().filter(|v| v.is_finite()).count());
        if count > 0 && count as f64 >= CLAMPED * of as f64 {
            let (share, low, high) = (text_percent(count as f64 / of as f64), text_mm(min_m), text_mm(max_m));
            self.add(
                FlagKind::OutOfRange,
                format!("{count} of {of} pixels ({share}) are outside {low} to {high}."),
                "The model was trained on depths inside this range: the shift carried them out of it.",
                "Choose the exact inverse, or statistics of this bundle's own predictions.",
            );
        }
    }

    fn against(&mut self, result: &DepthMap, truth: &DepthMap) {
        let as_is = correlation(result, truth);
        let straight = as_is.unwrap_or(0.0);
        let better = |other: Option<f64>| other.filter(|r| *r > TURNED_AT_LEAST && *r > straight + TURNED_BY);
        let turned = better(correlation(result, &truth.rotated_180()));
        let mirrored = better(correlation(result, &truth.rows_reversed())).filter(|r| turned.is_none_or(|t| *r > t));
        let seen = |r: f64, how: &str| {
            format!("Prediction and truth correlate {straight:.2} as they lie, but {r:.2} with the truth {how}.")
        };
        match (mirrored, turned) {
            (Some(r), _) => self.add(
                FlagKind::Mirrored,
                seen(r, "mirrored (rows reversed)"),
                "The two fingers see mirror images: one finger may stand for the other.",
                "Check which finger is which in the data and in the prediction.",
            ),
            (None, Some(r)) => self.add(
                FlagKind::TurnedBy180,
                seen(r, "turned by 180°"),
                "Bubble and GelSlim images are turned against each other by 180°; one turn is missing, or one too many.",
                "Correct rotation_deg of the bundle's input or output.",
            ),
            (None, None) if as_is.is_some_and(|r| r < UNLIKE) => self.add(
                FlagKind::Unlike,
                format!("Prediction and truth correlate only {straight:.2}."),
                "They show different contacts: the tool may be new to the model, or the pair mismatched.",
                "Look at the two images side by side, and try other seeds.",
            ),
            (None, None) => {}
        }
    }
}
