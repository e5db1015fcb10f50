//! A `rig.json` in which one thing is wrong is refused everywhere: its pictures are never read as another sensor's.

use std::path::Path;

use serde_json::{Value, json};
use touch2touch::app::library::Place;
use touch2touch::app::source::Source;
use touch2touch_core::grid::RgbGrid;
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::io::dataset::{Dataset, RIG_JSON};
use touch2touch_pipeline::io::error::FileErrorKind;
use touch2touch_pipeline::io::images;

use crate::support::{run, tiny};

/// A gripper of two fingers, each with a color and a depth sensor.
fn sound() -> Value {
    json!({
        "name": "Two fingers",
        "sensors": [
            {"key": "digit", "name": "DIGIT", "kind": "color", "width": 24, "height": 32, "px_per_m": 1600.0},
            {"key": "dome", "name": "Dome", "kind": "depth", "width": 64, "height": 48, "px_per_m": 800.0,
             "crop": {"full": [100, 80], "offset": [10, 8]}, "rotation_deg": 180},
        ],
        "pads": [{"key": "thumb", "name": "Thumb"}, {"key": "index", "name": "Index finger"}],
        "windows": [{"pad": 0, "of": 0, "within": 1, "center_px": [30.0, 24.0], "size_px": [12.0, 16.0]}],
    })
}

/// A folder with one touch, whose `rig.json` is this text.
fn folder(dir: &Path, rig: &[u8]) {
    let picture = RgbGrid::from_fn(24, 32, |x, y| [90.0 + x as f32, 100.0, 120.0 - y as f32]);
    images::write_rgb8(&dir.join("reference.png"), &picture).unwrap();
    images::write_rgb8(&dir.join("a_touch.png"), &picture).unwrap();
    std::fs::write(dir.join(RIG_JSON), rig).unwrap();
}

/// What is put into one place of the sound rig, and a word of what is then said. Numbers that JSON cannot hold are text
/// between `@`, without their quotes.
fn spoilt() -> Vec<(&'static str, Value, &'static str)> {
    vec![
        ("/sensors", json!([]), "1 to 100 sensors"),
        ("/sensors", json!("digit"), "invalid type"),
        ("/sensors", Value::Null, "invalid type"),
        ("/pads", json!([]), "1 to 100 pads"),
        ("/pads", json!(vec![json!({"key": "a", "name": "A"}); 101]), "1 to 100 pads"),
        ("/windows", json!(3), "invalid type"),
        ("/name", json!(""), "the name"),
        ("/name", json!("red\u{1b}[31m"), "the name"),
        ("/name", json!("x".repeat(81)), "the name"),
        ("/name", json!(7), "invalid type"),
        ("/sensors/0/key", json!("Digit"), "small letters"),
        ("/sensors/0/key", json!("../digit"), "small letters"),
        ("/sensors/0/key", json!(""), "small letters"),
        ("/sensors/0/key", json!("d".repeat(33)), "small letters"),
        ("/sensors/0/key", json!("dome"), "twice"),
        ("/sensors/0/key", json!("touch"), "another meaning"),
        ("/sensors/1/key", json!("vqvae"), "another meaning"),
        ("/sensors/0/name", json!("\u{202e}TIGID"), "the name"),
        ("/sensors/0/name", json!("two\nlines"), "the name"),
        ("/sensors/0/kind", json!("colour"), "unknown variant"),
        ("/sensors/0/width", json!(0), "width and height"),
        ("/sensors/0/width", json!(-24), "invalid value"),
        ("/sensors/0/width", json!(24.5), "invalid type"),
        ("/sensors/0/width", json!(4097), "width and height"),
        ("/sensors/0/height", json!(u64::MAX), "width and height"),
        ("/sensors/0/height", json!("32"), "invalid type"),
        ("/sensors/0/px_per_m", json!(0.0), "px_per_m"),
        ("/sensors/0/px_per_m", json!(-1600.0), "px_per_m"),
        ("/sensors/0/px_per_m", json!(1e300), "px_per_m"),
        ("/sensors/0/px_per_m", json!(1e-300), "px_per_m"),
        ("/sensors/0/px_per_m", json!("@1e999@"), "number out of range"),
        ("/sensors/0/px_per_m", json!("@NaN@"), "expected"),
        ("/sensors/0/px_per_mm", json!(1.6), "unknown field"),
        ("/sensors/1/rotation_deg", json!(90), "rotation_deg"),
        ("/sensors/1/rotation_deg", json!(-180), "invalid value"),
        ("/sensors/1/crop/full", json!([u64::MAX, u64::MAX]), "crop"),
        ("/sensors/1/crop/full", json!([60, 80]), "crop"),
        ("/sensors/1/crop/full", json!([0, 80]), "crop"),
        ("/sensors/1/crop/offset", json!([u64::MAX, 8]), "crop"),
        ("/sensors/1/crop/offset", json!([37, 8]), "crop"),
        ("/sensors/1/crop", json!({"full": [0, 0], "offset": [u64::MAX, 0]}), "crop.offset"),
        ("/pads/0/key", json!("both"), "another meaning"),
        ("/pads/0/key", json!("index"), "twice"),
        ("/pads/0/key", json!("thumb finger"), "small letters"),
        ("/pads/0/name", json!("  "), "the name"),
        ("/windows/0/pad", json!(2), "not there"),
        ("/windows/0/of", json!(7), "not there"),
        ("/windows/0/of", json!(1), "two sensors"),
        ("/windows/0/within", json!(300), "invalid value"),
        ("/windows/0/size_px", json!([0.0, 16.0]), "size_px"),
        ("/windows/0/size_px", json!([12.0, -16.0]), "size_px"),
        ("/windows/0/size_px", json!([1e308, 16.0]), "size_px"),
        ("/windows/0/size_px", json!([12.0]), "invalid length"),
        ("/windows/0/center_px", json!([1e308, 24.0]), "outside the picture"),
        ("/windows/0/center_px", json!([-30.0, 24.0]), "outside the picture"),
        ("/windows/1", json!({"pad": 0, "of": 0, "within": 1, "center_px": [9, 9], "size_px": [3, 3]}), "earlier one"),
    ]
}

