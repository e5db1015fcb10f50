//! The pages that people read, taken apart for the tests that hold them against the program.

use std::path::{Path, PathBuf};

/// Root of the repository.
pub(super) fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every page by its path from the root, with its text: README.md, ARCHITECTURE.md, those of docs, and training/README.md.
pub(super) fn all() -> Vec<(String, String)> {
    let docs = std::fs::read_dir(repository().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = docs.filter(|path| path.extension().is_some_and(|e| e == "md")).collect();
    files.extend(["README.md", "ARCHITECTURE.md", "training/README.md"].map(|page| repository().join(page)));
    files.sort();
    let read = |path: PathBuf| {
        let name = path.strip_prefix(repository()).unwrap().display().to_string();
        (name, std::fs::read_to_string(&path).unwrap())
    };
    files.into_iter().map(read).collect()
}

/// The commands in the code fences (those of drawings, data and Python have none), without what follows ` # `, and the rest of
/// the text.
pub(super) fn fenced(text: &str) -> (Vec<String>, String) {
    let (mut lines, mut rest, mut inside, mut no_commands) = (Vec::new(), String::new(), false, false);
    for line in text.lines() {
        if let Some(kind) = line.trim_start().strip_prefix("```") {
            inside = !inside;
            no_commands = matches!(kind, "text" | "json" | "python");
        } else if inside && no_commands {
            // Letters that draw something, or the content of a file.
        } else if inside {
            let command = line.split(" #").next().unwrap().trim();
            lines.extend((!command.is_empty()).then(|| command.to_owned()));
        } else {
            rest += line;
            rest.push('\n');
        }
    }
    (lines, rest)
}

/// The prose of a page: no fences, no code within sentences.
pub(super) fn prose(text: &str) -> String {
    fenced(text).1.split('`').step_by(2).collect::<Vec<_>>().join(" ")
}
