//! Pictures of pairs side by side, drawn for papers: rows of pairs, columns of panes, one locked range of colors with its
//! bar, a scale bar in millimeters ([`figure`], [`Figure::write`]). A single pane is a figure of one row and one column.

mod sheet;

use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use crate::compare::{Comparison, of_pad, tile_of};
use crate::error::TaskError;
use crate::images::canvas;
pub use crate::images::space::note;
use crate::images::space::{SpacePane, SpacePicture, SpaceView};
use crate::io::atomic;
use crate::io::dataset::Dataset;
use crate::io::images;
use crate::job::JobCx;
use crate::steps::imprint::{color, imprint_of};
use crate::steps::prediction::Prediction;
use sheet::FigureLayout;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::picture::{self, Rgb8};
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::{PadId, PerPad, Rig, Sensor};
use touch2touch_core::sample::{Sample, Scale};
use touch2touch_core::units;

const WHAT: &str = "Figure";
/// Most pixels of a PNG: what is drawn takes twelve times as many bytes while it is made.
const MOST_PIXELS: f64 = 5e7;
/// Most pictures in a figure.
const MOST_CELLS: usize = 400;
/// Scales that can be chosen: pixels per unit, where an imprint of the lab's rig is 175 units wide.
pub const SCALES: std::ops::RangeInclusive<f64> = 0.5..=16.0;

/// A column of a figure: what the pane of that name shows.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    Hash,
    PartialOrd,
    Ord,
    Serialize,
    Deserialize,
    EnumIter,
    EnumString,
    IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum FigurePane {
    /// The color sensor's difference image, which the generator sees.
    #[serde(rename = "gelslim")]
    #[strum(serialize = "gelslim")]
    GelSlim,
    /// The color sensor's image during the touch.
    Raw,
    /// The color sensor's image without contact.
    Reference,
    /// The measured imprint.
    Measured,
    /// The predicted imprint.
    Predicted,
    /// Predicted minus measured.
    Error,
    /// One of the two imprints that are compared minus the other.
    Compare,
    /// The pair in 3D by its measured imprint.
    #[serde(rename = "3d:measured")]
    #[strum(serialize = "3d:measured")]
    SpaceMeasured,
    /// The pair in 3D by its predicted imprint.
    #[serde(rename = "3d:predicted")]
    #[strum(serialize = "3d:predicted")]
    SpacePredicted,
    /// The pair in 3D by both.
    #[serde(rename = "3d:both")]
    #[strum(serialize = "3d:both")]
    SpaceBoth,
}

impl FigurePane {
    /// The imprints of a column in 3D.
    pub fn space(self) -> Option<SpacePane> {
        match self {
            Self::SpaceMeasured => Some(SpacePane::Measured),
            Self::SpacePredicted => Some(SpacePane::Predicted),
            Self::SpaceBoth => Some(SpacePane::Both),
            _ => None,
        }
    }

    /// Name on the command line and in files.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The caption of its column.
    pub fn title(self, rig: &Rig) -> String {
        let color = rig.color().map_or("Color", |sensor| &sensor.name);
        match self {
            Self::GelSlim => format!("{color} difference"),
            Self::Raw => format!("{color} raw"),
            Self::Reference => format!("{color} reference"),
            Self::Measured => "Measured imprint".into(),
            Self::Predicted => "Predicted imprint".into(),
            Self::Error => "Error".into(),
            Self::Compare => "A minus B".into(),
            Self::SpaceMeasured => "3D, measured".into(),
            Self::SpacePredicted => "3D, predicted".into(),
            Self::SpaceBoth => "3D, both".into(),
        }
    }

    /// True where something has to be predicted for it.
    pub fn is_predicted(self) -> bool {
        matches!(self, Self::Predicted | Self::Error | Self::Compare | Self::SpacePredicted | Self::SpaceBoth)
    }

    /// True where it shows one imprint minus another.
    pub fn is_difference(self) -> bool {
        matches!(self, Self::Error | Self::Compare)
    }

    fn sensor(self, rig: &Rig) -> Option<&Sensor> {
        match self {
            Self::GelSlim | Self::Raw | Self::Reference => rig.color(),
            Self::Measured | Self::Predicted | Self::Error | Self::Compare => rig.depth(),
            Self::SpaceMeasured | Self::SpacePredicted | Self::SpaceBoth => None,
        }
    }
}

/// The ground and ink of a figure.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, EnumIter, EnumString, IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum FigureTheme {
    /// Dark on white, for papers.
    #[default]
    Light,
    /// Light on dark, for slides.
    Dark,
}

