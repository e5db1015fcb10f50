//! The words of the program: collected for a person to read through, and each of its letters has a glyph.

use std::fmt::Write as _;
use std::path::Path;

use eframe::egui::{Context, FontId, RawInput};

use crate::layers::code;
use crate::support::rust_files;

/// Where text comes from that a window or a terminal shows.
const FOLDERS: &[&str] = &["src/ui", "src/app", "src/headless", "crates/pipeline/src", "crates/core/src"];

/// The string literals of a piece of code, as the compiler reads them; a raw one has no escapes.
fn literals(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut letters = code.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            // A quote or a backslash between apostrophes is a character.
            '\'' if letters.next_if_eq(&'\\').is_some() => drop(letters.next()),
            '\'' => drop(letters.next_if_eq(&'"')),
            '"' => {
                let mut text = String::new();
                while let Some(letter) = letters.next().filter(|letter| *letter != '"') {
                    match letter {
                        '\\' if letters.next_if_eq(&'\n').is_some() => {
                            while letters.next_if(|letter| letter.is_whitespace()).is_some() {}
                        }
                        '\\' => text.extend(letters.next().map(|letter| if letter == 'n' { ' ' } else { letter })),
                        _ => text.push(letter),
                    }
                }
                found.push(text);
            }
            _ => {}
        }
    }
    found
}

/// Whether a literal is text for a reader, and no key or path.
fn is_text(literal: &str) -> bool {
    let words = literal.split_whitespace().filter(|word| word.chars().filter(char::is_ascii_alphabetic).count() > 1);
    literal.starts_with(|letter: char| letter.is_uppercase()) || words.count() > 1
}

#[test]
fn every_word_is_in_one_file_to_read_and_every_letter_has_a_glyph() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let ctx = Context::default();
    touch2touch::ui::theme::install(&ctx);
    ctx.run_ui(RawInput::default(), |ui| drop(ui.label("a"))).textures_delta.clear();
    let (mut all, mut lines, mut lacking) = (String::new(), 0, Vec::new());
    for folder in FOLDERS {
        let mut files = rust_files(folder);
        files.sort();
        for file in files.iter().filter(|file| !file.ends_with("tests.rs")) {
            let literals = literals(&code(&std::fs::read_to_string(file).unwrap()));
            let texts: Vec<&String> = literals.iter().filter(|literal| is_text(literal)).collect();
            if !texts.is_empty() {
                writeln!(all, "\n{}", file.strip_prefix(root).unwrap().display()).unwrap();
            }
            for text in texts {
                writeln!(all, "    {text}").unwrap();
                lines += 1;
                let shown = |letter: char| ctx.fonts_mut(|fonts| fonts.has_glyph(&FontId::default(), letter));
                lacking.extend(text.chars().filter(|letter| !shown(*letter)).map(|letter| (letter, text.clone())));
            }
        }
    }
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("words.txt");
    std::fs::write(&file, all).unwrap();
    println!("{lines} texts in {}", file.display());
    assert!(lines > 1000, "the scan sees too little: {lines}");
    assert!(lacking.is_empty(), "letters that the window cannot draw: {lacking:?}");
}

#[test]
fn literals_are_read_as_the_compiler_reads_them() {
    let code = r#"f('"', "a b", '\'', "c \"d\" \
        e\nf"); g::<'a>("h")"#;
    assert_eq!(literals(code), ["a b", "c \"d\" e f", "h"]);
}
