//! Answer of `pose`: the cases, their metrics, and the table.

use std::collections::BTreeMap;

use serde::Serialize;

use touch2touch_core::align::{AlignReport, Evidence, PoseAnswer};
use touch2touch_core::findings::Finding;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::metrics::AngleSummary;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::symmetry::Symmetry;
use touch2touch_core::verdict::{Grade, Verdict};
use touch2touch_core::which_tool::Candidate;

#[derive(Debug, Clone, Serialize)]
pub(super) struct PoseRow {
    pub(super) name: String,
    #[serde(rename = "engine")]
    pub(super) registration: String,
    pub(super) imprint: &'static str,
    /// With `--tool any`: all tools that can be aligned, the likeliest first; the pose is that one's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) tools: Option<Vec<RankedTool>>,
    /// With `--tool any`: the answer in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) which_tool: Option<String>,
    /// Bases of the masks: the source's key, `hand` where one was drawn, `depth` where the mask model found nothing,
    /// `flat` where the imprint is flat; of both fingers (right, left) where they differ.
    pub(super) mask: String,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) mask_notes: Vec<String>,
    pub(super) angle_deg: Option<f64>,
    /// Standard deviation of the angle.
    pub(super) angle_sd_deg: Option<f64>,
    /// Reliance that the pose deserves, without the truth; none without a pose.
    pub(super) verdict: Option<Verdict>,
    /// Evidence that the verdict is from, with the covariance of the pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) evidence: Option<Evidence>,
    /// Poses that the touch allows, the answer first, where the range is wide.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) answers: Vec<AnswerRow>,
    pub(super) truth_deg: Option<f64>,
    pub(super) error_deg: Option<f64>,
    pub(super) y_m: Option<f64>,
    pub(super) z_m: Option<f64>,
    /// Time of the registration, milliseconds; 0 without a pose.
    pub(super) ms: f64,
    pub(super) stop: String,
    /// Pose that a person accepted for this imprint in the studio, where there are labels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) accepted: Option<Accepted>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) report: Option<AlignReport>,
}

/// A pose that the touch allows, in the sense of the other numbers of a [`PoseRow`].
#[derive(Debug, Clone, Copy, Serialize)]
pub(in crate::headless) struct AnswerRow {
    pub(super) angle_deg: f64,
    pub(super) y_m: f64,
    pub(super) z_m: f64,
    /// Chance that it is this one if it is one of them, 0 to 1.
    pub(super) weight: f64,
}

impl AnswerRow {
    pub(in crate::headless) fn new(answer: &PoseAnswer) -> Self {
        let PlanarPose { theta_rad, y_m, z_m } = answer.grasp_from_object.inverse();
        Self { angle_deg: theta_rad.to_degrees(), y_m, z_m, weight: answer.weight }
    }
}

/// A tool that was tried.
#[derive(Debug, Clone, Serialize)]
pub(super) struct RankedTool {
    pub(super) tool: String,
    /// Chance that it is this one if it is one of them, 0 to 1.
    pub(super) chance: f64,
    pub(super) angle_deg: f64,
    pub(super) verdict: Option<Verdict>,
}

impl RankedTool {
    pub(super) fn new(candidate: &Candidate) -> Self {
        Self {
            tool: candidate.tool.clone(),
            chance: candidate.chance,
            angle_deg: candidate.report.lab_angle_rad().to_degrees(),
            verdict: Verdict::of(&candidate.report),
        }
    }
}

/// An accepted pose in the sense of the other numbers of a [`PoseRow`].
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct Accepted {
    /// True where a person set it, rather than took over what a registration answered.
    pub(super) by_hand: bool,
    pub(super) angle_deg: f64,
    pub(super) error_deg: Option<f64>,
    pub(super) y_m: f64,
    pub(super) z_m: f64,
    /// The pose as it is stored.
    pub(super) grasp_from_object: PlanarPose,
}

impl Accepted {
    pub(super) fn new(accepted: AcceptedPose, truth: Option<(PlanarPose, &ToolModel)>) -> Self {
        let found = accepted.pose.inverse();
        let off = truth.map(|(truth, tool)| Symmetry::of(tool).difference(accepted.pose, truth));
        Self {
            by_hand: accepted.by_hand,
            angle_deg: found.theta_rad.to_degrees(),
            error_deg: off.map(|off| off.angle_rad.to_degrees()),
            y_m: found.y_m,
            z_m: found.z_m,
            grasp_from_object: accepted.pose,
        }
    }
}

