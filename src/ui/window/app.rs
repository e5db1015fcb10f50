//! The window: one frame from input to commands.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use eframe::egui::{self, ThemePreference, ViewportCommand};
use egui_tiles::Tree;
use strum::IntoEnumIterator as _;

pub use super::lost::Loss;
use super::pane::{Docking, Panes};
use super::screenshot::Shot;
use super::{bars, doctor, export, layout, lost, palette, pane, place, shortcuts, unsaved};
use crate::app::action::Action;
use crate::app::command::{
    Command, ExportCommand, LabelsCommand, LibraryCommand, Pane, PredictCommand, SettingsCommand, TasksCommand,
    UiRequest, UnsavedCommand, ViewCommand,
};
use crate::app::evaluate::EvaluateCommand;
use crate::app::keys::ImprintSource;
use crate::app::library::Place;
use crate::app::pane::{Kind, Workspace};
use crate::app::results;
use crate::app::runtime::Runtime;
use crate::app::services::Services;
use crate::app::settings::{Last, MaskTool, Theme, WindowPlace, prefer};
use crate::app::state::State;
use crate::app::view::Purpose;
use crate::app::workbench::{WorkbenchCommand, in_hand};
use crate::ui::panes::log as log_pane;
use crate::ui::parts::cx::{Cx, Shared};
use crate::ui::parts::frame_cache::FrameCache;
use crate::ui::parts::letters;
use crate::ui::parts::scene_view::Device;
use crate::ui::parts::theme::{self, DARK, LIGHT};
use touch2touch_core::rig::SensorKind;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::io::catch_panic::catch_panic;
use touch2touch_pipeline::io::fonts;

/// Options that the studio is started with.
pub struct Options {
    /// Files and models.
    pub services: Arc<Services>,
    /// Path to open; `None` opens what was open last, else the demo.
    pub open: Option<PathBuf>,
    /// Jobs run between frames on the window's own thread, one per frame, instead of on workers of their own: the same
    /// input then gives the same frames (tests).
    pub inline: bool,
    /// True where the system's file dialogs are tried before the path box.
    pub native_dialogs: bool,
    /// True where all preferences and layouts start from their defaults.
    pub reset: bool,
    /// Folder that pictures are written to; `None` = the user's folder for pictures.
    pub screenshots: Option<PathBuf>,
    /// Loss of the graphics device: whoever opened the window asks it when the window is closed.
    pub loss: Loss,
    /// True where every frame is painted whole even where a program draws (for measuring what [`crate::ui::parts::frame_cache`] saves).
    pub whole_frames: bool,
}

impl Options {
    /// The usual ones.
    pub fn new(services: Arc<Services>, open: Option<PathBuf>) -> Self {
        Self {
            services,
            open,
            inline: false,
            native_dialogs: true,
            reset: false,
            screenshots: None,
            loss: Loss::default(),
            whole_frames: false,
        }
    }
}

/// The studio.
pub struct StudioApp {
    state: State,
    runtime: Runtime,
    inbox: Vec<Command>,
    shared: Shared,
    panes: Panes,
    palette: palette::Memory,
    shortcuts: shortcuts::Memory,
    trees: BTreeMap<Workspace, Tree<Pane>>,
    device: Result<Device, String>,
    first_prediction: bool,
    /// True once cameras and the large pane of the last run were looked for.
    resumed: bool,
    applied_theme: Option<Theme>,
    applied_zoom: f32,
    folder: Option<PathBuf>,
    /// Place on the desktop.
    place: Option<WindowPlace>,
    /// True where the window may close: everything is saved, or is not to be.
    leaving: bool,
    /// True once everything that has to be done at the end was done.
    ended: bool,
    shot_sender: Sender<(Shot, Arc<egui::ColorImage>)>,
    shots: Receiver<(Shot, Arc<egui::ColorImage>)>,
    loss: Loss,
    _watched: Option<lost::Watched>,
    /// Letters that no font has; the first is said.
    lacking: Receiver<char>,
    lacks_letters: bool,
}

