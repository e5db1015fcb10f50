//! One drawing, two files: SVG text and PNG pixels.

use std::path::Path;

use anyhow::Context as _;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;

use crate::domain::grid::RgbGrid;
use crate::fonts;
use crate::io::{atomic, images};

/// Family of the letters; a viewer of the SVG takes its own.
const FAMILY: &str = "sans-serif";
/// Pixels of the drawing per pixel of the PNG along one side: their mean smooths edges, which the backend does not.
const FINE: usize = 2;

/// What can be drawn, with the error of the backend that it is drawn on.
pub(super) type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Something to be drawn.
pub(super) trait Drawing {
    /// Width and height in units of SVG pixels.
    const SIZE: [u32; 2];

    /// Draws on a white area of `paper.scale` pixels to a unit.
    fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B>;
}

/// An area with its scale.
pub(super) struct Paper<'a, B: DrawingBackend> {
    pub(super) area: &'a DrawingArea<B, Shift>,
    scale: f64,
}

impl<B: DrawingBackend> Paper<'_, B> {
    /// Units in pixels.
    pub(super) fn px(&self, units: f64) -> i32 {
        (units * self.scale).round() as i32
    }

    /// The same for a width, of which something stays.
    pub(super) fn wide(&self, units: f64) -> u32 {
        self.px(units).max(1).unsigned_abs()
    }

    /// A line or an outline of a width in units.
    pub(super) fn stroke(&self, color: RGBColor, units: f64) -> ShapeStyle {
        color.stroke_width(self.wide(units))
    }

    /// Letters of a height in units.
    pub(super) fn letters(&self, units: f64, color: RGBColor) -> TextStyle<'static> {
        (FAMILY, units * self.scale).into_font().color(&color)
    }

    /// A line between places in units.
    pub(super) fn line(&self, places: &[[f64; 2]], color: RGBColor, units: f64) -> Drawn<B> {
        let places: Vec<(i32, i32)> = places.iter().map(|[x, y]| (self.px(*x), self.px(*y))).collect();
        self.area.draw(&PathElement::new(places, self.stroke(color, units)))
    }

    /// A text at a place in units.
    pub(super) fn text(&self, [x, y]: [f64; 2], style: &TextStyle<'_>, text: &str) -> Drawn<B> {
        self.area.draw_text(text, style, (self.px(x), self.px(y)))
    }
}

fn draw<B: DrawingBackend, D: Drawing>(backend: B, scale: f64, drawing: &D) -> anyhow::Result<()>
where
    B::ErrorType: 'static,
{
    register_font(FAMILY, FontStyle::Normal, fonts::REGULAR).ok().context("the built-in font cannot be read")?;
    let area = backend.into_drawing_area();
    area.fill(&WHITE)?;
    drawing.draw(&Paper { area: &area, scale })?;
    Ok(area.present()?)
}

pub(super) fn svg<D: Drawing>(drawing: &D) -> anyhow::Result<String> {
    let mut out = String::new();
    draw(SVGBackend::with_string(&mut out, D::SIZE.into()), 1.0, drawing)?;
    Ok(out)
}

/// The drawing with `scale` pixels to a unit; values 0..255.
pub(super) fn pixels<D: Drawing>(drawing: &D, scale: f64) -> anyhow::Result<RgbGrid> {
    let [w, h] = D::SIZE.map(|n| (f64::from(n) * scale).round() as usize);
    let fine = [w * FINE, h * FINE];
    let mut bytes = vec![0; fine[0] * fine[1] * 3];
    draw(BitMapBackend::with_buffer(&mut bytes, fine.map(|n| n as u32).into()), scale * FINE as f64, drawing)?;
    Ok(RgbGrid::from_fn(w, h, |x, y| {
        std::array::from_fn(|c| {
            let at = |i: usize| bytes[((y * FINE + i / FINE) * fine[0] + x * FINE + i % FINE) * 3 + c];
            (0..FINE * FINE).map(|i| f32::from(at(i))).sum::<f32>() / (FINE * FINE) as f32
        })
    }))
}

/// Writes `file` (an SVG) and the PNG beside it.
pub(super) fn write<D: Drawing>(drawing: &D, file: &Path) -> anyhow::Result<()> {
    atomic::write_bytes(file, svg(drawing)?.as_bytes()).with_context(|| format!("cannot write {}", file.display()))?;
    images::write_rgb8(&file.with_extension("png"), &pixels(drawing, 1.5)?)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sketch;

    impl Drawing for Sketch {
        const SIZE: [u32; 2] = [60, 40];

        fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
            paper.line(&[[0.0, 20.0], [60.0, 20.0]], RED, 4.0)?;
            paper.area.draw(&Circle::new((paper.px(30.0), paper.px(8.0)), paper.wide(5.0), BLUE.filled()))?;
            paper.text([5.0, 26.0], &paper.letters(11.0, BLACK), "a<b")
        }
    }

    #[test]
    fn both_files_show_the_same_shapes() {
        let text = svg(&Sketch).unwrap();
        assert!(text.contains("stroke=\"#FF0000\"") && text.contains("a&lt;b") && text.ends_with("</svg>\n"));
        let image = pixels(&Sketch, 2.0).unwrap();
        assert_eq!(image.size(), [120, 80]);
        assert_eq!(image[(50, 40)], [255.0, 0.0, 0.0]);
        assert_eq!(image[(60, 16)], [0.0, 0.0, 255.0]);
        assert_eq!(image[(110, 70)], [255.0; 3]);
        let ink = (0..60).flat_map(|x| (50..80).map(move |y| (x, y))).filter(|&p| image[p][0] < 128.0).count();
        assert!(ink > 40, "the text has ink: {ink}");
    }
}
