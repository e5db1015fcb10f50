//! The generator fitted to the open pairs: which pairs, how far it is, and what the fit is worth.

use eframe::egui::{self, RichText, ScrollArea, Ui, vec2};
use strum::IntoEnumIterator as _;

use super::cx::Cx;
use super::theme::{SMALL, caption, section};
use super::widget::{empty, progress};
use crate::app::action::Action;
use crate::app::adapt::{AdaptPairs, TUNING_STEPS};
use crate::app::command::{AdaptCommand, Pane, TasksCommand};
use crate::domain::units::{fixed, mm};
use crate::work::adapt::{Adapted, ENOUGH_PAIRS, Remark, Scored};

/// Nothing is kept between frames.
pub(super) type Memory = ();

/// The pane.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    super::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        choices(cx, ui);
        ui.separator();
        let Some(found) = cx.state.adapt.result.clone() else {
            let (what, why) = match cx.state.adapting() {
                Some(_) => ("The scores appear when the fit was tried", "A second or two after the last prediction"),
                None => (
                    "The model is as it was trained, on simulated touches",
                    "Some pairs of your own sensors tell where their windows lie, their scale and their pattern: the \
                     model is fitted to them in seconds, and scored on pairs that were left out",
                ),
            };
            let action = Action::FitPairs.command(cx.state);
            let action = action.map(|_| ("Fit to my pairs", Action::FitPairs.tooltip()));
            if empty::show(ui, what, why, action) {
                cx.act(Action::FitPairs);
            }
            return;
        };
        ScrollArea::vertical().auto_shrink(false).id_salt("fit").show(ui, |ui| {
            scores(cx, ui, &found);
            pads(cx, ui, &found);
            remarks(cx, ui, &found);
        });
    });
}

/// Which pairs, and the buttons.
fn choices(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        ui.label(caption("Fit to", cx.p));
        let now = cx.state.adapt.pairs;
        let combo = egui::ComboBox::from_id_salt("fitted pairs").width(130.0).selected_text(now.label());
        let response = combo.show_ui(ui, |ui| {
            for pairs in AdaptPairs::iter() {
                if ui.selectable_label(pairs == now, pairs.label()).clicked() {
                    cx.push(AdaptCommand::Choose(pairs));
                }
            }
        });
        response.response.accessible_name("Pairs to fit to").on_hover_text("Which pairs the model is fitted to");
        let count = cx.state.adapt_pairs().count();
        let text = RichText::new(format!("{count} pairs")).size(SMALL);
        let text = if count < ENOUGH_PAIRS { text.color(cx.p.caution) } else { text.color(cx.p.weak) };
        ui.label(text).on_hover_text(format!(
            "From {ENOUGH_PAIRS} pairs on a fit is sound; about a tenth of a second each, the first time"
        ));
        let mut tune = cx.state.adapt.tune;
        let tip = format!(
            "After the closed form, {TUNING_STEPS} steps of tuning the networks themselves: about a minute each on two free \
             cores, four times over, because the score is of pairs that were left out"
        );
        if ui.checkbox(&mut tune, "tune the networks").on_hover_text(tip).changed() {
            cx.push(AdaptCommand::Tune(tune));
        }
        match cx.state.adapting() {
            Some((ticket, task)) => {
                let (fraction, text, cancelling) =
                    (task.progress.fraction(), task.progress.text.clone(), task.cancelling);
                progress::bar(ui, (ui.available_width() - 70.0).clamp(80.0, 360.0), fraction, &text);
                let cancel = ui.add_enabled(!cancelling, egui::Button::new("Cancel"));
                if cancel.on_hover_text("Stop; nothing is written").clicked() {
                    cx.push(TasksCommand::Cancel(ticket));
                }
            }
            None => {
                cx.action_button(ui, Action::FitPairs, "Fit to my pairs");
                cx.action_button(ui, Action::UseFit, "Use the fitted model");
                if cx.state.uses_fit() {
                    let tip = "The fitted model predicts now; another can be chosen in the Generate pane";
                    ui.label(RichText::new("in use").color(cx.p.good)).on_hover_text(tip);
                }
            }
        }
    });
}

/// A column of figures: heading, tooltip, value.
type Figure = (&'static str, &'static str, fn(&Scored) -> Option<String>);

const FIGURES: [Figure; 7] = [
    (
        "PSNR dB",
        "Pictures whose scale was lost are both stretched to 0..1, where noise decides; else peak 22.5 mm",
        |s| Some(format!("{:.1} ± {:.1}", s.psnr_db?, s.psnr_spread_db?)),
    ),
    ("SSIM", "Structural similarity, as PSNR", |s| Some(format!("{:.2}", s.ssim?))),
    ("raw dB", "PSNR of the pictures as they are, not stretched", |s| Some(format!("{:.1}", s.psnr_raw_db?))),
    ("line dB", "PSNR after the straight line that fits best: the worth of the shape alone", |s| {
        Some(format!("{:.1}", s.psnr_line_db?))
    }),
    ("seen dB", "PSNR inside the GelSlim's window", |s| Some(format!("{:.1}", s.seen?.psnr_db?))),
    ("invented dB", "PSNR outside the GelSlim's window", |s| Some(format!("{:.1}", s.invented?.psnr_db?))),
    ("angle °", "Mean error of the in-hand angle, degrees, where the data have poses", |s| {
        Some(format!("{:.1}", s.angle.as_ref()?.mean_deg?))
    }),
];

/// Before and after, on pairs that were left out.
fn scores(cx: &Cx<'_>, ui: &mut Ui, found: &Adapted) {
    ui.label(section("On pairs that were left out", cx.p));
    let rows = [
        ("As it was trained", Some(&found.before)),
        ("Fitted (closed form)", found.closed_form.as_ref()),
        ("Tuned", found.after.as_ref()),
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
        "{} pairs, {} touches; {:.1} s, {:.2} s of it for the fit",
        found.pairs, found.touches, found.seconds, found.fit_seconds
    );
    ui.label(caption(text, cx.p));
    for warning in &found.warnings {
        ui.add(egui::Label::new(RichText::new(warning).size(SMALL).color(cx.p.caution)).wrap());
    }
}

/// What was found for each pad.
fn pads(cx: &Cx<'_>, ui: &mut Ui, found: &Adapted) {
    ui.add_space(8.0);
    ui.label(section("What was found", cx.p));
    for pad in &found.pads {
        let text = format!(
            "{} ({} touches): moved {:+.1} px right and {:+.1} px down in the decoder's picture; {} · d {} mm",
            pad.pad,
            pad.touches,
            pad.offset_px[0],
            pad.offset_px[1],
            fixed(pad.gain, 3),
            signed(pad.offset_m)
        );
        ui.add(egui::Label::new(text).wrap());
    }
    ui.label(caption("Each part is a stage of the depth chain, and can be switched off there", cx.p));
}

fn signed(offset_m: f64) -> String {
    format!("{} {}", if offset_m < 0.0 { "-" } else { "+" }, fixed(mm(offset_m.abs()), 2))
}

/// Pairs to look at.
fn remarks(cx: &Cx<'_>, ui: &mut Ui, found: &Adapted) {
    let mut list = |heading: &str, remarks: &[Remark]| {
        if remarks.is_empty() {
            return;
        }
        ui.add_space(8.0);
        ui.label(section(heading, cx.p));
        for remark in remarks {
            ui.add(egui::Label::new(format!("{}: {}", remark.name, remark.why)).wrap());
        }
    };
    list("Pairs that contradict the others", &found.doubtful);
    list("Pairs that could not be used", &found.left_out);
}
