//! The generator in the pane Adapt: the pairs that it is fitted to, and what the fit is worth.

use std::hash::Hash;

use eframe::egui::{
    self, Align2, Color32, FontId, Painter, Pos2, Rect, Response, RichText, Role, Sense, Ui, WidgetInfo, pos2, vec2,
};
use strum::IntoEnumIterator as _;

use super::super::images::{map_of, range_of};
use crate::app::action::Action;
use crate::app::command::LearnCommand;
use crate::app::learn::{self, AdaptPairs, Network, TUNING_STEPS};
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, section};
use crate::ui::parts::widget::choice::choose;
use crate::ui::parts::widget::empty;
use crate::ui::parts::widget::texture::depth_image;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::units::{self, fixed, mm};
use touch2touch_pipeline::learn::adapt::{Adapted, ENOUGH_PAIRS, Remark, Scored};

/// Between pictures, points.
const GAP: f32 = 6.0;
/// Height of a caption over a picture, points.
const CAPTION: f32 = 16.0;

/// Scores of the last fit, and a touch before and after.
pub(super) fn worth(cx: &mut Cx<'_>, ui: &mut Ui) {
    let Some(adapted) = cx.state.learn.adapted.clone() else { return };
    refusal(cx, ui, &adapted);
    before_and_after(cx, ui);
    scores(cx, ui, &adapted);
    pads(cx, ui, &adapted);
    remarks(cx, ui, &adapted);
}

/// The invitation to a first fit.
pub(super) fn nothing_yet(cx: &mut Cx<'_>, ui: &mut Ui, begun: bool) {
    let fitting = cx.state.tasks.of_kind(TaskKind::Learn).is_some() && cx.state.learn.started == Network::Generator;
    let (what, why) = match fitting {
        true => ("Scores appear when the fit is done", ""),
        false => (
            "Shipped model in use, trained on simulated touches",
            "A few pairs of your own sensors are enough to fit the model to their alignment, scale and pattern. It takes \
             seconds, and the score is on pairs that were left out",
        ),
    };
    let action = Action::FitPairs.command(cx.state).filter(|_| !begun);
    let action = action.map(|_| ("Fit to my pairs", Action::FitPairs.tooltip()));
    if empty::show(ui, what, why, action) {
        cx.act(Action::FitPairs);
    }
}

/// Objections to the fit, and a way to keep it all the same.
fn refusal(cx: &mut Cx<'_>, ui: &mut Ui, adapted: &Adapted) {
    let refused = adapted.unwritten.is_some();
    if !refused && adapted.objections.is_empty() {
        return;
    }
    let heading = if refused { "The fit was not kept" } else { "Kept despite these objections" };
    ui.label(RichText::new(heading).strong().color(cx.p.wrong));
    for reason in adapted.objections.iter().chain(&adapted.in_place_of) {
        ui.add(egui::Label::new(RichText::new(reason).color(cx.p.wrong)).wrap());
    }
    if refused && cx.state.tasks.of_kind(TaskKind::Learn).is_none() {
        let tip = "Saves the fitted model anyway, over any earlier fit in its folder";
        if ui.button("Keep it anyway").on_hover_text(tip).clicked() {
            cx.push(LearnCommand::Keep);
        }
    }
    ui.add_space(8.0);
}

