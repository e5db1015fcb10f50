//! Choosing a folder or file: the system's dialog on a thread of its own, and a path box where there is none.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use eframe::egui::{self, Key, RichText};

use crate::app::view::Purpose;
use crate::ui::parts::theme::{Palette, caption};
use touch2touch_pipeline::io::dataset::BuiltIn;

/// A dialog that ends empty sooner than a person could have closed it was never shown.
const NEVER_SHOWN: Duration = Duration::from_millis(700);

impl Purpose {
    /// Objection to a path, in words.
    fn objection(self, path: &Path) -> Option<String> {
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let writes_file = matches!(self, Self::Output(output) if output.file_name().is_some());
        let (named, shown) = (path.to_str().and_then(BuiltIn::named), path.display());
        match self {
            Self::Folder if named.is_some() => None,
            Self::Folder | Self::Masks => (!path.exists()).then(|| format!("There is nothing at {shown}")),
            _ if writes_file && path.is_dir() => Some(format!("{shown} is a folder: name a file in it")),
            _ if writes_file => parent
                .filter(|parent| !parent.is_dir())
                .map(|parent| format!("There is no folder {}", parent.display())),
            _ => path.is_file().then(|| format!("{shown} is a file, not a folder")),
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Folder => "Open a folder of pairs",
            Self::Output(output) => output.title(),
            Self::Labels => "Save the labels to a folder",
            Self::Masks => "Import masks from a folder",
            Self::Table => "Write the results table to a folder",
        }
    }
}

/// The path box.
struct PathBox {
    purpose: Purpose,
    text: String,
    why: String,
    fresh: bool,
}

/// The end of the system's dialog.
struct Answer {
    purpose: Purpose,
    path: Option<PathBuf>,
    /// False where nobody can have seen it.
    shown: bool,
}

/// Dialogs under way.
pub(crate) struct Dialogs {
    sender: Sender<Answer>,
    answers: Receiver<Answer>,
    /// True where the system's dialog is open, or is about to be.
    pub waiting: bool,
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
        let work = move || {
            let possible = system::has_dialogs();
            let started = Instant::now();
            let dialog = rfd::FileDialog::new().set_title(purpose.title());
            let path = match purpose {
                _ if !possible => None,
                Purpose::Folder | Purpose::Table | Purpose::Masks | Purpose::Labels => dialog.pick_folder(),
                Purpose::Output(output) => match output.file_name() {
                    Some(name) => dialog.set_file_name(name).save_file(),
                    None => dialog.pick_folder(),
                },
            };
            let shown = path.is_some() || (possible && started.elapsed() >= NEVER_SHOWN);
            // The window may be gone by now: then nobody waits for the answer.
            if sender.send(Answer { purpose, path, shown }).is_ok() {
                ctx.request_repaint();
            }
        };
        if std::thread::Builder::new().name("dialog".into()).spawn(work).is_err() {
            self.waiting = false;
            self.type_path(purpose, "No file dialog could be started: type or paste a path.");
        }
    }

    /// True where the path box is open.
    pub(crate) fn is_path_box_open(&self) -> bool {
        self.path_box.is_some()
    }

    /// Shows the path box.
    pub(crate) fn type_path(&mut self, purpose: Purpose, why: &str) {
        self.path_box = Some(PathBox { purpose, text: String::new(), why: why.to_owned(), fresh: true });
    }

    /// Shows what is open; returns a path when one was chosen.
    pub(crate) fn show(&mut self, ctx: &egui::Context) -> Option<(Purpose, PathBuf)> {
        if let Ok(Answer { purpose, path, shown }) = self.answers.try_recv() {
            self.waiting = false;
            if let Some(path) = path {
                return Some((purpose, path));
            }
            if !shown {
                self.type_path(purpose, "This desktop has no file dialog: type or paste a path.");
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
                ui.label(RichText::new(&state.why).color(p.caution));
            }
            // A name of its own: it keeps the focus where a complaint comes above it.
            let edit = egui::TextEdit::singleline(&mut state.text).id_salt("path").hint_text("/path/to/folder");
            let edit = edit.desired_width(460.0);
            let edit = ui.add(edit).accessible_name("Path");
            if std::mem::take(&mut state.fresh) {
                edit.request_focus();
            }
            let what = match state.purpose {
                Purpose::Output(output) => match output.file_name() {
                    Some(name) => format!("A file such as {name}"),
                    None => "A folder; it is created if missing.".to_owned(),
                },
                Purpose::Labels => "A folder on another disk; touch2touch_masks is created in it.".to_owned(),
                Purpose::Masks => "The folder of an export, one of its splits, or one mask (.png).".to_owned(),
                _ => "A folder in the lab's layout, a folder of image pairs, or any file in one.".to_owned(),
            };
            ui.label(caption(what, p));
            let enter = edit.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            ui.horizontal(|ui| {
                let text = state.text.trim();
                let ok = ui.add_enabled(!text.is_empty(), egui::Button::new("Use this path"));
                if (ok.on_hover_text("Use this path (Enter)").clicked() || enter) && !text.is_empty() {
                    let path = from_home(text);
                    match state.purpose.objection(&path) {
                        Some(why) => (state.why, state.fresh) = (why, true),
                        None => {
                            answer = Some((state.purpose, path));
                            close = true;
                        }
                    }
                }
                close |= ui.button("Close").on_hover_text("Cancel (Esc)").clicked();
            });
        });
        if close || modal.should_close() {
            self.path_box = None;
        }
        answer
    }
}

