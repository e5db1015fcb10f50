//! The services of the program: data sets and labels through `io`, models through `infer`, settings in the user's
//! configuration folder.

mod follow;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::super::command::Opened;
use super::super::document::{HandMask, PairLabels, Review};
use super::super::error::TaskError;
use super::super::jobs::JobCx;
use super::super::keys::{Revision, TouchKey};
use super::super::library::{BundleInfo, BundleKind, GeneratorInfo, Place};
use super::super::results::Prediction;
use super::super::settings::{RuntimeChoice, SETTINGS_VERSION, Settings};
use super::{DataSource, Following, GenerateItem, Generated, Services};
use crate::domain::dataset::{Index, PairId, Problem};
use crate::domain::grid::{DepthMap, Mask, RgbGrid};
use crate::domain::mesh::TriMesh;
use crate::domain::sample::Sample;
use crate::domain::sensor::Finger;
use crate::infer::bundle::{self, Bundle, BundleSpec};
use crate::infer::engine::EngineChoice;
use crate::infer::generator::Generator;
use crate::infer::mask::MaskModel;
use crate::infer::store::{self, Store};
use crate::io::atomic;
use crate::io::dataset::Dataset;
use crate::io::export_unet::{self, ExportConfig, ExportEntry};
use crate::io::masks::{self, MaskStore, StoreError, StoredMask, StoredReview};
use crate::io::statistics::ShiftStatistics;

/// The settings file inside the configuration folder.
const SETTINGS_FILE: &str = "settings.json";
/// Where a settings file that cannot be used is put.
const BAD_SETTINGS_FILE: &str = "settings.bad.json";

/// A model in memory, with the bundle's identity and the runtime it was loaded for.
pub(super) type Loaded<T> = Option<((Arc<str>, RuntimeChoice), T)>;

/// The program's services. Models stay loaded between calls.
#[derive(Debug, Default)]
pub struct LiveServices {
    config_folder: Option<PathBuf>,
    /// Predictions kept on the disk.
    pub(super) store: Option<Mutex<Store>>,
    pub(super) generator: Mutex<Loaded<Generator>>,
    mask_model: Mutex<Loaded<MaskModel>>,
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl LiveServices {
    /// With settings in the user's configuration folder.
    pub fn new() -> Self {
        let store = store::user_folder().map(|folder| Mutex::new(Store::new(folder, store::DEFAULT_BUDGET)));
        Self { config_folder: user_config_folder(), store, ..Self::default() }
    }

    /// With settings and kept predictions in a given folder; `None` keeps none.
    pub fn with_config_folder(folder: Option<PathBuf>) -> Self {
        let kept = folder.as_ref().map(|folder| folder.join("predictions"));
        let store = kept.map(|folder| Mutex::new(Store::new(folder, store::DEFAULT_BUDGET)));
        Self { config_folder: folder, store, ..Self::default() }
    }
}

/// The user's folder for this program's configuration, by the rules of the platform.
fn user_config_folder() -> Option<PathBuf> {
    let from = |variable: &str| std::env::var_os(variable).map(PathBuf::from).filter(|p| p.is_absolute());
    let base = from("XDG_CONFIG_HOME").or_else(|| {
        if cfg!(windows) {
            from("APPDATA")
        } else if cfg!(target_os = "macos") {
            Some(from("HOME")?.join("Library/Application Support"))
        } else {
            Some(from("HOME")?.join(".config"))
        }
    })?;
    Some(base.join("touch2touch"))
}

/// Opens a place as the studio does: data set, stored labels, and what is wrong with either.
///
/// # Errors
/// If nothing in it can be opened.
pub fn open_source(place: &Place) -> Result<LiveSource, TaskError> {
    let dataset = match place {
        Place::Demo => Dataset::demo(),
        Place::Path(path) => Dataset::open(path)
            .map_err(|err| TaskError::from_error(format!("Open {place}"), &err).with_hint(err.hint()))?,
    };
    let mut problems = dataset.problems.clone();
    let store = MaskStore::for_dataset(&dataset);
    let mut reviews = BTreeMap::new();
    match &store {
        Ok(store) => {
            let (stored, mut damaged) = store.reviews();
            problems.append(&mut damaged);
            for (pair, review) in stored {
                match Review::from_stored(&review.review) {
                    Some(Review::Todo) | None => {}
                    Some(review) => {
                        reviews.insert(pair, review);
                    }
                }
            }
        }
        Err(err) => problems.push(Problem {
            file: dataset.root.clone().unwrap_or_default(),
            what: err.to_string(),
            hint: err.hint().into(),
        }),
    }
    Ok(LiveSource { dataset: Arc::new(dataset), store, problems, reviews, saved: Arc::default() })
}

/// An open data set with its store of labels.
#[derive(Debug)]
pub struct LiveSource {
    dataset: Arc<Dataset>,
    store: Result<MaskStore, StoreError>,
    problems: Vec<Problem>,
    reviews: BTreeMap<String, Review>,
    /// What is on the disk, as far as it was read or written here: only differences are written.
    saved: Arc<Mutex<BTreeMap<String, PairLabels>>>,
}

impl LiveSource {
    /// The data set.
    pub fn dataset(&self) -> &Dataset {
        &self.dataset
    }

