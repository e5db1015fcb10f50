//! The selected pair in words and figures: the verdict on its pose, the prediction against the truth.

use crate::app::results;
use eframe::egui::{Button, Label, RichText, ScrollArea, Ui};

use super::{images, scene};
use crate::app::action::{Action, with_keys};
use crate::app::command::{LabelsCommand, Pane};
use crate::app::keys::ImprintSource;
use crate::app::state::{Absent, Lookup};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption, grade_color, section, value};
use crate::ui::parts::widget::line::Line;
use crate::ui::parts::widget::scroll_to_focus;
use strum::IntoEnumIterator as _;
use touch2touch_core::postprocess::Severity;
use touch2touch_core::sample::Scale;
use touch2touch_core::units;
use touch2touch_core::verdict::Grade;
use touch2touch_core::which_tool::in_words;
use touch2touch_pipeline::labels::ImprintOf;
use touch2touch_pipeline::steps::pose::PoseResult;

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    ScrollArea::vertical().id_salt("metrics").show(ui, |ui| {
        pair(cx, ui);
        pose(cx, ui);
        comparison(cx, ui);
        flag(cx, ui);
        scroll_to_focus(ui);
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
                .on_hover_text("Pictures carry no scale: every length of this pair is assumed");
        }
    });
}

fn is_doubted(cx: &Cx<'_>, source: ImprintSource) -> bool {
    let verdict = results::pose(cx.state, source).shown().and_then(|pose| pose.verdict.as_ref());
    verdict.is_some_and(|verdict| verdict.grade > Grade::Good)
}

/// The likeliest tools where that was asked, else the offer to try them where the pose is doubted.
fn tools(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource) {
    match results::ranking(cx.state, source) {
        Some(Lookup::Ready(all)) => {
            ui.label(RichText::new(format!("Tool: {}", in_words(all))).size(SMALL).color(cx.p.strong));
            let own = results::tool_name(cx.state).unwrap_or_default();
            for (row, candidate) in all.iter().enumerate().take(3) {
                let text = format!("{:3.0} %  {}", 100.0 * candidate.chance, candidate.tool);
                let color = if candidate.tool == own { cx.p.text } else { cx.p.weak };
                let label = ui.label(RichText::new(text).size(SMALL).color(color)).on_hover_text(format!(
                    "Probability that it is this tool, given that it is one of the {} of this data set; best angle {}. \
                     The 3D view shows its outline there",
                    all.len(),
                    units::text_deg(candidate.report.lab_angle_rad())
                ));
                if label.hovered() || cx.shared.hovered_tool == Some((source, row)) {
                    cx.shared.hovered_tool = label.hovered().then_some((source, row));
                }
            }
        }
        Some(Lookup::Failed(err)) => {
            ui.label(RichText::new(&err.why).size(SMALL).color(cx.p.wrong));
        }
        Some(_) => {
            ui.label(caption("Trying all tools…", cx.p));
        }
        // One button for both sides: the first that is doubted has it.
        None if ImprintSource::iter().find(|side| is_doubted(cx, *side)) == Some(source) => {
            let button = ui.add(Button::new(RichText::new(Action::TryTools.name()).size(SMALL)).small());
            if button.on_hover_text(Action::TryTools.help()).clicked() {
                cx.act(Action::TryTools);
            }
        }
        None => {}
    }
}

/// The pose of each side: the verdict in words, the angle with its deviation, then where it is.
fn pose(cx: &mut Cx<'_>, ui: &mut Ui) {
    for source in ImprintSource::iter() {
        ui.add_space(4.0);
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 6.0;
            images::side_mark(ui, cx.p, source);
            ui.label(source.name());
            match results::pose(cx.state, source) {
                Lookup::Ready(pose) | Lookup::Stale(pose) => angle(cx, ui, pose),
                Lookup::Waiting => _ = ui.label(caption("…", cx.p)),
                Lookup::Failed(err) => {
                    ui.label(RichText::new("no pose").color(cx.p.wrong)).on_hover_text(err.to_string());
                }
                Lookup::Absent(absent) => {
                    ui.label(caption(absent_short(absent), cx.p)).on_hover_text(absent.text());
                }
            }
        });
        if let Some(pose) = results::pose(cx.state, source).shown() {
            verdict(cx, ui, pose);
            tools(cx, ui, source);
            place(cx, ui, source, pose);
        }
    }
}

/// The verdict in a word, the angle with its standard deviation, and how far it is off where the truth is known.
fn angle(cx: &Cx<'_>, ui: &mut Ui, pose: &PoseResult) {
    if let Some(verdict) = &pose.verdict {
        ui.label(RichText::new(verdict.grade.to_string()).color(grade_color(cx.p, verdict.grade)));
    }
    ui.label(value(pose.angle_text(), cx.p)).on_hover_text("Angle of the tool in the hand ± standard deviation");
    if let (Some(truth), Some(error)) = (pose.truth_rad, pose.error_rad) {
        let text = RichText::new(format!("off by {}", units::text_deg(error))).size(SMALL);
        let label = ui.label(text.color(scene::error_color(cx.p, error)));
        label.on_hover_text(format!("The true angle is {}", units::text_deg(truth)));
    }
}

