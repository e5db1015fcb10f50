//! Corrected masks on disk: nothing is lost, nothing is overwritten blindly.

use std::io::Write as _;
use std::process::Command;

use glam::DVec2;
use serde_json::Value;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::Mask;
use touch2touch_core::label::{self, CleanKind, CleanUp, Marks, Provenance};
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::error::FileErrorKind;
use touch2touch_pipeline::io::masks::{ByImprint, FOLDER, MaskStore, StoredMask, StoredReview};
use touch2touch_pipeline::io::predicted_id::PredictedId;

use super::touch_file;

const PAIR: &str = "pattern_31_rod/data_0";

fn stored(mask: Mask) -> StoredMask {
    StoredMask {
        marks: Marks::all(mask.size(), Provenance::told("Threshold 5.00 mm")),
        mask,
        person: "anna".into(),
        saved_unix_s: 1,
    }
}

fn entry(number: u32) -> Value {
    let points = stroke(number).map(|p| [p.x, p.y]);
    serde_json::json!({"unix_s": number, "person": "anna", "name": "brush stroke", "points": points})
}

/// The lines of a journal that can be understood.
fn lines(store: &MaskStore) -> Vec<Value> {
    store.journal(PAIR).unwrap().split(|b| *b == b'\n').filter_map(|line| serde_json::from_slice(line).ok()).collect()
}

/// Stroke `number`: the same in the writing and in the checking process.
fn stroke(number: u32) -> [DVec2; 2] {
    let at = |k: u32, size: u32| f64::from(number.wrapping_mul(k) % size);
    [DVec2::new(at(37, 175), at(61, 140)), DVec2::new(at(53, 175), at(29, 140))]
}

fn paint(mask: &mut Mask, number: u32) {
    label::paint(mask, stroke(number), 3.0, number % 5 != 4);
}

#[test]
fn what_is_saved_is_loaded_and_undo_changes_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let store = MaskStore::in_folder(dir.path().join("deep/masks"));
    assert_eq!(store.load(PAIR, lab::RIGHT).unwrap(), None);
    let before = Mask::filled(175, 140, false);
    let mut after = before.clone();
    paint(&mut after, 0);
    store.save(PAIR, lab::RIGHT, Some(&stored(after.clone()))).unwrap();
    assert_eq!(store.load(PAIR, lab::RIGHT).unwrap(), Some(stored(after.clone())));
    assert_eq!(store.load(PAIR, lab::LEFT).unwrap(), None);
    store.save(PAIR, lab::RIGHT, Some(&stored(before.clone()))).unwrap();
    assert_eq!(store.load(PAIR, lab::RIGHT).unwrap(), Some(stored(before)));
    // Names that look alike do not share a file.
    for name in ["a/b", "a_b", "A/b", "../x", "ä"] {
        store.save(name, lab::LEFT, Some(&stored(Mask::filled(name.len(), 1, true)))).unwrap();
    }
    for name in ["a/b", "a_b", "A/b", "../x", "ä"] {
        assert_eq!(store.load(name, lab::LEFT).unwrap().unwrap().mask.width(), name.len());
    }
    let mut names: Vec<String> = store.masks().into_iter().map(|(name, _)| name).collect();
    names.sort();
    assert_eq!(names, ["../x", "A/b", "a/b", "a_b", PAIR, "ä"]);
    store.save(PAIR, lab::RIGHT, None).unwrap();
    store.save(PAIR, lab::RIGHT, None).unwrap();
    assert_eq!(store.load(PAIR, lab::RIGHT).unwrap(), None);
}

#[test]
fn a_damaged_file_blocks_its_pair_and_is_kept() {
    let dir = tempfile::tempdir().unwrap();
    let store = MaskStore::in_folder(dir.path().to_owned());
    let mask = stored(Mask::filled(175, 140, true));
    store.save(PAIR, lab::RIGHT, Some(&mask)).unwrap();
    let file = store.mask_file(PAIR, lab::RIGHT);
    let good = std::fs::read_to_string(&file).unwrap();
    for bad in [
        String::new(),
        good[..good.len() / 2].to_owned(),
        good.replace("\"version\":2", "\"version\":3"),
        good.replace("24500]", "24499]"),
        good.replace("\"contact_px\":24500", "\"contact_px\":24000"),
        good.replace("data_0", "data_1"),
        good.replace("\"width\":175", "\"width\":18446744073709551615"),
        "[]".into(),
    ] {
        assert_ne!(bad, good);
        std::fs::write(&file, &bad).unwrap();
        for result in [
            store.load(PAIR, lab::RIGHT).map(drop),
            store.save(PAIR, lab::RIGHT, Some(&mask)),
            store.save(PAIR, lab::RIGHT, None),
        ] {
            let err = result.unwrap_err();
            assert!(err.hint.contains("backup"), "{err}");
        }
        assert_eq!(std::fs::read_to_string(&file).unwrap(), bad, "it is left as it is");
        store.save(PAIR, lab::LEFT, Some(&mask)).unwrap();
    }
}

