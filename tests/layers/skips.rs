//! No test ends early without a word.
//!
//! What a machine may lack (reference data, a graphics adapter, PyTorch) is asked for through `tests/support.rs`, which
//! says on the terminal what was not tried, and fails instead where the check script demands it.

use std::path::Path;

use crate::support::rust_files;

/// What may stand to the right of `let Some(..) =` in a test that returns without it.
const ASKS: &[&str] = &[
    "shared(",
    "support::shared(",
    "support::gpu(",
    "support::openvino(",
    "support::python(",
    "support::torch(",
    "View::new(",
    "Rig::",
];

/// The body of each test of a file, with its name.
fn tests(text: &str) -> Vec<(&str, &str)> {
    let mut found = Vec::new();
    for (at, attribute) in text.match_indices("#[test]\n") {
        let rest = &text[at + attribute.len()..];
        let indent = rest.len() - rest.trim_start_matches(' ').len();
        let end = format!("\n{}}}\n", " ".repeat(indent));
        if let (Some(begin), Some(length)) = (rest.find("fn "), rest.find(&end)) {
            let name = rest[begin + 3..].split('(').next().unwrap_or_default();
            found.push((name, &rest[begin..length.max(begin)]));
        }
    }
    found
}

/// Whether a test's body returns other than where [`ASKS`] had nothing to give.
fn returns_silently(body: &str) -> bool {
    let is_word = |at: usize| {
        let inside = |c: char| c.is_alphanumeric() || c == '_';
        !body[..at].ends_with(inside) && !body[at + "return".len()..].starts_with(inside)
    };
    body.match_indices("return").filter(|(at, _)| is_word(*at)).any(|(at, _)| {
        let statement = body[..at].rfind("let Some(").map_or("", |begin| &body[begin..at]);
        let asked = statement.split_once(" = ").map_or("", |(_, asked)| asked.trim_start());
        let ends = statement.trim_end().ends_with("else {") && !statement.contains(';');
        !(ends && ASKS.iter().any(|ask| asked.starts_with(ask)))
    })
}

#[test]
fn a_test_that_cannot_be_tried_says_so() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files = ["src", "crates", "tests"].map(rust_files).concat();
    let mut all = 0;
    let mut silent = Vec::new();
    // This file has examples of what it refuses.
    for file in files.into_iter().filter(|file| !file.ends_with("layers/skips.rs")) {
        let text = std::fs::read_to_string(&file).unwrap();
        for (name, body) in tests(&text) {
            all += 1;
            if returns_silently(body) {
                silent.push(format!("{}: {name} returns early: ask through tests/support.rs", file.display()));
            }
        }
        // What hands a missing adapter on must have asked for it there.
        for (at, _) in text.match_indices(") -> Option<Self> {").chain(text.match_indices(") -> Option<(Self,")) {
            let body = text[at..].split("\n    }\n").next().unwrap_or_default();
            let asks = ["support::gpu()?", "Self::new(", "Self::live("].iter().any(|ask| body.contains(ask));
            if file.starts_with(root.join("tests")) && !asks {
                silent.push(format!("{}: an Option<Self> that did not ask support::gpu()", file.display()));
            }
        }
    }
    assert!(all > 500, "the scan found too few tests to mean anything: {all}");
    assert!(silent.is_empty(), "{}", silent.join("\n"));
}

#[test]
fn a_silent_return_is_found() {
    let text = "#[test]\nfn a() {\n    if !there() {\n        return;\n    }\n}\n#[test]\nfn b() {\n    let returned = 1;\n}\n";
    let found: Vec<_> = tests(text).into_iter().map(|(name, body)| (name, returns_silently(body))).collect();
    assert_eq!(found, [("a", true), ("b", false)]);
    for (body, silent) in [
        ("let Some(x) = support::shared(\"a\") else { return };", false),
        ("let Some((mut rig, gate)) = Rig::gated(\n        SIZE,\n    ) else {\n        return;\n    };", false),
        ("let Some(x) = std::env::var_os(\"X\") else { return };", true),
        ("let Some(x) = support::shared(\"a\") else { return };\n    if x.is_dir() { return }", true),
    ] {
        assert_eq!(returns_silently(body), silent, "{body}");
    }
}