impl StudioApp {
    /// Gives the window its look, takes its graphics device and starts reading.
    pub fn new(cc: &eframe::CreationContext<'_>, options: Options) -> Self {
        theme::install(&cc.egui_ctx);
        let lacking = letters::install(&cc.egui_ctx);
        let watched = cc.wgpu_render_state.as_ref().map(|state| {
            // A larger window could not be drawn.
            let most = state.device.limits().max_texture_dimension_2d as f32 / cc.egui_ctx.pixels_per_point();
            cc.egui_ctx.send_viewport_cmd(ViewportCommand::MaxInnerSize(egui::Vec2::splat(most)));
            options.loss.watch(&state.device, &cc.egui_ctx)
        });
        let device = match &cc.wgpu_render_state {
            Some(state) => Device::new(state).map_err(|e| e.to_string()),
            None => Err("The window was opened without a graphics device that can draw 3D.".to_owned()),
        };
        if let Err(why) = &device {
            log::error!("No 3D views: {why}");
        }
        if let Some(state) = cc.wgpu_render_state.as_ref().filter(|_| !options.whole_frames)
            && let Err(error) = FrameCache::install(&cc.egui_ctx, state)
        {
            log::error!("Every frame is painted whole: {error}");
        }
        let ctx = cc.egui_ctx.clone();
        let (shot_sender, shots) = channel();
        let mut runtime = if options.inline {
            Runtime::inline(options.services.clone())
        } else {
            Runtime::threads(options.services.clone(), Arc::new(move || ctx.request_repaint()))
        };
        let mut state = State::default();
        let place = options.open.map(Place::Path);
        let requests = runtime.start(&mut state, place);
        let mut inbox: Vec<Command> = requests.into_iter().map(|request| ViewCommand::Ui(request).into()).collect();
        inbox.extend(lost::greeting().map(|said| TasksCommand::Report(said).into()));
        if options.reset {
            inbox.push(Command::Settings(SettingsCommand::ResetSettings));
        }
        Self {
            state,
            runtime,
            inbox,
            shared: Shared::new(options.native_dialogs),
            panes: Panes::default(),
            palette: palette::Memory::default(),
            shortcuts: shortcuts::Memory::default(),
            trees: BTreeMap::new(),
            device,
            first_prediction: false,
            resumed: false,
            applied_theme: None,
            applied_zoom: 1.0,
            folder: options.screenshots,
            place: None,
            leaving: false,
            ended: false,
            shot_sender,
            shots,
            loss: options.loss,
            _watched: watched,
            lacking,
            lacks_letters: false,
        }
    }

    /// State of the studio. For tests and the screenshot tool.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Executes a command before the next frame. For tests and the screenshot tool.
    pub fn push(&mut self, command: impl Into<Command>) {
        self.inbox.push(command.into());
    }

    /// Loss of the graphics device. For tests.
    pub fn loss(&self) -> &Loss {
        &self.loss
    }

    /// Pictures sent to the graphics card so far.
    pub fn uploads(&self) -> u64 {
        self.shared.textures.uploads
    }

    /// Pixels of the window painted so far, where only what changed is painted. For tests.
    pub fn painted(&self, ctx: &egui::Context) -> Option<u64> {
        ctx.with_plugin(|cache: &mut FrameCache| cache.painted)
    }

    /// True where nothing runs, nothing waits and nothing is to be executed.
    pub fn is_idle(&self) -> bool {
        self.inbox.is_empty() && self.state.tasks.is_idle()
    }

    /// Place of a point of the grasp frame (meters) in a 3D pane when it was last drawn, points. For tests.
    pub fn on_screen(&self, source: ImprintSource, p: [f64; 3]) -> Option<egui::Pos2> {
        self.panes.memories.scene.on_screen(source, p.into())
    }

    /// Rectangle of each pane when it was drawn last, points. For tests.
    pub fn places(&self) -> BTreeMap<Pane, egui::Rect> {
        self.panes.places.clone()
    }

    /// The panes of the workspace in front are arranged validly. For tests.
    pub fn layout_is_valid(&self) -> bool {
        self.trees.iter().all(|(workspace, tree)| layout::is_valid(tree, *workspace))
    }

