//! Several seeds of one touch: what `generate --seeds` and `pose --seeds` share.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use touch2touch_core::ensemble::{AngleFan, seeds};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::pose::RegistrationChoice;
use touch2touch_core::units::angle_error;
use touch2touch_work::fan::{self, Fan, FingerSeeds};
use touch2touch_work::feel::Touch;
use touch2touch_work::io::{images, names, npz};
use touch2touch_work::job::JobCx;
use touch2touch_work::models::Models;
use touch2touch_work::recipe::Recipe;

/// Number of seeds.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct SeedArgs {
    /// Predict with this many seeds, from the seed on: mean, spread per pixel, spread of the decoder's channels, and
    /// the fan of the poses.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    pub seeds: u16,
}

/// Folder for the pictures of the fans.
#[derive(Debug, Clone, Args)]
pub(super) struct FanArgs {
    /// With `--seeds`: write a picture of each fan of poses into this folder.
    #[arg(long, value_name = "DIR", requires = "seeds")]
    pub fan_out: Option<PathBuf>,
}

/// Metrics of the seeds of one touch.
#[derive(Debug, Clone, Serialize)]
pub(super) struct SeedFigures {
    seeds: Vec<u64>,
    /// Of the spread over all pixels, meters.
    spread_mean_m: Option<f64>,
    spread_max_m: Option<f64>,
    /// Of the spread of the decoder's channels, meters.
    channels_mean_m: Option<f64>,
    /// Of the mean over the seeds, against the measurement.
    pub(super) mean_psnr_db: Option<f64>,
    pub(super) mean_ssim: Option<f64>,
}

/// Writes mean and spreads as `STEM_{mean,spread,channels}.npy` (meters) and pictures of the spreads (0.0001 mm steps)
/// and of the mean (0.001 mm steps from -20 mm). PSNR and SSIM are left to whoever knows the measurement.
pub(super) fn write(stem: &Path, found: &FingerSeeds, first: u64) -> anyhow::Result<SeedFigures> {
    let file = |what: &str, ending: &str| names::with_ending(stem, &format!("_{what}.{ending}"));
    let maps = [
        ("mean", Some(&found.ensemble.spread.mean)),
        ("spread", Some(&found.ensemble.spread.std)),
        ("channels", found.ensemble.channels.as_ref()),
    ];
    for (what, map) in maps {
        let Some(map) = map else { continue };
        npz::write_npy(&file(what, "npy"), map)?;
        let (from, step) = if what == "mean" { (0.02, 1e6) } else { (0.0, 1e7) };
        images::write_gray16(&file(what, "png"), &map.map(|&d| ((d + from) * step).clamp(0.0, 65535.0) as u16))?;
    }
    let finite = |v: f64| v.is_finite().then_some(v);
    let mean_of = |map: &DepthMap| finite(touch2touch_core::postprocess::Stats::of(map).mean);
    Ok(SeedFigures {
        seeds: seeds(first, found.imprints.len()),
        spread_mean_m: finite(found.ensemble.spread.mean_std()),
        spread_max_m: finite(found.ensemble.spread.max_std()),
        channels_mean_m: found.ensemble.channels.as_ref().and_then(mean_of),
        mean_psnr_db: None,
        mean_ssim: None,
    })
}

/// The poses of the seeds of one grasp. All angles are the lab's, degrees.
#[derive(Debug, Clone, Serialize)]
pub(super) struct PoseFan {
    seeds: Vec<u64>,
    /// Of each seed; `None` without a pose.
    angles_deg: Vec<Option<f64>>,
    /// The circular mean.
    mean_deg: Option<f64>,
    /// Circular standard deviation.
    std_deg: Option<f64>,
    /// Number of masks (one per seed and one of the mean imprint) that are not of the source that was asked, by what
    /// they are of instead (`depth`, `flat`).
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    mask_notes: BTreeMap<String, usize>,
    /// Farthest to either side of the mean, as differences from it.
    extremes_deg: Option<[f64; 2]>,
    /// Of the pose of the mean imprint.
    pub of_mean_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_error_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of_mean_error_deg: Option<f64>,
    #[serde(skip)]
    fan: Option<AngleFan>,
    #[serde(skip)]
    truth_rad: Option<f64>,
}

impl PoseFan {
    /// Writes `STEM_ENGINE_fan.png`; nothing where the angles have no mean. `name` is the pair's.
    pub(super) fn write(&self, stem: &Path, name: &str, registration: RegistrationChoice) -> anyhow::Result<()> {
        let file = names::with_ending(stem, &format!("_{}_fan.png", registration.to_string().replace([':', '='], "_")));
        let Some(fan) = &self.fan else { return Ok(()) };
        if let Some(picture) = fan::picture(name, fan, self.truth_rad)? {
            images::write_rgb8(&file, &picture)?;
        }
        Ok(())
    }
}

/// The fan of the poses of a touch with several seeds.
pub(super) fn fan(touch: Touch<'_>, recipe: &Recipe, count: u16, models: &Models) -> anyhow::Result<PoseFan> {
    let Fan { seeds, angles_rad, of_mean_rad, fan, otherwise } =
        fan::fan(touch, recipe, count.into(), models, &JobCx::unwatched())?;
    let truth = touch.sample.grasp_from_object.map(|p| p.inverse().theta_rad);
    let mean = fan.as_ref().and_then(|f| f.mean_rad);
    let error = |angle: Option<f64>| Some(angle_error(angle?, truth?).to_degrees());
    let finite = |v: f64| v.is_finite().then_some(v.to_degrees());
    Ok(PoseFan {
        seeds,
        angles_deg: angles_rad.iter().map(|a| a.map(f64::to_degrees)).collect(),
        mean_deg: mean.map(f64::to_degrees),
        std_deg: fan.as_ref().and_then(|f| finite(f.std_rad)),
        extremes_deg: fan.as_ref().map(|f| f.extremes_rad).filter(|e| e[0].is_finite()).map(|e| e.map(f64::to_degrees)),
        mask_notes: otherwise,
        of_mean_deg: of_mean_rad.map(f64::to_degrees),
        mean_error_deg: error(mean),
        of_mean_error_deg: error(of_mean_rad),
        fan,
        truth_rad: truth,
    })
}
