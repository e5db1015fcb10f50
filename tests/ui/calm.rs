//! A control costs everyone who does not need it: each workspace shows few of them, and what they had is still there.

use eframe::egui::accesskit::Role;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use touch2touch::app::command::{LibraryCommand, PredictCommand};
use touch2touch::app::library::Place;
use touch2touch::app::settings::{Workspace, prefer};
use touch2touch_core::dataset::PairId;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

/// What a pointer can press, drag or type into.
fn is_control(role: Role) -> bool {
    matches!(
        role,
        Role::Button
            | Role::CheckBox
            | Role::RadioButton
            | Role::ComboBox
            | Role::Slider
            | Role::SpinButton
            | Role::TextInput
            | Role::MultilineTextInput
            | Role::Link
            | Role::ColorWell
    )
}

/// Names of the controls that can be seen. The rows of the list of pairs are data: a longer list is not more to learn.
fn controls(rig: &Rig) -> Vec<String> {
    let pairs = rig.harness.state().state().library.pairs();
    let is_pair = |name: &str| pairs.iter().any(|pair| name.contains(&format!("{}, ", pair.name)));
    let nodes = rig.harness.get_all_by(|node| is_control(node.role()));
    let seen = nodes.filter(|node| {
        let rect = node.accesskit_node().bounding_box().map(|_| node.rect());
        let window = eframe::egui::Rect::from_min_size(eframe::egui::Pos2::ZERO, SIZE.into());
        rect.is_some_and(|rect| rect.is_positive() && window.intersects(rect))
    });
    let name = |node: egui_kittest::Node<'_>| {
        let node = node.accesskit_node();
        format!("{:?} {}", node.role(), node.label().or_else(|| node.value()).unwrap_or_default())
    };
    seen.map(name).filter(|name| !is_pair(name)).collect()
}

#[test]
fn each_workspace_shows_few_controls() {
    let Some(mut rig) = Rig::live(SIZE, Place::Demo) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(LibraryCommand::Select(PairId(6)));
    rig.send(PredictCommand::Generate);
    let most = [(Workspace::Inspect, 75), (Workspace::Align, 65), (Workspace::Label, 65), (Workspace::Evaluate, 50)];
    let mut crowded = Vec::new();
    for (workspace, most) in most {
        rig.send(prefer(move |s| s.workspace = workspace));
        let shown = controls(&rig);
        println!("{workspace:?}: {} controls\n  {}", shown.len(), shown.join("\n  "));
        if shown.len() > most {
            crowded.push(format!("{workspace:?} {} of {most}", shown.len()));
        }
    }
    assert!(crowded.is_empty(), "too many controls: {crowded:?}");
}