    /// On the first start a prediction is made unasked, so that there is something to see.
    fn first_prediction(&mut self) {
        if self.first_prediction || self.state.library.open.is_none() || self.state.settings.hint_dismissed {
            return;
        }
        let demo = self.state.library.open.as_ref().is_some_and(|o| o.place == Place::Demo);
        if !demo || self.state.library.opening.is_some() {
            self.first_prediction = !demo;
            return;
        }
        if results::can_generate(&self.state).is_ok() && results::sample(&self.state).ready().is_some() {
            self.first_prediction = true;
            if results::chosen(&self.state, self.state.selection.finger).is_none() {
                self.inbox.push(Command::Predict(PredictCommand::Generate));
            }
        }
    }

    /// Once, as the first data set is there: cameras and the large pane as they were when it was last closed.
    fn resume(&mut self) {
        let Some(open) = self.state.library.open.as_ref().filter(|_| !self.resumed) else { return };
        self.resumed = true;
        let last = &self.state.settings.last;
        if last.place.as_ref() == Some(&open.place) {
            self.panes.memories.scene.resume(open.seq, &last.cameras);
            self.panes.maximized = serde_json::from_str(&last.maximized).ok();
        }
    }

    /// Keeps what is on screen for the next start; closing the window does it.
    pub fn remember(&mut self) {
        let state = &self.state;
        let last = Last {
            place: state.library.open.as_ref().map(|open| open.place.clone()),
            pair: state.pair_name().to_owned(),
            finger: state.selection.finger.index(),
            both_fingers: state.selection.both_fingers,
            cameras: self.panes.memories.scene.cameras(),
            maximized: self.panes.maximized.and_then(|pane| serde_json::to_string(&pane).ok()).unwrap_or_default(),
            sort: state.library.sort,
            window: self.place,
        };
        self.inbox.push(Command::Settings(SettingsCommand::Remember(last)));
    }

    /// Does what only the window can do.
    fn perform(&mut self, ctx: &egui::Context, request: UiRequest) {
        match request {
            UiRequest::Pick(purpose) => self.shared.dialogs.open(purpose, ctx),
            UiRequest::Close => {
                self.leaving = true;
                ctx.send_viewport_cmd(ViewportCommand::Close);
            }
            UiRequest::Camera(preset) => self.panes.memories.scene.look_from(preset),
            UiRequest::Fit => {
                let memories = &mut self.panes.memories;
                match self.panes.hovered.map(Pane::kind) {
                    Some(Kind::Scene) => memories.scene.fit(),
                    Some(Kind::Color) => self.shared.views.fit(Some(SensorKind::Color)),
                    Some(Kind::Imprint(_) | Kind::Compare) => self.shared.views.fit(Some(SensorKind::Depth)),
                    _ => {
                        self.shared.views.fit(None);
                        memories.scene.fit();
                    }
                }
            }
            UiRequest::ShowPane(pane) => self.show_pane(pane),
            UiRequest::StepPane(by) => self.panes.step(ctx, by),
            UiRequest::Screenshot => self.shoot(ctx, None, false),
            UiRequest::PanePicture { pane, copied } => {
                let place = pane.or(self.panes.hovered).and_then(|pane| self.panes.places.get(&pane).copied());
                // Of no pane it is the whole window, unless that pane was asked for.
                if place.is_some() || pane.is_none() {
                    self.shoot(ctx, place, copied);
                }
            }
            UiRequest::ToggleFullscreen => {
                let full = ctx.input(|i| i.viewport().fullscreen.unwrap_or(false));
                ctx.send_viewport_cmd(ViewportCommand::Fullscreen(!full));
            }
            UiRequest::ToggleMaximized => {
                self.panes.maximized = match self.panes.maximized {
                    Some(_) => None,
                    None => self.panes.hovered.or(Some(Pane::Measured)),
                };
                // The picture is of another shape.
                self.panes.memories.scene.fit();
            }
            UiRequest::ResetWorkspace => {
                let workspace = self.state.settings.workspace;
                self.panes.maximized = None;
                self.trees.insert(workspace, layout::default_tree(workspace));
                self.store_layout(workspace);
            }
            UiRequest::CopyHovered => {
                if let Some(text) = &self.shared.readout {
                    ctx.copy_text(text.clone());
                }
            }
            UiRequest::FocusFilter => self.panes.memories.browser.focus_filter = true,
        }
        ctx.request_repaint();
    }

