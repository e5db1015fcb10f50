//! Masks in the forms of other programs: what is exported comes back the same, and an import keeps what people did.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use strum::IntoEnumIterator as _;
use touch2touch_core::catalog;
use touch2touch_core::dataset::PairId;
use touch2touch_core::grid::{Grid, Mask};
use touch2touch_core::label::{Marks, Provenance};
use touch2touch_core::rig::{PadId, lab};
use touch2touch_pipeline::export::import::{Import, ImportSetup, import_masks, plan_import};
use touch2touch_pipeline::export::{DrawnMasks, ExportChoice, ExportSetup, Which, export_masks};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::exchange::{Format, MANIFEST, PARTS};
use touch2touch_pipeline::io::images;
use touch2touch_pipeline::io::simulated::Layout;
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::labels::{DrawnMask, Labels, MaskPlace, Operation, PairLabels, Review};

use crate::support::{cancelled_when, write_grasps};

/// A data set of four grasps whose masks Anna painted, each with some ignored pixels and one without contact; the last pair
/// is in progress, the others are done.
fn painted(root: &Path) -> Dataset {
    write_grasps(root, Layout::Train, &catalog::tools()[..1], 4);
    let dataset = Dataset::open(root).unwrap();
    for (at, entry) in (0..).zip(&dataset.index.pairs) {
        let sample = dataset.load(PairId(at)).unwrap();
        let mut stored = PairLabels { review: Review::Done, ..PairLabels::default() };
        if at == 3 {
            stored.review = Review::InProgress;
        }
        for (pad, touch) in sample.pads.entries() {
            let truth = touch.depth().unwrap().truth.as_ref().unwrap().contact.clone();
            let empty = at == 1 && pad == lab::LEFT;
            let mask = if empty { truth.map(|_| false) } else { truth };
            let ignored = (at != 2).then(|| Mask::from_fn(mask.width(), mask.height(), |x, y| x / 7 == 3 && y > 60));
            stored.masks.insert(MaskPlace::measured(pad), by(&mask, ignored.as_ref(), Provenance::hand("Anna")));
        }
        Labels::of(&dataset).save(&entry.name, &stored, &Operation::named("test")).unwrap();
    }
    dataset
}

fn by(mask: &Mask, ignored: Option<&Mask>, from: Provenance) -> DrawnMask {
    let mut hand = DrawnMask::new(mask.clone(), from.clone());
    hand.take_over(mask, ignored, from, false);
    hand
}

fn export(dataset: &Dataset, folder: &Path, format: Format) {
    let choice = ExportChoice { which: Which::Begun, format, ..ExportChoice::default() };
    let masks = DrawnMasks { labels: &Labels::of(dataset), changed: &BTreeMap::new() };
    let setup = ExportSetup { pairs: None, choice };
    let (plan, report) = export_masks(dataset, &masks, &setup, folder, None, &JobCx::unwatched()).unwrap();
    assert_eq!((plan.total(), report.counts.iter().sum::<usize>()), (8, 8), "{format:?}");
}

fn from(path: &Path) -> ImportSetup {
    ImportSetup { from: path.to_owned(), person: Some("Ben".into()), ..ImportSetup::default() }
}

fn import(dataset: &Dataset, setup: &ImportSetup) -> Import {
    let planned = plan_import(dataset, setup, &JobCx::unwatched()).unwrap();
    let found = import_masks(dataset, setup, &JobCx::unwatched()).unwrap();
    assert_eq!(planned, found, "what is said is what is done");
    found
}

fn all(dataset: &Dataset) -> BTreeMap<(String, PadId), DrawnMask> {
    let labels = Labels::of(dataset);
    let load = |(pair, pad): (String, PadId)| {
        let hand = labels.load(&pair).unwrap().measured(pad).unwrap().clone();
        ((pair, pad), hand)
    };
    labels.masks().into_iter().map(load).collect()
}

fn forget(dataset: &Dataset) {
    std::fs::remove_dir_all(Labels::of(dataset).folder().unwrap()).unwrap();
}

