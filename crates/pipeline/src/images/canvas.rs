//! One drawing, two files: SVG text and PNG pixels. Lines and letters are drawn, pictures are laid below them.

use std::path::Path;
use std::sync::Once;

use anyhow::Context as _;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;

use crate::images::fonts;
use crate::io::{atomic, images};
use touch2touch_core::grid::{Grid, RgbGrid};

/// Family of the letters; a viewer of the SVG takes its own.
const FAMILY: &str = "sans-serif";
/// Pixels of the drawing per pixel of the PNG along one side: their mean smooths edges, which the backend does not.
pub(crate) const FINE: usize = 2;

/// Result of drawing, with the error of the backend that it is drawn on.
pub type Drawn<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Something to be drawn.
pub trait Drawing {
    /// Width and height in units of SVG pixels.
    fn size(&self) -> [u32; 2];

    /// The color of the ground.
    fn ground(&self) -> RGBColor {
        WHITE
    }

    /// The pictures below everything that is drawn.
    fn rasters(&self) -> &[Raster] {
        &[]
    }

    /// Draws on an area of `paper.scale` pixels to a unit.
    fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B>;
}

/// A picture in a drawing; its pixels stay squares, whatever the scale.
#[derive(Clone, Debug)]
pub struct Raster {
    /// Left, top, width and height, units.
    pub place: [f64; 4],
    /// Pixels, sRGB.
    pub pixels: Grid<[u8; 3]>,
}

/// An area with its scale.
pub struct Paper<'a, B: DrawingBackend> {
    /// The area.
    pub area: &'a DrawingArea<B, Shift>,
    scale: f64,
    family: &'static str,
}

impl<B: DrawingBackend> Paper<'_, B> {
    /// Pixels to a unit.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Units in pixels.
    pub fn px(&self, units: f64) -> i32 {
        (units * self.scale).round() as i32
    }

    /// Pixels of a width in units, at least one, so that something of it stays.
    pub fn wide(&self, units: f64) -> u32 {
        self.px(units).max(1).unsigned_abs()
    }

    /// A line or an outline of a width in units.
    pub fn stroke(&self, color: RGBColor, units: f64) -> ShapeStyle {
        color.stroke_width(self.wide(units))
    }

    /// The font with letters of a height in units.
    pub(crate) fn font(&self, units: f64) -> FontDesc<'static> {
        (self.family, units * self.scale).into_font()
    }

    /// Letters of a height in units.
    pub fn letters(&self, units: f64, color: RGBColor) -> TextStyle<'static> {
        self.font(units).color(&color)
    }

    /// A line between places in units.
    pub fn line(&self, places: &[[f64; 2]], color: RGBColor, units: f64) -> Drawn<B> {
        let places: Vec<(i32, i32)> = places.iter().map(|[x, y]| (self.px(*x), self.px(*y))).collect();
        self.area.draw(&PathElement::new(places, self.stroke(color, units)))
    }

    /// A text at a place in units.
    pub fn text(&self, [x, y]: [f64; 2], style: &TextStyle<'_>, text: &str) -> Drawn<B> {
        self.area.draw_text(text, style, (self.px(x), self.px(y)))
    }
}

