//! Labels that could not be written beside their data: they are kept in another folder and taken in later.

#![allow(clippy::unwrap_used, reason = "helpers of tests, too")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use touch2touch::app::library::Place;
use touch2touch::app::services::Services;
use touch2touch::app::source::Source;
use touch2touch_core::grid::{Grid, Mask, RgbGrid};
use touch2touch_core::label::Provenance;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::error::TaskErrorKind;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::io::masks::{FOLDER, MaskStore};
use touch2touch_pipeline::labels::{
    DrawnMask, Labels, MaskPlace, Operation, PairLabels, Review, Unsaved, recover, take_in,
};

/// A folder of two pairs of pictures.
pub(crate) fn pictures(root: &Path) -> Dataset {
    std::fs::create_dir_all(root).unwrap();
    for name in ["a", "b"] {
        images::write_gray8(&root.join(format!("{name}_bubble.png")), &Grid::from_fn(32, 32, |x, y| (x * 4 + y) as u8))
            .unwrap();
        let rgb = RgbGrid::from_fn(32, 32, |x, y| [x as f32, y as f32, 9.0]);
        images::write_rgb8(&root.join(format!("{name}_gelslim.png")), &rgb).unwrap();
    }
    Dataset::open(root).unwrap()
}

/// Labels whose mask has a square of contact at `x`, painted by Anna on nothing.
fn square(base: &PairLabels, x: usize) -> PairLabels {
    let mut labels = base.clone();
    let place = MaskPlace::measured(lab::RIGHT);
    let mut hand = labels
        .masks
        .get(&place)
        .cloned()
        .unwrap_or_else(|| DrawnMask::new(Mask::filled(32, 32, false), Provenance::Nothing));
    let mut mask = (*hand.mask).clone();
    let touched = Mask::from_fn(32, 32, |a, b| (x..x + 4).contains(&a) && b < 4);
    let rect = touch2touch_core::label::Rect { x, y: 0, width: 4, height: 4 };
    let paint = touch2touch_core::label::Paint::Contact;
    Arc::make_mut(&mut hand.marks).paint(&mut mask, (&touched, rect), paint, None, Provenance::hand("Anna"));
    hand.mask = mask.into();
    labels.masks.insert(place, hand);
    labels.review = Review::InProgress;
    labels
}

fn at(labels: &PairLabels, x: usize) -> bool {
    labels.measured(lab::RIGHT).is_some_and(|hand| hand.mask[(x, 1)])
}

fn unsaved(name: &str, labels: &PairLabels) -> Unsaved {
    let deed = Operation { person: Some("Anna".into()), ..Operation::named("brush stroke") };
    Unsaved { name: name.into(), labels: labels.clone(), deed }
}

fn set(dir: &Path) -> (PathBuf, PathBuf, Dataset) {
    let (root, waiting) = (dir.join("set"), dir.join("waiting"));
    let dataset = pictures(&root);
    (root, waiting, dataset)
}

#[test]
fn what_waits_is_taken_in_at_the_next_opening_and_merged_with_what_others_did() {
    let dir = tempfile::tempdir().unwrap();
    let (_, waiting, dataset) = set(dir.path());
    let labels = Labels::of(&dataset);
    let base = square(&labels.load("a").unwrap(), 0);
    labels.save("a", &base, &Operation::named("first")).unwrap();
    // Two strokes that could not be saved, kept one after the other; meanwhile somebody else paints.
    let folder = labels.keep_waiting(&dataset, &[unsaved("a", &square(&base, 8))], &waiting).unwrap();
    let both = square(&square(&base, 8), 14);
    assert_eq!(labels.keep_waiting(&dataset, &[unsaved("a", &both)], &waiting).unwrap(), folder);
    let other = Labels::of(&dataset);
    let theirs = square(&other.load("a").unwrap(), 20);
    other.save("a", &theirs, &Operation::named("theirs")).unwrap();

    let fresh = Labels::of(&dataset);
    let found = recover(&dataset, &fresh, &waiting);
    assert_eq!((found.pairs.clone(), found.failed.len()), (vec!["a".to_owned()], 0), "{found:?}");
    assert!(found.text().unwrap().contains('a') && !folder.exists());
    let now = Labels::of(&dataset).load("a").unwrap();
    assert!([0, 8, 14, 20].into_iter().all(|x| at(&now, x)), "both people's strokes are there");
    // Undo takes it back, and the journal says whose it was.
    let told = Labels::of(&dataset).past("a", &now);
    assert_eq!((told.done.last().unwrap().name.as_ref(), told.problem), ("labels taken in", None));
    assert_eq!(Labels::of(&dataset).persons("a").unwrap().into_iter().collect::<Vec<_>>(), ["Anna"]);
    // Nothing is taken in twice.
    assert_eq!(recover(&dataset, &fresh, &waiting).pairs, Vec::<String>::new());
}

