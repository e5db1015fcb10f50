//! Frames of the whole studio, painted whole and painted where something changed, in turns in one run.
//!
//! Processor time of all threads, because the clock of a machine that does other things as well says nothing.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use eframe::egui::{self, Event, Key, Modifiers, PointerButton, Pos2, Rect, TexturesDelta, pos2, vec2};
use eframe::egui_wgpu::{RenderState, Renderer, RendererOptions, ScreenDescriptor};
use egui_kittest::kittest::Queryable as _;
use egui_kittest::{Harness, TestRenderer};
use serde_json::json;
use strum::IntoEnumIterator as _;
use touch2touch::app::command::Command;
use touch2touch::app::services::live::LiveServices;
use touch2touch::app::settings::Workspace;
use touch2touch::app::settings::prefer;
use touch2touch::gpu::wgpu;
use touch2touch::ui::{Options, StudioApp};

/// A full-HD screen.
pub(super) const SIZE: [f32; 2] = [1920.0, 1080.0];
/// Frames per figure.
const FRAMES: usize = 30;
/// Pairs of the demo that are paged through for the figure of memory, unless `--pairs` says otherwise.
const PAIRS: usize = 200;

/// What puts frames on a texture as the window puts them on the screen.
struct Painter {
    state: RenderState,
    screen: Arc<Mutex<Option<wgpu::Texture>>>,
}

impl Painter {
    fn new(dithering: bool) -> (Self, RenderState, Arc<Mutex<Option<wgpu::Texture>>>) {
        let options = RendererOptions { dithering, ..Default::default() };
        let mut state = egui_kittest::wgpu::create_render_state(egui_kittest::wgpu::default_wgpu_setup(), options);
        // As windows have it on X11 and Wayland.
        state.target_format = wgpu::TextureFormat::Bgra8Unorm;
        *state.renderer.write() = Renderer::new(&state.device, state.target_format, options);
        let screen = Arc::new(Mutex::new(None));
        (Self { state: state.clone(), screen: screen.clone() }, state, screen)
    }
}

impl TestRenderer for Painter {
    fn setup_eframe(&self, cc: &mut eframe::CreationContext<'_>, frame: &mut eframe::Frame) {
        cc.wgpu_render_state = Some(self.state.clone());
        frame.wgpu_render_state = Some(self.state.clone());
    }

    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        let mut renderer = self.state.renderer.write();
        let mut set: Vec<_> = delta.set.drain().collect();
        set.sort_by_key(|(id, _)| *id);
        for (id, images) in set {
            for image in images {
                renderer.update_texture(&self.state.device, &self.state.queue, id, &image);
            }
        }
        let mut free: Vec<_> = delta.free.drain().collect();
        free.sort();
        for id in free {
            renderer.free_texture(&id);
        }
    }

    /// Paints the frame and waits for it; the picture stays on the device.
    fn render(&mut self, ctx: &egui::Context, output: &egui::FullOutput) -> Result<image::RgbaImage, String> {
        let (device, queue) = (&self.state.device, &self.state.queue);
        let mut kept = self.screen.lock().map_err(|e| e.to_string())?;
        let texture = kept.get_or_insert_with(|| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: SIZE[0] as u32, height: SIZE[1] as u32, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: self.state.target_format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        });
        let screen = ScreenDescriptor { pixels_per_point: 1.0, size_in_pixels: SIZE.map(|s| s as u32) };
        let jobs = ctx.tessellate(output.shapes.clone(), 1.0);
        let mut renderer = self.state.renderer.write();
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let before = renderer.update_buffers(device, queue, &mut encoder, &jobs, &screen);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        renderer.render(&mut pass.forget_lifetime(), &jobs, &screen);
        queue.submit(before.into_iter().chain([encoder.finish()]));
        device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| e.to_string())?;
        Ok(image::RgbaImage::new(1, 1))
    }
}

/// A studio, and where it is painted.
pub(super) struct Studio {
    pub(super) harness: Harness<'static, StudioApp>,
    state: RenderState,
    screen: Arc<Mutex<Option<wgpu::Texture>>>,
    _folder: tempfile::TempDir,
}

impl Studio {
    /// On the demo.
    fn new(whole_frames: bool) -> std::io::Result<Self> {
        let mut studio = Self::on(None, whole_frames, true)?;
        studio.settle();
        studio.send(prefer(|s| s.hint_dismissed = true));
        Ok(studio)
    }