fn draw<B: DrawingBackend, D: Drawing>(backend: B, scale: f64, family: &'static str, drawing: &D) -> anyhow::Result<()>
where
    B::ErrorType: 'static,
{
    register_font(FAMILY, FontStyle::Normal, fonts::REGULAR).ok().context("the built-in font cannot be read")?;
    let area = backend.into_drawing_area();
    drawing.draw(&Paper { area: &area, scale, family })?;
    Ok(area.present()?)
}

/// The drawing as SVG text, without the pictures and the ground.
fn lines_and_letters<D: Drawing>(drawing: &D) -> anyhow::Result<String> {
    let mut out = String::new();
    let [width, height] = drawing.size();
    draw(SVGBackend::with_string(&mut out, (width, height)), 1.0, FAMILY, drawing)?;
    Ok(out)
}

/// The family that has the letters of a drawing: where some are East Asian, a font of this computer.
fn family<D: Drawing>(drawing: &D) -> anyhow::Result<&'static str> {
    static SAID: Once = Once::new();
    let letters = fonts::east_asian(&lines_and_letters(drawing)?);
    if letters.is_empty() {
        return Ok(FAMILY);
    }
    let Some(font) = fonts::covering(&letters) else {
        let lacking =
            "Chinese, Japanese or Korean letters are boxes in the PNG, because no font of this computer has them";
        SAID.call_once(|| log::warn!("{lacking}. {}", fonts::ADVICE));
        return Ok(FAMILY);
    };
    register_font(font.name, FontStyle::Normal, font.bytes).ok().context("a font of this computer cannot be read")?;
    Ok(font.name)
}

/// The drawing as SVG text; pictures lie in it as PNG files.
pub fn svg<D: Drawing>(drawing: &D) -> anyhow::Result<String> {
    let [width, height] = drawing.size();
    let mut out = lines_and_letters(drawing)?;
    // XML has no place for control letters, which a name may hold.
    out.retain(|letter| !letter.is_control() || letter == '\n');
    // Behind the opening tag, and so below everything else.
    let at = out.find("<svg").and_then(|from| Some(from + out[from..].find('>')? + 1)).context("no SVG was drawn")?;
    let RGBColor(r, g, b) = drawing.ground();
    let mut below = format!("\n<rect width=\"{width}\" height=\"{height}\" fill=\"#{r:02X}{g:02X}{b:02X}\"/>");
    for Raster { place: [x, y, w, h], pixels } in drawing.rasters() {
        let png =
            base64(&images::png_bytes(pixels).map_err(|err| anyhow::anyhow!("a picture cannot be drawn: {err}"))?);
        below += &format!(
            "\n<image x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" preserveAspectRatio=\"none\" \
             image-rendering=\"pixelated\" href=\"data:image/png;base64,{png}\"/>"
        );
    }
    out.insert_str(at, &below);
    Ok(out)
}

/// The drawing with `scale` pixels to a unit; values 0..255.
pub fn pixels<D: Drawing>(drawing: &D, scale: f64) -> anyhow::Result<RgbGrid> {
    let [w, h] = drawing.size().map(|n| (f64::from(n) * scale).round() as usize);
    let fine = [w * FINE, h * FINE];
    let RGBColor(r, g, b) = drawing.ground();
    let mut bytes = [r, g, b].repeat(fine[0] * fine[1]);
    let scale = scale * FINE as f64;
    for raster in drawing.rasters() {
        lay(raster, scale, &mut bytes, fine);
    }
    draw(BitMapBackend::with_buffer(&mut bytes, (fine[0] as u32, fine[1] as u32)), scale, family(drawing)?, drawing)?;
    Ok(RgbGrid::from_fn(w, h, |x, y| {
        std::array::from_fn(|c| {
            let at = |i: usize| bytes[((y * FINE + i / FINE) * fine[0] + x * FINE + i % FINE) * 3 + c];
            (0..FINE * FINE).map(|i| f32::from(at(i))).sum::<f32>() / (FINE * FINE) as f32
        })
    }))
}

/// Writes a picture into the bytes of an image of `[width, height]`, `scale` pixels to a unit.
fn lay(raster: &Raster, scale: f64, bytes: &mut [u8], [width, height]: [usize; 2]) {
    let [left, top, w, h] = raster.place.map(|units| (units * scale).round().max(0.0) as usize);
    if raster.pixels.is_empty() || w == 0 || h == 0 {
        return;
    }
    for y in top..(top + h).min(height) {
        let row = raster.pixels.row((y - top) * raster.pixels.height() / h);
        for x in left..(left + w).min(width) {
            let at = (y * width + x) * 3;
            bytes[at..at + 3].copy_from_slice(&row[(x - left) * raster.pixels.width() / w]);
        }
    }
}

