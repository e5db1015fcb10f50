//! The lines and letters of a figure, and where its pictures lie.

use plotters::prelude::*;
use plotters::style::FontTransform;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{FigureLook, FigurePane, FigureTheme, Row};
use crate::images::canvas::{Drawing, Drawn, Paper, Raster};
use crate::images::space::{Ground, SpacePane, SpaceView, ViewAngles};
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::grid::Grid;
use touch2touch_core::rig::Rig;

/// Width of a picture, units: one for each pixel of the lab's imprints.
const WIDE: f64 = 175.0;
/// Height of a picture in 3D over its width.
const TALL: f64 = 1.1;
/// Fewest pixels of a picture in 3D per unit: an SVG is looked at closely.
const FEWEST: f64 = 4.0;
/// Between pictures.
const GAP: f64 = 6.0;
/// Around everything.
const MARGIN: f64 = 8.0;
/// The captions of rows, at the left.
const LEFT: f64 = 28.0;
/// The captions of columns, at the top.
const TOP: f64 = 16.0;
/// The bars, below.
const BARS: f64 = 40.0;
/// The note, at the bottom.
const NOTE: f64 = 14.0;
/// Widest bar.
const BAR: f64 = 260.0;
/// Height of letters: captions, and smaller ones.
const LETTERS: [f64; 2] = [10.0, 8.5];
/// Letters of a row's caption that fit beside a picture.
const MOST_LETTERS: usize = 30;
/// Round lengths of scale bars, millimeters.
const LENGTHS_MM: [f64; 10] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];

/// A figure laid out.
#[derive(Debug)]
pub(super) struct FigureLayout {
    pub(super) look: FigureLook,
    /// Width and height, units.
    pub(super) size: [u32; 2],
    rasters: Vec<Raster>,
    columns: Vec<String>,
    rows: Vec<[String; 2]>,
    cells: Vec<Laid>,
    bars: Vec<Bar>,
    note: String,
    high: f64,
}

/// A picture's place and what is drawn on it.
#[derive(Debug)]
struct Laid {
    /// Left, top, width and height, units.
    place: [f64; 4],
    /// Why there is no picture.
    absent: Option<String>,
    /// Length in units, with its text.
    scale_bar: Option<(f64, String)>,
    /// Left, top, right and bottom, units.
    window: Option<[f64; 4]>,
    note: String,
}

/// A color bar.
#[derive(Debug)]
struct Bar {
    left: f64,
    width: f64,
    title: &'static str,
    /// Millimeters.
    range: Range,
}

/// The height that all pictures get, units.
fn height(look: &FigureLook, rig: &Rig) -> f64 {
    let shape = |pane: &FigurePane| {
        if pane.space().is_some() {
            return Some(WIDE * TALL);
        }
        let sensor = pane.sensor(rig)?;
        Some((WIDE * sensor.height as f64 / sensor.width.max(1) as f64).clamp(WIDE / 4.0, WIDE * 2.0))
    };
    look.panes.iter().filter_map(shape).fold(0.0, f64::max).max(WIDE / 4.0).round()
}

/// View of a picture in 3D: of as many pixels as its place has while it is drawn.
pub(super) fn space_view(look: &FigureLook, pane: SpacePane, rig: &Rig) -> SpaceView {
    let per_unit = (look.scale * crate::images::canvas::FINE as f64).max(FEWEST);
    SpaceView {
        pane,
        ground: match look.theme {
            FigureTheme::Light => Ground::White,
            FigureTheme::Dark => Ground::Black,
        },
        angles: ViewAngles::default(),
        turned_deg: 0.0,
        distance_m: None,
        size_px: [WIDE, height(look, rig)].map(|units| (units * per_unit).round() as u32),
    }
}

fn bars(look: &FigureLook) -> Vec<(&'static str, ColorMap, Range)> {
    use FigurePane::{Compare, Error, Measured, Predicted};
    let mut bars = Vec::new();
    if look.panes.iter().any(|pane| matches!(pane, Measured | Predicted)) {
        bars.push(("imprint, mm", look.map, look.range));
    }
    if look.panes.contains(&Error) {
        bars.push(("predicted minus measured, mm", ColorMap::Diverging, Range::symmetric(look.error_m)));
    }
    if look.panes.contains(&Compare) {
        bars.push(("A minus B, mm", ColorMap::Diverging, Range::symmetric(look.error_m)));
    }
    bars
}