#[test]
fn the_studio_keeps_and_takes_in_through_its_services() {
    let dir = tempfile::tempdir().unwrap();
    let (root, ..) = set(dir.path());
    let services = Services::with_config_folder(Some(dir.path().join("config")));
    let place = Place::Path(root.clone());
    let open = || Source::open(&place, services.waiting.as_deref()).unwrap();
    let opened = open();
    let drawn = square(&opened.labels.load("a").unwrap(), 3);
    // Where the folder of labels should be made lies a file: that stops everybody, root as well.
    std::fs::write(root.join(FOLDER), "in the way").unwrap();
    opened.labels.save("a", &drawn, &Operation::named("stroke")).unwrap_err();
    opened.keep_labels(&[unsaved("a", &drawn)], None).unwrap();
    // It does not work yet: they go on waiting, and it is said.
    assert!(!open().recovered.failed.is_empty() || cfg!(not(unix)));
    std::fs::remove_file(root.join(FOLDER)).unwrap();
    let again = open();
    assert_eq!(again.recovered.pairs, ["a"]);
    assert!(at(&again.labels.load("a").unwrap(), 3));
    assert_eq!(again.reviews.states["a"], Review::InProgress);
}

#[test]
fn a_data_set_that_was_renamed_is_found_again_and_another_one_is_not_taken_for_it() {
    let dir = tempfile::tempdir().unwrap();
    let (root, waiting, dataset) = set(dir.path());
    let labels = Labels::of(&dataset);
    let drawn = square(&labels.load("a").unwrap(), 3);
    let renamed = dir.path().join("renamed");
    std::fs::rename(&root, &renamed).unwrap();
    let err = labels.save("a", &drawn, &Operation::named("stroke")).unwrap_err();
    assert_eq!(err.kind, TaskErrorKind::Lost, "{err}");
    assert!(!root.exists() && err.hint.unwrap().contains("elsewhere"));
    labels.keep_waiting(&dataset, &[unsaved("a", &drawn)], &waiting).unwrap();

    let other = pictures(&dir.path().join("other"));
    assert_eq!(recover(&other, &Labels::of(&other), &waiting).pairs, Vec::<String>::new());
    let dataset = Dataset::open(&renamed).unwrap();
    assert_eq!(recover(&dataset, &Labels::of(&dataset), &waiting).pairs, ["a"]);
    assert!(at(&Labels::of(&dataset).load("a").unwrap(), 3));
}

#[test]
fn labels_saved_to_a_folder_are_ordinary_ones_and_can_be_taken_in() {
    let dir = tempfile::tempdir().unwrap();
    let (_, _, dataset) = set(dir.path());
    let labels = Labels::of(&dataset);
    let drawn = square(&labels.load("a").unwrap(), 3);
    let folder = dir.path().join("usb").join(FOLDER);
    let gone = Unsaved { name: "c".into(), ..unsaved("c", &drawn) };
    labels.keep_in(&dataset, &[unsaved("a", &drawn), gone], &folder).unwrap();
    let there = MaskStore::in_folder(folder.clone());
    assert!(there.load("a", lab::RIGHT).unwrap().unwrap().mask[(3, 1)]);
    assert_eq!(there.load_review("a").unwrap().unwrap().review, Review::InProgress.stored());
    let found = take_in(&dataset, &labels, &folder).unwrap();
    assert_eq!(found.pairs, ["a"]);
    assert!(found.failed[0].why.contains("c is not a pair"), "{found:?}");
    assert!(at(&Labels::of(&dataset).load("a").unwrap(), 3));
    let why = take_in(&dataset, &labels, dir.path()).unwrap_err();
    assert!(why.why.contains("recovered.json"), "{why}");
}

#[test]
fn what_of_a_journal_cannot_be_read_or_written_is_said_with_what_was_saved() {
    let dir = tempfile::tempdir().unwrap();
    let (_, _, dataset) = set(dir.path());
    let labels = Labels::of(&dataset);
    let first = square(&labels.load("a").unwrap(), 3);
    labels.save("a", &first, &Operation::named("stroke")).unwrap();
    let store = MaskStore::for_dataset(&dataset).unwrap();
    let file = store.journal_file("a");
    let whole = std::fs::read(&file).unwrap();
    let problem = |labels: &Labels| labels.past("a", &first).problem.map(|err| err.to_string());
    assert_eq!(problem(&labels), None);
    std::fs::write(&file, [&whole[..], br#"{"unix_s":1,"per"#].concat()).unwrap();
    assert!(problem(&labels).unwrap().contains("1 of 2 lines cannot be understood"));
    assert_eq!(labels.past("a", &first).done.len(), 1, "what can be understood still is");
    std::fs::write(&file, "{\"of\": \"another program\"}\n").unwrap();
    assert!(problem(&labels).unwrap().contains("1 of 1 line cannot"));
    std::fs::File::create(&file).unwrap().set_len(65 << 20).unwrap();
    let text = problem(&labels).unwrap();
    assert!(text.contains("at most") && text.contains("bytes"), "{text}");
    std::fs::remove_file(&file).unwrap();
    std::fs::create_dir(&file).unwrap();
    let err = labels.save("a", &square(&first, 12), &Operation::named("stroke")).unwrap_err();
    assert!(err.why.contains("are saved, the record of what was done is not"), "{err}");
    assert!(at(&Labels::of(&dataset).load("a").unwrap(), 12), "and that is so");
}
