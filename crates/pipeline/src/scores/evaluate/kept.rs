//! Figures that were computed before: found again by everything that decides them, and kept for the next time.
//!
//! A sheet ([`crate::infer::sheets`]) is of one method and one way to score; its lines are grasps, by the content of their
//! files, of their tool's and of the masks drawn on them, whatever they are called and wherever they lie.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::UNIX_EPOCH;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::load::Labeled;
use super::methods::{Method, Models};
use super::{Setup, ToolWork};
use crate::infer::engine::{EngineChoice, resolve};
use crate::infer::features::Preparation;
use crate::infer::sheets::Sheets;
use crate::io::dataset::{Dataset, SourceKind, UNIT_FILE};
use crate::io::digest::sha256;
use crate::io::files;
use crate::steps::recipe::{Recipe, RecipeId, Stage};
use touch2touch_core::catalog::pattern_of;
use touch2touch_core::dataset::{PairEntry, PairId, Problem};
use touch2touch_core::evaluation::{GraspScore, Group};
use touch2touch_core::read_as::list;
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::Scale;

/// To be raised when a figure is computed in another way.
const VERSION: u32 = 6;
/// The sheet of what files hold.
const FILES: &str = "files";
/// No larger file is a touch or a CAD model.
const MAX_FILE: u64 = 1 << 30;

/// The figures of a grasp by a method, with what else is said of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Entry {
    /// As in the table; what a table's row adds is put in when it is read.
    pub(super) score: GraspScore,
    /// Features by the classifier or the extractor, bit for bit, by image.
    features: Vec<String>,
    /// Least and largest value of each prediction.
    pub(super) spans: Vec<Option<[f32; 2]>>,
    /// The range that the lab's SSIM was computed with.
    pub(super) range: f64,
    /// True where the GelSlim picture is clipped; `None` where there is no picture.
    clipped: Option<bool>,
    /// Oddities of the files.
    pub(super) notes: Vec<Problem>,
    /// Why masks are not of the source that was asked, with how many.
    pub(super) otherwise: Vec<(String, usize)>,
    /// Digests of the color pictures, by which predictions of them are found.
    pub(super) inputs: Vec<String>,
}

impl Entry {
    pub(super) fn new(
        score: GraspScore,
        clipped: Option<bool>,
        notes: Vec<Problem>,
        otherwise: Vec<(String, usize)>,
        inputs: Vec<String>,
    ) -> Self {
        Self { features: Vec::new(), spans: Vec::new(), range: 0.0, clipped, notes, otherwise, inputs, score }
    }

    /// True where its SSIM is with this range, or has none of the tool.
    pub(super) fn is_of_range(&self, range: f64) -> bool {
        self.score.scale == Scale::Assumed || self.range.to_bits() == range.to_bits()
    }

    fn written(&self) -> Option<String> {
        let bits = |features: &Vec<f32>| {
            features.iter().fold(String::new(), |mut text, value| {
                // Writing to a string cannot fail.
                write!(text, "{:08x}", value.to_bits()).ok();
                text
            })
        };
        let features = self.score.images.iter().map(|image| bits(&image.features)).collect();
        serde_json::to_string(&Self { features, ..self.clone() }).ok()
    }

    fn read(text: &str, entry: &PairEntry, simulated: bool) -> Option<Self> {
        let mut read: Self = serde_json::from_str(text).ok()?;
        let score = &mut read.score;
        score.pair.clone_from(&entry.name);
        score.tool = entry.tool.as_deref().map(|name| pattern_of(name).to_owned());
        score.group = Group::of(entry, simulated, read.clipped);
        if score.images.len() != read.features.len() || score.images.len() != read.spans.len() {
            return None;
        }
        for (image, text) in score.images.iter_mut().zip(&read.features) {
            let digits = |at: usize| Some(f32::from_bits(u32::from_str_radix(text.get(8 * at..8 * at + 8)?, 16).ok()?));
            image.features = (0..text.len() / 8).map(digits).collect::<Option<_>>()?;
        }
        read.features.clear();
        Some(read)
    }
}

