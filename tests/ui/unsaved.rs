//! Closing the window over labels that are not on the disk.

use std::time::Duration;
use touch2touch::app::settings::prefer;

use eframe::egui::{Event, ViewportCommand, ViewportEvent, ViewportId};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::labels::{Question, Review};
use touch2touch::app::library::Place;
use touch2touch::app::services::Services;
use touch2touch::app::settings::Workspace;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::{FOLDER, MaskStore};
use touch2touch_pipeline::labels::{Labels, recover};

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

impl Rig {
    /// Flags the pair by hand.
    fn flag(&mut self) {
        for label in ["Review state", "flagged"] {
            self.click(label);
        }
    }

    /// Asks the window to close as the system does, and goes on; what the studio answered the system.
    fn ask_to_close(&mut self) -> Vec<ViewportCommand> {
        let root = self.harness.input_mut().viewports.entry(ViewportId::ROOT).or_default();
        root.events.push(ViewportEvent::Close);
        let mut answers = self.step_answering();
        self.harness.input_mut().viewports.entry(ViewportId::ROOT).or_default().events.clear();
        for _ in 0..20 {
            answers.extend(self.step_answering());
        }
        answers
    }

    fn step_answering(&mut self) -> Vec<ViewportCommand> {
        self.harness.step();
        self.harness.output().viewport_output[&ViewportId::ROOT].commands.clone()
    }

    fn question(&self) -> Option<Question> {
        self.state().document.question
    }
}

/// Flags a pair whose labels cannot be written, by root neither: a file lies where their folder should be.
fn stick(rig: &mut Rig) {
    rig.send(prefer(|s| s.workspace = Workspace::Label));
    std::fs::write(rig.data.join(FOLDER), "in the way").unwrap();
    rig.flag();
    rig.harness.get_by_label("not saved");
}

#[test]
fn closing_is_held_up_until_what_is_unsaved_is_saved_or_given_up() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    stick(&mut rig);
    let delays: Vec<Duration> = rig.harness.output().viewport_output.values().map(|v| v.repaint_delay).collect();
    let seconds = Duration::from_secs(1)..=Duration::from_secs(5);
    assert!(delays.iter().all(|delay| seconds.contains(delay)), "it looks again after seconds: {delays:?}");
    let answers = rig.ask_to_close();
    assert!(
        answers.contains(&ViewportCommand::CancelClose) && !answers.contains(&ViewportCommand::Close),
        "{answers:?}"
    );
    assert_eq!(rig.question(), Some(Question::Closing));
    rig.harness.get_by_label("Close without saving?");
    rig.harness.get_by_label("Stay open").click();
    rig.settle();
    assert_eq!(rig.question(), None);
    // Once more; it can be saved by now.
    rig.ask_to_close();
    std::fs::remove_file(rig.data.join(FOLDER)).unwrap();
    rig.harness.get_by_label("Try again").click();
    let answers: Vec<ViewportCommand> = (0..20).flat_map(|_| rig.step_answering()).collect();
    assert!(answers.contains(&ViewportCommand::Close), "{answers:?}");
    let states = Labels::of(&Dataset::open(&rig.data).unwrap()).reviews().states;
    assert_eq!(states.into_values().collect::<Vec<_>>(), [Review::Flagged]);
}

#[test]
fn labels_go_elsewhere_or_nowhere_and_are_kept_where_nobody_was_asked() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    stick(&mut rig);
    rig.ask_to_close();
    rig.harness.get_by_label("Save elsewhere…").click();
    rig.settle();
    let usb = rig.config.join("usb");
    rig.harness.get_by_label("Path").focus();
    rig.harness.event(Event::Text(usb.to_str().unwrap().to_owned()));
    rig.harness.step();
    rig.harness.get_by_label("Use this path").click();
    let answers: Vec<ViewportCommand> = (0..20).flat_map(|_| rig.step_answering()).collect();
    assert!(answers.contains(&ViewportCommand::Close), "{answers:?}");
    let (there, _) = MaskStore::in_folder(usb.join(FOLDER)).reviews();
    assert_eq!(there.into_iter().map(|(_, stored)| stored.review).collect::<Vec<_>>(), [Review::Flagged.stored()]);

    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    stick(&mut rig);
    rig.ask_to_close();
    rig.harness.get_by_label("Discard and close").click();
    let answers: Vec<ViewportCommand> = (0..20).flat_map(|_| rig.step_answering()).collect();
    assert!(answers.contains(&ViewportCommand::Close), "{answers:?}");
    assert!(!rig.config.join("recovered").exists());

    // The window is torn down without a word, as when drawing it panics.
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    stick(&mut rig);
    let (data, config) = (rig.data.clone(), rig.config.clone());
    let Rig { harness, _folder, .. } = rig;
    drop(harness);
    std::fs::remove_file(data.join(FOLDER)).unwrap();
    let dataset = Dataset::open(&data).unwrap();
    let labels = Labels::of(&dataset);
    let found = recover(&dataset, &labels, &config.join("recovered"));
    assert_eq!((found.pairs.len(), found.failed), (1, Vec::new()));
    assert_eq!(labels.reviews().states.into_values().collect::<Vec<_>>(), [Review::Flagged]);
}

#[test]
fn a_lost_graphics_device_closes_the_window_unasked_with_everything_kept() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    stick(&mut rig);
    let pair = rig.state().pair_name().to_owned();
    rig.harness.state().loss().say("the driver crashed");
    let answers = rig.step_answering();
    assert!(
        answers.contains(&ViewportCommand::Close) && !answers.contains(&ViewportCommand::CancelClose),
        "{answers:?}"
    );
    assert_eq!(rig.question(), None);
    // All is on the disk although the process may die now.
    let dataset = Dataset::open(&rig.data).unwrap();
    let settings = Services::with_config_folder(Some(rig.config.clone())).load_settings().0;
    assert_eq!((settings.last.pair, settings.last.place), (pair, Some(Place::Path(rig.data.clone()))));
    std::fs::remove_file(rig.data.join(FOLDER)).unwrap();
    let labels = Labels::of(&dataset);
    assert_eq!(recover(&dataset, &labels, &rig.config.join("recovered")).pairs.len(), 1);
    assert_eq!(labels.reviews().states.into_values().collect::<Vec<_>>(), [Review::Flagged]);
    // Frames may come after it.
    rig.step_answering();
}
