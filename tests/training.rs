//! `masks train` as a user runs it: the shipped mask model on corrected masks of simulated grasps.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;

use serde_json::Value;
use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::label::{DrawTool, Drawing, Ground, Paint, Provenance};
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_pipeline::error::TaskErrorKind;
use touch2touch_pipeline::export::{DrawnMasks, LeftOut};
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::simulated::Layout;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{DrawnMask, ImprintOf, Labels, MaskPlace, Operation, Review};
use touch2touch_pipeline::learn::train::{TrainChoice, TrainSetup, Trained, plan, train};
use touch2touch_pipeline::learn::tuning::Tuning;
use touch2touch_pipeline::steps::bundles::{self, BundleKind, find};
use touch2touch_pipeline::steps::models::Models;

use crate::support::{cancelled_when, command, json, run, succeed, tiny, write_grasps};

/// Simulated grasps of two tools, all of whose masks were corrected to the truth by a person and marked done.
pub(crate) fn corrected(root: &Path, grasps: u64) {
    write_grasps(root, Layout::Train, &catalog::tools()[..2], grasps);
    let dataset = Dataset::open(root).unwrap();
    let labels = Labels::of(&dataset);
    for (at, entry) in dataset.index.pairs.iter().enumerate() {
        let sample = dataset.load(PairId(at as u32)).unwrap();
        let mut stored = labels.load(&entry.name).unwrap();
        for (pad, touch) in sample.pads.entries() {
            let truth = touch.depth().unwrap().truth.as_ref().unwrap().contact.clone();
            let hand = DrawnMask::new(truth, Provenance::Hand { person: "Anna".into() });
            stored.draw(&MaskPlace::measured(pad), Some(hand));
        }
        stored.review = Review::Done;
        labels.save(&entry.name, &stored, &Operation { person: Some("Anna".into()), ..Operation::default() }).unwrap();
    }
}

/// A folder and such a data set of it.
fn opened(grasps: u64) -> (tempfile::TempDir, Dataset) {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    corrected(&set, grasps);
    (dir, Dataset::open(&set).unwrap())
}

fn review(dataset: &Dataset, at: usize, review: Review) {
    let (labels, name) = (Labels::of(dataset), &dataset.index.pairs[at].name);
    let stored = labels.load(name).unwrap();
    labels.save(name, &touch2touch_pipeline::labels::PairLabels { review, ..stored }, &Operation::default()).unwrap();
}

fn setup(dataset: &Dataset, out: PathBuf, unfinished: Option<PathBuf>) -> TrainSetup {
    let found = find(&[]);
    TrainSetup {
        start: found.take(BundleKind::Mask, None, &dataset.rig).unwrap(),
        generators: found.bundles.into_iter().filter(|bundle| bundle.kind == BundleKind::Generator).collect(),
        engine: EngineChoice::Rten,
        registration: Default::default(),
        choice: TrainChoice { held_out_percent: 30, ..TrainChoice::default() },
        tuning: Tuning::Steps(3),
        unfinished,
        out,
    }
}

fn go(dataset: &Dataset, setup: &TrainSetup, cx: &JobCx) -> Result<Trained, touch2touch_pipeline::error::TaskError> {
    let masks = DrawnMasks { labels: &Labels::of(dataset), changed: &BTreeMap::new() };
    train(dataset, &masks, setup, &Models::new(None), cx)
}

