//! The readers: where each expects its file, and how it is called.

use std::path::{Path, PathBuf};

use sha2::Digest as _;
use touch2touch::app::services::Services;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::grid::{Grid, Mask};
use touch2touch_core::label::{self, Marks};
use touch2touch_core::moments::Moments;
use touch2touch_core::postprocess::{RawPrediction, ShiftFit};
use touch2touch_core::rig::lab;
use touch2touch_pipeline::infer::bundle::{Bundle, MANIFEST};
use touch2touch_pipeline::infer::engine::EngineKind;
use touch2touch_pipeline::infer::kept_key::KeptKey;
use touch2touch_pipeline::infer::store::Store;
use touch2touch_pipeline::io::dataset::{Dataset, UNIT_FILE, read_in_meters};
use touch2touch_pipeline::io::masks::{MaskStore, StoredMask, StoredReview};
use touch2touch_pipeline::io::statistics::{Provenance, ShiftStatistics};
use touch2touch_pipeline::io::{images, npz, pt, stl};

use crate::support::tetrahedron;

use super::seeds::{self, Content, Seed, bad, good, text, written};

/// A reader.
pub(super) struct Target {
    pub(super) name: &'static str,
    /// Memory that it may take for a file of any size, MiB.
    pub(super) base_mib: u64,
    pub(super) seeds: Vec<Seed>,
    /// Writes the file to its place, with whatever must lie beside it.
    pub(super) place: fn(&Path, &[u8]) -> PathBuf,
    /// Reads it; an error is what the user would be told.
    pub(super) read: fn(&Path, &Path) -> Result<(), String>,
}

type Outcome = Result<(), String>;

fn said(error: impl std::fmt::Display) -> String {
    error.to_string()
}

fn put(file: PathBuf, bytes: &[u8]) -> PathBuf {
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(&file, bytes).unwrap();
    file
}

/// Enough for the values of a tensor that repeats one value; see `io/pt.rs`.
const PT_MIB: u64 = 320;
/// 2^24 values of 8 bytes, and the bytes they are made of; see `io/npz.rs`.
const NPZ_MIB: u64 = 320;
/// 4096 x 4096 pixels of 8 bytes as decoded, and of 12 as they are used; see `io/images.rs`.
const PICTURE_MIB: u64 = 600;
/// Files that are read as they are.
const PLAIN_MIB: u64 = 16;

