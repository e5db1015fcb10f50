//! `touch2touch ledger`: everything between a decoder's picture and meters, for one touch.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde::Serialize;

use super::args::{DatasetArgs, FingerArg};
use super::notes::Notes;
use super::recipe::ModelArgs;
use super::{Common, Output, VerbResult};
use touch2touch_core::ambiguity::{Ambiguity, ambiguity};
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::findings::Finding;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::metrics::Line;
use touch2touch_core::picture::colored;
use touch2touch_core::postprocess::{ChainReading, Flag, Histogram, Ledger, Orientation, Stats};
use touch2touch_core::rig::{PadId, Text};
use touch2touch_core::units::{fixed, mm};
use touch2touch_work::io::images;
use touch2touch_work::job::JobCx;
use touch2touch_work::labels::ImprintSource;
use touch2touch_work::ledger::{LedgerResult, of_prediction};
use touch2touch_work::on_pad::OnPad;

/// Arguments of `ledger`.
#[derive(Debug, Args)]
pub(super) struct LedgerArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pair, by its name or a part of it that no other has.
    #[arg(long)]
    pair: String,
    /// Finger whose chain is shown (an image folder has only one).
    #[arg(long, default_value = "right")]
    finger: FingerArg,
    /// Read the decoder's range as it is meant instead of twice; leaves no shift to be done.
    #[arg(long, value_enum, conflicts_with = "shift")]
    mapping: Option<MappingArg>,
    /// A folder for a picture of every stage (16-bit PNG, stretched to its own range) and of the joint histogram;
    /// created if missing.
    #[arg(long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    model: ModelArgs,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum MappingArg {
    /// As the model means it, without a shift.
    Correct,
    /// Twice, as the released script does; the shift (see --shift) follows.
    Doubled,
}

#[derive(Debug, Serialize)]
struct StageReport {
    name: String,
    how: String,
    /// `m` or `1` (the decoder's -1 to 1).
    unit: &'static str,
    size: [usize; 2],
    stats: Stats,
    /// Pixels that are no numbers.
    invalid: usize,
    histogram: Histogram,
    #[serde(skip_serializing_if = "Option::is_none")]
    note: Option<String>,
}

#[derive(Debug, Serialize)]
struct AgainstReport {
    /// Pixels compared.
    pixels: usize,
    /// `prediction = slope · truth + offset` (offset and deviation in meters).
    line: Option<Line>,
    correlation: Orientation,
    joint: JointReport,
}

#[derive(Debug, Serialize)]
struct JointReport {
    /// Ends of both axes, meters.
    range_m: [f64; 2],
    bins: usize,
    /// Row by row: one row per prediction bin (smallest first), one number per truth bin.
    counts: Vec<Vec<u32>>,
}

#[derive(Debug, Serialize)]
struct Report {
    pair: String,
    finger: Text,
    bundle: String,
    bundle_hash: String,
    shift: &'static str,
    steps: u32,
    seed: u64,
    scale: &'static str,
    stages: Vec<StageReport>,
    against_truth: Option<AgainstReport>,
    /// Depth of the picture by every other way to meters.
    readings: Vec<ChainReading>,
    ambiguity: Option<Ambiguity>,
    flags: Vec<Flag>,
    /// Oddities of the files.
    notes: Vec<Finding>,
}

pub(super) fn run(args: &LedgerArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let id = super::find_pair(&dataset, &args.pair)?;
    let name = dataset.index.pairs[id.0 as usize].name.clone();
    let sample = dataset.load(id)?;
    // An image folder has one finger, whichever it was.
    let there: Vec<PadId> = sample.pads.entries().map(|(finger, _)| finger).collect();
    let asked = args.finger.fingers(&sample.rig)?;
    let finger = match (&there[..], &asked[..]) {
        ([only], _) | (_, [only]) => *only,
        _ => anyhow::bail!("--finger both: the depth chain is that of one finger; name it"),
    };
    let key = sample.rig.pad_key(finger);
    let touch = sample.pad(finger).ok_or_else(|| anyhow::anyhow!("{name}: there is no {key} finger"))?;

    let output = Output::new(args.common, "generating", 1);
    let mut notes = Notes::of(&dataset);
    notes.take(&output, &sample.notes);
    let models = args.model.models();
    let recipe = args.model.recipe(ImprintSource::Predicted, &dataset.rig)?;
    let (generating, shift) = (recipe.generating()?, recipe.shift);
    let config = *generating.config;
    if generating.picture(&sample, finger)?.is_none() {
        anyhow::bail!("{name}: {}", generating.no_input(&sample.rig).why);
    }
    let on = OnPad { sample: &sample, pad: finger };
    let made = generating.seeds(&models, on, &[config.seed], &JobCx::unwatched())?.pop();
    let made = made.ok_or_else(|| anyhow::anyhow!("the generator gave no prediction"))?;
    let correct = matches!(args.mapping, Some(MappingArg::Correct));
    let shift_name = if correct { "Correct mapping" } else { shift.label() };
    let LedgerResult { ledger: found, readings } = of_prediction(&made, shift, correct, on)?;
    if let Some(out) = &args.out {
        std::fs::create_dir_all(out)
            .map_err(|err| anyhow::anyhow!("cannot create the output folder: {err}: {}", out.display()))?;
        pictures(out, &found)?;
    }
    let report = Report {
        pair: name,
        finger: key,
        bundle: generating.bundle.name.clone(),
        bundle_hash: made.bundle.to_string(),
        shift: shift_name,
        steps: config.steps,
        seed: config.seed,
        scale: sample.scale.key(),
        against_truth: found.against.as_ref().map(|a| AgainstReport {
            pixels: a.joint.pixels,
            line: a.joint.line,
            correlation: a.orientation,
            joint: JointReport {
                range_m: [a.joint.lo, a.joint.hi],
                bins: a.joint.counts.width(),
                counts: (0..a.joint.counts.height()).map(|y| a.joint.counts.row(y).to_vec()).collect(),
            },
        }),
        stages: found.stages.iter().map(stage).collect(),
        readings,
        ambiguity: touch.color().and_then(|color| ambiguity(&color.difference)),
        flags: found.flags,
        notes: notes.into_list(&output),
    };
    output.finish(&report, || text(&report))?;
    Ok(true)
}

