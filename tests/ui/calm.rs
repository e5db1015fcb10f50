//! A control costs everyone who does not need it: each workspace shows few of them, and what they had is still there.

use egui_kittest::kittest::Queryable as _;
use strum::IntoEnumIterator as _;
use touch2touch::app::command::{LabelsCommand, LibraryCommand, Pane, ViewCommand};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::library::Place;
use touch2touch::app::settings::{MaskSource, MaskTool, Workspace, prefer};
use touch2touch_core::rig::lab;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

/// Pictures have no depth camera: the 3D pane leaves its room to them, and a data set with one has it back.
#[test]
fn a_pane_that_has_nothing_to_show_leaves_its_room() {
    let folder = tempfile::tempdir().unwrap();
    let pairs = folder.path().join("pairs");
    crate::recovery::pictures(&pairs);
    let Some(mut rig) = Rig::live(SIZE, Place::Path(pairs)) else { return };
    let wide = |rig: &Rig| rig.harness.state().places()[&Pane::Compare].width();
    assert!(!rig.state().selection.panes.contains(&Pane::Scene));
    let alone = wide(&rig);
    let layout = rig.state().settings.layouts.clone();
    rig.send(LibraryCommand::Open(Place::Demo));
    assert!(rig.state().selection.panes.contains(&Pane::Scene));
    assert!(wide(&rig) < 0.7 * alone, "{} of {alone}", wide(&rig));
    assert_eq!(rig.state().settings.layouts, layout, "what a person arranged is not touched");
}

/// Nothing below the tools moves when one is chosen, a mask is changed or a proposal is shown.
#[test]
fn nothing_in_the_mask_pane_moves_under_the_pointer() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
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
    assert!(rig.harness.query_all_by_label_contains("Angle ").next().is_some(), "the effect of the stroke is said");
    assert_eq!(place(&rig), before, "after a stroke");
    for source in [MaskSource::Threshold, MaskSource::TopPercent, MaskSource::Cad] {
        rig.send(prefer(move |s| s.mask.choice.source = source));
        rig.send(ViewCommand::Propose(true));
        assert_eq!(place(&rig), before, "{source:?}");
        rig.send(ViewCommand::Propose(false));
    }
}
