//! Flags: implausible things about a depth chain, each with what was seen, why that is odd, and what to do.

use serde::Serialize;

use super::record::{Against, Stage, StageRecord};
use super::{DepthChain, DepthRange, Mapping, RawPrediction, Shift};
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
/// Largest sound distance of a fitted slope from 1, and of an offset from 0 (meters).
const SLOPE_OFF: f64 = 0.15;
const OFFSET_OFF_M: f64 = 1e-3;
/// Largest sound distance of a shift's gain from the exact inverse's 2.
const GAIN_OFF: f64 = 0.03;

/// Severity: how much a person should care.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// The result cannot be right.
    Wrong,
    /// The result may be wrong.
    Caution,
    /// Good to know.
    Info,
}

/// Kind of implausible thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, strum::EnumIter)]
#[serde(rename_all = "snake_case")]
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
    /// The shift's gain is not the 2 that undoes the doubled mapping.
    ShiftGain,
    /// Depths outside what the model was trained on.
    OutOfRange,
    /// The channels, which should be equal, are not.
    ChannelsApart,
    /// Prediction and truth have little in common.
    Unlike,
    /// The line through the joint histogram is not the diagonal.
    Calibration,
}

/// One thing that is implausible.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Flag {
    /// Severity: how much a person should care.
    pub severity: Severity,
    /// Kind of thing.
    pub kind: FlagKind,
    /// The stage at which it shows.
    pub stage: String,
    /// Observation, with its numbers.
    pub what: String,
    /// Why that is odd.
    pub why: String,
    /// Remedy.
    pub action: String,
}

impl Flag {
    /// All of it as one text.
    pub fn text(&self) -> String {
        format!("{} {} {}", self.what, self.why, self.action)
    }
}

/// Everything that is implausible, the worst first.
pub(super) fn flags(
    chain: &DepthChain,
    raw: &RawPrediction,
    stages: &[StageRecord],
    against: Option<&Against>,
) -> Vec<Flag> {
    let mut list = List(Vec::new());
    list.numbers(stages);
    list.clamped(raw);
    list.channels(chain, raw);
    list.doubled(chain, stages);
    list.shift(chain, stages);
    list.range(chain, stages);
    if let Some(against) = against {
        list.orientation(against);
        list.calibration(against);
    }
    list.0.sort_by_key(|flag| (flag.severity, flag.kind));
    list.0
}

struct List(Vec<Flag>);

impl List {
    fn add(&mut self, severity: Severity, kind: FlagKind, stage: Stage, [what, why, action]: [String; 3]) {
        self.0.push(Flag { severity, kind, stage: stage.name(), what, why, action });
    }

    fn numbers(&mut self, stages: &[StageRecord]) {
        // Where it begins; later stages only carry it on.
        if let Some(bad) = stages.iter().find(|s| s.invalid > 0) {
            self.add(
                Severity::Wrong,
                FlagKind::NotFinite,
                bad.stage,
                [
                    format!("{} of {} values are not numbers.", bad.invalid, bad.image.len()),
                    "A model that gives NaN or infinity has met an input or a schedule it cannot take.".into(),
                    "Generate again with another sampler or more steps; if it stays, check the bundle.".into(),
                ],
            );
        }
        let flat = |s: &&StageRecord| s.stats.is_flat() && s.image.len() > 1;
        if let Some(flat) = stages.iter().find(flat) {
            self.add(
                Severity::Wrong,
                FlagKind::Constant,
                flat.stage,
                [
                    format!("All values are {}.", value(flat, flat.stats.mean)),
                    "An imprint has a touched and an untouched part; a constant image shows neither.".into(),
                    "Check that the GelSlim image shows a contact and that the bundle fits this sensor.".into(),
                ],
            );
        }
    }

