//! Strokes from the pointer to the screen, and many pairs paged through.

use std::path::Path;

use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, vec2};
use egui_kittest::kittest::Queryable as _;
use serde_json::json;
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{MaskTool, Workspace};
use touch2touch::app::state::results::Results;
use touch2touch_core::catalog;
use touch2touch_core::grid::Grid;
use touch2touch_core::sim;
use touch2touch_work::io::dataset::RIG_JSON;
use touch2touch_work::io::images;
use touch2touch_work::io::simulated::{Layout, pair_paths, write_pair, write_tools};

use super::window::{SIZE, Studio, median, own_ms, resident_mib};

/// Moves of the pointer in a stroke.
const MOVES: usize = 60;
/// Pairs that are paged through.
const PAIRS: u64 = 1000;

/// A folder with one pair whose imprint is 1024 x 1024.
fn large_pair(folder: &Path) -> std::io::Result<()> {
    const SIDE: usize = 1024;
    let sensor = |key: &str, kind: &str, size: [usize; 2], px_per_m: f64| json!({ "key": key, "name": key, "kind": kind, "width": size[0], "height": size[1], "px_per_m": px_per_m });
    let rig = json!({
        "name": "A large sensor",
        "sensors": [
            sensor("gelslim", "color", [427, 320], 23_720.0),
            sensor("bubble", "depth", [SIDE, SIDE], 14_000.0),
        ],
        "pads": [{ "key": "right", "name": "Right" }],
    });
    std::fs::write(folder.join(RIG_JSON), rig.to_string())?;
    let bump = |x: usize, y: usize| {
        let r = ((x as f64 - 500.0).powi(2) + (y as f64 - 480.0).powi(2)).sqrt();
        (40.0 + 180.0 * (-r / 220.0).exp()) as u8
    };
    let gray = Grid::from_fn(SIDE, SIDE, bump);
    images::write_gray8(&folder.join("a_bubble.png"), &gray).map_err(std::io::Error::other)?;
    let color = Grid::from_fn(427, 320, |x, y| [x as f32 / 2.0, y as f32 / 2.0, 90.0]);
    images::write_rgb8(&folder.join("a_gelslim.png"), &color).map_err(std::io::Error::other)
}

fn button(pos: Pos2, pressed: bool) -> Event {
    Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE }
}

/// The place of the imprint that is painted on.
fn canvas(studio: &Studio) -> Option<Rect> {
    let state = studio.harness.state().state();
    let name = format!("Measured imprint {}", state.finger_name(state.selection.finger));
    studio.harness.query_all_by_label(&name).next().map(|node| node.rect())
}

/// Prints what a stroke costs by size of imprint and brush; returns it for the file.
pub(super) fn strokes() -> std::io::Result<serde_json::Value> {
    println!("\nStrokes of {MOVES} moves, {} x {} points; ms of processor per frame", SIZE[0], SIZE[1]);
    println!("{:>12} {:>7} {:>9} {:>9} {:>9} {:>9} {:>9}", "imprint", "brush", "own", "worst", "all", "window", "end");
    let folder = tempfile::tempdir()?;
    large_pair(folder.path())?;
    let mut rows = Vec::new();
    for (open, radius_px) in [(None, 4.0), (Some(folder.path()), 4.0), (Some(folder.path()), 40.0)] {
        let mut studio = Studio::on(open.map(Path::to_owned), false, true)?;
        studio.settle();
        studio.send(prefer(|s| s.hint_dismissed = true));
        studio.send(prefer(|s| s.workspace = Workspace::Label));
        studio.send(prefer(|s| s.mask.tool = MaskTool::Brush));
        studio.send(prefer(move |s| s.mask.radius_px = radius_px));
        let state = studio.harness.state().state();
        let imprint = results::imprint(state, ImprintSource::Measured, state.selection.finger);
        let size = imprint.ready().map_or([0, 0], |imprint| imprint.size());
        let Some(place) = canvas(&studio) else {
            return Err(std::io::Error::other("the imprint is not on screen"));
        };
        let at = |i: usize| {
            let t = i as f32 * 0.2;
            place.center() + vec2(0.3 * place.width() * t.cos(), 0.3 * place.height() * (1.7 * t).sin())
        };
        studio.frame(&[Event::PointerMoved(at(0))]);
        studio.frame(&[button(at(0), true)]);
        let (mut own, mut drawn, mut window) = (Vec::new(), Vec::new(), Vec::new());
        for i in 1..=MOVES {
            studio.harness.input_mut().events.push(Event::PointerMoved(at(i)));
            let start = own_ms();
            studio.harness.step();
            own.push(own_ms() - start);
            let [all, shown] = studio.frame(&[Event::PointerMoved(at(i))]);
            drawn.push(all - shown);
            window.push(shown);
        }
        if studio.harness.state().state().document.stroke.is_none() {
            return Err(std::io::Error::other("nothing was painted"));
        }
        let [all, shown] = studio.frame(&[button(at(MOVES), false)]);
        let worst = own.iter().copied().fold(0.0, f64::max);
        let (middle, drawn_ms, shown_ms, end) =
            (median(&mut own), median(&mut drawn), median(&mut window), all - shown);
        let name = format!("{} x {}", size[0], size[1]);
        println!("{name:>12} {radius_px:>7.0} {middle:>9.2} {worst:>9.2} {drawn_ms:>9.2} {shown_ms:>9.2} {end:>9.2}");
        rows.push(json!({
            "size": size, "radius_px": radius_px, "own_median_ms": middle, "own_worst_ms": worst,
            "all_median_ms": drawn_ms, "window_median_ms": shown_ms, "end_ms": end,
        }));
    }
    Ok(rows.into())
}