/// The sound rig with one value in another's place, as a file's text.
fn with(at: &str, value: &Value) -> Vec<u8> {
    let mut rig = sound();
    let (parent, field) = at.rsplit_once('/').unwrap();
    match rig.pointer_mut(parent).unwrap() {
        Value::Object(fields) => drop(fields.insert(field.to_owned(), value.clone())),
        Value::Array(items) => match items.get_mut(field.parse::<usize>().unwrap()) {
            Some(item) => *item = value.clone(),
            None => items.push(value.clone()),
        },
        other => panic!("{at}: {other}"),
    }
    rig.to_string().replace("\"@", "").replace("@\"", "").into_bytes()
}

#[test]
fn the_rig_that_the_page_shows_is_one() {
    let page = include_str!("../docs/data.md");
    let shown = page.split("```json\n").nth(1).unwrap().split("```").next().unwrap();
    let rig = Rig::parse(shown.as_bytes()).unwrap();
    assert_eq!((&*rig.name, rig.sensors.len(), rig.pads.len(), rig.windows.len()), ("Two fingers", 2, 2, 1));
}

#[test]
fn a_rig_with_one_spoilt_field_is_refused_and_says_what_to_do() {
    let dir = tempfile::tempdir().unwrap();
    folder(dir.path(), sound().to_string().as_bytes());
    assert_eq!(Dataset::open(dir.path()).unwrap().rig.name, "Two fingers");
    assert!(Source::open(&Place::Path(dir.path().to_owned()), None).is_ok());

    let text = sound().to_string().into_bytes();
    let mut files: Vec<(String, Vec<u8>, &str)> =
        spoilt().into_iter().map(|(at, value, said)| (format!("{at} = {value:.60}"), with(at, &value), said)).collect();
    files.extend([
        ("nothing".to_owned(), Vec::new(), "EOF"),
        ("cut".to_owned(), text[..text.len() / 2].to_vec(), "EOF"),
        ("two".to_owned(), [&text[..], &text[..]].concat(), "trailing characters"),
        ("not UTF-8".to_owned(), b"{\"name\": \"\xff\"}".to_vec(), "invalid unicode"),
        ("a mark before it".to_owned(), [b"\xef\xbb\xbf", &text[..]].concat(), "expected value"),
    ]);
    assert!(files.len() >= 48);
    for (what, text, said) in &files {
        std::fs::write(dir.path().join(RIG_JSON), text).unwrap();
        let err = Dataset::open(dir.path()).expect_err(what);
        assert!(err.kind == FileErrorKind::Rig, "{what}: {err}");
        let err = Source::open(&Place::Path(dir.path().to_owned()), None).expect_err(what);
        let problem = Dataset::open(dir.path()).unwrap_err().to_problem();
        for shown in [err.to_string(), format!("{} {}", problem.what, problem.hint)] {
            for part in [RIG_JSON, "correct it, or remove it", said] {
                assert!(shown.contains(part), "{what}: {part:?} is not in {shown:?}");
            }
        }
    }
}

