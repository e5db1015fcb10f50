//! [`Correction`]: what a fit to pairs of one pad adds to the depth chain.
//!
//! A prediction is first moved to where the pad's sensors lie ([`CorrectionPart::Offset`]), and its values brought to the
//! sensor's scale by one straight line. Then comes what all imprints of the pad share and predictions lack
//! ([`CorrectionPart::Field`]), how much of its deviation from the mean prediction is believed at each pixel
//! ([`CorrectionPart::Gain`]), and what predictions of this shape are known to miss ([`CorrectionPart::Response`]).
//! Everything is at the decoder's size, in meters, before the picture is resized and turned.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use strum::IntoEnumIterator as _;

use crate::grid::{DepthMap, Grid};
use crate::resample::moved;

/// A part of a correction that can be switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum CorrectionPart {
    /// The place of the pad's window.
    Offset,
    /// The straight line, and the mean residual.
    Field,
    /// The share of the deviation from the mean prediction.
    Gain,
    /// The residual that predictions of such a shape are known to leave.
    Response,
}

impl CorrectionPart {
    /// The name on screen.
    pub fn label(self) -> &'static str {
        match self {
            Self::Offset => "Offset",
            Self::Field => "Line and field",
            Self::Gain => "Gain",
            Self::Response => "Response",
        }
    }

    /// Effect of the part, in a sentence.
    pub fn tip(self) -> &'static str {
        match self {
            Self::Offset => "moves the prediction to where the pad's sensors lie",
            Self::Field => "brings it to the sensor's scale and adds what all its imprints share",
            Self::Gain => "weighs how far it departs from the mean prediction, pixel by pixel",
            Self::Response => "adds what predictions of this shape were found to miss",
        }
    }
}

/// Set of parts that are applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(from = "Vec<CorrectionPart>", into = "Vec<CorrectionPart>")]
pub struct CorrectionParts(u8);

impl CorrectionParts {
    /// Every part.
    pub const ALL: Self = Self(0b1111);
    /// No part: the prediction as the model draws it.
    pub const NONE: Self = Self(0);

    /// True where a part is applied.
    pub fn has(self, part: CorrectionPart) -> bool {
        self.0 & (1 << part as u8) != 0
    }

    /// With a part switched on or off.
    #[must_use]
    pub fn with(self, part: CorrectionPart, on: bool) -> Self {
        if on { Self(self.0 | 1 << part as u8) } else { Self(self.0 & !(1 << part as u8)) }
    }
}

impl From<Vec<CorrectionPart>> for CorrectionParts {
    fn from(parts: Vec<CorrectionPart>) -> Self {
        parts.into_iter().fold(Self::NONE, |all, part| all.with(part, true))
    }
}

impl From<CorrectionParts> for Vec<CorrectionPart> {
    fn from(parts: CorrectionParts) -> Self {
        CorrectionPart::iter().filter(|part| parts.has(*part)).collect()
    }
}

/// Residual that predictions of some shapes are known to leave: linear in the picture's components.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Subtracted first, meters.
    pub center: Grid<f32>,
    /// Unit pictures that the rest is projected on.
    pub basis: Vec<Grid<f32>>,
    /// Pictures added per meter of each component.
    pub answers: Vec<Grid<f32>>,
}

/// The correction of one pad. All pictures are of the decoder's size.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// From where a prediction is drawn to where it belongs: `[right, down]`, pixels.
    pub offset_px: [f64; 2],
    /// `gain · d + offset`: the gain, and the offset in meters.
    pub line: [f64; 2],
    /// The mean of the moved predictions on the line, meters.
    pub mean: Grid<f32>,
    /// Added, meters.
    pub field: Grid<f32>,
    /// Factor of the deviation from `mean`.
    pub gain: Grid<f32>,
    /// Shared by the pads of a fit.
    pub response: Option<Arc<Response>>,
    /// Parts of it that are applied.
    pub parts: CorrectionParts,
}

impl Correction {
    /// True where a part is applied.
    pub fn has(&self, part: CorrectionPart) -> bool {
        self.parts.has(part)
    }

    /// True where every picture is of this size and every number finite.
    pub fn fits(&self, size: [usize; 2]) -> bool {
        let response = self.response.iter().flat_map(|r| r.basis.iter().chain(&r.answers).chain([&r.center]));
        let finite = |g: &Grid<f32>| g.size() == size && g.as_slice().iter().all(|v| v.is_finite());
        let paired = self.response.as_ref().is_none_or(|r| r.basis.len() == r.answers.len());
        self.offset_px.iter().chain(&self.line).all(|v| v.is_finite())
            && paired
            && [&self.mean, &self.field, &self.gain].into_iter().chain(response).all(finite)
    }

