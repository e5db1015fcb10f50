//! A case: one pair with everything that its results depend on, in one file that gives the same results elsewhere
//! ([`make`], [`open`], [`check`]).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use strum::IntoEnumIterator as _;

use crate::bundles::{self, BundleInfo, FoundBundles, by_id};
use crate::error::TaskError;
use crate::feel::{Touch, feel};
use crate::infer::bundle::Origin;
use crate::io::case_file::{self, CaseContent};
use crate::io::dataset::{BuiltIn, Dataset, READ_AS_FILE, UNIT_FILE};
use crate::io::digest::sha256;
use crate::io::masks::ByImprint;
use crate::io::{files, npz};
use crate::job::JobCx;
use crate::labels::{
    DrawnMask, ImprintOf, ImprintSource, Labels, MaskPlace, Operation, PairLabels, Review, by_imprint, note,
    of_imprints,
};
use crate::models::Models;
use crate::recipe::{Model, ModelName, Recipe, Stage};
use crate::tool::load_tool;
use touch2touch_core::align::Ask;
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Grid, Mask};
use touch2touch_core::label::PackedMask;
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::PadId;
use touch2touch_core::units::{angle_error, mm};

const WHAT: &str = "Case";
const FORMAT: &str = "touch2touch-case";
/// Version 1 held no results and no models.
const VERSION: u32 = 2;
/// Largest file that is taken into a case, bytes.
const MAX_FILE: u64 = 64 << 20;
/// A model is taken into a case up to this size, bytes; a larger one is named only.
const MAX_MODEL: u64 = 40 << 20;

/// A mask that a person drew.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct CaseMask {
    finger: PadId,
    #[serde(flatten)]
    mask: PackedMask,
    /// The imprint that it was drawn on.
    #[serde(default)]
    of: ImprintOf,
}

/// The labels of a pair.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct CaseLabels {
    masks: Vec<CaseMask>,
    review: Review,
    #[serde(flatten)]
    accepted: ByImprint<AcceptedPose>,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    note: String,
}

/// Results from one imprint of the case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseResult {
    /// Imprint: measured or predicted.
    pub imprint: ImprintSource,
    /// By finger, the hash of the imprint (meters, 32-bit floats) and of its contact mask.
    pub fingers: BTreeMap<String, [String; 2]>,
    /// The pose, `grasp_from_object`; `None` where there is none.
    pub pose: Option<PlanarPose>,
    /// Root mean square of the residuals, meters.
    pub rms_m: Option<f64>,
    /// The poses that the registration went through.
    pub trace: Vec<PlanarPose>,
}

/// The manifest of a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Case {
    format: String,
    version: u32,
    /// The program that made it.
    pub made_by: String,
    /// The data set's name.
    pub dataset: String,
    /// The built-in data set that the pair is of; `None` where its files are in the case.
    pub built_in: Option<String>,
    /// The pair.
    pub pair: String,
    /// Recipe of the results.
    pub recipe: Recipe<ModelName>,
    labels: CaseLabels,
    /// Hashes of the files in it.
    files: BTreeMap<String, String>,
    /// Hashes of the results and models in it.
    #[serde(default)]
    beside: BTreeMap<String, String>,
    /// The results.
    pub results: Vec<CaseResult>,
    /// View in the studio: preferences and camera, as it keeps them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view: Option<serde_json::Value>,
}

/// A case that is unpacked and opened.
#[derive(Debug)]
pub struct OpenedCase {
    /// Manifest of the case.
    pub case: Case,
    /// The data.
    pub dataset: Dataset,
    /// The pair.
    pub pair: PairId,
    /// Labels that a person gave the pair.
    pub labels: PairLabels,
    /// Imprints and models that the case brings besides.
    pub held: Held,
}

/// Content of a case besides the data.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Held {
    /// The imprints that its results were had from, meters.
    pub imprints: BTreeMap<(ImprintSource, PadId), DepthMap>,
    /// The folder of its models; `None` where it brings none.
    pub models: Option<PathBuf>,
}

