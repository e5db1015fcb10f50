//! `watch`: what arrives is taken once it is whole, once, and what cannot be used is said beside it.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::Value;
use touch2touch_pipeline::io::npz;

use super::{error_text, run, simulate, succeed};
use crate::support::files_below;

/// Two simulated grasps in the lab's layout; returns the folder of the set and its two GelSlim files.
fn set(dir: &Path) -> (PathBuf, Vec<PathBuf>) {
    let set = dir.join("set");
    simulate(&set, "pattern_36", &["--grasps", "3", "--seed", "5"]);
    let mut files = files_below(&set);
    files.retain(|path| path.to_str().unwrap().contains("gelslims"));
    files.sort();
    assert_eq!(files.len(), 3);
    (set, files)
}

/// A bubble file of the set: the rig's cameras.
fn bubble(gelslim: &Path) -> PathBuf {
    PathBuf::from(
        gelslim
            .to_str()
            .unwrap()
            .replace("gelslim_style_transfer_dataset_gelslim_", "bubble_style_transfer_dataset_bubbles_")
            .replace("gelslims", "bubbles"),
    )
}

/// The program at work on a folder, and its lines.
struct Watch {
    child: Child,
    lines: Receiver<Value>,
}

impl Watch {
    fn start(folder: &Path, data: &Path, more: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_touch2touch"))
            .args(["watch", folder.to_str().unwrap(), "--steps", "2", "--json"])
            .args(more)
            .env("TOUCH2TOUCH_DATA", data)
            .env("XDG_DATA_HOME", data)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, lines) = channel();
        let out = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                if sender.send(serde_json::from_str(&line).unwrap()).is_err() {
                    break;
                }
            }
        });
        let watch = Self { child, lines };
        assert_eq!(watch.next()["event"], "ready");
        watch
    }

    fn next(&self) -> Value {
        self.lines.recv_timeout(Duration::from_secs(120)).expect("the program says something")
    }

    /// Ctrl-C.
    #[cfg(unix)]
    fn stop(mut self) -> Value {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        let summary = loop {
            let line = self.next();
            if line["event"] == "summary" {
                break line;
            }
        };
        let status = self.child.wait().unwrap();
        assert_eq!(status.code(), Some(i32::from(summary["failed"] != 0)), "{status}");
        summary
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

fn result(touch: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(touch.with_extension("t2t.json")).unwrap()).unwrap()
}

#[cfg(unix)]
#[test]
fn touches_are_posed_as_they_arrive_and_damaged_ones_do_not_stop_it() {
    let dir = tempfile::tempdir().unwrap();
    let (set, files) = set(dir.path());
    let folder = dir.path().join("robot");
    std::fs::create_dir(&folder).unwrap();
    std::fs::copy(bubble(&files[0]), folder.join("rig.pt")).unwrap();
    let stl = set.join("tools_stls/pattern_36.stl");
    let watch = Watch::start(&folder, dir.path(), &["--tool", stl.to_str().unwrap()]);

    // Written slowly: nothing happens before the last byte.
    let slow = folder.join("grasp_1.pt");
    let bytes = std::fs::read(&files[0]).unwrap();
    let mut file = std::fs::File::create(&slow).unwrap();
    for part in bytes.chunks(bytes.len() / 4 + 1) {
        file.write_all(part).unwrap();
        file.flush().unwrap();
        assert!(!slow.with_extension("t2t.json").exists());
        std::thread::sleep(Duration::from_millis(150));
    }
    drop(file);
    let done = watch.next();
    assert_eq!((done["event"].as_str(), done["name"].as_str()), (Some("done"), Some("grasp_1")), "{done}");
    assert!(done["latency"]["total"].as_f64().unwrap() > 0.0 && done["latency"]["generate"].as_f64().unwrap() > 0.0);
    let json = result(&slow);
    assert_eq!(json["recipe"]["config"]["steps"], 2);
    assert!(json["error"].is_null());
    // Two steps say little about the angle, but the way to it is the whole one.
    assert!(json["pose"]["angle_deg"].is_number() || json["no_pose"].is_string(), "{json}");
    assert!(json["no_pose"].as_str().is_none_or(|why| !why.contains("camera") && !why.contains("tool")), "{json}");
    let arrays = npz::read(&slow.with_extension("t2t.npz")).unwrap();
    for name in ["imprint_right", "imprint_left", "mask_right", "mask_left"] {
        assert_eq!(arrays[name].shape, [140, 175], "{name}");
    }
    assert!(slow.with_extension("t2t.left.png").exists());

    // Cut off for good: said beside it, and the next one is done all the same.
    let cut = folder.join("grasp_2.pt");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let error = watch.next();
    assert_eq!((error["event"].as_str(), error["name"].as_str()), (Some("error"), Some("grasp_2")), "{error}");
    assert!(result(&cut)["error"]["what"].as_str().unwrap().contains("truncated"));
    let moved = folder.join("grasp_3.pt");
    std::fs::copy(&files[1], dir.path().join("store.pt")).unwrap();
    std::fs::rename(dir.path().join("store.pt"), &moved).unwrap();
    assert_eq!(watch.next()["name"], "grasp_3");
    // Written again, whole this time.
    std::fs::write(&cut, &bytes).unwrap();
    let healed = watch.next();
    assert_eq!((healed["event"].as_str(), healed["name"].as_str()), (Some("done"), Some("grasp_2")), "{healed}");
    assert!(result(&cut)["error"].is_null());

    let summary = watch.stop();
    assert_eq!((&summary["done"], &summary["failed"]), (&Value::from(3), &Value::from(1)), "{summary}");
    assert_eq!(summary["latency_ms"]["touches"], 3);
    assert!(summary["latency_ms"]["total"]["p95"].as_f64() >= summary["latency_ms"]["total"]["median"].as_f64());
    let left: Vec<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".part"))
        .collect();
    assert!(left.is_empty(), "{left:?}");

    // Started again, it takes up nothing: what lies there was done, and its own files are no touches.
    let mut again = Watch::start(&folder, dir.path(), &["--tool", stl.to_str().unwrap(), "--once"]);
    let events: Vec<Value> = std::iter::from_fn(|| again.lines.recv_timeout(Duration::from_secs(60)).ok()).collect();
    assert!(again.child.wait().unwrap().success());
    assert_eq!(events.len(), 4, "{events:#?}");
    assert!(events[..3].iter().all(|e| e["event"] == "skipped"));
    assert_eq!((&events[3]["done"], &events[3]["skipped"]), (&Value::from(0), &Value::from(3)));
}

