//! Jobs as plain functions of values: the studio's lanes and the command line call the same ones.

use std::sync::Arc;
use std::time::Instant;

use super::super::error::TaskError;
use super::super::keys::{MaskRecipe, PoseEngine, ShiftMode};
use super::super::results::{Clouds, Comparison, Ensemble, FingerCloud, PoseResult, Prediction};
use super::super::services::NamedTool;
use super::JobCx;
use crate::domain::align::basin::{Basin, BasinConfig, Plane};
use crate::domain::ensemble::{Spread, channel_spread};
use crate::domain::frames::PlanarPose;
use crate::domain::grid::{DepthMap, Grid, Mask};
use crate::domain::inspect::{basin_map, recorded};
use crate::domain::mesh::TriMesh;
use crate::domain::metrics::{self, SsimRange};
use crate::domain::pose::{ToolModel, register};
use crate::domain::postprocess::{DepthChain, PostprocessError, RawPrediction};
use crate::domain::resample::bilinear;
use crate::domain::rig::PerPad;
use crate::domain::sample::{DepthCamera, PadTouch, Sample, Scale};
use crate::domain::{cloud, contact, units};

/// The peak of the lab's PSNR, metres.
pub const LAB_PEAK_M: f64 = 0.0225;
/// Longest side of a thumbnail, pixels.
const THUMBNAIL_PX: usize = 44;

/// A prediction in metres, as large as the bubble image `size` (`[width, height]`).
///
/// # Errors
/// If the bundle has no such range mapping, or its steps do not fit its output.
pub fn imprint(prediction: &Prediction, shift: ShiftMode, size: [usize; 2]) -> Result<DepthMap, TaskError> {
    let what = format!("Range mapping \"{}\"", shift.label());
    let chain = chain(prediction, shift)?;
    in_metres(&chain, &prediction.output.raw, size).map_err(|err| TaskError::from_error(&what, &err))
}

/// A decoder's picture in metres, as large as the bubble image `size` (`[width, height]`; with a zero in it the chain's
/// own size is kept).
///
/// # Errors
/// If the chain does not fit the picture.
pub fn in_metres(chain: &DepthChain, raw: &RawPrediction, size: [usize; 2]) -> Result<DepthMap, PostprocessError> {
    let depth = chain.run(raw)?;
    if depth.size() == size || size.contains(&0) { Ok(depth) } else { Ok(bilinear(&depth, size[0], size[1])) }
}

/// The steps from a prediction to metres.
///
/// # Errors
/// If the bundle has no such range mapping, or the statistics of a refit are of another bundle.
pub fn chain(prediction: &Prediction, shift: ShiftMode) -> Result<DepthChain, TaskError> {
    let fail = |why: &str| {
        TaskError::new(format!("Range mapping \"{}\"", shift.label()), why)
            .with_hint("Choose another range mapping, or another bundle.")
    };
    let of = |mode: ShiftMode| match prediction.output.chains.get(&mode) {
        Some(Ok(chain)) => Ok(chain.clone()),
        Some(Err(why)) => Err(fail(why)),
        None => Err(fail("the bundle does not offer it")),
    };
    match shift {
        ShiftMode::Refit(refit) => {
            refit.check(&prediction.recipe.bundle).map_err(|why| fail(&why))?;
            of(ShiftMode::Raw)?.with_mode(shift, None).map_err(|err| fail(&err.to_string()))
        }
        mode => of(mode),
    }
}

