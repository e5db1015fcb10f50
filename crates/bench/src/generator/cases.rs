//! Simulated grasps, and how far a prediction of one is from the truth.

use rayon::prelude::*;

use touch2touch_core::align::Contacts;
use touch2touch_core::catalog;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::metrics::{self, AngleSummary};
use touch2touch_core::pose::{Registration, ToolModel, register};
use touch2touch_core::rig::{PadId, PerPad, lab};
use touch2touch_core::sample::{DepthTouch, Sample};
use touch2touch_core::sim::{self, SimConfig};
use touch2touch_core::units::angle_error;
use touch2touch_pipeline::compare::LAB_PEAK_M;
use touch2touch_pipeline::infer::mask::MaskModel;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::steps::cloud::{contact_points, images};

/// A grasp of a simulated tool.
pub(super) struct Case {
    pub(super) name: String,
    pub(super) sample: Sample,
    pub(super) tool: std::sync::Arc<ToolModel>,
    pub(super) truth: PlanarPose,
}

/// Score of a prediction.
pub(super) struct Score {
    /// Mean squared error over all pixels of both fingers, against the noise-free imprint.
    pub(super) mse_m2: f64,
    /// By finger.
    pub(super) psnr_db: [Option<f64>; 2],
    /// Error of the angle; `None` if there is no pose.
    pub(super) error_rad: Option<f64>,
}

/// `count` grasps, spread over the tools of which `wanted` says whether (by "seen in training").
///
/// # Errors
/// If no tool is wanted, or a CAD model cannot be used.
pub(super) fn simulate(count: usize, seed: u64, wanted: impl Fn(bool) -> bool) -> anyhow::Result<Vec<Case>> {
    let specs: Vec<_> = catalog::tools().iter().filter(|tool| wanted(tool.seen)).collect();
    anyhow::ensure!(!specs.is_empty(), "there are no such tools");
    let models = specs
        .iter()
        .map(|spec| Ok(std::sync::Arc::new(ToolModel::new(spec.mesh())?)))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let config = SimConfig::default();
    (0..count)
        .into_par_iter()
        .map(|i| {
            let (spec, n) = (specs[i % specs.len()], i as u64 ^ seed.rotate_left(32));
            let sample = sim::simulate(spec, sim::random_grasp(n), n, &config);
            let truth = sample.grasp_from_object.ok_or_else(|| anyhow::anyhow!("a simulated grasp without a pose"))?;
            let name = format!("{} {}", spec.name, i / specs.len());
            Ok(Case { name, sample, tool: models[i % specs.len()].clone(), truth })
        })
        .collect()
}

fn bubble(sample: &Sample, finger: PadId) -> anyhow::Result<&DepthTouch> {
    let touch = sample.pad(finger).and_then(|touch| touch.depth());
    touch.ok_or_else(|| anyhow::anyhow!("a simulated grasp has both bubbles"))
}

/// Finds masks and poses of imprints.
pub(super) struct Judge {
    masks: MaskModel,
    registration: Registration,
}

impl Judge {
    pub(super) fn new(masks: MaskModel, registration: Registration) -> Self {
        Self { masks, registration }
    }

    /// The pose errors of the imprints that were measured.
    pub(super) fn measured(&mut self, cases: &[Case]) -> anyhow::Result<AngleSummary> {
        let mut errors = Vec::new();
        for case in cases {
            let imprints = [bubble(&case.sample, lab::RIGHT)?, bubble(&case.sample, lab::LEFT)?];
            errors.push(
                self.error_rad(case, (ImprintSource::Measured, &imprints.map(|b| b.imprint.clone())))?
                    .unwrap_or(f64::NAN),
            );
        }
        Ok(AngleSummary::from_errors(&errors))
    }

    /// Predicted imprints by [`PadId`], meters.
    pub(super) fn score(&mut self, case: &Case, imprints: &[DepthMap; 2]) -> anyhow::Result<Score> {
        let (mut mse, mut psnr_db) = (0.0, [None, None]);
        for finger in lab::PADS {
            let truth = bubble(&case.sample, finger)?.truth.as_ref();
            let truth = &truth.ok_or_else(|| anyhow::anyhow!("a simulated grasp knows its truth"))?.imprint;
            let imprint = &imprints[finger.index()];
            mse += 0.5 * metrics::mse(imprint, truth)?;
            psnr_db[finger.index()] = metrics::psnr(imprint, truth, LAB_PEAK_M)?;
        }
        Ok(Score { mse_m2: mse, psnr_db, error_rad: self.error_rad(case, (ImprintSource::Predicted, imprints))? })
    }

    fn error_rad(
        &mut self,
        case: &Case,
        (source, imprints): (ImprintSource, &[DepthMap; 2]),
    ) -> anyhow::Result<Option<f64>> {
        let mut contact = |imprint| Ok::<_, anyhow::Error>(Some((*self.masks.contact(imprint)?.mask).clone()));
        let masks: PerPad<Mask> = [contact(&imprints[0])?, contact(&imprints[1])?].into();
        let imprints = [Some(&imprints[0]), Some(&imprints[1])].into();
        let points = contact_points(&case.sample, &imprints, &masks.as_ref())?;
        let contacts = Contacts { points: &points, images: &images(&case.sample, &imprints, source) };
        // Too few contact points are no pose; that is counted.
        let report = register(contacts, &case.tool, self.registration, false).ok();
        Ok(report.map(|r| angle_error(r.grasp_from_object.theta_rad, case.truth.theta_rad)))
    }
}