/// Differences between a case and the results of this program.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CaseReport {
    /// The pair.
    pub pair: String,
    /// True where everything is the same, bit for bit.
    pub same: bool,
    /// Things compared.
    pub compared: usize,
    /// Differences in words, with by how much where that is known.
    pub differences: Vec<String>,
}

/// The name of an imprint in a case.
fn imprint_name(source: ImprintSource, finger: &str) -> String {
    format!("{}{}_{finger}_imprint.npy", case_file::RESULTS, source.key())
}

/// A result with what it was had from.
struct Made {
    result: CaseResult,
    /// Imprints, and masks as 0 and 1, by their names in a case.
    arrays: BTreeMap<String, Vec<u8>>,
}

fn hash<T>(grid: &Grid<T>, bytes: impl Fn(&T) -> [u8; 4]) -> String {
    let mut all: Vec<u8> = grid.size().iter().flat_map(|n| (*n as u64).to_le_bytes()).collect();
    // All that is not a number counts as the same.
    all.extend(grid.as_slice().iter().flat_map(bytes));
    sha256(&all)
}

fn imprint_hash(imprint: &DepthMap) -> String {
    hash(imprint, |v| if v.is_nan() { f32::NAN.to_le_bytes() } else { v.to_le_bytes() })
}

fn mask_hash(mask: &Mask) -> String {
    hash(mask, |on| u32::from(*on).to_le_bytes())
}

impl CaseLabels {
    fn of(labels: &PairLabels) -> Self {
        let mask = |(place, hand): (&MaskPlace, &DrawnMask)| CaseMask {
            finger: place.pad,
            of: place.of.clone(),
            mask: hand.pack(),
        };
        Self {
            masks: labels.masks.iter().map(mask).collect(),
            review: labels.review,
            accepted: by_imprint(&labels.accepted),
            note: labels.note.clone(),
        }
    }

    fn labels(&self) -> Result<PairLabels, TaskError> {
        let mut labels = PairLabels {
            review: self.review,
            accepted: of_imprints(self.accepted.clone()),
            note: note(&self.note),
            ..PairLabels::default()
        };
        for mask in &self.masks {
            let hand =
                DrawnMask::unpack(&mask.mask, Default::default()).map_err(|err| TaskError::from_error(WHAT, &err))?;
            if mask.finger.index() >= 16 {
                return Err(TaskError::new(WHAT, "it has a mask of a finger that no gripper has"));
            }
            labels.masks.insert(MaskPlace { pad: mask.finger, of: mask.of.clone() }, hand);
        }
        Ok(labels)
    }
}

/// The results of a pair, with the models at hand.
fn results(touch: Touch<'_>, recipe: &Recipe, models: &Models, cx: &JobCx) -> Result<Vec<Made>, TaskError> {
    let sample = touch.sample;
    let mut out = Vec::new();
    for source in
        ImprintSource::iter().filter(|source| recipe.generator.is_some() || *source == ImprintSource::Measured)
    {
        let drawn = feel(touch, &recipe.of(source), Stage::Prediction, models, cx)?;
        // A color picture has no pose.
        if drawn.predictions.iter().flatten().any(|made| made.color.is_some()) {
            continue;
        }
        let felt = drawn.reach(touch, Stage::Imprint, models, cx)?;
        if felt.imprints.is_empty() {
            continue;
        }
        cx.check(WHAT)?;
        let ask = Ask { record: true, ..Ask::default() };
        let felt = felt.reach_asking(touch, Stage::Pose, ask, models, cx)?;
        let contact = felt.contact();
        let mut arrays = BTreeMap::new();
        for (pad, imprint) in contact.imprints.entries() {
            let finger = sample.rig.pad_key(pad);
            arrays.insert(imprint_name(source, &finger), npz::npy_bytes(imprint));
            if let Some(found) = &contact.masks[pad] {
                let name = format!("{}{}_{finger}_mask.npy", case_file::RESULTS, source.key());
                arrays.insert(name, npz::npy_bytes(&found.mask.map(|on| f32::from(u8::from(*on)))));
            }
        }
        let hashes = contact.imprints.entries().map(|(pad, imprint)| {
            let mask = contact.masks[pad].as_ref().map_or_else(String::new, |found| mask_hash(&found.mask));
            (sample.rig.pad_key(pad).into_owned(), [imprint_hash(imprint), mask])
        });
        // Without points or a tool there is no pose, and that is a result as well.
        let found = felt.pose().ok();
        let result = CaseResult {
            imprint: source,
            fingers: hashes.collect(),
            pose: found.map(|found| found.grasp_from_object),
            rms_m: found.map(|found| found.rms_m),
            trace: found.map_or_else(Vec::new, |f| f.report.trace.iter().map(|step| step.grasp_from_object).collect()),
        };
        out.push(Made { result, arrays });
    }
    Ok(out)
}