#[test]
fn every_form_comes_back_the_same_into_an_empty_folder_of_labels() {
    let dir = tempfile::tempdir().unwrap();
    let dataset = painted(&dir.path().join("set"));
    let before = all(&dataset);
    let folders: BTreeMap<Format, PathBuf> = Format::iter().map(|f| (f, dir.path().join(f.key()))).collect();
    for (format, folder) in &folders {
        export(&dataset, folder, *format);
    }
    for (format, folder) in &folders {
        // As it lies there, without its list, and of a part alone.
        for with_list in [true, false] {
            forget(&dataset);
            if !with_list {
                std::fs::remove_file(folder.join(MANIFEST)).unwrap();
            }
            let found = import(&dataset, &from(folder));
            assert_eq!((found.new, found.total(), found.complete), (8, 8, true), "{format:?}: {found:?}");
            assert_eq!(found.format, *format);
            let after = all(&dataset);
            assert!(after.keys().eq(before.keys()), "{format:?}");
            for (of, hand) in &after {
                let was = &before[of];
                assert!(hand.mask == was.mask && hand.marks.ignored() == was.marks.ignored(), "{format:?} {of:?}");
                let layers = hand.marks.layers();
                assert!(layers.iter().all(|(from, _)| matches!(from, Provenance::Imported { .. })), "{layers:?}");
            }
            let labels = Labels::of(&dataset);
            assert!(labels.reviews().states.is_empty(), "no pair is marked");
            let name = &dataset.index.pairs[0].name;
            assert_eq!(labels.persons(name).unwrap().into_iter().collect::<Vec<_>>(), ["Ben"]);
            assert_eq!(labels.past(name, &labels.load(name).unwrap()).done[0].name, "import of masks");
            let again = import(&dataset, &from(folder));
            assert_eq!((again.same, again.total()), (8, 0), "{format:?}: {again:?}");
        }
        let part = match format {
            Format::Unet => folder.join("train/masks"),
            Format::Png => folder.join("train"),
        };
        let found = import(&dataset, &from(&part));
        assert!(found.same > 0 && found.same < 8 && found.complete, "{format:?}: {found:?}");
    }
}

#[test]
fn what_people_did_stays_unless_asked_and_undo_brings_back_what_was() {
    let dir = tempfile::tempdir().unwrap();
    let dataset = painted(&dir.path().join("set"));
    let folder = dir.path().join("png");
    export(&dataset, &folder, Format::Png);
    // All masks are others now: of a threshold, with one column by hand. The first pair is done.
    let labels = Labels::of(&dataset);
    let names: Vec<String> = dataset.index.pairs.iter().map(|pair| pair.name.clone()).collect();
    for (at, name) in names.iter().enumerate() {
        let mut stored = labels.load(name).unwrap();
        stored.review = if at == 0 { Review::Done } else { Review::Todo };
        for hand in stored.masks.values_mut() {
            let all = hand.mask.map(|_| true);
            *hand = DrawnMask::new(all, Provenance::Threshold { min_m: 0.001 });
            let column = Mask::from_fn(175, 140, |x, _| x == 5);
            let rect = touch2touch_core::label::Rect { x: 5, y: 0, width: 1, height: 140 };
            let (mask, marks) = (Arc::make_mut(&mut hand.mask), Arc::make_mut(&mut hand.marks));
            let anna = Provenance::hand("Anna");
            marks.paint(mask, (&column, rect), touch2touch_core::label::Paint::Contact, None, anna);
        }
        labels.save(name, &stored, &Operation::named("test")).unwrap();
    }
    let before = all(&dataset);
    let found = import(&dataset, &from(&folder));
    assert_eq!((found.new, found.replaced, found.kept, found.judged), (0, 6, 6, 2), "{found:?}");
    assert_eq!(found.changed, names[1..]);
    let after = all(&dataset);
    for ((pair, pad), hand) in &after {
        let was = &before[&(pair.clone(), *pad)];
        assert_eq!(hand.is_same(was), *pair == names[0], "a judged pair");
        let checked: &Marks = &hand.marks;
        assert!((0..140).all(|y| hand.mask[(5, y)] && checked.at(5, y) == Some(&Provenance::hand("Anna"))));
    }
    assert_eq!(labels.load(&names[0]).unwrap().review, Review::Done);
    // The journal leads back.
    let fresh = Labels::of(&dataset);
    let stored = fresh.load(&names[1]).unwrap();
    assert_eq!(stored.review, Review::Todo);
    let done = fresh.past(&names[1], &stored).done;
    let last = done.last().unwrap();
    assert_eq!(last.name, "import of masks");
    for (place, [old, new]) in &last.change.masks {
        let of = (names[1].clone(), place.pad);
        assert!(old.as_ref().unwrap().is_same(&before[&of]) && new.as_ref().unwrap().is_same(&after[&of]));
    }
    // Asked for, all of it is taken; states stay.
    let found = import(&dataset, &ImportSetup { over_drawn: true, ..from(&folder) });
    assert_eq!((found.replaced, found.kept, found.judged), (8, 0, 0), "{found:?}");
    assert_eq!(labels.reviews().states, BTreeMap::from([(names[0].clone(), Review::Done)]));
    let again = import(&dataset, &from(&folder));
    assert_eq!((again.same, again.total()), (8, 0));
}

