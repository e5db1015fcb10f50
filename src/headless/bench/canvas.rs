//! One drawing, two files: SVG text and PNG pixels.

use super::strokes::{ADVANCE, CAPITAL, strokes};
use crate::domain::grid::RgbGrid;

/// 8-bit colour.
pub(super) type Colour = [u8; 3];

/// Where a text stands relative to its point; the point is on the baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// What can be drawn, in units of SVG pixels, y down.
#[derive(Clone, Debug)]
enum Shape {
    Line { from: [f32; 2], to: [f32; 2], width: f32, colour: Colour },
    Disc { centre: [f32; 2], radius: f32, colour: Colour },
    Text { at: [f32; 2], size: f32, anchor: Anchor, colour: Colour, text: String },
}

/// A picture as a list of shapes on white.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    pub(super) width: u32,
    pub(super) height: u32,
    shapes: Vec<Shape>,
}

/// Width of `text` at a letter height of `size` in the PNG; letters in the SVG are narrower.
pub(super) fn text_width(text: &str, size: f32) -> f32 {
    text.chars().count() as f32 * ADVANCE / CAPITAL * size
}

impl Canvas {
    pub(super) fn new(width: u32, height: u32) -> Self {
        Self { width, height, shapes: Vec::new() }
    }

    pub(super) fn line(&mut self, from: [f32; 2], to: [f32; 2], width: f32, colour: Colour) {
        self.shapes.push(Shape::Line { from, to, width, colour });
    }

    pub(super) fn disc(&mut self, centre: [f32; 2], radius: f32, colour: Colour) {
        self.shapes.push(Shape::Disc { centre, radius, colour });
    }

    /// `size` is the height of a capital letter.
    pub(super) fn text(&mut self, at: [f32; 2], size: f32, anchor: Anchor, colour: Colour, text: impl Into<String>) {
        self.shapes.push(Shape::Text { at, size, anchor, colour, text: text.into() });
    }

    pub(super) fn svg(&self) -> String {
        let (w, h) = (self.width, self.height);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\">\n\
             <rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>\n"
        );
        let hex = |[r, g, b]: Colour| format!("#{r:02x}{g:02x}{b:02x}");
        for shape in &self.shapes {
            out += &match shape {
                Shape::Line { from, to, width, colour } => format!(
                    "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{}\" stroke-width=\"{width}\"/>\n",
                    from[0],
                    from[1],
                    to[0],
                    to[1],
                    hex(*colour),
                ),
                Shape::Disc { centre, radius, colour } => format!(
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"{}\"/>\n",
                    centre[0],
                    centre[1],
                    hex(*colour)
                ),
                Shape::Text { at, size, anchor, colour, text } => format!(
                    "<text x=\"{:.1}\" y=\"{:.1}\" font-family=\"sans-serif\" font-size=\"{:.1}\" text-anchor=\"{}\" \
                     fill=\"{}\">{}</text>\n",
                    at[0],
                    at[1],
                    size / 0.72,
                    match anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    },
                    hex(*colour),
                    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
                ),
            };
        }
        out + "</svg>\n"
    }

    /// The picture in pixels, `scale` of them to a unit; values 0..255.
    pub(super) fn pixels(&self, scale: f32) -> RgbGrid {
        let size = |n: u32| (n as f32 * scale).round() as usize;
        let mut raster = Raster { scale, image: RgbGrid::filled(size(self.width), size(self.height), [255.0; 3]) };
        for shape in &self.shapes {
            match shape {
                Shape::Line { from, to, width, colour } => raster.stroke(*from, *to, *width, *colour),
                Shape::Disc { centre, radius, colour } => raster.stroke(*centre, *centre, 2.0 * radius, *colour),
                Shape::Text { at, size, anchor, colour, text } => raster.text(*at, *size, *anchor, *colour, text),
            }
        }
        raster.image
    }
}

struct Raster {
    scale: f32,
    image: RgbGrid,
}

impl Raster {
    /// A line with round ends, its edge smoothed over a pixel.
    fn stroke(&mut self, from: [f32; 2], to: [f32; 2], width: f32, colour: Colour) {
        let (a, b) = (from.map(|v| v * self.scale), to.map(|v| v * self.scale));
        let radius = 0.5 * width * self.scale;
        let bound = |k: usize, limit: usize| {
            let low = (a[k].min(b[k]) - radius - 1.0).max(0.0) as usize;
            let high = (a[k].max(b[k]) + radius + 2.0).clamp(0.0, limit as f32) as usize;
            low..high
        };
        let along = [b[0] - a[0], b[1] - a[1]];
        let squared = (along[0] * along[0] + along[1] * along[1]).max(1e-9);
        for y in bound(1, self.image.height()) {
            for x in bound(0, self.image.width()) {
                let p = [x as f32 + 0.5 - a[0], y as f32 + 0.5 - a[1]];
                let t = ((p[0] * along[0] + p[1] * along[1]) / squared).clamp(0.0, 1.0);
                let distance = (p[0] - t * along[0]).hypot(p[1] - t * along[1]);
                let cover = (radius + 0.5 - distance).clamp(0.0, 1.0);
                let pixel = &mut self.image[(x, y)];
                for (value, target) in pixel.iter_mut().zip(colour) {
                    *value += (f32::from(target) - *value) * cover;
                }
            }
        }
    }

    fn text(&mut self, at: [f32; 2], size: f32, anchor: Anchor, colour: Colour, text: &str) {
        let unit = size / CAPITAL;
        let width = text_width(text, size) - (ADVANCE - 4.0) * unit;
        let mut x = match anchor {
            Anchor::Start => at[0],
            Anchor::Middle => at[0] - 0.5 * width,
            Anchor::End => at[0] - width,
        };
        for c in text.chars() {
            for stroke in strokes(c) {
                let place = |p: [f32; 2]| [x + p[0] * unit, at[1] + (p[1] - CAPITAL) * unit];
                for i in 0..stroke.len().saturating_sub(1) {
                    self.stroke(place(stroke[i]), place(stroke[i + 1]), 0.14 * size, colour);
                }
            }
            x += ADVANCE * unit;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_files_show_the_same_shapes() {
        let mut canvas = Canvas::new(60, 40);
        canvas.line([0.0, 20.0], [60.0, 20.0], 4.0, [255, 0, 0]);
        canvas.disc([30.0, 8.0], 5.0, [0, 0, 255]);
        canvas.text([5.0, 38.0], 8.0, Anchor::Start, [0, 0, 0], "a<b");
        let svg = canvas.svg();
        assert!(svg.contains("stroke=\"#ff0000\"") && svg.contains("a&lt;b") && svg.ends_with("</svg>\n"));
        let image = canvas.pixels(2.0);
        assert_eq!(image.size(), [120, 80]);
        assert_eq!(image[(50, 40)], [255.0, 0.0, 0.0]);
        assert_eq!(image[(60, 16)], [0.0, 0.0, 255.0]);
        assert_eq!(image[(110, 70)], [255.0; 3]);
        let ink = (0..60).flat_map(|x| (60..80).map(move |y| (x, y))).filter(|&p| image[p][0] < 128.0).count();
        assert!(ink > 40, "the text has ink: {ink}");
    }
}
