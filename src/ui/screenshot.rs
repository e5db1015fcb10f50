//! A picture of the window as a file.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use eframe::egui::ColorImage;

use crate::app::command::{Command, TasksCommand};
use crate::work::error::TaskError;

/// Writes `image` as a PNG into `folder` (or the working directory), and reports where, or why not.
pub(super) fn save(folder: Option<&Path>, image: &ColorImage) -> Command {
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let path = folder.unwrap_or(Path::new(".")).join(format!("touch2touch-{seconds}.png"));
    let [width, height] = image.size.map(|s| u32::try_from(s).unwrap_or(0));
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|p| p.to_array()).collect();
    let result = image::save_buffer(&path, &bytes, width, height, image::ExtendedColorType::Rgba8);
    match result {
        Ok(()) => Command::Tasks(TasksCommand::Notice(format!("Saved {}", path.display()))),
        Err(err) => {
            Command::Tasks(TasksCommand::Report(TaskError::new("Screenshot", format!("{err}: {}", path.display()))))
        }
    }
}
