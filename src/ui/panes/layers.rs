//! The layers of a registration: residuals, drop reasons, distances both ways, and the direction it leaves open.

use eframe::egui::{
    Align, Align2, Button, Color32, FontId, Layout, Rect, RichText, Role, ScrollArea, Sense, Stroke, Ui, WidgetInfo,
    pos2, vec2,
};
use strum::IntoEnumIterator as _;

use super::images;
use crate::app::action::Action;
use crate::app::command::{Command, Pane};
use crate::app::keys::ImprintSource;
use crate::app::results;
use crate::app::state::Lookup;
use crate::app::workbench::{Layer, WorkbenchCommand};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, section};
use crate::ui::parts::widget::line::Line;
use touch2touch_core::align::reason::Reason;
use touch2touch_core::align::{Observability, Uncertainty};
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::units;
use touch2touch_work::layers::LayerResult;

/// The colors of residuals: perceptually uniform, and told apart by color-blind eyes.
pub(crate) const RESIDUAL_MAP: ColorMap = ColorMap::Viridis;

/// The color of a reason: the palette of Okabe and Ito, made to be told apart by color-blind eyes.
pub(crate) fn reason_rgb(reason: Reason) -> [u8; 3] {
    match reason {
        Reason::Inlier => [0x00, 0x9e, 0x73],
        Reason::Inside => [0xf0, 0xe4, 0x42],
        Reason::BeyondGate => [0xd5, 0x5e, 0x00],
        Reason::Trimmed => [0xcc, 0x79, 0xa7],
        Reason::OutOfFrame => [0x00, 0x72, 0xb2],
        Reason::InvalidDepth => [0xe8, 0xe8, 0xe8],
        Reason::OutsideMask => [0x70, 0x70, 0x70],
    }
}

/// Tooltip of a reason.
fn reason_tip(reason: Reason) -> &'static str {
    match reason {
        Reason::Inlier => "Contact point near the outline: it pulls on the pose",
        Reason::Inside => "Contact point on the silhouette: it fits and does not pull",
        Reason::BeyondGate => "Contact point farther than three widths of the kernel: its pull is negligible",
        Reason::Trimmed => "Contact point left out by a rejector of the registration",
        Reason::OutOfFrame => "Contact point outside the field of the tool",
        Reason::InvalidDepth => "Pixel of the mask without a usable depth",
        Reason::OutsideMask => "Pixel that the contact mask leaves out",
    }
}

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    crate::ui::parts::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        ScrollArea::vertical().id_salt("layers").show(ui, |ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            let source = cx.state.workbench.side;
            choice(cx, ui, source);
            match results::layers(cx.state, source) {
                Lookup::Ready(layers) | Lookup::Stale(layers) => {
                    histogram(cx, ui, layers);
                    reasons(cx, ui, layers);
                    directions(cx, ui, layers);
                }
                Lookup::Waiting => {
                    ui.label(caption("…", cx.p));
                }
                Lookup::Failed(err) => {
                    ui.label(RichText::new(err.to_string()).size(SMALL).color(cx.p.wrong));
                }
                Lookup::Absent(absent) => {
                    ui.label(caption(absent.text(), cx.p));
                }
            }
            if let Some(pose) = results::pose(cx.state, source).shown()
                && let Some(o) = &pose.report.observability
            {
                observability(cx, ui, o, pose.report.evidence.map(|evidence| evidence.uncertainty));
            }
        });
    });
}

/// Choice of the side that the pane is about, and of the layer that colors the points.
fn choice(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for side in ImprintSource::iter() {
            images::side_mark(ui, cx.p, side);
            let text = RichText::new(side.name()).size(SMALL);
            let button = ui.add(Button::selectable(side == source, text).min_size(vec2(0.0, 20.0)));
            let button = button.accessible_name(format!("Layers of the {} side", side.name().to_lowercase()));
            if button.on_hover_text("What this pane is about; follows the 3D pane under the pointer").clicked() {
                cx.push(Command::Workbench(WorkbenchCommand::SetSide(side)));
            }
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.label(caption("Color", cx.p));
        for layer in Layer::iter() {
            let text = RichText::new(layer.name()).size(SMALL);
            let on = cx.state.workbench.layer == layer;
            let button = ui.add(Button::selectable(on, text).min_size(vec2(0.0, 20.0)));
            let button = button.accessible_name(format!("Layer {}", layer.name()));
            if button.on_hover_text(format!("{} (V goes through the layers)", layer.tooltip())).clicked() {
                cx.push(Command::Workbench(WorkbenchCommand::SetLayer(layer)));
            }
        }
    });
}

