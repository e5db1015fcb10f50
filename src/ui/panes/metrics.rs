//! The figures of the selected pair: image metrics, the ledger of the prediction, the pose.

use crate::app::results;
use crate::app::settings::prefer;
use eframe::egui::{Align, Button, Color32, Layout, RichText, ScrollArea, Sense, Ui};

use super::images;
use super::scene;
use crate::app::action::Action;
use crate::app::command::{LabelsCommand, Pane};
use crate::app::keys::{ImprintSource, Registration};
use crate::app::state::{Absent, Lookup};
use crate::ui::parts::cx::{Cx, side_color};
use crate::ui::parts::theme::{SMALL, caption, grade_color, section, value};
use crate::ui::parts::widget::line::Line;
use crate::ui::parts::widget::texture::Memo;
use strum::IntoEnumIterator as _;
use touch2touch_core::manual::{ManualPose, PoseDifference};
use touch2touch_core::postprocess::{Severity, Stage, Stats};
use touch2touch_core::sample::Scale;
use touch2touch_core::units;
use touch2touch_core::verdict::Grade;
use touch2touch_work::compare::Comparison;
use touch2touch_work::labels::ImprintOf;
use touch2touch_work::pose::PoseResult;

/// Figures that only this pane shows.
#[derive(Default)]
pub(crate) struct Memory {
    /// Of the error and of the measured imprint.
    stats: Memo<Stats>,
}

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory, _: Pane) {
    crate::ui::parts::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        ScrollArea::vertical().id_salt("metrics").show(ui, |ui| {
            pair(cx, ui);
            pose(cx, ui);
            comparison(cx, ui);
            ledger(cx, ui, memory);
        });
    });
}

fn pair(cx: &Cx<'_>, ui: &mut Ui) {
    let Some(entry) = cx.state.entry() else { return };
    ui.label(RichText::new(&entry.name).family(crate::ui::parts::theme::medium()).color(cx.p.strong));
    let tool = entry.tool.as_deref().unwrap_or("tool unknown");
    let note = images::scale_note(cx.state);
    ui.horizontal(|ui| {
        ui.label(caption(tool, cx.p));
        if !note.is_empty() {
            ui.label(RichText::new(note).size(SMALL).color(cx.p.caution))
                .on_hover_text("The source lost its scale: every length of this pair is an assumption");
        }
    });
}

/// The likeliest tools where that was asked, else the offer to try them where the pose is doubted.
fn tools(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, pose: &PoseResult) {
    match results::ranking(cx.state, source) {
        Some(Lookup::Ready(all)) => {
            let own = results::tool_name(cx.state).unwrap_or_default();
            for candidate in all.iter().take(3) {
                let text = format!("{:3.0} %  {}", 100.0 * candidate.chance, candidate.tool);
                let color = if candidate.tool == own { cx.p.text } else { cx.p.weak };
                ui.label(RichText::new(text).size(SMALL).color(color)).on_hover_text(format!(
                    "Chance that it is this tool if it is one of the {} of the data set, by what its model explains of contact and \
                     membrane; at {}",
                    all.len(),
                    units::text_deg(candidate.report.lab_angle_rad())
                ));
            }
        }
        Some(Lookup::Failed(err)) => {
            ui.label(RichText::new(&err.why).size(SMALL).color(cx.p.wrong));
        }
        Some(_) => {
            ui.label(caption("Trying all tools…", cx.p));
        }
        None if pose.verdict.as_ref().is_some_and(|verdict| verdict.grade > Grade::Good) => {
            let button = ui.add(Button::new(RichText::new(Action::TryTools.name()).size(SMALL)).small());
            if button.on_hover_text(cx.keys().help(Action::TryTools)).clicked() {
                cx.act(Action::TryTools);
            }
        }
        None => {}
    }
}

