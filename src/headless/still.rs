//! `touch2touch still`: a pair in 3D as a picture, or as the frames of a turntable.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::VerbResult;
use super::args::{DatasetArgs, keyed};
use super::contact_mask::labels_of;
use super::recipe::RecipeArgs;
use crate::spatial;
use touch2touch_core::dataset::PairId;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::labels::Labels;
use touch2touch_pipeline::still::space::{Ground, SpacePane, ViewAngles};
use touch2touch_pipeline::still::{StillFiles, StillSetup, WIDTH_PX, still};

/// Arguments of `still`.
#[derive(Debug, Args)]
pub(super) struct StillArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// The pair, by its name or a unique part of it.
    #[arg(long)]
    pair: String,
    /// The imprint to show: `measured`, `predicted` or `both`.
    #[arg(long, value_parser = keyed::<SpacePane>(), default_value = "measured")]
    imprint: SpacePane,
    /// The file to write (`.png`), or with `--turntable` the folder.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Size as a multiple of 960 x 960 pixels.
    #[arg(long, value_name = "N", default_value_t = 2)]
    scale: u32,
    /// Width and height in pixels, instead of a scale; up to 8192.
    #[arg(long, value_name = "PX", conflicts_with = "scale")]
    width: Option<u32>,
    /// Background: white for papers, black for slides, or none.
    #[arg(long, value_parser = keyed::<Ground>(), default_value = "white")]
    ground: Ground,
    /// Viewing direction in degrees: azimuth from the right finger's side, and elevation.
    #[arg(long, value_name = "YAW,PITCH", value_parser = parse_view, default_value = "51.6,20", allow_hyphen_values = true)]
    view: ViewAngles,
    /// Color CAD model and contact points by signed distance, up to this many millimeters.
    #[arg(long, value_name = "MM")]
    distance: Option<f64>,
    /// Write a turntable of this many frames, as frame_0001.png and so on in a folder.
    #[arg(long, value_name = "N")]
    turntable: Option<u32>,
    #[command(flatten)]
    recipe: RecipeArgs,
}

/// Reads `YAW,PITCH` in degrees.
fn parse_view(text: &str) -> Result<ViewAngles, String> {
    let two =
        text.split_once(',').and_then(|(yaw, pitch)| Some([yaw.trim().parse().ok()?, pitch.trim().parse().ok()?]));
    match two {
        Some([yaw_deg, pitch_deg]) if f64::is_finite(yaw_deg) && f64::abs(pitch_deg) <= 90.0 => {
            Ok(ViewAngles { yaw_deg, pitch_deg })
        }
        _ => Err("two numbers of degrees with a comma between them are needed, such as 51.6,20".to_owned()),
    }
}

#[derive(Serialize)]
struct Report<'a> {
    pair: &'a str,
    #[serde(flatten)]
    still: StillFiles,
}

pub(super) fn run(args: &StillArgs) -> VerbResult {
    let png = args.out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
    if args.turntable.is_none() && !png {
        let why = format!("the name does not end in .png ({})", args.out.display());
        return Err(TaskError::new("Still", why).with_hint("Name the file still.png.").into());
    }
    let dataset = args.dataset.open()?;
    let pair: PairId = super::find_pair(&dataset, &args.pair)?;
    let name = dataset.index.pairs[pair.0 as usize].name.clone();
    let output = args.dataset.output("drawing", args.turntable.unwrap_or(1) as usize);
    let setup = StillSetup {
        pair,
        pane: args.imprint,
        recipe: args.recipe.of(args.imprint.farthest(), &dataset.rig)?,
        labels: labels_of(&Labels::of(&dataset), &name, &output),
        ground: args.ground,
        angles: args.view,
        width_px: args.width.unwrap_or(args.scale.saturating_mul(WIDTH_PX)),
        turntable: args.turntable,
        distance_m: args.distance.map(|mm| mm * 1e-3),
    };
    setup.check()?;
    let models = args.recipe.model.models();
    let done = still(&dataset, &setup, &models, spatial::still, &args.out, &output.job())?;
    let report = Report { pair: &name, still: done };
    output.finish(&report, || {
        let [width, height] = report.still.size_px;
        let count = report.still.files.len();
        format!("wrote {} ({count} of {width} x {height} pixels): {}", args.out.display(), report.still.note)
    })?;
    Ok(true)
}