/// Known figures of the grasps of an evaluation.
pub(super) struct KeptScores {
    sheets: Arc<Sheets>,
    /// The sheet of each method.
    names: Vec<String>,
    /// The key of each grasp; one without cannot be kept.
    keys: BTreeMap<PairId, String>,
    /// Figures that were found, by method.
    known: Vec<BTreeMap<PairId, Entry>>,
}

impl KeptScores {
    /// Looks up what is known of some grasps; `only_known`: no file is read where nothing is known of any.
    pub(super) fn open(
        dataset: &Dataset,
        setup: &Setup,
        models: &Models,
        sheets: &Arc<Sheets>,
        work: &[ToolWork],
        only_known: bool,
    ) -> Self {
        let names: Vec<String> = models.methods.iter().map(|method| sheet(dataset, setup, models, method)).collect();
        let work = if only_known && names.iter().all(|name| sheets.is_empty(name)) { &[] } else { work };
        let labels = Labeled::of(dataset, setup);
        let files = Files::new(sheets.clone());
        let mut keys = BTreeMap::new();
        for tool in work {
            let part = tool_part(dataset, tool.tool.as_deref(), &files);
            let key = |id: &PairId| Some((*id, key(dataset, *id, part.as_deref()?, &labels, &files)?));
            keys.extend(tool.ids.par_iter().filter_map(key).collect::<Vec<_>>());
        }
        files.keep();
        let simulated = dataset.kind == SourceKind::Demo;
        let known = names.iter().map(|name| {
            let found = sheets.get(name, keys.values().map(String::as_str));
            let entry = |(id, text): (&PairId, Option<String>)| {
                Some((*id, Entry::read(&text?, dataset.index.get(*id)?, simulated)?))
            };
            keys.keys().zip(found).collect::<Vec<_>>().into_par_iter().filter_map(entry).collect()
        });
        let known = known.collect();
        Self { sheets: sheets.clone(), names, keys, known }
    }

    /// True where a method's figures of a grasp are known.
    pub(super) fn has(&self, method: usize, id: PairId) -> bool {
        self.known[method].contains_key(&id)
    }

    /// True where every method's figures of a grasp are known.
    pub(super) fn is_whole(&self, id: PairId) -> bool {
        self.known.iter().all(|known| known.contains_key(&id))
    }

    /// Known figures of some grasps by a method, in their order.
    pub(super) fn of(&self, method: usize, ids: &[PairId]) -> Vec<(PairId, Entry)> {
        ids.iter().filter_map(|id| Some((*id, self.known[method].get(id)?.clone()))).collect()
    }

    /// Keeps a method's figures of some grasps.
    pub(super) fn put<'a>(&self, method: usize, entries: impl IntoIterator<Item = &'a (PairId, Entry)>) {
        let line = |(id, entry): &(PairId, Entry)| Some((self.keys.get(id)?.clone(), entry.written()?));
        self.sheets.put(&self.names[method], entries.into_iter().filter_map(line));
    }
}

/// The name of the sheet of a method (by its recipe) and a way to score.
fn sheet(dataset: &Dataset, setup: &Setup, models: &Models, method: &Method) -> String {
    #[derive(Serialize)]
    struct Way<'a> {
        version: u32,
        program: &'a str,
        stored: bool,
        recipe: RecipeId,
        classifier: Option<&'a str>,
        features: Option<(&'a str, Preparation)>,
        engine: &'a str,
        finger: Option<PadId>,
        kind: String,
        rig: String,
    }
    let recipe = method.posed(models.common());
    // Any choice of an engine is what it stands for.
    let engine = resolve(recipe.engine).map_or(recipe.engine, EngineChoice::from);
    let way = Way {
        version: VERSION,
        program: program(),
        stored: matches!(method, Method::Stored),
        // Drawn masks are in the key of the grasp.
        recipe: Recipe { engine, hand: true, ..recipe }.id(Stage::Pose),
        classifier: models.classifier_hash(),
        features: models.features_key(),
        engine: models.engine(),
        finger: setup.finger,
        kind: format!("{:?}", dataset.kind),
        rig: format!("{:?}", dataset.rig),
    };
    sha256(&serde_json::to_vec(&way).unwrap_or_default())[..24].to_owned()
}

