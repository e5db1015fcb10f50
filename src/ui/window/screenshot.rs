//! A picture of the window or of a pane, as a file or on the clipboard.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use eframe::egui::{self, ColorImage, Rect};

use crate::app::command::{Command, TasksCommand};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::folders;

/// Use of a picture of the window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shot {
    /// The part that is wanted, points; `None` = all of it.
    pub part: Option<Rect>,
    /// To the clipboard instead of a file.
    pub copied: bool,
    /// Physical pixels per point.
    pub scale: f32,
}

impl Shot {
    /// Does with the picture of the window what was asked for, and reports it. Files go to `folder`, else to the user's
    /// pictures.
    pub(crate) fn take(self, ctx: &egui::Context, folder: Option<&Path>, window: &ColorImage) -> Command {
        let image = match self.part {
            // Rounded inwards: the frame around a pane is not the pane's.
            Some(part) => window.region(&part.shrink(0.5), Some(self.scale)),
            None => window.clone(),
        };
        if self.copied {
            let [width, height] = image.size;
            ctx.copy_image(image);
            return Command::Tasks(TasksCommand::Notice(format!("Copied a picture of {width} x {height} pixels")));
        }
        save(folder, &image)
    }
}

/// Writes `image` as a PNG, and reports where, or why not.
fn save(folder: Option<&Path>, image: &ColorImage) -> Command {
    const WHAT: &str = "Picture";
    let millis = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_millis());
    let Some(folder) = folder.map(Path::to_owned).or_else(folders::pictures) else {
        let err = TaskError::new(WHAT, "there is no folder for pictures");
        return Command::Tasks(TasksCommand::Report(err.with_hint("Copy the picture instead.")));
    };
    let path = folder.join(format!("touch2touch-{millis}.png"));
    let [width, height] = image.size.map(|s| u32::try_from(s).unwrap_or(0));
    let bytes: Vec<u8> = image.pixels.iter().flat_map(|p| p.to_array()).collect();
    let written = image::save_buffer(&path, &bytes, width, height, image::ExtendedColorType::Rgba8);
    match written {
        Ok(()) => Command::Tasks(TasksCommand::Saved(format!("Saved {}", path.display()), path)),
        Err(err) => Command::Tasks(TasksCommand::Report(TaskError::new(WHAT, format!("{err}: {}", path.display())))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Color32, OutputCommand, pos2};

    #[test]
    fn the_part_that_is_wanted_is_written_or_copied() {
        let (ctx, folder) = (egui::Context::default(), tempfile::tempdir().unwrap());
        let mut window = ColorImage::filled([40, 20], Color32::BLACK);
        window[(10, 6)] = Color32::RED;
        // Points 4.5..12.5 and 2.5..7.5 at two pixels a point, less the frame.
        let part = Some(Rect::from_min_max(pos2(4.5, 2.5), pos2(12.5, 7.5)));
        let shot = Shot { part, copied: false, scale: 2.0 };
        let said = shot.take(&ctx, Some(folder.path()), &window);
        assert!(
            matches!(&said, Command::Tasks(TasksCommand::Saved(text, _)) if text.starts_with("Saved ")),
            "{said:?}"
        );
        let file = std::fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
        let written = image::open(file).unwrap().to_rgba8();
        assert_eq!(written.dimensions(), (14, 8));
        assert_eq!(written.get_pixel(0, 0).0, [255, 0, 0, 255]);
        let said = Shot { copied: true, ..shot }.take(&ctx, None, &window);
        assert!(matches!(&said, Command::Tasks(TasksCommand::Notice(text)) if text.contains("14 x 8")), "{said:?}");
        let copied = ctx.output(|o| o.commands.iter().any(|c| matches!(c, OutputCommand::CopyImage(_))));
        assert!(copied);
        let missing = folder.path().join("not/there");
        let said = shot.take(&ctx, Some(&missing), &window);
        assert!(
            matches!(&said, Command::Tasks(TasksCommand::Report(err)) if err.why.contains("not/there")),
            "{said:?}"
        );
    }
}