#[test]
fn what_does_not_fit_is_said_with_its_file_and_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let dataset = painted(&dir.path().join("set"));
    let folder = dir.path().join("png");
    export(&dataset, &folder, Format::Png);
    std::fs::remove_file(folder.join(MANIFEST)).unwrap();
    let mut files: Vec<PathBuf> = PARTS
        .iter()
        .flat_map(|part| std::fs::read_dir(folder.join(part)).unwrap().map(|entry| entry.unwrap().path()))
        .filter(|path| !path.to_str().unwrap().ends_with(".ignore.png"))
        .collect();
    files.sort();
    let gray = |value: u8| Grid::filled(175, 140, value);
    images::write_gray8(&files[0], &gray(7)).unwrap();
    images::write_gray8(&files[1], &Grid::filled(17, 14, 255u8)).unwrap();
    images::write_rgb8(&files[2], &Grid::from_fn(175, 140, |x, _| [x as f32, 0.0, 0.0])).unwrap();
    images::write_gray8(&files[3], &Grid::from_fn(175, 140, |x, _| if x < 9 { 1 } else { 255u8 })).unwrap();
    std::fs::write(&files[4], "no picture").unwrap();
    images::write_gray8(&folder.join("train/elsewhere_right.png"), &gray(0)).unwrap();
    // The same name in two parts: nobody can say which one is meant.
    for part in PARTS {
        std::fs::copy(&files[7], folder.join(part).join(files[7].file_name().unwrap())).unwrap();
    }
    let before = all(&dataset);
    let found = import(&dataset, &from(&folder));
    let why = |list: &[touch2touch_pipeline::error::Remark]| list.iter().map(|r| r.why.clone()).collect::<Vec<_>>();
    assert_eq!((found.same, found.total(), found.complete), (2, 0, false), "{found:?}");
    assert_eq!(found.unmatched.len(), 1);
    assert!(why(&found.unmatched)[0].contains("no pair and finger"), "{found:?}");
    let refused = why(&found.refused);
    for word in ["the value 7", "17 x 14", "Rgb8", "1 and 255", "not a readable PNG", "3 masks have the name"] {
        assert!(refused.iter().any(|why| why.contains(word)), "{word}: {refused:#?}");
    }
    assert!(refused.iter().filter(|why| why.contains(".png)")).count() >= 5, "each names its file: {refused:#?}");
    let after = all(&dataset);
    assert!(before.iter().all(|(of, hand)| hand.is_same(&after[of])));

    let fail = |path: &Path, format: Option<Format>| {
        let setup = ImportSetup { format, ..from(path) };
        plan_import(&dataset, &setup, &JobCx::unwatched()).unwrap_err()
    };
    let empty = dir.path().join("empty");
    std::fs::create_dir(&empty).unwrap();
    assert!(fail(&empty, None).why.contains("no masks here"));
    assert!(fail(&folder, Some(Format::Unet)).why.contains("no masks in the form"));
    assert!(fail(&dir.path().join("none"), None).why.contains("no such file"));
}

#[test]
fn an_import_stops_between_pairs_and_keeps_what_was_done() {
    let dir = tempfile::tempdir().unwrap();
    let dataset = painted(&dir.path().join("set"));
    let folder = dir.path().join("png");
    export(&dataset, &folder, Format::Png);
    forget(&dataset);
    let cx = cancelled_when(|progress| progress.done == 1);
    let found = import_masks(&dataset, &from(&folder), &cx).unwrap();
    assert_eq!((found.new, found.changed.len(), found.complete), (4, 2, false), "{found:?}");
    assert!(found.text().contains("stopped early"));
    assert_eq!(all(&dataset).len(), 4);
    // Before the first it is an error.
    assert!(import_masks(&dataset, &from(&folder), &cx).unwrap_err().is_cancelled());
}