/// Look of a figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FigureLook {
    /// The columns, left to right.
    pub panes: Vec<FigurePane>,
    /// The color map of imprints.
    pub map: ColorMap,
    /// The range of imprints, meters.
    pub range: Range,
    /// Half the range of errors, meters.
    pub error_m: f32,
    /// Ground and ink.
    pub theme: FigureTheme,
    /// True where the color sensor's window is drawn on imprints.
    pub window: bool,
    /// Pixels per unit of a PNG, within [`SCALES`].
    pub scale: f64,
}

impl Default for FigureLook {
    fn default() -> Self {
        use FigurePane::{Error, GelSlim, Measured, Predicted};
        Self {
            panes: vec![GelSlim, Measured, Predicted, Error],
            map: ColorMap::Viridis,
            range: Range { lo: 0.0, hi: 0.018 },
            error_m: 0.004,
            theme: FigureTheme::Light,
            window: true,
            scale: 2.0,
        }
    }
}

impl FigureLook {
    /// Width and height of a figure with so many rows, units (pixels of an SVG).
    pub fn size(&self, rows: usize, rig: &Rig) -> [u32; 2] {
        sheet::size(self, rows, rig)
    }

    /// Width and height of its PNG, pixels.
    pub fn pixels(&self, rows: usize, rig: &Rig) -> [u32; 2] {
        self.size(rows, rig).map(|n| (f64::from(n) * self.scale).round() as u32)
    }

    /// Checks that it can be drawn with so many rows.
    ///
    /// # Errors
    /// The reason why it cannot, and what to do.
    pub fn check(&self, rows: usize, rig: &Rig) -> Result<(), TaskError> {
        let fail = |why: String, hint: &str| Err(TaskError::new(WHAT, why).with_hint(hint));
        if rows == 0 || self.panes.is_empty() {
            return fail("there is nothing in it".into(), "Choose at least one pair, one finger and one pane.");
        }
        if rows.saturating_mul(self.panes.len()) > MOST_CELLS {
            let why = format!("{rows} rows of {} pictures are more than {MOST_CELLS}", self.panes.len());
            return fail(why, "Choose fewer pairs or panes.");
        }
        if !(self.range.lo.is_finite() && self.range.hi.is_finite() && self.range.lo < self.range.hi) {
            let why = format!("{} to {} m is no range of colors", self.range.lo, self.range.hi);
            return fail(why, "The lower end must lie below the upper one.");
        }
        if !(self.error_m > 0.0 && self.error_m.is_finite()) {
            return fail(format!("errors cannot span {} m", self.error_m), "Choose a range above zero.");
        }
        if !SCALES.contains(&self.scale) {
            return fail(format!("{} is no scale", self.scale), "Choose 0.5 to 16 pixels per unit.");
        }
        let [width, height] = self.pixels(rows, rig);
        if f64::from(width) * f64::from(height) > MOST_PIXELS {
            let why = format!("it would have {width} x {height} pixels");
            return fail(why, "Choose a smaller scale or fewer pairs, or write an SVG with scale 1.");
        }
        Ok(())
    }
}

/// Content of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct FigureSetup {
    /// The pairs, top to bottom.
    pub pairs: Vec<PairId>,
    /// The fingers, each a row of its own where a pair has it.
    pub fingers: Vec<PadId>,
    /// Mapping of predictions to meters.
    pub shift: ShiftMode,
    /// Look of the figure.
    pub look: FigureLook,
    /// The line below everything: what made the predictions, and what is compared.
    pub note: String,
}

/// Makers of what the columns of a figure show of a pair; each is asked only where a column needs it.
pub struct FigureMakers<P, S, A> {
    /// Predictions of the pair's fingers.
    pub predict: P,
    /// Picture of the pair in 3D.
    pub space: S,
    /// One of the imprints that are compared minus the other, of each finger that has both.
    pub apart: A,
}

/// One picture of a figure.
#[derive(Clone, Debug)]
struct Cell {
    /// As the pane shows it; else why there is none.
    picture: Result<Rgb8, String>,
    /// Pixels per meter.
    px_per_m: Option<f64>,
    /// True where each row has a scale of its own.
    own_scale: bool,
    /// Window of the color sensor in it: center and size, pixels.
    window: Option<[f64; 4]>,
    /// A figure of it, in a corner.
    note: String,
}

