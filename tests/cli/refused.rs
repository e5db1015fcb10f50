//! What cannot be done is an error that says what: files that are none, arguments that do nothing.

use std::path::Path;
use std::process::Command;

use super::{error_text, json, run, simulated, succeed};

#[test]
fn arguments_of_label_that_do_nothing_are_errors() {
    let (dir, set) = simulated("pattern_36", &["--grasps", "2", "--seed", "7"]);
    let label = |args: &[&str]| {
        let all = [&["label", set.to_str().unwrap(), "--pair", "data_0"], args].concat();
        run(&all, dir.path())
    };
    let outside = r#"{"tool": "wand", "tolerance_m": 0.001, "points": [[-500, 3]]}"#;
    let brush = r#"{"tool": "brush", "radius_px": -1, "points": [[50, 50]]}"#;
    let far = r#"{"tool": "brush", "radius_px": 3, "points": [[5000, 50]]}"#;
    let polygon = r#"{"tool": "polygon", "points": []}"#;
    for (args, said) in [
        (vec!["--accept", "measured", "--pose", "1e300,0,0"], "at most 360 degrees"),
        (vec!["--accept", "measured", "--pose", "0,5000,0"], "1000 mm"),
        (vec!["--pose", "10,0,0"], "--pose alone changes nothing"),
        (vec!["--draw", brush], "radius -1 px"),
        (vec!["--draw", polygon], "at least 3 points and has 0"),
        (vec!["--draw", outside], "touches no pixel"),
        (vec!["--draw", far], "touches no pixel"),
    ] {
        let refused = label(&args);
        let text = error_text(&refused);
        assert_eq!(refused.status.code(), Some(2), "{args:?}: {text}");
        assert!(text.contains(said), "{args:?}: {text}");
    }
    assert!(!set.join("touch2touch_masks").exists(), "nothing was stored");
    let drawn = label(&["--draw", r#"{"tool": "brush", "radius_px": 3, "points": [[50, 50]]}"#, "--json"]);
    assert!(drawn.status.success(), "{}", error_text(&drawn));
}

#[cfg(unix)]
#[test]
fn what_is_no_file_among_labels_and_masks_is_said() {
    let (dir, set) = simulated("pattern_36", &["--grasps", "2", "--seed", "7"]);
    let set = set.to_str().unwrap();
    let pipe = |at: &Path| assert!(Command::new("mkfifo").arg(at).status().unwrap().success());
    succeed(&["label", set, "--pair", "data_0", "--adopt", "--review", "done"], dir.path());
    // A lock that would never be given: it ends, and nothing is stored.
    let masks = Path::new(set).join("touch2touch_masks");
    std::fs::remove_file(masks.join(".lock")).unwrap();
    pipe(&masks.join(".lock"));
    let stuck = run(&["label", set, "--pair", "data_0", "--note", "odd"], dir.path());
    assert!(stuck.status.code() == Some(2) && error_text(&stuck).contains("not an ordinary file"), "{stuck:?}");
    std::fs::remove_file(masks.join(".lock")).unwrap();

    let out = dir.path().join("masks");
    succeed(&["masks", "export", set, "--out", out.to_str().unwrap(), "--format", "png"], dir.path());
    pipe(&out.join("train/odd_right.png"));
    let found = run(&["masks", "import", set, "--from", out.to_str().unwrap(), "--json"], dir.path());
    let report = json(&found);
    assert_eq!((report["complete"].as_bool(), found.status.code()), (Some(false), Some(1)), "{report}");
    assert!(error_text(&found).contains("odd_right"), "{}", error_text(&found));
}