    /// Brings a pane to the front, in the workspace in front if it is there, else in the first that has it.
    fn show_pane(&mut self, pane: Pane) {
        let own = self.state.settings.workspace;
        let all = std::iter::once(own).chain(Workspace::iter());
        let Some(workspace) = all.into_iter().find(|w| pane.dock(*w).is_some()) else { return };
        if workspace != own {
            self.inbox.push(prefer(move |s| s.workspace = workspace).into());
        }
        self.panes.maximized = None;
        let stored = self.state.settings.layouts.get(workspace.name());
        let tree = self.trees.entry(workspace).or_insert_with(|| layout::restore(stored, workspace));
        if let Some(id) = tree.tiles.find_pane(&pane) {
            tree.set_visible(id, true);
            tree.make_active(|tile, _| tile == id);
        }
        self.store_layout(workspace);
    }

    fn store_layout(&mut self, workspace: Workspace) {
        if let Some(text) = self.trees.get(&workspace).and_then(layout::to_text) {
            self.inbox.push(Command::Settings(SettingsCommand::SetLayout(workspace, text)));
        }
    }

    /// Folders and files dropped on the window, a screenshot that arrived, and letters that no font has.
    fn outside(&mut self, ctx: &egui::Context) {
        if !self.lacks_letters && self.lacking.try_recv().is_ok() {
            self.lacks_letters = true;
            let why = "no font on this computer has Chinese, Japanese or Korean characters; they show as boxes";
            self.inbox.push(TasksCommand::Report(TaskError::new("Letters", why).with_hint(fonts::ADVICE)).into());
        }
        let dropped: Vec<PathBuf> = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
        if let Some(path) = dropped.into_iter().next() {
            self.inbox.push(Command::Library(LibraryCommand::Open(Place::Path(path))));
        }
        while let Ok((shot, image)) = self.shots.try_recv() {
            self.inbox.push(shot.take(ctx, self.folder.as_deref(), &image));
        }
    }

    /// Asks for a picture of the window, or of a part of it (points).
    fn shoot(&self, ctx: &egui::Context, part: Option<egui::Rect>, copied: bool) {
        let shot = Shot { part, copied, scale: ctx.pixels_per_point() };
        let (sender, wake) = (self.shot_sender.clone(), ctx.clone());
        ctx.request_screenshot(move |image| {
            // The window may be gone by now: then nobody waits for the picture.
            if sender.send((shot, image)).is_ok() {
                wake.request_repaint();
            }
        });
    }

    /// Saves what can be saved; what cannot waits for the next start.
    fn end(&mut self) {
        if std::mem::replace(&mut self.ended, true) {
            return;
        }
        let ended = catch_panic(|| {
            self.remember();
            let commands = std::mem::take(&mut self.inbox);
            self.runtime.tick(&mut self.state, commands);
            let last = vec![Command::Labels(LabelsCommand::EndStroke), Command::Labels(LabelsCommand::Save)];
            self.runtime.tick(&mut self.state, last);
            self.runtime.finish(&mut self.state);
        });
        if let Err(message) = ended {
            log::error!("at the end: {message}");
        }
    }

    /// Follows the pen no further; whether it was drawing.
    fn lift_pen(&mut self) -> bool {
        let memories = &mut self.panes.memories;
        memories.images.lift_pen() | memories.scene.lift_pen()
    }