/// See [`FigureLook::size`].
pub(super) fn size(look: &FigureLook, rows: usize, rig: &Rig) -> [u32; 2] {
    let (columns, rows) = (look.panes.len() as f64, rows as f64);
    let width = 2.0 * MARGIN + LEFT + columns * WIDE + (columns - 1.0).max(0.0) * GAP;
    let bars = if bars(look).is_empty() { 0.0 } else { BARS };
    let grid = rows * height(look, rig) + (rows - 1.0).max(0.0) * GAP;
    [width, 2.0 * MARGIN + TOP + grid + bars + NOTE].map(|units| units.ceil() as u32)
}

/// Left and top of the picture in a column and row, units; `high` is the height of pictures.
pub(super) fn corner(column: usize, row: usize, high: f64) -> [f64; 2] {
    [MARGIN + LEFT + column as f64 * (WIDE + GAP), MARGIN + TOP + row as f64 * (high + GAP)]
}

/// The name in two lines, each short enough for the side of a picture; of a long one the end is kept.
fn caption(name: &str, finger: &str) -> [String; 2] {
    let (folder, own) = name.rsplit_once('/').unwrap_or(("", name));
    [folder.to_owned(), format!("{own}, {finger}")].map(|text| shortened(&text, MOST_LETTERS))
}

fn shortened(text: &str, most: usize) -> String {
    let letters = text.chars().count();
    if letters <= most {
        return text.to_owned();
    }
    std::iter::once('…').chain(text.chars().skip(letters + 1 - most)).collect()
}

impl FigureLayout {
    /// Lays out rows of as many cells as the look has panes.
    pub(super) fn new(look: FigureLook, rows: &[Row], note: &str, rig: &Rig) -> Self {
        let (size, high) = (size(&look, rows.len(), rig), height(&look, rig));
        let (mut rasters, mut cells) = (Vec::new(), Vec::new());
        for (y, row) in rows.iter().enumerate() {
            for (x, cell) in row.cells.iter().enumerate() {
                let corner = corner(x, y, high);
                let mut laid = Laid {
                    place: [corner[0], corner[1], WIDE, high],
                    absent: cell.picture.as_ref().err().cloned(),
                    scale_bar: None,
                    window: None,
                    note: cell.note.clone(),
                };
                if let Ok(pixels) = &cell.picture {
                    let [w, h] = pixels.size().map(|n| n.max(1) as f64);
                    let fit = (WIDE / w).min(high / h);
                    let place =
                        [corner[0] + (WIDE - w * fit) / 2.0, corner[1] + (high - h * fit) / 2.0, w * fit, h * fit];
                    laid.place = place;
                    laid.scale_bar =
                        cell.px_per_m.filter(|_| y == 0 || cell.own_scale).and_then(|px| scale_bar(px * fit * 1e-3));
                    laid.window = cell.window.map(|[cx, cy, w, h]| {
                        let at = |center: f64, half: f64, from: f64| from + (center + 0.5 + half) * fit;
                        [
                            at(cx, -w / 2.0, place[0]),
                            at(cy, -h / 2.0, place[1]),
                            at(cx, w / 2.0, place[0]),
                            at(cy, h / 2.0, place[1]),
                        ]
                    });
                    rasters.push(Raster { place, pixels: pixels.clone() });
                }
                cells.push(laid);
            }
        }
        let found = bars(&look);
        let all = f64::from(size[0]) - 2.0 * MARGIN - LEFT;
        let count = found.len().max(1) as f64;
        let width = ((all - (count - 1.0) * 24.0) / count).min(BAR);
        let below = f64::from(size[1]) - MARGIN - NOTE - BARS;
        let mut bars = Vec::new();
        for (i, (title, map, range)) in found.into_iter().enumerate() {
            let left = MARGIN + LEFT + i as f64 * (width + 24.0);
            let table = map.table();
            let pixels = Grid::from_fn(table.len(), 1, |x, _| table[x]);
            rasters.push(Raster { place: [left, below + 18.0, width, 8.0], pixels });
            bars.push(Bar { left, width, title, range: Range { lo: range.lo * 1e3, hi: range.hi * 1e3 } });
        }
        let most = (all / 4.3) as usize;
        Self {
            columns: look.panes.iter().map(|pane| pane.title(rig)).collect(),
            rows: rows.iter().map(|row| caption(&row.name, &row.finger)).collect(),
            note: note.chars().take(most.max(20)).collect(),
            look,
            size,
            rasters,
            cells,
            bars,
            high,
        }
    }

