//! Stills of a pair in 3D as PNG files ([`still`]): one picture, or the frames of a turntable, each with scale bar, name and
//! provenance.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use serde::Serialize;

use crate::compare::deviation::{DISTANCE_MAP, DISTANCES_M};
use crate::error::TaskError;
use crate::images::canvas::{self, Drawing, Drawn, Paper};
use crate::images::space::{DrawSpace, Ground, SpaceInput, SpacePane, SpaceView, ViewAngles, in_space};
use crate::io::dataset::Dataset;
use crate::io::images;
use crate::job::JobCx;
use crate::labels::PairLabels;
use crate::steps::models::Models;
use crate::steps::recipe::Recipe;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::Grid;

const WHAT: &str = "Still";
/// Width of a still at scale 1, pixels; it is as high as it is wide.
pub const WIDTH_PX: u32 = 960;
/// Widths that can be asked for, pixels.
pub const WIDTHS_PX: std::ops::RangeInclusive<u32> = 64..=8192;
/// Most frames of a turntable.
pub const MOST_FRAMES: u32 = 3600;
/// Width of a still in units of its letters.
const UNITS: f64 = 480.0;
/// Height of the strip of letters, units; with a color bar.
const STRIP: [f64; 2] = [40.0, 66.0];
/// Width and height of a color bar, units.
const BAR: [f64; 2] = [110.0, 6.0];
/// Letters of a line of the note, and its most lines.
const NOTE: (usize, usize) = (92, 2);
/// Round lengths of scale bars, millimeters.
const LENGTHS_MM: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

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
    /// Words on how it was made, as they stand below the picture.
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
            return fail(format!("{} pixels are no width", self.width_px), &format!("Choose {lo} to {hi} pixels."));
        }
        if self.turntable.is_some_and(|frames| frames == 0 || frames > MOST_FRAMES) {
            return fail("a turntable of so many frames cannot be".into(), "Choose 1 to 3600 frames.");
        }
        if self.distance_m.is_some_and(|reach| !DISTANCES_M.contains(&reach)) {
            return fail("the colors of distances cannot end there".into(), "Choose 0.01 to 50 mm.");
        }
        if !(self.angles.yaw_deg.is_finite() && self.angles.pitch_deg.abs() <= 90.0) {
            return fail("the view is no direction".into(), "Choose two numbers, the second from -90 to 90 degrees.");
        }
        Ok(())
    }
}

/// Draws a pair and writes it: a PNG file, or `frame_0001.png` and so on into a folder.
///
/// # Errors
/// If it cannot be drawn as asked, the pair cannot be read, its results cannot be made, the graphics device fails, or the
/// job was told to stop.
pub fn still(
    dataset: &Dataset,
    setup: &StillSetup,
    models: &Models,
    by: &dyn DrawSpace,
    out: &Path,
    cx: &JobCx,
) -> Result<StillFiles, TaskError> {
    setup.check()?;
    let name = dataset.index.get(setup.pair).map_or_else(String::new, |entry| entry.name.clone());
    let sample = dataset
        .load(setup.pair)
        .map(Arc::new)
        .map_err(|err| TaskError::from_error(format!("{WHAT}: load {name}"), &err).with_hint(err.hint()))?;
    let input = SpaceInput { dataset, pair: setup.pair, recipe: &setup.recipe, labels: &setup.labels, models };
    let pair = in_space(input, &sample, setup.pane.sides(), setup.distance_m.is_some(), cx)?;
    let frames = setup.turntable.unwrap_or(1);
    if setup.turntable.is_some() {
        std::fs::create_dir_all(out)
            .map_err(|err| TaskError::new(WHAT, format!("cannot make the folder: {err} ({})", out.display())))?;
    }
    let size_px = [setup.width_px; 2];
    let mut done = StillFiles { files: Vec::new(), size_px, px_per_mm: 0.0, note: pair.note.clone() };
    for frame in 0..frames {
        cx.check(WHAT)?;
        cx.progress(u64::from(frame), u64::from(frames), name.clone());
        let turned_deg = 360.0 * f64::from(frame) / f64::from(frames);
        let StillSetup { pane, ground, angles, distance_m, .. } = *setup;
        let view = SpaceView { pane, ground, angles, turned_deg, distance_m, size_px };
        let mut picture = by.draw(&pair, &view)?;
        done.px_per_mm = picture.px_per_m * 1e-3;
        let painted = distance_m.filter(|_| pair.sides.iter().any(|side| side.deviation.is_some()));
        let strip = StillStrip::new((&name, &pair.note), done.px_per_mm, setup.width_px, painted);
        letter(&mut picture.pixels, ground, &strip)?;
        let file = match setup.turntable {
            Some(_) => out.join(format!("frame_{:04}.png", frame + 1)),
            None => out.to_owned(),
        };
        images::write_rgba8(&file, &picture.pixels)
            .map_err(|err| TaskError::new(WHAT, format!("{err} ({})", file.display())))?;
        done.files.push(file);
    }
    Ok(done)
}