    fn store(&self, what: &str) -> Result<&MaskStore, TaskError> {
        self.store.as_ref().map_err(|err| store_error(what, err))
    }
}

fn store_error(what: &str, err: &StoreError) -> TaskError {
    TaskError::from_error(what, err).with_hint(err.hint())
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
        let what = format!("CAD model of {tool}");
        match self.dataset.tool_mesh(tool) {
            Ok(Some(mesh)) => Ok(mesh),
            Ok(None) => Err(TaskError::new(what, format!("there is no {tool}.stl in the data set"))
                .with_hint("Put it into data/tools_stls, in metres and the object frame.")),
            Err(err) => Err(TaskError::from_error(what, &err).with_hint(err.hint())),
        }
    }

    fn follow(&self) -> Option<Box<dyn Following>> {
        follow::start(self)
    }

    fn load_labels(&self, name: &str) -> Result<PairLabels, TaskError> {
        let what = format!("Labels of {name}");
        // Without a place for labels there are none; saving says why.
        let Ok(store) = &self.store else { return Ok(PairLabels::default()) };
        let fail = |err: StoreError| store_error(&what, &err);
        let mut labels = PairLabels::default();
        for finger in Finger::BOTH {
            labels.masks[finger.index()] = store.load(name, finger).map_err(fail)?.map(|stored| HandMask {
                mask: Arc::new(stored.mask),
                revision: Revision::default(),
                base: stored.base,
            });
        }
        if let Some(stored) = store.load_review(name).map_err(fail)? {
            labels.review = Review::from_stored(&stored.review).ok_or_else(|| {
                TaskError::new(&what, format!("the review state \"{}\" is not known", stored.review))
                    .with_hint("It may come from a newer version of this program.")
            })?;
            labels.accepted = stored.accepted;
        }
        lock(&self.saved).insert(name.to_owned(), labels.clone());
        Ok(labels)
    }

    fn save_labels(&self, name: &str, labels: &PairLabels) -> Result<(), TaskError> {
        let what = format!("Save the labels of {name}");
        let store = self.store(&what)?;
        let fail = |err: StoreError| store_error(&what, &err);
        let before = lock(&self.saved).get(name).cloned().unwrap_or_default();
        for finger in Finger::BOTH {
            let at = finger.index();
            let same = match (&before.masks[at], &labels.masks[at]) {
                (None, None) => true,
                (Some(a), Some(b)) => a.mask == b.mask && a.base == b.base,
                _ => false,
            };
            if same {
                continue;
            }
            let stored = labels.masks[at].as_ref().map(|hand| StoredMask {
                mask: (*hand.mask).clone(),
                base: hand.base.clone(),
                person: masks::person(),
                saved_unix_s: masks::now_unix_s(),
            });
            store.save(name, finger, stored.as_ref()).map_err(fail)?;
        }
        if before.review != labels.review || before.accepted != labels.accepted {
            let review = StoredReview { review: labels.review.stored().into(), accepted: labels.accepted };
            store.save_review(name, &review).map_err(fail)?;
        }
        lock(&self.saved).insert(name.to_owned(), labels.clone());
        Ok(())
    }