    /// A picture in meters at its place: [`CorrectionPart::Offset`].
    pub fn placed(&self, meters: &DepthMap) -> DepthMap {
        if self.has(CorrectionPart::Offset) { moved(meters, self.offset_px) } else { meters.clone() }
    }

    /// A placed picture on the sensor's scale with the mean residual: [`CorrectionPart::Field`].
    pub(crate) fn leveled(&self, placed: &DepthMap) -> DepthMap {
        if !self.has(CorrectionPart::Field) {
            return placed.clone();
        }
        self.zipped(&self.on_line(placed), |i, v| v + self.field.as_slice()[i])
    }

    /// Picture with the gain on a placed picture's deviation from the mean, meters: [`CorrectionPart::Gain`].
    pub(crate) fn weighed(&self, placed: &DepthMap, leveled: &DepthMap) -> DepthMap {
        if !self.has(CorrectionPart::Gain) {
            return leveled.clone();
        }
        let (own, mean, gain) = (self.on_line(placed), self.mean.as_slice(), self.gain.as_slice());
        self.zipped(leveled, |i, v| v + (gain[i] - 1.0) * (own.as_slice()[i] - mean[i]))
    }

    /// Picture with the known residual added, meters: [`CorrectionPart::Response`].
    pub fn answered(&self, placed: &DepthMap, weighed: &DepthMap) -> DepthMap {
        let Some(response) = self.response.as_ref().filter(|_| self.has(CorrectionPart::Response)) else {
            return weighed.clone();
        };
        let own = self.on_line(placed);
        let mut out = weighed.clone();
        for (basis, answer) in response.basis.iter().zip(&response.answers) {
            let pixels = own.as_slice().iter().zip(response.center.as_slice()).zip(basis.as_slice());
            let score: f64 = pixels.map(|((v, c), b)| f64::from(v - c) * f64::from(*b)).filter(|v| v.is_finite()).sum();
            for (value, answer) in out.as_mut_slice().iter_mut().zip(answer.as_slice()) {
                *value += (score * f64::from(*answer)) as f32;
            }
        }
        out
    }

    /// The whole correction of a picture in meters.
    pub fn apply(&self, meters: &DepthMap) -> DepthMap {
        let placed = self.placed(meters);
        let weighed = self.weighed(&placed, &self.leveled(&placed));
        self.answered(&placed, &weighed)
    }

    /// The straight line alone.
    pub(crate) fn on_line(&self, meters: &DepthMap) -> DepthMap {
        let [gain, offset_m] = self.line;
        meters.map(|&v| (f64::from(v) * gain + offset_m) as f32)
    }

    fn zipped(&self, image: &DepthMap, f: impl Fn(usize, f32) -> f32) -> DepthMap {
        let width = image.width();
        Grid::from_fn(width, image.height(), |x, y| f(y * width + x, image[(x, y)]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn correction() -> Correction {
        let unit = Grid::from_fn(8, 6, |x, y| if (x, y) == (2, 2) { 1.0 } else { 0.0 });
        Correction {
            offset_px: [1.0, 2.0],
            line: [2.0, 0.001],
            mean: Grid::filled(8, 6, 0.003),
            field: Grid::filled(8, 6, 0.01),
            gain: Grid::filled(8, 6, 0.5),
            response: Some(Arc::new(Response {
                center: Grid::filled(8, 6, 0.003),
                basis: vec![unit],
                answers: vec![Grid::filled(8, 6, 10.0)],
            })),
            parts: CorrectionParts::ALL,
        }
    }

    #[test]
    fn each_part_does_what_it_says_and_can_be_switched_off() {
        let image = Grid::from_fn(8, 6, |x, y| if (x, y) == (1, 0) { 0.005 } else { 0.001 });
        let mut fit = correction();
        // On the line: 0.011 at (2, 2) and 0.003 elsewhere; half of the deviation stays, the field comes on top, and the
        // component of 0.008 is answered with 0.08 everywhere.
        let out = fit.apply(&image);
        assert!((out[(2, 2)] - (0.003 + 0.004 + 0.01 + 0.08)).abs() < 1e-6, "{}", out[(2, 2)]);
        assert!((out[(5, 5)] - (0.003 + 0.01 + 0.08)).abs() < 1e-6);
        fit.parts = CorrectionParts::ALL.with(CorrectionPart::Response, false).with(CorrectionPart::Gain, false);
        assert_eq!(CorrectionParts::from(Vec::from(fit.parts)), fit.parts);
        assert!((fit.apply(&image)[(2, 2)] - 0.021).abs() < 1e-6);
        fit.parts = CorrectionParts::NONE;
        assert_eq!(fit.apply(&image), image);
        assert!(fit.fits([8, 6]) && !fit.fits([6, 8]));
        fit.gain[(0, 0)] = f32::NAN;
        assert!(!fit.fits([8, 6]));
    }
}