/// The tool of a pair; `Err` says why there is none.
fn tool_of(dataset: &Dataset, pair: PairId) -> Result<ToolModel, TaskError> {
    let tool = dataset.index.get(pair).and_then(|entry| entry.tool.as_deref());
    let name = tool.ok_or_else(|| TaskError::new(WHAT, "no tool is named"))?;
    load_tool(dataset, name).map(|loaded| loaded.model)
}

/// Content of a case to be written, besides the data.
#[derive(Clone, Debug)]
pub struct CaseSetup {
    /// The pair.
    pub pair: PairId,
    /// Recipe that decides its results.
    pub recipe: Recipe,
    /// Labels that a person gave the pair.
    pub labels: PairLabels,
    /// View in the studio.
    pub view: Option<serde_json::Value>,
}

/// Makes a case of a pair and writes it.
///
/// # Errors
/// If the pair or a model cannot be used, a file is too large, or the case cannot be written.
pub fn make(dataset: &Dataset, setup: &CaseSetup, models: &Models, file: &Path, cx: &JobCx) -> Result<Case, TaskError> {
    let entry = dataset.index.get(setup.pair).ok_or_else(|| TaskError::new(WHAT, "there is no such pair"))?;
    let fail = |err: &dyn std::error::Error| TaskError::from_error(WHAT, err);
    let sample = dataset.load(setup.pair).map_err(|err| fail(&err).with_hint(err.hint()))?;
    let mut content = CaseContent::default();
    let built_in = built_in_name(dataset);
    if built_in.is_none() {
        for path in inputs(dataset, setup.pair) {
            let bytes = files::read(&path, MAX_FILE)
                .map_err(|err| TaskError::new(WHAT, format!("{err} ({})", path.display())))?;
            content.files.insert(relative(dataset, &path)?, bytes);
        }
    }
    let recipe = &setup.recipe;
    let bundles = [recipe.generator.as_ref().map(|(model, _)| model), recipe.mask_model.as_ref()];
    for bundle in bundles.into_iter().flatten().filter(|bundle| !Origin::ships(&bundle.id)) {
        content.beside.append(&mut packed(bundle)?);
    }
    let mut found = Vec::new();
    let tool = tool_of(dataset, setup.pair);
    let touch = Touch { dataset, pair: setup.pair, sample: &sample, tool: tool.as_ref(), labels: &setup.labels };
    for made in results(touch, recipe, models, cx)? {
        found.push(made.result);
        content.beside.extend(made.arrays);
    }
    let named = |model: Model| Some(ModelName::from(&model));
    let recipe = recipe.clone().with_models(named).unwrap_or_default();
    let case = Case {
        format: FORMAT.into(),
        version: VERSION,
        made_by: format!("touch2touch {}", env!("CARGO_PKG_VERSION")),
        dataset: dataset.title.clone(),
        built_in,
        pair: entry.name.clone(),
        recipe,
        labels: CaseLabels::of(&setup.labels),
        files: hashes(&content.files),
        beside: hashes(&content.beside),
        results: found,
        view: setup.view.clone(),
    };
    content.manifest = serde_json::to_vec_pretty(&case).map_err(|err| fail(&err))?;
    case_file::write(file, &content).map_err(|err| fail(&err))?;
    Ok(case)
}

