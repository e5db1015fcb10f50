//! Stand-ins for files and models, and a bench to drive the model on.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use touch2touch::app::command::{Command, Opened};
use touch2touch::app::keys::{PredictionKey, ShiftMode, TouchKey};
use touch2touch::app::labels::{PairLabels, Review};
use touch2touch::app::library::Place;
use touch2touch::app::runtime::Runtime;
use touch2touch::app::services::{DataSource, Services};
use touch2touch::app::settings::Settings;
use touch2touch::app::state::State;
use touch2touch::app::tasks::Level;
use touch2touch_core::catalog;
use touch2touch_core::contact::{ContactMask, settled_model};
use touch2touch_core::dataset::{Index, PairEntry, PairId, Problem, Split};
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::{DepthMap, Grid, RgbGrid};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::postprocess::{DepthChain, DepthRange, Mapping, RawPrediction, Reduction, Shift};
use touch2touch_core::resample::Resampling;
use touch2touch_core::rig::lab;
use touch2touch_core::sample::{ColorTouch, DepthTouch, PadTouch, Sample};
use touch2touch_core::sim;
use touch2touch_pipeline::error::{TaskError, TaskErrorKind};
use touch2touch_pipeline::export::{ExportChoice, Plan};
use touch2touch_pipeline::infer::bundle::Origin;
use touch2touch_pipeline::infer::bundle::SensorPair;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{Operation, Recovered, Unsaved};
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind, GeneratorInfo};
use touch2touch_pipeline::steps::models::GenerateInput;
use touch2touch_pipeline::steps::prediction::Prediction;

/// `[width, height]` of the imprints of [`Source`].
pub(crate) const IMPRINT_SIZE: [usize; 2] = [24, 16];
/// The pair that is a simulated grasp with cameras, tool and truth.
pub(crate) const SIMULATED: PairId = PairId(12);

/// Twelve pairs of two made-up tools (no camera); with `simulated`, one real grasp more.
pub(crate) struct Source {
    index: Index,
    loads: Mutex<BTreeMap<u32, u32>>,
    failing: Mutex<BTreeSet<u32>>,
    panicking: Mutex<BTreeSet<u32>>,
    /// Labels as they would lie on the disk.
    pub(crate) labels: Mutex<BTreeMap<String, PairLabels>>,
    /// Pairs whose stored labels are damaged.
    pub(crate) damaged: Mutex<BTreeSet<String>>,
    pub(crate) full_disk: AtomicBool,
    /// The data set is not where it was opened.
    pub(crate) lost: AtomicBool,
    /// Labels kept where they wait, or in a folder that was named.
    pub(crate) waiting: Mutex<Vec<(Option<PathBuf>, Unsaved)>>,
    pub(crate) saves: AtomicU64,
    /// What is odd about every pair loaded from now on.
    pub(crate) notes: Mutex<Vec<Problem>>,
}

impl Source {
    fn new(simulated: bool) -> Self {
        let entry = |tool: &str, number: u64| PairEntry {
            name: format!("{tool}/data_{number}"),
            tool: Some(tool.to_owned()),
            split: Split::None,
            number,
        };
        let mut pairs: Vec<PairEntry> =
            ["tool_a", "tool_b"].iter().flat_map(|tool| (0..6).map(|n| entry(tool, n))).collect();
        if simulated {
            pairs.push(entry(&catalog::tools()[0].name, 0));
        }
        Self {
            index: Index { pairs },
            loads: Mutex::default(),
            failing: Mutex::default(),
            panicking: Mutex::default(),
            labels: Mutex::default(),
            damaged: Mutex::default(),
            full_disk: AtomicBool::new(false),
            lost: AtomicBool::new(false),
            waiting: Mutex::default(),
            saves: AtomicU64::new(0),
            notes: Mutex::default(),
        }
    }

    pub(crate) fn loads(&self) -> u32 {
        self.loads.lock().unwrap().values().sum()
    }

    pub(crate) fn loads_of(&self, pair: u32) -> u32 {
        self.loads.lock().unwrap().get(&pair).copied().unwrap_or(0)
    }

    pub(crate) fn fail(&self, pair: u32) {
        self.failing.lock().unwrap().insert(pair);
    }

    pub(crate) fn panic(&self, pair: u32) {
        self.panicking.lock().unwrap().insert(pair);
    }