    fn ink(&self) -> [RGBColor; 2] {
        match self.look.theme {
            FigureTheme::Light => [RGBColor(0x1e, 0x22, 0x28), RGBColor(0x5c, 0x64, 0x6e)],
            FigureTheme::Dark => [RGBColor(0xe6, 0xe9, 0xee), RGBColor(0x9a, 0xa4, 0xb0)],
        }
    }

    fn cell<B: DrawingBackend>(&self, paper: &Paper<'_, B>, laid: &Laid) -> Drawn<B> {
        let [left, top, width, height] = laid.place;
        let (right, bottom) = (left + width, top + height);
        let [_, weak] = self.ink();
        if let Some(why) = &laid.absent {
            let corners = [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]];
            paper.line(&corners, weak, 0.5)?;
            let style = paper.letters(LETTERS[1], weak).pos(Pos::new(HPos::Center, VPos::Center));
            return paper.text([(left + right) / 2.0, (top + bottom) / 2.0], &style, why);
        }
        if let Some(window) = laid.window {
            dashed(paper, window, laid.place)?;
        }
        if let Some((length, text)) = &laid.scale_bar {
            let (end, y) = (right - 5.0, bottom - 5.0);
            for (color, thick) in [(BLACK, 3.0), (WHITE, 1.5)] {
                let over = if thick > 2.0 { 0.75 } else { 0.0 };
                paper.line(&[[end - length - over, y], [end + over, y]], color, thick)?;
            }
            plated(paper, [end - length / 2.0, y - 4.5], HPos::Center, text)?;
        }
        if !laid.note.is_empty() {
            plated(paper, [left + 5.0, bottom - 3.5], HPos::Left, &laid.note)?;
        }
        Ok(())
    }

    fn bar<B: DrawingBackend>(&self, paper: &Paper<'_, B>, bar: &Bar) -> Drawn<B> {
        let [ink, weak] = self.ink();
        let top = f64::from(self.size[1]) - MARGIN - NOTE - BARS + 18.0;
        let title = paper.letters(LETTERS[1], ink).pos(Pos::new(HPos::Left, VPos::Bottom));
        paper.text([bar.left, top - 2.0], &title, bar.title)?;
        // Both ends are always said; round numbers between them where they do not run into these.
        let mut ticks = bar.range.ticks((bar.width / 40.0) as usize);
        let near = (bar.range.hi - bar.range.lo) * 18.0 / bar.width as f32;
        ticks.retain(|v| *v - bar.range.lo > near && bar.range.hi - *v > near);
        ticks.extend([bar.range.lo, bar.range.hi]);
        for v in ticks {
            let x = bar.left + f64::from(bar.range.unit(v)) * bar.width;
            paper.line(&[[x, top + 8.0], [x, top + 10.5]], weak, 0.5)?;
            let side = match v {
                v if v == bar.range.lo => HPos::Left,
                v if v == bar.range.hi => HPos::Right,
                _ => HPos::Center,
            };
            let style = paper.letters(LETTERS[1], ink).pos(Pos::new(side, VPos::Top));
            paper.text([x, top + 11.5], &style, &number(v))?;
        }
        Ok(())
    }
}

/// A number as short as it can be said.
fn number(v: f32) -> String {
    let text = format!("{v:.2}");
    let short = text.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" { "0".into() } else { short.to_owned() }
}

/// The longest round length that takes at most a third of a picture, with its text; `px_per_mm` in units.
fn scale_bar(px_per_mm: f64) -> Option<(f64, String)> {
    let fits = |mm: &&f64| **mm * px_per_mm <= WIDE / 3.0;
    let mm = LENGTHS_MM.iter().rev().find(fits).filter(|_| px_per_mm > 0.0 && px_per_mm.is_finite())?;
    Some((mm * px_per_mm, format!("{mm} mm")))
}

/// Light letters on a dark plate: they can be read on every color.
fn plated<B: DrawingBackend>(paper: &Paper<'_, B>, [x, y]: [f64; 2], side: HPos, text: &str) -> Drawn<B> {
    // Wide enough for most letters; the plate need not fit exactly.
    let width = text.chars().count() as f64 * LETTERS[1] * 0.52;
    let left = if matches!(side, HPos::Left) { x } else { x - width / 2.0 };
    let at = |x: f64, y: f64| (paper.px(x), paper.px(y));
    let plate = [at(left - 2.0, y - LETTERS[1] - 0.5), at(left + width + 2.0, y + 1.5)];
    paper.area.draw(&Rectangle::new(plate, BLACK.mix(0.6).filled()))?;
    paper.text([x, y], &paper.letters(LETTERS[1], WHITE).pos(Pos::new(side, VPos::Bottom)), text)
}

