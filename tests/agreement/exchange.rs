//! Masks that are exported and imported: in the studio as by the verb, and undo takes an import back.

use touch2touch::app::labels::Review;
use touch2touch::app::results;
use touch2touch_pipeline::io::exchange::Format;

use super::*;

#[test]
pub(super) fn masks_are_imported_by_the_studio_as_by_the_verb_and_undo_takes_it_back() {
    let (home, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (folder, copy) = (lab_folder(home.path()), lab_folder(second.path()));
    let names: Vec<String> = Dataset::open(&folder).unwrap().index.pairs.iter().map(|pair| pair.name.clone()).collect();
    let exported = home.path().join("exported");
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let (path, copied, out) = (text(&folder), text(&copy), text(&exported));
    for name in &names {
        json(&["label", &path, "--pair", name, "--adopt", "--mask", "truth", "--review", "done"], home.path());
    }
    let mut studio = Studio::open(Place::Path(folder.clone()), home.path());
    let choice = ExportChoice { format: Format::Png, ..ExportChoice::default() };
    studio.send(ExportCommand::SetMasks(choice).into());
    studio.send(ExportCommand::Write(Output::Masks, exported.clone()).into());
    let by_verb = home.path().join("by_verb");
    json(&["masks", "export", &path, "--out", &text(&by_verb), "--format", "png"], home.path());
    let list = |folder: &Path| std::fs::read(folder.join(touch2touch_pipeline::io::exchange::MANIFEST)).unwrap();
    assert!(list(&exported) == list(&by_verb), "the hashes of all files are in it");
    drop(studio);

    // Into labels of other masks: of pairs that nobody judged, and one that somebody did.
    let stored = |folder: &Path, name: &str| Labels::of(&Dataset::open(folder).unwrap()).load(name).unwrap();
    for (path, folder, home) in [(&path, &folder, &home), (&copied, &copy, &second)] {
        let labels = Labels::of(&Dataset::open(folder).unwrap()).folder().unwrap().to_owned();
        if labels.is_dir() {
            std::fs::remove_dir_all(labels).unwrap();
        }
        let other = ["--adopt", "--mask", "threshold"];
        json(&[&["label", path, "--pair", &names[0]], &other[..], &["--review", "todo"]].concat(), home.path());
        json(&[&["label", path, "--pair", &names[1]], &other[..], &["--review", "done"]].concat(), home.path());
    }
    let mut studio = Studio::open(Place::Path(folder.clone()), home.path());
    studio.send(LibraryCommand::Select(PairId(0)).into());
    let hand =
        |studio: &Studio| results::drawn_mask(&studio.state, ImprintSource::Measured, lab::RIGHT).cloned().unwrap();
    let before = hand(&studio);
    studio.send(ExportCommand::AskImport(Some(exported.clone())).into());
    let key = results::import_plan_key(&studio.state).expect("the form is open");
    let Some(plan) = studio.state.results.import_plans.get(&key).cloned() else {
        panic!("{:?}", studio.state.tasks.failed)
    };
    assert!(hand(&studio).is_same(&before), "nothing changes before it is asked for");
    studio.send(ExportCommand::Import.into());
    let entry = studio.state.log.entries.back().unwrap().clone();
    assert!(entry.text.starts_with("Imported from") && studio.state.export.importing.is_none(), "{entry:?}");
    let labels_folder = Labels::of(&Dataset::open(&folder).unwrap()).folder().unwrap().to_owned();
    assert_eq!(entry.place.as_deref(), Some(&*labels_folder), "the note leads there");
    let made = hand(&studio);
    assert!(!made.is_same(&before), "on screen at once");
    studio.send(LabelsCommand::Undo.into());
    assert!(hand(&studio).is_same(&before), "undo: {:?}", studio.state.log.entries);
    studio.send(LabelsCommand::Redo.into());
    assert!(hand(&studio).is_same(&made), "redo");
    drop(studio);

    let said = json(&["masks", "import", &copied, "--from", &out], second.path());
    assert_eq!((plan.new, plan.replaced, plan.judged), (2, 2, 2), "{plan:?}");
    for (key, count) in [("new", plan.new), ("replaced", plan.replaced), ("judged", plan.judged), ("same", plan.same)] {
        assert_eq!(said[key], count, "{key}: {said}");
    }
    for name in &names {
        let (by_studio, by_verb) = (stored(&folder, name), stored(&copy, name));
        assert_eq!(by_studio.review, by_verb.review, "{name}");
        assert!(by_studio.masks.len() == 2 && by_studio.masks.len() == by_verb.masks.len(), "{name}");
        for (place, mask) in &by_studio.masks {
            assert!(mask.is_same(&by_verb.masks[place]), "{name}");
        }
    }
    assert_eq!(stored(&folder, &names[1]).review, Review::Done);
}
