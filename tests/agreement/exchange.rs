//! Masks that are exported, in the studio as by the verb.

use super::*;

#[test]
pub(super) fn masks_are_exported_by_the_studio_as_by_the_verb() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let names: Vec<String> = Dataset::open(&folder).unwrap().index.pairs.iter().map(|pair| pair.name.clone()).collect();
    let exported = home.path().join("exported");
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let path = text(&folder);
    for name in &names {
        json(&["label", &path, "--pair", name, "--adopt", "--mask", "truth", "--review", "done"], home.path());
    }
    let mut studio = Studio::open(Place::Path(folder.clone()), home.path());
    studio.send(ExportCommand::SetMasks(ExportChoice::default()).into());
    studio.send(ExportCommand::Write(Output::Masks, exported.clone()).into());
    let by_verb = home.path().join("by_verb");
    json(&["masks", "export", &path, "--out", &text(&by_verb)], home.path());
    let list = |folder: &Path| std::fs::read(folder.join(touch2touch_pipeline::io::exchange::MANIFEST)).unwrap();
    assert!(list(&exported) == list(&by_verb), "the hashes of all files are in it");
}
