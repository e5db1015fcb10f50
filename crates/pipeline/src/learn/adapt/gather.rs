//! Touches with prediction and measurement on one grid.

use super::{AdaptSetup, MOST_TOUCHES, Remark, WHAT};
use crate::compare::tile_of;
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::learn::usable::unusable;
use crate::steps::imprint::{chain, window};
use crate::steps::models::Models;
use touch2touch_core::dataset::PairId;
use touch2touch_core::findings::Findings;
use touch2touch_core::fit::{FitPair, offsets};
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::markers::{signature, two_groups};
use touch2touch_core::postprocess::{DepthChain, ShiftMode};
use touch2touch_core::resample::bilinear;
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::{Sample, Scale};

/// Touches that are predicted together.
const BATCH: usize = 16;

/// A touch of one pad.
pub(super) struct FitTouch {
    pub(super) id: PairId,
    pub(super) name: String,
    pub(super) tool: Option<String>,
    pub(super) pad: PadId,
    /// Pad under which the sample holds the touch, which is not its finger in picture pairs.
    pub(super) of_sample: PadId,
    pub(super) scale: Scale,
    /// Meters, at the decoder's size and in its orientation.
    pub(super) prediction: DepthMap,
    /// Prediction moved to the pad's window, where the rig has one, as it is shown without a fit.
    pub(super) unfitted: DepthMap,
    /// That window, see [`window`].
    pub(super) window: Option<[f64; 2]>,
    /// Shift that moves a prediction into the window, `[right, down]` in pixels; `None` where either side does not say.
    pub(super) to_window_px: Option<[f64; 2]>,
    /// Measured imprint, likewise.
    pub(super) target: DepthMap,
    /// Measured imprint as it is: raw orientation.
    pub(super) measured: DepthMap,
    /// The picture as the file has it, meters, where there is one.
    pub(super) tile: Option<DepthMap>,
    /// True where the decoder's picture lies turned by 180 degrees in the raw orientation.
    pub(super) turned: bool,
    /// Picture that the generator starts from.
    pub(super) picture: RgbGrid,
    /// The lattice of its GelSlim, where the pad is not known.
    pub(super) signature: Option<Grid<f32>>,
}

impl FitTouch {
    pub(super) fn case(&self) -> FitPair<'_> {
        FitPair { prediction: &self.prediction, target: &self.target, pad: self.pad.index() }
    }

    /// A picture on the decoder's grid as an imprint: raw orientation, as large as the measured one.
    pub(super) fn imprint(&self, picture: &DepthMap) -> DepthMap {
        let [width, height] = self.measured.size();
        let resized = bilinear(picture, width, height);
        if self.turned { resized.rotated_180() } else { resized }
    }
}

pub(super) struct Gathered {
    pub(super) touches: Vec<FitTouch>,
    pub(super) left_out: Vec<Remark>,
    /// True where pads were told apart by their lattices.
    pub(super) grouped: bool,
    /// Oddities of the data set and of the files of the pairs.
    pub(super) notes: Findings,
}

/// Reads and predicts the pairs.
pub(super) fn gather(
    dataset: &Dataset,
    setup: &AdaptSetup,
    models: &Models,
    cx: &JobCx,
) -> Result<Gathered, TaskError> {
    let input = setup.recipe.generating()?.input(&dataset.rig);
    let input = input.map_err(|err| TaskError { what: WHAT.into(), ..err })?;
    let (mut touches, mut left_out) = (Vec::new(), Vec::new());
    let mut notes = Findings::default();
    notes.extend(dataset.problems.iter().cloned());
    let total = setup.pairs.len() as u64;
    let mut waiting: Vec<FitTouch> = Vec::new();
    for (done, &id) in setup.pairs.iter().enumerate() {
        cx.check(WHAT)?;
        cx.progress(done as u64, total, format!("predicting pair {} of {total}", done + 1));
        let Some(entry) = dataset.index.get(id) else { continue };
        let mut skip = |why: String| left_out.push(Remark { name: entry.name.clone(), why });
        if touches.len() + waiting.len() >= MOST_TOUCHES {
            skip(format!("{MOST_TOUCHES} touches are enough"));
            continue;
        }
        let sample = match dataset.load(id) {
            Ok(sample) => sample,
            Err(err) => {
                skip(format!("{err} ({})", err.hint));
                continue;
            }
        };
        notes.extend(sample.notes.iter().cloned());
        let before = waiting.len();
        for pad in sample.rig.pads() {
            match read(dataset, id, &entry.name, entry.tool.as_deref(), &sample, (pad, input)) {
                Ok(Some(touch)) => waiting.push(touch),
                Ok(None) => {}
                Err(why) => skip(why),
            }
        }
        if waiting.len() == before && left_out.last().is_none_or(|last| last.name != entry.name) {
            left_out.push(Remark {
                name: entry.name.clone(),
                why: "no finger has both a picture to start from and a measured imprint".into(),
            });
        }
        if waiting.len() >= BATCH || done + 1 == setup.pairs.len() {
            predict(setup, models, std::mem::take(&mut waiting), &mut touches, &mut left_out, cx)?;
        }
    }
    predict(setup, models, waiting, &mut touches, &mut left_out, cx)?;
    if touches.is_empty() {
        let why = left_out.first().map_or("there is no pair".to_owned(), |first| {
            format!("no pair can be used; the first: {}: {}", first.name, first.why)
        });
        return Err(TaskError::new(WHAT, why)
            .with_hint("A fit needs pairs of a GelSlim image and the Soft Bubble's imprint of the same grasp."));
    }
    let grouped = name_pads(dataset, &mut touches)?;
    Ok(Gathered { touches, left_out, grouped, notes })
}