#[derive(Debug, Clone, Serialize)]
pub(super) struct AngleMetrics {
    #[serde(flatten)]
    pub(super) angles: AngleSummary,
    pub(super) median_ms: Option<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct Summary {
    /// The figures of the first registration on the first kind of imprint, which [`Self::of`] names.
    #[serde(flatten)]
    pub(super) first: AngleMetrics,
    pub(super) of: First,
    /// `registration` (first kind of imprint) and `registration/imprint` (all): the figures of each.
    #[serde(rename = "engines")]
    pub(super) registrations: BTreeMap<String, AngleMetrics>,
}

/// The registration and the kind of imprint that a summary begins with.
#[derive(Debug, Clone, Serialize)]
pub(super) struct First {
    #[serde(rename = "engine")]
    pub(super) registration: String,
    pub(super) imprint: String,
}

/// The answer.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub(super) cases: Vec<PoseRow>,
    pub(super) summary: Summary,
    /// Oddities of the files and of the numbers in them, by kind.
    pub(super) notes: Vec<Finding>,
}

fn metrics<'a>(cases: impl Iterator<Item = &'a PoseRow>) -> AngleMetrics {
    let cases: Vec<&PoseRow> = cases.collect();
    // A case without truth has no error; one without a pose is a failure.
    let errors: Vec<f64> =
        cases.iter().filter(|c| c.truth_deg.is_some()).map(|c| c.error_deg.map_or(f64::NAN, f64::to_radians)).collect();
    let mut ms: Vec<f64> = cases.iter().map(|c| c.ms).collect();
    ms.sort_by(f64::total_cmp);
    let median_ms = (!ms.is_empty()).then(|| 0.5 * (ms[(ms.len() - 1) / 2] + ms[ms.len() / 2]));
    AngleMetrics { angles: AngleSummary::from_errors(&errors), median_ms }
}

pub(super) fn summary(cases: &[PoseRow], first: First) -> Summary {
    let of = |by: &str, imprint: &str| {
        metrics(cases.iter().filter(|case| case.registration == by && case.imprint == imprint))
    };
    let mut registrations = BTreeMap::new();
    for PoseRow { registration, imprint, .. } in cases {
        let key = format!("{registration}/{imprint}");
        if !registrations.contains_key(&key) {
            let figures = of(registration, imprint);
            if *imprint == first.imprint {
                registrations.insert(registration.clone(), figures.clone());
            }
            registrations.insert(key, figures);
        }
    }
    Summary { first: of(&first.registration, &first.imprint), of: first, registrations }
}

pub(super) fn text(report: &Report) -> String {
    let number = |v: Option<f64>| v.map_or("      -".to_owned(), |v| format!("{v:7.2}"));
    let mut text = format!(
        "{:<44} {:>9} {:>7} {:>9} {:>9}  {:<7} mask, stop\n",
        "pair", "angle °", "± °", "truth °", "error °", "verdict"
    );
    for c in &report.cases {
        text += &format!(
            "{:<44} {:>9} {:>7} {:>9} {:>9}  {:<7} {}/{}/{}: {}\n",
            c.name,
            number(c.angle_deg),
            number(c.angle_sd_deg),
            number(c.truth_deg),
            number(c.error_deg),
            c.verdict.as_ref().map_or_else(|| "-".to_owned(), |verdict| verdict.grade.to_string()),
            c.registration,
            c.imprint,
            c.mask,
            c.stop
        );
        text.extend(c.which_tool.iter().map(|words| format!("    tool: {words}\n")));
        for ranked in c.tools.iter().flatten().take(3) {
            text += &format!("    {:>3.0} % {}\n", 100.0 * ranked.chance, ranked.tool);
        }
        if let Some(verdict) = c.verdict.as_ref().filter(|verdict| verdict.grade > Grade::Good) {
            text += &format!("    {}: {} ({})\n", verdict.grade, verdict.why, verdict.parts_text());
        }
    }
    text + "\n" + &summary_text(&report.summary)
}

/// The table of the summary.
pub(super) fn summary_text(summary: &Summary) -> String {
    let number = |v: Option<f64>| v.map_or("      -".to_owned(), |v| format!("{v:7.2}"));
    let mut text = format!(
        "{:<28} {:>5} {:>9} {:>9} {:>7} {:>7} {:>10}\n",
        "registration/imprint", "n", "mean °", "median °", "<=5° %", "<=10° %", "median ms"
    );
    for (key, f) in summary.registrations.iter().filter(|(k, _)| k.contains('/')) {
        let a = f.angles;
        text += &format!(
            "{key:<28} {:>5} {:>9} {:>9} {:>7.1} {:>7.1} {:>10}\n",
            a.count,
            number(a.mean_deg),
            number(a.median_deg),
            a.success_5,
            a.success_10,
            f.median_ms.map_or("-".to_owned(), |v| format!("{v:.3}"))
        );
    }
    text
}
