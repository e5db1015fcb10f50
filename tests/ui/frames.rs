//! Frames of which only what changed is painted: the same pictures, and little to paint.

use eframe::egui::{Key, Modifiers, Pos2, Rect, vec2};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::LibraryCommand;
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{Theme, Workspace};
use touch2touch::app::state::State;
use touch2touch::app::state::results::Results;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

/// Share of bytes that differ by more than a rounding, and the largest difference.
fn difference(a: &mut Rig, b: &mut Rig, what: &str) -> (f64, u8) {
    let [one, two] = [a, b].map(|rig| rig.harness.render().unwrap());
    assert_eq!(one.dimensions(), two.dimensions());
    let apart = |(a, b): (&u8, &u8)| a.abs_diff(*b);
    let far = one.iter().zip(two.iter()).map(apart).filter(|d| *d > 2).count();
    let most = one.iter().zip(two.iter()).map(apart).max().unwrap_or(0);
    if far > 0
        && let Some(folder) = std::env::var_os("TOUCH2TOUCH_SCREENSHOTS")
    {
        let folder = std::path::Path::new(&folder);
        one.save(folder.join(format!("{what}-changed.png"))).unwrap();
        two.save(folder.join(format!("{what}-whole.png"))).unwrap();
    }
    (far as f64 / one.len() as f64, most)
}

#[test]
fn what_is_painted_in_parts_is_what_is_painted_whole() {
    let Some(mut parts) = Rig::new(SIZE, 1) else { return };
    let mut whole = parts.painted_whole(SIZE);
    assert!(parts.harness.state().painted(&parts.harness.ctx).is_some_and(|px| px > 0));
    assert_eq!(whole.harness.state().painted(&whole.harness.ctx), None);
    let check = |parts: &mut Rig, whole: &mut Rig, what: &str| {
        let (share, most) = difference(parts, whole, what);
        // Textures are filtered by the device in one and by the shader in the other.
        assert!(share < 0.002, "{what}: {:.3} % of the bytes differ, by at most {most}", share * 100.0);
    };
    for (workspace, theme) in
        [(Workspace::Inspect, Theme::Dark), (Workspace::Align, Theme::Light), (Workspace::Label, Theme::Dark)]
    {
        let name = workspace.name();
        for rig in [&mut parts, &mut whole] {
            rig.send(prefer(move |s| s.theme = theme));
            rig.send(prefer(move |s| s.workspace = workspace));
        }
        check(&mut parts, &mut whole, name);
        for i in [1_u8, 4] {
            let place = Pos2::new(90.0 + 200.0 * f32::from(i), 120.0 + 100.0 * f32::from(i));
            for rig in [&mut parts, &mut whole] {
                rig.harness.hover_at(place);
                rig.harness.step();
                rig.harness.step();
            }
            check(&mut parts, &mut whole, &format!("{name}-hover-{i}"));
        }
        for rig in [&mut parts, &mut whole] {
            rig.key(Modifiers::NONE, Key::D);
        }
        check(&mut parts, &mut whole, &format!("{name}-step"));
    }
    // A window of another size.
    for rig in [&mut parts, &mut whole] {
        rig.harness.set_size(vec2(1000.0, 700.0));
        rig.settle();
    }
    check(&mut parts, &mut whole, "resized");
}

#[test]
fn an_idle_window_paints_nothing_and_a_pointer_on_the_move_little() {
    let Some(mut rig) = Rig::new(SIZE, 1) else { return };
    rig.send(prefer(|s| s.workspace = Workspace::Inspect));
    let painted = |rig: &Rig| rig.harness.state().painted(&rig.harness.ctx).unwrap();
    rig.harness.hover_at(Pos2::new(640.0, 400.0));
    rig.harness.run();
    let rested = painted(&rig);
    for _ in 0..3 {
        rig.harness.step();
    }
    assert_eq!(painted(&rig), rested, "nothing changed");
    let frames = 12;
    for i in 0..frames {
        let t = i as f32 * 0.5;
        rig.harness.hover_at(Pos2::new(640.0 + 500.0 * t.sin(), 400.0 + 300.0 * t.cos()));
        rig.harness.step();
    }
    let share = (painted(&rig) - rested) as f64 / frames as f64 / f64::from(SIZE[0] * SIZE[1]);
    assert!(share < 0.25, "a move of the pointer paints {:.0} % of the window", share * 100.0);
}

/// The smallest and the largest byte of green in the upper left of `rect`, beside what may be written in its middle.
fn spread(rig: &mut Rig, rect: Rect) -> [u8; 2] {
    let picture = rig.harness.render().unwrap();
    let [min, max] = [0.15, 0.42].map(|share| rect.min + share * rect.size());
    let (xs, ys) = (min.x as u32..max.x as u32, min.y as u32..max.y as u32);
    let green = ys.flat_map(|y| xs.clone().map(move |x| (x, y))).map(|(x, y)| picture.get_pixel(x, y)[1]);
    green.fold([255, 0], |[low, high], value| [low.min(value), high.max(value)])
}

#[test]
fn paging_shows_no_blank_frame_and_keeps_its_budget() {
    let Some(mut rig) = Rig::paging(SIZE, 200) else { return };
    rig.harness.state_mut().push(prefer(|s| s.workspace = Workspace::Label));
    let felt =
        |state: &State| results::imprint(state, ImprintSource::Measured, state.selection.finger).ready().is_some();
    rig.until("the imprint", felt);
    rig.harness.run_steps(5);
    let state = rig.state();
    let name = format!("Measured imprint {}", state.finger_name(state.selection.finger));
    let place = rig.harness.get_by_label(&name).rect();
    let [low, high] = spread(&mut rig, place);
    assert!(high - low > 20, "an imprint has colors: {low} to {high}");
    let mut waited = 0;
    // As a held key does, before the last pair was read; and further than is read ahead.
    for by in (0..60).map(|frame| if frame % 4 == 0 { 8 } else { 1 }) {
        rig.harness.state_mut().push(LibraryCommand::Step(by));
        rig.harness.step();
        let state = rig.state();
        waited += usize::from(!felt(state));
        assert!(state.results.bytes() <= Results::BUDGET);
        let row = state.selection.pair;
        let [low, high] = spread(&mut rig, place);
        assert!(high - low > 10, "the frame of {row:?} is blank: {low} to {high}");
    }
    assert!(waited > 0, "every pair was there before its frame");
}
