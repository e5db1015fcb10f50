//! Stills of a pair in 3D as PNG files ([`still`]): one picture, or the frames of a turntable.

pub mod space;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use crate::compare::deviation::DISTANCES_M;
use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::io::images;
use crate::job::JobCx;
use crate::labels::PairLabels;
use crate::steps::models::Models;
use crate::steps::recipe::Recipe;
use space::{Ground, InSpace, SpacePane, SpacePicture, SpaceView, ViewAngles, in_space};
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::Grid;

const WHAT: &str = "Still";
/// Width of a still at scale 1, pixels; it is as high as it is wide.
pub const WIDTH_PX: u32 = 960;
/// Widths that can be asked for, pixels.
pub const WIDTHS_PX: std::ops::RangeInclusive<u32> = 64..=8192;
/// Most frames of a turntable.
pub const MOST_FRAMES: u32 = 3600;
/// Content of a still.
#[derive(Clone, Debug, PartialEq)]
pub struct StillSetup {
    /// The pair.
    pub pair: PairId,
    /// The imprints shown.
    pub pane: SpacePane,
    /// Recipe of its results.
    pub recipe: Recipe,
    /// Labels that people gave the pair.
    pub labels: PairLabels,
    /// The ground.
    pub ground: Ground,
    /// Direction of the view.
    pub angles: ViewAngles,
    /// Width and height, pixels, within [`WIDTHS_PX`].
    pub width_px: u32,
    /// Frames of a turntable, into a folder; `None` = one picture, into a file.
    pub turntable: Option<u32>,
    /// Distance at which the colors of signed distances end, meters, within [`DISTANCES_M`]; `None` without them.
    pub distance_m: Option<f64>,
}

/// Stills that were written.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StillFiles {
    /// The files.
    pub files: Vec<PathBuf>,
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Pixels per millimeter in the plane of what one looks at.
    pub px_per_mm: f64,
    /// Words on how it was made, prediction, registration and pose.
    pub note: String,
}

impl StillSetup {
    /// Checks that it can be drawn.
    ///
    /// # Errors
    /// The reason why it cannot, and what to do.
    pub fn check(&self) -> Result<(), TaskError> {
        let fail = |why: String, hint: &str| Err(TaskError::new(WHAT, why).with_hint(hint));
        if !WIDTHS_PX.contains(&self.width_px) {
            let (lo, hi) = (WIDTHS_PX.start(), WIDTHS_PX.end());
            return fail(
                format!("a picture cannot be {} pixels wide", self.width_px),
                &format!("Choose {lo} to {hi} pixels."),
            );
        }
        if self.turntable.is_some_and(|frames| frames == 0 || frames > MOST_FRAMES) {
            return fail("a turntable cannot have so many frames".into(), "Choose 1 to 3600 frames.");
        }
        if self.distance_m.is_some_and(|reach| !DISTANCES_M.contains(&reach)) {
            return fail("distance colors cannot end there".into(), "Choose 0.01 to 50 mm.");
        }
        if !(self.angles.yaw_deg.is_finite() && self.angles.pitch_deg.abs() <= 90.0) {
            return fail(
                "the view is not a direction".into(),
                "Choose two numbers, the second from -90 to 90 degrees.",
            );
        }
        Ok(())
    }
}

/// Name and note of a pair as it is drawn: `draw` frames it, and what that returns draws it turned about the vertical by an angle
/// in degrees.
fn framed<F>(
    dataset: &Dataset,
    setup: &StillSetup,
    models: &Models,
    draw: impl FnOnce(&InSpace, &SpaceView) -> Result<F, TaskError>,
    cx: &JobCx,
) -> Result<([String; 2], F), TaskError> {
    setup.check()?;
    let name = dataset.index.get(setup.pair).map_or_else(String::new, |entry| entry.name.clone());
    let sample = dataset
        .load(setup.pair)
        .map(Arc::new)
        .map_err(|err| TaskError::from_error(format!("{WHAT}: load {name}"), &err).with_hint(err.hint))?;
    let pair = in_space(dataset, setup, &sample, models, cx)?;
    let StillSetup { pane, ground, angles, distance_m, .. } = *setup;
    let turned = draw(&pair, &SpaceView { pane, ground, angles, distance_m, size_px: [setup.width_px; 2] })?;
    Ok(([name, pair.note], turned))
}

/// The picture of [`still`] without a file.
///
/// # Errors
/// As [`still`].
pub fn picture<F: FnMut(f64) -> Result<SpacePicture, TaskError>>(
    dataset: &Dataset,
    setup: &StillSetup,
    models: &Models,
    draw: impl FnOnce(&InSpace, &SpaceView) -> Result<F, TaskError>,
    cx: &JobCx,
) -> Result<Grid<[u8; 4]>, TaskError> {
    let (_, mut turned) = framed(dataset, setup, models, draw, cx)?;
    turned(0.0).map(|picture| picture.pixels)
}

