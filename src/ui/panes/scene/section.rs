//! The plane that cuts 3D views open: its axis, its place, its side.

use crate::app::settings::prefer;
use eframe::egui::{Button, RichText, Slider, Ui, vec2};
use strum::IntoEnumIterator as _;

use crate::app::command::Command;
use crate::app::state::State;
use crate::app::workbench::{SECTION_REACH_M, Section, SectionAxis, WorkbenchCommand};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{SMALL, caption};
use touch2touch_core::units;

/// True where a plane cuts the views, or only the window is shown.
pub(super) fn is_shown(state: &State) -> bool {
    state.workbench.section.is_some() || state.settings.scene.only_window
}

/// The plane that cuts all views, and the way back.
pub(super) fn bar(cx: &mut Cx<'_>, ui: &mut Ui) {
    let only_window = cx.state.settings.scene.only_window;
    let section = cx.state.workbench.section;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.add_space(4.0);
        if let Some(section) = section {
            let mut new = section;
            ui.label(caption("Cut at", cx.p));
            for axis in SectionAxis::iter() {
                let name = &axis.name()[..1];
                let button = Button::selectable(axis == section.axis, RichText::new(name).size(SMALL));
                let button = ui.add(button).accessible_name(format!("Cut across {}", axis.name()));
                if button.on_hover_text(axis.name()).clicked() {
                    new = Section { axis, at_m: 0.0, ..section };
                }
            }
            // What stands behind the slider in the same row.
            let others = if only_window { 350.0 } else { 200.0 };
            let reach = units::mm(SECTION_REACH_M);
            let mut place_mm = units::mm(section.at_m);
            ui.spacing_mut().slider_width = (ui.available_width() - others).clamp(24.0, 220.0);
            let slider = ui.add(Slider::new(&mut place_mm, -reach..=reach).fixed_decimals(1).suffix(" mm"));
            let slider = slider.accessible_name("Place of the cut");
            // A notch of the wheel over the slider is half a millimeter.
            let notches = if slider.hovered() { ui.input(|i| i.smooth_scroll_delta().y / 40.0) } else { 0.0 };
            if slider.changed() || notches != 0.0 {
                new.at_m = (place_mm + 0.5 * f64::from(notches)) * 1e-3;
            }
            if ui.add(Button::new(RichText::new("Other side").size(SMALL))).clicked() {
                new.flipped = !new.flipped;
            }
            if new != section {
                cx.push(Command::Workbench(WorkbenchCommand::SetSection(Some(new))));
            }
            close(cx, ui, "Cut no longer", WorkbenchCommand::SetSection(None).into());
        }
        if only_window {
            ui.label(caption("GelSlim's window only", cx.p));
            close(cx, ui, "Show all", prefer(|s| s.scene.only_window = false).into());
        }
    });
}

fn close(cx: &mut Cx<'_>, ui: &mut Ui, name: &str, command: Command) {
    let button = ui.add(Button::new("×").frame(false).min_size(vec2(16.0, 16.0)));
    if button.accessible_name(name).on_hover_text(name).clicked() {
        cx.push(command);
    }
}