/// Pages through pairs as fast as frames come, while threads read them; prints what was seen, returns it for the file.
pub(super) fn paging() -> std::io::Result<serde_json::Value> {
    let folder = tempfile::tempdir()?;
    let Some(tool) = catalog::tools().first() else { return Ok(json!(null)) };
    let sample = sim::simulate(tool, sim::random_grasp(3), 3, &sim::SimConfig::default());
    let root = folder.path();
    let written = write_pair(root, Layout::Train, &tool.name, 0, &sample).map_err(std::io::Error::other)?;
    write_tools(root, &[(tool.name.as_str(), tool.seen, tool.mesh())]).map_err(std::io::Error::other)?;
    for index in 1..PAIRS {
        for (file, again) in written.iter().zip(pair_paths(root, Layout::Train, &tool.name, index)) {
            std::fs::hard_link(file, again)?;
        }
    }
    let mut studio = Studio::on(Some(folder.path().to_owned()), false, false)?;
    let felt = |studio: &Studio| {
        let state = studio.harness.state().state();
        results::imprint(state, ImprintSource::Measured, state.selection.finger).ready().is_some()
    };
    studio.harness.state_mut().push(prefer(|s| s.hint_dismissed = true));
    studio.harness.state_mut().push(prefer(|s| s.workspace = Workspace::Label));
    let begin = std::time::Instant::now();
    while !felt(&studio) && begin.elapsed().as_secs() < 120 {
        studio.frame(&[]);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    for _ in 0..5 {
        studio.frame(&[]);
    }
    let Some(place) = canvas(&studio) else { return Err(std::io::Error::other("the imprint is not on screen")) };
    let (mut times, mut waited, mut blank, mut most) = (Vec::new(), 0_usize, 0_usize, 0_usize);
    for _ in 1..PAIRS {
        let key = |pressed| Event::Key {
            key: Key::D,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        let start = std::time::Instant::now();
        studio.frame(&[key(true), key(false)]);
        times.push(start.elapsed().as_secs_f64() * 1e3);
        waited += usize::from(!felt(&studio));
        blank += usize::from(is_blank(&studio.picture(), place));
        most = most.max(studio.harness.state().state().results.bytes());
    }
    let worst = times.iter().copied().fold(0.0, f64::max);
    let (middle, at) = (median(&mut times), studio.harness.state().state().selection.pair);
    let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
    let ([_, peak], budget) = (resident_mib(), mib(Results::BUDGET));
    println!(
        "\n{PAIRS} pairs paged through, one a frame, up to {at:?}: {blank} blank frames, {waited} with the pair before \
         dimmed; {middle:.1} ms a frame, {worst:.1} at most; {:.0} MiB in caches at most (budget {budget:.0}), {peak:.0} in all",
        mib(most)
    );
    Ok(json!({
        "pairs": PAIRS, "blank": blank, "waited": waited, "frame_median_ms": middle, "frame_worst_ms": worst,
        "caches_mib": mib(most), "budget_mib": budget, "peak_mib": peak,
    }))
}

/// Whether the upper left of a place on the screen has one color: beside what may be written in its middle.
fn is_blank(screen: &[u8], place: Rect) -> bool {
    let [min, max] = [0.15, 0.42].map(|share| place.min + share * place.size());
    let row = |y: usize| {
        let bytes = |x: f32| (y * SIZE[0] as usize + x as usize) * 4;
        screen.get(bytes(min.x)..bytes(max.x)).unwrap_or_default()
    };
    let green = (min.y as usize..max.y as usize).flat_map(|y| row(y).chunks_exact(4).map(|pixel| pixel[1]));
    let [low, high] = green.fold([255, 0], |[low, high]: [u8; 2], value| [low.min(value), high.max(value)]);
    high.saturating_sub(low) < 10
}