fn hashes(files: &BTreeMap<String, Vec<u8>>) -> BTreeMap<String, String> {
    files.iter().map(|(name, bytes)| (name.clone(), sha256(bytes))).collect()
}

/// The files of a model that does not ship, by their names in a case; none of one that is too large for it.
fn packed(bundle: &BundleInfo) -> Result<BTreeMap<String, Vec<u8>>, TaskError> {
    let opened = bundle.open(WHAT)?;
    if opened.bytes() > MAX_MODEL {
        return Ok(BTreeMap::new());
    }
    let content = opened.content(MAX_MODEL);
    let content = content.map_err(|err| TaskError::new(WHAT, format!("{err} ({})", bundle.origin)))?;
    let folder = format!("{}{:.16}", case_file::MODELS, bundle.id);
    Ok(content.into_iter().map(|(name, bytes)| (format!("{folder}/{name}"), bytes)).collect())
}

fn built_in_name(dataset: &Dataset) -> Option<String> {
    dataset.built_in_set().map(BuiltIn::name)
}

/// The files that a pair's results depend on: its own, its tool's model with the unit, the sensors, and how it is read.
fn inputs(dataset: &Dataset, pair: PairId) -> Vec<PathBuf> {
    let mut files = dataset.pair_files(pair);
    let tool = dataset.index.get(pair).and_then(|entry| entry.tool.as_deref());
    if let Some(model) = tool.and_then(|tool| dataset.tool_mesh_file(tool)) {
        files.push(model.to_owned());
        files.extend(model.parent().map(|folder| folder.join(UNIT_FILE)).filter(|file| file.is_file()));
    }
    let beside = dataset.root.iter().flat_map(|root| ["rig.json", READ_AS_FILE].map(|name| root.join(name)));
    files.extend(beside.filter(|file| file.is_file()));
    files
}

/// A file's path below the data set's folder; one beside it keeps the names of its last two parts.
fn relative(dataset: &Dataset, file: &Path) -> Result<String, TaskError> {
    let below = dataset.root.as_ref().and_then(|root| file.strip_prefix(root).ok()).ok_or_else(|| {
        TaskError::new(WHAT, format!("the file lies outside the data set's folder ({})", file.display()))
            .with_hint("Open the folder that holds all of it.")
    })?;
    let parts: Vec<_> = below.iter().map(|part| part.to_string_lossy()).collect();
    Ok(parts.join("/"))
}

