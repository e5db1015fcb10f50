//! Contact points to the tool's pose in the hand, with its error where the truth is known: [`pose`].

use std::time::Instant;

use glam::{DAffine3, DVec3};

use crate::error::TaskError;
use touch2touch_core::align::{AlignReport, Ask, Contacts, Evidence, PointFit, Register, Scene, TraceStep};
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::PoseDifference;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::symmetry::Symmetry;
use touch2touch_core::units;
use touch2touch_core::verdict::Verdict;

/// A registered pose.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseResult {
    /// The tool in the hand.
    pub grasp_from_object: PlanarPose,
    /// Place along x, in the CAD model's file, of the middle that `grasp_from_object` measures x from, meters.
    pub middle_x_m: f64,
    /// The angle that the lab reports: of `object_from_grasp`, radians.
    pub angle_rad: f64,
    /// The true angle in the same sense, where known; of equal ones, by the tool's symmetry, the one nearest to the answer.
    pub truth_rad: Option<f64>,
    /// Size of the angle's error, where the truth is known.
    pub error_rad: Option<f64>,
    /// Root mean square of the residuals, meters.
    pub rms_m: f64,
    /// Contact points registered.
    pub num_points: usize,
    /// Why it stopped, in words.
    pub stop: String,
    /// True where it stopped because nothing moved any more.
    pub converged: bool,
    /// Time it took, milliseconds.
    pub ms: f64,
    /// Reliance that it deserves, without the truth; `None` where its evidence was not asked for.
    pub verdict: Option<Verdict>,
    /// Everything the registration says about itself; with trace and fits only of a recorded run.
    pub report: AlignReport,
}

impl PoseResult {
    /// Pose the other way round; its angle is the number that the lab reports.
    pub fn object_from_grasp(&self) -> PlanarPose {
        self.grasp_from_object.inverse()
    }

    /// Motion that takes points of the CAD model, as its file has them, to the grasp frame.
    pub fn grasp_from_cad(&self) -> DAffine3 {
        self.grasp_from_cad_at(self.grasp_from_object)
    }

    /// [`PoseResult::grasp_from_cad`] at another pose of the same tool.
    pub fn grasp_from_cad_at(&self, grasp_from_object: PlanarPose) -> DAffine3 {
        grasp_from_object.to_affine() * DAffine3::from_translation(DVec3::new(-self.middle_x_m, 0.0, 0.0))
    }

    /// Standard deviation of the angle, radians, where the evidence was asked for.
    pub fn angle_sd_rad(&self) -> Option<f64> {
        Some(self.report.evidence?.uncertainty.angle_rad())
    }

    /// Difference from the true pose, or from the nearest that the symmetry of the tool makes equal to it.
    pub fn off(&self, truth: PlanarPose, tool: &ToolModel) -> PoseDifference {
        Symmetry::of(tool).difference(self.grasp_from_object, truth)
    }

    /// `-2.1° ± 0.3°`.
    pub fn angle_text(&self) -> String {
        let angle = units::text_deg(self.angle_rad);
        self.angle_sd_rad().map_or(angle.clone(), |spread| format!("{angle} ± {}", units::text_deg(spread)))
    }

    /// The same, of equal answers the nearest to another pose.
    #[must_use]
    pub fn kept_to(mut self, last: PlanarPose) -> Self {
        self.report.keep_to(last);
        let turned = self.report.lab_angle_rad() - self.angle_rad;
        (self.grasp_from_object, self.angle_rad) = (self.report.grasp_from_object, self.report.lab_angle_rad());
        self.truth_rad = self.truth_rad.map(|truth| units::wrap_angle(truth + turned));
        self
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.report.trace.len() * size_of::<TraceStep>()
            + self.report.fits.len() * size_of::<PointFit>()
    }
}

/// The pose of the tool from contact points (grasp frame, meters) and the images that they are from. `truth` is `grasp_from_object`, where known.
///
/// # Errors
/// If there are too few points, or they are nowhere near the tool.
pub fn pose<'a>(
    contacts: impl Into<Contacts<'a>>,
    tool: &ToolModel,
    registration: &dyn Register,
    ask: Ask<'_>,
    truth: Option<PlanarPose>,
) -> Result<PoseResult, TaskError> {
    let contacts = contacts.into();
    let start = Instant::now();
    let scene = Scene::new(contacts);
    let found = registration.run(&scene, tool, Ask { evidence: false, ..ask });
    let mut report = found.map_err(|err| TaskError::from_error("Pose", &err))?;
    // The time of the registration, not that of its evidence.
    let ms = start.elapsed().as_secs_f64() * 1e3;
    if ask.evidence {
        Evidence::gather(&scene, tool, &mut report);
    }
    let angle_rad = report.lab_angle_rad();
    // Of the true poses that no touch tells apart, the one nearest to the answer: errors are up to the tool's symmetry.
    let truth_rad = truth.map(|t| Symmetry::of(tool).nearest(t, report.grasp_from_object).inverse().theta_rad);
    Ok(PoseResult {
        grasp_from_object: report.grasp_from_object,
        middle_x_m: tool.middle_x_m,
        angle_rad,
        truth_rad,
        error_rad: truth_rad.map(|t| units::angle_error(angle_rad, t)),
        rms_m: report.inlier_rms_m,
        num_points: contacts.points.len(),
        stop: report.stop.to_string(),
        converged: report.converged,
        ms,
        verdict: Verdict::of(&report),
        report,
    })
}
