//! Result of a touch, as it is written and said.

use serde::Serialize;
use serde_json::Value;

use super::Source;
use super::summary::Latency;
use touch2touch_core::contact::ContactMask;
use touch2touch_core::dataset::Problem;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::{PadId, Text};
use touch2touch_core::sample::Sample;
use touch2touch_core::verdict::Verdict;
use touch2touch_pipeline::compare;
use touch2touch_pipeline::steps::mask::Contact;
use touch2touch_pipeline::steps::prediction::Prediction;

/// Metrics of one finger.
#[derive(Debug, Clone, Serialize)]
pub(super) struct FingerFigures {
    pub(super) finger: Text,
    pub(super) min_m: f64,
    pub(super) max_m: f64,
    pub(super) mean_m: f64,
    pub(super) contact_px: Option<usize>,
    /// Basis of the mask: the source's key, `depth` where the mask model found nothing, `flat` where there is no
    /// contact.
    pub(super) mask: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) psnr_db: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) ssim: Option<f64>,
}

/// A pose, in the lab's sense of the angle.
#[derive(Debug, Clone, Serialize)]
pub(super) struct PoseMetrics {
    pub(super) tool: String,
    pub(super) angle_deg: f64,
    pub(super) y_m: f64,
    pub(super) z_m: f64,
    pub(super) grasp_from_object: PlanarPose,
    /// Standard deviation of the angle, and the covariance of `grasp_from_object` (angle in radians, y and z in meters).
    pub(super) angle_sd_deg: Option<f64>,
    pub(super) covariance: Option<[[f64; 3]; 3]>,
    /// Reliance that the pose deserves, without the truth.
    pub(super) verdict: Option<Verdict>,
    pub(super) rms_m: f64,
    pub(super) points: usize,
    pub(super) stop: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) truth_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) error_deg: Option<f64>,
}

/// A result, as it is written and said.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Done {
    pub(super) name: String,
    pub(super) source: Source,
    pub(super) recipe: Value,
    pub(super) files: Vec<String>,
    /// Oddities of the touch's files.
    pub(super) notes: Vec<Problem>,
    pub(super) scale: &'static str,
    pub(super) fingers: Vec<FingerFigures>,
    /// Why masks are not made of the source that was asked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) mask_notes: Vec<String>,
    pub(super) pose: Option<PoseMetrics>,
    /// Why there is no pose.
    pub(super) no_pose: Option<String>,
    /// Up to the writing of this very file; the event and the summary include it.
    pub(super) latency: Latency,
    pub(super) error: Option<String>,
    #[serde(skip)]
    pub(super) fresh: bool,
}

impl Done {
    pub(super) fn text(&self) -> String {
        let pose = match (&self.pose, &self.no_pose) {
            (Some(p), _) => format!("{:.1} deg, y {:.2} mm, z {:.2} mm", p.angle_deg, p.y_m * 1e3, p.z_m * 1e3),
            (None, Some(why)) => format!("no pose: {why}"),
            (None, None) => "no pose".to_owned(),
        };
        let l = &self.latency;
        let when = if self.fresh { format!("{:.0} ms after it was closed", l.total) } else { "lay there".to_owned() };
        format!("{}: {pose} ({when}; generator {:.0} ms)", self.name, l.generate)
    }
}

/// Numbers of one prediction, against the measurement where there is one.
pub(super) fn figures(
    sample: &Sample,
    pad: PadId,
    contact: &Contact,
    drawn: Option<(&Prediction, ShiftMode)>,
    tile: Option<&DepthMap>,
) -> Option<FingerFigures> {
    let imprint = contact.imprints[pad].as_ref()?;
    let stats = touch2touch_core::postprocess::Stats::of(imprint);
    let compared = compare::of_pad(imprint, drawn, sample, pad, tile).ok().flatten();
    let mask = contact.masks[pad].as_ref();
    let count = |found: &ContactMask| found.mask.as_slice().iter().filter(|&&m| m).count();
    Some(FingerFigures {
        finger: sample.rig.pad_key(pad),
        min_m: stats.min,
        max_m: stats.max,
        mean_m: stats.mean,
        contact_px: mask.map(count),
        mask: mask.map_or(contact.source().key(), |found| found.basis.key(contact.source().key())),
        psnr_db: compared.as_ref().and_then(|c| c.psnr_db),
        ssim: compared.as_ref().and_then(|c| c.ssim),
    })
}
