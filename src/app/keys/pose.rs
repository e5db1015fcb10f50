//! Keys of clouds and poses, and of what is looked at of a registration.

use std::sync::Arc;

use super::super::keys::{ImprintKey, ImprintSource, LayersKey, MaskVersion, PairKey, Registration};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::PerPad;
use touch2touch_pipeline::steps::recipe::Recipe;

/// A cloud of both fingers: imprint and (where one can be had) mask of each finger.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CloudKey {
    /// Per finger.
    pub parts: PerPad<(ImprintKey, Option<MaskVersion>)>,
}

impl CloudKey {
    /// The pair and imprint it belongs to.
    pub fn place(&self) -> Option<(PairKey, ImprintSource)> {
        let (imprint, _) = self.parts.iter().flatten().next()?;
        Some((imprint.touch().pair, imprint.side()))
    }
}

/// A pose of a cloud.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PoseKey {
    /// The cloud whose contact points are registered.
    pub cloud: CloudKey,
    /// The tool.
    pub tool: Arc<str>,
    /// The registration.
    pub registration: Registration,
}

impl PoseKey {
    /// The key of a cloud and a tool by a recipe.
    pub(crate) fn of(cloud: CloudKey, tool: Arc<str>, recipe: &Recipe) -> Self {
        Self { cloud, tool, registration: recipe.registration }
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
    pub pose: PoseKey,
    /// The pose that it starts at (`grasp_from_object`); `None` = where the registration starts by itself.
    pub start: Option<PoseBits>,
}

impl LayersKey {
    /// The recorded registration that they are of.
    pub(crate) fn run(&self) -> RunKey {
        RunKey { pose: self.0.clone(), start: None }
    }
}
