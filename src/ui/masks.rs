//! The mask tools: brush, eraser, automatic sources with live preview, clean-ups, undo, review state.

use eframe::egui::{self, RichText, ScrollArea, Ui, vec2};
use strum::IntoEnumIterator as _;

use super::browser::review_color;
use super::cx::Cx;
use super::theme::{SMALL, caption, section};
use crate::app::action::Action;
use crate::app::command::{Command, LabelsCommand, Pane, SettingsCommand};
use crate::app::keys::ImprintSource;
use crate::app::labels::Review;
use crate::app::settings::{BRUSH_RADIUS_PX, MaskChoice, MaskSettings, MaskSource, MaskTool};
use crate::app::state::Lookup;

/// Nothing is kept between frames.
pub(super) type Memory = ();

/// The pane.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    super::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        if let Some(err) = cx.state.document.blocked(cx.state.pair_name()) {
            ui.label(RichText::new("The stored labels of this pair cannot be read.").color(cx.p.wrong));
            ui.label(caption(format!("{err} They are left untouched, and this pair cannot be edited."), cx.p));
            return;
        }
        ScrollArea::vertical().id_salt("masks").show(ui, |ui| {
            tools(cx, ui);
            source(cx, ui);
            clean_ups(cx, ui);
            review(cx, ui);
            look(cx, ui);
        });
    });
}

fn tools(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        for (tool, action) in
            [(MaskTool::Brush, Action::Brush), (MaskTool::Eraser, Action::Eraser), (MaskTool::Pan, Action::PanTool)]
        {
            let on = cx.state.settings.mask.tool == tool;
            let button = ui.add(egui::Button::selectable(on, tool.name()).min_size(vec2(56.0, 24.0)));
            if button.on_hover_text(cx.keys().help(action)).clicked() {
                cx.push(SettingsCommand::SetMaskTool(tool));
            }
        }
    });
    ui.horizontal(|ui| {
        let mut radius = cx.state.settings.mask.radius_px;
        ui.spacing_mut().slider_width = (ui.available_width() - 148.0).max(40.0);
        let slider = egui::Slider::new(&mut radius, BRUSH_RADIUS_PX).logarithmic(true).fixed_decimals(1).suffix(" px");
        let response = ui.add(slider).accessible_name("Brush radius");
        if response.double_clicked() {
            radius = MaskSettings::default().radius_px;
        }
        if response.changed() || response.double_clicked() {
            cx.push(SettingsCommand::SetBrushRadius(radius));
        }
        let mm = f64::from(radius) / cx.state.rig().depth().map_or(f64::NAN, |sensor| sensor.px_per_m) * 1e3;
        ui.label(caption(format!("{mm:.2} mm"), cx.p));
        let tip = "Radius of brush and eraser, image pixels ([[brush_smaller]] and [[brush_larger]], or Shift + wheel). \
                   Double-click resets";
        response.on_hover_text(cx.keys().fill(tip));
    });
}

/// The automatic source, with its number.
fn source(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.add_space(2.0);
    ui.label(section("Automatic source", cx.p));
    let settings = &cx.state.settings.mask;
    let finger = cx.state.selection.finger;
    let combo = egui::ComboBox::from_id_salt("mask source").width(ui.available_width() - 8.0);
    let response = combo.selected_text(settings.choice.source.name()).show_ui(ui, |ui| {
        for source in MaskSource::iter() {
            let option = ui.selectable_label(source == settings.choice.source, source.name());
            if option.on_hover_text(source.tooltip()).clicked() {
                cx.out.push(Command::Settings(SettingsCommand::SetMaskSource(source)));
            }
        }
    });
    response.response.accessible_name("Mask source").on_hover_text(settings.choice.source.tooltip());
    let mut new = settings.clone();
    ui.spacing_mut().slider_width = (ui.available_width() - 76.0).max(40.0);
    match settings.choice.source {
        MaskSource::Threshold => {
            let mut mm = new.choice.threshold_m * 1e3;
            let slider = egui::Slider::new(&mut mm, 0.0..=15.0).fixed_decimals(2).suffix(" mm");
            let response = ui.add(slider).accessible_name("Threshold");
            if response.double_clicked() {
                mm = MaskChoice::default().threshold_m * 1e3;
            }
            new.choice.threshold_m = mm * 1e-3;
            response
                .on_hover_text("Pixels pushed in further than this, millimeters. Default 5.00; double-click resets");
        }
        MaskSource::TopPercent => {
            let slider = egui::Slider::new(&mut new.choice.top_percent, 0.0..=60.0).fixed_decimals(1).suffix(" %");
            let response = ui.add(slider).accessible_name("Top percent");
            if response.double_clicked() {
                new.choice.top_percent = MaskChoice::default().top_percent;
            }
            response.on_hover_text("Share of the deepest pixels. Default 15.0; double-click resets");
        }
        MaskSource::Cad => {
            let mut mm = new.choice.cad_distance_m * 1e3;
            let slider = egui::Slider::new(&mut mm, 0.0..=5.0).fixed_decimals(2).suffix(" mm");
            let response = ui.add(slider).accessible_name("CAD distance");
            if response.double_clicked() {
                mm = MaskChoice::default().cad_distance_m * 1e3;
            }
            new.choice.cad_distance_m = mm * 1e-3;
            response
                .on_hover_text("Largest distance to the CAD model at the true pose. Default 1.00; double-click resets");
        }
        MaskSource::Auto | MaskSource::Unet | MaskSource::Truth => {}
    }
    if let Err(absent) = cx.state.mask_recipe(finger) {
        ui.label(RichText::new(absent.text()).size(SMALL).color(cx.p.caution));
    }
    if new != *settings {
        cx.push(SettingsCommand::SetMask(new));
    }
    for finger in cx.state.rig().pads().filter(|f| cx.state.fingers().contains(f)) {
        let text = match cx.state.mask_in_force(ImprintSource::Measured, finger) {
            Ok(mask) => mask.label,
            Err(Lookup::Failed(err)) => err.why.clone(),
            Err(Lookup::Absent(absent)) => absent.text().to_owned(),
            Err(_) => "…".to_owned(),
        };
        let by_hand = cx.state.document.hand_mask(cx.state.pair_name(), finger).is_some();
        let color = if by_hand { cx.p.strong } else { cx.p.weak };
        let label = egui::Label::new(
            RichText::new(format!("{}: {text}", cx.state.finger_name(finger))).size(SMALL).color(color),
        );
        ui.add(label.truncate()).on_hover_text("The mask in force on the measured imprint of this finger");
    }
}