fn pose(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.label(section("Pose", cx.p));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let registration = cx.state.settings.registration;
            let combo = eframe::egui::ComboBox::from_id_salt("engine")
                .width(150.0)
                .truncate()
                .selected_text(registration.label());
            let response = combo.show_ui(ui, |ui| {
                for e in Registration::iter() {
                    if ui.selectable_label(e == registration.by, e.label()).on_hover_text(e.description()).clicked() {
                        cx.out.push(prefer(move |s| s.registration = e.into()).into());
                    }
                }
            });
            response.response.accessible_name("Registration").on_hover_text(registration.by.description());
        });
    });
    for source in [ImprintSource::Measured, ImprintSource::Predicted] {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 6.0;
            images::side_mark(ui, cx.p, source);
            ui.label(source.name());
            match results::pose(cx.state, source) {
                Lookup::Ready(pose) | Lookup::Stale(pose) => {
                    let color = pose.verdict.as_ref().map_or(cx.p.strong, |verdict| grade_color(cx.p, verdict.grade));
                    ui.label(RichText::new(scene::angle_text(pose)).color(color));
                }
                Lookup::Waiting => {
                    ui.label(caption("…", cx.p));
                }
                Lookup::Failed(err) => {
                    ui.label(RichText::new("failed").color(cx.p.wrong)).on_hover_text(err.to_string());
                }
                Lookup::Absent(absent) => {
                    ui.label(caption(absent_short(absent), cx.p)).on_hover_text(absent.text());
                }
            }
        });
        let units = match results::pose(cx.state, source) {
            Lookup::Failed(err) => err.units.clone(),
            _ => None,
        };
        if let Some(offer) = units {
            let place = format!("{}, in the metrics", source.name().to_lowercase());
            ui.horizontal_wrapped(|ui| images::unit_buttons(cx, ui, &offer, &place));
        }
        if let Some(pose) = results::pose(cx.state, source).shown() {
            let p = pose.grasp_from_object;
            let text = format!("y {:.2} mm   z {:.2} mm", units::mm(p.y_m), units::mm(p.z_m));
            ui.horizontal(|ui| {
                let place = ui.label(value(text, cx.p).size(SMALL));
                place.on_hover_text("Place of the object's origin in the grasp frame");
                ui.label(caption(scene::pose_time(pose), cx.p)).on_hover_text("What this registration took");
            });
            if let Some(verdict) = &pose.verdict {
                let text = format!("{}: {}", verdict.grade, verdict.why);
                let all: Vec<&str> = verdict.against.iter().map(|sign| sign.what.as_str()).collect();
                let label = ui.label(RichText::new(text).size(SMALL).color(grade_color(cx.p, verdict.grade)));
                if all.len() > 1 {
                    label.on_hover_text(all.join("\n"));
                }
            }
            tools(cx, ui, source, pose);
            ui.label(caption(scene::pose_details(pose), cx.p));
            let action = match source {
                ImprintSource::Measured => Action::AcceptMeasuredPose,
                ImprintSource::Predicted => Action::AcceptPredictedPose,
            };
            let accepted = results::accepted(cx.state, source) == Some(p.into());
            let text = if accepted { "Accepted (withdraw)" } else { "Accept this pose" };
            if let Some(hand) = results::by_hand(cx.state, source) {
                by_hand(cx, ui, source, hand);
            } else {
                cx.action_button(ui, action, text);
            }
            let elsewhere = results::accepted_elsewhere(cx.state);
            if source == ImprintSource::Predicted && !elsewhere.is_empty() {
                let of: Vec<String> = elsewhere.into_iter().map(ImprintOf::text).collect();
                ui.label(caption("another prediction has an accepted pose", cx.p)).on_hover_text(of.join("\n"));
            }
        }
    }
}

/// A pose that a person set, in place of the button that takes the registered one over.
fn by_hand(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, hand: ManualPose) {
    let angle = hand.planar.inverse().theta_rad;
    let mut text = format!("Accepted by hand: {}", units::text_deg(angle));
    if let Some(truth) = results::truth(cx.state) {
        text += &format!(" (error {})", units::text_deg(PoseDifference::between(hand.planar, truth).angle_rad));
    }
    ui.label(RichText::new(text).size(SMALL).color(cx.p.good));
    let tip = cx.keys().fill("The registered pose counts again ([[undo]] brings it back)");
    let withdraw = ui.small_button("Withdraw").on_hover_text(tip);
    if withdraw.accessible_name(format!("Withdraw the pose by hand, {}", source.name().to_lowercase())).clicked() {
        cx.push(LabelsCommand::AcceptPose(source, false));
    }
}

