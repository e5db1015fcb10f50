//! Keys of imprints, of estimates made from them, and of what is looked at of these.

use std::sync::Arc;

use super::super::keys::{
    ImprintSource, LayersKey, MaskRecipe, PairKey, PredictionKey, Registration, Revision, ShiftMode, TouchKey,
};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::PerPad;
use touch2touch_pipeline::labels::ImprintOf;
use touch2touch_pipeline::steps::recipe::Stage;

/// One imprint in meters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ImprintKey {
    /// Measured: it is in the sample.
    Measured(TouchKey),
    /// Derived from a prediction.
    Predicted(PredictionKey, ShiftMode),
    /// The mean of several predictions.
    Mean(MeanKey),
    /// The prediction of another program that lies beside the pair.
    Picture(TouchKey),
}

impl ImprintKey {
    /// The touch it belongs to.
    pub fn touch(&self) -> TouchKey {
        match self {
            Self::Measured(touch) | Self::Picture(touch) => *touch,
            Self::Predicted(recipe, _) => recipe.touch,
            Self::Mean(key) => key.touch,
        }
    }

    /// The name by which masks drawn on it are told; `None` where nobody can have drawn on it.
    pub fn of(&self) -> Option<ImprintOf> {
        match self {
            Self::Measured(_) => Some(ImprintOf::Measured),
            Self::Predicted(recipe, shift) => Some(ImprintOf::predicted(&recipe.bundle, &recipe.config, *shift)),
            Self::Mean(_) | Self::Picture(_) => None,
        }
    }

    /// The side that it is shown on where there are two.
    pub fn side(&self) -> ImprintSource {
        match self {
            Self::Measured(_) => ImprintSource::Measured,
            Self::Predicted(..) | Self::Mean(_) | Self::Picture(_) => ImprintSource::Predicted,
        }
    }
}

/// The mean of several predictions of one touch.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MeanKey {
    /// The touch.
    pub touch: TouchKey,
    /// At least one; they differ in their seeds.
    pub recipes: Vec<PredictionKey>,
    /// The mapping to meters.
    pub shift: ShiftMode,
}

/// The mask of an imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MaskVersion {
    /// Automatic.
    Auto(MaskRecipe),
    /// Corrected by hand.
    Hand(Revision),
}

/// One imprint against another of the same touch.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ComparisonKey {
    /// One: the error map is its imprint minus the other's.
    pub a: ImprintKey,
    /// The other.
    pub b: ImprintKey,
}

impl ComparisonKey {
    /// A prediction against the measurement of its touch.
    pub fn measured(recipe: PredictionKey, shift: ShiftMode) -> Self {
        Self { b: ImprintKey::Measured(recipe.touch), a: ImprintKey::Predicted(recipe, shift) }
    }
}

/// The estimate of a pair up to a stage: the imprints of its fingers with their masks, and what is registered to which tool.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EstimateKey {
    /// Per finger the imprint, and from [`Stage::Mask`] on its mask where one can be made.
    pub parts: PerPad<(ImprintKey, Option<MaskVersion>)>,
    /// Of a pose, tool and registration.
    pub pose: Option<(Arc<str>, Registration)>,
    /// The stage.
    pub stage: Stage,
}

impl EstimateKey {
    /// The imprint of one finger.
    pub(crate) fn imprint(imprint: &ImprintKey) -> Self {
        Self::one(imprint, None, Stage::Imprint)
    }

    /// The mask of one finger's imprint.
    pub(crate) fn mask(imprint: &ImprintKey, mask: MaskVersion) -> Self {
        Self::one(imprint, Some(mask), Stage::Mask)
    }

    fn one(imprint: &ImprintKey, mask: Option<MaskVersion>, stage: Stage) -> Self {
        let mut parts = PerPad::default();
        parts[imprint.touch().finger] = Some((imprint.clone(), mask));
        Self { parts, pose: None, stage }
    }

    /// The cloud of imprints with their masks.
    pub(crate) fn cloud(parts: PerPad<(ImprintKey, Option<MaskVersion>)>) -> Self {
        Self { parts, pose: None, stage: Stage::Cloud }
    }

    /// The cloud that a pose is of.
    pub(crate) fn its_cloud(&self) -> Self {
        Self::cloud(self.parts.clone())
    }

    /// The pose of a cloud, of a tool by a registration.
    pub(crate) fn posed(self, tool: &str, registration: Registration) -> Self {
        Self { pose: Some((tool.into(), registration)), stage: Stage::Pose, ..self }
    }

    /// The keys of what is in it besides, as if that were all.
    pub(crate) fn within(&self) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for (imprint, mask) in self.parts.iter().flatten() {
            all.push(Self::imprint(imprint));
            all.extend(mask.clone().map(|mask| Self::mask(imprint, mask)));
        }
        all.extend((self.stage > Stage::Cloud).then(|| self.its_cloud()));
        all.retain(|key| key != self);
        all
    }

    /// The pair and imprint it belongs to.
    pub fn place(&self) -> Option<(PairKey, ImprintSource)> {
        let (imprint, _) = self.parts.iter().flatten().next()?;
        Some((imprint.touch().pair, imprint.side()))
    }
}

/// A pose (`grasp_from_object`) that compares and hashes by its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PoseBits([u64; 3]);

impl From<PlanarPose> for PoseBits {
    fn from(pose: PlanarPose) -> Self {
        Self([pose.theta_rad, pose.y_m, pose.z_m].map(f64::to_bits))
    }
}

impl PoseBits {
    /// The pose.
    pub fn get(self) -> PlanarPose {
        let [theta_rad, y_m, z_m] = self.0.map(f64::from_bits);
        PlanarPose { theta_rad, y_m, z_m }
    }
}

/// A registration with everything recorded: every step, and what became of every point.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RunKey {
    /// The pose that the registration makes.
    pub pose: EstimateKey,
    /// The pose that it starts at (`grasp_from_object`); `None` = where the registration starts by itself.
    pub start: Option<PoseBits>,
}

impl LayersKey {
    /// The recorded registration that they are of.
    pub(crate) fn run(&self) -> RunKey {
        RunKey { pose: self.0.clone(), start: None }
    }
}