    fn export_masks(
        &self,
        changed: &BTreeMap<String, PairLabels>,
        folder: &Path,
        cx: &JobCx,
    ) -> Result<String, TaskError> {
        const WHAT: &str = "Export masks";
        let known: BTreeMap<&str, PairId> =
            (0u32..).zip(&self.dataset.index.pairs).map(|(id, entry)| (entry.name.as_str(), PairId(id))).collect();
        // What is on the disk, and over it what was changed since.
        let mut wanted: BTreeSet<(String, Finger)> =
            self.store.as_ref().map_or_else(|_| Vec::new(), MaskStore::masks).into_iter().collect();
        for (pair, labels) in changed {
            for finger in Finger::BOTH {
                let key = (pair.clone(), finger);
                if labels.masks[finger.index()].is_some() {
                    wanted.insert(key);
                } else {
                    wanted.remove(&key);
                }
            }
        }
        let review = |pair: &str| {
            changed.get(pair).map(|l| l.review).or_else(|| self.reviews.get(pair).copied()).unwrap_or_default()
        };
        wanted.retain(|(pair, _)| known.contains_key(pair.as_str()) && review(pair) != Review::Skip);
        let entries: Vec<ExportEntry> = wanted
            .into_iter()
            .map(|(pair, finger)| {
                let tool = known.get(pair.as_str()).and_then(|id| self.dataset.index.get(*id)?.tool.clone());
                ExportEntry { pair, tool, finger }
            })
            .collect();
        if entries.is_empty() {
            return Err(TaskError::new(WHAT, "no mask was corrected yet")
                .with_hint("Correct masks, or take automatic ones over with \"Threshold to mask\" (T)."));
        }
        let total = entries.len() as u64;
        let report = export_unet::export(folder, &entries, &ExportConfig::default(), |at| {
            let entry = &entries[at];
            cx.check(WHAT)?;
            cx.progress(at as u64, total, format!("{}, {}", entry.pair, entry.finger.name()));
            let sample = self.load(known[entry.pair.as_str()])?;
            let bubble = sample.finger(entry.finger).and_then(|touch| touch.bubble.as_ref());
            let imprint = bubble.ok_or_else(|| TaskError::new(WHAT, "the finger has no imprint"))?.imprint.clone();
            let mask = match changed.get(&entry.pair).and_then(|l| l.masks[entry.finger.index()].as_ref()) {
                Some(hand) => (*hand.mask).clone(),
                None => {
                    let stored = self.store(WHAT)?.load(&entry.pair, entry.finger)?;
                    stored.ok_or_else(|| TaskError::new(WHAT, "its mask disappeared"))?.mask
                }
            };
            Ok((imprint, mask))
        })
        .map_err(|err| {
            if cx.cancel.is_cancelled() { TaskError::cancelled(WHAT) } else { TaskError::from_error(WHAT, &err) }
        })?;
        let [train, val, test] = report.counts;
        Ok(format!("Exported {total} masks to {} ({train} train, {val} val, {test} test)", folder.display()))
    }
}

impl Services for LiveServices {
    fn open(&self, place: &Place) -> Result<Opened, TaskError> {
        let source = open_source(place)?;
        let reviews = source.reviews.clone();
        Ok(Opened { source: Arc::new(source), reviews })
    }

    fn find_bundles(&self, folders: &[PathBuf]) -> (Vec<BundleInfo>, Vec<TaskError>) {
        let found = bundle::find_all(folders);
        let problems = found
            .problems
            .into_iter()
            .map(|p| {
                TaskError::new("A model bundle was refused", format!("{} ({})", p.what, p.file.display()))
                    .with_hint(p.hint)
            })
            .collect();
        (found.bundles.iter().map(info).collect(), problems)
    }