fn absent_short(absent: Absent) -> &'static str {
    match absent {
        Absent::NoPrediction => "no prediction yet",
        Absent::NoCamera => "no depth camera",
        Absent::NoTool => "tool unknown",
        Absent::NoContact => "too few contact points",
        Absent::NoTruth => "true pose unknown",
        _ => "not available",
    }
}

fn comparison(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.add_space(4.0);
    ui.label(section("Prediction against truth", cx.p)).on_hover_text(
        "PSNR and SSIM of the imprints in meters with the lab's peak of 22.5 mm as range; where the source lost its \
         scale, both images are scaled to 0..1 one by one (min-max)",
    );
    let fingers = cx.state.rig().pads().filter(|f| cx.state.fingers().contains(f));
    for finger in fingers {
        if let Some(recipe) = results::chosen(cx.state, finger) {
            let outdated = results::outdated(cx.state, finger).is_some();
            let color = if outdated { cx.p.caution } else { cx.p.weak };
            let text = RichText::new(cx.state.library.made_with(recipe)).size(SMALL).color(color);
            let label = ui.add(eframe::egui::Label::new(text).wrap());
            if outdated {
                label.on_hover_text("The settings in force would make another prediction");
            }
        }
        match results::comparison(cx.state, finger) {
            Lookup::Ready(c) | Lookup::Stale(c) => {
                let number = |v: Option<f64>, decimals: usize, unit: &str| match v {
                    Some(v) => format!("{v:.decimals$}{unit}"),
                    None => "not defined".to_owned(),
                };
                if cx.state.selection.both_fingers {
                    ui.label(caption(format!("{} finger", cx.state.finger_name(finger)), cx.p));
                }
                let (psnr, ssim) = match c.scale {
                    Scale::Measured => ("PSNR (peak 22.5 mm)", "SSIM (range 22.5 mm)"),
                    Scale::Assumed => ("PSNR (min-max 0..1)", "SSIM (min-max 0..1)"),
                };
                for (name, number) in [
                    (psnr, number(c.psnr_db, 1, " dB")),
                    (ssim, number(c.ssim, 3, "")),
                    ("Mean |error|", units::text_mm(c.mae_m)),
                ] {
                    line(0.0).show(ui, (name, cx.p.weak), &[(number, cx.p.strong)]);
                }
                parts(cx, ui, c);
                if let Some(warning) = results::ambiguity(cx.state, finger).and_then(|a| a.warning()) {
                    ui.add(eframe::egui::Label::new(RichText::new(warning).size(SMALL).color(cx.p.caution)).wrap());
                }
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
    }
}

/// Figures apart for what the GelSlim saw and for what the model made up.
fn parts(cx: &Cx<'_>, ui: &mut Ui, c: &Comparison) {
    let Some(split) = c.split else { return };
    let number = |v: Option<f64>, digits: usize| v.map_or("–".to_owned(), |v| units::fixed(v, digits));
    let spacing = std::mem::replace(&mut ui.spacing_mut().item_spacing.y, 0.0);
    let width = ((ui.available_width() - 60.0) / 4.0).clamp(34.0, 64.0);
    let heads = ["dB", "SSIM", "err mm", "bias mm"].map(|h| (h.to_owned(), cx.p.weak));
    line(width).show(ui, ("", cx.p.weak), &heads);
    for (name, f, tip) in [
        ("Seen", split.seen, "Inside the dashed window: the GelSlim saw this part. err: mean |error|"),
        ("Invented", split.invented, "Outside the dashed window: the model made this part up. err: mean |error|"),
    ] {
        let numbers = [
            number(f.psnr_db, 1),
            number(f.ssim, 3),
            number(f.mae.map(units::mm), 2),
            number(f.bias.map(units::mm), 2),
        ]
        .map(|text| (text, cx.p.strong));
        let tip = format!("{tip}. {} pixels; bias is predicted minus measured", f.pixels);
        line(width).show(ui, (name, cx.p.text), &numbers).on_hover_text(tip);
    }
    ui.spacing_mut().item_spacing.y = spacing;
}

/// Lines with `column` points from one number to the next.
fn line(column: f32) -> Line {
    Line { height: 17.0, size: 12.0, column, swatch: None }
}

/// The stages that a prediction went through, with the figures of each.
fn ledger(cx: &mut Cx<'_>, ui: &mut Ui, memory: &mut Memory) {
    let finger = cx.state.selection.finger;
    let shift = cx.state.settings.shift;
    let mut rows: Vec<(&str, Option<Color32>, Stats, bool)> = Vec::new();
    if let Some(recipe) = results::chosen(cx.state, finger).cloned() {
        if let Some(chain) = results::ledger(cx.state, finger).shown() {
            // The channels are of the pane "Depth chain"; here it is the way to meters.
            let way = |stage| !matches!(stage, Stage::Channel(_) | Stage::Resized | Stage::Placed);
            for record in chain.ledger.stages.iter().filter(|r| way(r.stage)) {
                let name = match record.stage {
                    Stage::Reduced => "Decoder",
                    Stage::Meters => "Meters",
                    Stage::Turned => "Predicted",
                    _ => "Shift",
                };
                let color = (record.stage == Stage::Turned).then(|| side_color(cx.p, ImprintSource::Predicted));
                rows.push((name, color, record.stats, record.stage.is_meters()));
            }
        }
        if let Lookup::Ready(c) = results::comparison(cx.state, finger) {
            let stats = *memory.stats.get("error", (&recipe, shift), || Stats::of(&c.error));
            rows.push(("Error", None, stats, true));
        }
    }
    if let (Lookup::Ready(imprint), Some(touch)) =
        (results::imprint(cx.state, ImprintSource::Measured, finger), cx.state.touch_key(finger))
    {
        let stats = *memory.stats.get("measured", touch, || Stats::of(imprint));
        let row = rows.len().saturating_sub(usize::from(rows.last().is_some_and(|r| r.0 == "Error")));
        rows.insert(row, ("Measured", Some(side_color(cx.p, ImprintSource::Measured)), stats, true));
    }
    if rows.is_empty() {
        return;
    }
    ui.add_space(4.0);
    ui.label(section(&format!("Ledger, {} finger", cx.state.finger_name(finger)), cx.p))
        .on_hover_text("What each stage of the depth chain left behind: smallest, mean, deviation, largest");
    if let Some(chain) = results::ledger(cx.state, finger).shown() {
        let serious = chain.ledger.flags.iter().filter(|f| f.severity < Severity::Info).count();
        if let Some(first) = chain.ledger.flags.first().filter(|_| serious > 0) {
            let color = if first.severity == Severity::Wrong { cx.p.wrong } else { cx.p.caution };
            let more = if serious > 1 { format!(" (and {} more)", serious - 1) } else { String::new() };
            let text = RichText::new(format!("{}{more}", first.what)).size(SMALL).color(color);
            let link = ui.add(eframe::egui::Label::new(text).wrap().sense(Sense::click()));
            if link.on_hover_text(format!("{} {} Click for the depth chain", first.why, first.action)).clicked() {
                cx.act(Action::DepthChain);
            }
        }
    }
    ui.spacing_mut().item_spacing.y = 0.0;
    let width = ((ui.available_width() - 76.0) / 4.0).clamp(34.0, 64.0);
    let heads = ["min", "mean", "std", "max"].map(|h| (h.to_owned(), cx.p.weak));
    line(width).show(ui, ("mm", cx.p.weak), &heads);
    for (name, color, stats, meters) in rows {
        let numbers = [stats.min, stats.mean, stats.std, stats.max].map(|v| {
            let v = if meters { units::mm(v) } else { v };
            (if v.is_finite() { format!("{v:.2}") } else { "–".to_owned() }, cx.p.strong)
        });
        line(width).show(ui, (name, color.unwrap_or(cx.p.text)), &numbers);
    }
}
