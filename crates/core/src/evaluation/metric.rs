//! [`Metric`]: the table of metrics of a grasp, which lists and pictures of many grasps are made of.

use std::cmp::Ordering;
use std::str::FromStr as _;

use serde::{Deserialize, Serialize};
use strum::IntoEnumIterator as _;

use super::{GraspScore, mean, psnr};
use crate::verdict::Grade;

/// A metric of a grasp: a row of a table. Lists, filters and pictures follow; the most telling first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(strum::EnumIter, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// Error of the in-hand angle, radians.
    #[default]
    Angle,
    /// Verdict on the pose without the truth: the number of its [`Grade`].
    Verdict,
    /// Of the imprints against the measured ones, pooled over the fingers, dB.
    Psnr,
    /// Mean over the fingers, range of the tool's predictions (pictures without scale: both stretched to 0..1).
    Ssim,
    /// As [`Metric::Psnr`] against the simulator's imprints without camera noise.
    PsnrNoiseFree,
}

/// A row of the table of metrics.
struct Row {
    name: &'static str,
    /// The word in the filter of the list.
    key: &'static str,
    tip: &'static str,
    /// The unit on screen; empty for a number without one.
    unit: &'static str,
    /// Factor from the value to the unit on screen.
    factor: f64,
    decimals: usize,
    larger_is_better: bool,
    of: fn(&GraspScore) -> Option<f64>,
}

const PLAIN: Row =
    Row { name: "", key: "", tip: "", unit: "", factor: 1.0, decimals: 3, larger_is_better: true, of: |_| None };
const DB: Row = Row { unit: "dB", decimals: 1, ..PLAIN };

impl Metric {
    /// The row of the table.
    fn row(self) -> Row {
        match self {
            Self::Angle => Row {
                name: "Angle error",
                key: "angle",
                tip: "Error of the in-hand angle from the contact of both fingers, degrees",
                unit: "°",
                factor: 1f64.to_degrees(),
                decimals: 1,
                larger_is_better: false,
                of: |grasp| grasp.angle_error_rad,
            },
            Self::Verdict => Row {
                name: "Verdict",
                key: "verdict",
                tip: "How much the pose can be relied on, without the truth: good, check or wrong",
                decimals: 0,
                larger_is_better: false,
                of: |grasp| grasp.verdict.map(|grade| f64::from(grade as u8)),
                ..PLAIN
            },
            Self::Psnr => Row {
                name: "PSNR",
                key: "psnr",
                tip: "Against the measured imprint, dB; peak 22.5 mm, or both scaled to 0..1 where the scale is assumed",
                of: |grasp| psnr(&[grasp], |image| Some(image.error)),
                ..DB
            },
            Self::Ssim => Row {
                name: "SSIM",
                key: "ssim",
                tip: "Structural similarity; range of the tool's predictions (the lab's), or both scaled to 0..1 where the scale is assumed",
                of: |grasp| mean(grasp.images.iter().filter_map(|image| image.ssim)),
                ..PLAIN
            },
            Self::PsnrNoiseFree => Row {
                name: "PSNR noise-free",
                key: "psnr-clean",
                tip: "Against the simulator's imprint without camera noise, dB",
                of: |grasp| psnr(&[grasp], |image| image.noise_free),
                ..DB
            },
        }
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// The meaning, in a line.
    pub fn tip(self) -> &'static str {
        self.row().tip
    }

    /// The decimals on screen.
    pub fn decimals(self) -> usize {
        self.row().decimals
    }

    /// A value in the unit of the screen.
    pub fn shown(self, value: f64) -> f64 {
        value * self.row().factor
    }

    /// A value with its unit.
    pub fn text(self, value: f64) -> String {
        if self == Self::Verdict
            && let Some(grade) = Grade::iter().find(|grade| f64::from(*grade as u8) == value)
        {
            return grade.to_string();
        }
        if value.is_nan() {
            return if self == Self::Angle { "no pose".into() } else { "–".into() };
        }
        let Row { unit, decimals, .. } = self.row();
        let space = if matches!(unit, "" | "°") { "" } else { " " };
        format!("{:.decimals$}{space}{unit}", self.shown(value))
    }

    /// Order of two values, the worse one first. A metric that is not a number (no pose was found) is the worst.
    pub fn worse(self, a: f64, b: f64) -> Ordering {
        self.badness(b).total_cmp(&self.badness(a))
    }

