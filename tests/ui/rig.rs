//! A studio on a small simulated data set, without a window.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex};

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Command, Opened};
use touch2touch::app::library::Place;
use touch2touch::app::results;
use touch2touch::app::services::Services;
use touch2touch::app::services::live::LiveServices;
use touch2touch::app::settings::Settings;
use touch2touch::app::state::State;
use touch2touch::ui::{Options, StudioApp};
use touch2touch_core::catalog::{self, ToolSpec};
use touch2touch_core::contact::ContactMask;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::postprocess::{
    DepthChain, DepthRange, Mapping, RawPrediction, Reduction, Shift, ShiftMode, ShiftStats,
};
use touch2touch_core::resample::Resampling;
use touch2touch_core::rig::lab;
use touch2touch_core::sim;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::infer::bundle::Origin;
use touch2touch_pipeline::infer::bundle::SensorPair;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::io::simulated::{Layout, pair_paths, write_pair, write_tools};
use touch2touch_pipeline::io::statistics::ShiftStatistics;
use touch2touch_pipeline::job::{JobCx, PreviewPicture};
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind, GeneratorInfo};
use touch2touch_pipeline::steps::imprint::in_meters;
use touch2touch_pipeline::steps::models::GenerateInput;
use touch2touch_pipeline::steps::prediction::Prediction;

/// The program's services with a generator that answers at once.
struct QuickGenerator {
    live: LiveServices,
    /// Holds every generation up after its preview of step 4, until it is opened.
    gate: Option<Arc<Gate>>,
}

/// Closed until somebody opens it.
#[derive(Default)]
pub(super) struct Gate {
    open: Mutex<bool>,
    bell: Condvar,
}

impl Gate {
    pub(super) fn open(&self) {
        *self.open.lock().unwrap() = true;
        self.bell.notify_all();
    }

    fn pass(&self) {
        let mut open = self.open.lock().unwrap();
        while !*open {
            open = self.bell.wait(open).unwrap();
        }
    }
}

/// A picture of the decoder's kind that depends on the input and the seed: the blurred strength of the difference.
fn picture(difference: &RgbGrid, seed: u64) -> Grid<f32> {
    const N: usize = 64;
    let (w, h) = (difference.width(), difference.height());
    Grid::from_fn(N, N, |x, y| {
        let mut sum = 0.0;
        for dy in 0..4 {
            for dx in 0..4 {
                let p = difference[((x * 4 + dx) * w / (4 * N), (y * 4 + dy) * h / (4 * N))];
                sum += p.iter().map(|v| v.abs()).sum::<f32>();
            }
        }
        (sum / 16.0 / 60.0 - 0.6 + (seed % 7) as f32 * 0.01).clamp(-1.0, 1.0)
    })
}

impl Services for QuickGenerator {
    fn open(&self, place: &Place) -> Result<Opened, TaskError> {
        self.live.open(place)
    }

    fn find_bundles(&self, _folders: &[PathBuf]) -> (Vec<BundleInfo>, Vec<TaskError>) {
        let info = BundleInfo {
            id: "quick".into(),
            name: "quick double".into(),
            kind: BundleKind::Generator,
            origin: Origin::Folder(PathBuf::new()),
            generator: Some(GeneratorInfo {
                fit: None,
                defaults: GenerateConfig { steps: 4, ..GenerateConfig::default() },
                training_steps: 1000,
                guided: false,
                sensors: SensorPair::of(&lab::GELSLIM, &lab::BUBBLE),
            }),
            trained: false,
        };
        (vec![info], Vec::new())
    }