/// Residuals by size, in the colors that they have in 3D, with the width of the kernel.
fn histogram(cx: &Cx<'_>, ui: &mut Ui, layers: &LayerResult) {
    ui.label(section("Residuals", cx.p)).on_hover_text("Distance of the contact points to the model");
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 52.0), Sense::hover());
    let points: u32 = layers.histogram.iter().sum::<u32>() + layers.above;
    let range = units::mm(layers.range_m);
    let mut info = format!("{points} contact points, {} farther than {range:.1} mm", layers.above);
    if let Some(kernel) = layers.kernel_m {
        info += &format!("; kernel {}", units::text_mm(kernel));
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("Histogram of residuals: {info}")));
    let painter = ui.painter_at(rect);
    let plot = Rect::from_min_max(rect.min + vec2(2.0, 0.0), rect.max - vec2(2.0, 14.0));
    let most = layers.histogram.iter().copied().max().unwrap_or(0).max(1);
    let n = layers.histogram.len().max(1) as f32;
    let width = plot.width() / n;
    for (i, count) in layers.histogram.iter().enumerate() {
        // A root, so that the few far points are seen beside the many near ones.
        let share = (*count as f32 / most as f32).sqrt();
        let x = plot.left() + i as f32 * width;
        let [r, g, b] = RESIDUAL_MAP.rgb8((i as f32 + 0.5) / n);
        let bar = Rect::from_min_max(
            pos2(x, plot.bottom() - share * (plot.height() - 4.0)),
            pos2(x + width - 0.5, plot.bottom()),
        );
        painter.rect_filled(bar, 0.0, Color32::from_rgb(r, g, b));
    }
    painter.hline(plot.x_range(), plot.bottom(), Stroke::new(1.0, cx.p.line));
    let font = FontId::proportional(10.0);
    let axis = Range { lo: 0.0, hi: range as f32 };
    for v in 0..=range.floor() as u32 {
        let x = plot.left() + axis.unit(v as f32) * plot.width();
        let anchor = match v {
            0 => Align2::LEFT_TOP,
            v if f64::from(v) + 0.5 > range => Align2::RIGHT_TOP,
            _ => Align2::CENTER_TOP,
        };
        let text = if f64::from(v) + 0.5 > range { format!("{v} mm") } else { v.to_string() };
        painter.text(pos2(x, plot.bottom() + 1.0), anchor, text, font.clone(), cx.p.weak);
    }
    if let Some(kernel) = layers.kernel_m {
        let x = plot.left() + axis.unit(units::mm(kernel) as f32) * plot.width();
        painter.vline(x, plot.y_range(), Stroke::new(1.0, cx.p.strong));
        painter.text(pos2(x + 4.0, plot.top()), Align2::LEFT_TOP, "kernel", font.clone(), cx.p.text);
    }
    if layers.above > 0 {
        let text = format!("+{} farther", layers.above);
        painter.text(plot.right_top(), Align2::RIGHT_TOP, text, font, cx.p.weak);
    }
    response.on_hover_text(format!("{info}. Heights by the square root of the counts"));
}

/// Lines with `column` points from one number to the next.
fn line(column: f32) -> Line {
    Line { height: 14.0, size: SMALL, column, swatch: None }
}

