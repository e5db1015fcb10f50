//! A studio without a window on a small data set: real files, and the tiny models of the tests.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use tempfile::TempDir;
use touch2touch::app::command::{Answer, Command, LibraryCommand};
use touch2touch::app::library::Place;
use touch2touch::app::runtime::Runtime;
use touch2touch::app::services::Services;
use touch2touch::app::settings::{MaskSource, Settings};
use touch2touch::app::state::State;
use touch2touch::app::tasks::Level;
use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::rig::lab;
use touch2touch_core::sample::{ColorTouch, DepthTouch, PadTouch, Sample};
use touch2touch_core::sim;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::io::masks::FOLDER;
use touch2touch_pipeline::io::simulated::{Layout, pair_paths, write_pair, write_tools};
use touch2touch_pipeline::labels::{Labels, PairLabels};
use touch2touch_pipeline::steps::bundles::{self, BundleInfo};
use touch2touch_pipeline::steps::models::Models;

use crate::support::{mesh, tiny};

/// `[width, height]` of the imprints.
pub(crate) const IMPRINT_SIZE: [usize; 2] = [lab::BUBBLE.width, lab::BUBBLE.height];
/// The first pair.
pub(crate) const PAIR: &str = "tool_a/data_0";
/// A pair that is too shallow for the mask model.
pub(crate) const SHALLOW: PairId = PairId(5);
/// The pair that is a simulated grasp with its truth.
pub(crate) const SIMULATED: PairId = PairId(12);
/// The generator's name.
pub(crate) const GENERATOR: &str = "Tiny generator of the tests";

/// The tool of a pair, and the pair's number among those of that tool.
fn place_of(pair: u32) -> (&'static str, u64) {
    (["tool_a", "tool_b", "tool_c"][pair as usize / 6], (pair % 6).into())
}

/// Six touches of each of two made-up tools, and a simulated one of a third. The imprints of the first twelve are drawn: a
/// bump with a hole in it and a second bump, both in contact, and a wide shallow one, deeper with each pair.
fn write_data(root: &Path) {
    let tool = &catalog::tools()[0];
    let grasp = sim::Grasp { theta_rad: 0.2, x_m: 0.001, y_m: -0.001 };
    let simulated = sim::simulate(tool, grasp, 7, &sim::SimConfig::default());
    for pair in 0..12 {
        let finger = |(pad, sign): (usize, f32)| {
            let felt = simulated.pad(lab::PADS[pad]).unwrap();
            let ring_m = if pair == SHALLOW.0 { 0.0045 } else { 0.008 + 0.0005 * pair as f32 };
            let imprint = DepthMap::from_fn(IMPRINT_SIZE[0], IMPRINT_SIZE[1], |x, y| {
                let ring = (3..9).contains(&x) && (3..9).contains(&y) && (x, y) != (5, 5);
                let spot = (15..17).contains(&x) && (10..12).contains(&y);
                let wide = (90..150).contains(&x) && (60..120).contains(&y);
                let depth = if ring || spot {
                    ring_m
                } else if wide {
                    0.004 + 0.00005 * pair as f32
                } else {
                    0.001
                };
                depth + sign * 1e-6 * (x + y) as f32
            });
            let images = felt.color().unwrap().images.clone().unwrap();
            let raw = images.raw.map(|p| [p[0], p[1], p[2] + sign * 0.1 * (pair + 1) as f32]);
            let color = ColorTouch::from_images(raw, images.reference);
            let depth = DepthTouch { imprint, camera: felt.depth().unwrap().camera.clone(), truth: None };
            PadTouch::default().with(lab::GELSLIM_ID, color).with(lab::BUBBLE_ID, Some(depth))
        };
        let pads = [(0, 1.0), (1, -1.0)].map(|pad| Some(finger(pad)));
        let (tool, number) = place_of(pair);
        write_pair(root, Layout::Train, tool, number, &Sample { pads: pads.into(), ..simulated.clone() }).unwrap();
    }
    let (name, number) = place_of(SIMULATED.0);
    write_pair(root, Layout::Train, name, number, &simulated).unwrap();
}

/// The data set, written once for all benches that are there at a time.
fn written() -> Arc<TempDir> {
    static WRITTEN: Mutex<Weak<TempDir>> = Mutex::new(Weak::new());
    let mut written = WRITTEN.lock().unwrap_or_else(PoisonError::into_inner);
    written.upgrade().unwrap_or_else(|| {
        let folder = Arc::new(tempfile::tempdir().unwrap());
        write_data(folder.path());
        *written = Arc::downgrade(&folder);
        folder
    })
}

/// The generator and the mask model of the tests.
pub(crate) fn models() -> Vec<BundleInfo> {
    ["generator", "mask"].map(|name| bundles::open("Test", tiny(name).as_path()).unwrap()).to_vec()
}

/// The folders that a studio works in.
pub(crate) struct Folders {
    pub(crate) data: PathBuf,
    pub(crate) config: PathBuf,
    written: Arc<TempDir>,
    _folder: TempDir,
}

impl Folders {
    /// With a data set of its own; its files are those of all others.
    pub(crate) fn new() -> Arc<Self> {
        let folder = tempfile::tempdir().unwrap();
        let (data, config) = (folder.path().join("data"), folder.path().join("config"));
        let folders = Self { data, config, written: written(), _folder: folder };
        (0..=SIMULATED.0).for_each(|pair| folders.link(pair));
        // What was drawn lies on no CAD model: with one, every opening would look for the model that it was felt of.
        write_tools(&folders.data, &[(place_of(SIMULATED.0).0, true, mesh(&catalog::tools()[0]))]).unwrap();
        Arc::new(folders)
    }