/// Bytes as text of 64 letters (RFC 4648), as pictures lie in an SVG.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let byte = |i: usize| u32::from(group.get(i).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = char::from(LETTERS[(bits >> (18 - 6 * i) & 63) as usize]);
            out.push(if i <= group.len() { letter } else { '=' });
        }
    }
    out
}

/// Writes `file` (an SVG) and the PNG beside it.
pub fn write<D: Drawing>(drawing: &D, file: &Path) -> anyhow::Result<()> {
    atomic::write_bytes(file, svg(drawing)?.as_bytes()).with_context(|| format!("cannot write {}", file.display()))?;
    images::write_rgb8(&file.with_extension("png"), &pixels(drawing, 1.5)?)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sketch;

    impl Drawing for Sketch {
        fn size(&self) -> [u32; 2] {
            [60, 40]
        }

        fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
            paper.line(&[[0.0, 20.0], [60.0, 20.0]], RED, 4.0)?;
            paper.area.draw(&Circle::new((paper.px(30.0), paper.px(8.0)), paper.wide(5.0), BLUE.filled()))?;
            paper.text([5.0, 26.0], &paper.letters(11.0, BLACK), "a<\u{b}b")
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

    struct Word(&'static str);

    impl Drawing for Word {
        fn size(&self) -> [u32; 2] {
            [40, 40]
        }

        fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
            paper.text([5.0, 5.0], &paper.letters(24.0, BLACK), self.0)
        }
    }

    #[test]
    fn east_asian_letters_are_drawn_where_this_computer_has_a_font() {
        for pair in [["\u{6f22}", "\u{4e00}"], ["\u{304b}", "\u{3044}"], ["\u{d55c}", "\u{c544}"]] {
            // Letters that no font has are the same box.
            let [a, b] = pair.map(|word| pixels(&Word(word), 1.0).unwrap());
            let letters: Vec<char> = pair.concat().chars().collect();
            assert_eq!(a != b, fonts::covering(&letters).is_some(), "{pair:?}");
            assert!(svg(&Word(pair[0])).unwrap().contains(pair[0]));
        }
        assert_ne!(pixels(&Word("a"), 1.0).unwrap(), pixels(&Word("b"), 1.0).unwrap());
    }

    struct Tiled(Vec<Raster>);

    impl Drawing for Tiled {
        fn size(&self) -> [u32; 2] {
            [8, 4]
        }

        fn ground(&self) -> RGBColor {
            BLACK
        }

        fn rasters(&self) -> &[Raster] {
            &self.0
        }

        fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
            paper.line(&[[7.0, 0.0], [7.0, 4.0]], RED, 1.0)
        }
    }

    #[test]
    fn pictures_lie_below_the_lines_pixel_by_pixel() {
        let tile = Grid::from_fn(2, 2, |x, y| [10 * x as u8, 100 * y as u8, 7]);
        let drawing = Tiled(vec![Raster { place: [2.0, 1.0, 2.0, 2.0], pixels: tile }]);
        for scale in [1.0, 3.0] {
            let image = pixels(&drawing, scale).unwrap();
            let at = |x: f64, y: f64| image[((x * scale) as usize, (y * scale) as usize)];
            assert_eq!(
                [at(2.1, 1.1), at(3.1, 1.1), at(2.1, 2.5), at(3.9, 2.9)].map(|p| [p[0], p[1]]),
                [[0.0, 0.0], [10.0, 0.0], [0.0, 100.0], [10.0, 100.0]]
            );
            assert_eq!(at(5.0, 2.0), [0.0; 3]);
        }
        let text = svg(&drawing).unwrap();
        let (image, line) = (text.find("data:image/png;base64,iVBOR").unwrap(), text.find("polyline").unwrap());
        assert!(image < line && text.contains("fill=\"#000000\""), "{text}");
    }

    #[test]
    fn letters_of_the_published_examples() {
        for (bytes, letters) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(bytes.as_bytes()), letters);
        }
    }
}