/// The letters below a still.
struct StillStrip {
    /// Width and height, units.
    size: [u32; 2],
    name: String,
    note: Vec<String>,
    /// Length in units, with its text.
    bar: Option<(f64, String)>,
    /// Distance at which the colors end, millimeters.
    distance_mm: Option<f64>,
}

impl StillStrip {
    fn new((name, note): (&str, &str), px_per_mm: f64, width_px: u32, distance_m: Option<f64>) -> Self {
        let per_mm = px_per_mm * UNITS / f64::from(width_px.max(1));
        let bar = LENGTHS_MM.iter().rev().find(|mm| **mm * per_mm <= UNITS / 4.0);
        let bar = bar.filter(|_| per_mm > 0.0).map(|mm| (mm * per_mm, format!("{mm} mm")));
        let high = STRIP[usize::from(distance_m.is_some())];
        // A number of few digits that came through single precision is meant.
        let distance_mm = distance_m.map(|m| (m * 1e7).round() * 1e-4);
        Self { size: [UNITS as u32, high as u32], name: name.to_owned(), note: lines(note), bar, distance_mm }
    }

    /// Left and top of the color bar, units.
    fn color_bar(&self) -> Option<[f64; 2]> {
        self.distance_mm.map(|_| [UNITS - 10.0 - BAR[0], 11.0])
    }
}

/// A note in lines, broken between its parts; what does not fit is said by the report.
fn lines(note: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for part in note.split(" · ") {
        match lines.last_mut() {
            Some(line) if line.chars().count() + part.chars().count() + 3 <= NOTE.0 => *line += &format!(" · {part}"),
            _ => lines.push(part.to_owned()),
        }
    }
    lines.truncate(NOTE.1);
    lines
}

impl Drawing for StillStrip {
    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
        let left = |units: f64| paper.letters(units, BLACK).pos(Pos::new(HPos::Left, VPos::Bottom));
        let high = f64::from(self.size[1]);
        let top = high - 6.0 - 9.0 * self.note.len() as f64;
        paper.text([10.0, top - 1.0], &left(8.5), &self.name)?;
        for (line, y) in self.note.iter().zip(1..) {
            paper.text([10.0, top + 9.0 * f64::from(y)], &left(7.0), line)?;
        }
        if let Some((length, text)) = &self.bar {
            let (right, y) = (UNITS - 10.0, high - 8.0);
            paper.line(&[[right - length, y], [right, y]], BLACK, 1.2)?;
            for x in [right - length, right] {
                paper.line(&[[x, y - 2.5], [x, y + 2.5]], BLACK, 1.0)?;
            }
            let style = paper.letters(8.5, BLACK).pos(Pos::new(HPos::Center, VPos::Bottom));
            paper.text([right - length / 2.0, y - 3.0], &style, text)?;
        }
        if let Some((mm, [left, top])) = self.distance_mm.zip(self.color_bar()) {
            let centered = |at: VPos| paper.letters(7.0, BLACK).pos(Pos::new(HPos::Center, at));
            let [middle, below] = [left + BAR[0] / 2.0, top + BAR[1] + 1.5];
            paper.text([middle, top - 1.0], &centered(VPos::Bottom), "signed distance, mm")?;
            for (share, text) in [(0.0, format!("-{mm} inside")), (0.5, "0".into()), (1.0, format!("+{mm}"))] {
                let side = [HPos::Left, HPos::Center, HPos::Right][(2.0 * share) as usize];
                let style = paper.letters(7.0, BLACK).pos(Pos::new(side, VPos::Top));
                paper.text([left + share * BAR[0], below], &style, &text)?;
            }
        }
        Ok(())
    }
}