    fn link(&self, pair: u32) {
        let (tool, number) = place_of(pair);
        let paths = |root: &Path| pair_paths(root, Layout::Train, tool, number);
        for (from, to) in paths(self.written.path()).iter().zip(paths(&self.data)) {
            std::fs::create_dir_all(to.parent().unwrap()).unwrap();
            std::fs::remove_file(&to).ok();
            std::fs::hard_link(from, &to).or_else(|_| std::fs::copy(from, &to).map(drop)).unwrap();
        }
    }

    /// Services that wait for nothing; with `keeping`, predictions stay on the disk.
    pub(crate) fn services(&self, keeping: bool) -> Services {
        let live = Services::with_config_folder(Some(self.config.clone()));
        let models = if keeping { live.models } else { Models::new(None) };
        let hour = Duration::from_secs(3600);
        Services {
            models,
            patience: Duration::ZERO,
            retry_after: hour,
            ..Services::with_config_folder(Some(self.config.clone()))
        }
    }

    /// The commands of a start with these models.
    pub(crate) fn start(&self, models: Vec<BundleInfo>) -> Vec<Command> {
        vec![Answer::Bundles(models, Vec::new()).into(), LibraryCommand::Open(Place::Path(self.data.clone())).into()]
    }
}

/// A state in which nothing is predicted without being asked for.
pub(crate) fn state() -> State {
    let mut settings = Settings { about_own_data: false, ..Settings::default() };
    settings.generate.by_itself = false;
    settings.mask.choice.source = MaskSource::Threshold;
    State { settings, ..State::default() }
}

/// A state, a runtime without threads, and the folders that they work in.
pub(crate) struct Bench {
    pub(crate) state: State,
    pub(crate) runtime: Runtime,
    pub(crate) folders: Arc<Folders>,
}

impl Bench {
    pub(crate) fn with(folders: Arc<Folders>, services: Services, models: Vec<BundleInfo>) -> Self {
        let (runtime, commands) = (Runtime::inline(Arc::new(services)), folders.start(models));
        let mut bench = Self { state: state(), runtime, folders };
        bench.runtime.tick(&mut bench.state, commands);
        bench.settle();
        bench
    }

    /// Twelve drawn pairs and a simulated one, opened; no pane is visible.
    pub(crate) fn open() -> Self {
        let folders = Folders::new();
        let services = folders.services(false);
        Self::with(folders, services, models())
    }

    /// As [`Self::open`], on folders in which predictions stay.
    pub(crate) fn keeping(folders: Arc<Folders>, models: Vec<BundleInfo>) -> Self {
        let services = folders.services(true);
        Self::with(folders, services, models)
    }

    /// Another data set: one pair of pictures.
    pub(crate) fn another(&self) -> Place {
        let folder = self.folders.data.with_file_name("another");
        std::fs::create_dir_all(&folder).unwrap();
        let gray = Grid::from_fn(32, 32, |x, y| (x * 4 + y) as u8);
        images::write_gray8(&folder.join("a_bubble.png"), &gray).unwrap();
        images::write_rgb8(&folder.join("a_gelslim.png"), &Grid::from_fn(32, 32, |x, y| [x as f32, y as f32, 9.0]))
            .unwrap();
        Place::Path(folder)
    }

    /// One round with one command; jobs wait.
    pub(crate) fn send(&mut self, command: impl Into<Command>) {
        self.runtime.tick(&mut self.state, vec![command.into()]);
    }

    /// One command and all that follows.
    pub(crate) fn run(&mut self, command: impl Into<Command>) {
        self.send(command);
        self.settle();
    }

    /// One round.
    pub(crate) fn tick(&mut self) {
        self.runtime.tick(&mut self.state, Vec::new());
    }

    /// Rounds until nothing waits.
    pub(crate) fn settle(&mut self) {
        self.runtime.settle(&mut self.state);
    }

    pub(crate) fn errors(&self) -> usize {
        self.state.log.entries.iter().filter(|e| e.level == Level::Error).count()
    }

    pub(crate) fn log(&self) -> Vec<String> {
        self.state.log.entries.iter().map(|e| e.text.clone()).collect()
    }

    /// Predictions that are there.
    pub(crate) fn generated(&self) -> usize {
        self.state.results.predictions.len()
    }

    /// The labels of a pair on the disk.
    pub(crate) fn stored(&self, name: &str) -> PairLabels {
        Labels::of(&Dataset::open(&self.folders.data).unwrap()).load(name).unwrap()
    }

    /// Makes the labels' folder one that cannot be written, or as it was again.
    pub(crate) fn fill(&self, full: bool) {
        let (place, aside) = (self.folders.data.join(FOLDER), self.folders.data.with_file_name("aside"));
        if full {
            std::fs::rename(&place, &aside).ok();
            std::fs::write(&place, "in the way").unwrap();
        } else {
            std::fs::remove_file(&place).unwrap();
            std::fs::rename(&aside, &place).ok();
        }
    }

    /// Takes the data set away, or brings it back.
    pub(crate) fn lose(&self, lost: bool) {
        let (here, away) = (self.folders.data.clone(), self.folders.data.with_file_name("away"));
        let (from, to) = if lost { (here, away) } else { (away, here) };
        std::fs::rename(from, to).unwrap();
    }

    /// Breaks the file of a pair, or makes it whole again.
    pub(crate) fn spoil(&self, pair: u32, broken: bool) {
        self.folders.link(pair);
        if broken {
            let (tool, number) = place_of(pair);
            let [_, bubble] = pair_paths(&self.folders.data, Layout::Train, tool, number);
            std::fs::remove_file(&bubble).unwrap();
            std::fs::write(&bubble, "x").unwrap();
        }
    }
}
