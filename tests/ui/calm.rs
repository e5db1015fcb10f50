//! A control costs everyone who does not need it: each workspace shows few of them, and what they had is still there.

use eframe::egui::accesskit::Role;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use strum::IntoEnumIterator as _;
use touch2touch::app::command::{LabelsCommand, LibraryCommand, Pane, PredictCommand, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::library::Place;
use touch2touch::app::settings::{MaskSource, MaskTool, SpacePane, Workspace, prefer};
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::lab;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

/// True of a role that a pointer can press, drag or type into.
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

/// Names of the controls that can be seen. The rows of the list of pairs and the starts of a registration are data: a longer
/// list is not more to learn.
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
    seen.map(name).filter(|name| !is_pair(name) && !name.starts_with("Button Start ")).collect()
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

/// Pictures have no depth camera: the 3D pane leaves its room to them, and a data set with one has it back.
#[test]
fn a_pane_that_has_nothing_to_show_leaves_its_room() {
    let folder = tempfile::tempdir().unwrap();
    let pairs = folder.path().join("pairs");
    crate::recovery::pictures(&pairs);
    let Some(mut rig) = Rig::live(SIZE, Place::Path(pairs)) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    let wide = |rig: &Rig| rig.harness.state().places()[&Pane::Compare].width();
    assert!(!rig.harness.state().state().selection.panes.contains(&Pane::Scene));
    let alone = wide(&rig);
    let layout = rig.harness.state().state().settings.layouts.clone();
    rig.send(LibraryCommand::Open(Place::Demo));
    assert!(rig.harness.state().state().selection.panes.contains(&Pane::Scene));
    assert!(wide(&rig) < 0.7 * alone, "{} of {alone}", wide(&rig));
    assert_eq!(rig.harness.state().state().settings.layouts, layout, "what a person arranged is not touched");
}

/// A side with nothing to show leaves its room to the other, and the choice is kept for each workspace.
#[test]
fn the_3d_pane_has_measured_predicted_or_both() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    let views = |rig: &Rig| {
        ["measured", "predicted"]
            .map(|side| rig.harness.query_by_label(&format!("3D view, {side}")).map(|node| node.rect().width()))
    };
    let [Some(alone), None] = views(&rig) else { panic!("{:?}", views(&rig)) };
    rig.send(PredictCommand::Generate);
    let [Some(measured), Some(predicted)] = views(&rig) else { panic!("{:?}", views(&rig)) };
    assert!(measured < 0.6 * alone && (measured - predicted).abs() < 2.0, "{alone} {measured} {predicted}");
    rig.harness.get_by_label("3D: predicted").click();
    rig.harness.step();
    rig.settle();
    assert!(matches!(views(&rig), [None, Some(_)]), "{:?}", views(&rig));
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    assert!(matches!(views(&rig), [Some(_), Some(_)]), "{:?}", views(&rig));
    rig.send(prefer(|s| s.workspace = Workspace::Inspect));
    rig.restart(SIZE);
    assert_eq!(rig.harness.state().state().settings.scene_sides(), SpacePane::Predicted);
}

/// Nothing below the tools moves when one is chosen, a mask is changed or a proposal is shown.
#[test]
fn nothing_in_the_mask_pane_moves_under_the_pointer() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    rig.send(prefer(|s| s.hint_dismissed = true));
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    let place = |rig: &Rig| ["Done and next", "Mask source", "Note"].map(|name| rig.harness.get_by_label(name).rect());
    let before = place(&rig);
    for tool in MaskTool::iter() {
        rig.send(prefer(move |s| s.mask.tool = tool));
        assert_eq!(place(&rig), before, "{tool:?}");
    }
    rig.send(prefer(|s| s.mask.tool = MaskTool::Brush));
    let (finger, source) = (lab::RIGHT, ImprintSource::Measured);
    rig.send(LabelsCommand::BeginStroke { finger, source, at_px: [60.0, 40.0], erase: false });
    rig.send(LabelsCommand::StrokeTo([100.0, 60.0]));
    rig.send(LabelsCommand::EndStroke);
    assert!(rig.harness.query_all_by_label_contains("angle ").next().is_some(), "the effect of the stroke is said");
    assert_eq!(place(&rig), before, "after a stroke");
    for source in [MaskSource::Threshold, MaskSource::TopPercent, MaskSource::Cad] {
        rig.send(prefer(move |s| s.mask.choice.source = source));
        rig.send(ViewCommand::Propose(true));
        assert_eq!(place(&rig), before, "{source:?}");
        rig.send(ViewCommand::Propose(false));
    }
}