    /// On a folder; `inline` does what is to be computed between frames, else threads do it meanwhile.
    pub(super) fn on(open: Option<PathBuf>, whole_frames: bool, inline: bool) -> std::io::Result<Self> {
        let folder = tempfile::tempdir()?;
        let services = LiveServices::with_config_folder(Some(PathBuf::from(folder.path())));
        let mut options = Options::new(Arc::new(services), open);
        options.inline = inline;
        options.native_dialogs = false;
        options.whole_frames = whole_frames;
        // As the window was opened before: with the toolkit's dithering.
        let (painter, state, screen) = Painter::new(whole_frames);
        let harness = Harness::builder()
            .with_size(SIZE)
            .with_max_steps(400)
            .renderer(painter)
            .build_eframe(move |cc| StudioApp::new(cc, options));
        Ok(Self { harness, state, screen, _folder: folder })
    }

    pub(super) fn settle(&mut self) {
        for _ in 0..2000 {
            self.harness.step();
            if self.harness.state().is_idle() && self.harness.state().state().library.open.is_some() {
                break;
            }
        }
        // What a frame found out the next one shows.
        for _ in 0..3 {
            self.harness.step();
        }
    }

    pub(super) fn send(&mut self, command: impl Into<Command>) {
        self.harness.state_mut().push(command);
        self.harness.step();
        self.settle();
    }

    /// One frame after `input`; its processor time, milliseconds: all, and that of putting it on the window.
    pub(super) fn frame(&mut self, input: &[Event]) -> [f64; 2] {
        self.harness.input_mut().events.extend_from_slice(input);
        let start = processor_ms();
        self.harness.step();
        // What the studio itself drew is waited for before the window is.
        if let Err(error) = self.state.device.poll(wgpu::PollType::wait_indefinitely()) {
            eprintln!("{error}");
        }
        let stepped = processor_ms();
        if let Err(error) = self.harness.render() {
            eprintln!("{error}");
        }
        let end = processor_ms();
        [end - start, end - stepped]
    }

    /// The bytes that are on the screen.
    pub(super) fn picture(&self) -> Vec<u8> {
        let (device, queue) = (&self.state.device, &self.state.queue);
        let Ok(kept) = self.screen.lock() else { return Vec::new() };
        let Some(texture) = kept.as_ref() else { return Vec::new() };
        let (width, height) = (texture.width(), texture.height());
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(width * height * 4),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        // A row of 1920 pixels is a multiple of 256 bytes.
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * 4), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            texture.size(),
        );
        queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |_| ());
        if let Err(error) = device.poll(wgpu::PollType::wait_indefinitely()) {
            eprintln!("{error}");
        }
        buffer.get_mapped_range(..).map(|bytes| bytes.to_vec()).unwrap_or_default()
    }
}

/// Processor time of all threads so far, milliseconds; the clock where the system does not say.
fn processor_ms() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let of_one = |thread: std::fs::DirEntry| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    let sum: f64 = threads.filter_map(of_one).sum();
    if sum > 0.0 { sum / 1e6 } else { std::time::UNIX_EPOCH.elapsed().map_or(0.0, |t| t.as_secs_f64() * 1e3) }
}

/// Processor time of this thread so far, milliseconds: what the studio itself does, without the device where that is the
/// processor as well; zero where the system does not say.
pub(super) fn own_ms() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) / 1e6
}

