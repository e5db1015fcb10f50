//! What `generate` answers: the metrics of each prediction, their means, and the table.

use serde::Serialize;

use super::super::seeds::SeedFigures;
use crate::domain::ambiguity::{Ambiguity, Touch};
use crate::domain::findings::Finding;
use crate::domain::metrics;
use crate::domain::rig::Text;
use crate::domain::sample::Scale;
use crate::work::compare::Comparison;

/// What a prediction is measured in.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    Meters,
    /// Of 0..255: a color picture.
    Levels,
}

/// What PSNR and SSIM of a color picture mean.
pub(super) const COLOR_CONVENTION: &str = "difference image of the color sensor on the 0..255 scale, peak and range 255; the split \
    by footprint, contact and pose need depth and are left out";

/// Metrics of one prediction. PSNR and SSIM are those of `convention`.
#[derive(Debug, Default, Clone, Serialize)]
pub(super) struct Pair {
    pub(super) name: String,
    pub(super) finger: Text,
    pub(super) psnr_db: Option<f64>,
    pub(super) ssim: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) vqvae_psnr_db: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) vqvae_ssim: Option<f64>,
    /// The figures apart for what the GelSlim saw and for what lies outside its footprint; errors in meters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) seen: Option<metrics::PixelMetrics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) invented: Option<metrics::PixelMetrics>,
    /// Whether the GelSlim image tells where on the tool it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) ambiguity: Option<Ambiguity>,
    /// Of the prediction; where both fingers were predicted in one go, half of it.
    pub(super) seconds: f64,
    /// Whether it was made before and only read now.
    pub(super) kept: bool,
    /// With `--seeds`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) ensemble: Option<SeedFigures>,
}

#[derive(Debug, Serialize)]
pub(super) struct Mean {
    pub(super) psnr_db: Option<f64>,
    pub(super) ssim: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) vqvae_psnr_db: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) vqvae_ssim: Option<f64>,
    /// Means over the pairs: inside the GelSlim's footprint, and outside.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) seen: Option<PartMean>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) invented: Option<PartMean>,
    /// Pairs whose GelSlim image leaves the place along a bare shaft open.
    pub(super) ambiguous: usize,
    pub(super) seconds: Option<f64>,
}

/// Means of the figures of one part.
#[derive(Debug, Serialize)]
pub(super) struct PartMean {
    pub(super) psnr_db: Option<f64>,
    pub(super) ssim: Option<f64>,
    pub(super) mae_m: Option<f64>,
    pub(super) bias_m: Option<f64>,
}

impl PartMean {
    fn of(pairs: &[Pair], part: fn(&Pair) -> Option<metrics::PixelMetrics>) -> Option<Self> {
        let all: Vec<metrics::PixelMetrics> = pairs.iter().filter_map(part).collect();
        let of = |get: fn(&metrics::PixelMetrics) -> Option<f64>| average(all.iter().filter_map(get));
        (!all.is_empty()).then(|| Self {
            psnr_db: of(|f| f.psnr_db),
            ssim: of(|f| f.ssim),
            mae_m: of(|f| f.mae),
            bias_m: of(|f| f.bias),
        })
    }
}

pub(super) fn average(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub(super) pairs: Vec<Pair>,
    pub(super) mean: Mean,
    pub(super) convention: &'static str,
    pub(super) bundle: String,
    pub(super) runtime: &'static str,
    pub(super) sampler: &'static str,
    pub(super) steps: u32,
    pub(super) seed: u64,
    pub(super) guidance: f64,
    /// What is odd about the files, by kind.
    pub(super) notes: Vec<Finding>,
}

/// What PSNR and SSIM mean here.
pub(super) fn convention(scale: Scale) -> &'static str {
    match scale {
        Scale::Measured => "depth in meters, PSNR peak and SSIM range 0.0225 m (the lab's peak)",
        Scale::Assumed => "both images scaled to 0..1 one by one, peak and range 1 (the source lost its scale)",
    }
}

pub(super) fn take(pair: &mut Pair, found: &Comparison) {
    (pair.psnr_db, pair.ssim) = (found.psnr_db, found.ssim);
    pair.seen = found.split.map(|s| s.seen);
    pair.invented = found.split.map(|s| s.invented);
}

pub(super) fn mean(pairs: &[Pair]) -> Mean {
    let of = |get: fn(&Pair) -> Option<f64>| average(pairs.iter().filter_map(get));
    Mean {
        psnr_db: of(|p| p.psnr_db),
        ssim: of(|p| p.ssim),
        vqvae_psnr_db: of(|p| p.vqvae_psnr_db),
        vqvae_ssim: of(|p| p.vqvae_ssim),
        seen: PartMean::of(pairs, |p| p.seen),
        invented: PartMean::of(pairs, |p| p.invented),
        ambiguous: pairs.iter().filter(|p| p.ambiguity.is_some_and(|a| a.kind == Touch::BareShaft)).count(),
        seconds: of(|p| Some(p.seconds)),
    }
}

pub(super) fn text(report: &Report) -> String {
    let number = |v: Option<f64>, digits: usize| v.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let mut text = format!(
        "{:<44} {:>8} {:>6} {:>8} {:>8} {:>12} {:>10} {:>8}\n",
        "pair", "PSNR dB", "SSIM", "seen dB", "inv. dB", "VQ-VAE dB", "VQ-VAE SSIM", "seconds"
    );
    let mut line = |name: &str, p: &Mean, note: &str| {
        let part = |part: &Option<PartMean>| number(part.as_ref().and_then(|p| p.psnr_db), 1);
        text += &format!(
            "{name:<44} {:>8} {:>6} {:>8} {:>8} {:>12} {:>10} {:>8}{note}\n",
            number(p.psnr_db, 1),
            number(p.ssim, 3),
            part(&p.seen),
            part(&p.invented),
            number(p.vqvae_psnr_db, 1),
            number(p.vqvae_ssim, 3),
            number(p.seconds, 2)
        );
    };
    for p in &report.pairs {
        let name = format!("{} {}", p.name, p.finger);
        let note = p.ambiguity.and_then(|a| a.caption()).map_or(String::new(), |c| format!("  {c}"));
        line(&name, &mean(std::slice::from_ref(p)), &note);
    }
    line("mean", &report.mean, "");
    text + &format!(
        "\n{}; seen = inside the GelSlim's footprint, inv. = invented outside it\n{} of {} GelSlim images are ambiguous \
         (bare shaft); {} steps, seed {}, {} on {}\n",
        report.convention,
        report.mean.ambiguous,
        report.pairs.len(),
        report.steps,
        report.seed,
        report.bundle,
        report.runtime
    )
}
