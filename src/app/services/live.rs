//! The services of the program: data sets and labels through `io`, models through `infer`, settings in the user's
//! configuration folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use super::super::keys::{PredictionKey, TouchKey};
use super::super::services::Opened;
use super::super::source::DataSource;
use super::super::state::labels::PairLabels;
use super::super::state::library::Place;
use super::super::state::settings::{SETTINGS_VERSION, Settings};
use super::Services;
use touch2touch_core::contact::ContactMask;
use touch2touch_core::dataset::{Index, PairId, Problem};
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::{DepthMap, RgbGrid};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::Rig;
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::doubts;
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::{self, DrawnMasks, ExportChoice, ExportSetup, Plan};
use touch2touch_pipeline::follow::Following;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::infer::store::{self, Store};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::FOLDER;
use touch2touch_pipeline::io::statistics::ShiftStatistics;
use touch2touch_pipeline::io::{atomic, files, folders};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{JournalHistory, Labels, Operation, Recovered, Reviews, Unsaved, recover};
use touch2touch_pipeline::learn::new_bundle::models_folder;
use touch2touch_pipeline::learn::tuning::unfinished_folder;
use touch2touch_pipeline::steps::bundles::{self, BundleInfo};
use touch2touch_pipeline::steps::models::{GenerateInput, KeptPrediction, Models};
use touch2touch_pipeline::steps::prediction::Prediction;
use touch2touch_pipeline::steps::tool::tool_file;

/// Longer than a key that is held down leaves a pair on screen.
const PATIENCE: Duration = Duration::from_millis(150);
/// The settings file inside the configuration folder.
const SETTINGS_FILE: &str = "settings.json";
/// The place to which a settings file is put that cannot be used.
const BAD_SETTINGS_FILE: &str = "settings.bad.json";

/// The program's services. Models stay loaded between calls.
#[derive(Debug, Default)]
pub struct LiveServices {
    config_folder: Option<PathBuf>,
    /// The folder of fitted models.
    models_folder: Option<PathBuf>,
    /// The folder of tuning that was stopped.
    unfinished: Option<PathBuf>,
    /// The folder of labels that could not be saved.
    waiting: Option<PathBuf>,
    models: Models,
}

impl LiveServices {
    /// With settings in the user's configuration folder.
    pub fn new() -> Self {
        let store = store::user_folder().map(|folder| Store::new(folder, store::DEFAULT_BUDGET));
        let (models_folder, unfinished) = (models_folder(), unfinished_folder());
        let waiting = folders::data().map(|folder| folder.join("recovered"));
        Self { config_folder: folders::config(), models_folder, unfinished, waiting, models: Models::new(store) }
    }

    /// With settings, kept predictions, fitted models and labels that wait in a given folder; `None` keeps none.
    pub fn with_config_folder(folder: Option<PathBuf>) -> Self {
        let kept = folder.as_ref().map(|folder| folder.join("predictions"));
        let store = kept.map(|folder| Store::new(folder, store::DEFAULT_BUDGET));
        let models_folder = folder.as_ref().map(|folder| folder.join("models"));
        let unfinished = folder.as_ref().map(|folder| folder.join("unfinished"));
        let waiting = folder.as_ref().map(|folder| folder.join("recovered"));
        Self { config_folder: folder, models_folder, unfinished, waiting, models: Models::new(store) }
    }
}

/// Opens a place as the studio does: data set, stored labels, and what is wrong with either.
///
/// # Errors
/// If nothing in it can be opened.
pub fn open_source(place: &Place) -> Result<LiveSource, TaskError> {
    open_recovering(place, None)
}

/// [`open_source`], with what waits in a folder of labels that could not be saved before.
fn open_recovering(place: &Place, waiting: Option<&Path>) -> Result<LiveSource, TaskError> {
    let dataset = match place {
        Place::Demo => Dataset::demo(),
        Place::Path(path) => Dataset::open(path)
            .map_err(|err| TaskError::from_error(format!("Open {place}"), &err).with_hint(err.hint()))?,
    };
    let mut problems = doubts::notes(&dataset);
    problems.extend(dataset.problems.iter().cloned());
    let labels = Labels::of(&dataset);
    let recovered = waiting.map(|waiting| recover(&dataset, &labels, waiting)).unwrap_or_default();
    let mut reviews = labels.reviews();
    problems.append(&mut reviews.problems);
    let (dataset, waiting) = (Arc::new(dataset), waiting.map(Path::to_owned));
    Ok(LiveSource { dataset, labels, problems, reviews, waiting, recovered })
}