    fn generate(
        &self,
        bundle: &BundleInfo,
        items: &[GenerateItem<'_>],
        cx: &JobCx,
    ) -> Result<Vec<Generated>, TaskError> {
        super::predictions::generate(self, bundle, items, cx)
    }

    fn stored(
        &self,
        bundles: &[BundleInfo],
        runtime: RuntimeChoice,
        touch: TouchKey,
        difference: &RgbGrid,
    ) -> Vec<Prediction> {
        super::predictions::stored(self, bundles, runtime, touch, difference)
    }

    fn mask_by_model(
        &self,
        bundle: &BundleInfo,
        runtime: RuntimeChoice,
        imprint: &DepthMap,
    ) -> Result<Mask, TaskError> {
        let what = format!("Mask with {}", bundle.name);
        let key = (bundle.id.clone(), runtime);
        let mut loaded = lock(&self.mask_model);
        if loaded.as_ref().is_none_or(|(k, _)| *k != key) {
            *loaded = None;
            let checked = open_bundle(&what, bundle)?;
            let model = MaskModel::open(&checked, runtime.into()).map_err(|err| TaskError::from_error(&what, &err))?;
            *loaded = Some((key, model));
        }
        let Some((_, model)) = loaded.as_mut() else { return Err(TaskError::new(what, "no model is loaded")) };
        model.predict(imprint).map_err(|err| TaskError::from_error(what, &err))
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
        let text = serde_json::to_vec_pretty(settings).map_err(|err| fail(err.into()))?;
        std::fs::create_dir_all(folder).map_err(fail)?;
        atomic::write_bytes(&file, &text).map_err(fail)
    }
}

impl LiveServices {
    /// The budget of the kept predictions as the settings say.
    fn keep_at_most(&self, settings: &Settings) {
        if let Some(store) = &self.store {
            lock(store).set_budget(u64::from(settings.cache_mib) << 20);
        }
    }

