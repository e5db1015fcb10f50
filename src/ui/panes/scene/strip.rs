//! The strip beside the 3D views: views, what is shown, tools.

use eframe::egui::{self, Popup, PopupCloseBehavior, Rect, Ui, UiBuilder, vec2};
use strum::IntoEnumIterator as _;

use crate::app::action::Action;
use crate::app::command::{Command, Pane};
use crate::app::workbench::{Layer, SceneTool, WorkbenchCommand};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::caption;
use crate::ui::parts::widget::icon::{self, Icon};

/// Width of the strip, points.
pub(super) const WIDTH: f32 = 34.0;

/// Ways to look at a scene, in the menu of views.
const VIEWS: [Action; 6] = [
    Action::Fit,
    Action::CameraLeft,
    Action::CameraRight,
    Action::CameraFront,
    Action::CameraTop,
    Action::CameraOblique,
];

/// The strip; what does not fit is left to menu, palette and keys.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, column: Rect) {
    ui.painter().rect_filled(column, 0.0, cx.p.panel);
    let builder = UiBuilder::new().max_rect(column.shrink2(vec2(2.0, 4.0))).id_salt("strip");
    ui.scope_builder(builder, |ui| {
        ui.set_clip_rect(column.intersect(ui.clip_rect()));
        // In a low pane the buttons are lower, so that all are there.
        const BUTTONS: f32 = 6.0;
        ui.spacing_mut().item_spacing.y = 2.0;
        ui.spacing_mut().interact_size.y = ((column.height() - 18.0) / BUTTONS - 2.0).clamp(18.0, icon::SIZE.y);
        views(cx, ui);
        line(cx, ui);
        let (tool, layer) = (cx.state.workbench.tool, cx.state.workbench.layer);
        switch(cx, ui, Icon::Distance, Action::Distances, layer == Layer::Distance);
        shown(cx, ui);
        line(cx, ui);
        switch(cx, ui, Icon::Hand, Action::PoseTool, tool == SceneTool::Pose);
        if cx.state.selection.panes.contains(&Pane::Masks) {
            switch(cx, ui, Icon::BrushIn3d, Action::PaintIn3d, tool == SceneTool::Paint);
        }
    });
}

fn line(cx: &Cx<'_>, ui: &mut Ui) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 5.0), egui::Sense::hover());
    ui.painter().hline(rect.x_range().shrink(3.0), rect.center().y, (1.0, cx.p.line));
}

/// A button of the strip, as high as there is room.
fn sign(ui: &mut Ui, button: icon::Button<'_>) -> egui::Response {
    let high = ui.spacing().interact_size.y;
    button.show(ui, vec2(icon::SIZE.x, high))
}

fn switch(cx: &mut Cx<'_>, ui: &mut Ui, icon: Icon, action: Action, on: bool) {
    let key = action.key_text();
    let enabled = action.command(cx.state).is_some();
    let button = sign(ui, icon::Button { icon, key: &key, name: action.name(), enabled, on });
    let help = format!("{}. {}", action.name(), action.help());
    if button.on_hover_text(help).clicked() {
        cx.act(action);
    }
}

/// Menu of the places to look from.
fn views(cx: &mut Cx<'_>, ui: &mut Ui) {
    let button = sign(ui, icon::Button { icon: Icon::Views, key: "", name: "Views", enabled: true, on: false });
    let button = button.on_hover_text("Camera views, fit, perspective or parallel");
    Popup::menu(&button).show(|ui| {
        ui.set_min_width(190.0);
        for action in VIEWS {
            cx.menu_row(ui, action, false);
        }
        ui.separator();
        let settings = &cx.state.settings;
        cx.menu_row(ui, Action::Parallel, settings.scene.orthographic);
    });
}

/// Menu of the layers, and of what the contact points can be painted with.
fn shown(cx: &mut Cx<'_>, ui: &mut Ui) {
    let painted = cx.state.workbench.layer;
    let on = !matches!(painted, Layer::None | Layer::Distance);
    let button = sign(ui, icon::Button { icon: Icon::Layers, key: "", name: "What is shown", enabled: true, on });
    let button = button.on_hover_text("Coloring of the contact points, and what else is drawn");
    Popup::menu(&button).close_behavior(PopupCloseBehavior::CloseOnClickOutside).show(|ui| {
        ui.set_min_width(210.0);
        ui.label(caption("Color the contact points by", cx.p));
        for layer in Layer::iter() {
            if ui.radio(layer == painted, layer.name()).on_hover_text(layer.tooltip()).clicked() {
                cx.push(Command::Workbench(WorkbenchCommand::SetLayer(layer)));
            }
        }
        ui.separator();
        cx.menu_row(ui, Action::BothClouds, cx.state.workbench.both_clouds);
    });
}