fn clean_ups(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.add_space(2.0);
    let finger = cx.state.selection.finger;
    ui.label(section(&format!("Correct, {} finger", cx.state.finger_name(finger)), cx.p));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        cx.action_button(ui, Action::AdoptAutomatic, "Take automatic");
        cx.action_button(ui, Action::FillHoles, "Fill holes");
        cx.action_button(ui, Action::LargestIsland, "Largest island");
        cx.action_button(ui, Action::ResetMask, "Remove");
    });
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let fingers = cx.state.fingers();
        let name = cx.state.pair_name();
        let undo = cx.state.history.next_undo(name, &fingers).map(|g| g.name);
        let redo = cx.state.history.next_redo(name, &fingers).map(|g| g.name);
        for (action, text, what) in [(Action::Undo, "Undo", undo), (Action::Redo, "Redo", redo)] {
            let response = cx.action_button(ui, action, text);
            if let Some(what) = what {
                response.on_hover_text(format!("{text} {what}"));
            }
        }
        save_state(cx, ui);
    });
}

/// `saved 12:03:11`, or what is not saved yet.
pub(super) fn save_state(cx: &Cx<'_>, ui: &mut Ui) {
    let (text, color) = if cx.state.document.stroke.is_some() {
        ("unsaved stroke".to_owned(), cx.p.caution)
    } else {
        let unsaved = cx.state.document.unsaved.contains(cx.state.pair_name());
        super::saved::text(&cx.shared.saved, unsaved, cx.p)
    };
    if !text.is_empty() {
        ui.label(RichText::new(text).size(SMALL).color(color))
            .on_hover_text("Labels are written after every change, to a file beside the old one that then replaces it");
    }
}

fn review(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.add_space(2.0);
    ui.label(section("Review", cx.p));
    let current = cx.state.document.review(cx.state.pair_name());
    let editable = cx.state.document.is_editable(cx.state.pair_name());
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for review in Review::iter() {
            let on = review == current;
            let color = if on { review_color(cx.p, review) } else { cx.p.text };
            let text =
                RichText::new(review.name()).color(if on && review == Review::Skip { cx.p.strong } else { color });
            let button = ui.add_enabled(editable, egui::Button::selectable(on, text));
            let button = button.accessible_name(format!("Review: {}", review.name()));
            if button.on_hover_text("The review state of this pair").clicked() {
                cx.push(LabelsCommand::SetReview(review));
            }
        }
        cx.action_button(ui, Action::DoneAndNext, "Done, next");
    });
}

fn look(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.add_space(2.0);
    ui.label(section("Overlay", cx.p));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        let settings = &cx.state.settings;
        let mut visible = settings.mask_visible;
        if ui.checkbox(&mut visible, "mask").on_hover_text(cx.keys().help(Action::MaskVisible)).changed() {
            cx.push(SettingsCommand::SetMaskVisible(visible));
        }
        let mut outline = settings.mask_outline;
        if ui.checkbox(&mut outline, "outline").on_hover_text(cx.keys().help(Action::MaskOutline)).changed() {
            cx.push(SettingsCommand::SetMaskOutline(outline));
        }
        let mut footprint = settings.footprint_visible;
        if ui.checkbox(&mut footprint, "GelSlim window").on_hover_text(cx.keys().help(Action::Footprint)).changed() {
            cx.push(SettingsCommand::SetFootprintVisible(footprint));
        }
    });
    ui.horizontal(|ui| {
        let mut opacity = cx.state.settings.mask_opacity;
        ui.spacing_mut().slider_width = (ui.available_width() - 76.0).max(40.0);
        let response =
            ui.add(egui::Slider::new(&mut opacity, 0.0..=1.0).fixed_decimals(2)).accessible_name("Mask opacity");
        if response.changed() {
            cx.push(SettingsCommand::SetMaskOpacity(opacity));
        }
        response.on_hover_text("How strongly the mask covers the image (- and =). Hold X to hide it");
    });
}
