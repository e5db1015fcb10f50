//! [`Figure`]: the figures of a grasp that lists and pictures of many grasps are made of.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use super::{GraspScore, mean, psnr};
use crate::sample::Scale;
use crate::units;

/// A figure of a grasp.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, strum::EnumIter, Serialize, Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Figure {
    /// Error of the in-hand angle, radians.
    #[default]
    Angle,
    /// Of the imprints against the measured ones, pooled over the fingers, dB.
    Psnr,
    /// Mean over the fingers, range 0.0225 m (pictures without scale: both stretched to 0..1).
    Ssim,
    /// Root of the mean squared error, pooled over the fingers, meters.
    Rms,
    /// As [`Figure::Psnr`] against the simulator's imprints without camera noise.
    PsnrNoiseFree,
    /// SSIM against these, range of the tool's predictions.
    SsimNoiseFree,
    /// SSIM with the lab's range: that of the tool's predictions.
    SsimTool,
    /// Share of the imprints whose tool the classifier names, 0..1.
    Tool,
    /// Time to generate one image, seconds.
    Seconds,
    /// One minus the Dice of the mask drawn by hand and the mask model's, of the worse finger, 0..1.
    Disagreement,
    /// Share of the pixels whose probability of contact is near one half, of the worse finger, 0..1.
    Unsure,
    /// How far predictions with different seeds are apart, meters.
    SeedSpread,
}

impl Figure {
    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Angle => "Angle error",
            Self::Psnr => "PSNR",
            Self::Ssim => "SSIM",
            Self::Rms => "RMS error",
            Self::PsnrNoiseFree => "PSNR noise-free",
            Self::SsimNoiseFree => "SSIM noise-free",
            Self::SsimTool => "SSIM tool's range",
            Self::Tool => "Tool named",
            Self::Seconds => "Time",
            Self::Disagreement => "Hand against model",
            Self::Unsure => "Model unsure",
            Self::SeedSpread => "Seed spread",
        }
    }

    /// The word that stands for it in the filter of the list.
    pub fn key(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Psnr => "psnr",
            Self::Ssim => "ssim",
            Self::Rms => "rms",
            Self::PsnrNoiseFree => "psnr-clean",
            Self::SsimNoiseFree => "ssim-clean",
            Self::SsimTool => "ssim-tool",
            Self::Tool => "named",
            Self::Seconds => "time",
            Self::Disagreement => "disagreement",
            Self::Unsure => "unsure",
            Self::SeedSpread => "spread",
        }
    }

    /// What it says, in a line.
    pub fn tip(self) -> &'static str {
        match self {
            Self::Angle => "Error of the in-hand angle from the contact of both fingers, degrees",
            Self::Psnr => {
                "Against the measured imprint, dB; peak 22.5 mm, or both scaled to 0..1 where the scale is assumed"
            }
            Self::Ssim => "Structural similarity; range 22.5 mm, or both scaled to 0..1 where the scale is assumed",
            Self::Rms => "Root mean square error of all fingers against the measured imprints, mm",
            Self::PsnrNoiseFree => "Against the simulator's imprint without camera noise, dB",
            Self::SsimNoiseFree => {
                "Against the simulator's imprint without camera noise; range of the tool's predictions"
            }
            Self::SsimTool => "Structural similarity with the lab's range: that of the tool's predictions",
            Self::Tool => "Share of the imprints whose tool the classifier names, percent",
            Self::Seconds => "Time to generate one image, seconds",
            Self::Disagreement => {
                "What the mask drawn by hand and the mask model's do not share: 1 - Dice of the worse finger, percent"
            }
            Self::Unsure => {
                "Share of the pixels to which the mask model gives a probability of 0.25 to 0.75, worse finger, percent"
            }
            Self::SeedSpread => {
                "Standard deviation between kept predictions with different seeds, mean over the pixels, mm"
            }
        }
    }

    /// Its unit on screen; empty for a number without one.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Angle => "°",
            Self::Psnr | Self::PsnrNoiseFree => "dB",
            Self::Rms | Self::SeedSpread => "mm",
            Self::Tool | Self::Disagreement | Self::Unsure => "%",
            Self::Seconds => "s",
            Self::Ssim | Self::SsimNoiseFree | Self::SsimTool => "",
        }
    }

    /// Its decimals on screen.
    pub fn decimals(self) -> usize {
        match self {
            Self::Angle | Self::Psnr | Self::PsnrNoiseFree | Self::Disagreement | Self::Unsure => 1,
            Self::Rms | Self::SeedSpread => 2,
            Self::Tool => 0,
            Self::Ssim | Self::SsimNoiseFree | Self::SsimTool | Self::Seconds => 3,
        }
    }

    /// A value in the unit of the screen.
    pub fn shown(self, value: f64) -> f64 {
        match self {
            Self::Angle => value.to_degrees(),
            Self::Rms | Self::SeedSpread => units::mm(value),
            Self::Tool | Self::Disagreement | Self::Unsure => value * 100.0,
            _ => value,
        }
    }

    /// A value with its unit.
    pub fn text(self, value: f64) -> String {
        if value.is_nan() {
            return if self == Self::Angle { "no pose".into() } else { "–".into() };
        }
        let space = if matches!(self.unit(), "" | "°") { "" } else { " " };
        format!("{:.*}{space}{}", self.decimals(), self.shown(value), self.unit())
    }

    /// Whether a larger value is a better one.
    pub fn larger_is_better(self) -> bool {
        !matches!(self, Self::Angle | Self::Rms | Self::Seconds | Self::Disagreement | Self::Unsure | Self::SeedSpread)
    }

    /// Whether `a` is worse than `b`: then it is less. A figure that is not a number (no pose was found) is the worst.
    pub fn worse(self, a: f64, b: f64) -> Ordering {
        self.badness(b).total_cmp(&self.badness(a))
    }

    /// A number that grows as the value gets worse.
    pub fn badness(self, value: f64) -> f64 {
        match (value.is_nan(), self.larger_is_better()) {
            (true, _) => f64::INFINITY,
            (false, true) => -value,
            (false, false) => value,
        }
    }
}

