//! The way back from 3D views that show the GelSlim's window only.

use eframe::egui::{Button, Ui, vec2};

use crate::app::settings::prefer;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::caption;

/// Says that only the window is shown, with the way back.
pub(super) fn bar(cx: &mut Cx<'_>, ui: &mut Ui) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.add_space(4.0);
        ui.label(caption("GelSlim window only", cx.p));
        let button = ui.add(Button::new("×").frame(false).min_size(vec2(16.0, 16.0)));
        if button.accessible_name("Show all").on_hover_text("Show all").clicked() {
            cx.push(prefer(|s| s.scene.only_window = false));
        }
    });
}
