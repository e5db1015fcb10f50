//! A decoder's picture to meters: [`imprint`].

use std::sync::Arc;

use crate::error::TaskError;
use crate::steps::prediction::{Chains, Prediction};
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::postprocess::{
    Correction, CorrectionParts, DepthChain, Flag, PostprocessError, RawPrediction, ShiftMode, flags,
};
use touch2touch_core::resample::{bilinear, bilinear_rgb};
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::{PadTouch, Sample, Scale};

/// Longest side of a thumbnail, pixels.
const THUMBNAIL_PX: usize = 44;

/// A prediction in meters as the model draws it, of no pad, as large as the bubble image `size` (`[width, height]`).
///
/// # Errors
/// If the bundle has no such range mapping, or its steps do not fit its output.
pub fn imprint(prediction: &Prediction, shift: ShiftMode, size: [usize; 2]) -> Result<DepthMap, TaskError> {
    through(&chain(prediction, shift)?, prediction, shift, size)
}

fn through(
    chain: &DepthChain,
    prediction: &Prediction,
    shift: ShiftMode,
    size: [usize; 2],
) -> Result<DepthMap, TaskError> {
    let what = format!("Range mapping \"{}\"", shift.label());
    in_meters(chain, &prediction.raw, size).map_err(|err| TaskError::from_error(&what, &err))
}

/// The prediction of one finger of a sample in meters, as large as its bubble image; without one, the bundle's own size
/// is kept. It lies where the finger's window does, and what the bundle's fit knows of the finger is applied.
///
/// # Errors
/// As [`imprint`].
pub fn imprint_of(
    prediction: &Prediction,
    shift: ShiftMode,
    sample: &Sample,
    finger: PadId,
) -> Result<DepthMap, TaskError> {
    let bubble = sample.pad(finger).and_then(|t| t.depth());
    let chain = chain_of_pad(prediction, shift, sample, finger)?;
    through(&chain, prediction, shift, bubble.map_or([0, 0], |b| b.imprint.size()))
}

/// Everything that is implausible about the way of a finger's prediction to meters, the worst first.
///
/// # Errors
/// As [`imprint`].
pub fn flags_of(
    prediction: &Prediction,
    shift: ShiftMode,
    sample: &Sample,
    finger: PadId,
) -> Result<Vec<Flag>, TaskError> {
    let measured = sample.pad(finger).and_then(|touch| touch.depth()).map(|bubble| &bubble.imprint);
    let chain = chain_of_pad(prediction, shift, sample, finger)?;
    flags(&chain, &prediction.raw, measured).map_err(|err| TaskError::from_error("Depth chain", &err))
}

/// The predictions of a pair's pads in meters, as [`imprint_of`].
///
/// # Errors
/// As [`imprint`].
pub fn imprints_of(
    made: &PerPad<Prediction>,
    shift: ShiftMode,
    sample: &Sample,
) -> Result<PerPad<DepthMap>, TaskError> {
    let mut out = PerPad::default();
    for (pad, made) in made.entries() {
        out[pad] = Some(imprint_of(made, shift, sample, pad)?);
    }
    Ok(out)
}

/// The prediction of one finger as its sensor's picture shows it, meters: turned as that lies, and as large. It is
/// resized once, where [`imprint_of`] and a resizing of that would do it twice.
///
/// # Errors
/// As [`imprint`].
pub(crate) fn picture_of(
    prediction: &Prediction,
    shift: ShiftMode,
    sample: &Sample,
    finger: PadId,
    size: [usize; 2],
) -> Result<DepthMap, TaskError> {
    let chain = chain_of_pad(prediction, shift, sample, finger)?;
    let lies = sample.rig.depth().map_or(0, |sensor| sensor.rotation_deg);
    let chain = DepthChain { size, rotation_deg: (chain.rotation_deg + lies) % 360, ..chain };
    through(&chain, prediction, shift, size)
}

/// The measured imprints of a pair.
pub fn measured(sample: &Sample) -> PerPad<DepthMap> {
    sample.rig.pads().map(|pad| Some(sample.pad(pad)?.depth()?.imprint.clone())).collect()
}

/// A prediction of a color sensor, as large as that sensor's picture `size` (`[width, height]`; with a zero in it the
/// bundle's own size is kept): the difference on the 0..255 scale. `None` where it is depth that was predicted.
///
/// # Errors
/// If the steps of the bundle do not fit its output.
pub fn color(prediction: &Prediction, size: [usize; 2]) -> Result<Option<RgbGrid>, TaskError> {
    let Some(chain) = prediction.color else { return Ok(None) };
    let color = chain.run(&prediction.raw).map_err(|err| TaskError::from_error("Color picture", &err))?;
    let fits = color.size() == size || size.contains(&0);
    Ok(Some(if fits { color } else { bilinear_rgb(&color, size[0], size[1]) }))
}

