//! File names for pair names: reversible, and different for different pairs.
//!
//! Two forms. [`label`] names what is kept about a pair (masks, reviews); it also stays apart on file systems that do
//! not tell capitals from small letters. [`output`] names what is written for people (predictions, results) and keeps
//! simple names readable; where such a file system makes two of them one, [`Outputs`] refuses.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::error::FileError;

/// Part of the name of every file that is written beside a touch; such files are never taken for touches.
pub const OUTPUT_MARK: &str = ".t2t.";

/// True for a file name that this program gives to files beside touches.
pub(crate) fn is_output(name: &str) -> bool {
    name.contains(OUTPUT_MARK)
}

/// Longest label; file systems end at 255 bytes and suffixes are added.
const LONGEST_LABEL: usize = 180;
/// Longest name of an output, likewise.
const LONGEST_OUTPUT: usize = 220;

/// Lower-case letters, digits, `-` and `_` stay; every other byte becomes `%xx`. Capital letters are escaped too,
/// because some file systems do not tell them from small ones. Very long names end in `%%` and a hash.
pub fn label(pair: &str) -> String {
    let mut out = String::with_capacity(pair.len());
    for byte in pair.bytes() {
        match byte {
            b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' => out.push(char::from(byte)),
            _ => push_escaped(&mut out, byte),
        }
    }
    shortened(out, pair, LONGEST_LABEL)
}

/// The pair behind [`label`]; `None` for shortened names and for what it never returns.
pub(crate) fn pair_of_label(name: &str) -> Option<String> {
    let pair = unescaped(name)?;
    (label(&pair) == name).then_some(pair)
}

/// The stem of the files that are written for a pair: its name with `__` for `/`. What would make that ambiguous is
/// escaped as `%xx`: an underscore beside another one or beside a `/`, `%`, `\`, a leading dot, and what no name on
/// some system may hold. Very long names end in `%%` and a hash.
pub fn output(pair: &str) -> String {
    let mut out = String::with_capacity(pair.len() + 8);
    let mut before = None;
    let mut chars = pair.chars().peekable();
    while let Some(c) = chars.next() {
        let joins = |c: Option<char>| matches!(c, Some('_' | '/'));
        match c {
            '/' => out.push_str("__"),
            '_' if joins(before) || joins(chars.peek().copied()) => push_escaped(&mut out, b'_'),
            '.' if before.is_none() => push_escaped(&mut out, b'.'),
            '%' | '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|' | '\0'..='\x1f' | '\x7f' => {
                push_escaped(&mut out, c as u8);
            }
            _ => out.push(c),
        }
        before = Some(c);
    }
    shortened(out, pair, LONGEST_OUTPUT)
}

fn push_escaped(out: &mut String, byte: u8) {
    out.push_str(&format!("%{byte:02x}"));
}

fn shortened(mut out: String, pair: &str, longest: usize) -> String {
    if out.len() > longest {
        let hash = super::digest::sha256(pair.as_bytes());
        let end = (0..=longest - hash.len() - 2).rev().find(|&at| out.is_char_boundary(at)).unwrap_or(0);
        out.truncate(end);
        out.push_str("%%");
        out.push_str(&hash);
    }
    out
}

fn unescaped(name: &str) -> Option<String> {
    let mut out = Vec::with_capacity(name.len());
    let mut bytes = name.bytes();
    while let Some(byte) = bytes.next() {
        if byte == b'%' {
            let digits = [bytes.next()?, bytes.next()?];
            out.push(u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?);
        } else {
            out.push(byte);
        }
    }
    String::from_utf8(out).ok()
}

/// A stem and an ending, which stays behind whatever dots are in the name.
pub fn with_ending(stem: &Path, ending: &str) -> PathBuf {
    let mut name = stem.file_name().map(std::ffi::OsStr::to_os_string).unwrap_or_default();
    name.push(ending);
    stem.with_file_name(name)
}

/// The names of the outputs in one folder, each given to one pair only.
#[derive(Debug)]
pub struct Outputs {
    folder: PathBuf,
    /// True where the folder takes capitals and small letters for the same.
    folds_case: bool,
    /// The pair that has a name, by the name as the folder sees it.
    given: BTreeMap<String, String>,
}