/// A touch that was left out: the measurement, and what the model draws before and after.
fn before_and_after(cx: &mut Cx<'_>, ui: &mut Ui) {
    let state = cx.state;
    let Some(held) = learn::held_back(state) else { return };
    ui.label(section("A touch left out of the fit", cx.p));
    // A fit that was made again has other pictures.
    let fit = state.learn.adapted.as_ref().map(|adapted| adapted.seconds.to_bits());
    let (map, range) = (map_of(state), range_of(state));
    let scale = held.measured.height() as f32 / held.measured.width().max(1) as f32;
    let width = ((ui.available_width() - 2.0 * GAP) / 3.0).clamp(40.0, 260.0);
    let (area, _) = ui.allocate_exact_size(vec2(3.0 * width + 2.0 * GAP, CAPTION + width * scale), Sense::hover());
    let all = [("Measured", &held.measured), ("Before", &held.before), ("Fitted", &held.after)];
    for (i, (name, picture)) in all.into_iter().enumerate() {
        let corner = area.min + vec2(i as f32 * (width + GAP), 0.0);
        ui.painter().text(corner, Align2::LEFT_TOP, name, FontId::proportional(SMALL), cx.p.weak);
        let rect = Rect::from_min_size(corner + vec2(0.0, CAPTION), vec2(width, width * scale));
        let response = ui.interact(rect, ui.scope_id().with(("held back", i)), Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
        let recipe = (held.pair, held.pad, fit);
        picture_of_depth(cx, ui.painter(), rect, ("held back", i), recipe, (picture, map, range));
        readout(cx, &response, name, picture);
    }
    let pad = state.rig().pad_key(held.pad).into_owned();
    let text = format!("{} {pad}; choose another pair in the list to see it", held.name);
    ui.label(caption(text, cx.p));
}

/// Choice of the pairs and of the tuning.
pub(super) fn choices(cx: &mut Cx<'_>, ui: &mut Ui) {
    let before = cx.state.learn.form;
    let mut form = before;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        ui.label(caption("Fit to", cx.p));
        let combo = egui::ComboBox::from_id_salt("fitted pairs").width(130.0).selected_text(before.pairs.label());
        let (name, said) = (("Pairs to fit to", "Which pairs the model is fitted to"), |p: &AdaptPairs| (p.label(), ""));
        form.pairs = choose(ui, combo, name, Some(&form.pairs), AdaptPairs::iter(), said).unwrap_or(form.pairs);
        let count = learn::pairs(cx.state).count();
        let text = RichText::new(format!("{count} pairs")).size(SMALL);
        let text = if count < ENOUGH_PAIRS { text.color(cx.p.caution) } else { text.color(cx.p.weak) };
        ui.label(text).on_hover_text(format!(
            "A fit needs {ENOUGH_PAIRS} pairs or more to be reliable; about 0.1 s a pair, the first time"
        ));
        let tip = "Also tunes the networks, in four runs so that the score is on pairs left out; a cancelled run can be \
                   continued";
        ui.checkbox(&mut form.tune, "tune the networks").on_hover_text(tip);
        if form.tune {
            let drag = egui::DragValue::new(&mut form.tuning_steps).speed(1.0).range(TUNING_STEPS).suffix(" steps");
            let drag = ui.add(drag).accessible_name("Tuning steps");
            drag.on_hover_text("50 steps take about a minute on two free cores, in each of the four runs");
        }
    });
    if form != before {
        cx.push(LearnCommand::SetForm(form));
    }
}

/// A column of figures: heading, tooltip, value.
type FitColumn = (&'static str, &'static str, fn(&Scored) -> Option<String>);

const FIGURES: [FitColumn; 3] = [
    ("PSNR dB", "Peak 22.5 mm; image pairs, which carry no scale, are both stretched to 0–1", |s| {
        Some(format!("{:.1} ± {:.1}", s.psnr_db?, s.psnr_spread_db?))
    }),
    ("SSIM", "Structural similarity, on the same images as PSNR", |s| Some(format!("{:.2}", s.ssim?))),
    ("angle °", "Mean error of the in-hand angle; for image pairs against the angle from the measured imprint", |s| {
        Some(format!("{:.1}", s.angle.as_ref()?.mean_deg?))
    }),
];

/// The gain of a fit in one number, on pairs that were left out.
pub(super) fn gain(adapted: &Adapted) -> Option<String> {
    let fitted = adapted.after.as_ref().or(adapted.closed_form.as_ref())?;
    Some(format!("{:.1} dB, before {:.1} dB", fitted.psnr_db?, adapted.before.psnr_db?))
}

