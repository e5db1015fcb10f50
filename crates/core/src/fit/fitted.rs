//! [`Fitted`]: the corrections of a rig, and what they were made from.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::grid::Grid;
use crate::markers::{likeness, signature};
use crate::postprocess::Correction;
use crate::rig::{PadId, PerPad};
use crate::sample::{Sample, Scale};

/// Source of a fit: the data and the bundle that it was made from, as they stand in a bundle's manifest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitSource {
    /// The name of the data.
    pub data: String,
    /// The name of the rig.
    pub rig: String,
    /// Scale: whether meters were measured or assumed.
    pub scale: Scale,
    /// The pairs.
    pub pairs: Vec<String>,
    /// Digests of the pictures that were predicted from, by which the data are known under whatever name; empty in fits of
    /// older programs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pictures: Vec<String>,
    /// The name of the bundle that was fitted.
    pub from: String,
    /// SHA-256 of that bundle.
    pub from_sha256: String,
}

impl FitSource {
    /// True where both are of the same data, as far as can be told: of a picture in common, else of the same name, rig
    /// and a pair in common.
    pub fn same_data(&self, other: &Self) -> bool {
        let common = |a: &[String], b: &[String]| a.iter().any(|one| b.contains(one));
        if self.pictures.is_empty() || other.pictures.is_empty() {
            return (&self.data, &self.rig) == (&other.data, &other.rig) && common(&self.pairs, &other.pairs);
        }
        common(&self.pictures, &other.pictures)
    }

    /// Difference of these data from those it was fitted to, in words; `None` where it sees none.
    pub fn misgiving(&self, sample: &Sample) -> Option<String> {
        let rig = (self.rig != sample.rig.name).then(|| format!("taken with the rig {}", self.rig));
        let scale = || format!("whose meters were {}", self.scale.key());
        let other = rig.or_else(|| (self.scale != sample.scale).then(scale))?;
        Some(format!(
            "the model was fitted to {} pairs of {}, {other}: on these data it is worse than unfitted",
            self.pairs.len(),
            self.data
        ))
    }
}

/// Fit of one pad.
#[derive(Clone, Debug, PartialEq)]
pub struct PadFit {
    /// Correction that its predictions need.
    pub correction: Arc<Correction>,
    /// Lattice of its GelSlim, where pictures were fitted.
    pub lattice: Option<Grid<f32>>,
}

/// A fit of a generator to a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Data and bundle that it was made from.
    pub source: FitSource,
    /// In the order of the rig's pads.
    pub pads: PerPad<PadFit>,
}

impl Fitted {
    /// The pad that a touch is of: as the sample says, or, for pictures, which do not say it, by the lattice.
    pub fn pad(&self, sample: &Sample, pad: PadId) -> PadId {
        if sample.scale != Scale::Assumed {
            return pad;
        }
        let Some(own) = sample.pad(pad).and_then(|t| t.color()).and_then(|c| signature(&c.difference)) else {
            return pad;
        };
        let known = self.pads.entries().filter_map(|(id, fit)| Some((id, likeness(&own, fit.lattice.as_ref()?))));
        known.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(pad, |(id, _)| id)
    }

    /// The correction of a touch's prediction; `None` where the fit had no pair of its pad.
    pub fn correction(&self, sample: &Sample, pad: PadId) -> Option<&Arc<Correction>> {
        Some(&self.pads.get(self.pad(sample, pad))?.correction)
    }
}
