//! A studio on a small simulated data set, without a window.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use eframe::egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::Command;
use touch2touch::app::library::Place;
use touch2touch::app::results;
use touch2touch::app::services::Services;
use touch2touch::app::settings::{MaskSource, Settings};
use touch2touch::app::state::State;
use touch2touch::ui::{Options, StudioApp};
use touch2touch_core::catalog;
use touch2touch_pipeline::io::simulated::{Layout, pair_paths};

use crate::support::{tiny, write_grasps};

/// The program's services, which wait for nothing, with these preferences beside what a test of the others asks for:
/// predictions are asked for, masks come from the threshold.
fn services(config: &Path, change: impl FnOnce(&mut Settings)) -> Arc<Services> {
    let services = Services { patience: Duration::ZERO, ..Services::with_config_folder(Some(config.to_owned())) };
    let mut settings = services.load_settings().0;
    settings.generate.by_itself = false;
    (settings.about_own_data, settings.hint_dismissed) = (false, true);
    change(&mut settings);
    services.save_settings(&settings).unwrap();
    Arc::new(services)
}

fn by_threshold(settings: &mut Settings) {
    settings.mask.choice.source = MaskSource::Threshold;
}

/// Writes a data set of a few simulated grasps of two tools, whose CAD models are small.
pub(super) fn write_dataset(root: &Path, grasps: u64) {
    write_grasps(root, Layout::Train, &catalog::tools()[6..8], grasps);
}

/// A studio that runs, and the folders it works in.
pub(super) struct Rig {
    pub(super) harness: Harness<'static, StudioApp>,
    pub(super) data: PathBuf,
    pub(super) config: PathBuf,
    pub(super) _folder: tempfile::TempDir,
}

impl Rig {
    /// A studio of the given size on a data set with `grasps` grasps of each of two tools.
    ///
    /// `None` where there is no graphics adapter; a failure where the check script demands one.
    pub(super) fn new(size: [f32; 2], grasps: u64) -> Option<Self> {
        crate::support::gpu()?;
        let folder = tempfile::tempdir().unwrap();
        let (data, config) = (folder.path().join("data"), folder.path().join("config"));
        write_dataset(&data, grasps);
        let services = services(&config, by_threshold);
        let harness = Self::build(size, services, Some(data.clone()), true);
        let mut rig = Self { harness, data, config, _folder: folder };
        rig.settle();
        Some(rig)
    }

    /// As [`Rig::new`] on `pairs` pairs of one tool that are the same files, read on workers of their own while frames go on.
    pub(super) fn paging(size: [f32; 2], pairs: u64) -> Option<Self> {
        crate::support::gpu()?;
        let folder = tempfile::tempdir().unwrap();
        let (data, config) = (folder.path().join("data"), folder.path().join("config"));
        let tool = &catalog::tools()[6];
        write_grasps(&data, Layout::Train, std::slice::from_ref(tool), 1);
        let written = pair_paths(&data, Layout::Train, &tool.name, 0);
        for index in 1..pairs {
            for (file, again) in written.iter().zip(pair_paths(&data, Layout::Train, &tool.name, index)) {
                std::fs::hard_link(file, again).unwrap();
            }
        }
        let services = services(&config, by_threshold);
        let mut rig =
            Self { harness: Self::build(size, services, Some(data.clone()), false), data, config, _folder: folder };
        rig.until("the first pair", |state| state.library.open.is_some() && results::sample(state).ready().is_some());
        Some(rig)
    }

    /// As [`Rig::new`] with workers of its own.
    pub(super) fn threaded(size: [f32; 2]) -> Option<Self> {
        let mut rig = Self::new(size, 1)?;
        rig.harness = Self::build(size, services(&rig.config, |_| {}), Some(rig.data.clone()), false);
        rig.until("the data set", |state| state.library.open.is_some() && results::sample(state).ready().is_some());
        Some(rig)
    }

    /// As [`Rig::new`] with the tiny bundles of the tests and one of them chosen.
    pub(super) fn with_bundle(size: [f32; 2], name: &str) -> Option<Self> {
        let mut rig = Self::new(size, 1)?;
        let services = services(&rig.config, |settings| {
            settings.bundle_folders = vec![tiny("")];
            settings.generate.bundle = Some(name.to_owned());
            settings.mask.choice.source = MaskSource::default();
        });
        rig.harness = Self::build(size, services, Some(rig.data.clone()), true);
        rig.settle();
        Some(rig)
    }