impl GraspScore {
    /// One of its figures; `None` where it cannot be there, NaN where it failed.
    pub fn figure(&self, figure: Figure) -> Option<f64> {
        let images = || self.images.iter();
        match figure {
            Figure::Angle => self.angle_error_rad,
            Figure::Psnr => psnr(&[self], |image| Some(image.error)),
            // Stretched pictures have one range only.
            Figure::Ssim if self.scale == Scale::Assumed => mean(images().filter_map(|image| image.ssim)),
            Figure::Ssim => mean(images().filter_map(|image| image.ssim_peak)),
            Figure::Rms if self.scale == Scale::Assumed => None,
            Figure::Rms => {
                let (sum, pixels) = images().fold((0.0, 0), |(s, n), i| (s + i.error.sum, n + i.error.pixels));
                (pixels > 0).then(|| (sum / pixels as f64).sqrt())
            }
            Figure::PsnrNoiseFree => psnr(&[self], |image| image.noise_free),
            Figure::SsimNoiseFree => mean(images().filter_map(|image| image.ssim_noise_free)),
            Figure::SsimTool if self.scale == Scale::Assumed => None,
            Figure::SsimTool => mean(images().filter_map(|image| image.ssim)),
            Figure::Tool => mean(images().filter_map(|i| i.tool_right).map(|right| if right { 1.0 } else { 0.0 })),
            Figure::Seconds => self.seconds,
            Figure::Disagreement => self.doubt.disagreement,
            Figure::Unsure => self.doubt.unsure,
            Figure::SeedSpread => self.seed_spread_m,
        }
    }
}

/// A condition on a figure, as it is typed: `angle>5`, `psnr<=20`, `measured:angle>2`. Numbers are in the units of the
/// screen.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// A part of the source's name, in lower case; empty for the one chosen.
    pub source: String,
    /// The figure.
    pub figure: Figure,
    /// The bound, in the unit of the screen.
    bound: f64,
    /// Which side of it passes.
    passes: [Ordering; 2],
}

impl Condition {
    /// The condition that a word states; `None` for a word that states none.
    pub fn parse(word: &str) -> Option<Self> {
        use strum::IntoEnumIterator as _;
        let at = word.find(['<', '>'])?;
        let (left, rest) = word.split_at(at);
        let side = if rest.starts_with('<') { Ordering::Less } else { Ordering::Greater };
        let (or_equal, number) = match rest[1..].strip_prefix('=') {
            Some(number) => (Ordering::Equal, number),
            None => (side, &rest[1..]),
        };
        let (source, key) = left.rsplit_once(':').unwrap_or(("", left));
        let figure = Figure::iter().find(|figure| figure.key() == key)?;
        let bound: f64 = number.trim_end_matches(['°', '%']).parse().ok().filter(|b: &f64| !b.is_nan())?;
        Some(Self { source: source.to_owned(), figure, bound, passes: [side, or_equal] })
    }

    /// Whether a value passes. What failed is worse than any number.
    pub fn passes(&self, value: f64) -> bool {
        let worst = if self.figure.larger_is_better() { f64::NEG_INFINITY } else { f64::INFINITY };
        let shown = if value.is_nan() { worst } else { self.figure.shown(value) };
        self.passes.contains(&shown.total_cmp(&self.bound))
    }
}

#[cfg(test)]
mod tests {
    use strum::IntoEnumIterator as _;

    use super::*;

    #[test]
    fn conditions_are_read_and_nothing_else_is_one() {
        let passes = |word: &str, value: f64| Condition::parse(word).unwrap().passes(value);
        assert!(passes("angle>5", 0.1) && !passes("angle>5", 0.05) && passes("angle>5", f64::NAN));
        assert!(passes("psnr<20", 19.9) && !passes("psnr<20", 20.0) && passes("psnr<=20", 20.0));
        assert!(passes("rms>0.5", 0.000_6) && passes("named<100%", 0.5) && !passes("angle<5", f64::NAN));
        let of = Condition::parse("measured:angle>=2").unwrap();
        assert_eq!((of.source.as_str(), of.figure), ("measured", Figure::Angle));
        for word in ["angle", "tool:rod", "angle>", "angle>x", "size>3", ">5", "angle>nan", "", "a:b:angle"] {
            assert_eq!(Condition::parse(word), None, "{word}");
        }
        for figure in Figure::iter() {
            assert_eq!(Condition::parse(&format!("{}>0", figure.key())).map(|c| c.figure), Some(figure));
        }
    }

    #[test]
    fn the_worst_is_what_failed_then_what_is_far_off() {
        let order = |figure: Figure, mut values: Vec<f64>| {
            values.sort_by(|a, b| figure.worse(*a, *b));
            values.iter().map(|v| figure.text(*v)).collect::<Vec<_>>()
        };
        assert_eq!(order(Figure::Angle, vec![0.0, 1.0, f64::NAN]), ["no pose", "57.3°", "0.0°"]);
        assert_eq!(order(Figure::Psnr, vec![30.0, 12.0]), ["12.0 dB", "30.0 dB"]);
        assert_eq!(order(Figure::Rms, vec![0.001, 0.002]), ["2.00 mm", "1.00 mm"]);
    }
}
