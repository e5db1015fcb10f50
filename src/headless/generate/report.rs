//! Answer of `generate`: the metrics of each prediction, their means, and the table.

use serde::Serialize;

use touch2touch_core::evaluation;
use touch2touch_core::findings::Finding;
use touch2touch_core::metrics::Unstretched;
use touch2touch_core::rig::Text;
use touch2touch_core::sample::Scale;

/// Meaning of PSNR and SSIM of a color picture.
pub(super) const COLOR_CONVENTION: &str = "difference image of the color sensor on the 0..255 scale, peak and range 255; the split \
    by footprint, contact and pose need depth and are left out";

/// Metrics of predictions. PSNR and SSIM are those of `convention`.
#[derive(Debug, Default, Clone, Serialize)]
pub(super) struct Figures {
    pub(super) psnr_db: Option<f64>,
    pub(super) ssim: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) vqvae_psnr_db: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) vqvae_ssim: Option<f64>,
    /// Metrics where the scale was assumed: of the pictures as they are, and after the best straight line.
    #[serde(flatten)]
    pub(super) unstretched: Option<Unstretched>,
    #[serde(flatten)]
    pub(super) vqvae: Option<Stored>,
}

/// One prediction.
#[derive(Debug, Default, Clone, Serialize)]
pub(super) struct Pair {
    pub(super) name: String,
    pub(super) finger: Text,
    #[serde(flatten)]
    pub(super) figures: Figures,
    /// Of the prediction; where both fingers were predicted in one go, half of it.
    pub(super) seconds: f64,
    /// True where it was made before and only read now.
    pub(super) kept: bool,
}

#[derive(Debug, Serialize)]
pub(super) struct Mean {
    #[serde(flatten)]
    pub(super) figures: Figures,
    pub(super) seconds: Option<f64>,
}

/// [`Unstretched`] metrics of the prediction that lay by.
#[derive(Debug, Clone, Copy, Serialize)]
#[serde(into = "StoredKeys")]
pub(super) struct Stored(pub(super) Unstretched);

/// [`Stored`] under its keys.
#[derive(Serialize)]
struct StoredKeys {
    vqvae_psnr_raw_db: Option<f64>,
    vqvae_ssim_raw: Option<f64>,
    vqvae_psnr_line_db: Option<f64>,
}

impl From<Stored> for StoredKeys {
    fn from(Stored(of): Stored) -> Self {
        Self { vqvae_psnr_raw_db: of.psnr_raw_db, vqvae_ssim_raw: of.ssim_raw, vqvae_psnr_line_db: of.psnr_line_db }
    }
}

/// Means over the pictures that have them.
fn unstretched_mean(all: impl Iterator<Item = Unstretched>) -> Option<Unstretched> {
    let all: Vec<Unstretched> = all.collect();
    (!all.is_empty()).then(|| Unstretched {
        psnr_raw_db: evaluation::mean(all.iter().filter_map(|u| u.psnr_raw_db)),
        ssim_raw: evaluation::mean(all.iter().filter_map(|u| u.ssim_raw)),
        psnr_line_db: evaluation::mean(all.iter().filter_map(|u| u.psnr_line_db)),
    })
}

/// The answer.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub(super) pairs: Vec<Pair>,
    pub(super) mean: Mean,
    pub(super) convention: String,
    pub(super) bundle: String,
    pub(super) runtime: String,
    pub(super) sampler: String,
    pub(super) steps: u32,
    pub(super) seed: u64,
    /// Oddities of the files, by kind.
    pub(super) notes: Vec<Finding>,
}

/// Meaning of PSNR and SSIM for the scale.
pub(super) fn convention(scale: Scale) -> &'static str {
    match scale {
        Scale::Measured => "depth in meters, PSNR peak and SSIM range 0.0225 m (the lab's peak)",
        Scale::Assumed => {
            "both images stretched to 0..1 one by one, peak and range 1 (the source lost its scale; no noise-free picture passes \
             20 dB so); raw: as they are, in the assumed meters; line: after the best straight line"
        }
    }
}

pub(super) fn mean(pairs: &[Pair]) -> Mean {
    let of = |get: fn(&Figures) -> Option<f64>| evaluation::mean(pairs.iter().filter_map(|pair| get(&pair.figures)));
    let figures = Figures {
        psnr_db: of(|f| f.psnr_db),
        ssim: of(|f| f.ssim),
        vqvae_psnr_db: of(|f| f.vqvae_psnr_db),
        vqvae_ssim: of(|f| f.vqvae_ssim),
        unstretched: unstretched_mean(pairs.iter().filter_map(|p| p.figures.unstretched)),
        vqvae: unstretched_mean(pairs.iter().filter_map(|p| Some(p.figures.vqvae?.0))).map(Stored),
    };
    Mean { figures, seconds: evaluation::mean(pairs.iter().map(|pair| pair.seconds)) }
}

/// The report as a table of its pairs.
pub(super) fn text(report: &Report) -> String {
    let pairs = &report.pairs;
    let number = |v: Option<f64>, digits: usize| v.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let mut text = format!(
        "{:<44} {:>8} {:>6} {:>12} {:>10} {:>8}\n",
        "pair", "PSNR dB", "SSIM", "VQ-VAE dB", "VQ-VAE SSIM", "seconds"
    );
    let mut line = |name: &str, p: &Figures, seconds: Option<f64>| {
        text += &format!(
            "{name:<44} {:>8} {:>6} {:>12} {:>10} {:>8}\n",
            number(p.psnr_db, 1),
            number(p.ssim, 3),
            number(p.vqvae_psnr_db, 1),
            number(p.vqvae_ssim, 3),
            number(seconds, 2)
        );
    };
    for p in pairs {
        let name = format!("{} {}", p.name, p.finger);
        line(&name, &p.figures, Some(p.seconds));
    }
    line("mean", &report.mean.figures, report.mean.seconds);
    text + &format!(
        "{}\n{}\n{} steps, seed {}, {} on {}\n",
        unstretched_text(&report.mean.figures),
        report.convention,
        report.steps,
        report.seed,
        report.bundle,
        report.runtime
    )
}

/// The means that do not stretch, as a line of their own.
fn unstretched_text(mean: &Figures) -> String {
    let number = |v: Option<f64>, digits: usize| v.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let Some(own) = mean.unstretched else { return String::new() };
    let line = |of: Unstretched| {
        let (raw, ssim, line) = (number(of.psnr_raw_db, 1), number(of.ssim_raw, 3), number(of.psnr_line_db, 1));
        format!("raw {raw} dB, SSIM {ssim}, line {line} dB")
    };
    let stored = mean.vqvae.map_or(String::new(), |Stored(of)| format!("; VQ-VAE {}", line(of)));
    format!("unstretched: {}{stored}\n", line(own))
}