/// Resident memory now and at its highest, MiB; zero where the system does not say.
pub(super) fn resident_mib() -> [f64; 2] {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let of = |key: &str| {
        let line = text.lines().find(|line| line.starts_with(key));
        line.and_then(|l| l.split_whitespace().nth(1)?.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
    };
    [of("VmRSS:"), of("VmHWM:")]
}

/// Root mean square difference of two pictures, 8-bit values.
fn rms(a: &[u8], b: &[u8]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    (sum / a.len().max(1) as f64).sqrt()
}

pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The place of the pointer in frame `i`: all over `rect`.
fn wander(rect: Rect, i: usize) -> Pos2 {
    let t = i as f32 * 0.37;
    rect.center() + vec2(0.47 * rect.width() * t.sin(), 0.45 * rect.height() * (1.3 * t).cos())
}

/// Prints the table of frames; returns it for the file.
pub(super) fn frames() -> std::io::Result<serde_json::Value> {
    let mut whole = Studio::new(true)?;
    let mut kept = Studio::new(false)?;
    println!("\nThe studio, {} x {} points, demo; ms of processor per frame, medians of {FRAMES}", SIZE[0], SIZE[1]);
    println!(
        "{:>10} {:>8} {:>9} {:>9} {:>7} {:>9} {:>9} {:>10}",
        "workspace", "what", "whole", "changed", "ratio", "on window", "on window", "difference"
    );
    let mut rows = Vec::new();
    let some = Workspace::iter().any(|w| std::env::args().any(|word| word == w.name()));
    for workspace in Workspace::iter().filter(|w| !some || std::env::args().any(|word| word == w.name())) {
        for studio in [&mut whole, &mut kept] {
            studio.send(prefer(move |s| s.workspace = workspace));
            studio.frame(&[]);
        }
        let view = |studio: &Studio| studio.harness.query_all_by_label("3D view, measured").next().map(|n| n.rect());
        let scene = view(&whole);
        let area = Rect::from_min_max(pos2(20.0, 60.0), pos2(SIZE[0] - 20.0, SIZE[1] - 40.0));
        let key = |key| {
            let event =
                |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers: Modifiers::NONE };
            [event(true), event(false)]
        };
        let button = |pos, pressed| {
            let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
            Event::PointerButton { pos, button, pressed, modifiers }
        };
        for what in ["hover", "step", "orbit"] {
            let Some(scene) = scene.filter(|_| what == "orbit").or((what != "orbit").then_some(area)) else { continue };
            let (mut times, mut shown, mut differences) =
                ([const { Vec::new() }; 2], [const { Vec::new() }; 2], Vec::new());
            if what == "orbit" {
                for studio in [&mut whole, &mut kept] {
                    studio.frame(&[Event::PointerMoved(scene.center())]);
                    studio.frame(&[button(scene.center(), true)]);
                }
            }
            for i in 0..FRAMES + 4 {
                for (at, studio) in [&mut whole, &mut kept].into_iter().enumerate() {
                    let [time, window] = match what {
                        "hover" => studio.frame(&[Event::PointerMoved(wander(area, i))]),
                        "orbit" => {
                            studio.frame(&[Event::PointerMoved(scene.center() + vec2(i as f32 * 4.0, i as f32))])
                        }
                        _ => {
                            // There and back between two pairs, so that nothing is read or computed after the first.
                            studio.harness.input_mut().events.extend(key(if i % 2 == 0 { Key::D } else { Key::A }));
                            if i < 4 {
                                studio.settle();
                            }
                            // One frame takes the key, the next shows what it led to.
                            let [first, second] = [studio.frame(&[]), studio.frame(&[])];
                            [first[0] + second[0], first[1] + second[1]]
                        }
                    };
                    if i >= 4 {
                        times[at].push(time);
                        shown[at].push(window);
                    }
                }
                if i % 8 == 4 {
                    differences.push(rms(&whole.picture(), &kept.picture()));
                }
            }
            if what == "orbit" {
                for studio in [&mut whole, &mut kept] {
                    studio.frame(&[button(scene.center(), false)]);
                    studio.settle();
                }
            }
            let [before, after] = times.map(|mut t| median(&mut t));
            let [before_shown, after_shown] = shown.map(|mut t| median(&mut t));
            let difference = differences.iter().copied().fold(0.0, f64::max);
            let name = workspace.name();
            println!(
                "{name:>10} {what:>8} {before:>9.1} {after:>9.1} {:>7.1} {before_shown:>9.1} {after_shown:>9.1} {difference:>10.3}",
                before / after
            );
            rows.push(json!({
                "workspace": name, "what": what, "whole_ms": before, "changed_ms": after,
                "whole_window_ms": before_shown, "changed_window_ms": after_shown, "difference_rms": difference,
            }));
        }
    }
    Ok(rows.into())
}

/// Pages through pairs of the demo and prints the memory that it takes; returns it for the file.
pub(super) fn memory() -> std::io::Result<serde_json::Value> {
    let mut studio = Studio::new(false)?;
    let [before, _] = resident_mib();
    let words: Vec<String> = std::env::args().collect();
    let asked = words.iter().position(|word| word == "--pairs").and_then(|at| words.get(at + 1)?.parse().ok());
    let pairs = asked.unwrap_or(PAIRS);
    for _ in 0..pairs {
        studio.harness.key_press(Key::D);
        studio.harness.step();
        studio.settle();
    }
    let [after, peak] = resident_mib();
    let held = studio.harness.state().state().results.bytes() as f64 / f64::from(1 << 20);
    println!(
        "\nMemory, MiB: {before:.0} at first, {after:.0} after {pairs} pairs ({held:.0} in caches), {peak:.0} at most"
    );
    Ok(json!({ "pairs": pairs, "first_mib": before, "after_mib": after, "caches_mib": held, "peak_mib": peak }))
}
