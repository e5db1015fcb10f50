//! The arrangement of panes survives a restart, a damaged one is replaced, and keys go through it.

use eframe::egui::{Key, Memory, Modifiers, Rect};
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

/// The visible part of what has the keyboard focus.
fn focus(rig: &Rig) -> Rect {
    let ctx = &rig.harness.ctx;
    let id = ctx.memory(Memory::focused).expect("something has the focus");
    ctx.read_response(id).expect("and is on screen").interact_rect
}

/// True where the left edge of `place` has the color of the ring.
fn has_ring(rig: &mut Rig, place: Rect) -> bool {
    let picture = rig.harness.render().unwrap();
    let is_accent = |x: f32| {
        let at = picture.get_pixel(x.clamp(0.0, SIZE[0] - 1.0) as u32, place.center().y as u32);
        at.0.iter().zip([0x8b, 0x8c, 0xf6]).all(|(is, accent)| is.abs_diff(accent) < 24)
    };
    (-1..=1).any(|by| is_accent(place.left() + by as f32))
}

#[test]
fn f6_goes_from_pane_to_pane_and_tab_through_the_controls_of_each_with_a_ring() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    let shown = rig.state().selection.panes.clone();
    let mut way = Vec::new();
    for _ in &shown {
        rig.key(Modifiers::NONE, Key::F6);
        let place = focus(&rig);
        let is_at = |(pane, at): &(Pane, Rect)| shown.contains(pane) && at.expand(2.0).contains_rect(place);
        let (pane, at) = rig.harness.state().places().into_iter().find(is_at).expect("the focus is on a pane");
        assert!(place.area() > 0.9 * at.area(), "{place:?} is {pane:?}, {at:?}");
        way.push(pane);
        assert!(has_ring(&mut rig, place), "{way:?}");
    }
    assert_eq!((way[0], way.iter().copied().collect()), (Pane::Browser, shown));
    rig.key(Modifiers::SHIFT, Key::F6);
    let place = rig.harness.state().places()[&way[way.len() - 2]];
    assert!(place.expand(2.0).contains_rect(focus(&rig)));
    let mut controls = 0;
    for _ in 0..40 {
        rig.key(Modifiers::NONE, Key::Tab);
        let at = focus(&rig);
        controls += usize::from(place.contains_rect(at));
        assert!(!at.is_positive() || has_ring(&mut rig, at), "no ring at {at:?}");
    }
    assert!(controls > 2, "{controls} controls of {:?}", way[way.len() - 2]);
}