    pub(crate) fn heal(&self) {
        self.failing.lock().unwrap().clear();
    }
}

impl DataSource for Source {
    fn title(&self) -> &str {
        "Double"
    }

    fn root(&self) -> Option<&Path> {
        None
    }

    fn index(&self) -> &Index {
        &self.index
    }

    fn problems(&self) -> &[Problem] {
        &[]
    }

    fn load(&self, pair: PairId) -> Result<Sample, TaskError> {
        *self.loads.lock().unwrap().entry(pair.0).or_default() += 1;
        assert!(!self.panicking.lock().unwrap().contains(&pair.0), "the file bit back");
        if self.failing.lock().unwrap().contains(&pair.0) {
            return Err(TaskError::new(format!("Load pair {}", pair.0), "the file is too short (x.pt)"));
        }
        if pair == SIMULATED {
            let grasp = sim::Grasp { theta_rad: 0.2, x_m: 0.001, y_m: -0.001 };
            return Ok(sim::simulate(&catalog::tools()[0], grasp, 7, &sim::SimConfig::default()));
        }
        let finger = |sign: f32| {
            let [w, h] = IMPRINT_SIZE;
            // A bump with a hole in it, a second bump, and a deeper one with each pair.
            let imprint = DepthMap::from_fn(w, h, |x, y| {
                let ring = (3..9).contains(&x) && (3..9).contains(&y) && (x, y) != (5, 5);
                let spot = (15..17).contains(&x) && (10..12).contains(&y);
                let depth = if ring || spot { 0.008 + 0.0005 * pair.0 as f32 } else { 0.001 };
                depth + sign * 1e-5 * (x + y) as f32
            });
            let difference = RgbGrid::from_fn(6, 4, |x, y| [x as f32, y as f32, sign]);
            let color = ColorTouch { images: None, difference };
            let depth = DepthTouch { imprint, camera: None, truth: None };
            Some(PadTouch::default().with(lab::GELSLIM_ID, Some(color)).with(lab::BUBBLE_ID, Some(depth)))
        };
        let notes = self.notes.lock().unwrap().clone();
        Ok(Sample { pads: [finger(1.0), finger(-1.0)].into(), grasp_from_object: None, notes, ..Sample::default() })
    }

    fn tool_mesh(&self, tool: &str) -> Result<TriMesh, TaskError> {
        let tool = catalog::tools().iter().find(|t| t.name == tool);
        tool.map(catalog::ToolSpec::mesh).ok_or_else(|| TaskError::new("CAD model", "there is none"))
    }

    fn load_labels(&self, name: &str) -> Result<PairLabels, TaskError> {
        if self.damaged.lock().unwrap().contains(name) {
            return Err(TaskError::new(format!("Labels of {name}"), "the file is damaged (x.json)"));
        }
        Ok(self.labels.lock().unwrap().get(name).cloned().unwrap_or_default())
    }

    fn save_labels(&self, name: &str, labels: &PairLabels, _: &Operation) -> Result<Option<PairLabels>, TaskError> {
        assert!(!self.damaged.lock().unwrap().contains(name), "a damaged file must not be written over");
        if self.full_disk.load(Ordering::Relaxed) {
            return Err(TaskError::new("Save the labels", "no space left"));
        }
        if self.lost.load(Ordering::Relaxed) {
            let err = TaskError::new("Save the labels", "the data set is gone");
            return Err(TaskError { kind: TaskErrorKind::Lost, ..err });
        }
        self.saves.fetch_add(1, Ordering::Relaxed);
        self.labels.lock().unwrap().insert(name.to_owned(), labels.clone());
        Ok(None)
    }

    fn keep_labels(&self, unsaved: &[Unsaved], folder: Option<&Path>) -> Result<PathBuf, TaskError> {
        let kept = unsaved.iter().map(|one| (folder.map(Path::to_owned), one.clone()));
        self.waiting.lock().unwrap().extend(kept);
        Ok(folder.map_or_else(|| "waiting".into(), Path::to_owned))
    }

    fn plan_masks(&self, _: &BTreeMap<String, PairLabels>, _: ExportChoice) -> Result<Plan, TaskError> {
        Ok(Plan::default())
    }

    fn export_masks(
        &self,
        changed: &BTreeMap<String, PairLabels>,
        _: ExportChoice,
        folder: &Path,
        cx: &JobCx,
    ) -> Result<String, TaskError> {
        cx.check("Export masks")?;
        Ok(format!("{} pairs to {}", changed.len(), folder.display()))
    }
}