#[test]
fn verbs_refuse_a_spoilt_rig_and_the_doctor_names_it() {
    let dir = tempfile::tempdir().unwrap();
    let (home, set) = (dir.path().join("home"), dir.path().join("set"));
    std::fs::create_dir(&set).unwrap();
    folder(&set, b"");
    let place = set.to_str().unwrap();
    // Each way in which the text can be wrong once; all of them are tried above, without a process for each.
    let some = ["/sensors", "/sensors/0/width", "/sensors/0/px_per_m", "/sensors/1/crop/full", "/windows/0/size_px"];
    for (at, value, _) in spoilt().into_iter().filter(|(at, ..)| some.contains(at)).step_by(2) {
        std::fs::write(set.join(RIG_JSON), with(at, &value)).unwrap();
        let doctor = run(&["doctor", place, "--json"], &home);
        let report: Value = serde_json::from_slice(&doctor.stdout).unwrap();
        assert_eq!((doctor.status.code(), report["problems"].as_array().unwrap().len()), (Some(1), 1), "{at}");
        assert!(report["problems"][0]["file"].as_str().unwrap().ends_with(RIG_JSON), "{report}");
        assert!(report["problems"][0]["hint"].as_str().unwrap().contains("remove it"), "{report}");
    }
    let out = dir.path().join("out");
    for verb in [
        "generate --out OUT",
        "pose",
        "evaluate",
        "adapt",
        "stats --out OUT",
        "masks export --out OUT",
        "label",
        "compare --pair a",
        "export --pair a --out OUT",
        "watch --once",
    ] {
        let words: Vec<&str> = verb.split(' ').map(|w| if w == "OUT" { out.to_str().unwrap() } else { w }).collect();
        let refused = run(&[&words[..], &[place]].concat(), &home);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{verb}: {said}");
        assert!(said.contains(RIG_JSON) && said.contains("remove it") && !out.exists(), "{verb}: {said}");
    }
}

#[cfg(unix)]
#[test]
fn a_rig_that_leads_nowhere_or_changes_is_no_lab_rig() {
    let dir = tempfile::tempdir().unwrap();
    folder(dir.path(), sound().to_string().as_bytes());
    let dataset = Dataset::open(dir.path()).unwrap();
    let file = dir.path().join(RIG_JSON);
    std::fs::remove_file(&file).unwrap();
    let gone = dataset.grown().expect_err("the pictures would be read as another sensor's").to_string();
    assert!(gone.contains("open it again"), "{gone}");
    std::os::unix::fs::symlink(dir.path().join("nowhere"), &file).unwrap();
    assert_eq!(Dataset::open(dir.path()).unwrap_err().kind, FileErrorKind::Rig);
    std::fs::remove_file(&file).unwrap();
    assert_eq!(*Dataset::open(dir.path()).unwrap().rig, *Rig::lab(), "without a file they are the lab's");
}

#[test]
fn names_from_files_are_shown_and_never_obeyed() {
    let dir = tempfile::tempdir().unwrap();
    let (home, set) = (dir.path().join("home"), dir.path().join("set"));
    std::fs::create_dir(&set).unwrap();
    folder(&set, sound().to_string().as_bytes());
    // A pair's name, a file without its other half, and a text that a reader quotes.
    let evil = "b\u{1b}[2J\u{1b}]0;owned\u{7}\u{9b}31m";
    std::fs::copy(set.join("reference.png"), set.join(format!("{evil}_touch.png"))).unwrap();
    std::fs::copy(set.join("reference.png"), set.join(format!("{evil}2_dome.png"))).unwrap();
    let place = set.to_str().unwrap();
    let obeyed = |bytes: &[u8]| {
        let text = String::from_utf8(bytes.to_vec()).unwrap();
        assert!(!text.chars().any(|c| c.is_control() && c != '\n' && c != '\t'), "{text:?}");
        text
    };
    let mut all = String::new();
    let bundle = tiny("digit_to_bubble");
    for args in [
        &["doctor", place][..],
        &["doctor", place, "--json"],
        &["stats", place, "--out", "/no/such/folder/x", "--bundle", bundle.to_str().unwrap()],
        &["pose", place],
        &["label", place],
        &["label", place, "--pair", evil],
        &["masks", "stats", place],
        &["doctor", evil],
    ] {
        let ran = run(args, &home);
        all += &obeyed(&ran.stdout);
        all += &obeyed(&ran.stderr);
    }
    assert!(all.contains(r"b\u001b[2J\u001b]0;owned\u0007\u009b31m"), "the name is shown: {all}");
    std::fs::write(set.join(RIG_JSON), with("/sensors/0/\u{1b}[31m", &json!(1))).unwrap();
    let refused = run(&["pose", place], &home);
    assert!(obeyed(&refused.stderr).contains(r"unknown field `\u001b[31m`"));
}