/// Mean and spreads of several predictions, `imprints` being the same in metres.
///
/// # Errors
/// If there is none, or their sizes differ.
pub fn ensemble(
    predictions: &[Arc<Prediction>],
    imprints: &[Arc<DepthMap>],
    shift: ShiftMode,
) -> Result<Ensemble, TaskError> {
    const WHAT: &str = "Spread of the seeds";
    let spread = Spread::of(&imprints.iter().map(|i| &**i).collect::<Vec<_>>())
        .ok_or_else(|| TaskError::new(WHAT, "the predictions differ in size"))?;
    let mut apart = Vec::new();
    for prediction in predictions {
        let chain = DepthChain { size: spread.mean.size(), ..chain(prediction, shift)? };
        let found = channel_spread(&prediction.output.raw, &chain).map_err(|err| TaskError::from_error(WHAT, &err))?;
        apart.extend(found);
    }
    let channels = Spread::of(&apart.iter().collect::<Vec<_>>()).map(|of| of.mean);
    Ok(Ensemble { spread, channels })
}

/// A prediction against the measurement. With an assumed scale both are stretched to 0..1 first.
///
/// # Errors
/// If the sizes differ or no pixel is left to compare.
pub fn compare(predicted: &DepthMap, measured: &DepthMap, scale: Scale) -> Result<Comparison, TaskError> {
    let fail = |err: metrics::MetricError| TaskError::from_error("Compare prediction and measurement", &err);
    let mut sum = 0.0;
    let mut count = 0usize;
    let sizes_equal = predicted.size() == measured.size();
    let error = Grid::from_fn(measured.width(), measured.height(), |x, y| {
        let difference = if sizes_equal { predicted[(x, y)] - measured[(x, y)] } else { f32::NAN };
        if difference.is_finite() {
            sum += f64::from(difference.abs());
            count += 1;
        }
        difference
    });
    let (psnr, ssim) = match scale {
        Scale::Measured => (
            metrics::psnr(predicted, measured, LAB_PEAK_M).map_err(fail)?,
            metrics::ssim(predicted, measured, SsimRange::Explicit(LAB_PEAK_M)),
        ),
        Scale::Assumed => {
            let (p, m) = (metrics::unit_range(predicted), metrics::unit_range(measured));
            (metrics::psnr(&p, &m, 1.0).map_err(fail)?, metrics::ssim(&p, &m, SsimRange::Explicit(1.0)))
        }
    };
    Ok(Comparison {
        error,
        psnr_db: psnr.db(),
        ssim: ssim.ok().map(|s| s.mean),
        mae_m: if count == 0 { f64::NAN } else { sum / count as f64 },
        scale,
        split: None,
    })
}

/// [`compare`] with the figures apart for what the GelSlim saw (`seen`) and for what the model made up.
///
/// # Errors
/// As [`compare`].
pub fn compare_parts(
    predicted: &DepthMap,
    measured: &DepthMap,
    scale: Scale,
    seen: Option<&Mask>,
) -> Result<Comparison, TaskError> {
    let fail = |err: metrics::MetricError| TaskError::from_error("Compare prediction and measurement", &err);
    let whole = compare(predicted, measured, scale)?;
    let Some(seen) = seen else { return Ok(whole) };
    let mut split = metrics::split(predicted, measured, seen, LAB_PEAK_M).map_err(fail)?;
    if scale == Scale::Assumed {
        // Lengths stay in the assumed metres; PSNR and SSIM are of the stretched images, as those of the whole are.
        let (p, m) = (metrics::unit_range(predicted), metrics::unit_range(measured));
        let unit = metrics::split(&p, &m, seen, 1.0).map_err(fail)?;
        for (part, unit) in
            [(&mut split.whole, unit.whole), (&mut split.seen, unit.seen), (&mut split.invented, unit.invented)]
        {
            (part.psnr_db, part.ssim) = (unit.psnr_db, unit.ssim);
        }
    }
    Ok(Comparison { split: Some(split), ..whole })
}

