//! `touch2touch generate`: predicted imprints of a whole data set, beside the measured ones.

mod report;

use std::path::{Path, PathBuf};

use clap::Args;

use super::VerbResult;
use super::args::{DatasetArgs, PairArgs};
use super::guard::{Bug, guarded};
use super::notes::Notes;
use super::output::says;
use super::recipe::{ModelArgs, misgiving};
use super::report::{RunReport, output_stems};
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::{PadTouch, Scale};
use touch2touch_core::{metrics, resample};
use touch2touch_pipeline::compare;
use touch2touch_pipeline::doubts;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::names::with_ending;
use touch2touch_pipeline::io::{images, npz};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::ImprintSource;
use touch2touch_pipeline::pairs::pads_named;
use touch2touch_pipeline::steps::imprint::{self, imprint_of};
use touch2touch_pipeline::steps::on_pad::OnPad;
use touch2touch_pipeline::steps::prediction::Prediction;

use report::{COLOR_CONVENTION, Figures, Pair, Report, Stored, convention, mean, text};

/// Arguments of `generate`.
#[derive(Debug, Args)]
pub(super) struct GenerateArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The folder for the predictions; created if missing.
    #[arg(long)]
    out: PathBuf,
    /// Finger to predict from: right, left (or as the data set names it), both.
    #[arg(long, default_value = "right")]
    finger: String,
    #[command(flatten)]
    pairs: PairArgs,
    #[command(flatten)]
    model: ModelArgs,
}

pub(super) fn run(args: &GenerateArgs) -> VerbResult {
    let dataset = args.dataset.open()?;
    let ids = args.pairs.of(&dataset)?;
    let fingers = pads_named(&dataset.rig, &args.finger).map_err(anyhow::Error::msg)?;
    let models = args.model.models();
    let recipe = args.model.recipe(ImprintSource::Predicted, &dataset.rig)?;
    let (generating, shift) = (recipe.generating()?, recipe.shift);
    let config = *generating.config;
    let stems = output_stems(&args.out, &dataset, &ids)?;
    let output = args.dataset.output("generating", ids.len());
    let begun = RunReport::begin(&args.out, "generate.json", ids.len())?;
    let mut pairs = Vec::new();
    let mut notes = Notes::of(&dataset);
    notes.take(&output, &doubts::notes(&dataset));
    let mut complete = !ids.is_empty();
    let mut scale = Scale::Measured;
    let mut in_color = false;
    for (id, stem) in ids.into_iter().zip(stems) {
        let id = PairId(id as u32);
        let name = dataset.index.pairs[id.0 as usize].name.clone();
        output.step(&name);
        let done = guarded(dataset.pair_files(id), || {
            let sample = dataset.load(id)?;
            scale = sample.scale;
            notes.take(&output, &sample.notes);
            notes.take(&output, misgiving(&recipe, &sample).as_slice());
            // An image folder has one finger, whichever it was.
            let present: Vec<PadId> = fingers.iter().copied().filter(|f| sample.pad(*f).is_some()).collect();
            let fingers = if present.is_empty() { sample.rig.pad_list() } else { present };
            let mut made = Vec::new();
            let mut touches = Vec::new();
            for finger in fingers {
                let Some(touch) = sample.pad(finger) else { continue };
                let picture = generating.picture(&sample, finger)?;
                let picture = picture.ok_or_else(|| anyhow::anyhow!("{}", generating.no_input(&sample.rig).why))?;
                touches.push((finger, touch, picture));
            }
            let pictures: Vec<_> = touches.iter().map(|(_, _, picture)| picture.clone()).collect();
            let predictions = generating.of(&models, &pictures, &JobCx::unwatched())?;
            for ((finger, touch, _), predicted) in touches.iter().zip(predictions) {
                let finger = *finger;
                let key = sample.rig.pad_key(finger);
                let stem = with_ending(&stem, &format!("_{key}"));
                let (seconds, kept) = (predicted.seconds, predicted.kept);
                let mut pair = Pair { name: name.clone(), finger: key, seconds, kept, ..Pair::default() };
                if let Some(difference) = imprint::color(&predicted, [0, 0])? {
                    in_color = true;
                    write_color(&stem, &difference)?;
                    score_color(&difference, touch, &mut pair.figures)?;
                    made.push(pair);
                    continue;
                }
                let imprint = imprint_of(&predicted, shift, &sample, finger)?;
                write(&stem, &imprint)?;
                let (drawn, on) = (Some((&predicted, shift)), OnPad { sample: &sample, pad: finger });
                score(&dataset, id, on, (&imprint, drawn), &mut pair.figures)?;
                made.push(pair);
            }
            Ok(made)
        });
        match done {
            Ok(made) => pairs.extend(made),
            Err(err) => {
                output.note(&format!("{name}: {}", says(&err)));
                if err.is::<Bug>() {
                    models.forget();
                }
                complete = false;
            }
        }
    }
    let report = Report {
        mean: mean(&pairs),
        convention: (if in_color { COLOR_CONVENTION } else { convention(scale) }).into(),
        bundle: generating.bundle.name.clone(),
        runtime: args.model.engine_label()?.into(),
        sampler: config.sampler.key().into(),
        steps: config.steps,
        seed: config.seed,
        notes: notes.into_list(&output),
        pairs,
    };
    begun.finish(&report)?;
    output.finish(&report, || text(&report))?;
    Ok(complete)
}