    /// Tells the model what is on screen now, and drops a cross-hair that no pane holds any more. `readout` is what the
    /// status bar shows.
    fn after_panes(&mut self, ctx: &egui::Context, readout: Option<&String>, out: &mut Vec<Command>) {
        let drawn = self.panes.drawn.iter().copied().collect();
        if drawn != self.state.selection.panes {
            out.push(Command::View(ViewCommand::ShowPanes(drawn)));
        }
        if self.state.selection.hover.is_some() && !self.shared.hover_claimed {
            out.push(Command::View(ViewCommand::HoverPixel(None)));
        }
        if self.shared.readout.as_ref() != readout {
            // The status bar was drawn before the pane under the pointer: once more, with the number in it.
            ctx.request_repaint();
        }
        // What is made of clicks goes on while no button is down. A whole click may lie between two frames: then the state
        // does not know yet of the drawing that it began.
        let by_tool = self.state.settings.mask.tool == MaskTool::Polygon;
        let by_clicks = self.state.document.stroke.as_ref().map_or(by_tool, |stroke| stroke.drawing.is_by_clicks());
        if !by_clicks && !ctx.input(|i| i.pointer.any_down()) && self.lift_pen() {
            out.push(Command::Labels(LabelsCommand::EndStroke));
        }
    }
}

