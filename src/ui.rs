//! The studio's window: panes, widgets, theme.
//!
//! Panes read the state and put commands on a list; they compute nothing and change nothing. What is derived for the
//! screen (textures, outlines) is made again only when the recipe of what is shown changes.

mod panes;
mod parts;
mod window;

pub use parts::{theme, widget};
pub use window::app;
pub use window::app::{Loss, Options, StudioApp};

use std::path::PathBuf;
use std::sync::Arc;

use eframe::egui;
use eframe::egui_wgpu::WgpuSetup;

use crate::app::services::Services;
use crate::gpu::Gpu;
use touch2touch_pipeline::io::catch_panic::catch_panic;
use window::lost::start_again;

/// Size of the window on the first start, points. eframe makes it smaller where the screen is.
const WINDOW: [f32; 2] = [1600.0, 960.0];
/// Smallest size that every workspace can be used in, points.
const SMALLEST: [f32; 2] = [900.0, 600.0];

/// The program's icon; without it where the picture cannot be read.
fn icon() -> egui::IconData {
    eframe::icon_data::from_png_bytes(include_bytes!("../assets/icon/touch2touch.png")).unwrap_or_default()
}

/// Opens the window and returns when it was closed. `open` is a folder or a file in one; `None` opens what was open
/// last, else the demo. `reset` starts with default preferences and layouts.
///
/// # Errors
/// In words, if no window can be opened: no display, or no graphics device.
pub fn run(open: Option<PathBuf>, reset: bool) -> Result<(), String> {
    let mut native = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Touch2Touch Studio")
            .with_app_id("touch2touch")
            .with_icon(icon())
            .with_inner_size(WINDOW)
            .with_min_inner_size(SMALLEST)
            .with_clamp_size_to_monitor_size(true)
            .with_drag_and_drop(true),
        // Pictures have whole bytes: there is nothing to dither, and it costs a program that draws a third of its time.
        dithering: false,
        ..Default::default()
    };
    if let WgpuSetup::CreateNew(setup) = &mut native.wgpu_options.wgpu_setup {
        setup.device_descriptor = Arc::new(Gpu::device_descriptor);
    }
    let services = Services::of_user();
    let last = (!reset).then(|| services.peek_settings()).flatten().and_then(|settings| settings.last.window);
    native.viewport = window::place::restored(native.viewport, last);
    let mut options = Options::new(Arc::new(services), open);
    options.reset = reset;
    let loss = options.loss.clone();
    let start: eframe::AppCreator<'_> = Box::new(move |cc| Ok(Box::new(StudioApp::new(cc, options))));
    // A frame on a device that is lost may panic.
    let ended = catch_panic(|| eframe::run_native("touch2touch", native, start));
    if let Some(why) = loss.why() {
        return Err(start_again(why));
    }
    ended
        .map_err(|bug| format!("The window ended by an internal error, which is a bug; everything is saved: {bug}"))?
        .map_err(|err| {
            format!(
                "The window cannot be opened: {err}. The studio needs a display (X11 or Wayland) and a Vulkan or GL \
                 driver (on Debian or Ubuntu: mesa-vulkan-drivers); the command line works without either (touch2touch \
                 --help)."
            )
        })
}