/// A pair and finger.
#[derive(Clone, Debug)]
struct Row {
    /// The pair's name.
    name: String,
    /// The finger's.
    finger: String,
    cells: Vec<Cell>,
}

/// A figure, ready to be written.
#[derive(Debug)]
pub struct Figure {
    sheet: FigureLayout,
    /// Rows drawn.
    pub rows: usize,
    /// Pair and finger of each row.
    pub of: Vec<[String; 2]>,
}

/// A figure in a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FigureFile {
    /// Width and height, pixels.
    pub size_px: [u32; 2],
    /// Pair and finger of each row.
    pub rows: Vec<[String; 2]>,
    /// The columns.
    pub panes: Vec<FigurePane>,
    /// The range of the colors of imprints, millimeters.
    pub range_mm: [f32; 2],
    /// Half the range of the colors of errors, millimeters.
    pub error_mm: f32,
}

/// Draws pairs of a data set.
///
/// # Errors
/// If it would be empty or too large, a pair cannot be read, a prediction fails, or the job was told to stop.
pub fn figure(
    dataset: &Dataset,
    setup: &FigureSetup,
    mut makers: FigureMakers<
        impl FnMut(PairId, &Arc<Sample>, &JobCx) -> Result<PerPad<Prediction>, TaskError>,
        impl FnMut(PairId, &Sample, &SpaceView, &JobCx) -> Result<SpacePicture, TaskError>,
        impl FnMut(PairId, &Arc<Sample>, &JobCx) -> Result<PerPad<Comparison>, TaskError>,
    >,
    cx: &JobCx,
) -> Result<Figure, TaskError> {
    let look = &setup.look;
    // Before anything is predicted; that a pair may lack a finger makes it smaller only.
    look.check(setup.pairs.len() * setup.fingers.len(), &dataset.rig)?;
    let mut rows = Vec::new();
    for (at, &pair) in setup.pairs.iter().enumerate() {
        cx.check(WHAT)?;
        let name = dataset.index.get(pair).map_or_else(String::new, |entry| entry.name.clone());
        cx.progress(at as u64, setup.pairs.len() as u64, name.clone());
        let sample = dataset
            .load(pair)
            .map(Arc::new)
            .map_err(|err| TaskError::from_error(format!("{WHAT}: load {name}"), &err).with_hint(err.hint()))?;
        let shows = |those: &[FigurePane]| look.panes.iter().any(|pane| those.contains(pane));
        let predicted = shows(&[FigurePane::Predicted, FigurePane::Error]);
        let made = if predicted { (makers.predict)(pair, &sample, cx)? } else { PerPad::default() };
        let compared = shows(&[FigurePane::Compare]);
        let apart = if compared { (makers.apart)(pair, &sample, cx)? } else { PerPad::default() };
        let mut in_space = Vec::new();
        for pane in look.panes.iter().filter_map(|pane| pane.space()) {
            in_space.push((pane, (makers.space)(pair, &sample, &sheet::space_view(look, pane, &dataset.rig), cx)?));
        }
        let tile = if predicted { tile_of(dataset, pair, &sample)? } else { None };
        for &finger in &setup.fingers {
            if sample.pad(finger).is_none() {
                continue;
            }
            let drawn = made.get(finger).map(|made| (made, setup.shift));
            let cells = look.panes.iter().map(|pane| match pane.space() {
                Some(of) => Ok(space_cell(&mut in_space, of)),
                None => cell(*pane, &sample, finger, (drawn, apart.get(finger)), tile.as_ref(), look),
            });
            let cells = cells.collect::<Result<_, TaskError>>()?;
            rows.push(Row { name: name.clone(), finger: sample.rig.pad_key(finger).into_owned(), cells });
        }
    }
    look.check(rows.len(), &dataset.rig)?;
    let of = rows.iter().map(|row| [row.name.clone(), row.finger.clone()]).collect();
    let count = rows.len();
    Ok(Figure { sheet: FigureLayout::new(look.clone(), &rows, &setup.note, &dataset.rig), rows: count, of })
}

/// A picture in 3D. It shows all fingers, and so stands in the first row of a pair alone.
fn space_cell(pictures: &mut Vec<(SpacePane, SpacePicture)>, pane: SpacePane) -> Cell {
    let Some(at) = pictures.iter().position(|(of, _)| *of == pane) else {
        return Cell {
            picture: Err("as above".into()),
            px_per_m: None,
            own_scale: true,
            window: None,
            note: String::new(),
        };
    };
    let (_, picture) = pictures.remove(at);
    let pixels = picture.pixels.map(|[r, g, b, _]| [*r, *g, *b]);
    Cell { picture: Ok(pixels), px_per_m: Some(picture.px_per_m), own_scale: true, window: None, note: String::new() }
}