/// This build of the program: figures that another one computed may differ.
fn program() -> &'static str {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let file = std::env::current_exe().and_then(std::fs::metadata);
        let stamp = file.ok().and_then(|found| Some((found.len(), found.modified().ok()?)));
        format!("{} {stamp:?}", env!("CARGO_PKG_VERSION"))
    })
}

/// Part of a key that the grasps of a tool have in common; `None` where its CAD model cannot be read.
fn tool_part(dataset: &Dataset, tool: Option<&str>, files: &Files) -> Option<String> {
    let Some(file) = tool.and_then(|name| dataset.tool_mesh_file(name)) else {
        let name = tool.map(pattern_of);
        return Some(format!("{name:?}"));
    };
    let unit = files::read_to_string(&file.with_file_name(UNIT_FILE), files::SMALL).ok();
    let said = tool.map_or(dataset.tool_scale, |tool| dataset.scale_of(tool));
    Some(format!("{} {unit:?} {said:?}", files.digest(file)?))
}

/// The key of a grasp: of all that its figures depend on and the sheet does not name.
fn key(dataset: &Dataset, id: PairId, tool: &str, labels: &Labeled, files: &Files) -> Option<String> {
    let entry = dataset.index.get(id)?;
    let found = dataset.scored_files(id);
    let mut text = format!("{tool} {}", list(dataset.read_as()));
    if found.is_empty() {
        // Built in: the program and the name say it all.
        write!(text, "\n{}\n{}", dataset.title, entry.name).ok()?;
    }
    for file in found {
        write!(text, "\n{}", files.digest(&file)?).ok()?;
    }
    let labels = labels.load(&entry.name).ok()?;
    for (place, hand) in labels.iter().flat_map(|labels| &labels.masks) {
        let mut pixels: Vec<u8> = hand.mask.as_slice().iter().map(|pixel| u8::from(*pixel)).collect();
        pixels.extend(hand.marks.ignored().iter().flat_map(|ignored| ignored.as_slice()).map(|pixel| u8::from(*pixel)));
        write!(text, "\n{place:?} {:?} {}", hand.mask.size(), sha256(&pixels)).ok()?;
    }
    Some(sha256(text.as_bytes())[..32].to_owned())
}

/// Digests of files: read again only where size or time of change say so.
struct Files {
    sheets: Arc<Sheets>,
    fresh: std::sync::Mutex<BTreeMap<String, String>>,
}

impl Files {
    fn new(sheets: Arc<Sheets>) -> Self {
        Self { sheets, fresh: std::sync::Mutex::default() }
    }

    fn fresh(&self) -> std::sync::MutexGuard<'_, BTreeMap<String, String>> {
        self.fresh.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn digest(&self, file: &Path) -> Option<String> {
        let found = std::fs::metadata(file).ok()?;
        let changed = found.modified().ok()?.duration_since(UNIX_EPOCH).ok()?;
        let stamp = sha256(format!("{}\n{}\n{}", file.display(), found.len(), changed.as_nanos()).as_bytes());
        if let Some(known) = self.sheets.get(FILES, [stamp.as_str()]).pop().flatten() {
            return Some(known);
        }
        let digest = sha256(&files::read(file, MAX_FILE).ok()?);
        self.fresh().insert(stamp, digest.clone());
        Some(digest)
    }

    /// Remembers what was read.
    fn keep(&self) {
        let fresh = std::mem::take(&mut *self.fresh());
        self.sheets.put(FILES, fresh);
    }
}