impl eframe::App for StudioApp {
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        if self.loss.why().is_some() {
            // Nothing can be asked in a window that is not drawn.
            self.end();
            self.leaving = true;
            ctx.send_viewport_cmd(ViewportCommand::Close);
            return;
        }
        self.place = place::of(ctx, self.place);
        let doc = &self.state.document;
        let open = !doc.unsaved.is_empty() || doc.stroke.is_some();
        if open && !self.leaving && ctx.input(|i| i.viewport().close_requested()) {
            ctx.send_viewport_cmd(ViewportCommand::CancelClose);
            self.inbox.push(LabelsCommand::Unsaved(UnsavedCommand::Close).into());
        }
        let commands = std::mem::take(&mut self.inbox);
        let travels = |c: &Command| matches!(c, Command::Labels(LabelsCommand::Undo | LabelsCommand::Redo));
        let travels = commands.iter().any(travels);
        if commands.iter().any(|c| matches!(c, Command::Settings(SettingsCommand::ResetSettings))) {
            self.trees.clear();
        }
        let before = self.state.settings.workspace;
        let requests = self.runtime.tick(&mut self.state, commands);
        if travels && !self.state.document.has_open_polygon() {
            // The pen is not to be followed into another state or workspace.
            self.lift_pen();
        }
        if self.state.settings.workspace != before {
            self.lift_pen();
            self.panes.memories.browser.scrolled_to = None;
        }
        if crate::app::jobs::Worker::iter().any(|worker| self.runtime.run_one(worker)) {
            ctx.request_repaint();
        }
        for request in requests {
            self.perform(ctx, request);
        }
        if let Some(wait) = self.runtime.next_tick() {
            ctx.request_repaint_after(wait);
        }
        self.shared.saved.observe(&self.state.document.unsaved);
        self.first_prediction();
        self.resume();
        let settings = &self.state.settings;
        if self.applied_theme != Some(settings.theme) {
            self.applied_theme = Some(settings.theme);
            ctx.set_theme(match settings.theme {
                Theme::Dark => ThemePreference::Dark,
                Theme::Light => ThemePreference::Light,
            });
        }
        // Ctrl + and Ctrl - change the toolkit's zoom: keep it; a zoom from the settings is applied once.
        if (self.applied_zoom - settings.ui_zoom).abs() > 1e-4 {
            self.applied_zoom = settings.ui_zoom;
            ctx.set_zoom_factor(settings.ui_zoom);
        } else if (ctx.zoom_factor() - self.applied_zoom).abs() > 1e-4 {
            self.applied_zoom = ctx.zoom_factor();
            let zoom = self.applied_zoom;
            self.inbox.push(prefer(move |s| s.ui_zoom = zoom).into());
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.outside(&ctx);
        self.shared.textures.begin_frame();
        self.panes.drawn.clear();
        self.shared.hover_claimed = false;
        // Keys come before the panes.
        let over = self.panes.hovered.take();
        self.shortcuts.observe(over);
        let workspace = self.state.settings.workspace;
        let stored = self.state.settings.layouts.get(workspace.name());
        let mut tree = self.trees.remove(&workspace).unwrap_or_else(|| layout::restore(stored, workspace));
        let mut out = Vec::new();
        let palette_colors = if ui.visuals().dark_mode { &DARK } else { &LIGHT };
        let mut edited;
        let readout;
        {
            let mut cx = Cx {
                state: &self.state,
                out: &mut out,
                shared: &mut self.shared,
                device: self.device.as_ref().map_err(String::as_str),
                p: palette_colors,
            };
            let covered = cx.state.selection.palette
                || cx.state.selection.shortcut_sheet
                || cx.shared.dialogs.is_path_box_open()
                || cx.state.document.question.is_some();
            let state = cx.state;
            let export = &state.export;
            let place = shortcuts::Place {
                covered,
                dialog: export.asking_masks
                    || export.importing.is_some()
                    || export.still.is_some()
                    || cx.shared.dialogs.waiting,
                labeling: state.is_labeling(),
            };
            let possible = |action: Action| action.command(state).is_some() && shortcuts::fits_pane(action, over);
            for action in shortcuts::pressed(&ctx, place, possible) {
                if action == Action::CancelJobs && self.panes.maximized.take().is_some() {
                    continue;
                }
                cx.act(action);
            }
            if in_hand(state) {
                for (axis, steps) in shortcuts::nudges(&ctx, place) {
                    cx.push(WorkbenchCommand::Nudge(axis, steps * axis.step()));
                }
            }
            edited = bars::top(&mut cx, ui, &mut tree);
            // Drawn before the panes, so it shows the read-out of the frame before: at rest they are the same.
            bars::bottom(&mut cx, ui);
            readout = cx.shared.readout.take();
            let frame = egui::Frame::new().fill(cx.p.frame);
            egui::CentralPanel::default().frame(frame).show(ui, |ui| match self.panes.maximized {
                Some(p) => pane::show_maximized(&mut cx, ui, &mut self.panes, p),
                None => {
                    let hidden = layout::collapse(&mut tree, self.panes.idle(&self.state));
                    let mut docking = Docking { cx: &mut cx, panes: &mut self.panes, edited: false };
                    tree.ui(&mut docking, ui);
                    edited |= docking.edited;
                    layout::restore_collapsed(&mut tree, hidden);
                }
            });
            log_pane::notices(&mut cx, &ctx);
            bars::hint(&mut cx, &ctx);
            doctor::panel(&mut cx, &ctx);
            export::masks_form(&mut cx, &ctx);
            export::import_form(&mut cx, &ctx);
            export::still_form(&mut cx, &ctx);
            palette::show(&mut cx, &ctx, &mut self.palette);
            shortcuts::list(&mut cx, &ctx, &mut self.shortcuts);
            unsaved::question(&mut cx, &ctx);
            bars::drop_overlay(&cx, &ctx);
            pane::ring(&ctx, cx.p);
            if let Some((purpose, path)) = cx.shared.dialogs.show(&ctx) {
                cx.push(match purpose {
                    Purpose::Folder => Command::Library(LibraryCommand::Open(Place::Path(path))),
                    Purpose::Output(output) => Command::Export(ExportCommand::Write(output, path)),
                    Purpose::Labels => Command::Labels(LabelsCommand::Unsaved(UnsavedCommand::Elsewhere(path))),
                    Purpose::Masks => Command::Export(ExportCommand::AskImport(Some(path))),
                    Purpose::Table => Command::Evaluate(EvaluateCommand::Export(path)),
                });
            }
        }
        self.trees.insert(workspace, tree);
        if edited {
            self.store_layout(workspace);
        }
        self.after_panes(&ctx, readout.as_ref(), &mut out);
        self.inbox.append(&mut out);
        if !self.inbox.is_empty() {
            ctx.request_repaint();
        }
    }

    fn on_exit(&mut self) {
        self.end();
    }
}

impl Drop for StudioApp {
    /// The window may go without asking: drawing it panicked. (Where an X server goes away its library ends the program at once,
    /// which is as a kill.)
    fn drop(&mut self) {
        self.end();
    }
}