/// All of them.
pub(super) fn all() -> Vec<Target> {
    let target = |name, base_mib, seeds, place, read| Target { name, base_mib, seeds, place, read };
    vec![
        target("pt", PT_MIB, seeds::pt(), |dir, bytes| put(dir.join("a.pt"), bytes), read_pt),
        target(
            "bubble",
            PT_MIB,
            seeds::bubble(),
            |dir, bytes| put(dir.join("train/bubbles/data/t/data_0.pt"), bytes),
            read_pair,
        ),
        target(
            "gelslim",
            PT_MIB,
            seeds::gelslim(),
            |dir, bytes| put(dir.join("train/gelslims/data/t/data_0.pt"), bytes),
            read_pair,
        ),
        target(
            "gelslim depth",
            PT_MIB,
            seeds::gelslim_depth(),
            |dir, bytes| put(dir.join("rod.pt"), bytes),
            |dir, file| {
                let dataset = Dataset::open(dir).map_err(|err| format!("{err}: {}", file.display()))?;
                if dataset.index.pairs.is_empty() {
                    return Err(dataset
                        .problems
                        .first()
                        .map_or_else(|| file.display().to_string(), |p| p.what.clone()));
                }
                dataset.load(PairId(0)).map(drop).map_err(said)
            },
        ),
        target(
            "depth array",
            NPZ_MIB,
            seeds::depth_arrays(),
            |dir, bytes| beside(dir, "a_bubble.npy", bytes),
            read_pair,
        ),
        target(
            "depth tiff",
            PICTURE_MIB,
            seeds::depth_tiffs(),
            |dir, bytes| beside(dir, "a_bubble.tif", bytes),
            read_pair,
        ),
        target(
            "npz",
            NPZ_MIB,
            seeds::npz(),
            |dir, bytes| put(dir.join("a.npz"), bytes),
            |_, file| npz::read(file).map(drop).map_err(said),
        ),
        target(
            "stl",
            PLAIN_MIB,
            stl_seeds(),
            |dir, bytes| put(dir.join("a.stl"), bytes),
            |_, file| stl::read(file).map(drop).map_err(said),
        ),
        target("unit", PLAIN_MIB, unit_seeds(), place_unit, read_unit),
        target("picture", PICTURE_MIB, seeds::pictures(), |dir, bytes| put(dir.join("a.png"), bytes), read_picture),
        target(
            "picture pair",
            PICTURE_MIB,
            seeds::pictures(),
            |dir, bytes| put(dir.join("a_gelslim.png"), bytes),
            read_pair,
        ),
        target("manifest", PLAIN_MIB, manifest_seeds(), place_manifest, read_bundle),
        target("onnx", PLAIN_MIB, onnx_seeds(), place_onnx, read_bundle),
        target("mask", PLAIN_MIB, mask_seeds(), |dir, bytes| put(mask_file(dir), bytes), read_mask),
        target("review", PLAIN_MIB, review_seeds(), |dir, bytes| put(dir.join("a.review.json"), bytes), read_review),
        target(
            "prediction",
            PLAIN_MIB,
            prediction_seeds(),
            |dir, bytes| put(prediction_file(dir), bytes),
            read_prediction,
        ),
        target(
            "settings",
            PLAIN_MIB,
            settings_seeds(),
            |dir, bytes| put(dir.join("settings.json"), bytes),
            read_settings,
        ),
        target(
            "statistics",
            PLAIN_MIB,
            statistics_seeds(),
            |dir, bytes| put(dir.join("s.json"), bytes),
            |_, file| ShiftStatistics::read(file).map(drop).map_err(said),
        ),
    ]
}

/// Puts a depth beside a picture of the same touch.
fn beside(dir: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let picture = Grid::from_fn(32, 32, |x, y| [120.0, (x * 7 % 250) as f32, (y * 5 % 250) as f32]);
    images::write_rgb8(&dir.join("a_gelslim.png"), &picture).unwrap();
    put(dir.join(name), bytes)
}

fn read_pt(_: &Path, file: &Path) -> Outcome {
    let dict = pt::read_dict(file).map_err(said)?;
    for key in dict.keys().iter().take(20) {
        dict.tensor(key).map_err(said)?;
    }
    // Nobody asks for this name; the file's other keys are named then.
    let text = dict.scalar("theta").map_or_else(said, |_| file.display().to_string());
    assert!(text.contains("a.pt"), "{text}");
    Ok(())
}

/// A pair of whatever dataset `dir` is.
fn read_pair(dir: &Path, file: &Path) -> Outcome {
    let dataset = Dataset::open(dir).map_err(|err| format!("{err}: {}", file.display()))?;
    let loaded = dataset.load_with_counts(PairId(0)).map_err(said)?;
    dataset.bubble_tile(PairId(0), loaded.sample.laid).map_err(said)?;
    dataset.gelslim_is_clipped(PairId(0)).map_err(said)?;
    Ok(())
}