/// Unpacks a case below a folder of its own and opens it.
///
/// # Errors
/// If it is no case of this version, its files were changed, or its pair cannot be opened.
pub fn open(file: &Path, folder: &Path) -> Result<OpenedCase, TaskError> {
    let fail = |why: String| TaskError::new(format!("Open {}", file.display()), why);
    let content = case_file::read(file).map_err(|err| fail(err.to_string()))?;
    let case: Case = serde_json::from_slice(&content.manifest).map_err(|err| fail(format!("its manifest: {err}")))?;
    if case.format != FORMAT || !(1..=VERSION).contains(&case.version) {
        return Err(fail(format!(
            "it is {:?} of version {}, not a case of version 1 to {VERSION}",
            case.format, case.version
        )));
    }
    if hashes(&content.files) != case.files || hashes(&content.beside) != case.beside {
        return Err(fail("its files are not those that its manifest names".into()));
    }
    let own = folder.join(&sha256(&content.manifest)[..16]);
    let mut dataset = match &case.built_in {
        Some(name) => Dataset::built_in(
            BuiltIn::named(name).ok_or_else(|| fail(format!("this program has no data set {name:?}")))?,
        ),
        None => {
            let own = own.join("data");
            case_file::unpack(&content, &own).map_err(|err| fail(err.to_string()))?;
            Dataset::open(&own).map_err(|err| fail(err.to_string()))?
        }
    };
    let pair = dataset.index.pairs.iter().position(|entry| entry.name == case.pair);
    let pair = pair.ok_or_else(|| fail(format!("there is no pair {:?} in it", case.pair)))?;
    let labels = case.labels.labels()?;
    // Its labels are kept apart from those of the data set that it was made from.
    dataset.title = format!("{}, case {}", case.dataset, &sha256(&content.manifest)[..8]);
    let mut held = Held::default();
    let sources = case.results.iter().map(|result| result.imprint);
    for (source, pad) in sources.flat_map(|source| dataset.rig.pads().map(move |pad| (source, pad))) {
        let name = imprint_name(source, &dataset.rig.pad_key(pad));
        if let Some(bytes) = content.beside.get(&name) {
            let imprint = npz::image_of_npy(bytes).map_err(|why| fail(format!("{name}: {why}")))?;
            held.imprints.insert((source, pad), imprint);
        }
    }
    if content.beside.keys().any(|name| name.starts_with(case_file::MODELS)) {
        let models = own.join("models");
        case_file::unpack_models(&content, &models).map_err(|err| fail(err.to_string()))?;
        held.models = Some(models);
    }
    Ok(OpenedCase { case, dataset, pair: PairId(pair as u32), labels, held })
}

impl OpenedCase {
    /// The bundles of this machine, and those that the case brings.
    pub fn bundles(&self) -> FoundBundles {
        bundles::find(self.held.models.as_slice())
    }

    /// Keeps what a person said where this data set's labels lie, unless something is there already.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep_labels(&self) -> Result<(), TaskError> {
        let store = Labels::of(&self.dataset);
        if self.labels.is_empty() || !store.load(&self.case.pair)?.is_empty() {
            return Ok(());
        }
        store.save(&self.case.pair, &self.labels, &Operation::named("opened with a case")).map(drop)
    }
}

/// Makes the results of a case again and says what differs.
///
/// # Errors
/// If the pair cannot be read, a model of the case is not there, or one cannot be run.
pub fn check(opened: &OpenedCase, found: &FoundBundles, models: &Models, cx: &JobCx) -> Result<CaseReport, TaskError> {
    let OpenedCase { case, dataset, pair, labels, .. } = opened;
    let sample = dataset.load(*pair).map_err(|err| TaskError::from_error(WHAT, &err).with_hint(err.hint()))?;
    let here = |named: ModelName| -> Option<Model> { by_id(&found.bundles, &named.id).cloned().map(Model::from) };
    let lacking = || {
        let (generator, mask_model) = (case.recipe.generator.iter().map(|(model, _)| model), &case.recipe.mask_model);
        let named = generator.chain(mask_model).find(|named| here((*named).clone()).is_none());
        let named = named.map_or_else(String::new, |named| format!("{} ({:.12})", named.name, named.id));
        TaskError::new(WHAT, format!("the model {named} is not here"))
            .with_hint("Name a folder with it in TOUCH2TOUCH_MODELS.")
    };
    let recipe = case.recipe.clone().with_models(here).ok_or_else(lacking)?;
    let tool = tool_of(dataset, *pair);
    let touch = Touch { dataset, pair: *pair, sample: &sample, tool: tool.as_ref(), labels };
    let now = results(touch, &recipe, models, cx)?;
    let now: Vec<CaseResult> = now.into_iter().map(|made| made.result).collect();
    let mut report = CaseReport { pair: case.pair.clone(), ..CaseReport::default() };
    compare(&case.results, &now, &mut report);
    report.same = report.differences.is_empty();
    Ok(report)
}