#[test]
fn reviews_are_read_in_each_version_and_written_in_the_last() {
    let dir = tempfile::tempdir().unwrap();
    let store = MaskStore::in_folder(dir.path().to_owned());
    let planar = PlanarPose { theta_rad: 0.1, y_m: 0.002, z_m: -0.1 / 3.0 };
    let text = |name: &str| std::fs::read_to_string(dir.path().join(format!("{name}.review.json"))).unwrap();
    // As the program wrote it before poses could be set by hand.
    let old = r#"{"format":"touch2touch-review","version":1,"pair":"old","review":"done",
        "accepted":[{"theta_rad":0.1,"y_m":0.002,"z_m":-0.03333333333333333},null]}"#;
    std::fs::write(dir.path().join("old.review.json"), old).unwrap();
    let read = store.load_review("old").unwrap().unwrap();
    assert_eq!(read.accepted, ByImprint { accepted: [Some(planar.into()), None], ..ByImprint::default() });
    store.save_review("plain", &read).unwrap();
    assert!(text("plain").contains("\"version\":4") && !text("plain").contains("by_hand"));

    let by_hand = Some(AcceptedPose { pose: planar, by_hand: true });
    let accepted = ByImprint { accepted: [None, by_hand], ..ByImprint::default() };
    let review = StoredReview { review: "todo".into(), accepted, ..StoredReview::default() };
    store.save_review("hand", &review).unwrap();
    assert_eq!(store.load_review("hand").unwrap(), Some(review.clone()));
    // Of a pose that left the plane its part in the plane is read.
    let tilted = text("hand").replace("\"by_hand\":", "\"pitch_rad\":0.05,\"x_m\":0.001,\"by_hand\":");
    std::fs::write(dir.path().join("hand.review.json"), &tilted).unwrap();
    assert!(tilted.contains("pitch_rad"));
    assert_eq!(store.load_review("hand").unwrap(), Some(review));
    let noted = StoredReview { review: "todo".into(), note: "shallow".into(), ..StoredReview::default() };
    store.save_review("noted", &noted).unwrap();
    assert_eq!(store.load_review("noted").unwrap(), Some(noted));
    let of = PredictedId::new("b0", &GenerateConfig::default(), ShiftMode::Raw);
    let accepted = ByImprint { accepted_predicted: [(of, planar.into())].into(), ..ByImprint::default() };
    let predicted = StoredReview { review: "todo".into(), accepted, ..StoredReview::default() };
    store.save_review("predicted", &predicted).unwrap();
    assert_eq!(store.load_review("predicted").unwrap(), Some(predicted));
    for bad in [text("hand").replace("\"version\":4", "\"version\":9"), text("hand").replace("0.002", "1e999")] {
        std::fs::write(dir.path().join("hand.review.json"), &bad).unwrap();
        assert!(store.load_review("hand").is_err(), "{bad}");
    }
}

#[test]
fn reviews_and_the_journal() {
    let dir = tempfile::tempdir().unwrap();
    let store = MaskStore::in_folder(dir.path().to_owned());
    let pose = PlanarPose { theta_rad: 0.1, y_m: 0.002, z_m: -0.1 / 3.0 };
    let accepted = ByImprint { accepted: [Some(pose.into()), None], ..ByImprint::default() };
    let review = StoredReview { review: "done".into(), accepted, ..StoredReview::default() };
    store.save_review("b", &review).unwrap();
    store.save_review("a", &StoredReview { review: "flagged".into(), ..StoredReview::default() }).unwrap();
    assert_eq!(store.load_review("b").unwrap(), Some(review));
    assert_eq!(store.load_review("c").unwrap(), None);
    std::fs::write(dir.path().join("c.review.json"), b"{").unwrap();
    let (reviews, problems) = store.reviews();
    assert_eq!(
        reviews.iter().map(|(n, r)| (n.as_str(), r.review.as_str())).collect::<Vec<_>>(),
        [("a", "flagged"), ("b", "done")]
    );
    assert!(problems.len() == 1 && problems[0].file.ends_with("c.review.json"));
    assert!(store.save_review("c", &StoredReview::default()).is_err());

    assert!(lines(&store).is_empty());
    for i in 0..3 {
        store.append_journal(PAIR, &entry(i)).unwrap();
    }
    store.append_journal("other", &entry(9)).unwrap();
    let file = std::fs::read_dir(dir.path())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .find(|path| path.to_string_lossy().contains("pattern_31_rod") && path.to_string_lossy().contains("journal"))
        .unwrap();
    let mut out = std::fs::OpenOptions::new().append(true).open(&file).unwrap();
    out.write_all(b"{\"unix_s\":3,\"pers").unwrap();
    assert_eq!(lines(&store), [entry(0), entry(1), entry(2)]);
    // What comes after a line that was cut short stands by itself.
    drop(out);
    store.append_journal(PAIR, &entry(3)).unwrap();
    assert_eq!(lines(&store), [entry(0), entry(1), entry(2), entry(3)]);
}