/// A decoder's picture in meters, as large as the bubble image `size` (`[width, height]`; with a zero in it the chain's
/// own size is kept).
///
/// # Errors
/// If the chain does not fit the picture.
pub fn in_meters(chain: &DepthChain, raw: &RawPrediction, size: [usize; 2]) -> Result<DepthMap, PostprocessError> {
    let depth = chain.run(raw)?;
    if depth.size() == size || size.contains(&0) { Ok(depth) } else { Ok(bilinear(&depth, size[0], size[1])) }
}

/// The steps from the prediction of a finger to meters, with the place of its window and what the bundle's fit knows of
/// it: the exact reading is corrected, those that show what was released are not.
///
/// # Errors
/// As [`chain`].
pub(crate) fn chain_of_pad(
    prediction: &Prediction,
    shift: ShiftMode,
    sample: &Sample,
    finger: PadId,
) -> Result<DepthChain, TaskError> {
    let parts = match shift {
        ShiftMode::ExactInverse => CorrectionParts::ALL,
        ShiftMode::Parts(parts) => parts,
        ShiftMode::Raw | ShiftMode::PaperShift | ShiftMode::Refit(_) => CorrectionParts::NONE,
    };
    let found = prediction.fit.as_ref().and_then(|fit| fit.correction(sample, finger));
    let correction = found.filter(|_| parts != CorrectionParts::NONE);
    let with = |fit: &Arc<Correction>| {
        if parts == CorrectionParts::ALL { fit.clone() } else { Arc::new(Correction { parts, ..(**fit).clone() }) }
    };
    Ok(DepthChain { correction: correction.map(with), ..chain(prediction, shift)?.placed(window(sample, finger)) })
}

/// Center of the color sensor's window in the imprint of a finger, shares of width and height. Where it is not known of which
/// finger a picture pair is, the middle of the windows stands for it.
pub fn window(sample: &Sample, finger: PadId) -> Option<[f64; 2]> {
    match sample.scale {
        Scale::Measured => sample.rig.window_share(finger),
        Scale::Assumed => match sample.taken_by {
            Some(taken_by) => sample.rig.window_share(taken_by),
            None => sample.rig.mean_window_share(),
        },
    }
}

/// The steps from a prediction to meters as the model draws them.
///
/// # Errors
/// If the bundle has no such range mapping, or the statistics of a refit are of another bundle.
pub fn chain(prediction: &Prediction, shift: ShiftMode) -> Result<DepthChain, TaskError> {
    chain_of(&prediction.chains, &prediction.bundle, shift)
}

/// The steps to meters among the ways that a bundle of this identity offers.
///
/// # Errors
/// As [`chain`].
pub fn chain_of(chains: &Chains, bundle: &str, shift: ShiftMode) -> Result<DepthChain, TaskError> {
    let fail = |why: &str| {
        TaskError::new(format!("Range mapping \"{}\"", shift.label()), why)
            .with_hint("Choose another range mapping, or another bundle.")
    };
    let of = |mode: ShiftMode| match chains.get(&mode) {
        Some(Ok(chain)) => Ok(chain.clone()),
        Some(Err(why)) => Err(fail(why)),
        None => Err(fail("the bundle does not offer it")),
    };
    match shift {
        ShiftMode::Refit(refit) => {
            refit.check(bundle).map_err(|why| fail(&why))?;
            of(ShiftMode::Raw)?.with_mode(shift, None).map_err(|err| fail(&err.to_string()))
        }
        ShiftMode::Parts(_) => of(ShiftMode::ExactInverse),
        mode => of(mode),
    }
}

/// A small picture of the measured imprint of the first finger that has one, else nothing (an empty image).
pub fn thumbnail(sample: &Sample) -> DepthMap {
    let Some(bubble) = sample.pads.iter().flatten().find_map(PadTouch::depth) else { return Grid::filled(0, 0, 0.0) };
    let imprint = &bubble.imprint;
    let longest = imprint.width().max(imprint.height());
    if longest <= THUMBNAIL_PX {
        return imprint.clone();
    }
    // The mean of the finite pixels of each block: no aliasing of the speckle, no holes where a few are missing.
    let size = imprint.size().map(|n| (n * THUMBNAIL_PX).div_ceil(longest).max(1));
    let block = |at: usize, out: usize, full: usize| at * full / out..((at + 1) * full / out).max(at * full / out + 1);
    Grid::from_fn(size[0], size[1], |x, y| {
        let (mut sum, mut count) = (0.0f32, 0u32);
        for v in block(y, size[1], imprint.height()) {
            for value in &imprint.row(v)[block(x, size[0], imprint.width())] {
                if value.is_finite() {
                    sum += value;
                    count += 1;
                }
            }
        }
        if count == 0 { f32::NAN } else { sum / count as f32 }
    })
}