fn stl_seeds() -> Vec<Seed> {
    let binary = written(|file| stl::write(file, &tetrahedron(0.04)).unwrap());
    let mut lying = binary.clone();
    lying[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1e-2 0 0\nvertex 0 1e-2 0\nendloop\nendfacet\n";
    vec![
        good("binary", Content::Raw(binary)),
        good("text", text(&format!("solid a\n{facet}{facet}endsolid a\n"))),
        bad("four billion triangles", Content::Raw(lying), "4294967295"),
        bad("empty", text(""), "shorter"),
    ]
}

fn unit_seeds() -> Vec<Seed> {
    let mut seeds: Vec<Seed> = ["m", "auto", "1", "m\n"].map(|unit| good("a unit", text(unit))).into();
    seeds.push(bad("another unit", text("0.001"), "not a tool"));
    seeds.push(bad("no unit", text("furlong"), "unknown unit"));
    seeds.push(bad("a long text", text(&"m".repeat(10_000)), "at most"));
    seeds
}

fn place_unit(dir: &Path, bytes: &[u8]) -> PathBuf {
    stl::write(&dir.join("a.stl"), &tetrahedron(0.04)).unwrap();
    put(dir.join(UNIT_FILE), bytes)
}

fn read_unit(dir: &Path, file: &Path) -> Outcome {
    // The refusal is about the model where the unit can be read but makes it impossible.
    read_in_meters(&dir.join("a.stl"), None).map(drop).map_err(|err| {
        let named = err.file == *file || err.file.ends_with("a.stl");
        assert!(named, "{err}");
        format!("{err} {}", file.display())
    })
}

fn read_picture(_: &Path, file: &Path) -> Outcome {
    drop(images::read_gray8(file));
    images::read_gray(file).map_err(said)?;
    images::read_rgb(file).map(drop).map_err(said)
}

const MASK_BUNDLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bundles/mask");
const GENERATOR_BUNDLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bundles/generator");
const GRAPH: &str = "mask_unet.onnx";

fn manifest_seeds() -> Vec<Seed> {
    let read = |bundle: &str| Content::Raw(std::fs::read(Path::new(bundle).join(MANIFEST)).unwrap());
    vec![
        good("of a mask model", read(MASK_BUNDLE)),
        bad("of a generator", read(GENERATOR_BUNDLE), "decoder.onnx"),
        bad("nothing", text("{}"), "format"),
        bad("deep", text(&"[".repeat(100_000)), MANIFEST),
    ]
}

fn place_manifest(dir: &Path, bytes: &[u8]) -> PathBuf {
    std::fs::copy(Path::new(MASK_BUNDLE).join(GRAPH), dir.join(GRAPH)).unwrap();
    put(dir.join(MANIFEST), bytes)
}

fn read_bundle(dir: &Path, file: &Path) -> Outcome {
    // Either file may be what disagrees with the other.
    Bundle::open(dir).map(drop).map_err(|err| {
        let text = err.to_string();
        // The manifest's own words for its files may be anything by now.
        assert!(text.contains(&dir.display().to_string()), "it names no place: {text}");
        format!("{text} ({})", file.display())
    })
}

fn onnx_seeds() -> Vec<Seed> {
    let graph = |bundle: &str, name: &str| Content::Raw(std::fs::read(Path::new(bundle).join(name)).unwrap());
    vec![
        good("a mask model", graph(MASK_BUNDLE, GRAPH)),
        bad("a denoiser", graph(GENERATOR_BUNDLE, "denoiser.onnx"), GRAPH),
        bad("empty", text(""), GRAPH),
    ]
}

/// With the right checksum in the manifest, so that the graph itself is read.
fn place_onnx(dir: &Path, bytes: &[u8]) -> PathBuf {
    let manifest = std::fs::read(Path::new(MASK_BUNDLE).join(MANIFEST)).unwrap();
    let mut manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    let sum: String = sha2::Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    manifest["files"]["mask_unet"]["sha256"] = sum.into();
    put(dir.join(MANIFEST), manifest.to_string().as_bytes());
    put(dir.join(GRAPH), bytes)
}

fn mask_file(dir: &Path) -> PathBuf {
    MaskStore::in_folder(dir.to_owned()).mask_file("a", lab::RIGHT)
}

fn mask_seeds() -> Vec<Seed> {
    let dir = tempfile::tempdir().unwrap();
    let mask = Mask::from_fn(30, 20, |x, y| (x + y) % 3 == 0);
    let stored = StoredMask {
        marks: Marks::all(mask.size(), label::Provenance::told("threshold")),
        mask,
        person: "p".into(),
        saved_unix_s: 1,
    };
    MaskStore::in_folder(dir.path().to_owned()).save("a", lab::RIGHT, Some(&stored)).unwrap();
    let whole = std::fs::read_to_string(mask_file(dir.path())).unwrap();
    let huge = whole.replace("\"width\":30", "\"width\":4000000000").replace("\"height\":20", "\"height\":4000000000");
    assert_ne!(huge, whole);
    vec![good("a mask", text(&whole)), bad("a huge mask", text(&huge), "packed mask"), bad("empty", text(""), "mask")]
}

fn read_mask(dir: &Path, _: &Path) -> Outcome {
    let store = MaskStore::in_folder(dir.to_owned());
    store.masks();
    store.load("a", lab::RIGHT).map(drop).map_err(said)
}

fn review_seeds() -> Vec<Seed> {
    let dir = tempfile::tempdir().unwrap();
    let review = StoredReview { review: "done".into(), ..Default::default() };
    MaskStore::in_folder(dir.path().to_owned()).save_review("a", &review).unwrap();
    let whole = std::fs::read_to_string(dir.path().join("a.review.json")).unwrap();
    vec![good("a review", text(&whole)), bad("empty", text(""), "review")]
}

fn read_review(dir: &Path, _: &Path) -> Outcome {
    let store = MaskStore::in_folder(dir.to_owned());
    store.reviews();
    store.load_review("a").map(drop).map_err(said)
}

fn recipe() -> KeptKey {
    KeptKey {
        input: "ab".repeat(32),
        bundle: "cd".repeat(32),
        engine: EngineKind::Rten,
        config: GenerateConfig::default(),
    }
}

/// Where a prediction of [`recipe`] is kept: a store says so by writing one.
fn prediction_file(dir: &Path) -> PathBuf {
    let raw = RawPrediction { channels: vec![Grid::from_fn(8, 4, |x, y| (x * y) as f32); 3] };
    Store::new(dir.to_owned(), 1 << 20).put(&recipe(), &raw, 1.0).unwrap();
    std::fs::read_dir(dir).unwrap().next().unwrap().unwrap().path()
}

fn prediction_seeds() -> Vec<Seed> {
    let dir = tempfile::tempdir().unwrap();
    let whole = std::fs::read(prediction_file(dir.path())).unwrap();
    let end = whole.iter().position(|&byte| byte == b'\n').unwrap();
    let huge = String::from_utf8_lossy(&whole[..=end]).replace("\"width\":8", "\"width\":9000000000000000000");
    // A damaged prediction is no error: it is made again.
    vec![good("a prediction", Content::Raw(whole)), good("a huge one", text(&huge))]
}

fn read_prediction(dir: &Path, file: &Path) -> Outcome {
    let store = Store::new(dir.to_owned(), 1 << 20);
    store.of_input(&recipe().input, 10);
    if store.get(&recipe()).is_none() && file.exists() {
        // Whole, but of another recipe.
        assert!(file.metadata().unwrap().len() > 0);
    }
    Ok(())
}

fn settings_seeds() -> Vec<Seed> {
    let dir = tempfile::tempdir().unwrap();
    let services = Services::with_config_folder(Some(dir.path().to_owned()));
    services.save_settings(&Default::default()).unwrap();
    let whole = std::fs::read_to_string(dir.path().join("settings.json")).unwrap();
    vec![
        good("the defaults", text(&whole)),
        bad("empty", text(""), "settings.json"),
        bad("old", text("{\"version\": 0}"), "version"),
    ]
}

fn read_settings(dir: &Path, _: &Path) -> Outcome {
    match Services::with_config_folder(Some(dir.to_owned())).load_settings().1 {
        Some(problem) => Err(format!("{}: {}", problem.what, problem.why)),
        None => Ok(()),
    }
}

fn statistics_seeds() -> Vec<Seed> {
    let of = |values: [f64; 3]| values.into_iter().collect::<Moments>();
    let fit = ShiftFit { predicted: of([0.01, 0.02, 0.03]), measured: of([0.0, 0.01, 0.02]), touches: 1 };
    let text_of = || "x".to_owned();
    let provenance = Provenance {
        bundle: text_of(),
        bundle_hash: text_of(),
        dataset: text_of(),
        seed: 1,
        steps: 10,
        sampler: text_of(),
        eta: 0.0,
        engine: text_of(),
        scale: text_of(),
        made: text_of(),
    };
    let whole = written(|file| ShiftStatistics::new(provenance, &fit).unwrap().write(file).unwrap());
    vec![good("statistics", Content::Raw(whole)), bad("empty", text(""), "statistics")]
}