/// The files of a bundle.
pub(crate) fn bytes(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap())
        .map(|entry| (entry.file_name().to_string_lossy().into_owned(), std::fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    files
}

#[test]
fn the_verb_trains_says_what_it_is_worth_and_writes_over_nothing() {
    let (dir, dataset) = opened(3);
    let set = dir.path().join("set");
    review(&dataset, 0, Review::InProgress);
    let out = dir.path().join("trained");
    let [set, out] = [&set, &out].map(|path| path.to_str().unwrap());
    let verb = |more: &[&str]| {
        let fixed = ["masks", "train", set, "--held-out", "30", "--runtime", "rten", "--json", "--no-cache"];
        run(&[&fixed[..], more].concat(), dir.path())
    };
    let planned = json(&verb(&["--dry-run"]));
    assert_eq!(
        (&planned["masks"], &planned["pairs"], &planned["held_out"]["masks"]),
        (&6.into(), &3.into(), &4.into())
    );
    assert_eq!(planned["left_out"]["not_done"], 1);
    let made = json(&verb(&["--steps", "3", "--out", out]));
    assert_eq!((&made["masks"], &made["pairs"], &made["steps"]), (&6.into(), &3.into(), &3.into()), "{made:#}");
    assert_eq!((&made["persons"], &made["bundle"]), (&serde_json::json!(["Anna"]), &out.into()));
    let held = made["held_out"].as_array().unwrap();
    assert!(held.len() == 4 && held.iter().all(|one| one["before"]["iou"].as_f64().unwrap() > 0.5), "{made:#}");
    assert!(held.is_sorted_by(|a, b| a["after"]["iou"].as_f64() <= b["after"]["iou"].as_f64()));
    assert!(made["before"]["dice"].as_f64().unwrap() > 0.7 && made["after"]["dice"].as_f64().unwrap() > 0.7);
    assert!(made["warnings"].to_string().contains("6 masks are few"), "{made:#}");

    // It is a bundle like any other, says from what it was made, and is no default.
    let bundle = bundles::open("Open", Path::new(out)).unwrap();
    assert!(bundle.trained && bundle.is_own() && bundle.kind == BundleKind::Mask);
    assert!(bundle.name.starts_with("Mask UNet, simulated data, trained on 6 masks of "), "{}", bundle.name);
    let manifest: Value =
        serde_json::from_slice(&std::fs::read(Path::new(out).join("manifest.json")).unwrap()).unwrap();
    let said = &manifest["provenance"]["trained"];
    assert_eq!((&said["persons"], &said["steps"]), (&serde_json::json!(["Anna"]), &3.into()));
    assert_eq!((said["pairs"].as_array().unwrap().len(), said["held_out"].as_array().unwrap().len()), (3, 2));
    assert_eq!(said["before"]["iou"], made["before"]["iou"]);
    let by_it = ["pose", set, "--limit", "1", "--mask", "unet", "--mask-bundle", out, "--runtime", "rten", "--json"];
    succeed(&by_it, dir.path());

    // Nothing is written over.
    let before = bytes(Path::new(out));
    let refused = verb(&["--steps", "3", "--out", out]);
    assert!(!refused.status.success() && String::from_utf8_lossy(&refused.stderr).contains("holds other files"));
    assert!(bytes(Path::new(out)) == before);
    // A training goes on from a trained model, and is named after the first one.
    let further = dir.path().join("further");
    let further = further.to_str().unwrap();
    let made = json(&verb(&["--steps", "1", "--start", out, "--out", further]));
    let name = made["name"].as_str().unwrap();
    assert!(name.matches("trained on").count() == 1 && name != bundle.name, "{name}");
}

#[test]
fn a_run_that_is_stopped_leaves_no_bundle_and_goes_on_to_the_same_last_bit() {
    let (dir, dataset) = opened(2);
    let (straight, stopped) = (dir.path().join("straight"), dir.path().join("stopped"));
    let whole = go(&dataset, &setup(&dataset, straight.clone(), None), &JobCx::unwatched()).unwrap();
    let kept = dir.path().join("unfinished");
    let resumable = setup(&dataset, stopped.clone(), Some(kept.clone()));
    let stopping = cancelled_when(|progress| progress.total == 3 && progress.done >= 2);
    let err = go(&dataset, &resumable, &stopping).unwrap_err();
    assert_eq!(err.kind, TaskErrorKind::Cancelled);
    assert!(!stopped.exists(), "a cancelled run leaves no bundle");
    let resumed = go(&dataset, &resumable, &JobCx::unwatched()).unwrap();
    assert_eq!((&resumed.curves, &resumed.held_out), (&whole.curves, &whole.held_out));
    assert!(bytes(&stopped) == bytes(&straight));
    assert_eq!(std::fs::read_dir(&kept).unwrap().count(), 0, "nothing is left of a finished run");
}

/// A training that is killed at any moment leaves no bundle, or a whole one; it neither keeps the next one from its place nor
/// costs a label.
#[test]
fn a_killed_training_leaves_no_bundle_that_cannot_be_opened() {
    const KILLS: u32 = 2;
    let (dir, dataset) = opened(1);
    let set = dir.path().join("set");
    let labels = || -> Vec<_> {
        let all = Labels::of(&dataset);
        dataset.index.pairs.iter().map(|entry| all.load(&entry.name).unwrap()).collect()
    };
    let before = labels();
    let models = dir.path().join("models");
    let train = |out: &Path| {
        let [set, out] = [&set, out].map(|path| path.to_str().unwrap());
        let args = ["masks", "train", set, "--held-out", "0", "--steps", "1", "--runtime", "rten", "--out", out];
        let mut command = command(&args, dir.path());
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    let start = std::time::Instant::now();
    assert!(train(&models.join("whole")).status().unwrap().success());
    let (whole, mut trained) = (start.elapsed(), 0);
    for kill in 1..=KILLS {
        let out = models.join(format!("killed {}", kill % 3));
        let mut child = train(&out).spawn().unwrap();
        // From before it reads anything to after it wrote; the end, where it writes, is met most often.
        std::thread::sleep(whole.mul_f64(f64::from(kill).sqrt() / f64::from(KILLS).sqrt() * 1.05));
        child.kill().unwrap();
        child.wait().unwrap();
        if out.exists() {
            let bundle = bundles::open("Open", &out).unwrap();
            assert!(bundle.trained);
            std::fs::remove_dir_all(&out).unwrap();
            trained += 1;
        }
        assert_eq!(labels(), before, "kill {kill}");
    }
    eprintln!("{KILLS} trainings killed, {trained} of them had written their bundle");
    // Whatever was left, the same training has its place, and nothing else lies there then.
    let out = models.join("killed 0");
    assert!(train(&out).status().unwrap().success());
    let of_run = bytes(&models.join("whole"));
    assert!(bytes(&out) == of_run, "a run that was cut off goes on to the same last bit");
    let mut names: Vec<_> = std::fs::read_dir(&models).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["killed 0", "whole"]);
}

#[test]
fn masks_on_predictions_are_learned_from_where_the_prediction_can_be_made_again() {
    let (dir, dataset) = opened(1);
    let (labels, name) = (Labels::of(&dataset), &dataset.index.pairs[0].name);
    let generator = find(&[]).take(BundleKind::Generator, None, &dataset.rig).unwrap();
    let config = GenerateConfig { steps: 1, ..generator.generator.as_ref().unwrap().defaults };
    let of = ImprintOf::predicted(&generator.id, &config, ShiftMode::ExactInverse);
    let mut stored = labels.load(name).unwrap();
    let (place, hand) = stored.masks.iter().next().map(|(place, hand)| (place.clone(), hand.clone())).unwrap();
    stored.draw(&MaskPlace { pad: place.pad, of }, Some(hand.clone()));
    let lost = ImprintOf::predicted("gone", &config, ShiftMode::Raw);
    stored.draw(&MaskPlace { pad: place.pad, of: lost }, Some(hand));
    labels.save(name, &stored, &Operation::default()).unwrap();

    let choice = TrainChoice { held_out_percent: 0, ..TrainChoice::default() };
    let masks = DrawnMasks { labels: &labels, changed: &BTreeMap::new() };
    let planned = plan(&dataset, &masks, choice).unwrap();
    assert_eq!((planned.masks(), planned.predicted, planned.held_out), (6, 2, [0, 0]));
    let out = dir.path().join("trained");
    let setup = TrainSetup { choice, tuning: Tuning::Steps(1), ..setup(&dataset, out, None) };
    let made = go(&dataset, &setup, &JobCx::unwatched()).unwrap();
    assert_eq!((made.masks, made.pairs, made.before, made.after), (5, 2, None, None));
    assert!(made.unusable.len() == 1 && made.unusable[0].why.contains("not among the bundles"), "{:?}", made.unusable);
    assert!(made.warnings.iter().any(|warning| warning.starts_with("nothing is left out")));
    // What was changed since and is not on the disk counts too.
    let changed = BTreeMap::from([(
        name.clone(),
        touch2touch_pipeline::labels::PairLabels { review: Review::Flagged, ..stored },
    )]);
    let planned = plan(&dataset, &DrawnMasks { labels: &labels, changed: &changed }, choice).unwrap();
    assert_eq!((planned.masks(), planned.left_out), (2, BTreeMap::from([(LeftOut::Flagged, 1)])));
}

#[test]
fn ignored_pixels_are_neither_learned_from_nor_scored() {
    let dir = tempfile::tempdir().unwrap();
    let made = |name: &str, flipped: bool| {
        let set = dir.path().join(name);
        corrected(&set, 1);
        let dataset = Dataset::open(&set).unwrap();
        let labels = Labels::of(&dataset);
        for (at, entry) in dataset.index.pairs.iter().enumerate() {
            let sample = dataset.load(PairId(at as u32)).unwrap();
            let mut stored = labels.load(&entry.name).unwrap();
            for (place, hand) in &mut stored.masks {
                let imprint = &sample.pad(place.pad).unwrap().depth().unwrap().imprint;
                let ground = Ground::new(imprint);
                let points = vec![[40.0, 20.0], [110.0, 90.0]];
                let ignore = Drawing { tool: DrawTool::Rectangle, points, paint: Paint::Ignore, sight: None };
                hand.draw(&ignore, ground, Provenance::Hand { person: "Anna".into() });
                if flipped {
                    let ignored = hand.marks.ignored().unwrap().clone();
                    let mask = Arc::make_mut(&mut hand.mask).as_mut_slice();
                    mask.iter_mut().zip(ignored.as_slice()).for_each(|(bit, ignored)| *bit ^= ignored);
                }
            }
            labels.save(&entry.name, &stored, &Operation::default()).unwrap();
        }
        let out = dir.path().join(format!("{name}-trained"));
        let choice = TrainChoice { held_out_percent: 50, ..TrainChoice::default() };
        let setup = TrainSetup { choice, tuning: Tuning::Steps(2), ..setup(&dataset, out.clone(), None) };
        let trained = go(&dataset, &setup, &JobCx::unwatched()).unwrap();
        (std::fs::read(out.join("mask_unet.onnx")).unwrap(), trained.before, trained.after)
    };
    let plain = made("plain", false);
    assert!(plain == made("flipped", true) && plain.1.is_some());
}

#[test]
fn what_cannot_be_trained_is_refused_and_says_what_to_do() {
    let (dir, dataset) = opened(1);
    let new = |change: &dyn Fn(&mut TrainSetup)| {
        let mut setup = setup(&dataset, dir.path().join("new"), None);
        change(&mut setup);
        let err = go(&dataset, &setup, &JobCx::unwatched()).unwrap_err();
        assert!(!dir.path().join("new").exists() && err.hint.is_some(), "{err}");
        err.to_string()
    };
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models/mask_unet");
    let own = bundles::open("Open", shipped.as_path()).unwrap();
    let onto_itself = new(&|setup| (setup.start, setup.out) = (own.clone(), shipped.clone()));
    assert!(onto_itself.contains("stays as it is"), "{onto_itself}");
    let file = dir.path().join("file");
    std::fs::write(&file, "x").unwrap();
    assert!(new(&|setup| setup.out = file.clone()).contains("is a file"));
    // A network that was never trained here.
    let tiny = tiny("mask");
    let other = new(&|setup| setup.start = bundles::open("Open", tiny.as_path()).unwrap());
    assert!(other.contains("architecture"), "{other}");
    review(&dataset, 0, Review::Skip);
    review(&dataset, 1, Review::InProgress);
    let nothing = new(&|_| {});
    let why =
        ["no mask to learn from: masks of 1 pair were corrected, and none", "1 pair begun", "1 pair marked \"skip\""];
    assert!(why.iter().all(|part| nothing.contains(part)), "{nothing}");
}