#[test]
fn without_tool_or_camera_it_says_so_and_existing_files_are_taken_once() {
    let dir = tempfile::tempdir().unwrap();
    let (_, files) = set(dir.path());
    let folder = dir.path().join("robot");
    std::fs::create_dir(&folder).unwrap();
    std::fs::copy(&files[0], folder.join("a_1.pt")).unwrap();
    std::fs::copy(&files[1], folder.join("pattern_36_data_2.pt")).unwrap();
    std::fs::write(folder.join("notes.txt"), "x").unwrap();
    let out = dir.path().join("out");
    let args = ["watch", folder.to_str().unwrap(), "--once", "--steps", "1", "--out", out.to_str().unwrap()];
    let start = Instant::now();
    let done = succeed(&args, dir.path());
    let text = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(text.contains("2 done, 0 skipped, 0 failed"), "{text}");
    let read = |name: &str| -> Value { serde_json::from_slice(&std::fs::read(out.join(name)).unwrap()).unwrap() };
    assert!(read("a_1.t2t.json")["no_pose"].as_str().unwrap().contains("--tool"));
    assert!(read("pattern_36_data_2.t2t.json")["no_pose"].as_str().unwrap().contains("rig.pt"));
    assert_eq!(npz::read(&out.join("a_1.t2t.npz")).unwrap()["imprint_right"].shape, [140, 175]);
    eprintln!("two touches once: {:.1} s with loading", start.elapsed().as_secs_f64());
    // Another recipe is another result.
    let other = run(&[&args[..4], &["2"], &args[5..]].concat(), dir.path());
    assert!(String::from_utf8_lossy(&other.stdout).contains("2 done"), "{}", error_text(&other));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3, "nothing is written beside the touches");
    let none = run(&["watch", dir.path().join("none").to_str().unwrap(), "--once"], dir.path());
    assert_eq!(none.status.code(), Some(2));
    let leak = run(&["watch", folder.to_str().unwrap(), "--once", "--mask", "cad"], dir.path());
    assert!(error_text(&leak).contains("true pose"), "{}", error_text(&leak));
}

/// A file of something else that sorts first is said, and hides nothing: neither what is there nor what comes later.
#[cfg(unix)]
#[test]
fn a_foreign_file_neither_hides_touches_nor_goes_unsaid() {
    let dir = tempfile::tempdir().unwrap();
    let (_, files) = set(dir.path());
    let folder = dir.path().join("robot");
    std::fs::create_dir(&folder).unwrap();
    let watch = Watch::start(&folder, dir.path(), &[]);
    std::fs::copy(&files[0], folder.join("grasp_1.pt")).unwrap();
    assert_eq!(watch.next()["name"], "grasp_1");
    std::fs::copy(bubble(&files[0]), folder.join("calibration.pt")).unwrap();
    let foreign = watch.next();
    assert_eq!(
        (&foreign["event"], &foreign["name"]),
        (&Value::from("error"), &Value::from("calibration")),
        "{foreign}"
    );
    assert!(foreign["error"].as_str().unwrap().contains("gelslim"), "{foreign}");
    std::fs::copy(&files[1], folder.join("grasp_2.pt")).unwrap();
    let later = watch.next();
    assert_eq!((&later["event"], &later["name"]), (&Value::from("done"), &Value::from("grasp_2")), "{later}");

    // Touches of another kind in the same folder are left out, and that is said.
    std::fs::write(folder.join("x_gelslim.png"), "a picture").unwrap();
    let other = watch.next();
    assert_eq!(other["event"], "trouble", "{other}");
    assert!(other["error"].as_str().unwrap().contains("pictures of touches"), "{other}");
    std::fs::remove_file(folder.join("x_gelslim.png")).unwrap();
    assert_eq!(watch.next()["event"], "recovered");
    // So is a folder that was emptied.
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "pt") {
            std::fs::remove_file(path).unwrap();
        }
    }
    let emptied = watch.next();
    assert_eq!(emptied["event"], "trouble", "{emptied}");
    assert!(emptied["error"].as_str().unwrap().contains("no touch is found"), "{emptied}");
    std::fs::copy(&files[2], folder.join("grasp_3.pt")).unwrap();
    let events = [watch.next(), watch.next()];
    assert!(
        events.iter().any(|e| e["event"] == "recovered") && events.iter().any(|e| e["name"] == "grasp_3"),
        "{events:?}"
    );
    watch.stop();
}