/// The reason of the verdict; what it says of angle and place, and what else speaks against the pose, behind it.
fn verdict(cx: &Cx<'_>, ui: &mut Ui, pose: &PoseResult) {
    let Some(verdict) = &pose.verdict else { return };
    let text = RichText::new(&verdict.why).size(SMALL);
    let label = ui.add(Label::new(text.color(grade_color(cx.p, verdict.grade))).wrap());
    let others = verdict.against.iter().skip(1).map(|sign| sign.what.clone());
    label.on_hover_text(std::iter::once(verdict.parts_text()).chain(others).collect::<Vec<_>>().join("\n"));
}

/// The place of the tool; how it was found behind it.
fn place(cx: &mut Cx<'_>, ui: &mut Ui, source: ImprintSource, pose: &PoseResult) {
    let p = pose.grasp_from_object;
    let mut text = format!("y {:.2} mm   z {:.2} mm", units::mm(p.y_m), units::mm(p.z_m));
    if results::accepted(cx.state, source) == Some(p.into()) {
        text += "   accepted";
    }
    let label = ui.label(value(text, cx.p).size(SMALL));
    label.on_hover_text(format!(
        "Position of the tool's origin in the grasp frame.\n{}, {}",
        scene::pose_details(pose),
        scene::pose_time(pose)
    ));
    let elsewhere = results::accepted_elsewhere(cx.state);
    if source == ImprintSource::Predicted && !elsewhere.is_empty() {
        let of: Vec<String> = elsewhere.into_iter().map(ImprintOf::text).collect();
        ui.label(caption("another prediction has a pose by hand", cx.p)).on_hover_text(of.join("\n"));
    }
    let Some(hand) = results::by_hand(cx.state, source) else { return };
    let angle = units::text_deg(hand.inverse().theta_rad);
    let error = results::off_truth(cx.state, hand).map(|off| off.angle_rad);
    let error = error.map_or(String::new(), |error| format!(" (error {})", units::text_deg(error)));
    ui.horizontal(|ui| {
        ui.label(RichText::new(format!("Pose by hand: {angle}{error}")).size(SMALL).color(cx.p.good));
        let tip = with_keys("Goes back to the registered pose ([[undo]] undoes this)");
        let withdraw = ui.small_button("Withdraw").on_hover_text(tip);
        if withdraw.accessible_name(format!("Withdraw the pose by hand, {}", source.name().to_lowercase())).clicked() {
            cx.push(LabelsCommand::AcceptPose(source, false));
        }
    });
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
    ui.label(section("Predicted vs measured", cx.p)).on_hover_text(
        "PSNR and SSIM of the imprints in meters with the lab's peak of 22.5 mm as range; where the source lost its \
         scale, both images are scaled to 0..1 one by one (min-max)",
    );
    let fingers = cx.state.rig().pads().filter(|f| cx.state.fingers().contains(f));
    for finger in fingers {
        // What it was made with stands under the image; here only that it is not what would be made now.
        if let Some(recipe) =
            results::chosen(cx.state, finger).filter(|_| results::outdated(cx.state, finger).is_some())
        {
            let text = RichText::new("Made with other settings").size(SMALL).color(cx.p.caution);
            ui.label(text).on_hover_text(cx.state.library.made_with(recipe));
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
                    Scale::Measured => ("PSNR", "SSIM"),
                    Scale::Assumed => ("PSNR (rescaled)", "SSIM (rescaled)"),
                };
                for (name, number) in [
                    (psnr, number(c.psnr_db, 1, " dB")),
                    (ssim, number(c.ssim, 3, "")),
                    ("Mean error", units::text_mm(c.mae_m)),
                ] {
                    line(0.0).show(ui, (name, cx.p.weak), &[(number, cx.p.strong)]);
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

/// Lines with `column` points from one number to the next.
fn line(column: f32) -> Line {
    Line { height: 17.0, size: 12.0, column, swatch: None }
}

/// The worst of what is implausible about the way of the prediction to meters, with all of it behind it.
fn flag(cx: &Cx<'_>, ui: &mut Ui) {
    let Some(flags) = results::flags(cx.state, cx.state.selection.finger).shown() else { return };
    let Some(first) = flags.first() else { return };
    let color = if first.severity == Severity::Wrong { cx.p.wrong } else { cx.p.caution };
    let more = if flags.len() > 1 { format!(" (and {} more)", flags.len() - 1) } else { String::new() };
    let text = RichText::new(format!("{}{more}", first.what)).size(SMALL).color(color);
    let all: Vec<String> = flags.iter().map(|flag| format!("{} {} {}", flag.what, flag.why, flag.action)).collect();
    ui.add(Label::new(text).wrap()).on_hover_text(all.join("\n"));
}
