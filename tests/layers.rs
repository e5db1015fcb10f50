//! The rules of ARCHITECTURE.md that the compiler cannot check: who may name whom, and how long a file may be.

mod circles;
mod skips;

use std::path::{Path, PathBuf};

use super::support::{files_below, rust_files};

/// What the code in a folder must not name, each with the reason. What lies in another crate needs no line where the
/// manifest does not list it.
const FORBIDDEN: &[(&str, &[&str], &str)] = &[
    ("crates/core/src", &["std::fs", "std::thread", "std::time", "std::env"], "the science is pure"),
    ("crates/pipeline/src", &["clap"], "the job knows no command line"),
    (
        "src/app",
        &["eframe", "egui", "wgpu", "crate::gpu", "crate::ui", "crate::headless"],
        "the application model has no window",
    ),
    (
        "src/gpu",
        &["egui::", "rfd", "crate::app", "crate::ui", "touch2touch_pipeline", "crate::headless"],
        "the renderer knows domain types only",
    ),
    (
        "src/spatial",
        &["egui::", "rfd", "crate::app", "crate::ui", "crate::headless"],
        "what a pair shows in 3D knows the job and the renderer",
    ),
    ("src/headless", &["eframe", "egui", "wgpu"], "verbs have no window"),
    ("src/ui", &["std::fs", "crate::headless"], "panes look up, format and draw"),
];

/// What the layers of the crate of the job may name of it, each with the reason.
const MAY_NAME: &[(&str, &[&str], &str)] = &[
    ("crates/pipeline/src/io", &["io"], "files know no model"),
    ("crates/pipeline/src/infer", &["io", "infer"], "models know nothing of the way from a touch to a pose"),
];

/// The engines, which only `infer` runs.
const ENGINES: &[&str] = &["rten::", "ort::"];

/// Longest file, in lines, tests included.
const MAX_LINES: usize = 700;

/// The code of a file: no comment lines, and nothing that is only compiled for tests, wherever it stands.
pub(crate) fn code(text: &str) -> String {
    let mut out = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.trim() == "#[cfg(test)]" {
            // The item after it: one line, or up to the brace that closes it.
            let mut depth = 0i32;
            for line in lines.by_ref() {
                let attribute = depth == 0 && line.trim_start().starts_with("#[");
                depth += line.matches('{').count() as i32 - line.matches('}').count() as i32;
                if depth <= 0 && !attribute {
                    break;
                }
            }
        } else if !line.trim_start().starts_with("//") {
            out.push(line);
        }
    }
    out.join("\n")
}

/// The code with each `super::` spelt out: `super::super::keys` in `src/app/results/pose.rs` is `crate::app::keys`.
fn spelt_out(file: &Path, code: &str) -> String {
    let module: Vec<String> = file.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
    let module = module.rsplit(|part| part == "src").next().unwrap();
    let mut out = String::new();
    let mut rest = code;
    while let Some(at) = rest.find("super::") {
        out += &rest[..at];
        rest = &rest[at..];
        let mut up = 0;
        while let Some(after) = rest.strip_prefix("super::") {
            (up, rest) = (up + 1, after);
        }
        let parents = &module[..module.len().saturating_sub(up)];
        out += "crate::";
        for parent in parents {
            out += parent;
            out += "::";
        }
    }
    out + rest
}

/// Whether `name` stands in the code as a name of its own: `Sort::` does not name `ort::`.
fn is_named(code: &str, name: &str) -> bool {
    let inside = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(name).any(|(at, _)| !code[..at].ends_with(inside))
}

/// The code of the files of a folder and of the file of its name, with each name spelt out; tests left out.
fn layer(folder: &str) -> Vec<(PathBuf, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut files = rust_files(&folder);
    files.extend(Some(folder.with_extension("rs")).filter(|file| file.is_file()));
    files.retain(|file| !file.ends_with("tests.rs"));
    assert!(files.len() > 3, "{}: the scan sees too little", folder.display());
    let read = |file: PathBuf| {
        let code = spelt_out(&file, &code(&std::fs::read_to_string(&file).unwrap()));
        (file, code)
    };
    files.into_iter().map(read).collect()
}

#[test]
fn layers_only_point_downwards() {
    let mut broken = Vec::new();
    for (folder, names, why) in FORBIDDEN {
        for (file, code) in layer(folder) {
            for name in names.iter().filter(|name| is_named(&code, name)) {
                broken.push(format!("{} names {name}: {why}", file.display()));
            }
        }
    }
    for (folder, may, why) in MAY_NAME {
        for (file, code) in layer(folder) {
            for (at, root) in code.match_indices("crate::") {
                let name = code[at + root.len()..].split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap();
                if !may.contains(&name) {
                    broken.push(format!("{} names crate::{name}: {why}", file.display()));
                }
            }
        }
    }
    for (file, code) in layer("crates/pipeline/src").iter().filter(|(file, _)| !file.iter().any(|part| part == "infer"))
    {
        for name in ENGINES.iter().filter(|name| is_named(code, name)) {
            broken.push(format!("{} names {name}: only `infer` runs engines", file.display()));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn what_is_only_for_tests_is_left_out_and_nothing_else() {
    let text = "#[cfg(test)]\nmod testing;\nuse a::b;\n#[cfg(test)]\nfn c() {\n    d();\n}\nfn e() {}\n// f\n";
    assert_eq!(code(text), "use a::b;\nfn e() {}");
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/app/results/pose.rs");
    assert_eq!(
        spelt_out(&file, "use super::super::keys::X; super::y()"),
        "use crate::app::keys::X; crate::app::results::y()"
    );
}

/// How a file could be opened without asking what it is.
const OPENERS: &[&str] = &["fs::read(", "fs::read_to_string(", "File::open(", "ImageReader::open("];
/// Who may: the one that asks, and the one that flushes a folder.
const MAY_OPEN: &[&str] = &["io/files.rs", "io/atomic.rs"];

#[test]
fn readers_open_ordinary_files_only() {
    let files = ["crates/pipeline/src", "src/app"].map(rust_files).concat();
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
    let files = ["src", "crates", "tests", "benches", "examples"].map(rust_files).concat();
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
    let assets = files_below(&Path::new(env!("CARGO_MANIFEST_DIR")).join("assets"));
    let bytes: u64 = assets.iter().map(|file| file.metadata().unwrap().len()).sum();
    assert!(bytes < 30_000_000, "assets must stay under 30 MB");
}

#[test]
fn no_text_of_the_window_says_a_key_by_hand() {
    use strum::IntoEnumIterator as _;
    use touch2touch::app::action::Action;
    // Escape closes what covers the panes and Enter takes what was typed, whatever their actions are.
    let keys = Action::iter().flat_map(|action| action.keys().iter().copied());
    let keys: Vec<_> = keys.filter(|key| !matches!(key.key, "Esc" | "Enter")).collect();
    let mut filled = 0;
    for file in rust_files("src/ui") {
        let text = code(&std::fs::read_to_string(&file).unwrap());
        for key in &keys {
            let said = text.contains(&format!(" ({key})")) || (key.ctrl && text.contains(&key.to_string()));
            assert!(!said, "{}: {key} is said by hand; `Action::behind` says it", file.display());
        }
        for part in text.split("[[").skip(1) {
            let name = part.split("]]").next().unwrap_or_default();
            if name.chars().all(|c| c.is_ascii_lowercase() || c == '_') {
                assert!(name.parse::<Action>().is_ok(), "{}: [[{name}]] is no action", file.display());
                filled += 1;
            }
        }
    }
    assert!(filled > 20, "{filled}");
}