/// An automatic mask that needs no model.
///
/// `tool` and `truth` (`grasp_from_object`) are needed for [`MaskRecipe::Cad`], `touch` for it and for
/// [`MaskRecipe::Truth`].
///
/// # Errors
/// If something the recipe needs is not there, or the sizes differ.
pub fn mask(
    recipe: &MaskRecipe,
    imprint: &DepthMap,
    touch: Option<&PadTouch>,
    tool: Option<&ToolModel>,
    truth: Option<PlanarPose>,
) -> Result<Mask, TaskError> {
    const WHAT: &str = "Contact mask";
    match recipe {
        MaskRecipe::Threshold(min_m) => Ok(contact::threshold(imprint, min_m.get())),
        MaskRecipe::TopPercent(percent) => {
            Ok(contact::top_percent(imprint, f64::from(percent.get()), f32::NEG_INFINITY))
        }
        MaskRecipe::Cad(limit_m) => {
            let camera = touch
                .and_then(PadTouch::camera)
                .ok_or_else(|| TaskError::new(WHAT, "this source has no depth camera"))?;
            let tool = tool.ok_or_else(|| TaskError::new(WHAT, "the tool's CAD model is not there"))?;
            let truth = truth.ok_or_else(|| TaskError::new(WHAT, "the true pose is not known"))?;
            contact::cad_signed_distance(imprint, camera, &tool.distance, truth.inverse(), f64::from(limit_m.get()))
                .map_err(|err| TaskError::from_error(WHAT, &err))
        }
        MaskRecipe::Truth => {
            let truth = touch
                .and_then(|t| t.depth()?.truth.as_ref())
                .ok_or_else(|| TaskError::new(WHAT, "only simulated data knows the true contact"))?;
            Ok(truth.contact.clone())
        }
        MaskRecipe::Unet(_) => Err(TaskError::new(WHAT, "the mask model runs on another lane")),
    }
}

/// The surface points of one finger, with the contact points marked. `None` for the mask marks none.
///
/// # Errors
/// If the sizes differ or the camera's numbers cannot be right.
pub fn finger_cloud(imprint: &DepthMap, camera: &DepthCamera, mask: Option<&Mask>) -> Result<FingerCloud, TaskError> {
    let lifted = cloud::lift(imprint, camera, None).map_err(|err| TaskError::from_error("Point cloud", &err))?;
    if let Some(mask) = mask.filter(|mask| mask.size() != imprint.size()) {
        let why = format!("the mask has {:?} pixels, the imprint {:?}", mask.size(), imprint.size());
        return Err(TaskError::new("Point cloud", why).with_hint("Remove the correction of this mask."));
    }
    let contact = lifted
        .pixels
        .iter()
        .map(|&[x, y]| mask.is_some_and(|m| m.get(x.into(), y.into()).is_some_and(|&contact| contact)))
        .collect();
    Ok(FingerCloud { points: lifted.points, pixels: lifted.pixels, contact })
}

/// The surface points of both fingers of a sample: `parts` holds imprint and mask; a finger without a
/// camera is left out.
///
/// # Errors
/// As [`finger_cloud`].
pub fn clouds(sample: &Sample, parts: &PerPad<(&DepthMap, Option<&Mask>)>) -> Result<Clouds, TaskError> {
    let mut clouds = Clouds::default();
    for finger in sample.rig.pads() {
        let camera = sample.pad(finger).and_then(|t| t.camera());
        if let (Some((imprint, mask)), Some(camera)) = (parts[finger], camera) {
            clouds.fingers[finger] = Some(finger_cloud(imprint, camera, mask)?);
        }
    }
    Ok(clouds)
}

/// A tool with what the registration needs. Takes some tens of milliseconds.
///
/// # Errors
/// If the mesh has no area or is not finite.
pub fn named_tool(name: &str, mesh: TriMesh) -> Result<NamedTool, TaskError> {
    let model = ToolModel::new(mesh).map_err(|err| TaskError::from_error(format!("CAD model of {name}"), &err))?;
    Ok(NamedTool { name: name.to_owned(), model })
}

/// The pose of the tool from contact points. `truth` is `grasp_from_object`, where known.
///
/// # Errors
/// If there are too few points, or they are nowhere near the tool.
pub fn pose(
    clouds: &Clouds,
    tool: &ToolModel,
    engine: PoseEngine,
    truth: Option<PlanarPose>,
) -> Result<PoseResult, TaskError> {
    run(clouds, tool, engine, truth, None, false)
}

