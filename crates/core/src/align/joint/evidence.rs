//! Evidence for and against a pose that needs no truth: what the tool explains of contact and membrane, and what it does not.

use serde::{Deserialize, Serialize};

use super::JointConfig;
use super::cost::{Relief, noise_m};
use super::problem::Problem;
use super::smooth::BANDS;
use crate::align::Scene;
use crate::align::batch::State;
use crate::frames::PlanarPose;
use crate::mesh::sampling::spread;
use crate::tool::ToolModel;

/// Contact points at most this far outside the silhouette lie on the tool, meters: a pixel of the mask and a half.
const ON_TOOL_M: f64 = 1e-3;
/// Most contact points that are looked at.
const POINTS: usize = 1024;

/// Places of the membranes that are compared in each band.
const PLACES: usize = 800;
/// Widths of the kernels, meters, band by band: what noise and the template's own error leave there.
const KERNELS_M: [f64; BANDS.len()] = [1e-3, 0.5e-3, 0.25e-3];

/// Evidence for and against a pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Share of all contact points with a place that lie on the tool, 0 to 1. 0 without any.
    pub on_tool: f64,
    /// The membranes' part, from wide bands of lengths to narrow ones, where their images are known and show where the
    /// membranes would meet.
    pub membrane: Option<[BandEvidence; BANDS.len()]>,
}

/// Relief of the membranes that the tool explains in one band of lengths. Squared heights are capped by a kernel, so that a few
/// pixels that are far off decide nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BandEvidence {
    /// Share of the relief that the tool explains, at most 1; that of the finger with the smaller share.
    pub explained: f64,
    /// Share of the relief that the membranes have and the tool would not make, 0 to 1.
    pub foreign: f64,
    /// Share of the relief that the tool would make and the membranes lack, 0 to 1.
    pub missing: f64,
    /// 1.48 times the median residual, meters.
    pub noise_m: f64,
}

impl Evidence {
    /// The evidence at `grasp_from_object`. Some tenths of a millisecond, and the first time for a tool what its templates
    /// take.
    pub fn at(scene: &Scene<'_>, tool: &ToolModel, grasp_from_object: PlanarPose) -> Self {
        let finite: Vec<_> = scene.yz().iter().filter(|p| p.is_finite()).collect();
        let object_from_grasp = grasp_from_object.inverse();
        let chosen = spread(finite.len(), POINTS);
        let on = chosen
            .iter()
            .filter(|&&i| tool.field.sample(object_from_grasp.transform_yz(*finite[i])).distance <= ON_TOOL_M);
        let on_tool = on.count() as f64 / chosen.len().max(1) as f64;
        let config = JointConfig::default();
        let problem = Problem::new(scene, tool, &config).ok().flatten();
        let bands = |problem: Problem<'_>| std::array::from_fn(|band| problem.evidence(grasp_from_object, band));
        Self { on_tool, membrane: problem.map(bands) }
    }
}

fn share(part: f64, of: f64) -> f64 {
    if of > 0.0 { part / of } else { 0.0 }
}

impl Problem<'_> {
    /// The evidence of the membranes at a pose.
    fn evidence(&self, grasp_from_object: PlanarPose, band: usize) -> BandEvidence {
        let state = State::from_pose(grasp_from_object, self.centroid());
        let patches = self.patches_of(band, PLACES);
        let fingers: Vec<Relief> = patches.chunks(1).map(|patch| Relief::of(patch, state, KERNELS_M[band])).collect();
        let sum = |of: fn(&Relief) -> f64| fingers.iter().map(of).sum::<f64>();
        let seen = fingers.iter().filter(|finger| !finger.residuals_m.is_empty());
        BandEvidence {
            explained: seen.map(Relief::explained).fold(1.0, f64::min),
            foreign: share(sum(|r| r.foreign), sum(|r| r.image)),
            missing: share(sum(|r| r.missing), sum(|r| r.template)),
            noise_m: noise_m(fingers.into_iter().flat_map(|finger| finger.residuals_m).collect()),
        }
    }
}