/// An open data set with its store of labels.
#[derive(Debug)]
pub struct LiveSource {
    dataset: Arc<Dataset>,
    labels: Labels,
    problems: Vec<Problem>,
    reviews: Reviews,
    /// The folder of labels that could not be saved.
    waiting: Option<PathBuf>,
    recovered: Recovered,
}

impl LiveSource {
    /// The data set.
    pub fn dataset(&self) -> &Dataset {
        &self.dataset
    }
}

impl DataSource for LiveSource {
    fn title(&self) -> &str {
        &self.dataset.title
    }

    fn root(&self) -> Option<&Path> {
        self.dataset.root.as_deref()
    }

    fn as_dataset(&self) -> Option<&Dataset> {
        Some(&self.dataset)
    }

    fn rig(&self) -> Arc<Rig> {
        self.dataset.rig.clone()
    }

    fn index(&self) -> &Index {
        &self.dataset.index
    }

    fn problems(&self) -> &[Problem] {
        &self.problems
    }

    fn load(&self, pair: PairId) -> Result<Sample, TaskError> {
        self.dataset.load(pair).map_err(|err| {
            let name = self.dataset.index.get(pair).map_or("a pair", |entry| &entry.name);
            TaskError::from_error(format!("Load {name}"), &err).with_hint(err.hint())
        })
    }

    fn tool_mesh(&self, tool: &str) -> Result<TriMesh, TaskError> {
        Ok(tool_file(&self.dataset, tool)?.mesh)
    }

    fn follow(&self) -> Option<Following> {
        Following::continuing(self.dataset.clone())
    }

    fn grown(&self, dataset: &Arc<Dataset>) -> Option<Arc<dyn DataSource>> {
        Some(Arc::new(Self {
            dataset: dataset.clone(),
            labels: self.labels.continued(dataset),
            problems: dataset.problems.clone(),
            reviews: self.reviews.clone(),
            waiting: self.waiting.clone(),
            recovered: Recovered::default(),
        }))
    }

    fn load_labels(&self, name: &str) -> Result<PairLabels, TaskError> {
        self.labels.load(name)
    }

    fn past(&self, name: &str, labels: &PairLabels) -> JournalHistory {
        self.labels.past(name, labels)
    }

    fn save_labels(&self, name: &str, labels: &PairLabels, deed: &Operation) -> Result<Option<PairLabels>, TaskError> {
        self.labels.save(name, labels, deed)
    }

    fn keep_labels(&self, unsaved: &[Unsaved], folder: Option<&Path>) -> Result<PathBuf, TaskError> {
        match (folder, &self.waiting) {
            (Some(folder), _) => {
                let folder = folder.join(FOLDER);
                self.labels.keep_in(&self.dataset, unsaved, &folder)?;
                Ok(folder)
            }
            (None, Some(waiting)) => self.labels.keep_waiting(&self.dataset, unsaved, waiting),
            (None, None) => {
                Err(TaskError::new("Keep the labels", "this system names no folder for what could not be saved"))
            }
        }
    }

    fn plan_masks(&self, changed: &BTreeMap<String, PairLabels>, choice: ExportChoice) -> Result<Plan, TaskError> {
        let masks = DrawnMasks { labels: &self.labels, changed };
        export::plan(&self.dataset, &masks, &ExportSetup { pairs: None, choice })
    }

    fn export_masks(
        &self,
        changed: &BTreeMap<String, PairLabels>,
        choice: ExportChoice,
        folder: &Path,
        cx: &JobCx,
    ) -> Result<String, TaskError> {
        let masks = DrawnMasks { labels: &self.labels, changed };
        let setup = ExportSetup { pairs: None, choice };
        let (plan, _) = export::export_masks(&self.dataset, &masks, &setup, folder, None, cx)?;
        Ok(format!("Exported to {}: {}", folder.display(), plan.lines().join("; ")))
    }
}

impl Services for LiveServices {
    fn open(&self, place: &Place) -> Result<Opened, TaskError> {
        let source = open_recovering(place, self.waiting.as_deref())?;
        let Reviews { states: reviews, notes, .. } = source.reviews.clone();
        let recovered = source.recovered.clone();
        Ok(Opened { source: Arc::new(source), reviews, notes, recovered })
    }

