//! `touch2touch generate`: predicted imprints of a whole dataset, beside the measured ones.

use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use serde::Serialize;

use super::args::{DatasetArgs, LimitArgs};
use super::guard::{Bug, guarded};
use super::notes::Notes;
use super::output::says;
use super::predict::{ModelArgs, Predictor};
use super::report::{RunReport, output_stems};
use super::seeds::{self, SeedArgs, SeedFigures};
use super::{Common, Output, VerbResult};
use crate::domain::ambiguity::{Ambiguity, Touch, ambiguity};
use crate::domain::dataset::PairId;
use crate::domain::findings::Finding;
use crate::domain::grid::{DepthMap, RgbGrid};
use crate::domain::rig::{PadId, Rig, Text};
use crate::domain::sample::{Sample, Scale};
use crate::domain::{metrics, resample};
use crate::io::dataset::{Dataset, assumed_meters};
use crate::io::images;
use crate::io::names::with_ending;
use crate::work::compare::{self, Comparison};
use crate::work::imprint::{self, imprint_of};
use crate::work::job::JobCx;

/// Arguments of `generate`.
#[derive(Debug, Args)]
pub(super) struct GenerateArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The folder for the predictions; created if missing.
    #[arg(long)]
    out: PathBuf,
    /// Which finger's GelSlim image: right, left (or as the data set names it), both.
    #[arg(long, default_value = "right")]
    finger: FingerArg,
    #[command(flatten)]
    limit: LimitArgs,
    #[command(flatten)]
    ensemble: SeedArgs,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

/// Which finger's image: the name of one, or `both`, which means all.
#[derive(Debug, Clone)]
pub(super) struct FingerArg(String);

impl FromStr for FingerArg {
    type Err = Infallible;

    fn from_str(name: &str) -> Result<Self, Infallible> {
        Ok(Self(name.to_lowercase()))
    }
}

impl FingerArg {
    /// The fingers it stands for. A rig with a single one has no other, however it is called.
    pub(super) fn fingers(&self, rig: &Rig) -> anyhow::Result<Vec<PadId>> {
        let all = rig.pad_list();
        if self.0 == "both" || all.len() == 1 {
            return Ok(all);
        }
        let finger = rig.pad_of_key(&self.0).ok_or_else(|| {
            let names: Vec<_> = all.iter().map(|pad| rig.pad_key(*pad)).collect();
            anyhow::anyhow!("there is no finger \"{}\"; name one of {} or both", self.0, names.join(", "))
        })?;
        Ok(vec![finger])
    }
}

/// What a prediction is measured in.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Unit {
    Meters,
    /// Of 0..255: a color picture.
    Levels,
}

/// What PSNR and SSIM of a color picture mean.
const COLOR_CONVENTION: &str = "difference image of the color sensor on the 0..255 scale, peak and range 255; the split \
    by footprint, contact and pose need depth and are left out";

/// Metrics of one prediction. PSNR and SSIM are those of `convention`.
#[derive(Debug, Default, Clone, Serialize)]
struct Pair {
    name: String,
    finger: Text,
    psnr_db: Option<f64>,
    ssim: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    vqvae_psnr_db: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    vqvae_ssim: Option<f64>,
    /// The figures apart for what the GelSlim saw and for what lies outside its footprint; errors in meters.
    #[serde(skip_serializing_if = "Option::is_none")]
    seen: Option<metrics::PixelMetrics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    invented: Option<metrics::PixelMetrics>,
    /// Whether the GelSlim image tells where on the tool it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    ambiguity: Option<Ambiguity>,
    /// Of the prediction; where both fingers were predicted in one go, half of it.
    seconds: f64,
    /// Whether it was made before and only read now.
    kept: bool,
    /// With `--seeds`.
    #[serde(skip_serializing_if = "Option::is_none")]
    ensemble: Option<SeedFigures>,
}

