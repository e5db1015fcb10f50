//! Preferences.

use crate::app::settings::prefer;
use eframe::egui::{self, RichText, ScrollArea, Ui};
use strum::IntoEnumIterator as _;

use crate::app::action::Action;
use crate::app::command::Pane;
use crate::app::settings::{ColorMap, MAX_CACHE_MIB};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{caption, section};
use crate::ui::parts::widget::choice::choose;
use crate::ui::parts::widget::scroll_to_focus;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::labels::system_person;

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    ScrollArea::vertical().id_salt("settings").show(ui, |ui| {
        body(cx, ui);
        scroll_to_focus(ui);
    });
}

/// Who labels.
pub(crate) fn person(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("Your name").color(cx.p.weak));
        let mut name = cx.state.settings.person.clone();
        let hint = system_person().unwrap_or_default();
        let edit = egui::TextEdit::singleline(&mut name).hint_text(hint).desired_width(f32::INFINITY);
        let edit = ui.add(edit).accessible_name("Your name");
        if edit.on_hover_text("Recorded with every mask and every change of a label").changed() {
            cx.push(prefer(move |s| s.person = name.clone()));
        }
    });
}

fn body(cx: &mut Cx<'_>, ui: &mut Ui) {
    let settings = &cx.state.settings;
    ui.label(section("Window", cx.p));
    ui.horizontal(|ui| {
        let mut zoom = settings.ui_zoom;
        let drag = egui::DragValue::new(&mut zoom).speed(0.01).range(0.5..=4.0).fixed_decimals(2).prefix("zoom ");
        // The whole window is scaled: while the number is dragged the pointer must not slip off it.
        let response = ui.add(drag.update_while_editing(false)).accessible_name("Zoom");
        if response.changed() {
            cx.out.push(prefer(move |s| s.ui_zoom = zoom).into());
        }
        response.on_hover_text("Scale of the whole window (Ctrl + and Ctrl -). Default 1.00");
    });
    ui.label(section("Images", cx.p));
    ui.horizontal(|ui| {
        for map in ColorMap::iter() {
            let radio = ui.radio(settings.color_map == map, map.name());
            if radio.on_hover_text("Colors of depth").clicked() {
                cx.out.push(prefer(move |s| s.color_map = map).into());
            }
        }
    });
    ui.label(section("Models", cx.p));
    ui.horizontal(|ui| {
        ui.label(RichText::new("Engine").color(cx.p.weak));
        let combo = egui::ComboBox::from_id_salt("runtime").selected_text(settings.runtime.name());
        let (name, said) = (("Engine", "What runs the models: processor or GPU"), |e: &EngineChoice| (e.name(), ""));
        if let Some(runtime) = choose(ui, combo, name, Some(&settings.runtime), EngineChoice::possible(), said) {
            cx.push(prefer(move |s| s.runtime = runtime));
        }
    });
    ui.horizontal(|ui| {
        ui.label(RichText::new("Keep predictions").color(cx.p.weak));
        let mut mib = settings.cache_mib;
        let drag = egui::DragValue::new(&mut mib).speed(8.0).range(0..=MAX_CACHE_MIB).suffix(" MiB");
        let response = ui.add(drag.update_while_editing(false)).accessible_name("Keep predictions");
        if response.changed() {
            cx.out.push(prefer(move |s| s.cache_mib = mib).into());
        }
        response.on_hover_text(
            "Disk space for earlier predictions; the least recently used go first, 0 keeps none. Default 512 MiB",
        );
    });
    ui.label(section("Labels", cx.p));
    person(cx, ui);
    if let Ok(device) = cx.device {
        ui.label(caption(format!("Graphics: {}", device.gpu.adapter), cx.p));
    }
    ui.add_space(4.0);
    cx.action_button(ui, Action::ResetWorkspace, "Reset workspace");
    cx.action_button(ui, Action::ResetSettings, "Reset preferences");
}