#[test]
fn masks_lie_beside_the_dataset_or_in_the_users_folder() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path().join("set");
    touch_file(&root.join("train/bubbles/rod/data_0.pt"));
    touch_file(&root.join("train/gelslims/rod/data_0.pt"));
    let dataset = Dataset::open(&root.join("train/bubbles")).unwrap();
    let store = MaskStore::for_dataset(&dataset).unwrap();
    assert_eq!(store.folder(), root.canonicalize().unwrap().join(FOLDER));
    assert!(!store.folder().exists(), "opening creates nothing");
    store.save(PAIR, lab::LEFT, Some(&stored(Mask::filled(2, 2, true)))).unwrap();
    assert_eq!(Dataset::open(&root).unwrap().index.pairs.len(), 1, "the masks are no data");
    // A root that cannot be written: here, because it is not there.
    let user = dir.path().join("home/masks/x");
    let missing = dir.path().join("gone");
    let store = MaskStore::choose(Some(&missing), Some(user.clone())).unwrap();
    assert_eq!(store.folder(), user);
    store.save(PAIR, lab::LEFT, Some(&stored(Mask::filled(2, 2, true)))).unwrap();
    // Back again, beside the data: the earlier work is still there.
    std::fs::create_dir(&missing).unwrap();
    let store = MaskStore::choose(Some(&missing), Some(user)).unwrap();
    assert_eq!(store.folder(), missing.join(FOLDER));
    assert!(store.load(PAIR, lab::LEFT).unwrap().is_some());
    assert!(MaskStore::choose(Some(&dir.path().join("no")), None).unwrap_err().what.contains("no folder"));
}

#[test]
fn masks_of_predictions_lie_beside_each_other_and_never_for_each_other() {
    let dir = tempfile::tempdir().unwrap();
    let store = MaskStore::in_folder(dir.path().join("masks"));
    let mask = |n: usize| stored(Mask::from_fn(175, 140, |x, y| x * y % (n + 7) == 0));
    let id = |text: &str| PredictedId::from(text.to_owned());
    store.save_predicted(PAIR, lab::RIGHT, &id("never"), None).unwrap();
    assert!(!dir.path().join("masks").exists(), "nothing is made for nothing");
    store.save_predicted(PAIR, lab::RIGHT, &id("seed 1"), Some(&mask(1))).unwrap();
    store.save_predicted(PAIR, lab::RIGHT, &id("seed 2"), Some(&mask(2))).unwrap();
    store.save(PAIR, lab::RIGHT, Some(&mask(3))).unwrap();
    store.save_predicted(PAIR, lab::RIGHT, &id("seed 1"), Some(&mask(4))).unwrap();
    let mut found = store.load_predicted(PAIR, lab::RIGHT).unwrap();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    assert_eq!(found, [(id("seed 1"), mask(4)), (id("seed 2"), mask(2))]);
    assert_eq!(store.load(PAIR, lab::RIGHT).unwrap(), Some(mask(3)));
    assert_eq!(store.masks(), [(PAIR.to_owned(), lab::RIGHT)], "what is exported is measured");
    assert!(store.load_predicted(PAIR, lab::LEFT).unwrap().is_empty());
    store.save_predicted(PAIR, lab::RIGHT, &id("seed 2"), None).unwrap();
    assert_eq!(store.load_predicted(PAIR, lab::RIGHT).unwrap().len(), 1);
    // What cannot be read is never replaced.
    let file = std::fs::read_dir(store.folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .find(|path| path.to_string_lossy().ends_with(".predicted.json"))
        .unwrap();
    for damage in ["{", "{}", r#"{"format": "touch2touch-predicted-masks", "version": 9}"#] {
        std::fs::write(&file, damage).unwrap();
        assert!(store.load_predicted(PAIR, lab::RIGHT).is_err());
        assert!(store.save_predicted(PAIR, lab::RIGHT, &id("seed 3"), Some(&mask(5))).is_err());
        assert_eq!(std::fs::read_to_string(&file).unwrap(), damage);
    }
}

#[cfg(unix)]
#[test]
fn the_journal_and_the_lock_are_ordinary_files_in_their_own_place() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join(FOLDER);
    std::fs::create_dir(&folder).unwrap();
    let store = MaskStore::in_folder(folder.clone());
    let foreign = dir.path().join("foreign");
    std::fs::write(&foreign, "mine").unwrap();
    let pipe = |at: &std::path::Path| assert!(Command::new("mkfifo").arg(at).status().unwrap().success());
    for place in [store.journal_file(PAIR), folder.join(".lock")] {
        for by_pipe in [false, true] {
            match by_pipe {
                false => std::os::unix::fs::symlink(&foreign, &place).unwrap(),
                true => pipe(&place),
            }
            let refused = match place.ends_with(".lock") {
                true => store.hold().map(drop),
                false => store.append_journal(PAIR, &entry(1)),
            };
            let text = refused.unwrap_err().to_string();
            assert!(text.contains("not an ordinary file") && text.contains(place.to_str().unwrap()), "{text}");
            std::fs::remove_file(&place).unwrap();
        }
    }
    assert_eq!(std::fs::read(&foreign).unwrap(), b"mine", "nothing is written through a link");
    store.append_journal(PAIR, &entry(1)).unwrap();
    assert!(store.hold().unwrap().is_some());
}