    fn predict(
        &self,
        bundle: &BundleInfo,
        _engine: EngineChoice,
        config: &GenerateConfig,
        wanted: &[GenerateInput<'_>],
        cx: &JobCx,
    ) -> Result<Vec<Prediction>, TaskError> {
        let steps = config.steps;
        for step in 0..steps {
            cx.check("Generate")?;
            cx.progress(step.into(), steps.into(), format!("step {} of {steps}", step + 1));
        }
        let chain = DepthChain {
            range: DepthRange { min_m: -0.0063, max_m: 0.018 },
            mapping: Mapping::Doubled,
            reduction: Reduction::Mean,
            shift: Shift::None,
            correction: None,
            size: [lab::BUBBLE.width, lab::BUBBLE.height],
            resampling: Resampling::Bilinear,
            rotation_deg: 180,
            window: None,
            offset: [0.0; 2],
        };
        let stats = ShiftStats { pred_mean: 0.0115, pred_std: 0.0021, gt_mean: 0.0052, gt_std: 0.0043 };
        let chains: BTreeMap<ShiftMode, Result<DepthChain, String>> = ShiftMode::ALL
            .into_iter()
            .map(|mode| (mode, chain.clone().with_mode(mode, Some(stats)).map_err(|e| e.to_string())))
            .collect();
        if let Some(gate) = &self.gate {
            for (at, item) in wanted.iter().enumerate() {
                if let Some((previews, shift)) = cx.previews().and_then(|p| Some((p, p.wants(at, 4)?))) {
                    let raw = RawPrediction { channels: vec![picture(item.difference, item.seed)] };
                    let depth = in_meters(chains[&shift].as_ref().unwrap(), &raw, item.size).unwrap();
                    previews.show(at, PreviewPicture { step: 4, of: steps, depth });
                }
            }
            gate.pass();
        }
        let chains = Arc::new(chains);
        let one = |item: &GenerateInput<'_>| {
            // Three channels around one picture, as three-channel decoders give it.
            let mean = picture(item.difference, item.seed);
            let raw = RawPrediction { channels: [-0.02, 0.0, 0.02].map(|off| mean.map(|v| v + off)).to_vec() };
            let (chains, bundle) = (chains.clone(), bundle.id.clone());
            Prediction {
                raw,
                chains,
                fit: None,
                color: None,
                bundle,
                engine: "double".into(),
                seconds: 0.0,
                kept: false,
            }
        };
        Ok(wanted.iter().map(one).collect())
    }

    fn mask_by_model(
        &self,
        bundle: &BundleInfo,
        runtime: EngineChoice,
        imprint: &DepthMap,
        probability: Option<f32>,
    ) -> Result<ContactMask, TaskError> {
        self.live.mask_by_model(bundle, runtime, imprint, probability)
    }

    fn save_statistics(&self, statistics: &ShiftStatistics) -> Result<Option<PathBuf>, TaskError> {
        self.live.save_statistics(statistics)
    }

    fn load_settings(&self) -> (Settings, Option<TaskError>) {
        // Predictions are asked for: a test that is about the others switches them on.
        let (mut settings, problem) = self.live.load_settings();
        settings.generate.by_itself = false;
        settings.about_own_data = false;
        (settings, problem)
    }

    fn save_settings(&self, settings: &Settings) -> Result<(), TaskError> {
        self.live.save_settings(settings)
    }
}

/// Writes a data set of a few simulated grasps of two tools.
pub(super) fn write_dataset(root: &Path, grasps: u64) {
    write_tools_touched(root, &catalog::tools()[..2], grasps);
}