fn compare(then: &[CaseResult], now: &[CaseResult], report: &mut CaseReport) {
    let sources = |list: &[CaseResult]| list.iter().map(|r| r.imprint).collect::<Vec<_>>();
    if sources(then) != sources(now) {
        report.differences.push(format!("there are other imprints: {:?}, then {:?}", sources(now), sources(then)));
    }
    for (then, now) in then.iter().filter_map(|t| Some((t, now.iter().find(|n| n.imprint == t.imprint)?))) {
        let of = format!("{} imprint", then.imprint.key());
        for finger in now.fingers.keys().filter(|finger| !then.fingers.contains_key(*finger)) {
            report.compared += 1;
            report.differences.push(format!("{of}, {finger} finger: the case does not have it"));
        }
        for (finger, hashes) in &then.fingers {
            for (i, what) in ["the imprint itself", "the contact mask"].into_iter().enumerate() {
                report.compared += 1;
                if now.fingers.get(finger).map(|found| &found[i]) != Some(&hashes[i]) {
                    report.differences.push(format!("{of}, {finger} finger: {what} is another one"));
                }
            }
        }
        report.compared += 2;
        match (then.pose, now.pose) {
            (Some(a), Some(b)) if a != b => {
                let degrees = angle_error(a.theta_rad, b.theta_rad).to_degrees();
                let apart = mm((a.y_m - b.y_m).hypot(a.z_m - b.z_m));
                report.differences.push(format!("{of}: the pose lies {degrees:.3e}° and {apart:.3e} mm apart"));
            }
            (a, b) if a.is_some() != b.is_some() => {
                let there =
                    if b.is_some() { "there is a pose where there was none" } else { "there is no pose any more" };
                report.differences.push(format!("{of}: {there}"));
            }
            _ => {}
        }
        if then.trace != now.trace || then.rms_m != now.rms_m {
            let (a, b) = (then.trace.len(), now.trace.len());
            report.differences.push(format!("{of}: the registration went another way ({b} steps, then {a})"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::infer::engine::EngineChoice;
    use crate::io::simulated::{Layout, write_pair, write_tools};
    use crate::mask::{MaskChoice, MaskSource};
    use touch2touch_core::catalog;
    use touch2touch_core::label::Provenance;
    use touch2touch_core::rig::lab;
    use touch2touch_core::sim::{SimConfig, random_grasp, simulate};

    fn setup(labels: PairLabels) -> CaseSetup {
        CaseSetup {
            pair: PairId(0),
            recipe: Recipe {
                mask: MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() },
                engine: EngineChoice::Rten,
                ..Recipe::default()
            },
            labels,
            view: Some(serde_json::json!({ "camera": "here" })),
        }
    }

    fn drawn() -> PairLabels {
        let mask = Mask::from_fn(175, 140, |x, y| (60..110).contains(&x) && (40..90).contains(&y));
        let hand = DrawnMask::new(mask, Provenance::Threshold { min_m: 0.005 });
        let masks = [(MaskPlace::measured(lab::RIGHT), hand)].into();
        PairLabels { masks, review: Review::Flagged, ..PairLabels::default() }
    }

    fn checked(file: &Path, folder: &Path) -> (OpenedCase, CaseReport) {
        let opened = open(file, folder).unwrap();
        let report = check(&opened, &FoundBundles::default(), &Models::new(None), &JobCx::unwatched()).unwrap();
        (opened, report)
    }

    #[test]
    fn a_case_of_files_gives_the_same_results_elsewhere_bit_for_bit() {
        let [here, there] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        let (tool, data) = (&catalog::tools()[1], here.path().join("data"));
        for index in 0..2 {
            let sample = simulate(tool, random_grasp(index + 3), index, &SimConfig::default());
            write_pair(&data, Layout::Train, &tool.name, index, &sample).unwrap();
        }
        write_tools(&data, &[(tool.name.as_str(), true, tool.mesh())]).unwrap();
        let dataset = Dataset::open(&data).unwrap();
        let file = here.path().join("a.t2tcase");
        let made = make(&dataset, &setup(drawn()), &Models::new(None), &file, &JobCx::unwatched()).unwrap();
        assert_eq!((made.results.len(), made.built_in.as_deref()), (1, None));
        assert!(made.results[0].pose.is_some() && made.results[0].trace.len() > 3);
        assert!(made.files.keys().any(|name| name.ends_with(".stl")), "{:?}", made.files.keys());
        let moved = there.path().join("moved.t2tcase");
        std::fs::rename(&file, &moved).or_else(|_| std::fs::copy(&file, &moved).map(drop)).unwrap();
        drop(here);
        let (opened, report) = checked(&moved, there.path());
        assert!(report.same && report.compared == 6, "{report:?}");
        assert_eq!((opened.case.pair, opened.dataset.index.pairs.len()), (made.pair.clone(), 1));
        assert_eq!(opened.labels.review, Review::Flagged);
        assert_eq!(opened.labels.measured(lab::RIGHT).unwrap().mask, drawn().measured(lab::RIGHT).unwrap().mask);
    }

    #[test]
    fn what_differs_is_said_with_by_how_much() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("demo.t2tcase");
        let demo = Dataset::demo();
        let made = make(&demo, &setup(PairLabels::default()), &Models::new(None), &file, &JobCx::unwatched()).unwrap();
        assert_eq!(made.built_in.as_deref(), Some("demo"));
        let (opened, report) = checked(&file, folder.path());
        assert!(report.same && opened.dataset.title.contains("case") && opened.labels.is_empty());
        let mut other = made.results.clone();
        other[0].pose.as_mut().unwrap().y_m += 1e-6;
        other[0].fingers.get_mut("left").unwrap()[1] = String::new();
        let mut report = CaseReport::default();
        compare(&made.results, &other, &mut report);
        let text = report.differences.join("; ");
        assert!(
            report.differences.len() == 2 && text.contains("1.000e-3 mm") && text.contains("left finger"),
            "{text}"
        );
        // A finger that is only in one of them is a difference, whichever it is.
        for (then, now) in [(0, 1), (1, 0)] {
            let mut fewer = made.results.clone();
            fewer[0].fingers.remove("right").unwrap();
            let lists = [&made.results, &fewer];
            let mut report = CaseReport::default();
            compare(lists[then], lists[now], &mut report);
            assert!(report.differences.iter().any(|text| text.contains("right finger")), "{report:?}");
        }
        let mut report = CaseReport::default();
        let empty = CaseResult { fingers: BTreeMap::new(), ..made.results[0].clone() };
        compare(&[empty], &made.results, &mut report);
        assert_eq!(report.differences.len(), 2, "{report:?}");
        // What is no case, or was tampered with, is refused.
        let content = case_file::read(&file).unwrap();
        for (from, to, word) in [
            ("\"version\": 2", "\"version\": 9", "version"),
            ("\"built_in\": \"demo\"", "\"built_in\": \"odd\"", "no data set"),
            ("\"pair\": \"", "\"pair\": \"no ", "no pair"),
        ] {
            let text = String::from_utf8(content.manifest.clone()).unwrap();
            assert!(text.contains(from), "{text}");
            let manifest = text.replace(from, to).into_bytes();
            case_file::write(&file, &CaseContent { manifest, ..content.clone() }).unwrap();
            let err = open(&file, folder.path()).unwrap_err().to_string();
            assert!(err.contains(word), "{err}");
        }
        let mut changed = content.clone();
        changed.beside.values_mut().for_each(|bytes| bytes.push(0));
        assert!(!changed.beside.is_empty());
        case_file::write(&file, &changed).unwrap();
        assert!(open(&file, folder.path()).unwrap_err().why.contains("its files"));
        let mut extra = content.clone();
        extra.files.insert("x.stl".into(), vec![1]);
        case_file::write(&file, &extra).unwrap();
        assert!(open(&file, folder.path()).unwrap_err().why.contains("its files"));
    }
}
