//! The rules of ARCHITECTURE.md that the compiler cannot check: who may name whom, and how long a file may be.

use std::path::{Path, PathBuf};

/// What must not be named in the code of a layer, each with the reason.
const FORBIDDEN: &[(&str, &[&str], &str)] = &[
    (
        "domain",
        &[
            "std::fs",
            "std::thread",
            "std::time",
            "std::env",
            "eframe",
            "egui",
            "wgpu",
            "rten",
            "ort::",
            "rfd",
            "crate::io",
            "crate::infer",
            "crate::app",
            "crate::gpu",
            "crate::ui",
            "crate::headless",
        ],
        "the science is pure",
    ),
    (
        "io",
        &["eframe", "egui", "wgpu", "crate::infer", "crate::app", "crate::gpu", "crate::ui"],
        "files know no model and no window",
    ),
    ("infer", &["eframe", "egui", "wgpu", "crate::app", "crate::gpu", "crate::ui"], "models know no window"),
    (
        "app",
        &["eframe", "egui", "wgpu", "rten::", "ort::", "crate::gpu", "crate::ui"],
        "the application model has no window",
    ),
    (
        "gpu",
        &["egui::", "rfd", "rten", "ort::", "crate::app", "crate::ui", "crate::io", "crate::infer"],
        "the renderer knows domain types only",
    ),
    ("ui", &["std::fs", "rten::", "ort::", "kiddo"], "panes look up, format and draw"),
];

/// Longest file, in lines, tests included.
const MAX_LINES: usize = 700;

fn rust_files(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// The code of a file: no comment lines, nothing from the first test module on.
fn code(text: &str) -> String {
    let end = text.find("#[cfg(test)]").unwrap_or(text.len());
    text[..end].lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// Whether `name` stands in the code as a name of its own: `Sort::` does not name `ort::`.
fn is_named(code: &str, name: &str) -> bool {
    let inside = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(name).any(|(at, _)| !code[..at].ends_with(inside))
}

#[test]
fn layers_only_point_downwards() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut broken = Vec::new();
    for (layer, names, why) in FORBIDDEN {
        let mut files = vec![src.join(format!("{layer}.rs"))];
        if src.join(layer).is_dir() {
            rust_files(&src.join(layer), &mut files);
        }
        for file in files {
            let code = code(&std::fs::read_to_string(&file).unwrap());
            for name in names.iter().filter(|n| is_named(&code, n)) {
                broken.push(format!("{} names {name}: {why}", file.display()));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// How a file could be opened without asking what it is.
const OPENERS: &[&str] = &["fs::read(", "fs::read_to_string(", "File::open(", "ImageReader::open("];
/// Who may: the one that asks, and the one that flushes a folder.
const MAY_OPEN: &[&str] = &["io/files.rs", "io/atomic.rs"];

#[test]
fn readers_open_ordinary_files_only() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    for layer in ["io", "infer", "app"] {
        rust_files(&src.join(layer), &mut files);
    }
    let mut broken = Vec::new();
    for file in files.iter().filter(|file| !MAY_OPEN.iter().any(|may| file.ends_with(may))) {
        let code = code(&std::fs::read_to_string(file).unwrap());
        for name in OPENERS.iter().filter(|name| is_named(&code, name)) {
            broken.push(format!("{} calls {name}...): use io::files, which refuses pipes and devices", file.display()));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn files_can_be_held_in_the_head() {
    let mut files = Vec::new();
    for dir in ["src", "tests", "benches", "examples"] {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join(dir);
        if dir.is_dir() {
            rust_files(&dir, &mut files);
        }
    }
    assert!(files.len() > 30, "the scan found too few files to mean anything");
    let long: Vec<String> = files
        .iter()
        .filter_map(|f| {
            let lines = std::fs::read_to_string(f).unwrap().lines().count();
            (lines > MAX_LINES).then(|| format!("{} has {lines} lines", f.display()))
        })
        .collect();
    assert!(long.is_empty(), "split these (limit {MAX_LINES}):\n{}", long.join("\n"));
}

#[test]
fn assets_stay_small() {
    fn bytes(dir: &Path) -> u64 {
        std::fs::read_dir(dir)
            .unwrap()
            .map(|e| {
                let path = e.unwrap().path();
                if path.is_dir() { bytes(&path) } else { path.metadata().unwrap().len() }
            })
            .sum()
    }
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    assert!(bytes(&assets) < 30_000_000, "assets must stay under 30 MB");
}