    fn read_settings(&self) -> (Settings, Option<TaskError>) {
        let Some(folder) = &self.config_folder else { return (Settings::default(), None) };
        let file = folder.join(SETTINGS_FILE);
        let bytes = match std::fs::read(&file) {
            Ok(bytes) => bytes,
            Err(err) if err.kind() == std::io::ErrorKind::NotFound => return (Settings::default(), None),
            Err(err) => {
                let why = format!("{err} ({})", file.display());
                return (Settings::default(), Some(TaskError::new("The preferences could not be read", why)));
            }
        };
        match parse_settings(&bytes) {
            Ok(settings) => (settings.validated(), None),
            Err(why) => {
                let bad = folder.join(BAD_SETTINGS_FILE);
                let kept = match std::fs::rename(&file, &bad) {
                    Ok(()) => format!("They are kept in {}.", bad.display()),
                    Err(err) => format!("They could not be set aside: {err}."),
                };
                let why = format!("{why} ({})", file.display());
                let problem = TaskError::new("The preferences were set to their defaults", why).with_hint(kept);
                (Settings::default(), Some(problem))
            }
        }
    }
}

fn parse_settings(bytes: &[u8]) -> Result<Settings, String> {
    let value: serde_json::Value = serde_json::from_slice(bytes).map_err(|err| err.to_string())?;
    let version = value.get("version").and_then(serde_json::Value::as_u64);
    if version != Some(SETTINGS_VERSION.into()) {
        return Err(format!(
            "they are of version {}, this program writes version {SETTINGS_VERSION}",
            version.map_or_else(|| "unknown".into(), |v| v.to_string())
        ));
    }
    serde_json::from_value(value).map_err(|err| err.to_string())
}

/// What the model shows of a bundle.
pub fn info(bundle: &Bundle) -> BundleInfo {
    BundleInfo {
        id: bundle.hash().into(),
        name: bundle.name().to_owned(),
        kind: match bundle.spec() {
            BundleSpec::Generator(_) => BundleKind::Generator,
            BundleSpec::MaskUnet(_) => BundleKind::Mask,
            BundleSpec::ToolClassifier(_) => BundleKind::Classifier,
        },
        origin: bundle.origin().clone(),
        generator: bundle.generator().map(|spec| GeneratorInfo {
            defaults: spec.defaults,
            training_steps: spec.schedule.training_steps(),
            guided: spec.guidance.is_some(),
        }),
    }
}

/// Opens a bundle that was found before. It must still be the same: its identity is part of the recipe.
pub(super) fn open_bundle(what: &str, bundle: &BundleInfo) -> Result<Bundle, TaskError> {
    let checked = Bundle::open(&bundle.origin).map_err(|err| TaskError::from_error(what, &err))?;
    if checked.hash() == &*bundle.id {
        return Ok(checked);
    }
    let why = format!("the bundle was changed since it was found ({})", bundle.origin);
    Err(TaskError::new(what, why).with_hint("Start the program again."))
}

impl From<RuntimeChoice> for EngineChoice {
    fn from(choice: RuntimeChoice) -> Self {
        match choice {
            RuntimeChoice::Auto => Self::Auto,
            RuntimeChoice::Rten => Self::Rten,
            RuntimeChoice::Ort => Self::Ort,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::frames::PlanarPose;
    use crate::domain::hand::{AcceptedPose, HandPose};

    /// A folder with one pair of pictures.
    fn pictures(folder: &Path) {
        let grey = crate::domain::grid::Grid::from_fn(32, 32, |x, y| (x * 4 + y) as u8);
        let rgb = RgbGrid::from_fn(32, 32, |x, y| [x as f32, y as f32, 9.0]);
        crate::io::images::write_grey8(&folder.join("a_bubble.png"), &grey).unwrap();
        crate::io::images::write_rgb8(&folder.join("a_gelslim.png"), &rgb).unwrap();
    }

    fn labels() -> PairLabels {
        let mask = Arc::new(Mask::from_fn(175, 140, |x, y| x > 20 && y < 9));
        PairLabels {
            masks: [Some(HandMask { mask, revision: Revision(3), base: "Threshold 5.00 mm".into() }), None],
            review: Review::InProgress,
            accepted: [
                Some(PlanarPose { theta_rad: 0.1, y_m: 0.002, z_m: -0.001 }.into()),
                Some(AcceptedPose { pose: HandPose { x_m: 1e-3, ..HandPose::default() }, by_hand: true }),
            ],
        }
    }

    fn same(a: &PairLabels, b: &PairLabels) -> bool {
        let masks = |l: &PairLabels| l.masks.clone().map(|m| m.map(|h| (h.mask, h.base)));
        masks(a) == masks(b) && a.review == b.review && a.accepted == b.accepted
    }

    #[test]
    fn labels_come_back_and_undo_reaches_the_disk() {
        let folder = tempfile::tempdir().unwrap();
        pictures(folder.path());
        let place = Place::Path(folder.path().to_owned());
        let source = open_source(&place).unwrap();
        let name = source.index().pairs[0].name.clone();
        assert!(source.load_labels(&name).unwrap().is_empty());
        source.save_labels(&name, &labels()).unwrap();
        let again = LiveServices::with_config_folder(None).open(&place).unwrap();
        assert_eq!(again.reviews[&name], Review::InProgress);
        assert!(same(&again.source.load_labels(&name).unwrap(), &labels()));
        again.source.save_labels(&name, &PairLabels::default()).unwrap();
        assert!(open_source(&place).unwrap().load_labels(&name).unwrap().is_empty());
    }

    #[test]
    fn damaged_labels_are_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        pictures(folder.path());
        let place = Place::Path(folder.path().to_owned());
        let source = open_source(&place).unwrap();
        let name = source.index().pairs[0].name.clone();
        source.save_labels(&name, &labels()).unwrap();
        let file = source.store("test").unwrap().mask_file(&name, Finger::Right);
        std::fs::write(&file, b"{ half a fi").unwrap();
        let again = open_source(&place).unwrap();
        assert!(again.load_labels(&name).unwrap_err().hint.is_some());
        assert!(again.save_labels(&name, &labels()).is_err());
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
        let none = source.export_masks(&BTreeMap::new(), &out, &cx).unwrap_err();
        assert!(none.why.contains("no mask") && !out.exists());
        let finger = source.load(PairId(0)).unwrap().fingers.iter().position(Option::is_some).unwrap();
        let mut labels = labels();
        labels.masks.swap(0, finger);
        let line = source.export_masks(&BTreeMap::from([(name.clone(), labels.clone())]), &out, &cx).unwrap();
        assert!(line.starts_with("Exported 1 masks"), "{line}");
        labels.review = Review::Skip;
        assert!(source.export_masks(&BTreeMap::from([(name, labels)]), &out, &cx).is_err());
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
        for bad in ["", "[1, 2", r#"{"version": 999}"#, r#"{"version": 1, "theme": "plaid"}"#] {
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