#[derive(Debug, Serialize)]
struct Mean {
    psnr_db: Option<f64>,
    ssim: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    vqvae_psnr_db: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    vqvae_ssim: Option<f64>,
    /// Means over the pairs: inside the GelSlim's footprint, and outside.
    #[serde(skip_serializing_if = "Option::is_none")]
    seen: Option<PartMean>,
    #[serde(skip_serializing_if = "Option::is_none")]
    invented: Option<PartMean>,
    /// Pairs whose GelSlim image leaves the place along a bare shaft open.
    ambiguous: usize,
    seconds: Option<f64>,
}

/// Means of the figures of one part.
#[derive(Debug, Serialize)]
struct PartMean {
    psnr_db: Option<f64>,
    ssim: Option<f64>,
    mae_m: Option<f64>,
    bias_m: Option<f64>,
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

fn average(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

#[derive(Debug, Serialize)]
struct Report {
    pairs: Vec<Pair>,
    mean: Mean,
    convention: &'static str,
    bundle: String,
    runtime: &'static str,
    sampler: &'static str,
    steps: u32,
    seed: u64,
    guidance: f64,
    /// What is odd about the files, by kind.
    notes: Vec<Finding>,
}

/// What PSNR and SSIM mean here.
fn convention(scale: Scale) -> &'static str {
    match scale {
        Scale::Measured => "depth in meters, PSNR peak and SSIM range 0.0225 m (the lab's peak)",
        Scale::Assumed => "both images scaled to 0..1 one by one, peak and range 1 (the source lost its scale)",
    }
}

pub(super) fn run(args: &GenerateArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let ids = args.limit.spread(dataset.index.pairs.len());
    let fingers = args.finger.fingers(&dataset.rig)?;
    let output = Output::new(args.common, "generating", ids.len());
    let mut predictor = Predictor::new(&args.model, &dataset.rig);
    let config = predictor.config()?;
    let stems = output_stems(&args.out, &dataset, &ids)?;
    let begun = RunReport::begin(&args.out, "generate.json", ids.len())?;
    let mut pairs = Vec::new();
    let mut notes = Notes::default();
    let mut complete = !ids.is_empty();
    let mut scale = Scale::Measured;
    let mut unit = Unit::Meters;
    for (id, stem) in ids.into_iter().zip(stems) {
        let id = PairId(id as u32);
        let name = dataset.index.pairs[id.0 as usize].name.clone();
        output.step(&name);
        let done = guarded(dataset.pair_files(id), || {
            let sample = dataset.load(id)?;
            scale = sample.scale;
            notes.take(&output, &sample.notes);
            // An image folder has one finger, whichever it was.
            let present: Vec<PadId> = fingers.iter().copied().filter(|f| sample.pad(*f).is_some()).collect();
            let fingers = if present.is_empty() { sample.rig.pad_list() } else { present };
            let mut made = Vec::new();
            let mut touches = Vec::new();
            for finger in fingers {
                let Some(touch) = sample.pad(finger) else { continue };
                let Some(picture) = predictor.condition(touch)? else { return Err(predictor.no_condition()) };
                touches.push((finger, touch, picture));
            }
            let pictures: Vec<_> = touches.iter().map(|(_, _, picture)| &**picture).collect();
            let predictions = predictor.predict(&pictures, &JobCx::unwatched())?;
            for ((finger, touch, _), predicted) in touches.iter().zip(predictions) {
                let finger = *finger;
                let key = sample.rig.pad_key(finger);
                let stem = with_ending(&stem, &format!("_{key}"));
                let (seconds, kept) = (predicted.seconds, predicted.kept);
                let ambiguity = touch.color().and_then(|g| ambiguity(&g.difference));
                let mut pair = Pair { name: name.clone(), finger: key, ambiguity, seconds, kept, ..Pair::default() };
                if let Some(difference) = imprint::color(&predicted, [0, 0])? {
                    unit = Unit::Levels;
                    write_color(&stem, &difference)?;
                    if let Some(measured) = touch.color() {
                        let [w, h] = measured.difference.size();
                        let sized = resample::bilinear_rgb(&difference, w, h);
                        let (psnr, ssim) = metrics::color(&sized, &measured.difference)?;
                        (pair.psnr_db, pair.ssim) = (psnr.db(), Some(ssim));
                    }
                    made.push(pair);
                    continue;
                }
                let imprint = imprint_of(&predicted, predictor.shift(), &sample, finger)?;
                write(&stem, &imprint)?;
                score(&dataset, id, (finger, &sample), &imprint, &mut pair)?;
                if args.ensemble.seeds > 1 {
                    let found = seeds::predict(&mut predictor, &sample, finger, args.ensemble.seeds)?;
                    let mut of_mean = Pair::default();
                    score(&dataset, id, (finger, &sample), &found.spread.mean, &mut of_mean)?;
                    let scores = (of_mean.psnr_db, of_mean.ssim);
                    pair.ensemble = Some(seeds::write(&stem, &found, config.seed, scores)?);
                }
                made.push(pair);
            }
            Ok(made)
        });
        match done {
            Ok(made) => pairs.extend(made),
            Err(err) => {
                output.note(&format!("{name}: {}", says(&err)));
                if err.is::<Bug>() {
                    predictor.recover();
                }
                complete = false;
            }
        }
    }
    let report = Report {
        mean: mean(&pairs),
        convention: if unit == Unit::Levels { COLOR_CONVENTION } else { convention(scale) },
        bundle: predictor.bundle()?.name.clone(),
        runtime: predictor.engine_label()?,
        sampler: config.sampler.key(),
        steps: config.steps,
        seed: config.seed,
        guidance: config.guidance,
        notes: notes.into_list(&output),
        pairs,
    };
    begun.finish(&report)?;
    output.finish(&report, || text(&report))?;
    Ok(complete)
}

/// Fills in the figures of a prediction against the measured imprint, and of the lab's own prediction where it lies by.
fn score(
    dataset: &Dataset,
    id: PairId,
    (finger, sample): (PadId, &Sample),
    imprint: &DepthMap,
    pair: &mut Pair,
) -> anyhow::Result<()> {
    let tile = compare::tile_of(dataset, id, sample)?;
    if let Some(found) = compare::of_pad(imprint, sample, finger, tile.as_ref())? {
        take(pair, &found);
    }
    if let Some(tile) = tile
        && let Some(vqvae) = dataset.vqvae_tile(id, sample.laid)?.as_ref().map(assumed_meters)
    {
        let theirs = compare::tiles(&vqvae, &tile, sample, finger)?;
        (pair.vqvae_psnr_db, pair.vqvae_ssim) = (theirs.psnr_db, theirs.ssim);
    }
    Ok(())
}

fn take(pair: &mut Pair, found: &Comparison) {
    (pair.psnr_db, pair.ssim) = (found.psnr_db, found.ssim);
    pair.seen = found.split.map(|s| s.seen);
    pair.invented = found.split.map(|s| s.invented);
}

/// Writes `STEM.npy` (meters, f32, 140 x 175, raw orientation) and a 16-bit picture of it (0.001 mm steps from
/// -20 mm) for people.
fn write(stem: &Path, imprint: &DepthMap) -> anyhow::Result<()> {
    crate::io::npz::write_npy(&with_ending(stem, ".npy"), imprint)?;
    let picture = imprint.map(|&d| ((d + 0.02) * 1e6).clamp(0.0, 65535.0) as u16);
    images::write_gray16(&with_ending(stem, ".png"), &picture)?;
    Ok(())
}

/// Writes `STEM.png`: the difference of a color sensor's images around the middle gray, in its raw orientation;
/// and `STEM.npy` with the numbers (f32, 3 x height x width).
fn write_color(stem: &Path, difference: &RgbGrid) -> anyhow::Result<()> {
    crate::io::npz::write_npy_planes(&with_ending(stem, ".npy"), difference)?;
    let picture = difference.map(|pixel| pixel.map(|v| v + 128.0));
    images::write_rgb8(&with_ending(stem, ".png"), &picture)?;
    Ok(())
}

fn mean(pairs: &[Pair]) -> Mean {
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

fn text(report: &Report) -> String {
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
