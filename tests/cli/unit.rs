//! A CAD model in another unit is said, and accepted for good.

use std::path::Path;

use touch2touch_pipeline::io::stl;

use super::{error_text, json, run, simulated};

/// Makes a CAD model larger, as if it were in a smaller unit.
fn scale(file: &Path, by: f64) {
    let mut mesh = stl::read(file).unwrap().mesh;
    mesh.vertices.iter_mut().for_each(|v| *v *= by);
    stl::write(file, &mesh).unwrap();
}

#[test]
fn a_model_in_millimeters_is_said_and_accepted_for_good() {
    let (dir, set) = simulated("pattern_36,pattern_31_rod", &["--grasps", "1"]);
    let path = set.to_str().unwrap();
    let folder = set.join("tools_stls");
    let [own, other] = ["pattern_36", "pattern_31_rod"];
    let said = || std::fs::read_to_string(folder.join("unit.txt")).ok();
    let posed = || run(&["pose", path, "--mask", "cad", "--json"], dir.path());
    let set_to = |unit: &str| run(&["doctor", path, "--json", "--set", &format!("unit:{own}={unit}")], dir.path());
    assert!(posed().status.success());
    scale(&folder.join(format!("{own}.stl")), 1e3);

    let found = posed();
    assert_eq!(found.status.code(), Some(1), "{}", error_text(&found));
    assert!(error_text(&found).contains("cannot be meters"), "{}", error_text(&found));
    let doctor = json(&run(&["doctor", path, "--no-predictions", "--json"], dir.path()));
    assert!(doctor["about"].to_string().contains(r#""unit":"mm""#), "{doctor}");

    // A unit in which it is no tool changes nothing; the right one is for all models of the folder.
    let wrong = set_to("um");
    assert!(wrong.status.code() == Some(2) && said().is_none(), "{}", error_text(&wrong));
    assert!(error_text(&wrong).contains("not a tool") && error_text(&wrong).contains("millimeters"));
    let done = set_to("mm");
    assert!(done.status.success(), "{}", error_text(&done));
    let word = json(&done)["set"][0]["word"].clone();
    assert_eq!((said().as_deref(), &word), (Some("auto\n"), &"auto".into()), "the other is in meters");
    assert!(posed().status.success());

    // What the file said before is replaced.
    scale(&folder.join(format!("{other}.stl")), 1e3);
    std::fs::write(folder.join("unit.txt"), "in").unwrap();
    assert_eq!(posed().status.code(), Some(1));
    let done = set_to("mm");
    assert!(done.status.success(), "{}", error_text(&done));
    assert_eq!(said().as_deref(), Some("mm\n"));
    let pose = posed();
    assert!(pose.status.success(), "{}", error_text(&pose));

    // One that is in a unit of its own: no word in one file says that.
    scale(&folder.join(format!("{own}.stl")), 1.0 / 25.4);
    let alone = set_to("in");
    assert_eq!(alone.status.code(), Some(2), "{}", error_text(&alone));
    assert!(error_text(&alone).contains("other units"), "{}", error_text(&alone));
}
