//! What is taken away, each in few clicks.

use std::path::Path;

use eframe::egui::{Key, Modifiers, OutputCommand};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{LabelsCommand, Pane, PredictCommand};
use touch2touch::app::export;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

impl Rig {
    /// Clicks widgets one after the other; how many that were.
    pub(super) fn clicks(&mut self, labels: &[&str]) -> usize {
        for label in labels {
            self.click(label);
        }
        labels.len()
    }

    /// Types a path and Enter: two actions.
    pub(super) fn take_to(&mut self, path: &Path) -> usize {
        self.harness.get_by_label("Path").type_text(path.to_str().unwrap());
        self.harness.step();
        self.key(Modifiers::NONE, Key::Enter);
        2
    }

    fn predicted(&mut self) {
        self.send(PredictCommand::Generate);
    }

    /// What went to the clipboard in the last frame.
    fn copied(&self) -> Option<String> {
        self.harness.output().platform_output.commands.iter().find_map(|command| match command {
            OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        })
    }
}

#[test]
fn cloud_pose_and_mesh_are_exported_and_the_command_is_copied_from_the_menu_of_a_scene() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.predicted();
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    let folder = rig.data.join("taken");
    rig.clicks(&["Menu of 3D"]);
    rig.clicks(&["Export the measured pair…"]);
    rig.take_to(&folder);
    // The note says where.
    rig.harness.get_all_by_label("Open folder").next().expect("the note leads to its folder");
    assert!(rig.state().log.entries.back().unwrap().place.as_ref().unwrap().starts_with(&folder));
    let mut names: Vec<String> =
        std::fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names.len(), 3, "{names:?}");
    assert!(names.iter().zip(["cloud.ply", "mesh.stl", "pose.json"]).all(|(name, end)| name.ends_with(end)));
    rig.clicks(&["Menu of 3D"]);
    rig.harness.get_by_label("Copy as command line").click();
    rig.harness.step();
    let copied = rig.copied().expect("the command is on the clipboard");
    let state = rig.state();
    assert_eq!(Some(&copied), export::equivalent(state, Pane::Scene).as_ref());
    assert!(copied.starts_with("touch2touch export ") && copied.contains("--imprint measured"), "{copied}");
    rig.settle();
    // What a mask is made of is said, also of one drawn by hand.
    rig.send(LabelsCommand::AdoptAutomatic);
    let exported = export::pair_export(rig.state(), Default::default()).unwrap();
    let files = exported.write(&folder).unwrap();
    let text = std::fs::read_to_string(files.iter().find(|f| f.ends_with(&names[2])).unwrap()).unwrap();
    assert!(text.contains("\"mask\": \"hand"), "{text}");
}