    fn clamped(&mut self, raw: &RawPrediction) {
        let values = || raw.channels.iter().flat_map(|c| c.as_slice()).filter(|v| v.is_finite());
        let (count, clamped) = (values().count(), values().filter(|v| v.abs() > 1.0).count());
        if clamped == 0 {
            return;
        }
        let share = clamped as f64 / count as f64;
        let severity = if share >= CLAMPED { Severity::Caution } else { Severity::Info };
        self.add(
            severity,
            FlagKind::Clamped,
            Stage::Meters,
            [
                format!(
                    "{clamped} of {count} decoder values ({}) were outside -1 to 1 and were clamped.",
                    text_percent(share)
                ),
                "Beyond its range the model cannot say how deep: those pixels read the end of the range.".into(),
                match severity {
                    Severity::Info => "A few are ordinary overshoot; nothing needs doing.".into(),
                    _ => "Check the bundle's output range, or use more steps.".into(),
                },
            ],
        );
    }

    fn channels(&mut self, chain: &DepthChain, raw: &RawPrediction) {
        let n = raw.channels.len();
        if n < 2 {
            return;
        }
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
                Severity::Caution,
                FlagKind::ChannelsApart,
                Stage::Reduced,
                [
                    format!("The {n} channels disagree by {} (root mean square).", text_mm(apart_m)),
                    "They are trained to be copies of one depth; where they differ the model is unsure.".into(),
                    "Use more steps, and compare several seeds before trusting the detail.".into(),
                ],
            );
        }
    }

    fn doubled(&mut self, chain: &DepthChain, stages: &[StageRecord]) {
        let Some(result) = stages.iter().find(|s| s.stage == Stage::Shifted) else { return };
        let DepthRange { min_m, max_m } = chain.range;
        let middle = (min_m + max_m) / 2.0;
        if result.stats.count == 0 || result.stats.min < middle - 1e-9 * (max_m - min_m) {
            return;
        }
        let what = format!(
            "The smallest depth is {}, not below {}, the middle of the range.",
            text_mm(result.stats.min),
            text_mm(middle)
        );
        let why = "An imprint has untouched pixels near 0; only a range that was mapped twice leaves all of them in the \
                   upper half.";
        let action = match (chain.mapping, chain.shift) {
            (Mapping::Doubled, Shift::None) => "Choose the exact inverse: 2 · value - max is the depth.",
            (Mapping::Doubled, _) => "Check the shift's statistics, or choose the exact inverse.",
            (Mapping::Correct, _) => {
                "The decoder's picture seems to be in 0 to 1 already: correct the bundle's output range."
            }
        };
        self.add(Severity::Wrong, FlagKind::DoubledMapping, Stage::Shifted, [what, why.into(), action.into()]);
    }

    fn shift(&mut self, chain: &DepthChain, stages: &[StageRecord]) {
        let Shift::PaperMeanStd(stats) = chain.shift else { return };
        if stats.has_no_spread(chain.range.max_m) {
            let note = stages.iter().find(|s| s.stage == Stage::Shifted).and_then(|s| s.note.clone());
            self.add(
                Severity::Caution,
                FlagKind::NoSpread,
                Stage::Shifted,
                [
                    format!("Only the mean was shifted: {}.", note.unwrap_or_default()),
                    "Dividing by a deviation of zero would send every pixel to the end of the range.".into(),
                    "Compute the statistics again over more pairs.".into(),
                ],
            );
            return;
        }
        let [gain, offset_m] = stats.affine(chain.range.max_m);
        // What undoes the doubled mapping has the gain 2 and the offset -max.
        if chain.mapping == Mapping::Doubled && (gain / 2.0 - 1.0).abs() > GAIN_OFF {
            let error_m = |depth_m: f64| gain * (depth_m + chain.range.max_m) / 2.0 + offset_m - depth_m;
            let steeper = if gain > 2.0 { "steep" } else { "flat" };
            self.add(
                Severity::Info,
                FlagKind::ShiftGain,
                Stage::Shifted,
                [
                    format!(
                        "The shift's gain is {gain:.3} where 2 undoes the doubled mapping: {} too {steeper}.",
                        text_percent((gain / 2.0 - 1.0).abs())
                    ),
                    format!(
                        "A depth the model gives as 0 becomes {}, 10 mm becomes {} (off by {}).",
                        text_mm(error_m(0.0)),
                        text_mm(0.01 + error_m(0.01)),
                        text_mm(error_m(0.01))
                    ),
                    "Choose the exact inverse for depths as the model means them.".into(),
                ],
            );
        }
    }

    fn range(&mut self, chain: &DepthChain, stages: &[StageRecord]) {
        let Some(result) = stages.last() else { return };
        let DepthRange { min_m, max_m } = chain.range;
        let slack = 1e-3 * (max_m - min_m);
        let outside =
            result.image.as_slice().iter().filter(|v| f64::from(**v) < min_m - slack || f64::from(**v) > max_m + slack);
        let (count, of) = (outside.count(), result.stats.count);
        if count > 0 {
            self.add(
                if count as f64 >= CLAMPED * of as f64 { Severity::Caution } else { Severity::Info },
                FlagKind::OutOfRange,
                Stage::Shifted,
                [
                    format!(
                        "{count} of {of} pixels ({}) are outside {} to {}.",
                        text_percent(count as f64 / of as f64),
                        text_mm(min_m),
                        text_mm(max_m)
                    ),
                    "The model was trained on depths inside this range: the shift carried them out of it.".into(),
                    "Choose the exact inverse, or statistics of this bundle's own predictions.".into(),
                ],
            );
        }
    }

    fn orientation(&mut self, against: &Against) {
        let o = &against.orientation;
        let straight = o.as_is.unwrap_or(0.0);
        let better = |other: Option<f64>| other.filter(|r| *r > TURNED_AT_LEAST && *r > straight + TURNED_BY);
        let turned = better(o.turned_180);
        let mirrored = better(o.rows_reversed).filter(|r| turned.is_none_or(|t| *r > t));
        let seen = |r: f64, how: &str| {
            format!("Prediction and truth correlate {straight:.2} as they lie, but {r:.2} with the truth {how}.")
        };
        if let (Some(r), None) = (turned, mirrored) {
            self.add(
                Severity::Wrong,
                FlagKind::TurnedBy180,
                Stage::Turned,
                [
                    seen(r, "turned by 180°"),
                    "Bubble and GelSlim images are turned against each other by 180°; one turn is missing, or one too \
                     many."
                        .into(),
                    "Correct rotation_deg of the bundle's input or output.".into(),
                ],
            );
        }
        if let Some(r) = mirrored {
            self.add(
                Severity::Wrong,
                FlagKind::Mirrored,
                Stage::Turned,
                [
                    seen(r, "mirrored (rows reversed)"),
                    "The two fingers see mirror images: one finger may stand for the other.".into(),
                    "Check which finger is which in the data and in the prediction.".into(),
                ],
            );
        }
        if turned.is_none()
            && mirrored.is_none()
            && let Some(r) = o.as_is.filter(|r| *r < UNLIKE)
        {
            self.add(
                Severity::Caution,
                FlagKind::Unlike,
                Stage::Turned,
                [
                    format!("Prediction and truth correlate only {r:.2}."),
                    "They show different contacts: the tool may be new to the model, or the pair mismatched.".into(),
                    "Look at the two images side by side, and try other seeds.".into(),
                ],
            );
        }
    }

    fn calibration(&mut self, against: &Against) {
        let Some(line) = against.joint.line else { return };
        // A line through images that show different things says nothing about the mapping.
        let alike = against.orientation.as_is.is_some_and(|r| r >= 2.0 * UNLIKE);
        if !alike || ((line.slope - 1.0).abs() <= SLOPE_OFF && line.offset.abs() <= OFFSET_OFF_M) {
            return;
        }
        let doubled = (line.slope - 0.5).abs() < 0.15 && line.offset > 2.0 * OFFSET_OFF_M;
        let why = match doubled {
            true => "Slope 0.5 with half the range's end as offset is the mark of a range that was mapped twice.",
            false => "A right depth has slope 1 and offset 0: too small a slope flattens the imprint.",
        };
        let action = match doubled {
            true => "Choose the exact inverse.",
            false => "Compare the readings below; a refit corrects slope and offset over a whole dataset.",
        };
        self.add(
            Severity::Caution,
            FlagKind::Calibration,
            Stage::Turned,
            [
                format!(
                    "The line through prediction against truth has slope {:.2}, offset {}.",
                    line.slope,
                    text_mm(line.offset)
                ),
                why.into(),
                action.into(),
            ],
        );
    }
}

/// A value of a stage with its unit.
fn value(stage: &StageRecord, value: f64) -> String {
    if stage.stage.is_meters() { text_mm(value) } else { format!("{value:.3}") }
}