impl Outputs {
    /// The names in `folder`, which is made if it is not there.
    ///
    /// # Errors
    /// Whatever the disk says.
    pub fn new(folder: &Path) -> Result<Self, FileError> {
        let io = |err| FileError::io(folder, "cannot write to the output folder", err);
        std::fs::create_dir_all(folder).map_err(io)?;
        let probe = super::atomic::probe(folder).map_err(io)?;
        let name = probe.path().file_name().map(|name| name.to_string_lossy().to_uppercase()).unwrap_or_default();
        let folds_case = folder.join(name).exists();
        Ok(Self { folder: folder.to_owned(), folds_case, given: BTreeMap::new() })
    }

    /// The path, without an ending, of the files of `pair`.
    ///
    /// # Errors
    /// [`FileError`] if another pair has it.
    pub fn stem(&mut self, pair: &str) -> Result<PathBuf, FileError> {
        let name = output(pair);
        let seen = if self.folds_case { name.to_lowercase() } else { name.clone() };
        let first = self.given.entry(seen).or_insert_with(|| pair.to_owned());
        if first != pair {
            let what = format!(
                "the files of the pairs {first:?} and {pair:?} would be the same in this folder, which does not tell capitals \
                 from small letters; write to another disk, or rename one of the pairs"
            );
            return Err(FileError::new(&self.folder, what, ""));
        }
        Ok(self.folder.join(name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The pair behind [`output`]; `None` for shortened names and for what it never returns.
    fn pair_of_output(stem: &str) -> Option<String> {
        let pair = unescaped(&stem.replace("__", "/"))?;
        (output(&pair) == stem).then_some(pair)
    }

    #[test]
    fn names_that_look_alike_stay_apart() {
        let names = ["a/b", "a_b", "a%2fb", "A/b", "a.b", "a b", "", "..", "ä", "a\u{308}"];
        let mut escaped: Vec<String> = names.iter().map(|n| label(n).to_lowercase()).collect();
        escaped.sort();
        escaped.dedup();
        assert_eq!(escaped.len(), names.len());
        let long = |c: &str| label(&format!("{}{c}", "x/".repeat(300)));
        assert!(long("a").len() <= LONGEST_LABEL && long("a") != long("b"));
        assert_eq!(pair_of_label(&long("a")), None);
    }

    #[test]
    fn simple_outputs_keep_their_names_and_ambiguous_ones_stay_apart() {
        for (pair, name) in [
            ("pattern_31_rod/data_0", "pattern_31_rod__data_0"),
            ("test_only/Pattern_05_data_7", "test_only__Pattern_05_data_7"),
            ("grasp 1.b", "grasp 1.b"),
            ("a__b", "a%5f%5fb"),
            ("a_/b", "a%5f__b"),
            ("a/_b", "a__%5fb"),
            ("a\\b", "a%5cb"),
            ("a%2fb", "a%252fb"),
            (".hidden", "%2ehidden"),
        ] {
            assert_eq!(output(pair), name);
            assert_eq!(pair_of_output(name).as_deref(), Some(pair));
        }
        let long = |c: &str| output(&format!("{}{c}", "ä/".repeat(300)));
        assert!(long("a").len() <= LONGEST_OUTPUT && long("a") != long("b"));
        assert_eq!(pair_of_output(&long("a")), None);
    }

    #[test]
    fn a_folder_gives_each_name_once() {
        let dir = tempfile::tempdir().unwrap();
        let mut outputs = Outputs::new(&dir.path().join("new")).unwrap();
        let [slash, plain] = ["a/b", "a__b"].map(|pair| outputs.stem(pair).unwrap());
        assert_ne!(slash, plain);
        assert_eq!(outputs.stem("a/b").unwrap(), slash, "the same pair has the same files");
        assert_eq!(std::fs::read_dir(dir.path().join("new")).unwrap().count(), 0, "nothing is left of the test");
        // As on a disk that does not tell capitals.
        outputs.folds_case = true;
        let (small, large) = (outputs.stem("x/y"), outputs.stem("X/y"));
        assert!(small.is_ok() && large.unwrap_err().to_string().contains("\"X/y\""));
    }

    proptest! {
        #[test]
        fn outputs_round_trip(name in "[ab_/%.\\\\]{0,12}|\\PC{0,30}") {
            let escaped = output(&name);
            prop_assert!(escaped.len() > 200 || pair_of_output(&escaped).as_deref() == Some(name.as_str()));
            prop_assert!(!escaped.contains(['/', '\\']));
        }
    }
}