/// Services over one [`Source`].
pub(crate) struct Double {
    pub(crate) source: Arc<Source>,
    generated: AtomicU64,
    panics: AtomicBool,
    cancel_at: AtomicU64,
    settings_saved: AtomicU64,
    /// Calls of the generator, whatever is in them.
    pub(crate) batches: AtomicU64,
    /// Times the disk was looked through.
    pub(crate) looked_up: AtomicU64,
    /// The mask model sees no contact anywhere.
    pub(crate) blind: AtomicBool,
    /// How long labels that could not be written wait, milliseconds.
    pub(crate) retry_ms: AtomicU64,
    /// What lies on the disk.
    pub(crate) kept: Mutex<Vec<(PredictionKey, Prediction)>>,
    bundles: bool,
}

impl Double {
    pub(crate) fn new(simulated: bool, bundles: bool) -> Self {
        Self {
            source: Arc::new(Source::new(simulated)),
            generated: AtomicU64::new(0),
            panics: AtomicBool::new(false),
            cancel_at: AtomicU64::new(u64::MAX),
            settings_saved: AtomicU64::new(0),
            batches: AtomicU64::new(0),
            looked_up: AtomicU64::new(0),
            blind: AtomicBool::new(false),
            retry_ms: AtomicU64::new(3_600_000),
            kept: Mutex::default(),
            bundles,
        }
    }

    pub(crate) fn generated(&self) -> u64 {
        self.generated.load(Ordering::Relaxed)
    }

    pub(crate) fn settings_saved(&self) -> u64 {
        self.settings_saved.load(Ordering::Relaxed)
    }

    pub(crate) fn panic_in_generate(&self) {
        self.panics.store(true, Ordering::Relaxed);
    }

    /// The next generations are told to stop while they are at this step.
    pub(crate) fn cancel_itself_at_step(&self, step: u64) {
        self.cancel_at.store(step, Ordering::Relaxed);
    }
}

impl Services for Double {
    fn open(&self, place: &Place) -> Result<Opened, TaskError> {
        if *place == Place::Path("missing".into()) {
            return Err(TaskError::new("Open missing", "there is no such folder (missing)"));
        }
        let source: Arc<dyn DataSource> = self.source.clone();
        let labels = self.source.labels.lock().unwrap();
        let reviews = labels.iter().filter(|(_, l)| l.review != Review::Todo);
        let notes = labels.iter().filter(|(_, l)| !l.note.is_empty());
        Ok(Opened {
            source,
            reviews: reviews.map(|(name, l)| (name.clone(), l.review)).collect(),
            notes: notes.map(|(name, l)| (name.clone(), l.note.clone())).collect(),
            recovered: Recovered::default(),
        })
    }

    fn find_bundles(&self, _: &[PathBuf]) -> (Vec<BundleInfo>, Vec<TaskError>) {
        let bundle = |id: &str, kind| BundleInfo {
            id: id.into(),
            name: id.into(),
            kind,
            origin: Origin::Folder(id.into()),
            generator: (kind == BundleKind::Generator).then(|| GeneratorInfo {
                fit: None,
                defaults: GenerateConfig { steps: 20, ..GenerateConfig::default() },
                training_steps: 1000,
                guided: false,
                sensors: SensorPair::of(&lab::GELSLIM, &lab::BUBBLE),
            }),
            trained: false,
        };
        match self.bundles {
            true => (vec![bundle("gen", BundleKind::Generator), bundle("unet", BundleKind::Mask)], Vec::new()),
            false => (Vec::new(), Vec::new()),
        }
    }