    /// Frames until something is so; a failure after five minutes.
    pub(super) fn until(&mut self, what: &str, so: impl Fn(&State) -> bool) {
        let begin = std::time::Instant::now();
        while !so(self.state()) {
            assert!(begin.elapsed().as_secs() < 300, "waited for {what}: {:?}", self.state().tasks);
            self.harness.step();
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        self.harness.step();
    }

    /// A studio with the shipped models on a place. `None` as for [`Rig::new`].
    pub(super) fn live(size: [f32; 2], place: Place) -> Option<Self> {
        crate::support::gpu()?;
        Self::greeting(size, place, false)
    }

    /// As [`Rig::live`]; with `about`, the panel about the data opens as it does for a person.
    pub(super) fn greeting(size: [f32; 2], place: Place, about: bool) -> Option<Self> {
        crate::support::gpu()?;
        let folder = tempfile::tempdir().unwrap();
        let (data, config) = (folder.path().join("data"), folder.path().join("config"));
        let services = services(&config, |settings| settings.about_own_data = about);
        let open = match place {
            Place::Demo => None,
            Place::Path(path) => Some(path),
        };
        let harness = Self::build(size, services, open, true);
        let mut rig = Self { harness, data, config, _folder: folder };
        rig.settle();
        Some(rig)
    }

    fn build(
        size: [f32; 2],
        services: Arc<Services>,
        open: Option<PathBuf>,
        inline: bool,
    ) -> Harness<'static, StudioApp> {
        let mut options = Options::new(services, open);
        options.inline = inline;
        Self::build_with(size, options)
    }

    /// The same studio on the same data, painted whole in every frame.
    pub(super) fn painted_whole(&self, size: [f32; 2]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let config = folder.path().join("config");
        let mut options = Options::new(services(&config, by_threshold), Some(self.data.clone()));
        options.inline = true;
        options.whole_frames = true;
        let harness = Self::build_with(size, options);
        let mut rig = Self { harness, data: self.data.clone(), config, _folder: folder };
        rig.settle();
        rig
    }

    fn build_with(size: [f32; 2], mut options: Options) -> Harness<'static, StudioApp> {
        options.native_dialogs = false;
        Harness::builder()
            .with_size(size)
            .with_max_steps(400)
            .wgpu()
            .build_eframe(move |cc| StudioApp::new(cc, options))
    }

    /// Closes the studio and starts it again on the same folders.
    pub(super) fn restart(&mut self, size: [f32; 2]) {
        self.harness = Self::build(size, services(&self.config, |_| {}), Some(self.data.clone()), true);
        self.settle();
    }

    /// Frames until nothing is to be done any more.
    pub(super) fn settle(&mut self) {
        for _ in 0..600 {
            self.harness.step();
            if self.harness.state().is_idle() && self.state().library.open.is_some() {
                break;
            }
        }
        assert!(self.harness.state().is_idle(), "{:?}", self.state().tasks);
        self.harness.run();
    }

    pub(super) fn state(&self) -> &State {
        self.harness.state().state()
    }

    /// Presses a key, and lets the studio come to rest.
    pub(super) fn key(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.step();
        self.settle();
    }

    /// Clicks on the first thing of this name, and lets the studio come to rest.
    pub(super) fn click(&mut self, label: &str) {
        let node = self.harness.get_all_by_label(label).next().unwrap_or_else(|| panic!("no {label:?} on screen"));
        node.click();
        self.harness.step();
        self.settle();
    }

    /// Carries a command out as if a pane had sent it.
    pub(super) fn send(&mut self, command: impl Into<Command>) {
        self.harness.state_mut().push(command);
        self.harness.step();
        self.settle();
    }

    /// Lets a pane fill the window, by the menu in its title.
    pub(super) fn fill(&mut self, title: &str) {
        for label in [format!("Menu of {title}"), format!("Fill the window: {title}")] {
            self.click(&label);
        }
    }

    /// Writes what is on screen, where a person asked for pictures (`TOUCH2TOUCH_SCREENSHOTS`).
    pub(super) fn shoot(&mut self, name: &str) {
        if let Some(folder) = std::env::var_os("TOUCH2TOUCH_SCREENSHOTS") {
            let image = self.harness.render().unwrap();
            image.save(Path::new(&folder).join(format!("{name}.png"))).unwrap();
        }
    }
}
