//! `touch2touch unit`: a CAD model in another unit is said, and accepted for good.

use std::path::Path;

use touch2touch_work::io::stl;

use super::{error_text, json};
use crate::support::run;

/// Makes a CAD model larger, as if it were in a smaller unit.
fn scale(file: &Path, by: f64) {
    let mut mesh = stl::read(file).unwrap().mesh;
    mesh.vertices.iter_mut().for_each(|v| *v *= by);
    stl::write(file, &mesh).unwrap();
}

#[test]
fn a_model_in_millimeters_is_said_and_accepted_for_good() {
    let dir = tempfile::tempdir().unwrap();
    let set = dir.path().join("set");
    let path = set.to_str().unwrap();
    let made = ["simulate", "--out", path, "--tools", "pattern_36,pattern_31_rod", "--grasps", "1"];
    assert!(run(&made, dir.path()).status.success());
    let folder = set.join("tools_stls");
    let [own, other] = ["pattern_36", "pattern_31_rod"];
    let said = || std::fs::read_to_string(folder.join("unit.txt")).ok();
    let unit = |words: &[&str]| run(&[&["unit", path, "--json"], words].concat(), dir.path());
    assert_eq!(unit(&[]).status.code(), Some(0));
    scale(&folder.join(format!("{own}.stl")), 1e3);

    let found = unit(&["--tool", own]);
    assert_eq!(found.status.code(), Some(1), "{}", error_text(&found));
    let tool = json(&found)["tools"][0].clone();
    assert_eq!((&tool["usable"], &tool["fits"][0]["unit"]), (&false.into(), &"mm".into()), "{tool}");
    assert!(tool["problem"].as_str().unwrap().contains("cannot be meters"), "{tool}");

    // A unit in which it is no tool changes nothing; the right one is for all models of the folder.
    let wrong = unit(&["--tool", own, "--set", "um"]);
    assert!(wrong.status.code() == Some(2) && said().is_none(), "{}", error_text(&wrong));
    assert!(error_text(&wrong).contains("no tool") && error_text(&wrong).contains("millimeters"));
    let done = unit(&["--tool", own, "--set", "mm"]);
    assert!(done.status.success(), "{}", error_text(&done));
    assert_eq!((said().as_deref(), &json(&done)["word"]), (Some("auto\n"), &"auto".into()), "the other is in meters");
    assert_eq!(unit(&[]).status.code(), Some(0));

    scale(&folder.join(format!("{other}.stl")), 1e3);
    std::fs::write(folder.join("unit.txt"), "in").unwrap();
    let refused = unit(&["--tool", own, "--set", "mm"]);
    assert_eq!((refused.status.code(), said().as_deref()), (Some(2), Some("in")));
    assert!(error_text(&refused).contains("says \"in\" already"), "{}", error_text(&refused));
    let done = unit(&["--tool", own, "--set", "mm", "--replace"]);
    assert!(done.status.success(), "{}", error_text(&done));
    assert_eq!(said().as_deref(), Some("mm\n"));
    assert_eq!(unit(&[]).status.code(), Some(0));
    let pose = run(&["pose", path, "--mask", "cad", "--json"], dir.path());
    assert!(pose.status.success(), "{}", error_text(&pose));

    // One that is in a unit of its own: no word in one file says that.
    scale(&folder.join(format!("{own}.stl")), 1.0 / 25.4);
    let alone = unit(&["--tool", own, "--set", "in", "--replace"]);
    assert_eq!(alone.status.code(), Some(2), "{}", error_text(&alone));
    assert!(error_text(&alone).contains("other units"), "{}", error_text(&alone));
}