    fn predict(
        &self,
        bundle: &BundleInfo,
        _: EngineChoice,
        config: &GenerateConfig,
        wanted: &[GenerateInput<'_>],
        cx: &JobCx,
    ) -> Result<Vec<Prediction>, TaskError> {
        self.batches.fetch_add(1, Ordering::Relaxed);
        wanted.iter().map(|item| self.predict_one(bundle, config, item, cx)).collect()
    }

    fn stored(
        &self,
        _: &[BundleInfo],
        _: EngineChoice,
        touch: TouchKey,
        _: &RgbGrid,
    ) -> Vec<(PredictionKey, Prediction)> {
        self.looked_up.fetch_add(1, Ordering::Relaxed);
        let kept = self.kept.lock().unwrap();
        kept.iter()
            .filter(|(key, _)| key.touch.pair.pair == touch.pair.pair && key.touch.finger == touch.finger)
            .map(|(key, prediction)| (PredictionKey { touch, ..key.clone() }, prediction.clone()))
            .collect()
    }

    fn mask_by_model(
        &self,
        _: &BundleInfo,
        _: EngineChoice,
        imprint: &DepthMap,
        _: Option<f32>,
    ) -> Result<ContactMask, TaskError> {
        let blind = self.blind.load(Ordering::Relaxed);
        Ok(settled_model(imprint, imprint.map(|v| !blind && *v > 0.006)))
    }

    fn retry_after(&self) -> Duration {
        Duration::from_millis(self.retry_ms.load(Ordering::Relaxed))
    }

    fn load_settings(&self) -> (Settings, Option<TaskError>) {
        // Predictions are asked for: a test that is about the others switches them on.
        let mut settings = Settings::default();
        settings.generate.by_itself = false;
        (settings, None)
    }

    fn save_settings(&self, _: &Settings) -> Result<(), TaskError> {
        self.settings_saved.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}

impl Double {
    fn predict_one(
        &self,
        bundle: &BundleInfo,
        config: &GenerateConfig,
        item: &GenerateInput<'_>,
        cx: &JobCx,
    ) -> Result<Prediction, TaskError> {
        self.generated.fetch_add(1, Ordering::Relaxed);
        assert!(!self.panics.load(Ordering::Relaxed), "the model fell over");
        for step in 0..u64::from(config.steps) {
            cx.progress(step, config.steps.into(), "step");
            if step == self.cancel_at.load(Ordering::Relaxed) {
                cx.cancel.cancel();
            }
            cx.check("Generate")?;
        }
        // Depends on the condition and on the seed, as a real one does.
        let condition = item.difference.as_slice().iter().map(|p| p[2]).sum::<f32>() / item.difference.len() as f32;
        let [w, h] = IMPRINT_SIZE;
        let raw = RawPrediction {
            channels: vec![Grid::from_fn(w, h, |x, y| {
                (((x * y) as f32 + item.seed as f32).sin() * 0.5 + 0.1 * condition).clamp(-1.0, 1.0)
            })],
        };
        let chain = DepthChain {
            range: DepthRange { min_m: -0.01, max_m: 0.03 },
            mapping: Mapping::Correct,
            reduction: Reduction::Mean,
            shift: Shift::None,
            correction: None,
            size: IMPRINT_SIZE,
            resampling: Resampling::Bilinear,
            rotation_deg: 0,
            window: None,
            offset: [0.0; 2],
        };
        let chains = [ShiftMode::Raw, ShiftMode::PaperShift, ShiftMode::ExactInverse]
            .map(|mode| (mode, chain.clone().with_mode(mode, None).map_err(|err| err.to_string())));
        let (chains, bundle) = (Arc::new(chains.into()), bundle.id.clone());
        Ok(Prediction {
            raw,
            chains,
            fit: None,
            color: None,
            bundle,
            engine: "double".into(),
            seconds: 0.0,
            kept: false,
        })
    }
}

/// A state, a runtime without threads, and the doubles behind it.
pub(crate) struct Bench {
    pub(crate) state: State,
    pub(crate) runtime: Runtime,
    pub(crate) services: Arc<Double>,
}

impl Bench {
    fn with(services: Double) -> Self {
        let services = Arc::new(services);
        let mut bench = Self { state: State::default(), runtime: Runtime::inline(services.clone()), services };
        bench.runtime.start(&mut bench.state, Some(Place::Demo));
        bench.settle();
        bench
    }

    /// Twelve made-up pairs, opened; no pane is visible.
    pub(crate) fn open() -> Self {
        Self::with(Double::new(false, true))
    }

    /// With a simulated grasp as pair [`SIMULATED`].
    pub(crate) fn open_simulated() -> Self {
        Self::with(Double::new(true, true))
    }

    /// Without any model bundle.
    pub(crate) fn open_without_models() -> Self {
        Self::with(Double::new(false, false))
    }

    /// One round with one command; jobs wait.
    pub(crate) fn send(&mut self, command: impl Into<Command>) {
        self.runtime.tick(&mut self.state, vec![command.into()]);
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
}
