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
use touch2touch_pipeline::still::WIDTH_PX;
use touch2touch_pipeline::still::space::Ground;

/// Frames of a turntable: six seconds of a film.
const FRAMES: u32 = 180;

/// Pictures of a 3D view from where it looks now; the verb makes them in any size.
fn stills(cx: &mut Cx<'_>, ui: &mut Ui) {
    let angles = cx.shared.angles[cx.state.workbench.side as usize];
    let pane = cx.state.settings.scene_sides();
    let asked = StillAsked { pane, width_px: 2 * WIDTH_PX, ground: Ground::White, angles, turntable: None };
    for (asked, text) in [
        (asked, "Save 3D picture…"),
        (StillAsked { ground: Ground::Transparent, ..asked }, "Save 3D picture without ground…"),
        (StillAsked { turntable: Some(FRAMES), ..asked }, "Save a turn around the pair…"),
    ] {
        let frames = asked.turntable.map_or("as PNG".to_owned(), |frames| format!("as {frames} PNG files"));
        let tip = format!("{frames}, {0} x {0} pixels; the verb `still` has other sizes", asked.width_px);
        let button = ui.add_enabled(export::can_draw(cx.state), egui::Button::new(text));
        if button.on_hover_text(tip).clicked() {
            cx.push(ExportCommand::Place(Output::Still(asked)));
            ui.close();
        }
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
            cx.push(ViewCommand::Ui(UiRequest::PanePicture { pane: Some(pane), copied }));
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
