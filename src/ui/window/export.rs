//! Taking things away: the menu in each pane's title.

pub(crate) mod import;
pub(crate) mod masks;

use eframe::egui::{self, Ui};

use crate::app::action::Action;
use crate::app::command::{ExportCommand, Pane, UiRequest, ViewCommand};
use crate::app::export;
use crate::app::export::{Output, StillAsked};
use crate::app::keys::ImprintSource;
use crate::app::pane::Kind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::caption;
use touch2touch_pipeline::still::WIDTH_PX;
use touch2touch_pipeline::still::space::Ground;

/// Frames of a turntable: six seconds of a film.
const FRAMES: u32 = 180;

/// Pictures of a 3D view, by ground and size, from where the view looks now.
fn stills(cx: &mut Cx<'_>, ui: &mut Ui) {
    let pane = cx.state.settings.scene_sides();
    ui.label(caption("3D picture", cx.p));
    let angles = cx.shared.angles[cx.state.workbench.side as usize];
    for (ground, name, on) in [
        (Ground::White, "white", "on white"),
        (Ground::Black, "black", "on black"),
        (Ground::Transparent, "no ground", "without ground"),
    ] {
        ui.horizontal(|ui| {
            let asked = StillAsked { pane, width_px: WIDTH_PX, ground, angles, turntable: None };
            let sizes = [(WIDTH_PX, "1x"), (2 * WIDTH_PX, "2x"), (4 * WIDTH_PX, "4x"), (8192, "8k")];
            let sizes = sizes.map(|(width_px, text)| (StillAsked { width_px, ..asked }, text));
            for (asked, text) in sizes.into_iter().chain([(StillAsked { turntable: Some(FRAMES), ..asked }, "film")]) {
                let button = ui.add_enabled(export::can_draw(cx.state), egui::Button::new(text));
                let button = button.accessible_name(format!("Save 3D picture {text} {on}"));
                let size = format!("{} x {} pixels {on}", asked.width_px, asked.width_px);
                let tip = match asked.turntable {
                    None => format!("Save as PNG, {size}, from this viewpoint"),
                    Some(frames) => {
                        format!("Save one turn around the pair as {frames} PNG files, {size}")
                    }
                };
                if button.on_hover_text(tip).clicked() {
                    cx.push(ExportCommand::Place(Output::Still(asked)));
                    ui.close();
                }
            }
            ui.label(caption(name, cx.p));
        });
    }
}

/// Menu of the files that a pane offers.
pub(crate) fn menu(cx: &mut Cx<'_>, ui: &mut Ui, pane: Pane) {
    if pane.kind() == Kind::Scene {
        stills(cx, ui);
        ui.separator();
    }
    let sides: &[Action] = match pane.side() {
        Some(ImprintSource::Measured) => &[Action::ExportMeasured],
        Some(ImprintSource::Predicted) => &[Action::ExportPredicted],
        None if pane.is_of_pair() => &[Action::ExportMeasured, Action::ExportPredicted],
        None => &[],
    };
    let table: &[Action] = if pane == Pane::Results { &[Action::ExportTable] } else { &[] };
    for action in sides.iter().chain(table).copied() {
        if cx.menu_row(ui, action, false).clicked() {
            ui.close();
        }
    }
    ui.separator();
    for (copied, text, tip) in [
        (false, "Save as picture", Action::SavePane.behind("Saves this pane as PNG")),
        (true, "Copy as picture", Action::CopyPane.behind("Copies this pane as a picture")),
    ] {
        if ui.button(text).on_hover_text(tip).clicked() {
            cx.push(ViewCommand::Ui(UiRequest::PictureOf { pane, copied }));
            ui.close();
        }
    }
    if let Some(command) = export::equivalent(cx.state, pane) {
        let copy = ui.button("Copy as command line");
        let tip = format!("Command line for this:\n{command}");
        if copy.on_hover_text(tip).clicked() {
            ui.copy_text(command);
            ui.close();
        }
    }
}
