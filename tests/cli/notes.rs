//! A data set of masks: notes.

use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::io::masks::MaskStore;

use super::{json, run, simulated, succeed};

#[test]
fn notes_are_written_listed_and_removed() {
    let (dir, set) = simulated("pattern_36", &["--grasps", "1", "--seed", "4"]);
    let path = set.to_str().unwrap();
    let name = Dataset::open(&set).unwrap().index.pairs[0].name.clone();
    let note = |text: &str| succeed(&["label", path, "--pair", &name, "--note", text, "--json"], dir.path());
    let written = note(" shallow\n at the edge ");
    assert_eq!(json(&written)["pairs"][0]["note"], "shallow at the edge");
    let listed = run(&["label", path], dir.path());
    let text = String::from_utf8_lossy(&listed.stdout).into_owned();
    assert!(text.contains("note: shallow at the edge") && text.contains("1 todo"), "{text}");
    let store = MaskStore::for_dataset(&Dataset::open(&set).unwrap()).unwrap();
    let journal = String::from_utf8(store.journal(&name).unwrap()).unwrap();
    assert!(journal.contains(r#""note":["","shallow at the edge"]"#), "{journal}");
    note("");
    assert_eq!(store.load_review(&name).unwrap().unwrap().note, "");
}
