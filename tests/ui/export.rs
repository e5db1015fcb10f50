//! What is taken away: figures and pictures, each in few clicks.

use eframe::egui::Key;
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{PredictCommand, SettingsCommand};
use touch2touch::app::settings::Theme;
use touch2touch::io::images;

use super::rig::Rig;

/// Clicks and keys, counted.
struct Hand {
    rig: Rig,
    actions: usize,
}

impl Hand {
    fn new(size: [f32; 2]) -> Option<Self> {
        let mut rig = Rig::new(size, 3)?;
        rig.send(SettingsCommand::DismissHint);
        rig.send(PredictCommand::Generate);
        Some(Self { rig, actions: 0 })
    }

    fn click(&mut self, label: &str) {
        self.actions += 1;
        self.rig.harness.get_by_label(label).click();
        self.rig.harness.step();
        self.rig.settle();
    }

    fn type_path(&mut self, path: &std::path::Path) {
        self.actions += 2;
        self.rig.harness.get_by_label("Path").type_text(path.to_str().unwrap());
        self.rig.harness.step();
        self.rig.harness.key_press(Key::Enter);
        self.rig.harness.step();
        self.rig.settle();
    }
}

#[test]
fn a_figure_of_four_pairs_takes_no_more_than_eight_actions() {
    let Some(mut hand) = Hand::new([1280.0, 800.0]) else { return };
    let file = hand.rig.data.join("figure.png");
    hand.click("Open");
    hand.click("Figure…");
    hand.rig.shoot("figure-form");
    hand.click("Save the figure");
    hand.type_path(&file);
    assert!(hand.actions <= 8, "{}", hand.actions);
    let image = images::read_rgb(&file).unwrap();
    assert_eq!(image.size(), [1524, 1328], "four rows of four pictures, two pixels for each of an imprint");
    // The note says where, and can be taken along.
    hand.rig.harness.get_by_label("Show in its folder");
    hand.rig.shoot("figure-saved");
    hand.rig.harness.get_by_label("Copy the path").click();
    hand.rig.harness.step();
    let copied = hand.rig.harness.output().platform_output.commands.iter().any(
        |command| matches!(command, eframe::egui::OutputCommand::CopyText(text) if *text == file.display().to_string()),
    );
    assert!(copied);
    let state = hand.rig.harness.state().state();
    assert!(!state.export.asking && state.log.entries.back().unwrap().place.as_deref() == Some(&*file));
}

#[test]
fn a_pane_is_drawn_as_a_picture_from_its_own_menu() {
    let Some(mut hand) = Hand::new([1280.0, 800.0]) else { return };
    hand.rig.send(SettingsCommand::SetTheme(Theme::Light));
    for (text, name) in [("Save picture 4x", "error.png"), ("Save picture SVG", "error.svg")] {
        let file = hand.rig.data.join(name);
        hand.actions = 0;
        hand.click("Export Error");
        hand.rig.shoot("pane-menu");
        hand.click(text);
        hand.type_path(&file);
        assert!(hand.actions <= 4 && file.is_file(), "{}", hand.actions);
    }
    let image = images::read_rgb(&hand.rig.data.join("error.png")).unwrap();
    assert_eq!(image.width(), 4 * (175 + 44), "one picture with its captions, four pixels for each of the imprint");
    let text = std::fs::read_to_string(hand.rig.data.join("error.svg")).unwrap();
    assert!(text.contains("predicted minus measured, mm") && text.contains("mean |error|"));
}