/// One picture, in the colors and the orientation of its pane.
fn cell(
    pane: FigurePane,
    sample: &Sample,
    finger: PadId,
    (drawn, apart): (Option<(&Prediction, ShiftMode)>, Option<&Comparison>),
    tile: Option<&DepthMap>,
    look: &FigureLook,
) -> Result<Cell, TaskError> {
    let touch = sample.pad(finger);
    let (gelslim, bubble) = (touch.and_then(|t| t.color()), touch.and_then(|t| t.depth()));
    let lies = |picture: Rgb8| if sample.rig.turned() { picture.rotated_180() } else { picture };
    let absent = |why: &str| Err(why.to_owned());
    let imprint = || match drawn {
        Some((made, shift)) if made.color.is_none() => imprint_of(made, shift, sample, finger).map(Some),
        _ => Ok(None),
    };
    let difference =
        |found: &Comparison| picture::colored(&found.error, ColorMap::Diverging, Range::symmetric(look.error_m));
    let mut note = String::new();
    let picture = match pane {
        FigurePane::GelSlim => {
            gelslim.map_or_else(|| absent("no image"), |touch| Ok(lies(picture::difference(&touch.difference))))
        }
        FigurePane::Raw | FigurePane::Reference => gelslim.and_then(|touch| touch.images.as_ref()).map_or_else(
            || absent("only the difference is known"),
            |images| {
                let image = if pane == FigurePane::Raw { &images.raw } else { &images.reference };
                Ok(lies(picture::plain(image)))
            },
        ),
        FigurePane::Measured => bubble
            .map_or_else(|| absent("not measured"), |touch| Ok(picture::colored(&touch.imprint, look.map, look.range))),
        FigurePane::Predicted => match (imprint()?, drawn) {
            (Some(imprint), _) => Ok(picture::colored(&imprint, look.map, look.range)),
            (None, Some((made, _))) => {
                let picture = color(made, [0, 0])?;
                picture.map_or_else(|| absent("no prediction"), |picture| Ok(lies(picture::difference(&picture))))
            }
            (None, None) => absent("no prediction"),
        },
        FigurePane::Error => match imprint()? {
            Some(imprint) => match of_pad(&imprint, drawn, sample, finger, tile)? {
                Some(found) => {
                    note = format!("mean |error| {}", units::text_mm(found.mae_m));
                    Ok(difference(&found))
                }
                None => absent("not measured"),
            },
            None => absent("no prediction"),
        },
        FigurePane::Compare => match apart {
            Some(found) => {
                note = format!("mean |A - B| {}", units::text_mm(found.mae_m));
                Ok(difference(found))
            }
            None => absent("not both are there"),
        },
        FigurePane::SpaceMeasured | FigurePane::SpacePredicted | FigurePane::SpaceBoth => absent("drawn in 3D"),
    };
    let sensor = pane.sensor(&sample.rig);
    let width = picture.as_ref().ok().map(|picture: &Rgb8| picture.width() as f64);
    let px_per_m = sensor.zip(width).map(|(sensor, width)| sensor.px_per_m * width / sensor.width.max(1) as f64);
    let window = (pane.sensor(&sample.rig) == sample.rig.depth())
        .then(|| Some(sample.rig.color_window(finger)?.rectangle()))
        .flatten()
        .filter(|_| look.window && width == sensor.map(|sensor| sensor.width as f64));
    if sample.scale == Scale::Assumed && note.is_empty() && pane.sensor(&sample.rig) == sample.rig.depth() {
        note = "assumed scale".into();
    }
    Ok(Cell { picture, px_per_m, own_scale: false, window, note })
}

impl Figure {
    /// As SVG text; pictures lie in it as PNG.
    ///
    /// # Errors
    /// If it cannot be drawn.
    pub fn svg(&self) -> Result<String, TaskError> {
        canvas::svg(&self.sheet).map_err(|err| TaskError::new(WHAT, format!("{err:#}")))
    }

    /// As pixels, values 0..255.
    ///
    /// # Errors
    /// If it cannot be drawn.
    pub fn pixels(&self) -> Result<touch2touch_core::grid::RgbGrid, TaskError> {
        canvas::pixels(&self.sheet, self.sheet.look.scale).map_err(|err| TaskError::new(WHAT, format!("{err:#}")))
    }