    fn find_bundles(&self, folders: &[PathBuf]) -> (Vec<BundleInfo>, Vec<TaskError>) {
        let found = bundles::find(folders);
        let refused = |p: Problem| {
            let why = format!("{} ({})", p.what, p.file.display());
            TaskError::new("A model bundle was refused", why).with_hint(p.hint)
        };
        (found.bundles, found.problems.into_iter().map(refused).collect())
    }

    fn predict(
        &self,
        bundle: &BundleInfo,
        engine: EngineChoice,
        config: &GenerateConfig,
        wanted: &[GenerateInput<'_>],
        cx: &JobCx,
    ) -> Result<Vec<Prediction>, TaskError> {
        self.models.predict(bundle, engine, config, wanted, cx)
    }

    fn stored(
        &self,
        bundles: &[BundleInfo],
        engine: EngineChoice,
        touch: TouchKey,
        difference: &RgbGrid,
    ) -> Vec<(PredictionKey, Prediction)> {
        let keyed = |kept: KeptPrediction| {
            let bundle = kept.prediction.bundle.clone();
            (PredictionKey { touch, bundle, config: kept.config, runtime: kept.engine }, kept.prediction)
        };
        self.models.kept(bundles, engine, difference).into_iter().map(keyed).collect()
    }

    fn models(&self) -> &Models {
        &self.models
    }

    fn models_folder(&self) -> Option<&Path> {
        self.models_folder.as_deref()
    }

    fn unfinished_folder(&self) -> Option<&Path> {
        self.unfinished.as_deref()
    }

    fn patience(&self) -> Duration {
        PATIENCE
    }

    fn mask_by_model(
        &self,
        bundle: &BundleInfo,
        engine: EngineChoice,
        imprint: &DepthMap,
        probability: Option<f32>,
    ) -> Result<ContactMask, TaskError> {
        self.models.mask(bundle, engine, imprint, probability)
    }

    fn save_statistics(&self, statistics: &ShiftStatistics) -> Result<Option<PathBuf>, TaskError> {
        let Some(folder) = self.config_folder.as_ref().map(|folder| folder.join("statistics")) else { return Ok(None) };
        let p = &statistics.provenance;
        let hash = p.bundle_hash.get(..12).unwrap_or(&p.bundle_hash);
        let dataset: String = p.dataset.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        let file = folder.join(format!("{hash}-{dataset}.json"));
        std::fs::create_dir_all(&folder)
            .map_err(|err| TaskError::new("Keep the statistics", format!("{err} ({})", folder.display())))?;
        statistics.write(&file).map_err(|err| TaskError::from_error("Keep the statistics", &err))?;
        Ok(Some(file))
    }

    fn load_settings(&self) -> (Settings, Option<TaskError>) {
        let (settings, problem) = self.read_settings();
        self.keep_at_most(&settings);
        (settings, problem)
    }

    fn save_settings(&self, settings: &Settings) -> Result<(), TaskError> {
        const WHAT: &str = "Save the preferences";
        self.keep_at_most(settings);
        let Some(folder) = &self.config_folder else { return Ok(()) };
        let file = folder.join(SETTINGS_FILE);
        let fail = |err: std::io::Error| TaskError::new(WHAT, format!("{err} ({})", file.display()));
        // A path that is no text cannot be written; it must not keep everything else from being written.
        let mut settings = settings.clone();
        let is_text = |place: &Place| !matches!(place, Place::Path(path) if path.to_str().is_none());
        settings.recent.retain(is_text);
        settings.last.place = settings.last.place.filter(is_text);
        settings.bundle_folders.retain(|folder| folder.to_str().is_some());
        let text = serde_json::to_vec_pretty(&settings).map_err(|err| fail(err.into()))?;
        std::fs::create_dir_all(folder).map_err(fail)?;
        atomic::write_bytes(&file, &text).map_err(fail)
    }
}

impl LiveServices {
    /// The budget of the kept predictions as the settings say.
    fn keep_at_most(&self, settings: &Settings) {
        self.models.keep_at_most(u64::from(settings.cache_mib) << 20);
    }

