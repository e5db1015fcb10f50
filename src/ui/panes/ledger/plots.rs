//! A stage's histogram, and the joint histogram of prediction and truth.

use eframe::egui::{Align2, Color32, ColorImage, FontId, Painter, Rect, Shape, Stroke, TextureId, Ui, pos2, vec2};

use crate::ui::parts::theme::Palette;
use touch2touch_core::colormap::ColorMap;
use touch2touch_core::grid::Grid;
use touch2touch_core::metrics::Joint;
use touch2touch_core::postprocess::Histogram;
use touch2touch_core::units::{fixed, mm};

/// Bars with the ends of their axis. Heights by the root of the counts: the untouched background is most of an imprint.
pub(super) fn histogram(painter: &Painter, area: Rect, of: &Histogram, scale: f64, color: Color32, p: &Palette) {
    let plot = Rect::from_min_max(area.min, area.max - vec2(0.0, 11.0));
    painter.hline(plot.x_range(), plot.bottom(), Stroke::new(1.0, p.line));
    let most = of.counts.iter().copied().max().unwrap_or(0).max(1) as f32;
    let width = plot.width() / of.counts.len().max(1) as f32;
    for (i, count) in of.counts.iter().enumerate().filter(|(_, c)| **c > 0) {
        let height = (*count as f32 / most).sqrt() * plot.height();
        let x = plot.left() + width * i as f32;
        let bar = Rect::from_min_max(pos2(x, plot.bottom() - height), pos2(x + (width - 0.5).max(0.5), plot.bottom()));
        painter.rect_filled(bar, 0.0, color);
    }
    if of.counts.is_empty() {
        return;
    }
    let font = FontId::proportional(9.0);
    let y = plot.bottom() + 1.0;
    painter.text(pos2(plot.left(), y), Align2::LEFT_TOP, fixed(of.lo * scale, 1), font.clone(), p.weak);
    painter.text(pos2(plot.right(), y), Align2::RIGHT_TOP, fixed(of.hi * scale, 1), font.clone(), p.weak);
    // Zero, where it is inside and does not run into the ends.
    let at = (-of.lo / (of.hi - of.lo)) as f32;
    if (0.0..=1.0).contains(&at) {
        let x = plot.left() + at * plot.width();
        painter.vline(x, plot.y_range(), Stroke::new(1.0, p.weak.gamma_multiply(0.6)));
        if (0.3..=0.7).contains(&at) {
            painter.text(pos2(x, y), Align2::CENTER_TOP, "0", font, p.weak);
        }
    }
}

/// Counts as colors, prediction upwards; where there is no pixel, the background.
pub(super) fn joint_image(counts: &Grid<u32>, background: Color32) -> ColorImage {
    let most = counts.as_slice().iter().copied().max().unwrap_or(0).max(1) as f32;
    let pixel = |count: &u32| {
        if *count == 0 {
            return background;
        }
        // A logarithm, so that the few deep pixels are seen beside the many shallow ones.
        let [r, g, b] = ColorMap::Viridis.rgb8(0.25 + 0.75 * (*count as f32).ln_1p() / most.ln_1p());
        Color32::from_rgb(r, g, b)
    };
    let upwards = counts.rows_reversed();
    ColorImage::new(upwards.size(), upwards.as_slice().iter().map(pixel).collect())
}

/// The joint histogram with the diagonal, the line, and axes in millimeters.
pub(super) fn joint(ui: &Ui, area: Rect, picture: TextureId, of: &Joint, p: &Palette) {
    let painter = ui.painter_at(area);
    let side = (area.height() - 26.0).min(area.width() - 40.0);
    let plot = Rect::from_min_size(area.min + vec2(34.0, 2.0), vec2(side, side));
    let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    painter.image(picture, plot, uv, Color32::WHITE);
    let at = |truth: f64, prediction: f64| {
        let unit = |v: f64| ((v - of.lo) / (of.hi - of.lo)) as f32;
        pos2(plot.left() + unit(truth) * plot.width(), plot.bottom() - unit(prediction) * plot.height())
    };
    let inside = painter.with_clip_rect(plot);
    let diagonal = [at(of.lo, of.lo), at(of.hi, of.hi)];
    inside.extend(Shape::dashed_line(&diagonal, Stroke::new(1.0, p.weak), 4.0, 4.0));
    if let Some(line) = of.line {
        let y = |t: f64| line.slope * t + line.offset;
        inside.line_segment([at(of.lo, y(of.lo)), at(of.hi, y(of.hi))], Stroke::new(2.0, p.prediction));
    }
    painter.rect_stroke(plot, 0.0, Stroke::new(1.0, p.line), eframe::egui::StrokeKind::Outside);
    let font = FontId::proportional(10.0);
    for v in ticks(mm(of.lo), mm(of.hi)) {
        let x = at(v * 1e-3, of.lo).x;
        painter.text(pos2(x, plot.bottom() + 1.0), Align2::CENTER_TOP, fixed(v, 0), font.clone(), p.weak);
        let y = at(of.lo, v * 1e-3).y;
        painter.text(pos2(plot.left() - 3.0, y), Align2::RIGHT_CENTER, fixed(v, 0), font.clone(), p.weak);
    }
    let below = pos2(plot.center().x, plot.bottom() + 12.0);
    painter.text(below, Align2::CENTER_TOP, "measured mm", font.clone(), p.truth);
    let galley = painter.layout_no_wrap("predicted mm".to_owned(), font, p.prediction);
    let corner = pos2(area.left() + 2.0, plot.center().y + galley.size().x / 2.0);
    let text =
        eframe::egui::epaint::TextShape::new(corner, galley, p.prediction).with_angle(-std::f32::consts::FRAC_PI_2);
    painter.add(text);
}

/// Round numbers inside a range, at most six.
fn ticks(lo: f64, hi: f64) -> Vec<f64> {
    let step = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0].into_iter().find(|s| (hi - lo) / s <= 6.0);
    let Some(step) = step else { return Vec::new() };
    let first = (lo / step).ceil() as i64;
    (first..=(hi / step).floor() as i64).map(|k| k as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(ticks(-6.3, 18.0), [-5.0, 0.0, 5.0, 10.0, 15.0]);
        assert_eq!(ticks(0.2, 0.8), [] as [f64; 0]);
        assert!(ticks(0.0, 1e9).is_empty());
    }

    #[test]
    fn the_picture_has_predictions_upwards_and_no_color_where_nothing_is() {
        let counts = Grid::from_vec(2, 2, vec![5, 0, 0, 0]).unwrap();
        let image = joint_image(&counts, Color32::BLACK);
        assert_ne!(image.pixels[2], Color32::BLACK, "small truth, small prediction: bottom left");
        assert_eq!(image.pixels.iter().filter(|c| **c == Color32::BLACK).count(), 3);
    }
}