/// Before and after, on pairs that were left out.
fn scores(cx: &Cx<'_>, ui: &mut Ui, adapted: &Adapted) {
    ui.label(section("Scores on pairs left out", cx.p));
    let rows = [
        ("Before", Some(&adapted.before)),
        ("Fitted", adapted.closed_form.as_ref()),
        ("Tuned", adapted.after.as_ref()),
    ];
    egui::Grid::new("fit scores").num_columns(FIGURES.len() + 1).spacing(vec2(18.0, 4.0)).show(ui, |ui| {
        ui.label("");
        for (heading, tip, _) in FIGURES {
            ui.label(caption(heading, cx.p)).on_hover_text(tip);
        }
        ui.end_row();
        for (name, scored) in rows {
            let Some(scored) = scored else { continue };
            ui.label(name);
            for (_, tip, value) in FIGURES {
                ui.label(value(scored).unwrap_or_else(|| "-".into())).on_hover_text(tip);
            }
            ui.end_row();
        }
    });
    let text = format!(
        "{} pairs, {} touches; {:.1} s, of which the fit {:.2} s",
        adapted.pairs, adapted.touches, adapted.seconds, adapted.fit_seconds
    );
    ui.label(caption(text, cx.p));
    for warning in &adapted.warnings {
        ui.add(egui::Label::new(RichText::new(warning).size(SMALL).color(cx.p.caution)).wrap());
    }
}

/// Correction of each pad.
fn pads(cx: &Cx<'_>, ui: &mut Ui, adapted: &Adapted) {
    ui.add_space(8.0);
    ui.label(section("What the fit corrects", cx.p));
    for pad in &adapted.pads {
        let text = format!(
            "{} ({} touches): shifted {:+.1} px right, {:+.1} px down; depth {} · d {} mm",
            pad.pad,
            pad.touches,
            pad.offset_px[0],
            pad.offset_px[1],
            fixed(pad.gain, 3),
            signed(pad.offset_m)
        );
        ui.add(egui::Label::new(text).wrap());
    }
    ui.label(caption("The Generate pane can switch each part off", cx.p));
}

fn signed(offset_m: f64) -> String {
    format!("{} {}", if offset_m < 0.0 { "-" } else { "+" }, fixed(mm(offset_m.abs()), 2))
}

/// Pairs to look at.
fn remarks(cx: &Cx<'_>, ui: &mut Ui, adapted: &Adapted) {
    let mut list = |heading: &str, remarks: &[Remark]| {
        if remarks.is_empty() {
            return;
        }
        ui.add_space(8.0);
        ui.label(section(heading, cx.p));
        for remark in remarks {
            ui.add(egui::Label::new(remark.to_string()).wrap());
        }
    };
    list("Pairs that disagree with the others", &adapted.doubtful);
    list("Pairs not used", &adapted.left_out);
}

/// Draws one into `rect`; made again only where `recipe` (what it shows) or its colors changed.
fn picture_of_depth(
    cx: &mut Cx<'_>,
    painter: &Painter,
    rect: Rect,
    slot: impl Hash,
    recipe: impl Hash,
    (image, map, range): (&DepthMap, ColorMap, Range),
) {
    let key = (recipe, map, range.lo.to_bits(), range.hi.to_bits());
    let texture = cx.shared.textures.get(painter.ctx(), slot, key, false, || (depth_image(image, map, range), None));
    painter.image(texture.texture.id(), rect, Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)), Color32::WHITE);
}

/// Says the value under the pointer in the status bar.
fn readout(cx: &mut Cx<'_>, response: &Response, name: &str, image: &DepthMap) {
    let Some(pos) = response.hover_pos() else { return };
    let share = (pos - response.rect.min) / response.rect.size();
    let [w, h] = image.size();
    let (x, y) = ((share.x * w as f32) as usize, (share.y * h as f32) as usize);
    if let Some(value) = image.get(x, y).filter(|v| v.is_finite()) {
        cx.shared.readout = Some(format!("{name} ({x}, {y})   {}", units::text_mm(f64::from(*value))));
    }
}