/// The same of other tools.
fn write_tools_touched(root: &Path, tools: &[ToolSpec], grasps: u64) {
    let config = sim::SimConfig::default();
    for tool in tools {
        for index in 0..grasps {
            let grasp = sim::random_grasp(index + 3);
            let sample = sim::simulate(tool, grasp, index, &config);
            write_pair(root, Layout::Train, &tool.name, index, &sample).unwrap();
        }
    }
    let meshes: Vec<_> = tools.iter().map(|t| (t.name.as_str(), t.seen, t.mesh())).collect();
    write_tools(root, &meshes).unwrap();
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
        write_tools_touched(&data, &catalog::tools()[..2], grasps);
        let mut rig = Self { harness: Self::start(size, &data, &config), data, config, _folder: folder };
        rig.settle();
        Some(rig)
    }

    /// As [`Rig::new`] on `pairs` pairs of one tool that are the same files, read on lanes of their own while frames go on.
    pub(super) fn paging(size: [f32; 2], pairs: u64) -> Option<Self> {
        crate::support::gpu()?;
        let folder = tempfile::tempdir().unwrap();
        let (data, config) = (folder.path().join("data"), folder.path().join("config"));
        let tool = &catalog::tools()[0];
        let sample = sim::simulate(tool, sim::random_grasp(3), 3, &sim::SimConfig::default());
        let written = write_pair(&data, Layout::Train, &tool.name, 0, &sample).unwrap();
        write_tools(&data, &[(tool.name.as_str(), tool.seen, tool.mesh())]).unwrap();
        for index in 1..pairs {
            for (file, again) in written.iter().zip(pair_paths(&data, Layout::Train, &tool.name, index)) {
                std::fs::hard_link(file, again).unwrap();
            }
        }
        let live = LiveServices::with_config_folder(Some(config.clone()));
        let services = Arc::new(QuickGenerator { live, gate: None });
        let mut rig =
            Self { harness: Self::build(size, services, Some(data.clone()), false), data, config, _folder: folder };
        rig.until("the first pair", |state| state.library.open.is_some() && results::sample(state).ready().is_some());
        Some(rig)
    }

    /// As [`Rig::new`] with lanes of its own, and a generator that stops after its preview until the gate is opened.
    pub(super) fn gated(size: [f32; 2]) -> Option<(Self, Arc<Gate>)> {
        let mut rig = Self::new(size, 1)?;
        let gate = Arc::new(Gate::default());
        let live = LiveServices::with_config_folder(Some(rig.config.clone()));
        let services = Arc::new(QuickGenerator { live, gate: Some(gate.clone()) });
        rig.harness = Self::build(size, services, Some(rig.data.clone()), false);
        rig.until("the data set", |state| state.library.open.is_some() && results::sample(state).ready().is_some());
        Some((rig, gate))
    }

    /// As [`Rig::new`] with the program's own services, the tiny bundles of the tests and one of them chosen.
    pub(super) fn with_bundle(size: [f32; 2], name: &str) -> Option<Self> {
        let mut rig = Self::new(size, 1)?;
        let services = LiveServices::with_config_folder(Some(rig.config.clone()));
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bundles");
        let mut settings = Settings { bundle_folders: vec![folder], ..Settings::default() };
        settings.generate.bundle = Some(name.to_owned());
        settings.generate.by_itself = false;
        settings.about_own_data = false;
        services.save_settings(&settings).unwrap();
        rig.harness = Self::build(size, Arc::new(services), Some(rig.data.clone()), true);
        rig.settle();
        Some(rig)
    }

    /// Frames until something is so; a failure after five minutes.
    pub(super) fn until(&mut self, what: &str, so: impl Fn(&State) -> bool) {
        let begin = std::time::Instant::now();
        while !so(self.harness.state().state()) {
            assert!(begin.elapsed().as_secs() < 300, "waited for {what}: {:?}", self.harness.state().state().tasks);
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
        let services = Arc::new(LiveServices::with_config_folder(Some(config.clone())));
        let mut settings = Settings { about_own_data: about, ..Settings::default() };
        settings.generate.by_itself = false;
        services.save_settings(&settings).unwrap();
        let open = match place {
            Place::Demo => None,
            Place::Path(path) => Some(path),
        };
        let harness = Self::build(size, services, open, true);
        let mut rig = Self { harness, data, config, _folder: folder };
        rig.settle();
        Some(rig)
    }

    fn start(size: [f32; 2], data: &Path, config: &Path) -> Harness<'static, StudioApp> {
        let live = LiveServices::with_config_folder(Some(config.to_owned()));
        Self::build(size, Arc::new(QuickGenerator { live, gate: None }), Some(data.to_owned()), true)
    }

    fn build(
        size: [f32; 2],
        services: Arc<dyn Services>,
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
        let live = LiveServices::with_config_folder(Some(config.clone()));
        let mut options = Options::new(Arc::new(QuickGenerator { live, gate: None }), Some(self.data.clone()));
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
        self.harness = Self::start(size, &self.data, &self.config);
        self.settle();
    }

    /// Frames until nothing is to be done any more.
    pub(super) fn settle(&mut self) {
        for _ in 0..600 {
            self.harness.step();
            if self.harness.state().is_idle() && self.harness.state().state().library.open.is_some() {
                break;
            }
        }
        assert!(self.harness.state().is_idle(), "{:?}", self.harness.state().state().tasks);
        self.harness.run();
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
            self.harness.get_by_label(&label).click();
            self.harness.step();
            self.settle();
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