fn stage(record: &touch2touch_core::postprocess::StageRecord) -> StageReport {
    StageReport {
        name: record.stage.name(),
        how: record.how.clone(),
        unit: if record.stage.is_meters() { "m" } else { "1" },
        size: record.image.size(),
        stats: record.stats,
        invalid: record.invalid,
        histogram: record.histogram.clone(),
        note: record.note.clone(),
    }
}

/// `01-decoder-channel-1.png` and so on: colors over the stage's own range; NaN is gray.
fn pictures(out: &Path, ledger: &Ledger) -> anyhow::Result<()> {
    for (i, record) in ledger.stages.iter().enumerate() {
        let range = Range { lo: record.stats.min as f32, hi: record.stats.max as f32 };
        let name = record.stage.name().to_lowercase().replace(' ', "-");
        write_colored(&out.join(format!("{:02}-{name}.png", i + 1)), &record.image, ColorMap::Viridis, range)?;
    }
    if let Some(against) = &ledger.against {
        let counts = &against.joint.counts;
        let most = counts.as_slice().iter().copied().max().unwrap_or(1).max(1);
        // Roots, so that the few deep pixels are seen beside the many shallow ones; prediction upwards.
        let shares: DepthMap = counts.map(|&c| (f64::from(c) / f64::from(most)).powf(0.25) as f32).rows_reversed();
        let whole = Range { lo: 0.0, hi: 1.0 };
        write_colored(&out.join("joint-histogram.png"), &shares, ColorMap::Viridis, whole)?;
    }
    Ok(())
}

/// Writes an image in the colors of a map; NaN is gray.
pub(super) fn write_colored(file: &Path, image: &DepthMap, map: ColorMap, range: Range) -> anyhow::Result<()> {
    Ok(images::write_rgb8(file, &colored(image, map, range).map(|pixel| pixel.map(f32::from)))?)
}

fn text(report: &Report) -> String {
    let mut text = format!(
        "{} {}, {}, {}, {} steps, seed {}\n\n{:<20} {:>9} {:>9} {:>9} {:>9}  {}\n",
        report.pair,
        report.finger,
        report.bundle,
        report.shift,
        report.steps,
        report.seed,
        "stage",
        "min",
        "mean",
        "std",
        "max",
        ""
    );
    for s in &report.stages {
        let numbers = [s.stats.min, s.stats.mean, s.stats.std, s.stats.max]
            .map(|v| if s.unit == "m" { format!("{} mm", fixed(mm(v), 2)) } else { fixed(v, 3) });
        let [min, mean, std, max] = numbers;
        text += &format!("{:<20} {min:>9} {mean:>9} {std:>9} {max:>9}  {}\n", s.name, s.how);
    }
    if let Some(line) = report.against_truth.as_ref().and_then(|a| a.line) {
        text += &format!(
            "\nprediction = {:.3} · truth {} {} mm (robust; deviation {} mm)\n",
            line.slope,
            if line.offset < 0.0 { "-" } else { "+" },
            fixed(mm(line.offset.abs()), 2),
            fixed(mm(line.deviation), 2)
        );
    }
    text += &format!(
        "\n{:<24} {:>9} {:>9} {:>9} {:>9} {:>9}\n",
        "reading", "mean mm", "std mm", "slope", "offset mm", "PSNR dB"
    );
    for r in &report.readings {
        let number = |v: Option<f64>, digits: usize| v.map_or("-".to_owned(), |v| fixed(v, digits));
        text += &format!(
            "{:<24} {:>9} {:>9} {:>9} {:>9} {:>9}\n",
            r.name,
            fixed(mm(r.stats.mean), 2),
            fixed(mm(r.stats.std), 2),
            number(r.line.map(|l| l.slope), 3),
            number(r.line.map(|l| mm(l.offset)), 2),
            number(r.psnr_db, 1)
        );
    }
    if let Some(warning) = report.ambiguity.and_then(|a| a.warning()) {
        text += &format!("\n{warning}\n");
    }
    if report.flags.is_empty() {
        text += "\nnothing implausible\n";
    }
    for flag in &report.flags {
        let severity = format!("{:?}", flag.severity).to_lowercase();
        text += &format!("\n{severity}, {}: {}", flag.stage.to_lowercase(), flag.text());
    }
    text
}
