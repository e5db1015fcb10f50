//! Influence of the pixels on the registered angle, over an imprint.

use eframe::egui::{Align2, Color32, ColorImage, FontId, Rect, Ui, pos2, vec2};

use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::state::{Lookup, State};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::widget::colorbar::gradient;
use crate::ui::parts::widget::image_canvas::CanvasOutput;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::grid::Grid;
use touch2touch_core::rig::PadId;
use touch2touch_core::units;
use touch2touch_work::influence::Influence;

/// The colors end here, degrees to the square millimeter: the same in every pair, so that they can be compared.
const END_DEG_PER_MM2: f32 = 0.02;

/// Opacity of the colors, of 255: enough of the imprint comes through to know the place.
const OPACITY: u8 = 225;

/// Blue where the angle would fall, red where it would grow, white where nothing hangs on a pixel.
fn picture(influence: &Influence, values: &Grid<f32>) -> ColorImage {
    let range = Range::symmetric(END_DEG_PER_MM2);
    let pixel = |value: &f32| {
        if value.is_nan() {
            return Color32::TRANSPARENT;
        }
        let [r, g, b] = ColorMap::Diverging.rgb8(range.unit(influence.deg_per_mm2(*value) as f32));
        Color32::from_rgba_unmultiplied(r, g, b, OPACITY)
    };
    ColorImage::new(values.size(), values.as_slice().iter().map(pixel).collect())
}

/// The colors over one finger's imprint, with their bar where the finger is the active one; else why there are none.
pub(super) fn overlay(cx: &mut Cx<'_>, ui: &Ui, output: &CanvasOutput, source: ImprintSource, finger: PadId) {
    if !results::shows_influence(cx.state, source) {
        return;
    }
    let active = finger == cx.state.selection.finger;
    let why = match results::influence(cx.state, source) {
        Lookup::Failed(err) => {
            let hint = err.hint.as_ref().map_or(String::new(), |hint| format!(". {hint}"));
            Some(format!("{}{hint}", err.why))
        }
        Lookup::Absent(absent) => Some(absent.text().to_owned()),
        Lookup::Ready(_) | Lookup::Stale(_) | Lookup::Waiting => None,
    };
    if let Some(why) = why {
        if active {
            said(cx, output, &why);
        }
        return;
    }
    let Some((key, influence)) = results::shown_influence(cx.state, source) else { return };
    let Some(values) = &influence.pixels[finger] else { return };
    let slot = ("influence", source, finger);
    let drawn = cx.shared.textures.get(ui.ctx(), slot, &key, true, || (picture(influence, values), None));
    output.paint(drawn.texture.id(), Color32::WHITE);
    if active {
        bar(output);
    }
}

/// A text at the bottom of the picture, in as many lines as it takes.
fn said(cx: &Cx<'_>, output: &CanvasOutput, text: &str) {
    let area = output.painter.clip_rect().shrink(10.0);
    let text = format!("No influence: {text}");
    let galley = output.painter.layout(text, FontId::proportional(11.0), cx.p.caution, area.width());
    let place = Align2::LEFT_BOTTOM.align_size_within_rect(galley.size(), area.translate(vec2(0.0, -18.0)));
    output.painter.rect_filled(place.expand2(vec2(4.0, 2.0)), 3.0, Color32::from_black_alpha(200));
    output.painter.galley(place.min, galley, cx.p.caution);
}

/// Bar of the colors, with the change of the angle that each means.
fn bar(output: &CanvasOutput) {
    const WIDTH: f32 = 150.0;
    let area = output.painter.clip_rect().shrink(8.0);
    let frame = Rect::from_min_max(pos2(area.right() - WIDTH - 12.0, area.bottom() - 60.0), area.max - vec2(0.0, 20.0));
    output.painter.rect_filled(frame, 3.0, Color32::from_black_alpha(190));
    let color = Color32::from_gray(225);
    let font = FontId::proportional(10.0);
    let text = "turn of the tool if a pixel changed";
    output.painter.text(frame.center_top() + vec2(0.0, 2.0), Align2::CENTER_TOP, text, font.clone(), color);
    let bar = Rect::from_min_size(frame.min + vec2(6.0, 15.0), vec2(WIDTH, 8.0));
    gradient(&output.painter, bar, 32, |share| {
        let [r, g, b] = ColorMap::Diverging.rgb8(share);
        Color32::from_rgb(r, g, b)
    });
    let end = END_DEG_PER_MM2;
    let texts = [
        (0.0, Align2::LEFT_TOP, format!("-{end}")),
        (0.5, Align2::CENTER_TOP, "0".to_owned()),
        (1.0, Align2::RIGHT_TOP, format!("+{end} °/mm²")),
    ];
    for (share, anchor, text) in texts {
        let below = pos2(bar.left() + share * bar.width(), bar.bottom() + 1.0);
        output.painter.text(below, anchor, text, font.clone(), color);
    }
}

/// Influence of a pixel, for the status bar; empty where nothing is shown.
pub(super) fn readout(state: &State, source: ImprintSource, finger: PadId, [x, y]: [usize; 2]) -> String {
    let influence = results::shown_influence(state, source).filter(|_| results::shows_influence(state, source));
    let value = influence.and_then(|(key, influence)| {
        let contact = state.results.clouds.get(&key.0.cloud)?.finger(finger).and_then(|cloud| {
            let index = cloud.at_pixel(x, y)?;
            cloud.contact.get(index).copied()
        })?;
        let value = influence.pixels[finger].as_ref()?.get(x, y).copied().filter(|v| v.is_finite())?;
        Some((influence.deg_per_mm2(value), contact))
    });
    value.map_or(String::new(), |(value, contact)| {
        let sign = if value > 0.0 { "+" } else { "" };
        let way = if contact { "without" } else { "with" };
        format!("   angle {sign}{} °/mm² {way} it", units::fixed(value, 4))
    })
}