/// A touch without its prediction; `None` where the pad felt nothing with both sensors.
fn read(
    dataset: &Dataset,
    id: PairId,
    name: &str,
    tool: Option<&str>,
    sample: &Sample,
    (pad, input): (PadId, touch2touch_core::rig::SensorId),
) -> Result<Option<FitTouch>, String> {
    let Some(touch) = sample.pad(pad) else { return Ok(None) };
    let (Some(picture), Some(bubble)) = (touch.picture(input), touch.depth()) else { return Ok(None) };
    if let Some(why) = unusable(&picture, &bubble.imprint) {
        return Err(why);
    }
    let lattice = (sample.scale == Scale::Assumed).then(|| signature(&picture)).flatten();
    let touch = FitTouch {
        id,
        name: name.to_owned(),
        tool: tool.map(str::to_owned),
        pad,
        of_sample: pad,
        scale: sample.scale,
        prediction: Grid::filled(0, 0, 0.0),
        unfitted: Grid::filled(0, 0, 0.0),
        window: window(sample, pad),
        to_window_px: None,
        target: Grid::filled(0, 0, 0.0),
        measured: bubble.imprint.clone(),
        tile: tile_of(dataset, id, sample).map_err(|err| err.why)?,
        turned: false,
        picture: picture.into_owned(),
        signature: lattice,
    };
    Ok(Some(touch))
}

fn predict(
    setup: &AdaptSetup,
    models: &Models,
    waiting: Vec<FitTouch>,
    touches: &mut Vec<FitTouch>,
    left_out: &mut Vec<Remark>,
    cx: &JobCx,
) -> Result<(), TaskError> {
    let generating = setup.recipe.generating()?;
    let wanted: Vec<_> = waiting.iter().map(|touch| generating.starting_from(&touch.picture)).collect();
    let made = models.predict(generating, &wanted, &cx.quiet())?;
    for (touch, made) in waiting.into_iter().zip(made) {
        let chain = chain(&made, ShiftMode::ExactInverse)?.placed(touch.window);
        let size = made.raw.channels.first().map_or([0, 0], Grid::size);
        let turned = chain.rotation_deg == 180;
        let placed = DepthChain { size, rotation_deg: 0, ..chain };
        let plain = DepthChain { offset: [0.0; 2], ..placed.clone() };
        let run = |chain: &DepthChain| chain.run(&made.raw).map_err(|err| TaskError::from_error(WHAT, &err));
        let (prediction, unfitted) = (run(&plain)?, run(&placed)?);
        if prediction.as_slice().iter().any(|v| !v.is_finite()) {
            left_out.push(Remark { name: touch.name, why: "its prediction has values that are not numbers".into() });
            continue;
        }
        let target = on_grid(&touch.measured, touch.tile.as_ref(), turned, size);
        let both = touch.window.is_some() && placed.window.is_some();
        let to_window_px = both.then(|| [0, 1].map(|i| placed.offset[i] * size[i] as f64));
        touches.push(FitTouch { prediction, unfitted, to_window_px, target, turned, ..touch });
    }
    Ok(())
}

/// The measurement at the decoder's size and in its orientation: from the file's own pixels where there is a picture.
pub(super) fn on_grid(measured: &DepthMap, tile: Option<&DepthMap>, turned: bool, size: [usize; 2]) -> DepthMap {
    let lies = match tile {
        Some(tile) => tile.clone(),
        None if turned => measured.rotated_180(),
        None => measured.clone(),
    };
    if lies.size() == size { lies } else { bilinear(&lies, size[0], size[1]) }
}

/// Tells the pads of pictures apart, which do not say them. Whether there were two.
fn name_pads(dataset: &Dataset, touches: &mut [FitTouch]) -> Result<bool, TaskError> {
    let known: Vec<usize> = (0..touches.len()).filter(|&i| touches[i].signature.is_some()).collect();
    if dataset.rig.pads().len() < 2 || known.is_empty() {
        return Ok(false);
    }
    let signatures: Vec<Grid<f32>> = known.iter().filter_map(|&i| touches[i].signature.clone()).collect();
    let groups = two_groups(&signatures);
    if groups.iter().all(|group| *group == groups[0]) {
        return Ok(false);
    }
    for (&i, group) in known.iter().zip(groups) {
        touches[i].pad = PadId::new(group);
    }
    // The pads' windows lie side by side in the raw picture, and so do the offsets that each needs.
    let cases: Vec<FitPair<'_>> = touches.iter().map(FitTouch::case).collect();
    let offsets = offsets(&cases, 2);
    let column = |pad: usize| {
        let sign = if touches[0].turned { -1.0 } else { 1.0 };
        sign * offsets[pad][0]
    };
    let window = |pad: usize| dataset.rig.color_window(PadId::new(pad)).map_or(0.0, |w| w.rectangle()[0]);
    if (column(0) > column(1)) != (window(0) > window(1)) {
        for &i in &known {
            touches[i].pad = PadId::new(1 - touches[i].pad.index());
        }
    }
    Ok(true)
}