/// A path as a shell reads it: `~` is the home folder.
fn from_home(text: &str) -> PathBuf {
    match (text.strip_prefix('~'), std::env::home_dir()) {
        (Some(rest), Some(home)) if rest.is_empty() || rest.starts_with('/') => home.join(rest.trim_start_matches('/')),
        _ => PathBuf::from(text),
    }
}

/// The programs that show file dialogs on a Linux desktop: a portal, else zenity. The library that asks them says "cancelled" where neither
/// is there, and waits half a minute for a portal that does not answer.
#[cfg(target_os = "linux")]
mod system {
    use std::time::Duration;

    /// A portal may have to be started first.
    const PATIENCE: Duration = Duration::from_secs(5);

    pub(super) fn has_dialogs() -> bool {
        let folders = std::env::var_os("PATH").unwrap_or_default();
        futures_lite::future::block_on(portal()).is_ok()
            || std::env::split_paths(&folders).any(|folder| folder.join("zenity").is_file())
    }

    async fn portal() -> zbus::Result<()> {
        let bus = zbus::connection::Builder::session()?.method_timeout(PATIENCE).build().await?;
        let (name, path) = ("org.freedesktop.portal.Desktop", "/org/freedesktop/portal/desktop");
        let (properties, asked) =
            ("org.freedesktop.DBus.Properties", ("org.freedesktop.portal.FileChooser", "version"));
        bus.call_method(Some(name), path, Some(properties), "Get", &asked).await.map(drop)
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    pub(super) fn has_dialogs() -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::export::{Output, StillAsked};
    use touch2touch_pipeline::still::space::{Ground, SpacePane, ViewAngles};

    #[test]
    fn a_path_that_cannot_be_what_is_asked_for_is_refused_in_words() {
        let dir = tempfile::tempdir().unwrap();
        let (file, new) = (dir.path().join("file"), dir.path().join("new"));
        std::fs::write(&file, "").unwrap();
        let output = Output::Still(StillAsked {
            pane: SpacePane::Both,
            width_px: 960,
            ground: Ground::White,
            angles: ViewAngles::default(),
            turntable: None,
        });
        assert!(output.file_name().is_some());
        let picture = Purpose::Output(output);
        for (purpose, path, said) in [
            (Purpose::Folder, dir.path(), None),
            (Purpose::Folder, &new, Some("nothing at")),
            (Purpose::Folder, Path::new("test-set"), None),
            (Purpose::Masks, Path::new("test-set"), Some("nothing at")),
            (Purpose::Folder, &file, None),
            (Purpose::Labels, &new, None),
            (Purpose::Labels, &file, Some("is a file")),
            (picture, &new, None),
            (picture, dir.path(), Some("is a folder")),
            (picture, &new.join("a"), Some("no folder")),
            (picture, Path::new("a"), None),
        ] {
            let why = purpose.objection(path);
            assert_eq!(why.is_some(), said.is_some(), "{purpose:?} {}: {why:?}", path.display());
            assert!(why.unwrap_or_default().contains(said.unwrap_or_default()));
        }
        let home = std::env::home_dir().unwrap();
        assert_eq!([from_home("~"), from_home("~/a"), from_home("~a")], [home.clone(), home.join("a"), "~a".into()]);
    }
}
