//! Choosing a folder or file: the system's dialog on a thread of its own, and a path box where there is none.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use eframe::egui::{self, Key, RichText};

use crate::app::export::Output;
use crate::ui::parts::theme::{Palette, caption};

/// A dialog that ends empty sooner than a person could have closed it was never shown.
const NEVER_SHOWN: Duration = Duration::from_millis(700);

/// Purpose of a dialog.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Purpose {
    /// A folder with pairs, to open.
    Folder,
    /// A file, whose folder is opened.
    File,
    /// The folder that the results table is written to.
    Table,
    /// The folder of rows that are shown as scores.
    Scores,
    /// The folder of masks that are imported.
    Masks,
    /// The folder that labels are written to which could not be saved.
    Labels,
    /// A place that something is written to.
    Output(Output),
}

impl Purpose {
    fn title(self) -> &'static str {
        match self {
            Self::Folder => "Open a folder of pairs",
            Self::File => "Open a file of a data set",
            Self::Output(output) => output.title(),
            Self::Labels => "Save the labels to a folder",
            Self::Masks => "Import masks from a folder",
            Self::Scores => "Open the scores in a folder",
            Self::Table => "Write the results table to a folder",
        }
    }
}

/// The path box.
struct PathBox {
    purpose: Purpose,
    text: String,
    why: &'static str,
    fresh: bool,
}

/// Dialogs under way.
pub(crate) struct Dialogs {
    sender: Sender<(Purpose, Option<PathBuf>, Duration)>,
    answers: Receiver<(Purpose, Option<PathBuf>, Duration)>,
    waiting: bool,
    path_box: Option<PathBox>,
    /// True where the system's dialogs are tried at all.
    native: bool,
}

impl Dialogs {
    /// `native` false always shows the path box (tests, or a person's wish).
    pub(crate) fn new(native: bool) -> Self {
        let (sender, answers) = channel();
        Self { sender, answers, waiting: false, path_box: None, native }
    }

    /// Asks for a path.
    pub(crate) fn open(&mut self, purpose: Purpose, ctx: &egui::Context) {
        if !self.native {
            self.type_path(purpose, "");
            return;
        }
        if std::mem::replace(&mut self.waiting, true) {
            return;
        }
        let (sender, ctx) = (self.sender.clone(), ctx.clone());
        let started = Instant::now();
        let work = move || {
            let dialog = rfd::FileDialog::new().set_title(purpose.title());
            let path = match purpose {
                Purpose::Folder | Purpose::Table | Purpose::Scores | Purpose::Masks | Purpose::Labels => {
                    dialog.pick_folder()
                }
                Purpose::File => dialog.pick_file(),
                Purpose::Output(output) => match output.file_name() {
                    Some(name) => dialog.set_file_name(name).save_file(),
                    None => dialog.pick_folder(),
                },
            };
            // The window may be gone by now: then nobody waits for the answer.
            if sender.send((purpose, path, started.elapsed())).is_ok() {
                ctx.request_repaint();
            }
        };
        if std::thread::Builder::new().name("dialog".into()).spawn(work).is_err() {
            self.waiting = false;
            self.type_path(purpose, "No file dialog could be started: type or paste a path.");
        }
    }

    /// True where the system's dialog is open, or is about to be.
    pub(crate) fn is_waiting(&self) -> bool {
        self.waiting
    }

    /// True where the path box is open.
    pub(crate) fn is_path_box_open(&self) -> bool {
        self.path_box.is_some()
    }

    /// Shows the path box.
    pub(crate) fn type_path(&mut self, purpose: Purpose, why: &'static str) {
        self.path_box = Some(PathBox { purpose, text: String::new(), why, fresh: true });
    }

    /// Shows what is open; returns a path when one was chosen.
    pub(crate) fn show(&mut self, ctx: &egui::Context) -> Option<(Purpose, PathBuf)> {
        if let Ok((purpose, path, took)) = self.answers.try_recv() {
            self.waiting = false;
            match path {
                Some(path) => return Some((purpose, path)),
                None if took < NEVER_SHOWN => {
                    self.type_path(purpose, "This desktop has no file dialog: type or paste a path.");
                }
                None => {}
            }
        }
        let state = self.path_box.as_mut()?;
        let mut answer = None;
        let mut close = false;
        let modal = egui::Modal::new(egui::Id::unique("path box")).show(ctx, |ui| {
            ui.set_width(460.0);
            let p = Palette::of(ui);
            ui.label(RichText::new(state.purpose.title()).heading());
            if !state.why.is_empty() {
                ui.label(RichText::new(state.why).color(p.caution));
            }
            let edit = egui::TextEdit::singleline(&mut state.text).hint_text("/path/to/folder").desired_width(460.0);
            let edit = ui.add(edit).accessible_name("Path");
            if std::mem::take(&mut state.fresh) {
                edit.request_focus();
            }
            let what = match state.purpose {
                Purpose::Output(output) => match output.file_name() {
                    Some(name) => format!("A file such as {name}"),
                    None => "A folder; it is made if it is not there.".to_owned(),
                },
                Purpose::Labels => "A folder on another disk; touch2touch_masks is made in it.".to_owned(),
                Purpose::Masks => {
                    "The folder of an export, one of its parts, or one .png, .npy or .json of masks.".to_owned()
                }
                Purpose::Scores => "A folder of .parquet files that touch2touch.ray wrote, or one of them.".to_owned(),
                _ => "A folder in the lab's layout, a folder of image pairs, or any file in one.".to_owned(),
            };
            ui.label(caption(what, p));
            let enter = edit.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            ui.horizontal(|ui| {
                let text = state.text.trim();
                let ok = ui.add_enabled(!text.is_empty(), egui::Button::new("Use this path"));
                if (ok.on_hover_text("Take the path (Enter)").clicked() || enter) && !text.is_empty() {
                    answer = Some((state.purpose, PathBuf::from(text)));
                    close = true;
                }
                close |= ui.button("Close").on_hover_text("Leave everything as it is (Esc)").clicked();
            });
        });
        if close || modal.should_close() {
            self.path_box = None;
        }
        answer
    }
}