#[test]
fn nothing_is_written_where_the_data_set_is_not_any_more() {
    let dir = tempfile::tempdir().unwrap();
    let (root, elsewhere) = (dir.path().join("set"), dir.path().join("renamed"));
    let tool = touch2touch_core::catalog::tools().first().unwrap();
    let sample = touch2touch_core::sim::simulate(tool, Default::default(), 1, &Default::default());
    touch2touch_pipeline::io::simulated::write_pair(
        &root,
        touch2touch_pipeline::io::simulated::Layout::Train,
        &tool.name,
        0,
        &sample,
    )
    .unwrap();
    let dataset = Dataset::open(&root).unwrap();
    let root = dataset.root.clone().unwrap();
    let store = MaskStore::for_dataset(&dataset).unwrap();
    let mask = stored(Mask::filled(175, 140, true));
    store.save(PAIR, lab::RIGHT, Some(&mask)).unwrap();
    std::fs::rename(&root, &elsewhere).unwrap();
    // Of what was opened before, and of what is made from it now.
    for store in [store.clone(), MaskStore::for_dataset(&dataset).unwrap()] {
        let refused = [
            store.save(PAIR, lab::RIGHT, Some(&mask)),
            store.save(PAIR, lab::RIGHT, None),
            store.save_review(PAIR, &StoredReview::default()),
            store.append_journal(PAIR, &entry(1)),
            store.hold().map(drop),
        ];
        assert!(refused.iter().all(|r| r.as_ref().is_err_and(|err| err.kind == FileErrorKind::Lost)), "{refused:?}");
        assert!(!root.exists(), "no folder is made at the old path");
    }
    std::fs::create_dir(&root).unwrap();
    let text = store.save(PAIR, lab::RIGHT, Some(&mask)).unwrap_err().to_string();
    assert!(text.contains("another folder"), "{text}");
    assert_eq!(std::fs::read_dir(&root).unwrap().count(), 0);
    std::fs::remove_dir(&root).unwrap();
    std::fs::rename(&elsewhere, &root).unwrap();
    store.save(PAIR, lab::RIGHT, Some(&mask)).unwrap();
}

#[test]
fn a_mask_with_a_clean_up_that_is_not_known_is_read_with_its_words() {
    let folder = tempfile::tempdir().unwrap();
    let store = MaskStore::in_folder(folder.path().join("masks"));
    let mut mask = Mask::filled(20, 10, true);
    let mut marks = Marks::all(mask.size(), Provenance::Truth);
    let what = CleanUp { kind: CleanKind::Smooth, size_mm: 1.5 };
    let smaller = Mask::from_fn(20, 10, |x, _| x < 10);
    assert!(marks.replace(&mut mask, &smaller, Provenance::CleanUp { what }, false));
    let stored = StoredMask { mask: mask.clone(), marks, person: "Anna".into(), saved_unix_s: 1 };
    store.save("a", lab::LEFT, Some(&stored)).unwrap();
    let file = store.mask_file("a", lab::LEFT);
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("smooth"), "{text}");
    std::fs::write(&file, text.replace("smooth", "clear_border")).unwrap();
    let read = store.load("a", lab::LEFT).unwrap().unwrap();
    assert_eq!(read.mask, mask);
    assert_eq!(read.marks.at(15, 5), Some(&Provenance::told("clean up clear border 1.5")));
    assert_eq!(read.marks.at(5, 5), Some(&Provenance::Truth));
    // It can be written again.
    store.save("a", lab::LEFT, Some(&read)).unwrap();
    assert_eq!(store.load("a", lab::LEFT).unwrap(), Some(read));
}