/// Draws a pair and writes it: a PNG file, or `frame_0001.png` and so on into a folder. `draw` frames it, and what that returns
/// draws it turned about the vertical by an angle in degrees.
///
/// # Errors
/// If it cannot be drawn as asked, the pair cannot be read, its results cannot be made, the graphics device fails, or the
/// job was told to stop.
pub fn still<F: FnMut(f64) -> Result<SpacePicture, TaskError> + Send>(
    dataset: &Dataset,
    setup: &StillSetup,
    models: &Models,
    draw: impl FnOnce(&InSpace, &SpaceView) -> Result<F, TaskError>,
    out: &Path,
    cx: &JobCx,
) -> Result<StillFiles, TaskError> {
    let ([name, note], mut turned) = framed(dataset, setup, models, draw, cx)?;
    let frames = setup.turntable.unwrap_or(1);
    if setup.turntable.is_some() {
        std::fs::create_dir_all(out)
            .map_err(|err| TaskError::new(WHAT, format!("cannot make the folder: {err} ({})", out.display())))?;
    }
    let mut done = StillFiles { files: Vec::new(), size_px: [setup.width_px; 2], px_per_mm: 0.0, note };
    let mut last: Option<SpacePicture> = None;
    for frame in 0..=frames {
        cx.check(WHAT)?;
        cx.progress(u64::from(frame), u64::from(frames), name.clone());
        let file = setup.turntable.map_or_else(|| out.to_owned(), |_| out.join(format!("frame_{frame:04}.png")));
        // A frame is written while the next one is drawn.
        let write = || last.as_ref().map(|picture| images::write_rgba8(&file, &picture.pixels)).transpose();
        let next = || (frame < frames).then(|| turned(360.0 * f64::from(frame) / f64::from(frames))).transpose();
        let (written, drawn) = rayon::join(write, next);
        written.map_err(|err| TaskError::new(WHAT, format!("{err} ({})", file.display())))?;
        done.files.extend(last.take().map(|_| file));
        last = drawn?;
        done.px_per_mm = last.as_ref().map_or(done.px_per_mm, |picture| picture.px_per_m * 1e-3);
    }
    Ok(done)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::ImprintSource;
    use touch2touch_core::grid::Grid;

    /// Draws the share of the frame's turn as a color, and nothing in the upper half.
    fn plain(
        pair: &InSpace,
        view: &SpaceView,
    ) -> Result<impl FnMut(f64) -> Result<SpacePicture, TaskError> + use<>, TaskError> {
        assert!(pair.sides.iter().all(|side| side.pose.is_some() && !side.contact.is_empty()));
        let [w, h] = view.size_px.map(|n| n as usize);
        Ok(move |turned_deg: f64| {
            let color = (turned_deg / 360.0 * 255.0) as u8;
            let pixels = Grid::from_fn(w, h, |_, y| if y < h / 2 { [0; 4] } else { [color, 200, 200, 255] });
            Ok(SpacePicture { pixels, px_per_m: 10_000.0 })
        })
    }

    fn setup() -> StillSetup {
        StillSetup {
            pair: PairId(3),
            pane: SpacePane::Measured,
            recipe: Recipe {
                mask: crate::steps::mask::MaskChoice {
                    source: crate::steps::mask::MaskSource::Threshold,
                    ..Default::default()
                },
                ..Recipe::default()
            },
            labels: PairLabels::default(),
            ground: Ground::Transparent,
            angles: ViewAngles::default(),
            width_px: 480,
            turntable: None,
            distance_m: None,
        }
    }

    #[test]
    fn a_still_is_the_picture_with_its_empty_ground() {
        let folder = tempfile::tempdir().unwrap();
        let (demo, models) = (Dataset::demo(), Models::new(None));
        let file = folder.path().join("still.png");
        let done = still(&demo, &setup(), &models, plain, &file, &JobCx::unwatched()).unwrap();
        assert_eq!((done.size_px, done.px_per_mm), ([480, 480], 10.0));
        assert!(done.note.starts_with(ImprintSource::Measured.key()) && done.note.contains("true"), "{}", done.note);
        let image = image::open(&file).unwrap().into_rgba8();
        assert_eq!(image.get_pixel(100, 50).0[3], 0, "nothing was drawn there");
        assert_eq!(image.get_pixel(360, 472).0, [0, 200, 200, 255]);
    }

    #[test]
    fn a_turntable_is_numbered_frames_all_around() {
        let folder = tempfile::tempdir().unwrap();
        let setup = StillSetup { turntable: Some(4), width_px: 64, ..setup() };
        let new = folder.path().join("frames");
        let done = still(&Dataset::demo(), &setup, &Models::new(None), plain, &new, &JobCx::unwatched()).unwrap();
        let colors = done.files.iter().map(|file| image::open(file).unwrap().into_rgba8().get_pixel(32, 40).0[0]);
        assert_eq!(colors.collect::<Vec<_>>(), [0, 63, 127, 191]);
        assert!(done.files[3].ends_with("frame_0004.png"));
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_in_words() {
        for broken in [
            StillSetup { width_px: 20_000, ..setup() },
            StillSetup { turntable: Some(0), ..setup() },
            StillSetup { distance_m: Some(f64::NAN), ..setup() },
            StillSetup { angles: ViewAngles { yaw_deg: 0.0, pitch_deg: f64::NAN }, ..setup() },
        ] {
            assert!(broken.check().unwrap_err().hint.is_some());
        }
    }
}