/// Lays the letters and the color bar over the lower end of a picture, in an ink that can be read on its ground.
fn letter(pixels: &mut Grid<[u8; 4]>, ground: Ground, strip: &StillStrip) -> Result<(), TaskError> {
    let ink: f32 = if ground == Ground::Black { 225.0 } else { 40.0 };
    let scale = pixels.width() as f64 / UNITS;
    let drawn = canvas::pixels(strip, scale).map_err(|err| TaskError::new(WHAT, format!("{err:#}")))?;
    let top = pixels.height().saturating_sub(drawn.height());
    for (x, y) in (0..drawn.height()).flat_map(|y| (0..drawn.width()).map(move |x| (x, y))) {
        let Some([r, g, b, a]) = pixels.get(x, top + y).copied() else { continue };
        // Black on white: what is missing from white is ink.
        let cover = 1.0 - drawn[(x, y)][1] / 255.0;
        if cover <= 0.0 {
            continue;
        }
        let below = f32::from(a) / 255.0 * (1.0 - cover);
        let alpha = cover + below;
        let over = |v: u8| ((ink * cover + f32::from(v) * below) / alpha).round() as u8;
        pixels[(x, top + y)] = [over(r), over(g), over(b), (alpha * 255.0).round() as u8];
    }
    if let Some([left, from]) = strip.color_bar() {
        let [left, from, wide, high] = [left, from, BAR[0], BAR[1]].map(|units| (units * scale).round() as usize);
        for (x, y) in (0..high).flat_map(|y| (0..wide).map(move |x| (x, y))) {
            let [r, g, b] = DISTANCE_MAP.rgb8(x as f32 / (wide.max(2) - 1) as f32);
            let at = (left + x, top + from + y);
            if at.0 < pixels.width() && at.1 < pixels.height() {
                pixels[at] = [r, g, b, 255];
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::images::space::{InSpace, SpacePicture};
    use crate::labels::ImprintSource;

    /// Draws the share of the frame's turn as a color, and nothing in the upper half.
    struct Plain;

    impl DrawSpace for Plain {
        fn draw(&self, pair: &InSpace, view: &SpaceView) -> Result<SpacePicture, TaskError> {
            assert!(pair.sides.iter().all(|side| side.pose.is_some() && !side.contact.is_empty()));
            let [w, h] = view.size_px.map(|n| n as usize);
            let color = (view.turned_deg / 360.0 * 255.0) as u8;
            let pixels = Grid::from_fn(w, h, |_, y| if y < h / 2 { [0; 4] } else { [color, 200, 200, 255] });
            Ok(SpacePicture { pixels, px_per_m: 10_000.0 })
        }
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
    fn a_still_has_its_letters_and_its_empty_ground() {
        let folder = tempfile::tempdir().unwrap();
        let (demo, models) = (Dataset::demo(), Models::new(None));
        let file = folder.path().join("still.png");
        let done = still(&demo, &setup(), &models, &Plain, &file, &JobCx::unwatched()).unwrap();
        assert_eq!((done.size_px, done.px_per_mm), ([480, 480], 10.0));
        assert!(done.note.starts_with(ImprintSource::Measured.key()) && done.note.contains("true"), "{}", done.note);
        let image = image::open(&file).unwrap().into_rgba8();
        assert_eq!(image.get_pixel(100, 50).0[3], 0, "nothing was drawn there");
        // 10 mm are 100 pixels, from the right.
        assert_eq!(image.get_pixel(420, 472).0, [40, 40, 40, 255], "the scale bar");
        assert_eq!(image.get_pixel(360, 472).0, [0, 200, 200, 255], "beside it");
    }

    #[test]
    fn distances_have_their_bar() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("still.png");
        let setup = StillSetup { distance_m: Some(0.002), ground: Ground::White, ..setup() };
        still(&Dataset::demo(), &setup, &Models::new(None), &Plain, &file, &JobCx::unwatched()).unwrap();
        let image = image::open(&file).unwrap().into_rgba8();
        // The bar is 110 by 6 pixels, 11 below the top of the strip.
        for (x, share) in [(360, 0.0), (469, 1.0)] {
            assert_eq!(image.get_pixel(x, 480 - 66 + 14).0[..3], DISTANCE_MAP.rgb8(share), "{share}");
        }
    }

    #[test]
    fn a_turntable_is_numbered_frames_all_around() {
        let folder = tempfile::tempdir().unwrap();
        let setup = StillSetup { turntable: Some(4), width_px: 64, ..setup() };
        let new = folder.path().join("frames");
        let done = still(&Dataset::demo(), &setup, &Models::new(None), &Plain, &new, &JobCx::unwatched()).unwrap();
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
