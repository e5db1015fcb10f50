//! Labels by whatever way their data set is opened.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use touch2touch_core::catalog;
use touch2touch_core::grid::Mask;
use touch2touch_core::label::Provenance;
use touch2touch_core::rig::lab;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::simulated::{Layout, pair_paths};
use touch2touch_pipeline::labels::{DrawnMask, Labels, MaskPlace, Operation, PairLabels, Review};

use crate::support::write_grasps;

fn mask(at: usize) -> Mask {
    Mask::from_fn(175, 140, |u, v| (u + 3 * at) % 11 < 4 && v > 20 + at)
}

/// All labels of a data set as they are read in this order of its pairs.
fn read(folder: &Path, backwards: bool) -> BTreeMap<String, PairLabels> {
    let dataset = Dataset::open(folder).unwrap();
    let labels = Labels::of(&dataset);
    let mut names: Vec<String> = dataset.index.pairs.iter().map(|pair| pair.name.clone()).collect();
    assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
    if backwards {
        names.reverse();
    }
    names.into_iter().map(|name| (name.clone(), labels.load(&name).unwrap())).collect()
}

fn files(folder: &Path) -> BTreeSet<PathBuf> {
    let inside = std::fs::read_dir(folder).into_iter().flatten().flatten();
    inside.map(|entry| entry.path()).filter(|path| path.is_file()).collect()
}

#[test]
fn labels_are_the_same_by_whatever_way_the_data_set_is_opened() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path().join("set");
    write_grasps(&root, Layout::Train, &catalog::tools()[..1], 4);
    let first_pair = pair_paths(&root, Layout::Train, &catalog::tools()[0].name, 0);
    let aside = [0, 1].map(|half| dir.path().join(format!("{half}.pt")));
    first_pair.iter().zip(&aside).for_each(|(file, aside)| std::fs::rename(file, aside).unwrap());
    let dataset = Dataset::open(&root).unwrap();
    let labels = Labels::of(&dataset);
    for (at, pair) in dataset.index.pairs.iter().enumerate() {
        let mut one = labels.load(&pair.name).unwrap();
        for pad in lab::PADS {
            let hand = DrawnMask::new(mask(at + pad.index()), Provenance::hand("a person"));
            one.put(&MaskPlace::measured(pad), Some(hand));
        }
        one.review = Review::Flagged;
        labels.save(&pair.name, &one, &Operation::named("test")).unwrap();
    }
    let (first, written) = (read(&root, false), files(labels.folder().unwrap()));
    assert!(first.len() == 3 && first.values().all(|one| one.masks.len() == 2 && one.review == Review::Flagged));
    let same = |now: &BTreeMap<String, PairLabels>, way: &str| {
        for (name, one) in &first {
            let now = now.get(name).unwrap_or_else(|| panic!("{way}: {name} is gone"));
            assert_eq!(now.review, one.review, "{way}: {name}");
            assert_eq!(now.masks.len(), one.masks.len(), "{way}: {name}");
            assert!(one.masks.iter().all(|(place, hand)| now.masks[place].is_same(hand)), "{way}: {name}");
        }
    };
    same(&read(&root, true), "backwards, a second time");
    let mut ways = vec![
        root.join("train"),
        root.join("train/bubbles"),
        root.join("train/gelslims"),
        root.join("train/bubbles/../../../set"),
    ];
    #[cfg(unix)]
    {
        let link = dir.path().join("link");
        std::os::unix::fs::symlink(&root, &link).unwrap();
        ways.push(link);
    }
    for way in ways {
        same(&read(&way, false), &way.display().to_string());
    }
    // A pair that sorts before the others moves all of them by one place.
    first_pair.iter().zip(&aside).for_each(|(file, aside)| std::fs::rename(aside, file).unwrap());
    let grown = read(&root, false);
    assert_eq!(grown.len(), 4);
    same(&grown, "a pair more");
    assert_eq!(files(labels.folder().unwrap()), written, "reading writes nothing");
    // The folder goes elsewhere, with what lies in it.
    let moved = dir.path().join("moved");
    std::fs::rename(&root, &moved).unwrap();
    same(&read(&moved, false), "moved");
}
