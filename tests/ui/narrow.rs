//! A window of 900 x 600 points: nothing stands beyond its pane, in any workspace and any pane.

use std::collections::BTreeMap;
use touch2touch::app::settings::prefer;

use eframe::egui::accesskit::Role;
use eframe::egui::{Rect, pos2, vec2};
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use strum::IntoEnumIterator as _;
use touch2touch::app::command::{Command, Pane, PredictCommand, UiRequest, ViewCommand};
use touch2touch::app::settings::Workspace;

use super::rig::Rig;

const SIZE: [f32; 2] = [900.0, 600.0];
/// What a frame around a control may add, points.
const FRAME: f32 = 2.0;

/// What is read or pressed, and must be there whole.
fn counts(role: Role) -> bool {
    matches!(
        role,
        Role::Button | Role::CheckBox | Role::RadioButton | Role::ComboBox | Role::TextInput | Role::SpinButton
    ) || matches!(role, Role::Slider | Role::Label | Role::Link)
}

/// What stands beyond the window or its pane, in words.
fn beyond(rig: &Rig) -> Vec<String> {
    let places: BTreeMap<Pane, Rect> = rig.harness.state().places();
    let shown = &rig.state().selection.panes;
    let panes: Vec<(Pane, Rect)> = places.into_iter().filter(|(pane, _)| shown.contains(pane)).collect();
    let mut found = Vec::new();
    let nodes = rig.harness.get_all_by(|_| true);
    let mut seen = 0;
    for node in nodes {
        let role = node.accesskit_node().role();
        if !counts(role) || node.accesskit_node().bounding_box().is_none() || !node.rect().is_positive() {
            continue;
        }
        let rect = node.rect();
        seen += 1;
        let name = node.accesskit_node().label().or_else(|| node.accesskit_node().value()).unwrap_or_default();
        // What is scrolled out of sight lies above or below its pane.
        let home = panes.iter().find(|(_, place)| place.contains(rect.center()));
        let (of, place) = match home {
            Some((pane, place)) => (pane.title(), *place),
            None => ("the window", Rect::from_min_size(pos2(0.0, 0.0), vec2(SIZE[0], SIZE[1]))),
        };
        // Tabs that find no room are reached by the arrow of their bar.
        if role == Role::Button && Pane::iter().any(|pane| name == pane.tab() || name == pane.title()) {
            continue;
        }
        if rect.left() < place.left() - FRAME || rect.right() > place.right() + FRAME {
            found.push(format!("{role:?} {name:?} at {rect:?} of {of}, {place:?}"));
        }
    }
    assert!(seen > 20, "{seen}");
    found
}

#[test]
fn no_control_is_cut_off_in_a_window_of_900_by_600() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(PredictCommand::Generate);
    let mut found = Vec::new();
    for workspace in Workspace::iter() {
        rig.send(prefer(move |s| s.workspace = workspace));
        for pane in Pane::of(workspace) {
            rig.send(Command::View(ViewCommand::Ui(UiRequest::ShowPane(pane))));
            rig.send(prefer(move |s| s.workspace = workspace));
            assert!(rig.state().selection.panes.contains(&pane), "{workspace:?} {pane:?}");
            let cut = beyond(&rig);
            found.extend(cut.into_iter().map(|cut| format!("{workspace:?}, {pane:?}: {cut}")));
        }
    }
    found.sort();
    found.dedup_by_key(|line| line.split_once(": ").map(|(_, what)| what.to_owned()));
    assert!(found.is_empty(), "{} cut off:\n{}", found.len(), found.join("\n"));
}