    /// A number that grows as the value gets worse.
    pub fn badness(self, value: f64) -> f64 {
        match (value.is_nan(), self.row().larger_is_better) {
            (true, _) => f64::INFINITY,
            (false, true) => -value,
            (false, false) => value,
        }
    }
}

impl GraspScore {
    /// One of the metrics; `None` where it cannot be there, NaN where it failed.
    pub fn metric(&self, metric: Metric) -> Option<f64> {
        (metric.row().of)(self)
    }
}

/// A condition on a metric, as it is typed: `angle>5`, `psnr<=20`, `measured:angle>2`, `verdict=wrong`. Numbers are in the
/// units of the screen.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// A part of the source's name, in lower case; empty for the one chosen.
    pub source: String,
    /// The metric.
    pub metric: Metric,
    /// The bound, in the unit of the screen.
    bound: f64,
    /// Orders of a value and the bound that pass.
    passes: [Ordering; 2],
}

impl Condition {
    /// The condition that a word states; `None` for a word that states none.
    pub fn parse(word: &str) -> Option<Self> {
        let sign = word.find(['<', '>', '='])?;
        let (left, rest) = word.split_at(sign);
        let side = match rest.as_bytes()[0] {
            b'<' => Ordering::Less,
            b'>' => Ordering::Greater,
            _ => Ordering::Equal,
        };
        let (or_equal, number) = match rest[1..].strip_prefix('=') {
            Some(number) => (Ordering::Equal, number),
            None => (side, &rest[1..]),
        };
        let (source, key) = left.rsplit_once(':').unwrap_or(("", left));
        let metric = Metric::iter().find(|metric| metric.row().key == key)?;
        let bound = match (metric, Grade::from_str(number)) {
            (Metric::Verdict, Ok(grade)) => f64::from(grade as u8),
            _ => number.trim_end_matches('°').parse().ok().filter(|b: &f64| !b.is_nan())?,
        };
        Some(Self { source: source.to_owned(), metric, bound, passes: [side, or_equal] })
    }

    /// True where a value passes. What failed is worse than any number.
    pub fn passes(&self, value: f64) -> bool {
        let worst = if self.metric.row().larger_is_better { f64::NEG_INFINITY } else { f64::INFINITY };
        let shown = if value.is_nan() { worst } else { self.metric.shown(value) };
        self.passes.contains(&shown.total_cmp(&self.bound))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_read_and_nothing_else_is_one() {
        let passes = |word: &str, value: f64| Condition::parse(word).unwrap().passes(value);
        assert!(passes("angle>5", 0.1) && !passes("angle>5", 0.05) && passes("angle>5", f64::NAN));
        assert!(passes("psnr<20", 19.9) && !passes("psnr<20", 20.0) && passes("psnr<=20", 20.0));
        assert!(passes("ssim<0.5", 0.4) && passes("angle>5°", 0.1) && !passes("angle<5", f64::NAN));
        let [good, check, wrong] = Grade::iter().map(|grade| f64::from(grade as u8)).collect::<Vec<_>>()[..] else {
            panic!("three grades")
        };
        assert!(passes("verdict=wrong", wrong) && !passes("verdict=wrong", check) && !passes("verdict=wrong", good));
        assert!(passes("verdict>good", check) && passes("verdict<=check", good) && !passes("verdict<wrong", wrong));
        let of = Condition::parse("measured:angle>=2").unwrap();
        assert_eq!((of.source.as_str(), of.metric), ("measured", Metric::Angle));
        for word in
            ["angle", "verdict=bad", "tool:rod", "angle>", "angle>x", "size>3", ">5", "angle>nan", "", "a:b:angle"]
        {
            assert_eq!(Condition::parse(word), None, "{word}");
        }
        for metric in Metric::iter() {
            assert!(!metric.name().is_empty());
            assert_eq!(Condition::parse(&format!("{}>0", metric.row().key)).map(|c| c.metric), Some(metric));
        }
    }

    #[test]
    fn the_worst_is_what_failed_then_what_is_far_off() {
        let order = |metric: Metric, mut values: Vec<f64>| {
            values.sort_by(|a, b| metric.worse(*a, *b));
            values.iter().map(|v| metric.text(*v)).collect::<Vec<_>>()
        };
        assert_eq!(order(Metric::Angle, vec![0.0, 1.0, f64::NAN]), ["no pose", "57.3°", "0.0°"]);
        assert_eq!(order(Metric::Psnr, vec![30.0, 12.0]), ["12.0 dB", "30.0 dB"]);
    }
}