/// Fills in the figures of a predicted color picture against the measured one.
fn score_color(difference: &RgbGrid, touch: &PadTouch, figures: &mut Figures) -> anyhow::Result<()> {
    if let Some(measured) = touch.color() {
        let [w, h] = measured.difference.size();
        let sized = resample::bilinear_rgb(difference, w, h);
        let (psnr, ssim) = metrics::color(&sized, &measured.difference)?;
        (figures.psnr_db, figures.ssim) = (psnr, Some(ssim));
    }
    Ok(())
}

/// Fills in the figures of a prediction against the measured imprint, and of the lab's own prediction where it lies by.
fn score(
    dataset: &Dataset,
    id: PairId,
    OnPad { sample, pad }: OnPad<'_>,
    (imprint, drawn): (&DepthMap, Option<(&Prediction, ShiftMode)>),
    figures: &mut Figures,
) -> anyhow::Result<()> {
    let tile = compare::tile_of(dataset, id, sample)?;
    if let Some(found) = compare::of_pad(imprint, drawn, sample, pad, tile.as_ref())? {
        (figures.psnr_db, figures.ssim, figures.unstretched) = (found.psnr_db, found.ssim, found.unstretched);
    }
    if let Some(tile) = tile
        && let Some(vqvae) = compare::beside(dataset, id, sample)?
    {
        let theirs = compare::compare(&vqvae.tile, &tile, sample.scale)?;
        (figures.vqvae_psnr_db, figures.vqvae_ssim) = (theirs.psnr_db, theirs.ssim);
        figures.vqvae = theirs.unstretched.map(Stored);
    }
    Ok(())
}

/// Writes `STEM.npy` (meters, f32, 140 x 175, raw orientation) and a 16-bit picture of it (0.001 mm steps from
/// -20 mm) for people.
fn write(stem: &Path, imprint: &DepthMap) -> anyhow::Result<()> {
    npz::write_npy(&with_ending(stem, ".npy"), imprint)?;
    Ok(images::write_depth16(&with_ending(stem, ".png"), imprint)?)
}

/// Writes `STEM.png`: the difference of a color sensor's images around the middle gray, in its raw orientation;
/// and `STEM.npy` with the numbers (f32, 3 x height x width).
fn write_color(stem: &Path, difference: &RgbGrid) -> anyhow::Result<()> {
    npz::write_npy_planes(&with_ending(stem, ".npy"), difference)?;
    let picture = difference.map(|pixel| pixel.map(|v| v + 128.0));
    images::write_rgb8(&with_ending(stem, ".png"), &picture)?;
    Ok(())
}