/// [`pose`] from a given start (`grasp_from_object`) where there is one, with everything recorded where asked.
///
/// # Errors
/// As [`pose`].
pub fn run(
    clouds: &Clouds,
    tool: &ToolModel,
    engine: PoseEngine,
    truth: Option<PlanarPose>,
    from: Option<PlanarPose>,
    record: bool,
) -> Result<PoseResult, TaskError> {
    let start = Instant::now();
    let points = clouds.contact_points();
    let report = match record || from.is_some() {
        true => recorded(&points, tool, engine, from),
        false => register(&points, tool, engine, false),
    };
    let report = report.map_err(|err| TaskError::from_error("Pose", &err))?;
    let ms = start.elapsed().as_secs_f64() * 1e3;
    let angle_rad = report.lab_angle_rad();
    let truth_rad = truth.map(|t| t.inverse().theta_rad);
    Ok(PoseResult {
        grasp_from_object: report.grasp_from_object,
        angle_rad,
        truth_rad,
        error_rad: truth_rad.map(|t| units::angle_error(angle_rad, t)),
        rms_m: report.inlier_rms_m,
        num_points: points.len(),
        stop: report.stop.to_string(),
        converged: report.converged,
        ms,
        report,
    })
}

/// Where starts lead.
///
/// # Errors
/// If the job was told to stop, or no start led anywhere.
pub fn basin(
    clouds: &Clouds,
    tool: &ToolModel,
    engine: PoseEngine,
    plane: Plane,
    cx: &JobCx,
) -> Result<Basin, TaskError> {
    const WHAT: &str = "Basin map";
    let config = BasinConfig::new(plane);
    let map = basin_map(&clouds.contact_points(), tool, engine, &config, || cx.cancel.is_cancelled())
        .ok_or_else(|| TaskError::cancelled(WHAT))?;
    match map.cells.iter().find_map(|cell| cell.failure.as_deref()) {
        Some(why) if map.basins.is_empty() => Err(TaskError::new(WHAT, why)),
        _ => Ok(map),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::rig::lab;

    #[test]
    fn a_thumbnail_keeps_means_and_survives_holes() {
        let imprint = Grid::from_fn(175, 140, |x, y| if (x + y) % 2 == 0 { f32::NAN } else { 0.004 });
        let bubble = crate::domain::sample::DepthTouch { imprint, camera: None, truth: None };
        let touch = crate::domain::sample::PadTouch::default().with(lab::BUBBLE_ID, Some(bubble));
        let sample = Sample { pads: [None, Some(touch)].into(), ..Sample::default() };
        let small = thumbnail(&sample);
        assert_eq!(small.size(), [44, 36]);
        // The mean of equal numbers is that number up to rounding of a sum of at most 20.
        assert!(small.as_slice().iter().all(|v| (v - 0.004).abs() < 1e-8));
        assert!(thumbnail(&Sample::default()).is_empty());
    }

    #[test]
    fn comparing_says_how_far_off() {
        let a = Grid::from_fn(40, 30, |x, y| 1e-4 * (x * y % 17) as f32);
        let b = a.map(|v| v + 0.001);
        let comparison = compare(&b, &a, Scale::Measured).unwrap();
        // A constant error of 1 mm: 20 log10(0.0225 / 0.001) = 27.04 dB.
        assert!((comparison.psnr_db.unwrap() - 27.04).abs() < 0.01);
        assert!((comparison.mae_m - 0.001).abs() < 1e-8);
        // With an assumed scale an offset is invisible: the stretched images are equal up to rounding.
        let assumed = compare(&b, &a, Scale::Assumed).unwrap();
        assert!(assumed.psnr_db.is_none_or(|db| db > 80.0));
        assert!(compare(&Grid::filled(3, 3, 0.0), &a, Scale::Measured).is_err());
    }
}
