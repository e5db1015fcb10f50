//! Nothing to see is an error, and pictures for people.

use touch2touch::app::command::Command;
use touch2touch::app::settings::{Theme, Workspace};

use super::rig::Rig;

/// Every workspace draws something in both themes and sizes.
#[test]
fn every_workspace_draws_in_both_themes() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 3) else { return };
    rig.send(Command::DismissHint);
    rig.send(Command::Generate);
    for theme in [Theme::Dark, Theme::Light] {
        rig.send(Command::SetTheme(theme));
        for workspace in [Workspace::Inspect, Workspace::Align, Workspace::Label, Workspace::Evaluate] {
            rig.send(Command::SetWorkspace(workspace));
            rig.shoot(&format!("test-{}-{theme:?}", workspace.name()).to_lowercase());
            let image = rig.harness.render().unwrap();
            let mut colors: Vec<[u8; 4]> = image.pixels().map(|p| p.0).collect();
            colors.sort_unstable();
            colors.dedup();
            assert!(colors.len() > 500, "{workspace:?} {theme:?}: {} colours", colors.len());
        }
    }
}