    fn read_settings(&self) -> (Settings, Option<TaskError>) {
        let Some(folder) = &self.config_folder else { return (Settings::default(), None) };
        let file = folder.join(SETTINGS_FILE);
        let bytes = match files::read(&file, files::SMALL) {
            Ok(bytes) => bytes,
            Err(err) if err.kind() == std::io::ErrorKind::NotFound => return (Settings::default(), None),
            Err(err) => {
                let why = format!("{err} ({})", file.display());
                return (Settings::default(), Some(TaskError::new("The preferences could not be read", why)));
            }
        };
        let bad = folder.join(BAD_SETTINGS_FILE);
        match parse_settings(&bytes) {
            Ok((settings, refused)) => {
                let problem = (!refused.is_empty()).then(|| {
                    let why = format!("{} ({})", refused.join("; "), file.display());
                    let kept = match std::fs::copy(&file, &bad) {
                        Ok(_) => format!("Old file: {}", bad.display()),
                        Err(err) => format!("The old file could not be kept: {err}"),
                    };
                    TaskError::new("Some preferences could not be read and were reset", why).with_hint(kept)
                });
                (settings.validated(), problem)
            }
            Err(why) => {
                let kept = match std::fs::rename(&file, &bad) {
                    Ok(()) => format!("Old file: {}", bad.display()),
                    Err(err) => format!("The old file could not be kept: {err}."),
                };
                let why = format!("{why} ({})", file.display());
                let problem = TaskError::new("Preferences could not be read and were reset", why).with_hint(kept);
                (Settings::default(), Some(problem))
            }
        }
    }
}

/// The settings, and which of them could not be used.
fn parse_settings(bytes: &[u8]) -> Result<(Settings, Vec<String>), String> {
    let mut value: Value = serde_json::from_slice(bytes).map_err(|err| err.to_string())?;
    let version = value.get("version").and_then(Value::as_u64);
    if version != Some(SETTINGS_VERSION.into()) {
        return Err(format!(
            "they are of version {}, this program writes version {SETTINGS_VERSION}",
            version.map_or_else(|| "unknown".into(), |v| v.to_string())
        ));
    }
    let fits = |value: Value| serde_json::from_value::<Settings>(value).is_ok();
    let refused = leave_out(&mut value, "", &fits).into_iter().map(|path| format!("{path} cannot be read")).collect();
    Ok((serde_json::from_value(value).map_err(|err| err.to_string())?, refused))
}

/// Leaves out the parts of a value that make it unfit, each as small as can be, and returns their paths: that of the value
/// itself where nothing else helps.
fn leave_out(value: &mut Value, path: &str, fits: &dyn Fn(Value) -> bool) -> Vec<String> {
    if fits(value.clone()) {
        return Vec::new();
    }
    let mut out = Vec::new();
    if let Value::Object(parts) = value {
        let dot = if path.is_empty() { "" } else { "." };
        parts.retain(|key, part| {
            let alone = |part| fits(Value::Object([(key.clone(), part)].into_iter().collect()));
            let unfit = leave_out(part, &format!("{path}{dot}{key}"), &alone);
            out.extend(unfit);
            alone(part.clone())
        });
    }
    if let Value::Array(parts) = value {
        let mut at = 0;
        parts.retain_mut(|part| {
            let alone = |part| fits(Value::Array(vec![part]));
            out.extend(leave_out(part, &format!("{path}[{at}]"), &alone));
            at += 1;
            alone(part.clone())
        });
    }
    if fits(value.clone()) { out } else { vec![path.to_owned()] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::settings::{CompareChoice, Workspace};
    use touch2touch_core::frames::PlanarPose;
    use touch2touch_core::grid::Mask;
    use touch2touch_core::label::Provenance;
    use touch2touch_core::manual::AcceptedPose;
    use touch2touch_core::postprocess::ShiftMode;
    use touch2touch_core::rig::lab;
    use touch2touch_pipeline::compare::subject::Subject;
    use touch2touch_pipeline::export::{LeftOut, Which};
    use touch2touch_pipeline::io::masks::MaskStore;
    use touch2touch_pipeline::labels::ImprintOf;
    use touch2touch_pipeline::labels::Review;
    use touch2touch_pipeline::labels::{DrawnMask, MaskPlace, Revision};

    /// A folder with one pair of pictures.
    fn pictures(folder: &Path) {
        let gray = touch2touch_core::grid::Grid::from_fn(32, 32, |x, y| (x * 4 + y) as u8);
        let rgb = RgbGrid::from_fn(32, 32, |x, y| [x as f32, y as f32, 9.0]);
        touch2touch_pipeline::io::images::write_gray8(&folder.join("a_bubble.png"), &gray).unwrap();
        touch2touch_pipeline::io::images::write_rgb8(&folder.join("a_gelslim.png"), &rgb).unwrap();
    }

    fn labels() -> PairLabels {
        let mask = Arc::new(Mask::from_fn(175, 140, |x, y| x > 20 && y < 9));
        PairLabels {
            masks: [(
                MaskPlace::measured(lab::RIGHT),
                DrawnMask { revision: Revision(3), ..DrawnMask::new(mask, Provenance::Threshold { min_m: 0.005 }) },
            )]
            .into(),
            review: Review::InProgress,
            accepted: [
                (ImprintOf::Measured, PlanarPose { theta_rad: 0.1, y_m: 0.002, z_m: -0.001 }.into()),
                (
                    ImprintOf::predicted("b0", &GenerateConfig::default(), ShiftMode::Raw),
                    AcceptedPose { pose: PlanarPose { y_m: 1e-3, ..PlanarPose::default() }, by_hand: true },
                ),
            ]
            .into(),
            note: "shallow at the edge".into(),
        }
    }

    fn same(a: &PairLabels, b: &PairLabels) -> bool {
        let masks = |l: &PairLabels| {
            l.masks.iter().map(|(place, h)| (place.clone(), h.mask.clone(), h.base())).collect::<Vec<_>>()
        };
        masks(a) == masks(b) && a.review == b.review && a.accepted == b.accepted && a.note == b.note
    }

    #[test]
    fn labels_come_back_and_undo_reaches_the_disk() {
        let folder = tempfile::tempdir().unwrap();
        pictures(folder.path());
        let place = Place::Path(folder.path().to_owned());
        let source = open_source(&place).unwrap();
        let name = source.index().pairs[0].name.clone();
        assert!(source.load_labels(&name).unwrap().is_empty());
        source.save_labels(&name, &labels(), &Operation::default()).unwrap();
        let again = LiveServices::with_config_folder(None).open(&place).unwrap();
        assert_eq!((again.reviews[&name], &*again.notes[&name]), (Review::InProgress, "shallow at the edge"));
        assert!(same(&again.source.load_labels(&name).unwrap(), &labels()));
        again.source.save_labels(&name, &PairLabels::default(), &Operation::default()).unwrap();
        assert!(open_source(&place).unwrap().load_labels(&name).unwrap().is_empty());
    }

    #[test]
    fn damaged_labels_are_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        pictures(folder.path());
        let place = Place::Path(folder.path().to_owned());
        let source = open_source(&place).unwrap();
        let name = source.index().pairs[0].name.clone();
        source.save_labels(&name, &labels(), &Operation::default()).unwrap();
        let folder = source.labels.folder().unwrap().to_owned();
        let file = MaskStore::in_folder(folder).mask_file(&name, lab::RIGHT);
        std::fs::write(&file, b"{ half a fi").unwrap();
        let again = open_source(&place).unwrap();
        assert!(again.load_labels(&name).unwrap_err().hint.is_some());
        assert!(again.save_labels(&name, &labels(), &Operation::default()).is_err());
        assert_eq!(std::fs::read(&file).unwrap(), b"{ half a fi");
    }

    #[test]
    fn export_takes_what_is_stored_and_what_changed_since() {
        let folder = tempfile::tempdir().unwrap();
        pictures(folder.path());
        let source = open_source(&Place::Path(folder.path().to_owned())).unwrap();
        let name = source.index().pairs[0].name.clone();
        let out = folder.path().join("export");
        let cx = JobCx::unwatched();
        let (done, begun) = (ExportChoice::default(), ExportChoice { which: Which::Begun, ..ExportChoice::default() });
        let none = source.export_masks(&BTreeMap::new(), done, &out, &cx).unwrap_err();
        assert!(none.why.contains("no mask") && !out.exists());
        let finger = source.load(PairId(0)).unwrap().pads.entries().next().unwrap().0;
        let mut labels = labels();
        assert_eq!(finger, lab::RIGHT);
        labels.review = Review::InProgress;
        let changed = BTreeMap::from([(name.clone(), labels.clone())]);
        // What was begun goes along if asked only.
        let plan = source.plan_masks(&changed, done).unwrap();
        assert_eq!((plan.total(), &plan.left_out), (0, &BTreeMap::from([(LeftOut::NotDone, 1)])));
        assert!(source.export_masks(&changed, done, &out, &cx).unwrap_err().why.contains("not marked \"done\""));
        let line = source.export_masks(&changed, begun, &out, &cx).unwrap();
        assert!(line.contains("1 mask"), "{line}");
        labels.review = Review::Done;
        let changed = BTreeMap::from([(name.clone(), labels.clone())]);
        assert!(source.export_masks(&changed, done, &out, &cx).is_ok());
        for left_out in [Review::Skip, Review::Flagged] {
            labels.review = left_out;
            assert!(source.export_masks(&BTreeMap::from([(name.clone(), labels.clone())]), begun, &out, &cx).is_err());
        }
        cx.cancel.cancel();
    }

    #[test]
    fn settings_come_back_and_bad_ones_are_set_aside() {
        let folder = tempfile::tempdir().unwrap();
        let services = LiveServices::with_config_folder(Some(folder.path().join("new")));
        assert_eq!(services.load_settings(), (Settings::default(), None));
        let mut settings = Settings::default();
        settings.mask.radius_px = 7.5;
        settings.recent.push(Place::Path("/data/x".into()));
        services.save_settings(&settings).unwrap();
        assert_eq!(services.load_settings(), (settings, None));
        let file = folder.path().join("new").join(SETTINGS_FILE);
        for bad in ["", "[1, 2", r#"{"version": 999}"#, r#"{"theme": "light"}"#] {
            std::fs::write(&file, bad).unwrap();
            let (settings, problem) = services.load_settings();
            assert_eq!(settings, Settings::default(), "{bad}");
            assert!(problem.unwrap().hint.unwrap().contains(BAD_SETTINGS_FILE));
            assert!(!file.exists(), "set aside, so that the next start is quiet");
            assert_eq!(std::fs::read_to_string(file.with_file_name(BAD_SETTINGS_FILE)).unwrap(), bad);
        }
        // Numbers that cannot be worked with are brought into range; unknown and missing keys are no harm.
        std::fs::write(&file, r#"{"version": 1, "ui_zoom": 1e9, "new_key": 3}"#).unwrap();
        assert_eq!(services.load_settings().0.ui_zoom, 4.0);
        // Keys that cannot be used cost nothing else, and are said.
        // A field that cannot be read falls back alone, and the file as it was is kept.
        let one = r#"{"version": 1, "theme": "plaid", "ui_zoom": 2.0, "recent": ["demo", 7, {"path": "/data/x"}],
            "compare": {"inspect": {"a": "measured", "b": "prediction:bundle=a, b"}, "label": {"a": "stored"}},
            "mask": {"radius_px": "wide", "clean_mm": 2.0}, "last": {"cameras": ["one"], "pair": "data_6"}}"#;
        std::fs::write(&file, one).unwrap();
        let (settings, problem) = services.load_settings();
        let problem = problem.unwrap();
        assert!(problem.hint.unwrap().contains(BAD_SETTINGS_FILE));
        let fields = ["compare.inspect.b", "last.cameras", "mask.radius_px", "recent[1]", "theme"];
        let fields = fields.map(|field| format!("{field} cannot be read")).join("; ");
        assert_eq!(problem.why, format!("{fields} ({})", file.display()));
        assert_eq!(std::fs::read_to_string(file.with_file_name(BAD_SETTINGS_FILE)).unwrap(), one);
        let mut want = Settings { ui_zoom: 2.0, ..Settings::default() };
        want.recent = vec![Place::Demo, Place::Path("/data/x".into())];
        want.mask.clean_mm = 2.0;
        want.last.pair = "data_6".into();
        let compared = |a| CompareChoice { a, ..CompareChoice::default() };
        want.compare.insert(Workspace::Inspect, compared(Subject::Measured));
        want.compare.insert(Workspace::Label, compared(Subject::Stored));
        assert_eq!(settings, want);
    }

    #[test]
    fn the_demo_opens_without_a_folder() {
        let demo = open_source(&Place::Demo).unwrap();
        assert_eq!(demo.root(), None);
        assert!(demo.index().pairs.len() >= 12);
        let tool = demo.index().pairs[0].tool.clone().unwrap();
        assert!(demo.tool_mesh(&tool).unwrap().is_watertight());
        assert!(demo.tool_mesh("no such tool").unwrap_err().hint.is_some());
        assert!(open_source(&Place::Path("/no/such/folder".into())).unwrap_err().hint.is_some());
    }
}