/// A dashed rectangle within a picture.
fn dashed<B: DrawingBackend>(paper: &Paper<'_, B>, window: [f64; 4], place: [f64; 4]) -> Drawn<B> {
    const DASH: f64 = 3.0;
    let inside = |v: f64, from: f64, length: f64| v.clamp(from, from + length);
    let [left, right] = [window[0], window[2]].map(|x| inside(x, place[0], place[2]));
    let [top, bottom] = [window[1], window[3]].map(|y| inside(y, place[1], place[3]));
    let light = RGBColor(235, 235, 235);
    for [from, to] in [
        [[left, top], [right, top]],
        [[right, top], [right, bottom]],
        [[right, bottom], [left, bottom]],
        [[left, bottom], [left, top]],
    ] {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let at = |t: f64| {
            let share = (t / length.max(1e-9)).min(1.0);
            [from[0] + (to[0] - from[0]) * share, from[1] + (to[1] - from[1]) * share]
        };
        for i in 0..(length / (2.0 * DASH)).ceil() as usize {
            let start = 2.0 * DASH * i as f64;
            paper.line(&[at(start), at(start + DASH)], BLACK, 1.5)?;
            paper.line(&[at(start), at(start + DASH)], light, 0.75)?;
        }
    }
    Ok(())
}

impl Drawing for FigureLayout {
    fn size(&self) -> [u32; 2] {
        self.size
    }

    fn ground(&self) -> RGBColor {
        match self.look.theme {
            FigureTheme::Light => WHITE,
            FigureTheme::Dark => RGBColor(0x16, 0x19, 0x1e),
        }
    }

    fn rasters(&self) -> &[Raster] {
        &self.rasters
    }

    fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
        let [ink, weak] = self.ink();
        for (i, title) in self.columns.iter().enumerate() {
            let x = MARGIN + LEFT + i as f64 * (WIDE + GAP) + WIDE / 2.0;
            let style = paper.letters(LETTERS[0], ink).pos(Pos::new(HPos::Center, VPos::Bottom));
            paper.text([x, MARGIN + TOP - 3.0], &style, title)?;
        }
        for (i, lines) in self.rows.iter().enumerate() {
            let y = MARGIN + TOP + i as f64 * (self.high + GAP) + self.high / 2.0;
            for (line, x, color, letters) in
                [(&lines[0], MARGIN + 5.0, weak, LETTERS[1]), (&lines[1], MARGIN + 17.0, ink, LETTERS[0])]
            {
                let style = paper
                    .font(letters)
                    .transform(FontTransform::Rotate270)
                    .color(&color)
                    .pos(Pos::new(HPos::Center, VPos::Center));
                paper.text([x, y], &style, line)?;
            }
        }
        for laid in &self.cells {
            self.cell(paper, laid)?;
        }
        for bar in &self.bars {
            self.bar(paper, bar)?;
        }
        let below = f64::from(self.size[1]) - MARGIN;
        let style = paper.letters(LETTERS[1], weak).pos(Pos::new(HPos::Left, VPos::Bottom));
        paper.text([MARGIN + LEFT, below], &style, &self.note)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn captions_keep_the_end_of_long_names() {
        assert_eq!(caption("test_only/Pattern_05_data_7", "right"), ["test_only", "Pattern_05_data_7, right"]);
        let long = caption(&"x".repeat(80), "left");
        assert!(long[1].chars().count() == MOST_LETTERS && long[1].starts_with('…') && long[1].ends_with("x, left"));
        assert_eq!([number(18.0), number(0.0), number(-0.5), number(-0.001)], ["18", "0", "-0.5", "0"]);
    }

    #[test]
    fn scale_bars_are_round_and_take_less_than_a_third() {
        for px_per_mm in [0.5, 2.36, 9.7, 300.0] {
            let (length, text) = scale_bar(px_per_mm).unwrap();
            assert!(length <= WIDE / 3.0 && length > WIDE / 10.0, "{px_per_mm}: {text}");
        }
        assert_eq!(scale_bar(2.36).unwrap().1, "20 mm");
        assert!(scale_bar(f64::NAN).is_none() && scale_bar(0.0).is_none() && scale_bar(1e9).is_none());
    }
}
