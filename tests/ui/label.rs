//! The labeling desk by mouse and keys.

use eframe::egui::{Key, Modifiers};
use touch2touch::app::command::{LabelsCommand, LibraryCommand, SettingsCommand};
use touch2touch::app::labels::Review;
use touch2touch::app::settings::Workspace;
use touch2touch::io::export_unet::check_folder;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

impl Rig {
    /// What the last plan of an export says.
    fn plan(&self) -> Vec<String> {
        let state = self.harness.state().state();
        state.results.mask_plans.get(&state.mask_plan_key().unwrap()).unwrap().lines()
    }
}

#[test]
fn an_export_says_what_goes_where_before_it_writes() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    rig.send(SettingsCommand::DismissHint);
    rig.send(SettingsCommand::SetWorkspace(Workspace::Label));
    rig.send(LabelsCommand::AdoptAutomatic);
    rig.send(LibraryCommand::Step(1));
    rig.send(LabelsCommand::AdoptAutomatic);
    rig.send(LabelsCommand::SetReview(Review::Done));
    rig.send(LibraryCommand::Step(1));
    rig.send(LabelsCommand::SetReview(Review::Skip));
    rig.harness.key_press_modifiers(Modifiers::CTRL, Key::E);
    rig.harness.step();
    rig.settle();
    let said = rig.plan();
    assert_eq!(said[0], "1 masks");
    assert!(said.iter().any(|line| line.contains("1 pairs begun")) && said.iter().any(|line| line.contains("skip")));
    rig.shoot("export-masks");
    // What is marked beside the form is in the next plan.
    rig.send(LabelsCommand::SetReview(Review::Done));
    assert!(rig.plan().iter().any(|line| line.contains("without a mask drawn")), "{:?}", rig.plan());
    rig.clicks(&["done and in progress"]);
    assert_eq!(rig.plan()[0], "2 masks");
    let folder = rig.data.join("training");
    rig.clicks(&["Choose the folder of the export"]);
    rig.take_to(&folder);
    let written: usize = ["train", "val", "test"]
        .iter()
        .map(|part| std::fs::read_dir(folder.join(part).join("masks")).unwrap().count())
        .sum();
    assert_eq!(written, 2);
    assert!(check_folder(&folder).problems.is_empty());
    let state = rig.harness.state().state();
    assert_eq!(state.log.entries.back().unwrap().place.as_deref(), Some(&*folder), "the note leads there");
    assert!(!state.export.asking_masks);
}
