//! Stills of a pair in 3D as PNG files ([`still`]).

pub mod space;

use std::path::Path;
use std::sync::Arc;

use crate::error::TaskError;
use crate::io::dataset::Dataset;
use crate::io::images;
use crate::job::JobCx;
use crate::labels::PairLabels;
use crate::steps::models::Models;
use crate::steps::recipe::Recipe;
use space::{Ground, InSpace, SpaceInput, SpacePane, SpaceView, ViewAngles, in_space};
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::Grid;

const WHAT: &str = "Still";
/// Width of a still at scale 1, pixels; it is as high as it is wide.
pub const WIDTH_PX: u32 = 960;
/// Widths that can be asked for, pixels.
const WIDTHS_PX: std::ops::RangeInclusive<u32> = 64..=8192;

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
    /// Width and height, pixels.
    pub width_px: u32,
    /// Distance at which the colors of signed distances end, meters; `None` without them.
    pub distance_m: Option<f64>,
}

/// Draws a pair and writes it as a PNG file.
///
/// # Errors
/// If it cannot be drawn as large as asked, the pair cannot be read, its results cannot be made, the graphics device fails,
/// or the job was told to stop.
pub fn still(
    dataset: &Dataset,
    setup: &StillSetup,
    models: &Models,
    draw: impl Fn(&InSpace, &SpaceView) -> Result<Grid<[u8; 4]>, TaskError>,
    file: &Path,
    cx: &JobCx,
) -> Result<(), TaskError> {
    if !WIDTHS_PX.contains(&setup.width_px) {
        let (lo, hi) = (WIDTHS_PX.start(), WIDTHS_PX.end());
        let why = format!("{} pixels are no width", setup.width_px);
        return Err(TaskError::new(WHAT, why).with_hint(format!("Choose {lo} to {hi} pixels.")));
    }
    let name = dataset.index.get(setup.pair).map_or_else(String::new, |entry| entry.name.clone());
    let sample = dataset
        .load(setup.pair)
        .map(Arc::new)
        .map_err(|err| TaskError::from_error(format!("{WHAT}: load {name}"), &err).with_hint(err.hint()))?;
    let input = SpaceInput { dataset, pair: setup.pair, recipe: &setup.recipe, labels: &setup.labels, models };
    let pair = in_space(input, &sample, setup.pane.sides(), setup.distance_m.is_some(), cx)?;
    cx.check(WHAT)?;
    let StillSetup { ground, angles, distance_m, .. } = *setup;
    let pixels = draw(&pair, &SpaceView { ground, angles, distance_m, size_px: [setup.width_px; 2] })?;
    images::write_rgba8(file, &pixels).map_err(|err| TaskError::new(WHAT, format!("{err} ({})", file.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Draws nothing in the upper half.
    fn plain(pair: &InSpace, view: &SpaceView) -> Result<Grid<[u8; 4]>, TaskError> {
        assert!(pair.sides.iter().all(|side| side.pose.is_some() && !side.contact.is_empty()));
        let [w, h] = view.size_px.map(|n| n as usize);
        Ok(Grid::from_fn(w, h, |_, y| if y < h / 2 { [0; 4] } else { [0, 200, 200, 255] }))
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
            distance_m: None,
        }
    }

    #[test]
    fn a_still_is_the_picture_with_its_empty_ground() {
        let folder = tempfile::tempdir().unwrap();
        let (demo, models) = (Dataset::demo(), Models::new(None));
        let file = folder.path().join("still.png");
        still(&demo, &setup(), &models, plain, &file, &JobCx::unwatched()).unwrap();
        let image = image::open(&file).unwrap().into_rgba8();
        assert_eq!(image.get_pixel(100, 50).0[3], 0, "nothing was drawn there");
        assert_eq!(image.get_pixel(360, 472).0, [0, 200, 200, 255]);
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_in_words() {
        let broken = StillSetup { width_px: 20_000, ..setup() };
        let made = still(&Dataset::demo(), &broken, &Models::new(None), plain, Path::new("x.png"), &JobCx::unwatched());
        assert!(made.unwrap_err().hint.is_some());
    }
}
