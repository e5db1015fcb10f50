//! The mouse controls of panes.

use crate::app::action::with_keys;
use eframe::egui::{self, RichText, Ui};

use crate::ui::parts::theme::{Palette, SMALL, caption};

/// Mouse controls of every image pane.
pub(crate) const IMAGE: &[(&str, &str)] = &[
    ("Wheel", "zoom at the pointer"),
    ("Drag, middle drag or Space + drag", "move all linked images"),
    ("Double-click or [[fit]]", "fit"),
    ("Hover", "cross-hair in every image and point in 3D"),
];

/// Controls of the comparison of any two imprints.
pub(crate) const COMPARE: &[(&str, &str)] = &[
    ("Click on A or B", "choose what to compare"),
    ("Hold F", "show B instead of A"),
    ("Hover", "both values and their difference, in the status bar"),
    ("Wheel, drag, double-click", "zoom, move, fit"),
];

/// Mouse controls of an image that can be painted on.
pub(crate) const PAINT: &[(&str, &str)] = &[
    ("Drag", "paint with the tool in hand"),
    ("Ctrl + drag or right drag", "erase"),
    ("[[brush_smaller]] and [[brush_larger]], or Shift + wheel", "brush size"),
    ("Wheel", "zoom at the pointer"),
    ("Middle drag or Space + drag", "move all linked images"),
    ("[[fit]]", "fit"),
];

/// Mouse controls of the 3D panes.
pub(crate) const SCENE: &[(&str, &str)] = &[
    ("Left drag", "orbit"),
    ("Right or middle drag", "move"),
    ("Wheel", "zoom at the pointer"),
    ("Double-click", "center the point; beside all points, or [[fit]]: fit"),
    ("[[camera_left]], [[camera_right]], [[camera_front]], [[camera_top]]", "from left, right, front, top"),
    ("Hover", "cross-hair in the images"),
    ("Click a point", "read it"),
    ("[[pose_tool]]", "pose tool: keys or handles; [[accept]] accepts, [[cancel_jobs]] reverts"),
    ("Arrow keys with the pose tool", "move by 0.1 mm; Alt turns by 0.5°; Shift ×10, Ctrl ÷10"),
    ("[[distances]]", "distance to the CAD in mm"),
    ("[[parallel]]", "parallel projection"),
    ("Click on the colored dots", "legend: show or hide"),
];

/// Controls of the steps of a registration.
pub(crate) const STEPS: &[(&str, &str)] = &[
    ("Drag in the curves", "go through the steps"),
    ("Click on a curve", "show that start and step"),
    ("[[step_back]] and [[step_forward]]", "previous and next step"),
    ("[[play_steps]]", "play or pause, also over a 3D view"),
];

/// The list of `controls`, with their keys.
pub fn list(ui: &mut Ui, pane: &str, controls: &[(&str, &str)]) {
    egui::Grid::new(("help", pane)).num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
        for (control, effect) in controls {
            ui.label(caption(with_keys(control), Palette::of(ui)));
            ui.label(RichText::new(with_keys(effect)).size(SMALL));
            ui.end_row();
        }
    });
}
