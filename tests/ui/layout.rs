//! The arrangement of panes survives a restart, and a damaged one is replaced.

use touch2touch::app::command::{Pane, SettingsCommand, UiRequest, ViewCommand};
use touch2touch::app::settings::Workspace;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

#[test]
fn a_damaged_layout_is_replaced_and_reset_works() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    assert!(rig.harness.state().layout_is_valid());
    rig.send(SettingsCommand::SetLayout(Workspace::Inspect, "{\"not\": \"a layout\"}".into()));
    rig.restart(SIZE);
    assert!(rig.harness.state().layout_is_valid());
    assert!(rig.state().selection.panes.contains(&Pane::Measured));
    rig.send(ViewCommand::Ui(UiRequest::ResetWorkspace));
    let stored = rig.state().settings.layouts.get("Inspect").cloned();
    assert!(stored.is_some_and(|s| s.contains("touch2touch-layout")));
    // What was stored is taken again.
    rig.restart(SIZE);
    assert!(rig.harness.state().layout_is_valid());
}