fn reasons(cx: &Cx<'_>, ui: &mut Ui, layers: &LayerResult) {
    ui.add_space(2.0);
    ui.label(section("What became of the pixels", cx.p));
    let rig = cx.state.rig();
    let heads: Vec<_> = rig.pads().map(|finger| (rig.pad_key(finger).into_owned(), cx.p.weak)).collect();
    ui.spacing_mut().item_spacing.y = 0.0;
    line(56.0).show(ui, ("", cx.p.weak), &heads);
    // What did not happen is said in one line.
    let happened = |reason: &Reason| layers.counts.iter().flatten().any(|counts| counts[*reason as usize] > 0);
    for reason in Reason::iter().filter(happened) {
        let [r, g, b] = reason_rgb(reason);
        let numbers = rig.pads().map(|finger| {
            let count = layers.counts.get(finger).map_or(0, |counts| counts[reason as usize]);
            let there = layers.reasons[finger].is_some();
            let color = if count > 0 { cx.p.strong } else { cx.p.weak };
            (if there { count.to_string() } else { "–".to_owned() }, color)
        });
        let numbers: Vec<_> = numbers.collect();
        let line = Line { swatch: Some(Color32::from_rgb(r, g, b)), ..line(56.0) };
        line.show(ui, (&reason.to_string(), cx.p.text), &numbers).on_hover_text(reason_tip(reason));
    }
    let none: Vec<String> = Reason::iter().filter(|r| !happened(r)).map(|r| r.to_string()).collect();
    if !none.is_empty() {
        line(56.0).show(ui, (&format!("none {}", none.join(", ")), cx.p.weak), &[]);
    }
    ui.spacing_mut().item_spacing.y = 2.0;
}

fn directions(cx: &Cx<'_>, ui: &mut Ui, layers: &LayerResult) {
    let Some(both) = layers.directions else { return };
    ui.add_space(2.0);
    let heads = ["rms", "overlap"].map(|h| (h.to_owned(), cx.p.weak));
    line(62.0).show(ui, ("Both directions", cx.p.weak), &heads);
    for (name, d, tip) in [
        ("Touch to model", both.scene_to_model, "Contact points to the nearest model point: how well the touch fits"),
        (
            "Model to touch",
            both.model_to_scene,
            "The tool's surface to the nearest contact point: how much was touched",
        ),
    ] {
        let numbers = [units::text_mm(d.rms_m), format!("{:.0} %", d.overlap * 100.0)].map(|text| (text, cx.p.strong));
        line(62.0)
            .show(ui, (name, cx.p.text), &numbers)
            .on_hover_text(format!("{tip}. Overlap: share within 1 mm, in the plane of the tool"));
    }
}

fn observability(cx: &mut Cx<'_>, ui: &mut Ui, o: &Observability, told: Option<Uncertainty>) {
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        ui.label(section("Observability", cx.p));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let on = cx.state.workbench.animate_weakest;
            let text = RichText::new("Animate").size(SMALL);
            let button = ui.add(Button::selectable(on, text).frame_when_inactive(true).min_size(vec2(0.0, 18.0)));
            let button = button.accessible_name(Action::AnimateWeakest.name());
            if button.on_hover_text(cx.keys().help(Action::AnimateWeakest)).clicked() {
                cx.act(Action::AnimateWeakest);
            }
        });
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        let color = if o.degenerate { cx.p.caution } else { cx.p.text };
        ui.label(RichText::new(format!("Weakest: {}", o.weakest_text())).size(SMALL).color(color))
            .on_hover_text("The motion of the tool that changes the fit least, in the grasp frame");
        if o.degenerate {
            let text = RichText::new("degenerate").size(SMALL).color(cx.p.caution);
            ui.label(text)
                .on_hover_text("The contact points leave a motion of the tool open: its pose is not determined");
        }
    });
    if let Some(told) = told {
        let [turn, y, z] = [0, 1, 2].map(|i| told.covariance[i][i].sqrt());
        let text = format!("1σ  y {:.2} mm   z {:.2} mm   angle {:.2}°", units::mm(y), units::mm(z), turn.to_degrees());
        ui.label(caption(text, cx.p)).on_hover_text(
            "Standard deviations of the pose: of the fit's curvature and noise, the cameras' mounting, and what a gripper holds",
        );
    }
    let [a, b, c] = o.eigenvalues;
    ui.label(caption(format!("Eigenvalues {a:.4}  {b:.3}  {c:.3}   {} points tell", o.telling), cx.p)).on_hover_text(
        "Of the scaled curvature of the fit per point near the outline; the smallest below 0.015 counts as degenerate",
    );
}