    /// Writes it, as the file's ending says: `.png` or `.svg`.
    ///
    /// # Errors
    /// If the ending is another one, or the file cannot be written.
    pub fn write(&self, file: &Path) -> Result<FigureFile, TaskError> {
        let fail = |why: String| TaskError::new(WHAT, format!("{why} ({})", file.display()));
        let look = &self.sheet.look;
        let size_px = match kind(file)? {
            FigureKind::Svg => {
                atomic::write_bytes(file, self.svg()?.as_bytes()).map_err(|err| fail(err.to_string()))?;
                self.sheet.size
            }
            FigureKind::Png => {
                let pixels = self.pixels()?;
                images::write_rgb8(file, &pixels).map_err(|err| fail(err.to_string()))?;
                pixels.size().map(|n| n as u32)
            }
        };
        Ok(FigureFile {
            size_px,
            rows: self.of.clone(),
            panes: look.panes.clone(),
            range_mm: [look.range.lo, look.range.hi].map(|m| m * 1e3),
            error_mm: look.error_m * 1e3,
        })
    }
}

/// The kind of a figure's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureKind {
    /// Pixels.
    Png,
    /// Lines and letters, with the pictures in it.
    Svg,
}

/// The kind that a file's ending says.
///
/// # Errors
/// If it is neither.
pub fn kind(file: &Path) -> Result<FigureKind, TaskError> {
    let ending = file.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some("png") => Ok(FigureKind::Png),
        Some("svg") => Ok(FigureKind::Svg),
        _ => {
            let why = format!("the name ends neither in .png nor in .svg ({})", file.display());
            Err(TaskError::new(WHAT, why).with_hint("Name the file figure.png or figure.svg."))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::compare;
    use touch2touch_core::rig::lab;

    fn setup(panes: &[FigurePane], scale: f64) -> FigureSetup {
        let look = FigureLook { panes: panes.to_vec(), scale, window: false, ..FigureLook::default() };
        let shift = ShiftMode::default();
        FigureSetup { pairs: vec![PairId(0), PairId(5)], fingers: lab::PADS.to_vec(), shift, look, note: "n".into() }
    }

    fn drawn(setup: &FigureSetup) -> Result<Figure, TaskError> {
        let never = |_, _: &Arc<Sample>, _: &JobCx| panic!("nothing has to be predicted");
        // A plain color tells that a picture was asked for at the size of its cell.
        let space = |_, _: &Sample, view: &SpaceView, _: &JobCx| {
            let [w, h] = view.size_px.map(|n| n as usize);
            Ok(SpacePicture { pixels: touch2touch_core::grid::Grid::filled(w, h, [9, 99, 199, 255]), px_per_m: 2000.0 })
        };
        let apart = |_, sample: &Arc<Sample>, _: &JobCx| {
            let imprint = &sample.pad(lab::RIGHT).and_then(|touch| touch.depth()).unwrap().imprint;
            let mut found = PerPad::default();
            found[lab::RIGHT] = Some(compare(&imprint.map(|m| m + 0.001), imprint, Scale::Measured).unwrap());
            Ok(found)
        };
        let makers = FigureMakers { predict: never, space, apart };
        figure(&Dataset::demo(), setup, makers, &JobCx::unwatched())
    }

    #[test]
    fn pixels_are_those_of_the_panes() {
        let (demo, scale) = (Dataset::demo(), 2.0);
        let setup = setup(&[FigurePane::GelSlim, FigurePane::Measured], scale);
        let figure = drawn(&setup).unwrap();
        assert_eq!((figure.rows, figure.of[1][1].as_str()), (4, "left"));
        let image = figure.pixels().unwrap();
        assert_eq!(image.size().map(|n| n as u32), setup.look.pixels(4, &demo.rig));
        let sample = demo.load(PairId(5)).unwrap();
        let touch = sample.pad(lab::LEFT).unwrap();
        let (imprint, wanted) = (&touch.depth().unwrap().imprint, setup.look.range);
        // The last row of the second column; nothing is written on its upper half.
        let [left, top] = sheet::corner(1, 3, 140.0).map(|units| (units * scale) as usize);
        let mut colors = std::collections::BTreeSet::new();
        for (x, y) in (0..175).flat_map(|x| (0..100).map(move |y| (x, y))) {
            let unit = wanted.unit(imprint[(x, y)]);
            let color = if unit.is_nan() { unit } else { (unit * 255.0 + 0.5).floor() / 255.0 };
            let found = image[(left + 2 * x + 1, top + 2 * y)].map(|v| v as u8);
            assert_eq!(found, ColorMap::Viridis.rgb8(color), "({x}, {y})");
            colors.insert(found);
        }
        assert!(colors.len() > 50, "{}", colors.len());
        // The GelSlim's picture lies as its pane shows it: turned against the file.
        let gel = picture::difference(&touch.color().unwrap().difference).rotated_180();
        let [left, top] = sheet::corner(0, 3, 140.0).map(|units| (units * scale) as usize);
        let high = 175.0 * 320.0 / 427.0;
        let off = ((140.0 - high) / 2.0 * scale) as usize;
        let mean = |at: &dyn Fn(usize, usize) -> f64| (0..6400).map(|i| at(i % 80, i / 80)).sum::<f64>() / 6400.0;
        let shown = mean(&|x, y| f64::from(image[(left + 4 + x * 4, top + off + 4 + y * 2)][0]));
        let meant = mean(&|x, y| f64::from(gel[(5 + x * 4 * 427 / 350, 5 + y * 2 * 427 / 350)][0]));
        assert!((shown - meant).abs() < 3.0, "{shown} {meant}");
    }

    #[test]
    fn what_is_compared_is_a_column_with_its_bar_and_its_mean() {
        let text = drawn(&setup(&[FigurePane::Compare], 1.0)).unwrap().svg().unwrap();
        for word in ["A minus B", "A minus B, mm", "mean |A - B| 1.00 mm", "not both are there"] {
            assert!(text.contains(word), "{word}");
        }
    }

    #[test]
    fn a_column_in_3d_is_drawn_once_for_a_pair_with_its_own_scale() {
        let setup = setup(&[FigurePane::Measured, FigurePane::SpaceMeasured], 2.0);
        let figure = drawn(&setup).unwrap();
        let image = figure.pixels().unwrap();
        let [left, top] = sheet::corner(1, 0, 193.0).map(|units| (units * 2.0) as usize);
        for (x, y) in [(3, 3), (340, 3), (3, 380), (170, 190)] {
            assert_eq!(image[(left + x, top + y)], [9.0, 99.0, 199.0], "({x}, {y})");
        }
        let [left, top] = sheet::corner(1, 1, 193.0).map(|units| (units * 2.0) as usize);
        assert_eq!(image[(left + 30, top + 30)], [255.0; 3], "the second finger's row has none of its own");
        let text = figure.svg().unwrap();
        assert!(text.contains("as above") && text.contains("3D, measured"));
    }

    #[test]
    fn an_svg_is_a_whole_document_with_its_pictures_in_it() {
        let figure = drawn(&setup(&[FigurePane::Measured, FigurePane::Raw], 1.0)).unwrap();
        let text = figure.svg().unwrap();
        assert!(text.starts_with("<svg") && text.trim_end().ends_with("</svg>"));
        // Four of two columns, and the bar.
        assert_eq!(text.matches("<image ").count(), 9);
        for word in ["Measured imprint", "GelSlim raw", "imprint, mm", "\n18\n", "\n20 mm\n", "data_"] {
            assert!(text.contains(word), "{word}");
        }
        assert!(!text.contains("predicted minus"));
        let (open, close) = (text.matches("<text").count(), text.matches("</text>").count());
        assert!(open > 10 && open == close && text.matches('"').count().is_multiple_of(2));
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_in_words() {
        let refused = |change: &dyn Fn(&mut FigureSetup)| {
            let mut setup = setup(&[FigurePane::Measured], 1.0);
            change(&mut setup);
            let err = drawn(&setup).unwrap_err();
            assert!(err.hint.is_some(), "{err}");
            err.why
        };
        assert!(refused(&|s| s.pairs.clear()).contains("nothing"));
        assert!(refused(&|s| s.look.panes.clear()).contains("nothing"));
        assert!(refused(&|s| s.pairs = vec![PairId(0); 900]).contains("more than"));
        assert!(refused(&|s| s.look.range.hi = f32::NAN).contains("range"));
        assert!(refused(&|s| s.look.error_m = 0.0).contains("errors"));
        assert!(refused(&|s| s.look.scale = f64::INFINITY).contains("scale"));
        assert!(refused(&|s| (s.look.scale, s.pairs) = (16.0, vec![PairId(0); 60])).contains("pixels"));
        assert!(kind(Path::new("a.gif")).is_err() && kind(Path::new("a")).is_err());
        assert_eq!(kind(Path::new("a.b.SVG")).unwrap(), FigureKind::Svg);
    }
}
