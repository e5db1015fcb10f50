//! Keys: shown by what works here.

use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

fn press(rig: &mut Rig, modifiers: Modifiers, key: Key) {
    rig.harness.key_press_modifiers(modifiers, key);
    rig.harness.step();
    rig.settle();
}

/// Narrows the sheet to what a person looks for, so that its rows are on screen.
fn find(rig: &mut Rig, text: &str) {
    rig.harness.get_by_label("Filter shortcuts").type_text(text);
    rig.harness.step();
    rig.settle();
}

fn says(rig: &Rig, text: &str) -> bool {
    rig.harness.query_all_by_label_contains(text).next().is_some()
}

#[test]
fn the_sheet_begins_with_what_works_here_and_fits_the_window() {
    for size in [SIZE, [1024.0, 700.0]] {
        let Some(mut rig) = Rig::new(size, 1) else { return };
        rig.send(prefer(|s| s.hint_dismissed = true));
        rig.send(prefer(|s| s.workspace = Workspace::Align));
        let over = rig.harness.get_by_label("3D view, measured").rect().center();
        rig.harness.hover_at(over);
        rig.harness.step();
        press(&mut rig, Modifiers::NONE, Key::F1);
        rig.shoot(&format!("shortcuts-{}", size[0]));
        assert!(says(&rig, "HERE: ALIGN, 3D"));
        // What works here stands first: before the files' in the same column, or in an earlier one.
        let place = |name: &str| rig.harness.get_by_label(name).rect().min;
        let (here, file) = (place("View from the top"), place("Open folder…"));
        assert!((here.x, here.y) < (file.x, file.y), "{here} {file}");
        for label in ["Filter shortcuts", "Close"] {
            let rect = rig.harness.get_by_label(label).rect();
            assert!(rect.right() <= size[0] && rect.bottom() <= size[1], "{label}: {rect:?}");
        }
        let keys = rig.harness.query_all_by_label_contains("Ctrl+").map(|node| node.rect());
        for rect in keys.filter(|rect| rect.height() > 0.0) {
            assert!(rect.left() >= 0.0 && rect.right() <= size[0] - 32.0, "{rect:?}");
        }
        find(&mut rig, "Ctrl+S");
        assert_eq!(rig.harness.query_all_by_label("Ctrl+S").count(), 1);
        rig.shoot(&format!("shortcuts-filter-{}", size[0]));
    }
}
